//! Where a preimage can be: bounds of displacements, and what rounding does to them.

use crate::Grid;

use super::Inverse;

/// What rounding can do to positions in a grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rounding<const D: usize> {
    /// In the lattice coordinates of a world point of the domain, relative to the
    /// computed inverse of the frame.
    pub(super) lattice: [f64; D],
    /// In world coordinates, between a point and the world position of its exact
    /// lattice coordinates: the inverse of the frame is rounded too.
    frame: [f64; D],
    /// In lattice coordinates, on the way to the world and back.
    pub(super) round_trip: [f64; D],
    /// In the world coordinates of a point of the domain.
    pub(super) world: [f64; D],
}

impl<const D: usize> Rounding<D> {
    pub(super) fn new(grid: &Grid<D>) -> Self {
        let (axes, inverse) = (grid.frame().axes(), grid.frame().inverse());
        let domain = grid.domain();
        let size = grid.size();
        // |x − origin| along each axis of the world.
        let reach: [f64; D] = std::array::from_fn(|c| {
            (0..D)
                .map(|i| domain[i][1].max(-domain[i][0]) * axes[i][c].abs())
                .sum()
        });
        let through_inverse = |world: [f64; D]| -> [f64; D] {
            inverse.map(|row| (0..D).map(|c| row[c].abs() * world[c]).sum())
        };
        let through_axes = |lattice: [f64; D]| -> [f64; D] {
            std::array::from_fn(|c| (0..D).map(|i| lattice[i] * axes[i][c].abs()).sum())
        };
        // A difference, a product and a sum of at most three are rounded: two ε.
        let reached = through_inverse(reach);
        let lattice = std::array::from_fn(|i| 4.0 * f64::EPSILON * (reached[i] + 1.0));
        // Elimination on a few columns: less than 16 ε in the product with the inverse.
        let frame = through_axes(reached).map(|x| 16.0 * f64::EPSILON * x);
        let positions = through_inverse(frame.map(|x| x + f64::EPSILON * size));
        Self {
            lattice,
            frame,
            round_trip: std::array::from_fn(|i| lattice[i] + positions[i]),
            world: std::array::from_fn(|c| {
                f64::EPSILON * (grid.frame().origin()[c].abs() + reach[c])
            }),
        }
    }

    /// By how much an image of a point, as computed, can differ from the bounds that
    /// follow from exact lattice coordinates, if displacements near by are in `hull`.
    pub(super) fn of_image(&self, grid: &Grid<D>, size: f64, hull: &[[f64; 2]; D]) -> [f64; D] {
        std::array::from_fn(|c| {
            let [low, high] = hull[c];
            // A product of basis functions has less than 60 roundings, a sum 18 more,
            // in the image and in the bounds; and positions are rounded at `size`.
            let sums = f64::EPSILON * (200.0 * low.abs().max(high.abs()) + 8.0 * size);
            // No derivative of a spline exceeds its degree times the difference of
            // two control points.
            let slopes: f64 = grid
                .degree()
                .iter()
                .zip(self.lattice)
                .map(|(n, error)| n.get() as f64 * (high - low) * error)
                .sum();
            sums + slopes + self.frame[c]
        })
    }
}

/// Cells of the domain, a box of them: the first and the last along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cells<const D: usize> {
    pub(super) first: [usize; D],
    pub(super) last: [usize; D],
}

impl<const D: usize> Cells<D> {
    fn len(&self, axis: usize) -> usize {
        self.last[axis] - self.first[axis] + 1
    }

    fn longest_axis(&self) -> usize {
        (0..D)
            .max_by_key(|&axis| self.len(axis))
            .expect("there are axes")
    }

    /// Whether less than half as many as in another box.
    fn less_than_half_of(&self, other: &Self) -> bool {
        let share = |axis| self.len(axis) as f64 / other.len(axis) as f64;
        (0..D).map(share).product::<f64>() < 0.5
    }
}

/// A cell and the bounds of the displacements of its control points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate<const D: usize> {
    pub(super) cell: [usize; D],
    /// What rounding can do to images in this cell.
    pub(super) margin: [f64; D],
}

impl<const D: usize> Inverse<'_, D> {
    /// The cells from which the largest displacements of the lattice reach `q`; `None`
    /// if there are none.
    pub(super) fn reachable(&self, q: [f64; D]) -> Option<Cells<D>> {
        let grid = self.lattice.grid();
        let all = Cells {
            first: [0; D],
            last: std::array::from_fn(|axis| grid.domain_cells(axis) - 1),
        };
        self.contract(q, &self.hull, &all)
    }

    /// Adds the single cells among `cells` that can hold a preimage of `q`. Counts
    /// ranges of cells looked at, as the boxes that they are, and stops when the budget
    /// is spent.
    pub(super) fn candidates(
        &self,
        q: [f64; D],
        mut cells: Cells<D>,
        out: &mut Vec<Candidate<D>>,
        boxes: &mut usize,
    ) {
        loop {
            *boxes += 1;
            if *boxes > self.budget {
                return;
            }
            let hull = self.hull_of(&cells);
            let Some(fewer) = self.contract(q, &hull, &cells) else {
                return;
            };
            if fewer.first == fewer.last {
                out.push(Candidate {
                    cell: fewer.first,
                    margin: self
                        .rounding
                        .of_image(self.lattice.grid(), self.size, &hull),
                });
                return;
            }
            let again = fewer.less_than_half_of(&cells);
            cells = fewer;
            if !again {
                break;
            }
        }
        let axis = cells.longest_axis();
        let middle = cells.first[axis] + cells.len(axis) / 2;
        let (mut low, mut high) = (cells, cells);
        low.last[axis] = middle - 1;
        high.first[axis] = middle;
        self.candidates(q, low, out, boxes);
        self.candidates(q, high, out, boxes);
    }

    /// The cells among `cells` that can hold a point that a displacement in `hull`
    /// moves to `q`.
    fn contract(&self, q: [f64; D], hull: &[[f64; 2]; D], cells: &Cells<D>) -> Option<Cells<D>> {
        let grid = self.lattice.grid();
        let (origin, inverse) = (grid.frame().origin(), grid.frame().inverse());
        let margin = self.rounding.of_image(grid, self.size, hull);
        let mut fewer = *cells;
        for (axis, row) in inverse.iter().enumerate() {
            let (mut low, mut high) = (0.0, 0.0);
            for c in 0..D {
                // Where the point can be, relative to the origin.
                let pad = margin[c]
                    + 8.0
                        * f64::EPSILON
                        * (q[c].abs() + origin[c].abs() + hull[c][0].abs().max(hull[c][1].abs()));
                let from = q[c] - hull[c][1] - origin[c] - pad;
                let to = q[c] - hull[c][0] - origin[c] + pad;
                let [a, b] = [row[c] * from, row[c] * to];
                // Each end of a product is rounded, and so is the sum.
                let slack = 4.0 * f64::EPSILON * a.abs().max(b.abs());
                low += a.min(b) - slack;
                high += a.max(b) + slack;
            }
            let layers = grid.layers(axis) as f64;
            let slack = self.rounding.lattice[axis];
            let low = (low + layers - slack).floor();
            let high = (high + layers + slack).floor();
            // Comparisons with NaN, after an overflow, are false: nothing is discarded.
            if high < cells.first[axis] as f64 || low > cells.last[axis] as f64 {
                return None;
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "compared with cell numbers, which are not negative"
            )]
            if low > cells.first[axis] as f64 {
                fewer.first[axis] = low as usize;
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "compared with cell numbers, which are not negative"
            )]
            if high < cells.last[axis] as f64 {
                fewer.last[axis] = high as usize;
            }
        }
        Some(fewer)
    }

    /// Bounds of the displacements of the control points that act on some cells.
    fn hull_of(&self, cells: &Cells<D>) -> [[f64; 2]; D] {
        let order = self.lattice.grid().order();
        let counts = std::array::from_fn(|axis| cells.len(axis) - 1 + order[axis]);
        let block = self.lattice.block(cells.first);
        let mut hull = [[f64::INFINITY, f64::NEG_INFINITY]; D];
        for_each_index(counts, |index| extend(&mut hull, block.displacement(index)));
        hull
    }
}

/// Widens bounds so that they hold a point.
pub(super) fn extend<const D: usize>(hull: &mut [[f64; 2]; D], point: [f64; D]) {
    for (bounds, x) in hull.iter_mut().zip(point) {
        *bounds = [bounds[0].min(x), bounds[1].max(x)];
    }
}

/// Calls `f` with all indices below the counts, the first axis fastest.
pub(super) fn for_each_index<const D: usize>(counts: [usize; D], mut f: impl FnMut([usize; D])) {
    let mut index = [0; D];
    loop {
        f(index);
        let mut axis = 0;
        loop {
            index[axis] += 1;
            if index[axis] < counts[axis] {
                break;
            }
            index[axis] = 0;
            axis += 1;
            if axis == D {
                return;
            }
        }
    }
}
