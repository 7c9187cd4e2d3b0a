//! Boxes cut in half until they are decided: for the sign of the determinant, or for an
//! interval that contains its minimum.

use super::Budget;
use super::batch::{self, CHUNK};
use super::dominance::Dominance;
use super::queue::{Node, Queue};
use super::search::{DEEPEST, Part, Search, State};
use crate::Lattice;

impl<const D: usize> Search<D> {
    /// Cuts boxes until they are decided; returns those that floating point cannot decide,
    /// and those that are left when the budget is spent.
    pub(super) fn subdivide(
        &mut self,
        lattice: &Lattice<D>,
        mut queue: Queue<D>,
        budget: &Budget,
        all: bool,
        reversed: bool,
    ) -> Vec<Node<D>> {
        let mut doubtful = Vec::new();
        let allowed = self.effort.boxes.saturating_add(budget.boxes);
        while let Some(node) = self.take(&mut queue) {
            if !reversed && matches!(self.states[node.cell], State::Folded(_)) {
                continue;
            }
            if self.effort.boxes + 2 > allowed || is_for_exact_arithmetic(&node) {
                doubtful.push(node);
                continue;
            }
            self.open_part(node.cell);
            for child in self.cut(node) {
                self.examine(lattice, child, reversed, &mut queue);
            }
            if (reversed || !all) && self.both_signs().is_some() {
                break;
            }
        }
        doubtful
    }

    /// The next box, with its coefficients.
    fn take(&mut self, queue: &mut Queue<D>) -> Option<Node<D>> {
        let mut node = queue.pop()?;
        if node.coefficients.is_empty() {
            let cell = self.partials.cell(node.cell);
            self.products
                .determinant(&self.partials, cell, &mut node.coefficients);
        }
        Some(node)
    }

    pub(super) fn cut(&mut self, node: Node<D>) -> [Node<D>; 2] {
        let axis = self.shape.most_curved_axis(&node.coefficients);
        let largest = node.bounds.max.abs().max(node.bounds.min.abs());
        let mut high = node;
        let mut low = Node {
            coefficients: vec![0.0; high.coefficients.len()],
            ..high
        };
        self.shape
            .split(axis, &mut low.coefficients, &mut high.coefficients);
        high.low[axis] += 0.5_f64.powi(high.level[axis] + 1);
        for half in [&mut low, &mut high] {
            half.level[axis] += 1;
            half.bounds = self.shape.bounds(&half.coefficients);
            half.error = self.shape.error_after_split(axis, half.error, largest);
        }
        self.effort.boxes += 2;
        [low, high]
    }

    /// Decides a box, or puts it into the queue.
    fn examine(
        &mut self,
        lattice: &Lattice<D>,
        mut node: Node<D>,
        reversed: bool,
        queue: &mut Queue<D>,
    ) {
        let (bounds, error) = (node.bounds, node.error);
        self.least_seen = self.least_seen.min(bounds.low_corner.0 + error);
        if reversed {
            if bounds.high_corner.0 > error {
                self.positive = Some(self.corner(lattice, &node, bounds.high_corner.1));
                return;
            }
        } else if bounds.low_corner.0 < -error {
            let place = self.corner(lattice, &node, bounds.low_corner.1);
            self.negative = self.negative.or(Some(place));
            self.states[node.cell] = State::Folded(Box::new(place));
            return;
        } else if self.positive.is_none() && bounds.high_corner.0 > error {
            self.positive = Some(self.corner(lattice, &node, bounds.high_corner.1));
        }
        let (min, corner) = if reversed {
            (-bounds.max, -bounds.high_corner.0)
        } else {
            (bounds.min, bounds.low_corner.0)
        };
        node.key = min - error;
        if node.key <= 0.0 && corner > error {
            let (shape, scratch) = (&self.shape, &mut self.scratch);
            let bound = shape.lower_bound(&node.coefficients, reversed, scratch);
            node.key = node.key.max(bound - error);
        }
        if node.key > 0.0 {
            self.close_part(node.cell, Part::Right(node.key), reversed);
        } else {
            queue.push(node);
        }
    }

    /// Encloses the minimum of the determinant over all cells, in lattice coordinates, in an
    /// interval of the given width; wider if the budget is spent before, or where rounding
    /// errors are as large as that.
    pub(super) fn enclose(&mut self, width: f64, budget: &Budget) -> [f64; 2] {
        self.partials.prepare();
        let mut queue = Queue::default();
        let (cells, mut high) = self.where_least_may_be();
        for (least, cell) in cells {
            if least >= high {
                break;
            }
            let mut node = self.whole_cell(cell);
            self.bound(&mut node, &mut high);
            queue.push(node);
        }
        let allowed = self.effort.boxes.saturating_add(budget.boxes);
        let mut low = f64::INFINITY;
        while let Some(node) = self.take(&mut queue) {
            let narrow = high - node.key <= width;
            let sorted = queue.is_sorted();
            if narrow || self.effort.boxes + 2 > allowed || is_exhausted(&node) {
                low = low.min(node.key);
                // What comes after the worst is not worse.
                if sorted {
                    break;
                }
                continue;
            }
            for mut half in self.cut(node) {
                self.bound(&mut half, &mut high);
                if half.key < high {
                    queue.push(half);
                }
            }
        }
        self.least_seen = self.least_seen.min(high);
        self.partials.divide_by_frame([low.min(high), high])
    }

    /// Cells with lower bounds of their determinants, the least first, and an upper bound of
    /// the least determinant: the cheapest bounds that tell which cells matter.
    fn where_least_may_be(&mut self) -> (Vec<(f64, usize)>, f64) {
        let in_order = |cells: &mut Vec<(f64, usize)>| {
            cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        };
        let dominance = Dominance::new(&self.partials);
        let bound = |cell: usize| {
            let index = self.partials.index(self.partials.cell(cell));
            let known = match self.states[cell] {
                State::Positive(bound) => bound,
                _ => f64::NEG_INFINITY,
            };
            dominance
                .least(index)
                .map_or(known, |least| known.max(least))
        };
        let mut cells: Vec<_> = (0..self.states.len()).map(|c| (bound(c), c)).collect();
        in_order(&mut cells);
        let mut high = f64::INFINITY;
        if self.partials.is_sound() {
            for chunk in cells.chunks_mut(CHUNK) {
                chunk.sort_by_key(|&(_, cell)| cell);
                let numbers: Vec<usize> = chunk
                    .iter()
                    .filter(|(least, _)| *least < high)
                    .map(|&(_, cell)| cell)
                    .collect();
                if numbers.is_empty() {
                    break;
                }
                self.effort.boxes += numbers.len();
                for list in batch::by_kind(&self.partials, &numbers) {
                    let kind = batch::Kind::new(self.products.level, &self.partials, list[0]);
                    for (&cell, bounds) in list.iter().zip(kind.bounds(&list)) {
                        high = high.min(bounds.low_corner + bounds.error);
                        let at = chunk.binary_search_by_key(&cell, |&(_, cell)| cell);
                        let (least, _) = &mut chunk[at.expect("taken from there")];
                        *least = least.max(bounds.min - bounds.error);
                    }
                }
            }
        }
        in_order(&mut cells);
        (cells, high)
    }

    /// Sets the lower bound of a box, and lowers the upper bound of the minimum.
    fn bound(&mut self, node: &mut Node<D>, high: &mut f64) {
        if node.error == f64::INFINITY {
            return;
        }
        *high = high.min(node.bounds.low_corner.0 + node.error);
        let mut least = node.bounds.min;
        if least < node.bounds.low_corner.0 {
            let (shape, scratch) = (&self.shape, &mut self.scratch);
            least = least.max(shape.lower_bound(&node.coefficients, false, scratch));
        }
        node.key = least - node.error;
    }
}

/// Whether cutting a box cannot improve its bounds much.
fn is_exhausted<const D: usize>(node: &Node<D>) -> bool {
    node.error == f64::INFINITY
        || node.level.iter().any(|&level| level >= DEEPEST)
        || node.bounds.max - node.bounds.min <= 4.0 * node.error
}

/// Whether rounding errors are as large as the values in a box; or a corner may be zero and
/// all else positive, which is what a box looks like when the determinant touches zero at
/// its border.
fn is_for_exact_arithmetic<const D: usize>(node: &Node<D>) -> bool {
    let Node { bounds, error, .. } = node;
    let touches = |least: f64, corner: f64| least >= -error && corner.abs() <= *error;
    let largest = bounds.max.abs().max(bounds.min.abs());
    *error == f64::INFINITY
        || node.level.iter().any(|&level| level >= DEEPEST)
        || largest <= 4.0 * error
        || touches(bounds.min, bounds.low_corner.0)
        || touches(-bounds.max, bounds.high_corner.0)
}
