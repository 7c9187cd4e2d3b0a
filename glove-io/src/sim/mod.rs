//! Devices in software that answer real commands with real bytes.
//!
//! Neither simulator does any input or output, keeps time or starts a thread.
//! The caller passes in the bytes a client sent, gets the bytes to send back,
//! and calls `tick` once per sample period; a pseudo-terminal, a socket or a
//! test sits around it.

mod cyberglove;
mod fastrak;
#[cfg(all(feature = "host", unix))]
pub mod host;

pub use cyberglove::CyberGlove;
pub use fastrak::Fastrak;

/// A device in software.
pub trait Device {
    /// Takes bytes from the client and appends the answers to `reply`.
    fn receive(&mut self, bytes: &[u8], reply: &mut Vec<u8>);

    /// Lets one period pass and appends what the device sends at its end.
    fn tick(&mut self, reply: &mut Vec<u8>);

    /// Seconds between two calls of [`tick`](Self::tick), as the device is set now;
    /// more than zero.
    fn tick_period_s(&self) -> f64;
}

impl Device for CyberGlove {
    fn receive(&mut self, bytes: &[u8], reply: &mut Vec<u8>) {
        Self::receive(self, bytes, reply);
    }

    fn tick(&mut self, reply: &mut Vec<u8>) {
        Self::tick(self, reply);
    }

    fn tick_period_s(&self) -> f64 {
        self.sample_period().as_secs_f64()
    }
}

impl Device for Fastrak {
    fn receive(&mut self, bytes: &[u8], reply: &mut Vec<u8>) {
        Self::receive(self, bytes, reply);
    }

    fn tick(&mut self, reply: &mut Vec<u8>) {
        Self::tick(self, reply);
    }

    fn tick_period_s(&self) -> f64 {
        1.0 / 120.0
    }
}
