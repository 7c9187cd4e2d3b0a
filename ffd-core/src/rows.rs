//! Evaluation of one point, with the coordinates of a row of control points in the lanes
//! of vectors.
//!
//! Control points along the first axis lie next to each other, so the sums over the
//! other axes are sums of whole rows: twelve numbers in a cubic lattice in space. The
//! operations on each number, and their order, are those of [`blend`](crate::blend).

use fearless_simd::{Simd, SimdBase, f64x4};

use crate::bspline::MAX_ORDER;

/// Rows of control displacements in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<'a> {
    /// Components, beginning with those of the first control point that acts.
    pub(crate) components: &'a [f64],
    /// From one row to the next along the second axis, in components.
    pub(crate) row: usize,
    /// From one row to the next along the third axis.
    pub(crate) plane: usize,
}

/// The displacement in a cubic lattice.
#[inline(always)]
pub(crate) fn cubic<S: Simd, const D: usize>(
    simd: S,
    rows: Rows<'_>,
    weights: &[[f64; MAX_ORDER]; D],
) -> [f64; D] {
    let zero = f64x4::splat(simd, 0.0);
    let mut sum = [zero; D];
    for j in 0..4 {
        let mut row = load(simd, rows, j, 0);
        if D == 3 {
            let unweighted = row;
            add(&mut row, true, unweighted, weights[D - 1][0]);
            for k in 1..4 {
                add(&mut row, false, load(simd, rows, j, k), weights[D - 1][k]);
            }
        }
        add(&mut sum, j == 0, row, weights[1][j]);
    }
    along_row(sum, &weights[0])
}

#[inline(always)]
fn load<S: Simd, const D: usize>(simd: S, rows: Rows<'_>, j: usize, k: usize) -> [f64x4<S>; D] {
    let start = j * rows.row + k * rows.plane;
    let row = &rows.components[start..start + 4 * D];
    let mut vectors = [f64x4::splat(simd, 0.0); D];
    for c in 0..D {
        vectors[c] = f64x4::from_slice(simd, &row[4 * c..4 * c + 4]);
    }
    vectors
}

/// Adds a weighted row, or begins the sum with it.
#[inline(always)]
fn add<S: Simd, const D: usize>(
    sum: &mut [f64x4<S>; D],
    first: bool,
    row: [f64x4<S>; D],
    weight: f64,
) {
    for c in 0..D {
        let term = row[c] * weight;
        sum[c] = if first { term } else { sum[c] + term };
    }
}

/// The weighted sum of the four control points of a row.
#[inline(always)]
fn along_row<S: Simd, const D: usize>(row: [f64x4<S>; D], weights: &[f64; MAX_ORDER]) -> [f64; D] {
    let mut components = [0.0; 12];
    for c in 0..D {
        row[c].store_slice(&mut components[4 * c..4 * c + 4]);
    }
    let mut out = [0.0; D];
    for c in 0..D {
        out[c] = weights[0] * components[c];
        for i in 1..4 {
            out[c] += weights[i] * components[i * D + c];
        }
    }
    out
}
