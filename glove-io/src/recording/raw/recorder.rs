//! Writing recordings.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};

use super::format::{encode_chunk, encode_file_header};
use super::{Chunk, RawError, RawReader};

/// Writes a recording to anything that takes bytes.
///
/// Each chunk reaches the writer in a single [`write_all`](Write::write_all) at
/// once; the recorder holds nothing back. With a [`File`], chunks that were
/// recorded survive the end of the process. Whether they survive the end of the
/// computer is up to the system: call [`File::sync_data`] through
/// [`get_ref`](Self::get_ref) as often as that matters. In a `BufWriter` chunks
/// are as safe as the last [`flush`](Self::flush).
///
/// It allocates only until its buffer has the size of the longest chunk.
#[derive(Debug)]
pub struct RawRecorder<W> {
    writer: W,
    /// The chunk being written.
    buffer: Vec<u8>,
}

impl<W: Write> RawRecorder<W> {
    /// Begins a recording.
    ///
    /// `start_unix_ns` is the wall clock in nanoseconds since 1970, for
    /// information; the times of the chunks come from a monotonic clock.
    ///
    /// # Errors
    ///
    /// [`RawError::Io`] if the header cannot be written.
    pub fn new(mut writer: W, start_unix_ns: u64) -> Result<Self, RawError> {
        writer.write_all(&encode_file_header(start_unix_ns))?;
        Ok(Self {
            writer,
            buffer: Vec::new(),
        })
    }

    /// Writes one chunk.
    ///
    /// Times need not rise from one chunk to the next.
    ///
    /// # Errors
    ///
    /// * [`RawError::TooLong`] if the payload exceeds
    ///   [`MAX_PAYLOAD`](super::MAX_PAYLOAD); split it.
    /// * [`RawError::BadDescription`] if a description cannot be written.
    /// * [`RawError::Io`] if writing fails. Part of the chunk may have been
    ///   written; readers skip it.
    pub fn record(&mut self, chunk: &Chunk) -> Result<(), RawError> {
        encode_chunk(chunk, &mut self.buffer)?;
        Ok(self.writer.write_all(&self.buffer)?)
    }

    /// Flushes the writer.
    ///
    /// # Errors
    ///
    /// [`RawError::Io`] if that fails.
    pub fn flush(&mut self) -> Result<(), RawError> {
        Ok(self.writer.flush()?)
    }

    /// The writer.
    pub fn get_ref(&self) -> &W {
        &self.writer
    }

    /// Ends the recording and returns the writer.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

/// What was in a recording that goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Appended {
    /// Number of chunks in it.
    pub chunks: u64,
    /// The latest time in it, in nanoseconds. New times should go on from here.
    pub latest_time_ns: u64,
    /// Bytes cut off behind the last whole chunk.
    pub cut_off: u64,
}

impl RawRecorder<File> {
    /// Goes on with a recording, in a file open for reading and writing.
    ///
    /// The whole file is read and checked. What follows its last chunk, such as
    /// an unfinished chunk, is cut off. An empty file, or one that ends within
    /// its header, is begun anew with `start_unix_ns`; other files keep the wall
    /// clock they have.
    ///
    /// # Errors
    ///
    /// The file is unchanged, except if writing fails.
    ///
    /// * [`RawError::NotARecording`], [`RawError::DamagedHeader`] or
    ///   [`RawError::Version`] if the file is something else.
    /// * [`RawError::Damaged`] if something before the last chunk is damaged.
    /// * [`RawError::Io`] if reading or writing fails.
    pub fn append(mut file: File, start_unix_ns: u64) -> Result<(Self, Appended), RawError> {
        file.rewind()?;
        let mut appended = Appended {
            chunks: 0,
            latest_time_ns: 0,
            cut_off: 0,
        };
        let mut reader = match RawReader::new(&file) {
            Err(RawError::NoHeader { len }) => {
                appended.cut_off = len as u64;
                file.set_len(0)?;
                file.rewind()?;
                return Ok((Self::new(file, start_unix_ns)?, appended));
            }
            reader => reader?,
        };
        let (mut end, mut damage) = (reader.offset(), None);
        loop {
            match reader.next_chunk() {
                Ok(None) => break,
                Ok(Some(chunk)) => {
                    if let Some(damage) = damage {
                        return Err(damage);
                    }
                    appended.chunks += 1;
                    appended.latest_time_ns = appended.latest_time_ns.max(chunk.time_ns);
                    end = reader.offset();
                }
                Err(error @ RawError::Damaged { .. }) => damage = damage.or(Some(error)),
                Err(error) => return Err(error),
            }
        }
        appended.cut_off = reader.skipped_bytes() + reader.torn_bytes();
        file.set_len(end)?;
        file.seek(SeekFrom::Start(end))?;
        let recorder = Self {
            writer: file,
            buffer: Vec::new(),
        };
        Ok((recorder, appended))
    }
}
