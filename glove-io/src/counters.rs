//! What a stream parser has seen so far.

/// Statistics of a stream parser since it was made.
///
/// Every byte ever pushed is in exactly one place: in a record that was handed
/// out, in `dropped_bytes`, or still pending as part of an unfinished record.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Records handed to the sink.
    pub records: u64,
    /// How often the parser lost its place, that is, began to drop bytes after
    /// a good record (or after the start of the stream).
    pub resyncs: u64,
    /// Bytes that belong to no record.
    pub dropped_bytes: u64,
}

impl Counters {
    /// The statistics of two streams together.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            records: self.records + other.records,
            resyncs: self.resyncs + other.resyncs,
            dropped_bytes: self.dropped_bytes + other.dropped_bytes,
        }
    }
}
