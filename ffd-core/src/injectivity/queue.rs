//! Boxes in doubt, the worst first.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::piece::Bounds;

/// Boxes whose coefficients are kept while they wait; beyond, the newest comes first, so
/// that memory stays bounded.
const KEPT: usize = 4096;

/// A box in doubt.
#[derive(Debug)]
pub(super) struct Node<const D: usize> {
    /// A lower bound, with the sign that is being proven.
    pub(super) key: f64,
    pub(super) cell: usize,
    /// The lower corner, and halvings along each axis.
    pub(super) low: [f64; D],
    pub(super) level: [i32; D],
    /// Empty for a whole cell that waits among many: they are computed again.
    pub(super) coefficients: Vec<f64>,
    pub(super) bounds: Bounds,
    /// By how much coefficients may be wrong.
    pub(super) error: f64,
}

impl<const D: usize> Node<D> {
    /// From and to along each axis of the cell.
    pub(super) fn part(&self) -> [[f64; 2]; D] {
        std::array::from_fn(|a| {
            let size = 0.5_f64.powi(self.level[a]);
            [self.low[a], self.low[a] + size]
        })
    }
}

impl<const D: usize> PartialEq for Node<D> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<const D: usize> Eq for Node<D> {}

impl<const D: usize> PartialOrd for Node<D> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The worst is the greatest; of equals, the first cell and place, so that the order does
/// not depend on anything else.
impl<const D: usize> Ord for Node<D> {
    fn cmp(&self, other: &Self) -> Ordering {
        let places = || {
            let axes = 0..D;
            axes.map(|a| other.low[a].total_cmp(&self.low[a]))
                .find(|&o| o != Ordering::Equal)
                .unwrap_or(Ordering::Equal)
        };
        other
            .key
            .total_cmp(&self.key)
            .then(other.cell.cmp(&self.cell))
            .then_with(places)
    }
}

/// Boxes in doubt, the worst first as long as there are not too many.
#[derive(Debug, Default)]
pub(super) struct Queue<const D: usize> {
    heap: BinaryHeap<Node<D>>,
    stack: Vec<Node<D>>,
}

impl<const D: usize> Queue<D> {
    pub(super) fn push(&mut self, mut node: Node<D>) {
        if self.heap.len() < KEPT {
            self.heap.push(node);
        } else if node.level == [0; D] {
            node.coefficients = Vec::new();
            self.heap.push(node);
        } else {
            self.stack.push(node);
        }
    }

    /// Whether the next box is the worst of all.
    pub(super) fn is_sorted(&self) -> bool {
        self.stack.is_empty()
    }

    pub(super) fn pop(&mut self) -> Option<Node<D>> {
        self.stack.pop().or_else(|| self.heap.pop())
    }
}
