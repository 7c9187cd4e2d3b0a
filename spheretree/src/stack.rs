//! The fixed stack of a depth-first walk.

use crate::morton;

/// The greatest depth a tree can have.
///
/// A node splits once per octree level at most. Below the last level all keys
/// are equal, and fewer than 2³¹ triangles are cut into eight runs at a time
/// until eight or fewer remain: ten more splits.
pub(crate) const MAX_DEPTH: usize = morton::BITS as usize + 10;

/// Every split replaces one entry by at most eight.
const CAPACITY: usize = 7 * MAX_DEPTH + 1;

/// A last-in, first-out list that never allocates.
pub(crate) struct Stack<T> {
    entries: [T; CAPACITY],
    len: usize,
}

impl<T: Copy + Default> Stack<T> {
    pub(crate) fn new() -> Self {
        Self {
            entries: [T::default(); CAPACITY],
            len: 0,
        }
    }

    pub(crate) fn push(&mut self, entry: T) {
        self.entries[self.len] = entry;
        self.len += 1;
    }

    pub(crate) fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        Some(self.entries[self.len])
    }
}
