//! What can go wrong between a driver and its device.

use std::io;
use std::sync::Arc;
use std::time::Duration;

/// Why a device could not be started.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The port failed.
    #[error("the port failed: {0}")]
    Io(Arc<io::Error>),
    /// The device does not answer a command, or not with what it should.
    #[error("no answer to `{command}` (heard: `{heard}`)")]
    NoAnswer {
        /// The command, unprintable bytes escaped.
        command: String,
        /// The first bytes that came instead.
        heard: String,
    },
    /// The device answers that it cannot do what is asked.
    #[error("the device answers `{answer}` to `{command}`: {meaning}")]
    Refused {
        /// The command, unprintable bytes escaped.
        command: String,
        /// Its answer, likewise.
        answer: String,
        /// What that means.
        meaning: &'static str,
    },
    /// The driver was told to stop meanwhile.
    #[error("the driver was stopped")]
    Stopped,
}

impl From<io::Error> for StartError {
    fn from(error: io::Error) -> Self {
        Self::Io(Arc::new(error))
    }
}

/// Why a driver has no device at the moment.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The port cannot be opened.
    #[error("the port cannot be opened: {0}")]
    Connect(Arc<io::Error>),
    /// The device does not start.
    #[error("the device does not start: {0}")]
    Start(StartError),
    /// The port failed while samples arrived.
    #[error("the connection was lost: {0}")]
    Lost(Arc<io::Error>),
    /// The port is open, but no sample has come for too long.
    #[error("no sample for {:.1} s, though {bytes} bytes came", silence.as_secs_f64())]
    Silent {
        /// How long.
        silence: Duration,
        /// Bytes that arrived meanwhile and made no sample.
        bytes: u64,
    },
}
