//! Boxes of space and way, cut until it is known how far all of them are safe.
//!
//! The box that may fold first is taken: it is cut down to the part of the way that is in
//! doubt, from where it is safe to where some place is known to have folded, which
//! converges quadratically; where that does not help, it is cut in half along the axis of
//! most curvature, or the way is.

use std::collections::BinaryHeap;

use super::super::batch::{self, CHUNK};
use super::super::dominance::{Dominance, lower_bound};
use super::super::partials::{Partials, UNIT};
use super::super::piece::Shape;
use super::super::product::Products;
use super::super::search::DEEPEST;
use super::super::{Effort, Place};
use super::along::{Along, first_fall};
use super::boxes::{TimeBox, end_of};
use super::guess::Guess;
use crate::Lattice;

/// Boxes whose coefficients are kept while they wait, so that memory stays bounded.
const KEPT: usize = 512;

/// If cutting down leaves more than this part of the way, the box is cut in half.
const WORTHWHILE: f64 = 0.5;

/// What is known of the way from one lattice to another.
pub(super) struct Search<'a, const D: usize> {
    pub(super) from: &'a Lattice<D>,
    pub(super) to: &'a Lattice<D>,
    /// Control vectors at both ends.
    start: Partials<D>,
    end: Partials<D>,
    /// How far from the axes columns are there.
    distances: [Dominance<D>; 2],
    products: Products<D>,
    pub(super) shape: Shape,
    pub(super) width: f64,
    pub(super) effort: Effort,
    /// Boxes of the effort that do not count for the budget: the cells.
    free: usize,
    /// At this t, or before, some place has folded; infinite if none is known.
    pub(super) high: f64,
    pub(super) place: Option<Place<D>>,
    /// Boxes that floating point cannot decide, without coefficients.
    pub(super) doubtful: Vec<TimeBox<D>>,
    scratch: Vec<f64>,
}

/// A part of the way, with control vectors at D + 1 places that divide it evenly.
struct Section<const D: usize> {
    t: [f64; 2],
    nodes: Vec<Partials<D>>,
}

impl<'a, const D: usize> Search<'a, D> {
    /// With the control vectors of the first lattice.
    pub(super) fn new(from: &'a Lattice<D>, to: &'a Lattice<D>, start: Partials<D>) -> Self {
        let mut start = start;
        start.prepare();
        let mut end = Partials::without_vectors(to);
        end.prepare();
        let degree = start.degree;
        Self {
            from,
            to,
            distances: [Dominance::new(&start), Dominance::new(&end)],
            start,
            end,
            products: Products::new(degree),
            shape: Shape::new(&Products::result_degree(degree)),
            width: 0.0,
            effort: Effort::default(),
            free: 0,
            high: f64::INFINITY,
            place: None,
            doubtful: Vec::new(),
            scratch: Vec::new(),
        }
    }

    /// Cells of the domain along each axis.
    pub(super) fn cells(&self) -> [usize; D] {
        self.start.cells
    }

    /// Cells that may fold on the whole way, as far as can be told at no cost.
    pub(super) fn cells_in_doubt(&self) -> Vec<[usize; D]> {
        let mut cells = self.moving_cells();
        cells.retain(|&cell| !self.is_dominant(cell, [0.0, 1.0]));
        cells.iter().map(|&cell| self.start.cell(cell)).collect()
    }

    /// How far it is worth proving that nothing folds.
    pub(super) fn target(&self) -> f64 {
        if self.high == f64::INFINITY {
            return 1.0;
        }
        // Rounded up, so that the enclosure is not wider than asked for.
        let target = self.high * (1.0 - self.width);
        target.next_up().next_up().min(self.high.next_down())
    }

    /// Looks at a part of the way. Returns up to where nothing folds in it, but for the
    /// boxes in doubt; infinite if nothing does in all of it.
    pub(super) fn search(&mut self, t: [f64; 2], guess: Option<Guess<D>>, allowed: usize) -> f64 {
        let section = self.section(t);
        let before = self.effort.boxes;
        let mut waiting = BinaryHeap::new();
        let first = guess.map(|guess| self.locate(guess.at));
        if let Some((cell, place)) = first {
            let whole = self.whole_cell(&section, cell);
            self.look_at(&whole, place);
            self.examine(whole, &mut waiting);
        }
        let mut cells = self.moving_cells();
        cells.retain(|&cell| first.is_none_or(|(done, _)| done != cell));
        cells.retain(|&cell| !self.is_dominant(cell, t));
        for cell in self.left_by_batches(&section, &cells) {
            let whole = self.whole_cell(&section, cell);
            self.examine(whole, &mut waiting);
        }
        self.free += self.effort.boxes - before;
        while let Some(mut next) = waiting.pop() {
            if next.safe >= self.target() {
                return next.safe;
            }
            if self.effort.boxes - self.free >= allowed {
                self.doubtful.push(next);
                self.doubtful.extend(waiting);
                for left in &mut self.doubtful {
                    left.coefficients = Vec::new();
                }
                break;
            }
            if next.coefficients.is_empty() && next.error < f64::INFINITY {
                next = self.rebuild(&section, &next);
            }
            if self.is_for_exact_arithmetic(&next) {
                next.coefficients = Vec::new();
                self.doubtful.push(next);
                continue;
            }
            let lowest = self.shape.lowest_place(next.slab(D), &mut self.scratch);
            self.look_at(&next, lowest);
            self.refine(next, &mut waiting);
        }
        f64::INFINITY
    }

    /// Distances of columns from the axes in a cell at both ends of the way, at most.
    fn distances(&self, cell: usize) -> [[f64; D]; 2] {
        let index = self.start.index(self.start.cell(cell));
        [0, 1].map(|end| self.distances[end].of_cell(index))
    }

    /// Whether nothing folds in a cell on a part of the way, because columns are near the axes.
    fn is_dominant(&self, cell: usize, [from, to]: [f64; 2]) -> bool {
        let [start, end] = self.distances(cell);
        let most: [f64; D] = std::array::from_fn(|a| {
            // Convex along the way. Terms are rounded twice, and their sum once.
            let between = |t: f64| (1.0 - t) * start[a] + t * end[a];
            let (at_first, at_last) = (between(from), between(to));
            // Not `f64::max`, which would lose what is not a number.
            let most = if at_first > at_last {
                at_first
            } else {
                at_last
            };
            most * (1.0 + 8.0 * UNIT)
        });
        lower_bound(most).is_some()
    }

    /// The cells, of those given, that may fold before the earliest fold known: as far as
    /// single precision can tell.
    fn left_by_batches(&mut self, section: &Section<D>, cells: &[usize]) -> Vec<usize> {
        if !self.start.is_sound() {
            return cells.to_vec();
        }
        self.effort.boxes += cells.len();
        let nodes: Vec<&Partials<D>> = section.nodes.iter().collect();
        let mut left = Vec::new();
        for list in batch::by_kind(&self.start, cells) {
            let kind = batch::Kind::new(self.products.level, &section.nodes[0], list[0]);
            for chunk in list.chunks(CHUNK) {
                let errors = self.errors(chunk, section);
                let all = kind.bounds_along(&nodes, chunk, &errors);
                for (&cell, bounds) in chunk.iter().zip(all) {
                    let least = bounds.least.map(|c| c - bounds.error);
                    if end_of::<D>(section.t, &least) < self.high {
                        left.push(cell);
                    }
                }
            }
        }
        left.sort_unstable();
        left
    }

    /// By how much control vectors at places of a section may be wrong, of each column in the
    /// given cells.
    fn errors(&self, cells: &[usize], section: &Section<D>) -> Vec<[f64; D]> {
        let error = |&cell: &usize| {
            let [start, end] = self.distances(cell);
            // No vector is longer than its axis and its distance from that.
            std::array::from_fn(|a| {
                let ends = [1.0 + start[a], 1.0 + end[a]];
                self.start.error_between(ends, section.t[1])
            })
        };
        cells.iter().map(error).collect()
    }

    fn section(&self, [from, to]: [f64; 2]) -> Section<D> {
        let node = |j: usize| {
            let t = match j {
                0 => from,
                _ if j == D => to,
                _ => from + (to - from) * (j as f64 / D as f64),
            };
            self.start.between(&self.end, t)
        };
        Section {
            t: [from, to],
            nodes: (0..=D).map(node).collect(),
        }
    }

    /// The cells in which a control point moves.
    fn moving_cells(&self) -> Vec<usize> {
        let grid = self.from.grid();
        let mut moving = vec![false; self.start.cell_count()];
        let both = self
            .from
            .displacements()
            .iter()
            .zip(self.to.displacements());
        for (index, (from, to)) in both.enumerate() {
            if from != to {
                let mut at = grid.control_point_indices(index);
                for (axis, at) in at.iter_mut().enumerate() {
                    *at += grid.layers(axis);
                }
                self.start.for_cells_around(at, |cell| moving[cell] = true);
            }
        }
        (0..moving.len()).filter(|&cell| moving[cell]).collect()
    }

    /// The cell of a point of the domain and the place in it.
    fn locate(&self, at: [f64; D]) -> (usize, [f64; 3]) {
        let mut place = [0.0; 3];
        let cell = std::array::from_fn(|axis| {
            let last = self.start.cells[axis] - 1;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a point of the domain"
            )]
            let cell = (at[axis].floor() as usize).min(last);
            place[axis] = (at[axis] - cell as f64).clamp(0.0, 1.0);
            cell
        });
        (self.start.number(cell), place)
    }

    /// The determinant over a cell and a part of the way: interpolated from those at D + 1
    /// places.
    fn whole_cell(&mut self, section: &Section<D>, cell: usize) -> TimeBox<D> {
        let at = self.start.cell(cell);
        let ends = [self.start.norms(at), self.end.norms(at)];
        let errors: [f64; D] = std::array::from_fn(|a| {
            let ends = [ends[0][a], ends[1][a]];
            self.start.error_between(ends, section.t[1])
        });
        let mut coefficients = Vec::new();
        let mut error = 0.0_f64;
        for node in &section.nodes {
            let values = &mut self.scratch;
            self.products.determinant(node, at, values);
            coefficients.extend_from_slice(values);
            let bound = self.products.rounding.bound_with(node.norms(at), errors);
            // Also where it is not a number.
            error = if bound <= error { error } else { bound };
        }
        let mut largest = 0.0_f64;
        for k in 0..=D {
            let count = coefficients.len() / (D + 1);
            let bounds = self.shape.bounds(&coefficients[k * count..(k + 1) * count]);
            largest = largest.max(bounds.max.abs()).max(bounds.min.abs());
        }
        interpolate::<D>(&mut coefficients);
        let error = error_of_way(error, largest, UNIT);
        let sound = self.start.is_sound() && error < f64::INFINITY;
        TimeBox {
            safe: section.t[0],
            cell,
            low: [0.0; D],
            level: [0; D],
            t: section.t,
            coefficients,
            error: if sound { error } else { f64::INFINITY },
            largest: 5.7 * largest,
        }
    }

    /// Computes the coefficients of a box again.
    fn rebuild(&mut self, section: &Section<D>, node: &TimeBox<D>) -> TimeBox<D> {
        let mut part = self.whole_cell(section, node.cell);
        for axis in 0..D {
            let mut position = node.low[axis];
            for _ in 0..node.level[axis] {
                position *= 2.0;
                let [low, high] = part.cut(&self.shape, axis);
                part = if position >= 1.0 { high } else { low };
                position -= position.floor();
            }
        }
        if part.t != node.t {
            part.restrict(self.products.level, node.t[0], node.t[1]);
        }
        part.safe = node.safe;
        part
    }

    /// Bounds a box; it waits if it may fold before the earliest fold known.
    fn examine(&mut self, mut part: TimeBox<D>, waiting: &mut BinaryHeap<TimeBox<D>>) {
        self.effort.boxes += 1;
        if part.error < f64::INFINITY {
            for corner in 0..1 << D {
                let along = part.at_corner(&self.shape, corner);
                let place = |axis: usize| f64::from(u8::from(corner >> axis & 1 == 1));
                let error = part.error + 256.0 * UNIT * part.largest;
                self.record_fall(&part, &along, error, std::array::from_fn(place));
            }
        }
        part.bound(&self.shape, self.high, &mut self.scratch);
        if part.safe < self.high {
            if waiting.len() >= KEPT {
                part.coefficients = Vec::new();
            }
            waiting.push(part);
        }
    }

    /// Looks for a fold at a place in a box.
    fn look_at(&mut self, part: &TimeBox<D>, place: [f64; 3]) {
        if part.error == f64::INFINITY {
            return;
        }
        // A place that is an exact number in the cell.
        let size = part.size();
        let mut exact = [0.0; 3];
        for axis in 0..D {
            let in_cell = part.low[axis] + place[axis] * size[axis];
            exact[axis] = ((in_cell - part.low[axis]) / size[axis]).clamp(0.0, 1.0);
        }
        let along = part.at(&self.shape, exact);
        let error = part.error + 512.0 * UNIT * part.largest;
        self.record_fall(part, &along, error, exact);
    }

    fn record_fall(&mut self, part: &TimeBox<D>, along: &Along, error: f64, place: [f64; 3]) {
        let raised = along.map(|c| c + error);
        if let Some(s) = first_fall::<D>(&raised) {
            let size = part.size();
            let t = std::array::from_fn(|a| part.low[a] + place[a] * size[a]);
            let time = part.time(s) * (1.0 + 4.0 * f64::EPSILON);
            self.record(part.cell, t, time.min(part.t[1]));
        }
    }

    /// Something has folded at a place of a cell, at the time given or before.
    pub(super) fn record(&mut self, cell: usize, t: [f64; D], time: f64) {
        if time < self.high {
            let cell = self.start.cell(cell);
            let grid = self.from.grid();
            let u = std::array::from_fn(|a| cell[a] as f64 - grid.layers(a) as f64 + t[a]);
            self.high = time;
            self.place = Some(Place {
                cell,
                t,
                world: grid.frame().to_world(u),
            });
        }
    }

    /// Cuts a box down or in half.
    fn refine(&mut self, mut part: TimeBox<D>, waiting: &mut BinaryHeap<TimeBox<D>>) {
        let level = self.products.level;
        let (from, to) = (part.safe, part.t[1].min(self.high));
        if from >= to {
            return;
        }
        let before = part.t[1] - part.t[0];
        if [from, to] != part.t {
            part.restrict(level, from, to);
        }
        if to - from <= WORTHWHILE * before {
            self.examine(part, waiting);
            return;
        }
        let (curvature, along) = part.curvatures(&self.shape);
        // A polynomial of degree n keeps within n / 8 second differences of its
        // coefficients.
        let mut axis = D;
        let mut most = along * D as f64;
        for a in 0..D {
            let distance = curvature[a] * (self.shape.counts[a] - 1) as f64;
            if distance > most && distance > part.error {
                (axis, most) = (a, distance);
            }
        }
        if axis < D {
            for half in part.cut(&self.shape, axis) {
                self.examine(half, waiting);
            }
        } else {
            let middle = f64::midpoint(from, to);
            // Shorter ways do not help where rounding is larger than what changes along them.
            if most <= part.error || middle <= from || to <= middle {
                part.coefficients = Vec::new();
                self.doubtful.push(part);
                return;
            }
            let mut later = part.clone();
            part.restrict(level, from, middle);
            later.restrict(level, middle, to);
            later.safe = middle;
            self.examine(part, waiting);
            self.examine(later, waiting);
        }
    }

    /// Whether rounding errors are as large as the values at the beginning of the box, or a
    /// corner may be zero there and all else positive.
    fn is_for_exact_arithmetic(&self, part: &TimeBox<D>) -> bool {
        if part.error == f64::INFINITY || part.level.iter().any(|&level| level >= DEEPEST) {
            return true;
        }
        if part.t[1] - part.t[0] <= 16.0 * f64::EPSILON * part.t[1] {
            return true;
        }
        let error = part.error;
        let bounds = self.shape.bounds(part.slab(0));
        let touches = bounds.min >= -error && bounds.low_corner.0 <= error;
        part.safe <= part.t[0] && (touches || bounds.max <= 4.0 * error)
    }
}

/// The error of coefficients along the way, from that of the values at D + 1 places, the
/// largest of these, and the unit roundoff.
///
/// The weights of the values in a coefficient add up to at most 34/6 in absolute value; a sum
/// of as many products is rounded less than 8 times.
pub(in super::super) fn error_of_way(error: f64, largest: f64, unit: f64) -> f64 {
    5.7 * error + 64.0 * unit * (largest + error)
}

/// From the values at D + 1 evenly spaced places to Bernstein coefficients.
fn interpolate<const D: usize>(values: &mut [f64]) {
    let count = values.len() / (D + 1);
    let (first, rest) = values.split_at_mut(count);
    let (second, rest) = rest.split_at_mut(count);
    if D == 2 {
        for ((a, b), c) in first.iter().zip(second).zip(rest) {
            *b = 2.0 * *b - 0.5 * (a + *c);
        }
        return;
    }
    let (third, last) = rest.split_at_mut(count);
    for (((a, b), c), d) in first.iter().zip(second).zip(third).zip(last) {
        let (p, q) = (*b, *c);
        *b = (18.0 * p - 9.0 * q + (2.0 * *d - 5.0 * a)) / 6.0;
        *c = (18.0 * q - 9.0 * p + (2.0 * a - 5.0 * *d)) / 6.0;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::injectivity::samples::{grid, noisy};

    /// What single precision and what columns say of whole cells is what double precision
    /// says, within the bounds of their errors.
    fn check_cells<const D: usize>(
        degree: usize,
        size: f64,
        seed: u64,
        t: [f64; 2],
    ) -> Result<(), TestCaseError> {
        let grid = grid([degree; D], [2; D]);
        let (from, to) = (noisy(grid.clone(), 0.1, seed), noisy(grid, size, seed + 1));
        let mut search = Search::new(&from, &to, Partials::without_vectors(&from));
        let section = search.section(t);
        let cells: Vec<usize> = (0..search.start.cell_count()).collect();
        let nodes: Vec<_> = section.nodes.iter().collect();
        let kind = batch::Kind::new(search.products.level, &section.nodes[0], 0);
        let bounds = kind.bounds_along(&nodes, &cells, &search.errors(&cells, &section));
        for (cell, bounds) in cells.into_iter().zip(bounds) {
            let whole = search.whole_cell(&section, cell);
            let dominant = search.is_dominant(cell, t);
            for k in 0..=D {
                let least = search.shape.bounds(whole.slab(k)).min;
                let tolerance = bounds.error + whole.error;
                prop_assert!((bounds.least[k] - least).abs() <= tolerance);
                prop_assert!(!dominant || least > -whole.error);
            }
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn cheap_bounds_agree_with_double_precision(
            degree in 1_usize..=5,
            size in prop_oneof![Just(0.05), Just(0.5), Just(3.0)],
            seed in 1_u64..1000,
            from in 0.0..0.5,
            length in 0.01..0.5,
        ) {
            check_cells::<2>(degree, size, seed, [from, from + length])?;
            check_cells::<3>(degree.min(3), size, seed, [from, from + length])?;
        }
    }
}
