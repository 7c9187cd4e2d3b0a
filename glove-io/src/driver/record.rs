//! Recording the bytes of all devices of a session.

use std::io::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::line::{Event, Tap};
use crate::recording::raw::{
    Chunk, Content, DeviceDescription, MAX_PAYLOAD, RawError, RawRecorder,
};

/// Key of a description that marks the start-up of a device.
pub(super) const STATE: &str = "state";
/// Its value there.
pub(super) const STARTING: &str = "starting";

/// Writes what several drivers receive and send to one recording.
///
/// Every event is written before its bytes are parsed, in the thread of the driver;
/// a writer that holds nothing back, such as a [`File`](std::fs::File), leaves a
/// complete recording even if the program is killed. The first error stops the
/// recording, not the drivers.
///
/// # Example
///
/// ```no_run
/// use std::fs::File;
/// use std::time::Instant;
/// use glove_io::driver::{CyberGlove, Device, Driver, Options, SessionRecorder, serial};
/// use glove_io::recording::raw::RawRecorder;
///
/// let file = RawRecorder::new(File::create_new("hand.graw")?, 0)?;
/// let session = SessionRecorder::new(file, Instant::now());
/// let options = Options { tap: Some(session.tap(0, CyberGlove::KIND)), ..Options::default() };
/// let glove = Driver::spawn(serial("/dev/ttyUSB0", 115_200), CyberGlove::default(), options)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SessionRecorder<W> {
    shared: Arc<Mutex<Shared<W>>>,
    start: Instant,
}

struct Shared<W> {
    recorder: RawRecorder<W>,
    chunks: u64,
    error: Option<RawError>,
}

impl<W: Write + Send + 'static> SessionRecorder<W> {
    /// Records to `recorder`; the time `start` is zero in it.
    #[must_use]
    pub fn new(recorder: RawRecorder<W>, start: Instant) -> Self {
        Self {
            shared: Arc::new(Mutex::new(Shared {
                recorder,
                chunks: 0,
                error: None,
            })),
            start,
        }
    }

    /// What a driver needs to have its events recorded as those of device number
    /// `device`, a [`Device::KIND`](super::Device::KIND).
    #[must_use]
    pub fn tap(&self, device: u8, kind: &'static str) -> Tap {
        let (shared, start) = (Arc::clone(&self.shared), self.start);
        Box::new(move |time, event| {
            let since = time.saturating_duration_since(start);
            let time_ns = u64::try_from(since.as_nanos()).unwrap_or(u64::MAX);
            let mut shared = lock(&shared);
            let mut record = |content| {
                shared.record(&Chunk {
                    device,
                    time_ns,
                    content,
                });
            };
            match event {
                Event::Opened => record(Content::Description(
                    DeviceDescription::new(kind).with(STATE, STARTING),
                )),
                Event::Started(description) => record(Content::Description(description.clone())),
                Event::Received(bytes) => bytes
                    .chunks(MAX_PAYLOAD)
                    .for_each(|piece| record(Content::FromDevice(piece))),
                Event::Sent(bytes) => bytes
                    .chunks(MAX_PAYLOAD)
                    .for_each(|piece| record(Content::ToDevice(piece))),
            }
        })
    }

    /// Chunks written so far.
    #[must_use]
    pub fn chunks(&self) -> u64 {
        lock(&self.shared).chunks
    }

    /// The error that stopped the recording, if one did; only once.
    #[must_use]
    pub fn take_error(&self) -> Option<RawError> {
        lock(&self.shared).error.take()
    }
}

fn lock<W>(shared: &Mutex<Shared<W>>) -> MutexGuard<'_, Shared<W>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<W: Write> Shared<W> {
    fn record(&mut self, chunk: &Chunk<'_>) {
        if self.error.is_none() {
            match self.recorder.record(chunk) {
                Ok(()) => self.chunks += 1,
                Err(error) => self.error = Some(error),
            }
        }
    }
}
