//! Cutting a stream of bytes into records.

use super::format::{HEADER_LEN, MAX_RECORD, RecordFormat};
use super::record::{Record, may_begin_record};
use crate::Counters;

/// A record and the header of the next one.
const CAPACITY: usize = MAX_RECORD + HEADER_LEN;

/// Bytes in, records out, in pieces of any size.
///
/// Every byte value, `0` included, may occur inside a binary record, so the
/// parser goes by length and checks the header, the fixed characters and that
/// all numbers are finite.
///
/// A record that begins where the last one ended is handed out when its last
/// byte arrives. After damage the parser looks for the next place where a whole
/// record fits, and believes it only when the header of *another* record
/// follows. A client that polls with `P` therefore gets the first record after
/// damage together with the next one. Output lists without a blank or CR LF at
/// the end leave nothing to check there; their records always wait for the next
/// header.
///
/// One missing, extra or changed byte costs or alters at most one record; two if
/// the output list has no such end.
///
/// # Example
///
/// ```
/// use glove_io::fastrak::{Parser, RecordFormat};
///
/// let mut parser = Parser::new(RecordFormat::default());
/// let mut records = Vec::new();
/// for piece in ["01   12.34  -5.60   0.07", "  30.00  20.00  10.00\r\n"] {
///     parser.push(piece.as_bytes(), |record| records.push(record));
/// }
/// let [x, _, _] = records[0].position_m.unwrap();
/// assert_eq!(x, 12.34 * 0.0254);
/// ```
#[derive(Debug, Clone)]
pub struct Parser {
    format: RecordFormat,
    /// Bytes of a record in `format`.
    record_len: usize,
    /// Whether records in `format` end in something that can be checked.
    has_end_mark: bool,
    /// Its first `len` bytes are an unfinished record, header first.
    buffer: [u8; CAPACITY],
    len: usize,
    /// Whether the buffer begins where a record ended or the stream began.
    in_step: bool,
    counters: Counters,
}

/// What the front of the buffer turned out to be.
enum Front {
    Incomplete,
    Complete(Record),
    Damaged,
}

impl Parser {
    /// A parser for records of this format, at the start of a stream.
    #[must_use]
    pub fn new(format: RecordFormat) -> Self {
        Self {
            record_len: format.record_len(),
            has_end_mark: format.has_end_mark(),
            format,
            buffer: [0; CAPACITY],
            len: 0,
            in_step: true,
            counters: Counters::default(),
        }
    }

    /// Takes the next bytes of the stream and hands every completed record to
    /// `sink`, in order.
    ///
    /// Constant memory. Time in proportion to the number of bytes, times the
    /// length of a record where the stream is damaged.
    pub fn push(&mut self, mut bytes: &[u8], mut sink: impl FnMut(Record)) {
        loop {
            bytes = self.take_whole(bytes, &mut sink);
            // Behind a whole header nothing is judged before the record is
            // complete, so that many bytes may be taken at once.
            let count = if self.len < HEADER_LEN {
                1
            } else {
                self.record_len.saturating_sub(self.len).max(1)
            };
            let (taken, rest) = bytes.split_at(count.min(bytes.len()));
            if taken.is_empty() {
                return;
            }
            self.buffer[self.len..][..taken.len()].copy_from_slice(taken);
            self.len += taken.len();
            bytes = rest;
            self.advance(&mut sink);
        }
    }

    /// Statistics since the parser was made.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Number of bytes held back that may become part of a record.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.len
    }

    /// Takes whole records straight from the stream, as long as they are those
    /// that [`examine`](Self::examine) would call complete, and returns the rest.
    fn take_whole<'a>(&mut self, mut bytes: &'a [u8], sink: &mut impl FnMut(Record)) -> &'a [u8] {
        if self.len > 0 || !self.in_step || !self.has_end_mark {
            return bytes;
        }
        while let Some((front, rest)) = bytes.split_at_checked(self.record_len) {
            if !may_begin_record(front) {
                break;
            }
            let Some(record) = Record::decode(&self.format, front) else {
                break;
            };
            bytes = rest;
            self.counters.records += 1;
            sink(record);
        }
        bytes
    }

    /// Takes complete records and damaged bytes off the front of the buffer.
    fn advance(&mut self, sink: &mut impl FnMut(Record)) {
        let mut start = 0;
        while start < self.len {
            match self.examine(&self.buffer[start..self.len]) {
                Front::Incomplete => break,
                Front::Complete(record) => {
                    start += self.record_len;
                    self.in_step = true;
                    self.counters.records += 1;
                    sink(record);
                }
                Front::Damaged => {
                    start += 1;
                    self.counters.resyncs += u64::from(self.in_step);
                    self.in_step = false;
                    self.counters.dropped_bytes += 1;
                }
            }
        }
        if start > 0 {
            self.buffer.copy_within(start..self.len, 0);
            self.len -= start;
        }
    }

    /// Judges a possible record at the front of `bytes`.
    ///
    /// Never [`Front::Incomplete`] once a record and a header are there, which
    /// is why the buffer cannot overflow.
    fn examine(&self, bytes: &[u8]) -> Front {
        if !may_begin_record(bytes) {
            return Front::Damaged;
        }
        let Some((bytes, next)) = bytes.split_at_checked(self.record_len) else {
            return Front::Incomplete;
        };
        let Some(record) = Record::decode(&self.format, bytes) else {
            return Front::Damaged;
        };
        if self.in_step && self.has_end_mark {
            return Front::Complete(record);
        }
        if !may_begin_record(next) {
            Front::Damaged
        } else if next.len() < HEADER_LEN {
            Front::Incomplete
        } else {
            Front::Complete(record)
        }
    }
}
