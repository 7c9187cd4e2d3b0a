//! Cutting a stream of bytes into records.

use super::record::{MAX_RECORD, Record, RecordFormat, is_head};
use crate::Counters;

/// The longest record without its final NUL.
const LONGEST_RUN: usize = MAX_RECORD - 1;

/// Bytes in, records out, in pieces of any size.
///
/// A record is handed out the moment its last byte arrives. After damage the
/// parser finds the next intact record by itself: one missing, extra or changed
/// byte costs or alters at most one record. (The format has no checksum; a
/// sensor value that changed into another one cannot be noticed.)
///
/// Feed it while the glove answers `G` or `S`; replies to queries that arrive
/// in between are dropped and counted.
///
/// # Example
///
/// ```
/// use glove_io::cyberglove::{Parser, RecordFormat};
///
/// let mut parser = Parser::new(RecordFormat::default());
/// let mut bytes = vec![b'S'];
/// bytes.extend([128; 22]);
/// bytes.push(0);
/// let mut records = Vec::new();
/// parser.push(&bytes[..10], |record| records.push(record));
/// assert_eq!((records.len(), parser.pending()), (0, 10));
/// parser.push(&bytes[10..], |record| records.push(record));
/// assert_eq!((records.len(), parser.pending()), (1, 0));
/// assert_eq!(records[0].sensors(), [128; 22]);
/// ```
#[derive(Debug, Clone)]
pub struct Parser {
    format: RecordFormat,
    /// The last bytes of the current run of non-zero bytes.
    run: [u8; LONGEST_RUN],
    /// How many bytes of `run` are in use.
    kept: usize,
    /// Length of the current run, including what is no longer kept.
    run_len: usize,
    /// Whether the run began with a byte that can begin a record.
    begins_with_head: bool,
    /// Whether the last byte that left the parser was part of a record.
    in_step: bool,
    counters: Counters,
}

impl Parser {
    /// A parser for records of this format, at the start of a stream.
    #[must_use]
    pub fn new(format: RecordFormat) -> Self {
        Self {
            format,
            run: [0; LONGEST_RUN],
            kept: 0,
            run_len: 0,
            begins_with_head: false,
            in_step: true,
            counters: Counters::default(),
        }
    }

    /// Takes the next bytes of the stream and hands every completed record to
    /// `sink`, in order.
    ///
    /// Constant memory, and time in proportion to the number of bytes.
    pub fn push(&mut self, bytes: &[u8], mut sink: impl FnMut(Record)) {
        let mut bytes = bytes;
        loop {
            while let Some((record, rest)) = self.whole_record(bytes) {
                self.in_step = true;
                self.counters.records += 1;
                sink(record);
                bytes = rest;
            }
            let Some((&byte, rest)) = bytes.split_first() else {
                return;
            };
            bytes = rest;
            if byte == 0 {
                if let Some(record) = self.end_run() {
                    sink(record);
                }
            } else {
                self.keep(byte);
            }
        }
    }

    /// The record that `bytes` begin with and what follows it, if no byte is
    /// held back and the record carries no error marks.
    ///
    /// A short cut for the usual case: the bytes are a run of exactly the length
    /// of a record, which [`end_run`](Self::end_run) would accept as well. A zero
    /// in the time stamp or the status would end the run early, so these are
    /// looked at too; `decode` does the same for the sensors.
    fn whole_record<'a>(&self, bytes: &'a [u8]) -> Option<(Record, &'a [u8])> {
        if self.run_len != 0 {
            return None;
        }
        let (run, rest) = bytes.split_at_checked(self.format.base_len())?;
        let (&0, rest) = rest.split_first()? else {
            return None;
        };
        let after_sensors = &run[1 + self.format.sensors.get()..];
        if after_sensors.contains(&0) {
            return None;
        }
        Some((Record::decode(self.format, run)?, rest))
    }

    /// Statistics since the parser was made.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Number of bytes held back that may become part of a record.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.kept
    }

    fn keep(&mut self, byte: u8) {
        if self.run_len == 0 {
            self.begins_with_head = is_head(byte);
        }
        if self.kept == LONGEST_RUN {
            self.run.copy_within(1.., 0);
            self.kept -= 1;
            self.drop_bytes(1);
        }
        self.run[self.kept] = byte;
        self.kept += 1;
        self.run_len = self.run_len.saturating_add(1);
    }

    /// Handles the NUL that ends a run.
    fn end_run(&mut self) -> Option<Record> {
        let found = self.record_at_end_of_run();
        match found {
            Some((len, _)) => {
                self.drop_bytes(self.kept - len);
                self.in_step = true;
                self.counters.records += 1;
            }
            None => self.drop_bytes(self.kept + 1),
        }
        self.kept = 0;
        self.run_len = 0;
        found.map(|(_, record)| record)
    }

    /// The record that the current run ends with, and its length without NUL.
    ///
    /// Normally the run *is* the record. If it is longer, what precedes the
    /// record decides:
    ///
    /// * at least a whole record: its NUL was lost, and this one is intact;
    /// * something that cannot begin a record: stray bytes between records;
    /// * a head and less than a record: bytes were inserted *into* this record,
    ///   and reading its tail would shift the fingers by one. Refuse it.
    fn record_at_end_of_run(&self) -> Option<(usize, Record)> {
        let run = &self.run[..self.kept];
        let base = self.format.base_len();
        // Longest first: error marks are also legal sensor values.
        for len in [base + 4, base + 2, base] {
            let Some(start) = run.len().checked_sub(len) else {
                continue;
            };
            let before = self.run_len - len;
            let plausible = before == 0 || before >= base || !self.begins_with_head;
            if let Some(record) = Record::decode(self.format, &run[start..])
                && plausible
            {
                return Some((len, record));
            }
        }
        None
    }

    fn drop_bytes(&mut self, count: usize) {
        if count > 0 {
            self.counters.dropped_bytes += count as u64;
            self.counters.resyncs += u64::from(self.in_step);
            self.in_step = false;
        }
    }
}
