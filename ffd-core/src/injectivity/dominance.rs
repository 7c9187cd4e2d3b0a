//! How far the columns of the Jacobian are from the axes: the cheapest lower bound of the
//! determinant.
//!
//! Let δₐ be the largest 1-norm of `v − eₐ` over the control vectors v of column a that act
//! on a cell. Column a of the Jacobian is a mean of them, so it is no farther from `eₐ`
//! anywhere in the cell. If every δₐ is below one, the matrix is strictly diagonally dominant
//! by columns, and, by a theorem of Ostrowski,
//!
//! ```text
//! det J ≥ Πₐ (1 − δₐ) > 0.
//! ```
//!
//! On a straight way from one lattice to another control vectors are linear in t, so δₐ is a
//! convex function of t: what is known of both ends bounds it between them.

use fearless_simd::{Level, Simd, dispatch};

use super::cones::sliding_maximum;
use super::partials::{Partials, UNIT};

/// See the [module](self).
#[derive(Debug, Clone)]
pub(super) struct Dominance<const D: usize> {
    /// Of each column, for the cell that begins at each control point.
    distances: [Vec<f64>; D],
    sound: bool,
}

impl<const D: usize> Dominance<D> {
    /// Of control vectors that have been [prepared](Partials::prepare).
    pub(super) fn new(partials: &Partials<D>) -> Self {
        let level = Level::new();
        let unit = partials.error(0.0);
        let mut spare = vec![0.0; partials.vectors[0][0].len()];
        let distances = std::array::from_fn(|a| {
            let vectors = &partials.vectors[a];
            let mut out = vec![0.0; vectors[0].len()];
            dispatch!(level, s => distances(s, vectors, a, unit, &mut out));
            for (axis, &window) in partials.window(a).iter().enumerate() {
                let (out, spare) = (&mut out, &mut spare);
                let stride = partials.stride[axis];
                dispatch!(level, s => sliding_maximum(s, out, stride, window, spare));
            }
            out
        });
        Self {
            distances,
            sound: partials.is_sound(),
        }
    }

    /// δ of each column in the cell that begins at a control point; infinite if nothing is
    /// known.
    pub(super) fn of_cell(&self, index: usize) -> [f64; D] {
        std::array::from_fn(|a| {
            let distance = self.distances[a][index];
            // Nor is what is not a number.
            let known = self.sound && distance < f64::INFINITY;
            if known { distance } else { f64::INFINITY }
        })
    }

    /// A lower bound of the determinant in lattice coordinates in that cell, if it is
    /// positive.
    pub(super) fn least(&self, index: usize) -> Option<f64> {
        lower_bound(self.of_cell(index))
    }
}

/// δ of each column in one cell, without looking at others.
pub(super) fn distances_in_cell<const D: usize>(
    partials: &Partials<D>,
    cell: [usize; D],
) -> [f64; D] {
    if !partials.is_sound() {
        return [f64::INFINITY; D];
    }
    let (start, unit) = (partials.index(cell), partials.error(0.0));
    std::array::from_fn(|a| {
        let window = partials.window(a);
        let planes = if D == 3 { window[D - 1] } else { 1 };
        let mut most = 0.0_f64;
        for row in 0..window[1] * planes {
            let (j, k) = (row % window[1], row / window[1]);
            let plane = if D == 3 {
                k * partials.stride[D - 1]
            } else {
                0
            };
            let at = start + j * partials.stride[1] + plane;
            let row: [&[f64]; D] =
                std::array::from_fn(|c| &partials.vectors[a][c][at..at + window[0]]);
            for i in 0..window[0] {
                most = most.max(distance::<D>(std::array::from_fn(|c| row[c][i]), a, unit));
            }
        }
        most
    })
}

/// A lower bound of the determinant for distances from the axes, if it is positive.
pub(super) fn lower_bound<const D: usize>(distances: [f64; D]) -> Option<f64> {
    // Each factor is rounded once, and each product.
    let product = distances.iter().fold(1.0, |product, distance| {
        let part = 1.0 - distance;
        if part > 0.0 { product * part } else { 0.0 }
    });
    let bound = product * (1.0 - 16.0 * UNIT);
    (bound > 0.0).then_some(bound)
}

/// An upper bound of the 1-norm of `v − eₐ` for the exact vector v; infinite if it is not a
/// number. The stored one errs by at most `unit` times its 1-norm plus one in each component,
/// and its 1-norm is at most one more than the distance.
#[inline(always)]
fn distance<const D: usize>(vector: [f64; D], a: usize, unit: f64) -> f64 {
    let mut sum = 0.0;
    for c in 0..D {
        sum += (vector[c] - f64::from(u8::from(c == a))).abs();
    }
    // A few roundings of the sum, and of this.
    let distance = (sum + D as f64 * unit * (2.0 + sum)) * (1.0 + 16.0 * UNIT);
    // What is not a number would be lost where the largest is looked for.
    if distance < f64::INFINITY {
        distance
    } else {
        f64::INFINITY
    }
}

#[inline(always)]
fn distances<S: Simd, const D: usize>(
    _: S,
    vectors: &[Vec<f64>; D],
    a: usize,
    unit: f64,
    out: &mut [f64],
) {
    let count = out.len();
    let components: [&[f64]; D] = std::array::from_fn(|c| &vectors[c][..count]);
    for i in 0..count {
        out[i] = distance::<D>(std::array::from_fn(|c| components[c][i]), a, unit);
    }
}
