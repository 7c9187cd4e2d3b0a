//! Drivers: one thread per device, from an open port to the newest sample.
//!
//! A [`Driver`] opens a port ([`serial`], [`tcp_client`], [`tcp_listener`], or a
//! closure of your own), starts the device, and hands out its samples. When the
//! device falls silent or the port fails, it closes the port, waits, opens it
//! again *by name* and starts the device anew, waiting longer after every
//! failure. No runtime is imposed; whoever wants samples asks for
//!
//! * the newest one ([`Driver::newest`], or [`Driver::wait_newer`] to sleep until
//!   there is another), for a render or haptic loop;
//! * every one ([`Driver::subscribe`]), through a bounded channel that counts
//!   what it had to drop, for recorders and filters.
//!
//! | device | samples | protocol |
//! |---|---|---|
//! | [`CyberGlove`] | [`cyberglove::Record`](crate::cyberglove::Record) | `G` or `S`, all models |
//! | [`CyberGlove3`] | [`cyberglove::Packet`](crate::cyberglove::Packet) | `1E…`, `1S` of the III |
//! | [`Fastrak`] | [`fastrak::Record`](crate::fastrak::Record) | `P` or `C` |
//!
//! A [`SessionRecorder`] writes all bytes of a session to one file, and [`Replay`] turns
//! such a file into the same samples again.
//!
//! # Example
//!
//! ```no_run
//! use std::time::Duration;
//! use glove_io::driver::{CyberGlove, Driver, Options, serial};
//!
//! let glove = Driver::spawn(serial("/dev/ttyUSB0", 115_200), CyberGlove::default(), Options::default())?;
//! let mut last = None;
//! while let Some(sample) = glove.wait_newer(last, Duration::from_secs(5)) {
//!     println!("{:?}", sample.value.sensors());
//!     last = Some(sample.sequence);
//! }
//! glove.stop();
//! # Ok::<(), std::io::Error>(())
//! ```

mod cyberglove;
mod error;
mod fastrak;
mod line;
mod port;
mod record;
mod replay;
mod samples;
mod thread;

pub use cyberglove::{CyberGlove, CyberGlove3};
pub use error::{DriverError, StartError};
pub use fastrak::Fastrak;
pub use line::{Event, Line, Tap};
pub use port::{Connect, Port, READ_TIMEOUT, serial, tcp_client, tcp_listener};
pub use record::SessionRecorder;
pub use replay::{Replay, ReplayError, Replayed};
pub use samples::{Stamped, State, Status};
pub use thread::{Backoff, Driver, Options};

use crate::Counters;
use crate::recording::raw::DeviceDescription;

/// A device as a driver sees it: how it is started, asked, and understood.
pub trait Device: Send + 'static {
    /// What it measures.
    type Sample: Copy + Send + 'static;

    /// What it is, in recordings.
    const KIND: &'static str;

    /// Brings the device into the state in which samples flow, whatever an
    /// earlier program left it in. `attempt` counts from 0 the tries at an open port
    /// since the last sample; a device may need stronger means after some.
    ///
    /// # Errors
    ///
    /// Any [`StartError`]; the driver closes the port and tries again later.
    fn start(&mut self, line: &mut Line<'_>, attempt: u32) -> Result<(), StartError>;

    /// The command that asks for the next sample, if the device does not stream.
    fn request(&self) -> Option<&'static [u8]>;

    /// The command that ends a stream, sent when the driver stops.
    fn end(&self) -> &'static [u8];

    /// Takes received bytes and hands out the samples they complete.
    fn receive(&mut self, bytes: &[u8], sink: &mut dyn FnMut(Self::Sample));

    /// Bytes held back that may become part of a sample.
    fn pending(&self) -> usize;

    /// Statistics since the device was started last.
    fn counters(&self) -> Counters;

    /// How the device was started: what a replay needs to understand its bytes.
    fn description(&self) -> DeviceDescription;

    /// A device that has been started as described.
    ///
    /// # Errors
    ///
    /// The setting that is missing or makes no sense.
    fn from_description(description: &DeviceDescription) -> Result<Self, ReplayError>
    where
        Self: Sized;

    /// Which of up to four sources a sample is of; the driver keeps the newest of
    /// each.
    fn source(_sample: &Self::Sample) -> usize {
        0
    }
}
