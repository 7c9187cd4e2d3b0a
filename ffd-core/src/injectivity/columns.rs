//! The vectors of the columns of the Jacobian that act on a box: control vectors of a
//! cell or of the whole lattice, or Bézier vectors of a cell or of a part of one.
//!
//! Each column of the Jacobian is a weighted mean of its vectors at every point of the
//! box, with weights that are not negative. Whatever convex set holds the vectors holds
//! the column.
//!
//! # Rounding
//!
//! Let u be the unit roundoff, N the largest 1-norm of the exact vectors of a column, and
//! e a bound of the error of an entry. The conversion to Bézier form adds at most six
//! products along each of D axes, with weights that have a relative error of 26 u; so it
//! makes an entry worse by less than 33 D u (N + D e). Halving (de Casteljau) makes it
//! worse by one rounding for each of at most n steps.

use fearless_simd::{Level, Simd, dispatch};

use super::partials::{Partials, UNIT};
use super::piece::Shape;
use crate::bspline::{MAX_ORDER, ToBezier};

/// No 1-norm may be larger than this, so that products do not overflow.
const LARGEST: f64 = 1e100;

/// Rows of a table, padded to whole vectors.
const LANES: usize = 8;

/// See the [module](self).
#[derive(Debug, Clone)]
pub(super) struct Columns<const D: usize> {
    pub(super) level: Level,
    /// Vectors of each column along each axis.
    counts: [[usize; 3]; D],
    /// `vectors[a][c]`: component c of the vectors of column a, first axis fastest.
    pub(super) vectors: [[Vec<f64>; D]; D],
    /// By how much an entry of each column may be wrong.
    pub(super) errors: [f64; D],
    /// A bound of the 1-norm of the exact vectors of each column.
    norms: [f64; D],
    scratch: Vec<f64>,
}

impl<const D: usize> Columns<D> {
    /// Empty.
    pub(super) fn new() -> Self {
        Self {
            level: Level::new(),
            counts: [[0; 3]; D],
            vectors: std::array::from_fn(|_| std::array::from_fn(|_| Vec::new())),
            errors: [0.0; D],
            norms: [0.0; D],
            scratch: Vec::new(),
        }
    }

    /// Takes the control vectors that act on a cell.
    pub(super) fn set_control(&mut self, partials: &Partials<D>, cell: [usize; D]) {
        let start = partials.index(cell);
        let norms = partials.norms(cell);
        for a in 0..D {
            let window = partials.window(a);
            self.set_norm(partials, a, norms[a]);
            self.counts[a] = [1; 3];
            self.counts[a][..D].copy_from_slice(&window);
            let [width, height, planes] = self.counts[a];
            for (out, values) in self.vectors[a].iter_mut().zip(&partials.vectors[a]) {
                out.clear();
                for row in 0..height * planes {
                    let (j, k) = (row % height, row / height);
                    let plane = if D == 3 {
                        k * partials.stride[D - 1]
                    } else {
                        0
                    };
                    let at = start + j * partials.stride[1] + plane;
                    out.extend_from_slice(&values[at..at + width]);
                }
            }
        }
    }

    /// Takes the control vectors of the whole lattice.
    pub(super) fn set_all(&mut self, partials: &Partials<D>) {
        for a in 0..D {
            let mut counts = partials.counts;
            counts[a] -= 1;
            self.counts[a] = [1; 3];
            self.counts[a][..D].copy_from_slice(&counts);
            let [width, height, planes] = self.counts[a];
            for (out, values) in self.vectors[a].iter_mut().zip(&partials.vectors[a]) {
                out.clear();
                for row in 0..height * planes {
                    let (j, k) = (row % height, row / height);
                    let plane = if D == 3 {
                        k * partials.stride[D - 1]
                    } else {
                        0
                    };
                    let at = j * partials.stride[1] + plane;
                    out.extend_from_slice(&values[at..at + width]);
                }
            }
            let mut norm = 0.0_f64;
            for i in 0..self.vectors[a][0].len() {
                let sum: f64 = self.vectors[a].iter().map(|v| v[i].abs()).sum();
                // Not `f64::max`, which would lose a NaN.
                norm = if norm.is_nan() || sum <= norm {
                    norm
                } else {
                    sum
                };
            }
            self.set_norm(partials, a, norm);
        }
    }

    /// The largest computed norm of a column bounds the error, and that the exact norm.
    fn set_norm(&mut self, partials: &Partials<D>, a: usize, norm: f64) {
        let error = partials.error(norm);
        let sound = partials.is_sound() && norm <= LARGEST;
        self.errors[a] = if sound { error } else { f64::INFINITY };
        self.norms[a] = (1.0 + 4.0 * UNIT) * norm + 1.01 * D as f64 * error;
    }

    /// Turns control vectors of a cell into its Bézier vectors.
    pub(super) fn convert(&mut self, partials: &Partials<D>, cell: [usize; D]) {
        let tables = partials.tables(cell);
        let level = self.level;
        for a in 0..D {
            for axis in 0..D {
                let table = if axis == a {
                    &tables[axis].slope
                } else {
                    &tables[axis].full
                };
                let counts = self.counts[a];
                for c in 0..D {
                    let values = &mut self.vectors[a][c];
                    let scratch = &mut self.scratch;
                    dispatch!(level, s => convert(s, counts, axis, table, values, scratch));
                }
            }
            let norm = self.norms[a];
            self.errors[a] += 33.0 * D as f64 * UNIT * (norm + D as f64 * self.errors[a]);
        }
    }

    /// How each column is cut into halves.
    pub(super) fn shapes(&self) -> [Shape; D] {
        std::array::from_fn(|a| {
            let degree: [usize; D] = std::array::from_fn(|axis| self.counts[a][axis] - 1);
            Shape::new(&degree)
        })
    }

    /// Cuts Bézier vectors of a box into those of its upper half, and `low` for the lower.
    pub(super) fn split(&mut self, shapes: &[Shape; D], axis: usize, low: &mut Self) {
        for a in 0..D {
            self.errors[a] = shapes[a].error_after_split(axis, self.errors[a], self.norms[a]);
            for (high, low) in self.vectors[a].iter_mut().zip(&mut low.vectors[a]) {
                shapes[a].split(axis, low, high);
            }
        }
        low.counts = self.counts;
        low.errors = self.errors;
        low.norms = self.norms;
    }

    /// Vectors along each axis.
    pub(super) fn counts(&self, a: usize) -> [usize; 3] {
        self.counts[a]
    }

    /// A vector of a column.
    pub(super) fn vector(&self, a: usize, index: usize) -> [f64; D] {
        std::array::from_fn(|c| self.vectors[a][c][index])
    }

    /// An upper bound of Π N: of the sum of the absolute terms of every determinant of
    /// vectors, one from each column, exact or as stored.
    pub(super) fn size(&self) -> f64 {
        let sizes = self.norms.iter().zip(&self.errors);
        sizes.fold(1.001, |product, (norm, error)| {
            product * (norm + D as f64 * error)
        })
    }

    /// By how much the determinant of vectors, one from each column, may be wrong, if it is
    /// computed by products of at most five roundings each.
    pub(super) fn determinant_error(&self) -> f64 {
        let (mut exact, mut disturbed) = (1.0, 1.0);
        for (norm, error) in self.norms.iter().zip(&self.errors) {
            exact *= norm;
            disturbed *= norm + D as f64 * error;
        }
        // The difference itself is rounded.
        let bound = 1.01 * (disturbed - exact) + 24.0 * UNIT * disturbed;
        // Not a number where the difference of infinities is none.
        if bound < f64::INFINITY {
            bound
        } else {
            f64::INFINITY
        }
    }
}

/// Replaces control values along an axis by Bézier values.
#[inline(always)]
fn convert<S: Simd>(
    _: S,
    counts: [usize; 3],
    axis: usize,
    table: &ToBezier,
    values: &mut Vec<f64>,
    scratch: &mut Vec<f64>,
) {
    let count = counts[axis];
    scratch.clear();
    scratch.resize(values.len(), 0.0);
    if axis == 0 {
        // Lanes are the values of one line.
        let mut columns = [[0.0; LANES]; MAX_ORDER];
        for (m, column) in columns.iter_mut().enumerate() {
            for i in 0..MAX_ORDER {
                column[i] = table[i][m];
            }
        }
        let lines = values.chunks_exact(count);
        for (line, out) in lines.zip(scratch.chunks_exact_mut(count)) {
            let mut sums = [0.0; LANES];
            for (&value, column) in line.iter().zip(&columns) {
                for i in 0..LANES {
                    sums[i] += column[i] * value;
                }
            }
            out.copy_from_slice(&sums[..count]);
        }
    } else {
        let stride: usize = counts[..axis].iter().product();
        let slabs = values.chunks_exact(stride * count);
        for (slab, out) in slabs.zip(scratch.chunks_exact_mut(stride * count)) {
            for (row, out) in table.iter().zip(out.chunks_exact_mut(stride)) {
                for (&weight, line) in row.iter().zip(slab.chunks_exact(stride)) {
                    for (out, value) in out.iter_mut().zip(line) {
                        *out += weight * value;
                    }
                }
            }
        }
    }
    std::mem::swap(values, scratch);
}
