//! When the chunks of a recording are due.

use std::io::Read;
use std::time::Duration;

use super::{Chunk, RawError, RawReader};

/// Reads a recording and says when each chunk is due.
///
/// It does not wait: the caller does, or does not. The bytes are the recorded
/// ones at any speed.
///
/// # Example
///
/// ```
/// use std::time::Duration;
/// use glove_io::recording::raw::{Chunk, Content, Player, RawReader, RawRecorder};
///
/// let mut recorder = RawRecorder::new(Vec::new(), 0)?;
/// for time_ns in [7_000, 27_000] {
///     recorder.record(&Chunk { device: 0, time_ns, content: Content::FromDevice(b"G") })?;
/// }
/// let file = recorder.into_inner();
///
/// let mut player = Player::new(RawReader::new(file.as_slice())?, 2.0)?;
/// let mut dues = Vec::new();
/// while let Some(next) = player.next_due()? {
///     // Here a real replay sleeps until its start plus `next.after`.
///     dues.push(next.after);
/// }
/// assert_eq!(dues, [Duration::ZERO, Duration::from_micros(10)]);
/// # Ok::<(), glove_io::recording::raw::RawError>(())
/// ```
#[derive(Debug)]
pub struct Player<R> {
    reader: RawReader<R>,
    speed: f64,
    /// Time of the first chunk.
    first_ns: Option<u64>,
}

/// A chunk and when it is due.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Due<'a> {
    /// Time after the first chunk. It does not rise where the recorded times do
    /// not; a chunk with a time before the first one is due at once.
    pub after: Duration,
    /// The chunk.
    pub chunk: Chunk<'a>,
}

impl<R: Read> Player<R> {
    /// Plays from where the reader is; `speed` 1 is as fast as recorded, 2 twice
    /// as fast, infinite without waiting.
    ///
    /// # Errors
    ///
    /// [`RawError::Speed`] if the speed is not positive.
    pub fn new(reader: RawReader<R>, speed: f64) -> Result<Self, RawError> {
        if speed.is_nan() || speed <= 0.0 {
            return Err(RawError::Speed { speed });
        }
        Ok(Self {
            reader,
            speed,
            first_ns: None,
        })
    }

    /// The next chunk and when it is due, or `None` at the end.
    ///
    /// Times are exact at speed 1 up to 104 days (2⁵³ ns); otherwise they are
    /// rounded down to the nanosecond.
    ///
    /// # Errors
    ///
    /// As [`RawReader::next_chunk`].
    pub fn next_due(&mut self) -> Result<Option<Due<'_>>, RawError> {
        let Some(chunk) = self.reader.next_chunk()? else {
            return Ok(None);
        };
        let first = *self.first_ns.get_or_insert(chunk.time_ns);
        let elapsed = chunk.time_ns.saturating_sub(first);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_precision_loss,
            clippy::cast_sign_loss,
            reason = "rounded as documented; the cast saturates"
        )]
        let after_ns = (elapsed as f64 / self.speed) as u64;
        Ok(Some(Due {
            after: Duration::from_nanos(after_ns),
            chunk,
        }))
    }

    /// The reader, for its statistics.
    pub fn reader(&self) -> &RawReader<R> {
        &self.reader
    }
}
