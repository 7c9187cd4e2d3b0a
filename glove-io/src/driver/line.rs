//! Asking and listening during the start-up of a device.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::error::StartError;
use super::port::Port;
use crate::recording::raw::DeviceDescription;

/// Bytes taken from a port at once: more than any device sends in 20 ms.
pub(super) const PIECE: usize = 4096;

/// The most bytes kept while waiting for an answer.
const LONGEST_ANSWER: usize = 1024;

/// What happens at the port of a device.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Event<'a> {
    /// The port was opened; the device is started next.
    Opened,
    /// The device is started: bytes received from now on are samples.
    Started(&'a DeviceDescription),
    /// Bytes from the device to the host.
    Received(&'a [u8]),
    /// Bytes from the host to the device.
    Sent(&'a [u8]),
}

/// Sees all that happens at a port with the time, in the thread of the driver; a
/// recorder, for instance. It must be quick.
pub type Tap = Box<dyn FnMut(Instant, Event<'_>) + Send>;

/// The open port of a device while it is started.
pub struct Line<'a> {
    pub(super) port: &'a mut dyn Port,
    pub(super) stop: &'a AtomicBool,
    pub(super) tap: &'a mut Option<Tap>,
}

impl Line<'_> {
    /// Sends bytes.
    ///
    /// # Errors
    ///
    /// [`StartError::Io`] if the port refuses them.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), StartError> {
        self.port.write_all(bytes)?;
        if let Some(tap) = self.tap {
            tap(Instant::now(), Event::Sent(bytes));
        }
        Ok(())
    }

    /// Reads what has arrived, after at most one read timeout; may be nothing.
    ///
    /// # Errors
    ///
    /// [`StartError::Io`] if the port fails or was closed, [`StartError::Stopped`]
    /// if the driver shall stop.
    pub fn read<'b>(&mut self, buffer: &'b mut [u8]) -> Result<&'b [u8], StartError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(StartError::Stopped);
        }
        let count = read_some(self.port, buffer)?;
        let bytes = &buffer[..count];
        if let Some(tap) = self.tap
            && count > 0
        {
            tap(Instant::now(), Event::Received(bytes));
        }
        Ok(bytes)
    }

    /// Throws away what arrives until nothing has for `quiet`, or for ten times
    /// that in all.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read).
    pub fn drain(&mut self, quiet: Duration) -> Result<(), StartError> {
        let mut buffer = [0; PIECE];
        let begin = Instant::now();
        let mut last = begin;
        while last.elapsed() < quiet && begin.elapsed() < 10 * quiet {
            if !self.read(&mut buffer)?.is_empty() {
                last = Instant::now();
            }
        }
        Ok(())
    }

    /// Sends a command and gathers bytes until `answer` finds what it looks for
    /// in all that arrived since.
    ///
    /// # Errors
    ///
    /// [`StartError::NoAnswer`] after `patience`, or when a kilobyte holds no
    /// answer; what `answer` returns; and those of [`read`](Self::read).
    pub fn ask<T>(
        &mut self,
        command: &[u8],
        patience: Duration,
        mut answer: impl FnMut(&[u8]) -> Result<Option<T>, StartError>,
    ) -> Result<T, StartError> {
        self.send(command)?;
        let mut heard = [0; LONGEST_ANSWER];
        let mut len = 0;
        let begin = Instant::now();
        while begin.elapsed() < patience && len < heard.len() {
            len += self.read(&mut heard[len..])?.len();
            if let Some(found) = answer(&heard[..len])? {
                return Ok(found);
            }
        }
        Err(StartError::NoAnswer {
            command: printable(command),
            heard: printable(&heard[..len.min(64)]),
        })
    }

    /// Waits without listening.
    ///
    /// # Errors
    ///
    /// [`StartError::Stopped`] if the driver shall stop.
    pub fn pause(&mut self, duration: Duration) -> Result<(), StartError> {
        let begin = Instant::now();
        while let Some(left) = duration.checked_sub(begin.elapsed()) {
            if self.stop.load(Ordering::Relaxed) {
                return Err(StartError::Stopped);
            }
            std::thread::sleep(left.min(super::port::READ_TIMEOUT));
        }
        Ok(())
    }
}

/// Reads bytes if there are any before the port's own timeout.
pub(super) fn read_some(port: &mut dyn Port, buffer: &mut [u8]) -> io::Result<usize> {
    match port.read(buffer) {
        Ok(0) => Err(io::Error::new(
            io::ErrorKind::UnexpectedEof,
            "the device closed the connection",
        )),
        Ok(count) => Ok(count),
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
            ) =>
        {
            Ok(0)
        }
        Err(error) => Err(error),
    }
}

/// Bytes for a message.
pub(super) fn printable(bytes: &[u8]) -> String {
    bytes.escape_ascii().to_string()
}
