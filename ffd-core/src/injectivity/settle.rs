//! Boxes that floating point left in doubt, in exact arithmetic.

use super::exact::ExactPiece;
use super::queue::Node;
use super::search::{DEEPEST, Part, Search, State};
use super::{Budget, Place, Undecided};
use crate::Lattice;

/// Boxes of exact arithmetic for each box in doubt, before any gets more.
const FEW: usize = 16;

impl<const D: usize> Search<D> {
    /// Records that a box could not be decided; of several in a cell, the one with the
    /// lowest bound.
    fn record_doubt(&mut self, node: &Node<D>) {
        let undecided = self.undecided(node);
        let state = &mut self.states[node.cell];
        if !matches!(state, State::Doubtful(old) if old.det[0] <= undecided.det[0]) {
            *state = State::Doubtful(Box::new(undecided));
        }
    }

    /// Boxes that floating point left in doubt. Each gets a few boxes of exact arithmetic
    /// first, so that one that takes all of the budget does not keep it from the others.
    pub(super) fn decide_exactly(
        &mut self,
        lattice: &Lattice<D>,
        nodes: Vec<Node<D>>,
        budget: &Budget,
        all: bool,
        reversed: bool,
    ) {
        let allowed = self.effort.exact_boxes.saturating_add(budget.exact_boxes);
        let mut open = nodes;
        for share in [FEW, usize::MAX] {
            let mut cached: Option<(usize, ExactPiece)> = None;
            for node in std::mem::take(&mut open) {
                if (reversed || !all) && self.both_signs().is_some() {
                    return;
                }
                if !reversed && matches!(self.states[node.cell], State::Folded(_)) {
                    continue;
                }
                let limit = allowed.min(self.effort.exact_boxes.saturating_add(share));
                if self.effort.exact_boxes >= limit {
                    open.push(node);
                    continue;
                }
                let whole = match cached.take() {
                    Some((cell, piece)) if cell == node.cell => piece,
                    _ => ExactPiece::of_cell(lattice, self.partials.cell(node.cell)),
                };
                let found = self.search_exactly(lattice, &whole, &node, limit, reversed);
                cached = Some((node.cell, whole));
                match found {
                    Some(found) => self.take_over(node.cell, found, reversed),
                    None => open.push(node),
                }
            }
        }
        for node in &open {
            self.record_doubt(node);
        }
    }

    fn take_over(&mut self, cell: usize, found: Exactly<D>, reversed: bool) {
        match found {
            Exactly::Right => self.close_part(cell, Part::Right(0.0), reversed),
            Exactly::Zero(place) => {
                self.least_seen = self.least_seen.min(0.0);
                self.close_part(cell, Part::Zero(place), reversed);
            }
            Exactly::Wrong(place) if reversed => self.positive = Some(place),
            Exactly::Wrong(place) => {
                self.least_seen = self.least_seen.min(0.0);
                self.negative = self.negative.or(Some(place));
                self.states[cell] = State::Folded(Box::new(place));
            }
        }
    }

    fn undecided(&self, node: &Node<D>) -> Undecided<D> {
        let bounds = node.bounds;
        let det = if node.error.is_finite() {
            [bounds.min - node.error, bounds.max + node.error]
        } else {
            [f64::NEG_INFINITY, f64::INFINITY]
        };
        Undecided {
            cell: self.partials.cell(node.cell),
            part: node.part(),
            det: self.partials.divide_by_frame(det),
        }
    }

    /// What exact arithmetic says of a box; `None` if the limit of boxes is reached before.
    fn search_exactly(
        &mut self,
        lattice: &Lattice<D>,
        whole: &ExactPiece,
        node: &Node<D>,
        limit: usize,
        reversed: bool,
    ) -> Option<Exactly<D>> {
        // Each halving on the way to the part computes as much as a box.
        let halvings = usize::try_from(node.level.iter().sum::<i32>()).expect("not negative");
        self.effort.exact_boxes += halvings;
        let limit = limit.saturating_add(halvings);
        let mut stack = vec![(whole.part(node.low, node.level), node.low, node.level)];
        let mut zero = None;
        while let Some((piece, low, level)) = stack.pop() {
            if self.effort.exact_boxes >= limit {
                return None;
            }
            self.effort.exact_boxes += 1;
            let signs = piece.signs(&self.shape);
            let size = level.map(|l| 0.5_f64.powi(l));
            let place = |corner: usize| {
                let end = |a: usize| f64::from(u8::from(corner >> a & 1 == 1));
                let t = std::array::from_fn(|a| low[a] + size[a] * end(a));
                self.place(lattice, node.cell, t)
            };
            let (wrong, any_wrong, right) = if reversed {
                (signs.positive_corner, signs.any_positive, None)
            } else {
                (
                    signs.negative_corner,
                    signs.any_negative,
                    signs.positive_corner,
                )
            };
            if let Some(corner) = wrong {
                return Some(Exactly::Wrong(place(corner)));
            }
            // All coefficients zero or right: a zero of the polynomial is one of a corner.
            if !any_wrong && zero.is_none() {
                zero = signs.zero_corner.map(place);
            }
            if self.positive.is_none() {
                self.positive = right.map(place);
            }
            if !any_wrong {
                continue;
            }
            let axis = (0..D).min_by_key(|&a| level[a]).expect("two or three axes");
            if level[axis] >= DEEPEST {
                return None;
            }
            let mut finer = level;
            finer[axis] += 1;
            let mut upper = low;
            upper[axis] += 0.5 * size[axis];
            let [low_piece, high_piece] = piece.split(axis);
            stack.push((high_piece, upper, finer));
            stack.push((low_piece, low, finer));
        }
        Some(zero.map_or(Exactly::Right, Exactly::Zero))
    }
}

/// What exact arithmetic says about a box.
enum Exactly<const D: usize> {
    /// The sign is the one to be proven.
    Right,
    /// There is a zero, and no value of the other sign.
    Zero(Place<D>),
    /// The sign is the other one at a place.
    Wrong(Place<D>),
}
