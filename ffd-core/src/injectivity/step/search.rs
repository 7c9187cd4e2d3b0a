//! Boxes of space and way, cut until it is known how far all of them are safe.
//!
//! The box that may fold first is taken: it is cut down to the part of the way that is in
//! doubt, from where it is safe to where some place is known to have folded, which
//! converges quadratically; where that does not help, it is cut in half along the axis of
//! most curvature, or the way is.

use std::collections::BinaryHeap;

use super::super::partials::{Partials, UNIT};
use super::super::piece::Shape;
use super::super::product::Products;
use super::super::search::DEEPEST;
use super::super::{Effort, Place};
use super::along::{Along, first_fall};
use super::boxes::TimeBox;
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
    products: Products<D>,
    pub(super) shape: Shape,
    pub(super) width: f64,
    pub(super) effort: Effort,
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
            start,
            end,
            products: Products::new(degree),
            shape: Shape::new(&Products::result_degree(degree)),
            width: 0.0,
            effort: Effort::default(),
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
        let mut waiting = BinaryHeap::new();
        let first = guess.map(|guess| self.locate(guess.at));
        if let Some((cell, place)) = first {
            let whole = self.whole_cell(&section, cell);
            self.look_at(&whole, place);
            self.examine(whole, &mut waiting);
        }
        for cell in self.moving_cells() {
            if first.is_none_or(|(done, _)| done != cell) {
                let whole = self.whole_cell(&section, cell);
                self.examine(whole, &mut waiting);
            }
        }
        // One for each cell is for free.
        let allowed = allowed.saturating_add(self.start.cell_count());
        while let Some(mut next) = waiting.pop() {
            if next.safe >= self.target() {
                return next.safe;
            }
            if self.effort.boxes >= allowed {
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
    ///
    /// # Rounding
    ///
    /// The weights of the determinants in a coefficient add up to at most 34/6 in absolute
    /// value; a sum of as many products is rounded less than 8 times.
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
        let error = 5.7 * error + 64.0 * UNIT * (largest + error);
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
        if raised[..=D].iter().all(|&c| c > 0.0) {
            return;
        }
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
