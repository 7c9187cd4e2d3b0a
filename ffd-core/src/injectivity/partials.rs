//! The partial derivatives of the map in lattice coordinates, as B-splines.
//!
//! With `M`, the stored inverse of the frame, taken as an exact matrix, the map
//! `u ↦ M (F(o + A u) − o)` has the Jacobian `M (A + D) = M J A`, where
//! `D = Σ dᵢ ∇Bᵢᵀ`. Its determinant is `det J` times the constant `det(M A)`, which is 1
//! up to rounding; so its sign is that of `det J`, whatever the rounding of `M`. Its column
//! for axis a is a spline on the same knots, one degree lower along a, with the control
//! vectors
//!
//! ```text
//! vᵢ = M A eₐ + M (dᵢ₊₁ − dᵢ) n / (κᵢ₊ₙ₊₁ − κᵢ₊₁).
//! ```
//!
//! Displacements are subtracted before anything else, so that a large translation of the
//! whole lattice costs no accuracy.
//!
//! # Rounding
//!
//! Let u be the unit roundoff, and K the largest row sum of |M| |A|, 1 for axes at right
//! angles. A difference, a sum of D products and a factor are rounded 7 times relative to
//! |M| |Δd|, and |M| |Δd| ≤ K ‖A⁻¹ Δd‖∞, which is at most 1.02 K (‖v‖ + 1.02); `M A` is
//! rounded by at most 4 u K. Together an entry of v is wrong by less than
//! 12 u K (N + 1), if no control vector for the axis has a 1-norm above N.

use crate::bspline::{Axis, BezierTables};
use crate::{Grid, Lattice};

/// The unit roundoff of `f64`.
pub(super) const UNIT: f64 = f64::EPSILON / 2.0;

/// See the [module](self).
#[derive(Debug, Clone)]
pub(super) struct Partials<const D: usize> {
    /// Cells of the domain.
    pub(super) cells: [usize; D],
    pub(super) degree: [usize; D],
    /// Control points of the domain, with the fixed ones of a border.
    pub(super) counts: [usize; D],
    /// From one control point to the next along each axis, in memory.
    pub(super) stride: [usize; D],
    /// Fixed control points before the first of the lattice.
    layers: [usize; D],
    displacements: Vec<[f64; D]>,
    /// `vectors[a][c]`: component c of the control vectors for axis a, one for each control
    /// point; the last along axis a means nothing. Empty until [`Partials::prepare`].
    pub(super) vectors: [[Vec<f64>; D]; D],
    /// `n / (κᵢ₊ₙ₊₁ − κᵢ₊₁)` along each axis; empty if all are one.
    slopes: [Vec<f64>; D],
    /// `M`.
    inverse: [[f64; D]; D],
    /// `M A`, rounded.
    product: [[f64; D]; D],
    /// An upper bound of K.
    condition: f64,
    /// An interval that contains `det(M A)`; empty if that may be far from 1.
    pub(super) frame_determinant: [f64; 2],
    /// The conversion to Bézier form of each kind of cell, and the kind of each cell.
    tables: [Vec<BezierTables>; D],
    kinds: [Vec<usize>; D],
}

impl<const D: usize> Partials<D> {
    #[cfg(test)]
    pub(super) fn new(lattice: &Lattice<D>) -> Self {
        let mut partials = Self::without_vectors(lattice);
        partials.prepare();
        partials
    }

    /// With displacements alone: enough for the conic-hull test of a whole lattice.
    pub(super) fn without_vectors(lattice: &Lattice<D>) -> Self {
        let grid = lattice.grid();
        let layers: [usize; D] = std::array::from_fn(|axis| grid.layers(axis));
        let cells = std::array::from_fn(|axis| grid.domain_cells(axis));
        let degree = grid.degree().map(crate::Degree::get);
        let counts: [usize; D] = std::array::from_fn(|axis| cells[axis] + degree[axis]);
        let mut stride = [1; D];
        for axis in 1..D {
            stride[axis] = stride[axis - 1] * counts[axis - 1];
        }
        let total = counts.iter().product();
        let (inverse, product, condition, frame_determinant) = frame_product(grid);
        let mut partials = Self {
            cells,
            degree,
            counts,
            stride,
            layers,
            displacements: Vec::new(),
            vectors: std::array::from_fn(|_| std::array::from_fn(|_| Vec::new())),
            slopes: std::array::from_fn(|axis| slopes(&grid.axes()[axis])),
            inverse,
            product,
            condition,
            frame_determinant,
            tables: std::array::from_fn(|axis| BezierTables::of_axis(&grid.axes()[axis])),
            kinds: std::array::from_fn(|axis| {
                let cells = 0..cells[axis];
                cells.map(|cell| grid.kind_of_cell(axis, cell)).collect()
            }),
        };
        partials.copy_displacements(lattice, total);
        partials
    }

    /// With zeros for the fixed control points of a border.
    fn copy_displacements(&mut self, lattice: &Lattice<D>, total: usize) {
        if self.layers == [0; D] {
            self.displacements = lattice.displacements().to_vec();
            return;
        }
        self.displacements = vec![[0.0; D]; total];
        let own = lattice.grid().control_points_per_axis();
        let rows = lattice.displacements().chunks_exact(own[0]);
        for (number, row) in rows.enumerate() {
            let start = self.layers[0] + self.row_of(number, &own);
            self.displacements[start..start + own[0]].copy_from_slice(row);
        }
    }

    /// Control vectors part of the way, `t` from 0 to 1, to those of a lattice on the same
    /// grid. Both must have been [prepared](Partials::prepare). What they are rounded by is
    /// bounded by [`Partials::error_between`].
    pub(super) fn between(&self, to: &Self, t: f64) -> Self {
        let mix = |from: &[f64], to: &[f64]| -> Vec<f64> {
            let both = from.iter().zip(to);
            both.map(|(a, b)| (1.0 - t) * a + t * b).collect()
        };
        Self {
            displacements: Vec::new(),
            vectors: std::array::from_fn(|a| {
                std::array::from_fn(|c| mix(&self.vectors[a][c], &to.vectors[a][c]))
            }),
            slopes: self.slopes.clone(),
            tables: self.tables.clone(),
            kinds: self.kinds.clone(),
            ..*self
        }
    }

    /// Whether control vectors follow from differences by a factor for each component: `M`
    /// is diagonal, and knots are uniform along an axis.
    fn is_plain(&self, axis: usize) -> bool {
        let unit = crate::frame::unit_entry;
        let zero = |r: usize, c: usize| unit(r, c) != 0.0 || self.inverse[r][c] == 0.0;
        self.slopes[axis].is_empty() && (0..D).all(|r| (0..D).all(|c| zero(r, c)))
    }

    /// Computes all control vectors, unless that was done before.
    pub(super) fn prepare(&mut self) {
        if !self.vectors[0][0].is_empty() {
            return;
        }
        for axis in 0..D {
            if self.is_plain(axis) {
                self.set_axis_plain(axis);
            } else {
                for list in &mut self.vectors[axis] {
                    list.resize(self.displacements.len(), 0.0);
                }
                for index in 0..self.displacements.len() {
                    self.set_vector(axis, index);
                }
            }
        }
    }

    /// Where control vectors follow from differences by a factor for each component:
    /// displacements from the first control point on and from the next along the axis on,
    /// the factors, and what is added. Entries between the lines of control points mean
    /// nothing.
    pub(super) fn plain(&self, axis: usize) -> Option<Plain<'_, D>> {
        let stride = self.stride[axis];
        self.is_plain(axis).then(|| Plain {
            from: &self.displacements[..self.displacements.len() - stride],
            to: &self.displacements[stride..],
            scale: std::array::from_fn(|c| self.inverse[c][c]),
            rest: std::array::from_fn(|c| self.product[c][axis]),
        })
    }

    /// Takes over the displacement of a control point, and returns its index among those
    /// of the domain.
    pub(super) fn set(&mut self, control_point: [usize; D], displacement: [f64; D]) -> [usize; D] {
        let at = std::array::from_fn(|axis| control_point[axis] + self.layers[axis]);
        let index = self.index(at);
        self.displacements[index] = displacement;
        for axis in 0..D {
            self.set_vector(axis, index);
            if at[axis] > 0 {
                self.set_vector(axis, index - self.stride[axis]);
            }
        }
        at
    }

    /// Where a row of the lattice's own control points begins, without its offset along
    /// the first axis.
    fn row_of(&self, number: usize, own: &[usize; D]) -> usize {
        let mut rest = number;
        let mut start = 0;
        for axis in 1..D {
            start += (rest % own[axis] + self.layers[axis]) * self.stride[axis];
            rest /= own[axis];
        }
        start
    }

    pub(super) fn index(&self, at: [usize; D]) -> usize {
        (0..D).map(|axis| at[axis] * self.stride[axis]).sum()
    }

    /// The control vector for an axis between a control point and the next one.
    fn set_vector(&mut self, axis: usize, index: usize) {
        let next = index + self.stride[axis];
        let place = index / self.stride[axis] % self.counts[axis];
        if place + 1 == self.counts[axis] {
            return;
        }
        let (from, to) = (self.displacements[index], self.displacements[next]);
        let mut difference = from;
        for c in 0..D {
            difference[c] = to[c] - from[c];
        }
        let slope = self.slopes[axis].get(place).copied().unwrap_or(1.0);
        for c in 0..D {
            let mut sum = self.inverse[c][0] * difference[0];
            for k in 1..D {
                sum += self.inverse[c][k] * difference[k];
            }
            self.vectors[axis][c][index] = self.product[c][axis] + sum * slope;
        }
    }

    /// The same operations as in [`Partials::set_vector`], without those that multiply by
    /// zero or one.
    fn set_axis_plain(&mut self, axis: usize) {
        let mut vectors: [Vec<f64>; D] = std::array::from_fn(|_| Vec::new());
        let total = self.displacements.len();
        let Plain {
            from,
            to,
            scale,
            rest,
        } = self.plain(axis).expect("asked before");
        for c in 0..D {
            let both = from.iter().zip(to);
            vectors[c].reserve_exact(total);
            vectors[c].extend(both.map(|(from, to)| rest[c] + (to[c] - from[c]) * scale[c]));
            vectors[c].resize(total, rest[c]);
        }
        self.vectors[axis] = vectors;
    }

    /// The conversions to Bézier form in a cell.
    pub(super) fn tables(&self, cell: [usize; D]) -> [&BezierTables; D] {
        std::array::from_fn(|axis| &self.tables[axis][self.kinds[axis][cell[axis]]])
    }

    /// The kind of a cell along each axis.
    pub(super) fn kind(&self, cell: [usize; D]) -> [usize; D] {
        std::array::from_fn(|axis| self.kinds[axis][cell[axis]])
    }

    /// The cells along an axis on which a control point of the domain acts: from and to.
    pub(super) fn around(&self, axis: usize, at: [usize; D]) -> [usize; 2] {
        let from = at[axis].saturating_sub(self.degree[axis]);
        [from, (at[axis] + 1).min(self.cells[axis])]
    }

    /// Calls `found` with the number of each cell on which a control point of the domain
    /// acts.
    pub(super) fn for_cells_around(&self, at: [usize; D], mut found: impl FnMut(usize)) {
        let range = |axis: usize| {
            let [from, to] = self.around(axis, at);
            from..to
        };
        let planes = if D == 3 { range(D - 1) } else { 0..1 };
        for k in planes {
            for j in range(1) {
                for i in range(0) {
                    let plane = if D == 3 { k * self.cells[1] } else { 0 };
                    found(i + self.cells[0] * (j + plane));
                }
            }
        }
    }

    /// The number of cells of the domain.
    pub(super) fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    /// A cell by its number, first axis fastest.
    pub(super) fn cell(&self, number: usize) -> [usize; D] {
        let mut rest = number;
        self.cells.map(|n| {
            let index = rest % n;
            rest /= n;
            index
        })
    }

    /// The number of a cell.
    pub(super) fn number(&self, cell: [usize; D]) -> usize {
        (0..D)
            .rev()
            .fold(0, |number, axis| number * self.cells[axis] + cell[axis])
    }

    /// Control vectors for axis `a` that act on a cell, per axis.
    pub(super) fn window(&self, a: usize) -> [usize; D] {
        std::array::from_fn(|axis| self.degree[axis] + usize::from(axis != a))
    }

    /// The largest 1-norm of the control vectors for each axis that act on a cell.
    pub(super) fn norms(&self, cell: [usize; D]) -> [f64; D] {
        let start = self.index(cell);
        std::array::from_fn(|a| {
            let window = self.window(a);
            let planes = if D == 3 { window[D - 1] } else { 1 };
            let mut norm = 0.0_f64;
            for row in 0..window[1] * planes {
                let (j, k) = (row % window[1], row / window[1]);
                let plane = if D == 3 { k * self.stride[D - 1] } else { 0 };
                let at = start + j * self.stride[1] + plane;
                let mut sums = [0.0; crate::bspline::MAX_ORDER];
                for c in 0..D {
                    let row = &self.vectors[a][c][at..at + window[0]];
                    for (sum, v) in sums.iter_mut().zip(row) {
                        *sum += v.abs();
                    }
                }
                for sum in sums {
                    // Not `f64::max`, which would lose a NaN.
                    norm = if norm.is_nan() || sum <= norm {
                        norm
                    } else {
                        sum
                    };
                }
            }
            norm
        })
    }

    /// By how much an entry of a control vector can be wrong, if none for its axis has a
    /// larger 1-norm than `norm`.
    pub(super) fn error(&self, norm: f64) -> f64 {
        12.0 * UNIT * self.condition * (norm + 1.0)
    }

    /// By how much an entry of a control vector [between](Partials::between) two lattices
    /// can be wrong, as the value at a `t` up to `most` that itself is wrong by 4 units times
    /// `most`. No control vectors at the beginning and the end of the whole way have larger
    /// 1-norms than those given, so none at t has one above N = N₀ + `most` N₁.
    ///
    /// The errors of both ends are mixed like their values, to 12 u K (N + 1) at most; three
    /// roundings of each term add 3 u N, and a wrong t at most 4 u N.
    pub(super) fn error_between(&self, ends: [f64; 2], most: f64) -> f64 {
        20.0 * UNIT * self.condition * (ends[0] + most * ends[1] + 1.0)
    }

    /// Bounds of `det J` from bounds of the determinant in lattice coordinates.
    pub(super) fn divide_by_frame(&self, [low, high]: [f64; 2]) -> [f64; 2] {
        if !self.is_sound() {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let [smallest, largest] = self.frame_determinant;
        // Divided by what makes it least or largest, and rounded outwards.
        let low = low / if low > 0.0 { largest } else { smallest };
        let high = high / if high > 0.0 { smallest } else { largest };
        [
            if low == 0.0 { low } else { low.next_down() },
            if high == 0.0 { high } else { high.next_up() },
        ]
    }

    /// Whether floating point can decide anything: the frame is far from singular.
    pub(super) fn is_sound(&self) -> bool {
        self.frame_determinant[0] <= self.frame_determinant[1]
    }
}

/// See [`Partials::plain`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Plain<'a, const D: usize> {
    pub(super) from: &'a [[f64; D]],
    pub(super) to: &'a [[f64; D]],
    pub(super) scale: [f64; D],
    pub(super) rest: [f64; D],
}

/// `M`, `M A`, K and bounds of `det(M A)`.
#[expect(clippy::type_complexity, reason = "four results, used once")]
fn frame_product<const D: usize>(grid: &Grid<D>) -> ([[f64; D]; D], [[f64; D]; D], f64, [f64; 2]) {
    let (axes, inverse) = (grid.frame().axes(), grid.frame().inverse());
    let mut product = [[0.0; D]; D];
    let mut condition = 0.0_f64;
    let mut distance = 0.0_f64;
    for r in 0..D {
        let (mut sizes, mut distances) = (0.0, 0.0);
        for a in 0..D {
            let terms: [f64; D] = std::array::from_fn(|k| inverse[r][k] * axes[a][k]);
            product[r][a] = terms.iter().sum();
            sizes += terms.iter().map(|t| t.abs()).sum::<f64>();
            distances += (product[r][a] - crate::frame::unit_entry(r, a)).abs();
        }
        condition = condition.max(sizes);
        distance = distance.max(distances);
    }
    let condition = 1.001 * condition;
    // ‖M A − I‖ in the maximum norm; eigenvalues are that far from 1 at most.
    let distance = 1.001 * distance + 8.0 * UNIT * condition;
    let determinant = if distance <= 0.01 {
        // Slack for the roundings of the three products, and then some.
        let power = |x: f64| (0..D).fold(1.0, |product, _| product * x);
        [
            power(1.0 - distance) - 4.0 * UNIT,
            power(1.0 + distance) + 4.0 * UNIT,
        ]
    } else {
        [f64::INFINITY, f64::NEG_INFINITY]
    };
    (inverse, product, condition, determinant)
}

/// The factors of the differences along an axis; none if all are one.
fn slopes(axis: &Axis) -> Vec<f64> {
    if axis.knots() == crate::Knots::Uniform {
        return Vec::new();
    }
    let n = axis.degree().get();
    (0..axis.control_point_count() - 1)
        .map(|i| {
            let i = i.cast_signed();
            let (from, to) = (axis.knot(0, i + 1 - n.cast_signed()), axis.knot(0, i + 1));
            n as f64 / (to - from)
        })
        .collect()
}
