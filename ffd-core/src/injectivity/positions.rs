//! The map in Bézier form over boxes within a cell, in lattice coordinates.
//!
//! With `M`, the stored inverse of the frame, taken as an exact matrix, this is the map
//!
//! ```text
//! G(u) = M (F(o + A u) − o − d₀) = Σ Bᵢ(u) Pᵢ,    Pᵢ = (M A) ξᵢ + M (dᵢ − d₀),
//! ```
//!
//! with ξᵢ the point at which control point i rests and d₀ the displacement of the first
//! one, so that a large translation of the whole lattice costs no accuracy. As `M` is
//! regular, G(p) = G(q) if and only if F(p) = F(q).
//!
//! Over a box within a cell, the Bézier point with index (i, j, k) is the polar form of the
//! cell's polynomial at as many lower and upper ends of the box: a mean of the cell's
//! control points with weights that are not negative. The derivative along an axis of
//! degree n, over a box of size h there, is a mean of n/h times differences of neighbours.
//!
//! # Rounding
//!
//! Let u be the unit roundoff, K the largest row sum of |M| |A|, S the largest 1-norm of a
//! ξᵢ and T the largest entry of a sum |M| |dᵢ − d₀|. An entry of `M A` is wrong by at most
//! 4 u K; a coordinate of ξᵢ is rounded once, products and sums less than eight times: an
//! entry of Pᵢ is wrong by at most 16 u (K (S + 1) + T). Weights along each axis have a
//! relative error of at most 26 u (five steps with five roundings); with the products and
//! sums of at most six terms along up to three axes, Bézier points are wrong by another
//! 128 u max |Pᵢ|.

use super::partials::UNIT;
use crate::Lattice;
use crate::bspline::{BezierTables, MAX_ORDER};

/// Row i holds the weights of Bézier point i.
type Weights = [[f64; MAX_ORDER]; MAX_ORDER];

/// See the [module](self).
#[derive(Debug)]
pub(super) struct Positions<'a, const D: usize> {
    lattice: &'a Lattice<D>,
    pub(super) cells: [usize; D],
    pub(super) degree: [usize; D],
    stride: [usize; D],
    points: Vec<[f64; D]>,
    tables: [Vec<BezierTables>; D],
    /// By how much a component of a Bézier point can be wrong.
    pub(super) error: f64,
    /// No component of a control point is larger.
    pub(super) largest: f64,
    scratch: [Vec<[f64; D]>; 2],
}

impl<'a, const D: usize> Positions<'a, D> {
    /// Only for a lattice with a free border. `None` if numbers are too large to compute
    /// with.
    pub(super) fn new(lattice: &'a Lattice<D>) -> Option<Self> {
        let grid = lattice.grid();
        let counts = grid.control_points_per_axis();
        let cells = grid.cells();
        // Positions in the lattice must be exact, down to 2⁻²⁸ of a cell.
        if cells.iter().any(|&n| n > 1 << 22) {
            return None;
        }
        let mut stride = [1; D];
        for axis in 1..D {
            stride[axis] = stride[axis - 1] * counts[axis - 1];
        }
        let (axes, inverse) = (grid.frame().axes(), grid.frame().inverse());
        let mut product = [[0.0; D]; D];
        let mut condition = 0.0_f64;
        for r in 0..D {
            let mut sizes = 0.0;
            for a in 0..D {
                for k in 0..D {
                    let term = inverse[r][k] * axes[a][k];
                    product[r][a] += term;
                    sizes += term.abs();
                }
            }
            condition = condition.max(1.001 * sizes);
        }
        let rest: [Vec<f64>; D] = std::array::from_fn(|axis| {
            let own = &grid.axes()[axis];
            (0..counts[axis]).map(|i| own.rest_coordinate(i)).collect()
        });
        let reach: f64 = rest
            .iter()
            .map(|r| r.iter().fold(0.0_f64, |m, x| m.max(x.abs())))
            .sum();
        let first = lattice.displacements()[0];
        let (mut moved, mut largest) = (0.0_f64, 0.0_f64);
        let mut points = Vec::with_capacity(lattice.displacements().len());
        let mut index = [0; D];
        for displacement in lattice.displacements() {
            let mut point = [0.0; D];
            for r in 0..D {
                let (mut size, mut by, mut at) = (0.0, 0.0, 0.0);
                for k in 0..D {
                    let term = inverse[r][k] * (displacement[k] - first[k]);
                    by += term;
                    size += term.abs();
                    at += product[r][k] * rest[k][index[k]];
                }
                point[r] = at + by;
                // Not `f64::max`, which would lose a NaN.
                moved = if moved.is_nan() || size <= moved {
                    moved
                } else {
                    size
                };
                let out = point[r].abs();
                largest = if largest.is_nan() || out <= largest {
                    largest
                } else {
                    out
                };
            }
            points.push(point);
            for axis in 0..D {
                index[axis] += 1;
                if index[axis] < counts[axis] {
                    break;
                }
                index[axis] = 0;
            }
        }
        let sound = moved <= 1e100 && largest <= 1e100;
        let error = 16.0 * UNIT * (condition * (reach + 1.0) + moved) + 128.0 * UNIT * largest;
        sound.then_some(Self {
            lattice,
            cells,
            degree: grid.degree().map(crate::Degree::get),
            stride,
            points,
            tables: std::array::from_fn(|axis| BezierTables::of_axis(&grid.axes()[axis])),
            error: 1.01 * error,
            largest,
            scratch: [Vec::new(), Vec::new()],
        })
    }

    /// The number of Bézier points along each axis over a box: one where it is flat.
    pub(super) fn counts(&self, part: &[[f64; 2]; D]) -> [usize; D] {
        std::array::from_fn(|a| {
            if part[a][0] < part[a][1] {
                self.degree[a] + 1
            } else {
                1
            }
        })
    }

    /// Appends the Bézier points over a part of a cell, given by its ends within 0 and 1
    /// along each axis, first axis fastest.
    pub(super) fn bezier(
        &mut self,
        cell: [usize; D],
        part: &[[f64; 2]; D],
        out: &mut Vec<[f64; D]>,
    ) {
        let counts = self.counts(part);
        let order = self.degree.map(|n| n + 1);
        let weights: [Weights; D] =
            std::array::from_fn(|axis| self.weights(axis, cell[axis], part[axis]));
        let start: usize = (0..D).map(|a| cell[a] * self.stride[a]).sum();
        let planes = if D == 3 { order[D - 1] } else { 1 };
        let plane_stride = if D == 3 { self.stride[D - 1] } else { 0 };
        let [half, other] = &mut self.scratch;

        // Along the first axis; rows of `counts[0]`.
        half.clear();
        for k in 0..planes {
            for j in 0..order[1] {
                let at = start + j * self.stride[1] + k * plane_stride;
                let row = &self.points[at..at + order[0]];
                for i in 0..counts[0] {
                    half.push(combine(row, 1, &weights[0][i]));
                }
            }
        }
        // Along the second.
        let (n0, n1) = (counts[0], counts[1]);
        let target: &mut Vec<[f64; D]> = if D == 3 { other } else { &mut *out };
        if D == 3 {
            target.clear();
        }
        for k in 0..planes {
            for j in 0..n1 {
                for i in 0..n0 {
                    let column = &half[k * order[1] * n0 + i..][..(order[1] - 1) * n0 + 1];
                    target.push(combine(column, n0, &weights[1][j]));
                }
            }
        }
        if D == 3 {
            for k in 0..counts[D - 1] {
                for at in 0..n0 * n1 {
                    let column = &other[at..][..(planes - 1) * n0 * n1 + 1];
                    out.push(combine(column, n0 * n1, &weights[D - 1][k]));
                }
            }
        }
    }

    /// The weights of the control points along an axis in the Bézier points over a part of
    /// a cell.
    fn weights(&self, axis: usize, cell: usize, [from, to]: [f64; 2]) -> Weights {
        let n = self.degree[axis];
        let grid = self.lattice.grid();
        let kind = grid.kind_of_cell(axis, cell);
        let table = &self.tables[axis][kind].full;
        let end = |t: f64| {
            if t <= 0.0 {
                Some(0)
            } else if t >= 1.0 {
                Some(n)
            } else {
                None
            }
        };
        match (end(from), end(to)) {
            (Some(0), Some(last)) if last == n => return *table,
            (Some(a), Some(_)) => {
                let mut weights = [[0.0; MAX_ORDER]; MAX_ORDER];
                weights[0] = table[a];
                return weights;
            }
            _ => {}
        }
        let basis = &grid.axes()[axis].bases()[kind];
        let mut weights = [[0.0; MAX_ORDER]; MAX_ORDER];
        if from >= to {
            weights[0] = basis.values(n, from, 0.0, 1.0);
            return weights;
        }
        for (i, row) in weights[..=n].iter_mut().enumerate() {
            let mut arguments = [from; MAX_ORDER];
            arguments[n - i..n].fill(to);
            *row = basis.blossoms(&arguments[..n], 0.0, 1.0);
        }
        weights
    }

    /// G and its Jacobian, `[r][c]`, at a place of a cell, approximately.
    pub(super) fn evaluate(&self, cell: [usize; D], t: [f64; D]) -> ([f64; D], [[f64; D]; D]) {
        let grid = self.lattice.grid();
        let rows: [[[f64; MAX_ORDER]; 2]; D] = std::array::from_fn(|axis| {
            let basis = &grid.axes()[axis].bases()[grid.kind_of_cell(axis, cell[axis])];
            basis.values_and_slopes(self.degree[axis], t[axis], 0.0, 1.0)
        });
        let start: usize = (0..D).map(|a| cell[a] * self.stride[a]).sum();
        let mut position = [0.0; D];
        let mut jacobian = [[0.0; D]; D];
        let planes = if D == 3 { self.degree[D - 1] + 1 } else { 1 };
        for k in 0..planes {
            let (plane, last) = if D == 3 {
                let [values, slopes] = &rows[D - 1];
                (k * self.stride[D - 1], [values[k], slopes[k]])
            } else {
                (0, [1.0, 0.0])
            };
            for j in 0..=self.degree[1] {
                let at = start + j * self.stride[1] + plane;
                // Value, and derivatives along the first axis.
                let mut sums = [[0.0; D]; 2];
                for i in 0..=self.degree[0] {
                    let point = &self.points[at + i];
                    for c in 0..D {
                        sums[0][c] += rows[0][0][i] * point[c];
                        sums[1][c] += rows[0][1][i] * point[c];
                    }
                }
                let [value, slope] = [rows[1][0][j], rows[1][1][j]];
                for c in 0..D {
                    position[c] += value * last[0] * sums[0][c];
                    jacobian[c][0] += value * last[0] * sums[1][c];
                    jacobian[c][1] += slope * last[0] * sums[0][c];
                    if D == 3 {
                        jacobian[c][D - 1] += value * last[1] * sums[0][c];
                    }
                }
            }
        }
        (position, jacobian)
    }

    /// The cell of a point of the domain, and its position there, both exact.
    pub(super) fn locate(&self, u: [f64; D]) -> ([usize; D], [f64; D]) {
        let cell: [usize; D] = std::array::from_fn(|a| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between 0 and the number of cells"
            )]
            let cell = u[a] as usize;
            cell.min(self.cells[a] - 1)
        });
        (cell, std::array::from_fn(|a| u[a] - cell[a] as f64))
    }
}

/// `Σ wₘ pₘ` over every `stride`-th point.
#[inline(always)]
fn combine<const D: usize>(
    points: &[[f64; D]],
    stride: usize,
    weights: &[f64; MAX_ORDER],
) -> [f64; D] {
    let mut sum = [0.0; D];
    for (point, &weight) in points.iter().step_by(stride).zip(weights) {
        for c in 0..D {
            sum[c] += weight * point[c];
        }
    }
    sum
}

/// Cuts Bézier points in the middle of an axis, by de Casteljau's algorithm: `low` and
/// `high`, which both hold the whole, become the two halves. Components err by at most
/// `count − 1` roundings of the largest more.
pub(super) fn halve<const D: usize>(
    counts: [usize; D],
    axis: usize,
    low: &mut [[f64; D]],
    high: &mut [[f64; D]],
) {
    let stride: usize = counts[..axis].iter().product();
    let count = counts[axis];
    for slab in (0..high.len()).step_by(stride * count) {
        for offset in slab..slab + stride {
            for step in 1..count {
                for i in 0..count - step {
                    let at = offset + i * stride;
                    for c in 0..D {
                        high[at][c] = 0.5 * (high[at][c] + high[at + stride][c]);
                    }
                }
                low[offset + step * stride] = high[offset];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{grid, in_frame, noisy};
    use super::*;
    use crate::*;

    /// Bézier points over a part of a cell, evaluated by halving again and again, are the
    /// values of the map, less the displacement of the first control point, within the
    /// bound given; a million cells away from the origin too.
    fn check<const D: usize>(lattice: &Lattice<D>, far: [f64; D]) {
        let mut positions = Positions::new(lattice).unwrap();
        let cells = lattice.grid().cells();
        for number in 0..cells.iter().product() {
            let mut rest: usize = number;
            let cell = std::array::from_fn(|a| {
                let index = rest % cells[a];
                rest /= cells[a];
                index
            });
            for part in [
                [0.0, 1.0],
                [0.25, 0.75],
                [0.0, 0.375],
                [0.625, 1.0],
                [1.0, 1.0],
            ] {
                let part: [[f64; 2]; D] =
                    std::array::from_fn(|a| if a == 0 { part } else { [0.125, 0.5] });
                let counts = positions.counts(&part);
                let mut points = Vec::new();
                positions.bezier(cell, &part, &mut points);
                assert_eq!(points.len(), counts.iter().product::<usize>());
                let mut low = points.clone();
                // The middle of the part: the last point of the lower half along each axis.
                let mut stride = 1;
                let mut last = 0;
                for a in 0..D {
                    if counts[a] > 1 {
                        let mut high = low.clone();
                        halve(counts, a, &mut low, &mut high);
                    }
                    last += (counts[a] - 1) * stride;
                    stride *= counts[a];
                }
                let t: [f64; D] = part.map(|[a, b]| 0.5 * (a + b));
                let (value, _) = positions.evaluate(cell, t);
                for c in 0..D {
                    assert!((low[last][c] - value[c]).abs() <= 2.0 * positions.error);
                }
                let u = std::array::from_fn(|a| cell[a] as f64 + t[a]);
                let world = lattice.grid().frame().to_world(u);
                let image = lattice.deform_point(world);
                let first = lattice.displacements()[0];
                let moved = std::array::from_fn(|c| image[c] - first[c] - far[c]);
                let in_lattice = crate::matrix::multiply(&lattice.grid().frame().inverse(), moved);
                for c in 0..D {
                    assert!((in_lattice[c] - value[c]).abs() < 1e-8);
                }
            }
        }
        assert!(positions.error < 1e-12);
    }

    #[test]
    fn bezier_points_are_those_of_the_map() {
        check(&noisy(grid([3, 2], [3, 2]), 1.0, 1), [0.0; 2]);
        check(&noisy(grid([1, 4, 5], [2, 1, 2]), 1.0, 2), [0.0; 3]);
        let far = [1e6, -2e6];
        let frame = Frame::new(far, [[0.5, 0.25], [-0.25, 0.5]]).unwrap();
        check(&in_frame(&noisy(grid([3, 3], [2, 2]), 1.0, 3), frame), far);
    }
}
