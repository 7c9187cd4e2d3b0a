//! Devices in software that answer real commands with real bytes.
//!
//! Neither simulator does any input or output, keeps time or starts a thread.
//! The caller passes in the bytes a client sent, gets the bytes to send back,
//! and calls `tick` once per sample period; a pseudo-terminal, a socket or a
//! test sits around it.

mod cyberglove;
mod fastrak;

pub use cyberglove::CyberGlove;
pub use fastrak::Fastrak;
