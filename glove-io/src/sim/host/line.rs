//! The pace of a serial line: a byte takes its time.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Start bit, eight data bits, stop bit.
const BITS_PER_BYTE: f64 = 10.0;
/// Bytes are handed over at least this often, as the buffer of a serial port does.
const HAND_OVER: Duration = Duration::from_millis(1);

/// Bytes on their way, each due when its last bit has left the device.
pub(super) struct SlowLine {
    byte_time: Duration,
    queue: VecDeque<u8>,
    /// When the first byte of the queue is due.
    first_due: Instant,
}

impl SlowLine {
    pub(super) fn new(baud: u32, now: Instant) -> Self {
        Self {
            byte_time: Duration::from_secs_f64(BITS_PER_BYTE / f64::from(baud.max(1))),
            queue: VecDeque::new(),
            first_due: now,
        }
    }

    pub(super) fn queued(&self) -> usize {
        self.queue.len()
    }

    /// Puts bytes on the line.
    pub(super) fn send(&mut self, now: Instant, put: impl FnOnce(&mut VecDeque<u8>)) {
        if self.queue.is_empty() {
            self.first_due = now + self.byte_time;
        }
        put(&mut self.queue);
    }

    /// Cuts what has not left the device.
    pub(super) fn cut(&mut self) {
        self.queue.clear();
    }

    /// When it is worth to look again: all is through, or enough to hand over.
    pub(super) fn next_due(&self) -> Option<Instant> {
        let last = self.queue.len().checked_sub(1)?;
        let all = self
            .byte_time
            .saturating_mul(u32::try_from(last).unwrap_or(u32::MAX));
        Some(self.first_due + all.min(HAND_OVER))
    }

    /// Moves the bytes that are through to `out`.
    pub(super) fn arrived(&mut self, now: Instant, out: &mut Vec<u8>) {
        while self.first_due <= now
            && let Some(byte) = self.queue.pop_front()
        {
            out.push(byte);
            self.first_due += self.byte_time;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_takes_ten_bits() {
        let start = Instant::now();
        let mut line = SlowLine::new(10_000, start);
        line.send(start, |queue| queue.extend(0..100));
        let mut out = Vec::new();
        // One byte a millisecond: none before the first is complete.
        for (after_us, arrived) in [
            (999, 0),
            (1_000, 1),
            (10_000, 10),
            (99_999, 99),
            (100_000, 100),
        ] {
            line.arrived(start + Duration::from_micros(after_us), &mut out);
            assert_eq!(out.len(), arrived, "after {after_us} us");
        }
        assert_eq!(out, (0..100).collect::<Vec<u8>>());
        assert_eq!(line.next_due(), None);
    }

    #[test]
    fn an_idle_line_starts_afresh() {
        let start = Instant::now();
        let mut line = SlowLine::new(10_000, start);
        let later = start + Duration::from_secs(1);
        line.send(later, |queue| queue.extend([1, 2]));
        assert_eq!(line.next_due(), Some(later + Duration::from_millis(2)));
        let mut out = Vec::new();
        line.arrived(later, &mut out);
        assert!(out.is_empty());
    }
}
