//! Weighted sums over the control points of a cell.
//!
//! The sum `Σ wᵢ wⱼ wₖ dᵢⱼₖ` is taken along the last axis first: every way to evaluate a
//! lattice, one point at a time, in bulk, or several points in the lanes of a vector,
//! does the same operations in the same order and gives the same result to the last
//! bit. The last axis comes first because control points along the first one lie next
//! to each other: whole rows of them can then be added in the lanes of a vector.

use crate::bspline::{MAX_ORDER, Real};

/// `Σ weights[n] · terms[n]`, from the first to the last.
macro_rules! sum {
    ($count:expr, $n:ident => $term:expr) => {{
        let mut sum = {
            let $n = 0;
            $term
        };
        for $n in 1..$count {
            sum = sum + $term;
        }
        sum
    }};
}

/// The displacement: `weights[axis]` holds the basis functions along each axis, `block`
/// gives the displacements of the control points of the cell.
#[inline(always)]
pub(crate) fn blend<T, V: Real<T>, const D: usize>(
    order: [usize; D],
    weights: &[[V; MAX_ORDER]; D],
    block: impl Fn([usize; D]) -> [T; D],
    zero: V,
) -> [V; D]
where
    T: Copy,
{
    let mut out = [zero; D];
    for i in 0..order[0] {
        let mut plane = [zero; D];
        if D == 2 {
            for c in 0..D {
                plane[c] = sum!(order[1], j => weights[1][j] * block(index([i, j, 0]))[c]);
            }
        } else {
            for j in 0..order[1] {
                for c in 0..D {
                    let row = sum!(order[2], k => weights[2][k] * block(index([i, j, k]))[c]);
                    let term = weights[1][j] * row;
                    plane[c] = if j == 0 { term } else { plane[c] + term };
                }
            }
        }
        for c in 0..D {
            let term = weights[0][i] * plane[c];
            out[c] = if i == 0 { term } else { out[c] + term };
        }
    }
    out
}

/// The displacement and its derivatives: `weights[axis]` holds the basis functions and
/// their slopes. Entry `[a][c]` of the second result is the derivative of component c
/// along axis a.
#[inline(always)]
pub(crate) fn blend_with_partials<T, V: Real<T>, const D: usize>(
    order: [usize; D],
    weights: &[[[V; MAX_ORDER]; 2]; D],
    block: impl Fn([usize; D]) -> [T; D],
    zero: V,
) -> ([V; D], [[V; D]; D])
where
    T: Copy,
{
    let mut out = [zero; D];
    let mut partials = [[zero; D]; D];
    for i in 0..order[0] {
        // Sums over the other axes, of the values and of the derivatives along them.
        let mut plane = [zero; D];
        let mut slopes = [[zero; D]; D];
        if D == 2 {
            let [w, dw] = &weights[1];
            for c in 0..D {
                plane[c] = sum!(order[1], j => w[j] * block(index([i, j, 0]))[c]);
                slopes[1][c] = sum!(order[1], j => dw[j] * block(index([i, j, 0]))[c]);
            }
        } else {
            let ([w1, dw1], [w2, dw2]) = (&weights[1], &weights[D - 1]);
            for j in 0..order[1] {
                for c in 0..D {
                    let row = sum!(order[2], k => w2[k] * block(index([i, j, k]))[c]);
                    let slope = sum!(order[2], k => dw2[k] * block(index([i, j, k]))[c]);
                    let terms = [w1[j] * row, dw1[j] * row, w1[j] * slope];
                    if j == 0 {
                        [plane[c], slopes[1][c], slopes[D - 1][c]] = terms;
                    } else {
                        plane[c] = plane[c] + terms[0];
                        slopes[1][c] = slopes[1][c] + terms[1];
                        slopes[D - 1][c] = slopes[D - 1][c] + terms[2];
                    }
                }
            }
        }
        let [w, dw] = &weights[0];
        for c in 0..D {
            let (value, along) = (w[i] * plane[c], dw[i] * plane[c]);
            out[c] = if i == 0 { value } else { out[c] + value };
            partials[0][c] = if i == 0 {
                along
            } else {
                partials[0][c] + along
            };
            for a in 1..D {
                let term = w[i] * slopes[a][c];
                partials[a][c] = if i == 0 { term } else { partials[a][c] + term };
            }
        }
    }
    (out, partials)
}

/// The first `D` of three indices.
#[inline(always)]
fn index<const D: usize>(all: [usize; 3]) -> [usize; D] {
    let mut index = [0; D];
    index.copy_from_slice(&all[..D]);
    index
}
