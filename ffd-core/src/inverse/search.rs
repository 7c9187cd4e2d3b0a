//! Branch and bound over cells and boxes within them, where Newton's method alone fails.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::bspline::MAX_ORDER;
use crate::grid::Location;
use crate::matrix::cofactors;

use super::Inverse;
use super::bounds::{Candidate, Cells, for_each_index};
use super::newton::Trial;

/// A box is not cut below this part of its cell: its corners are then still exact.
const SMALLEST: f64 = 1.0 / (1_u64 << 46) as f64;

/// A residual, in units of ε · size, from which Newton's method in the whole domain may
/// improve on the one in a cell.
const NEAR: f64 = 1e4;

/// What is known about preimages in the domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Outcome<const D: usize> {
    Found {
        y: [f64; D],
        /// How far the image of y is from the point sought, in units of ε · size.
        residual: f64,
    },
    /// Proven: there is none.
    Excluded,
    /// The budget is spent.
    Unresolved {
        nearest: [f64; D],
        residual: f64,
        boxes: usize,
    },
}

/// A part of a cell that may hold a preimage.
#[derive(Debug, Clone, Copy)]
struct Part<const D: usize> {
    candidate: Candidate<D>,
    low: [f64; D],
    high: [f64; D],
    /// How far the middle of the bounds of its image is from the point sought.
    distance: f64,
    /// The axis along which its image is longest.
    longest: usize,
    /// Whether rounding forbids to cut it further.
    smallest: bool,
}

impl<const D: usize> Part<D> {
    fn middle(&self) -> Location<D> {
        Location {
            cell: self.candidate.cell,
            t: std::array::from_fn(|axis| 0.5 * (self.low[axis] + self.high[axis])),
        }
    }
}

/// The nearest one is looked at first.
impl<const D: usize> Ord for Part<D> {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance)
    }
}

impl<const D: usize> PartialOrd for Part<D> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<const D: usize> PartialEq for Part<D> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<const D: usize> Eq for Part<D> {}

impl<const D: usize> Inverse<'_, D> {
    /// Searches some cells for a preimage of `q`. `best` is the nearest that is known.
    pub(super) fn search(
        &self,
        q: [f64; D],
        cells: &Cells<D>,
        mut best: Option<Trial<D>>,
    ) -> Outcome<D> {
        let mut candidates = Vec::new();
        let mut boxes = 0;
        self.candidates(q, *cells, &mut candidates, &mut boxes);
        if boxes > self.budget {
            return self.undecided(q, best, boxes);
        }
        let mut net = Net::new(self.lattice.grid().order());
        let mut parts = BinaryHeap::new();
        for candidate in candidates {
            boxes += 1;
            if boxes > self.budget {
                return self.undecided(q, best, boxes);
            }
            parts.extend(self.part(q, candidate, [0.0; D], [1.0; D], &mut net));
        }
        // The best of the parts that rounding does not let decide.
        let mut indistinct: Option<Trial<D>> = None;
        while let Some(part) = parts.pop() {
            let mut end = self.newton_in_cell(q, part.middle());
            if (end.residual <= NEAR || part.smallest || self.accepted(&end))
                && let Some(polished) = self.newton(q, end.y)
            {
                end = polished;
            }
            if self.accepted(&end) {
                return end.found();
            }
            keep_nearer(&mut best, end);
            if part.smallest {
                if self.indistinct(q, &end, &part) {
                    keep_nearer(&mut indistinct, end);
                    continue;
                }
                return self.undecided(q, best, boxes);
            }
            let axis = part.longest;
            let middle = 0.5 * (part.low[axis] + part.high[axis]);
            let (mut low, mut high) = (part.low, part.high);
            high[axis] = middle;
            parts.extend(self.part(q, part.candidate, low, high, &mut net));
            (low[axis], high[axis]) = (middle, part.high[axis]);
            parts.extend(self.part(q, part.candidate, low, high, &mut net));
            boxes += 2;
            if boxes > self.budget {
                return self.undecided(q, best, boxes);
            }
        }
        match indistinct {
            Some(end) => end.found(),
            None => Outcome::Excluded,
        }
    }

    fn undecided(&self, q: [f64; D], best: Option<Trial<D>>, boxes: usize) -> Outcome<D> {
        let unit = f64::EPSILON * self.size;
        Outcome::Unresolved {
            nearest: best.map_or(q, |best| best.y),
            residual: best.map_or(f64::INFINITY, |best| best.residual * unit),
            boxes,
        }
    }

    /// Whether `q` differs from an image in a part that cannot be cut further by no
    /// more than bounds and rounding leave open.
    fn indistinct(&self, q: [f64; D], end: &Trial<D>, part: &Part<D>) -> bool {
        let image = self.lattice.deform_point(end.y);
        (0..D).all(|c| (image[c] - q[c]).abs() <= 4.0 * part.candidate.margin[c])
    }

    /// A box of a cell, unless it is proven that no point of it is moved to `q`.
    fn part(
        &self,
        q: [f64; D],
        candidate: Candidate<D>,
        low: [f64; D],
        high: [f64; D],
        net: &mut Net<D>,
    ) -> Option<Part<D>> {
        self.fill(net, candidate.cell, low, high, q);
        let margin = candidate.margin;
        let bounds = net.bounds();
        for c in 0..D {
            if bounds[c][0] > margin[c] || bounds[c][1] < -margin[c] {
                return None;
            }
        }
        // The gradients of lattice coordinates, up to a factor.
        let mut edges = net.edges();
        for edge in &mut edges {
            let length = edge.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            if length > 0.0 {
                *edge = edge.map(|x| x / length);
            }
        }
        for gradient in cofactors(&edges) {
            if net.lies_on_one_side(&gradient, &bounds, &margin) {
                return None;
            }
        }
        let lengths = net.lengths();
        let cuttable = |&axis: &usize| high[axis] - low[axis] > SMALLEST;
        let longest = (0..D).filter(cuttable).max_by(|&a, &b| {
            let widths = (high[a] - low[a]).total_cmp(&(high[b] - low[b]));
            lengths[a].total_cmp(&lengths[b]).then(widths)
        });
        let like_a_point = (0..D).all(|c| bounds[c][1] - bounds[c][0] <= margin[c]);
        Some(Part {
            candidate,
            low,
            high,
            distance: bounds
                .iter()
                .fold(0.0, |most, [a, b]| (0.5 * (a + b)).abs().max(most)),
            longest: longest.unwrap_or(0),
            smallest: like_a_point || longest.is_none(),
        })
    }

    /// Sets the net to the Bézier control points of the deformation on a box of a cell,
    /// relative to `q`.
    fn fill(&self, net: &mut Net<D>, cell: [usize; D], low: [f64; D], high: [f64; D], q: [f64; D]) {
        let grid = self.lattice.grid();
        let order = net.order;
        let block = self.lattice.block(cell);
        net.points.clear();
        for_each_index(order, |index| net.points.push(block.displacement(index)));
        let place = Location { cell, t: low };
        for axis in 0..D {
            let basis = grid.basis(axis, &place);
            let degree = order[axis] - 1;
            // Control point i is the polar form with i arguments at the upper end.
            let mut weights = [[0.0; MAX_ORDER]; MAX_ORDER];
            for (i, weights) in weights[..=degree].iter_mut().enumerate() {
                let mut arguments = [low[axis]; MAX_ORDER];
                arguments[..i].fill(high[axis]);
                *weights = basis.blossoms(&arguments[..degree], 0.0, 1.0);
            }
            net.combine(axis, &weights);
        }
        let mut at = 0;
        let start =
            std::array::from_fn::<_, D, _>(|axis| cell[axis] as f64 - grid.layers(axis) as f64);
        for_each_index(order, |index| {
            let rest = grid.frame().to_world(std::array::from_fn(|axis| {
                let share = index[axis] as f64 / (order[axis] - 1) as f64;
                start[axis] + (low[axis] + share * (high[axis] - low[axis]))
            }));
            for c in 0..D {
                net.points[at][c] += rest[c] - q[c];
            }
            at += 1;
        });
    }
}

fn keep_nearer<const D: usize>(best: &mut Option<Trial<D>>, end: Trial<D>) {
    if best.is_none_or(|best| end.residual < best.residual) {
        *best = Some(end);
    }
}

/// Control points of a polynomial in several variables, the first axis fastest.
struct Net<const D: usize> {
    order: [usize; D],
    points: Vec<[f64; D]>,
}

impl<const D: usize> Net<D> {
    fn new(order: [usize; D]) -> Self {
        Self {
            order,
            points: Vec::with_capacity(order.iter().product()),
        }
    }

    /// Calls `f` with the first index of each row along an axis, and the step in it.
    fn for_each_row(order: [usize; D], axis: usize, mut f: impl FnMut(usize, usize)) {
        let step: usize = order[..axis].iter().product();
        let outer: usize = order[axis + 1..].iter().product();
        for k in 0..outer {
            for i in 0..step {
                f(i + step * order[axis] * k, step);
            }
        }
    }

    /// Replaces each row along an axis by weighted sums of it.
    fn combine(&mut self, axis: usize, weights: &[[f64; MAX_ORDER]; MAX_ORDER]) {
        let count = self.order[axis];
        Self::for_each_row(self.order, axis, |first, step| {
            let mut row = [[0.0; D]; MAX_ORDER];
            for (m, row) in row[..count].iter_mut().enumerate() {
                *row = self.points[first + m * step];
            }
            for (m, weights) in weights[..count].iter().enumerate() {
                let mut sum = [0.0; D];
                for (weight, point) in weights.iter().zip(&row[..count]) {
                    for c in 0..D {
                        sum[c] += weight * point[c];
                    }
                }
                self.points[first + m * step] = sum;
            }
        });
    }

    /// The least and the largest coordinate along each axis of the world.
    fn bounds(&self) -> [[f64; 2]; D] {
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; D];
        for &point in &self.points {
            super::bounds::extend(&mut bounds, point);
        }
        bounds
    }

    /// Along each axis, the sum of the vectors between the ends of all rows.
    fn edges(&self) -> [[f64; D]; D] {
        let mut edges = [[0.0; D]; D];
        for (axis, edge) in edges.iter_mut().enumerate() {
            let last = self.order[axis] - 1;
            Self::for_each_row(self.order, axis, |first, step| {
                let (from, to) = (self.points[first], self.points[first + last * step]);
                *edge = std::array::from_fn(|c| edge[c] + (to[c] - from[c]));
            });
        }
        edges
    }

    /// Along each axis, the length of the longest row, in the maximum norm.
    fn lengths(&self) -> [f64; D] {
        let mut lengths = [0.0_f64; D];
        for (axis, length) in lengths.iter_mut().enumerate() {
            Self::for_each_row(self.order, axis, |first, step| {
                let mut sum = 0.0;
                for m in 1..self.order[axis] {
                    let [a, b] = [m - 1, m].map(|m| self.points[first + m * step]);
                    sum += (0..D).fold(0.0_f64, |most, c| most.max((b[c] - a[c]).abs()));
                }
                *length = length.max(sum);
            });
        }
        lengths
    }

    /// Whether all points lie on one side of the origin along a direction, farther than
    /// they may be off.
    fn lies_on_one_side(
        &self,
        direction: &[f64; D],
        bounds: &[[f64; 2]; D],
        margin: &[f64; D],
    ) -> bool {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for point in &self.points {
            let along: f64 = (0..D).map(|c| direction[c] * point[c]).sum();
            (low, high) = (low.min(along), high.max(along));
        }
        // Products and sums are rounded: each term by less than 4 ε.
        let slack: f64 = (0..D)
            .map(|c| {
                let largest = bounds[c][0].abs().max(bounds[c][1].abs());
                direction[c].abs() * (margin[c] + 4.0 * f64::EPSILON * largest)
            })
            .sum();
        low > slack || high < -slack
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Border, Degree, Frame, Grid, Knots, Lattice};
    use proptest::prelude::*;

    /// A lattice in a skewed frame, from numbers between −1 and 1: displacements of up
    /// to `most` lattice units.
    fn lattice(
        degree: usize,
        knots: Knots,
        border: Border,
        most: f64,
        numbers: &[[f64; 3]],
    ) -> Lattice<3> {
        let axes = [[0.5, 0.25, 0.0], [0.125, 1.0, -0.25], [0.0, 0.5, -1.5]];
        let frame = Frame::new([3.0, -1.0, 2.0], axes).unwrap();
        let grid = Grid::new([Degree::new(degree).unwrap(); 3], [3, 2, 2], frame).unwrap();
        let grid = match border {
            Border::Free => grid.with_knots([knots; 3]).unwrap(),
            Border::Identity => grid.with_border(border).unwrap(),
        };
        let displacements = (0..grid.control_point_count())
            .map(|i| {
                let u = numbers[i % numbers.len()].map(|x| most * x);
                std::array::from_fn(|c| (0..3).map(|a| u[a] * axes[a][c]).sum())
            })
            .collect();
        Lattice::new(grid, displacements).unwrap()
    }

    fn numbers() -> impl Strategy<Value = Vec<[f64; 3]>> {
        proptest::collection::vec(proptest::array::uniform3(-1.0..=1.0_f64), 97)
    }

    fn knots() -> impl Strategy<Value = Knots> {
        prop_oneof![Just(Knots::Uniform), Just(Knots::Clamped)]
    }

    fn border() -> impl Strategy<Value = Border> {
        prop_oneof![Just(Border::Free), Just(Border::Identity)]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        /// The search alone finds what Newton's method finds: both are within what is
        /// promised of the one preimage there is.
        #[test]
        fn the_search_agrees_with_newtons_method(
            degree in 1_usize..=5,
            knots in knots(),
            border in border(),
            numbers in numbers(),
            fractions in proptest::array::uniform3(0.0..=1.0_f64),
        ) {
            // Derivatives are at most 2 n δ per axis, 0.9 in all: the map is injective and
            // ‖J⁻¹‖ at most 10 in lattice coordinates; the condition of the frame is
            // below 10.
            let lattice = lattice(degree, knots, border, 0.15 / degree as f64, &numbers);
            let inverse = Inverse::new(&lattice);
            let domain = lattice.grid().domain();
            let x = lattice.grid().frame().to_world(std::array::from_fn(|i| {
                domain[i][0] + fractions[i] * (domain[i][1] - domain[i][0])
            }));
            prop_assume!(lattice.grid().contains(x));
            let q = lattice.deform_point(x);
            let cells = inverse.reachable(q).expect("x is in one");
            let Outcome::Found { y, residual } = inverse.search(q, &cells, None) else {
                return Err(TestCaseError::fail(format!("{x:?} not found")));
            };
            prop_assert!(residual <= 16.0);
            let tolerance = 64.0 * f64::EPSILON * inverse.size() * 100.0;
            let newton = inverse.newton(q, q).expect("there are numbers in the domain");
            for c in 0..3 {
                prop_assert!((y[c] - x[c]).abs() <= tolerance);
                if inverse.accepted(&newton) {
                    prop_assert!((y[c] - newton.y[c]).abs() <= tolerance);
                }
            }
        }

        /// No box that holds a preimage is discarded, however the lattice folds, and
        /// however small the box.
        #[test]
        fn boxes_with_a_preimage_are_kept(
            degree in 1_usize..=5,
            knots in knots(),
            border in border(),
            numbers in numbers(),
            most in prop_oneof![Just(0.1), Just(1.0), Just(20.0)],
            fractions in proptest::array::uniform3(0.0..=1.0_f64),
            width in 0_i32..46,
        ) {
            let lattice = lattice(degree, knots, border, most, &numbers);
            let inverse = Inverse::new(&lattice);
            let domain = lattice.grid().domain();
            let x = lattice.grid().frame().to_world(std::array::from_fn(|i| {
                domain[i][0] + fractions[i] * (domain[i][1] - domain[i][0])
            }));
            let Some(location) = lattice.grid().locate(x) else {
                return Ok(());
            };
            let q = lattice.deform_point(x);
            let mut candidates = Vec::new();
            let cells = inverse.reachable(q).expect("x is in one");
            inverse.candidates(q, cells, &mut candidates, &mut 0);
            let candidate = candidates.iter().find(|c| c.cell == location.cell);
            let candidate = *candidate.expect("the cell of x is a candidate");
            // The box of a subdivision that holds x.
            let width = 0.5_f64.powi(width);
            let low = location.t.map(|t| ((t / width).floor() * width).min(1.0 - width));
            let high = low.map(|low| low + width);
            let mut net = Net::new(lattice.grid().order());
            prop_assert!(inverse.part(q, candidate, low, high, &mut net).is_some());
        }
    }

    /// Far from the image, a cell is enough; without a budget nothing is claimed.
    #[test]
    fn a_budget_is_kept() {
        let numbers = [[0.9, -0.4, 0.3], [-0.7, 0.2, 0.8], [0.1, 0.6, -0.9]];
        let lattice = lattice(3, Knots::Uniform, Border::Free, 3.0, &numbers);
        let q = [4.0, 0.0, 1.0];
        let inverse = Inverse::new(&lattice).with_budget(0);
        let cells = inverse.reachable(q).expect("displacements are large");
        let Outcome::Unresolved {
            boxes: 1, residual, ..
        } = inverse.search(q, &cells, None)
        else {
            panic!("decided without looking at a box");
        };
        assert!(residual.is_infinite());
        assert!(inverse.reachable([1e3, 0.0, 0.0]).is_none());
    }
}
