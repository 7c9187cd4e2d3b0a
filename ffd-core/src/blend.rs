//! Weighted sums over the control points of a cell.
//!
//! The sum `Σ wᵢ wⱼ wₖ dᵢⱼₖ` is taken along the last axis first: every way to evaluate a
//! lattice, one point at a time, in bulk, or several points in the lanes of a vector,
//! does the same operations in the same order and gives the same result to the last
//! bit. The last axis comes first because control points along the first one lie next
//! to each other: whole rows of them can then be added in the lanes of a vector.

use crate::bspline::{MAX_ORDER, Real};

/// The displacements of the control points that act on a cell.
///
/// A trait and not a closure: everything within a kernel must be inlined into it, or its
/// vectors would travel through memory, and closures cannot be told to be.
pub(crate) trait Block<T, const D: usize> {
    /// One component of that of the control point with the given index along each axis,
    /// counted from the first one that acts on the cell.
    fn component(&self, index: [usize; D], component: usize) -> T;
}

/// `Σ term(n)` for n below a count, from the first to the last.
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

/// The displacement: `weights[axis]` holds the basis functions along each axis.
#[inline(always)]
pub(crate) fn blend<T, V, B, const D: usize>(
    order: [usize; D],
    weights: &[[V; MAX_ORDER]; D],
    block: &B,
    zero: V,
) -> [V; D]
where
    T: Copy,
    V: Real<T>,
    B: Block<T, D>,
{
    let mut out = [zero; D];
    for c in 0..D {
        out[c] = sum!(order[0], i => weights[0][i] * plane(order, weights, block, i, c));
    }
    out
}

/// The sum over all axes but the first of one component.
#[inline(always)]
fn plane<T, V, B, const D: usize>(
    order: [usize; D],
    weights: &[[V; MAX_ORDER]; D],
    block: &B,
    i: usize,
    c: usize,
) -> V
where
    T: Copy,
    V: Real<T>,
    B: Block<T, D>,
{
    if D == 2 {
        return sum!(order[1], j => weights[1][j] * block.component(index([i, j, 0]), c));
    }
    sum!(order[1], j => {
        let row = sum!(order[2], k => weights[2][k] * block.component(index([i, j, k]), c));
        weights[1][j] * row
    })
}

/// The displacement and its derivatives: `weights[axis]` holds the basis functions and
/// their slopes. Entry `[a][c]` of the second result is the derivative of component c
/// along axis a.
#[inline(always)]
pub(crate) fn blend_with_partials<T, V, B, const D: usize>(
    order: [usize; D],
    weights: &[[[V; MAX_ORDER]; 2]; D],
    block: &B,
    zero: V,
) -> ([V; D], [[V; D]; D])
where
    T: Copy,
    V: Real<T>,
    B: Block<T, D>,
{
    let mut out = [zero; D];
    let mut partials = [[zero; D]; D];
    for c in 0..D {
        let [w, dw] = &weights[0];
        let [value, slopes @ ..] = plane_with_slopes(order, weights, block, 0, c);
        out[c] = w[0] * value;
        partials[0][c] = dw[0] * value;
        for a in 1..D {
            partials[a][c] = w[0] * slopes[a - 1];
        }
        for i in 1..order[0] {
            let [value, slopes @ ..] = plane_with_slopes(order, weights, block, i, c);
            out[c] = out[c] + w[i] * value;
            partials[0][c] = partials[0][c] + dw[i] * value;
            for a in 1..D {
                partials[a][c] = partials[a][c] + w[i] * slopes[a - 1];
            }
        }
    }
    (out, partials)
}

/// The sum over all axes but the first of one component, followed by its derivatives
/// along these axes.
#[inline(always)]
fn plane_with_slopes<T, V, B, const D: usize>(
    order: [usize; D],
    weights: &[[[V; MAX_ORDER]; 2]; D],
    block: &B,
    i: usize,
    c: usize,
) -> [V; 3]
where
    T: Copy,
    V: Real<T>,
    B: Block<T, D>,
{
    let [w, dw] = &weights[1];
    if D == 2 {
        let value = sum!(order[1], j => w[j] * block.component(index([i, j, 0]), c));
        let slope = sum!(order[1], j => dw[j] * block.component(index([i, j, 0]), c));
        return [value, slope, slope];
    }
    let [w2, dw2] = &weights[D - 1];
    let mut sums = [w[0]; 3];
    for j in 0..order[1] {
        let row = sum!(order[2], k => w2[k] * block.component(index([i, j, k]), c));
        let slope = sum!(order[2], k => dw2[k] * block.component(index([i, j, k]), c));
        let terms = [w[j] * row, dw[j] * row, w[j] * slope];
        for n in 0..3 {
            sums[n] = if j == 0 { terms[n] } else { sums[n] + terms[n] };
        }
    }
    sums
}

/// The first `D` of three indices.
#[inline(always)]
fn index<const D: usize>(all: [usize; 3]) -> [usize; D] {
    let mut index = [0; D];
    index.copy_from_slice(&all[..D]);
    index
}
