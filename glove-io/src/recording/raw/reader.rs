//! Reading recordings.

use std::io::{ErrorKind, Read};

use super::format::{
    FILE_HEADER_LEN, Front, MARK, MAX_CHUNK, decode_chunk, decode_file_header, examine,
};
use super::{Chunk, RawError};

/// Room for the longest chunk and as much again to read ahead.
const BUFFER_LEN: usize = 2 * MAX_CHUNK;

/// Reads a recording from anything that gives bytes, one chunk after the other.
///
/// It holds a buffer of 128 KiB whatever the recording is, and reads in large
/// pieces, so a [`File`](std::fs::File) needs no `BufReader`.
///
/// Every byte of the file is in exactly one place: in the header, in a chunk
/// that was handed out, in [`skipped_bytes`](Self::skipped_bytes) or, at the end,
/// in [`torn_bytes`](Self::torn_bytes).
#[derive(Debug)]
pub struct RawReader<R> {
    source: R,
    buffer: Box<[u8]>,
    /// The bytes `buffer[start..end]` were read and not yet used up.
    start: usize,
    end: usize,
    source_ended: bool,
    /// Place of `start` in the file.
    offset: u64,
    /// What is at `start` was reported as damaged.
    in_damage: bool,
    start_unix_ns: u64,
    skipped_bytes: u64,
    torn_bytes: u64,
}

impl<R: Read> RawReader<R> {
    /// Begins to read.
    ///
    /// # Errors
    ///
    /// * [`RawError::NotARecording`] if the bytes begin with something else.
    /// * [`RawError::NoHeader`] if they end within the header.
    /// * [`RawError::DamagedHeader`] if its checksum is wrong.
    /// * [`RawError::Version`] if the format is newer.
    /// * [`RawError::Io`] if reading fails.
    pub fn new(source: R) -> Result<Self, RawError> {
        let mut reader = Self {
            source,
            buffer: vec![0; BUFFER_LEN].into_boxed_slice(),
            start: 0,
            end: 0,
            source_ended: false,
            offset: 0,
            in_damage: false,
            start_unix_ns: 0,
            skipped_bytes: 0,
            torn_bytes: 0,
        };
        reader.fill(FILE_HEADER_LEN)?;
        reader.start_unix_ns = decode_file_header(reader.unread())?;
        reader.advance(FILE_HEADER_LEN);
        Ok(reader)
    }

    /// The wall clock when the recording began, in nanoseconds since 1970.
    #[must_use]
    pub fn start_unix_ns(&self) -> u64 {
        self.start_unix_ns
    }

    /// The next chunk, or `None` at the end.
    ///
    /// The end may be an unfinished chunk, see [`torn_bytes`](Self::torn_bytes).
    ///
    /// # Errors
    ///
    /// * [`RawError::Damaged`] once per damaged stretch. The next call looks for
    ///   the next place where a chunk with right checksums begins.
    /// * [`RawError::Io`] if reading fails; the next call tries again.
    pub fn next_chunk(&mut self) -> Result<Option<Chunk<'_>>, RawError> {
        let len = loop {
            if self.unread().is_empty() && self.fill(1)? == 0 {
                return Ok(None);
            }
            match examine(self.unread()) {
                Front::Whole(len) => break len,
                Front::Needs(len) => {
                    if self.fill(len)? >= len {
                        continue;
                    }
                    if !self.in_damage {
                        let torn = self.unread().len();
                        self.torn_bytes = torn as u64;
                        self.advance(torn);
                        return Ok(None);
                    }
                }
                Front::Damaged(damage) if !self.in_damage => {
                    self.in_damage = true;
                    return Err(RawError::Damaged {
                        offset: self.offset,
                        damage,
                    });
                }
                Front::Damaged(_) => {}
            }
            self.skip_to_mark();
        };
        let (offset, start) = (self.offset, self.start);
        self.in_damage = false;
        self.advance(len);
        match decode_chunk(&self.buffer[start..start + len]) {
            Ok(chunk) => Ok(Some(chunk)),
            Err(damage) => {
                self.skipped_bytes += len as u64;
                Err(RawError::Damaged { offset, damage })
            }
        }
    }

    /// Where the next chunk begins, in bytes from the beginning of the file.
    #[must_use]
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Damaged bytes passed over so far.
    #[must_use]
    pub fn skipped_bytes(&self) -> u64 {
        self.skipped_bytes
    }

    /// Bytes of an unfinished chunk at the end; zero before the end is reached.
    #[must_use]
    pub fn torn_bytes(&self) -> u64 {
        self.torn_bytes
    }

    fn unread(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    fn advance(&mut self, count: usize) {
        self.start += count;
        self.offset += count as u64;
    }

    /// Passes over the first unread byte and all that follow up to one that can
    /// begin a mark.
    fn skip_to_mark(&mut self) {
        let rest = &self.unread()[1..];
        let gap = rest.iter().position(|&byte| byte == MARK[0]);
        let count = 1 + gap.unwrap_or(rest.len());
        self.skipped_bytes += count as u64;
        self.advance(count);
    }

    /// Reads until there are `count` unread bytes, at most [`MAX_CHUNK`], or the
    /// source ends; returns how many there are.
    fn fill(&mut self, count: usize) -> Result<usize, RawError> {
        // Moving only when the room behind is too small keeps the work in
        // proportion to the bytes.
        if self.start + count > self.buffer.len() {
            self.buffer.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        while self.unread().len() < count && !self.source_ended {
            match self.source.read(&mut self.buffer[self.end..]) {
                Ok(0) => self.source_ended = true,
                Ok(read) => self.end += read,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(self.unread().len())
    }
}
