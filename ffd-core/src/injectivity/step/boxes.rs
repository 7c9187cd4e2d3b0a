//! The determinant over a part of a cell and a part of the way, in Bernstein form.
//!
//! Along the way there are D + 1 coefficients, each a polynomial in space: slab k of the
//! list. At fixed t the determinant is a mean of the slabs with weights that are not
//! negative. So if each slab is replaced by a lower bound over the box, what comes out is a
//! polynomial in t below the determinant at every point of the box; and that one lies above
//! the convex hull of its coefficients.
//!
//! # Rounding
//!
//! With L the largest absolute coefficient and e the error of the worst: a restriction along
//! the way takes at most three steps for each of its two ends. A step rounds four times
//! relative to L, which makes 24 u L. Its weights s come from exact ends t by two
//! subtractions and a division, 3 u; the polynomial changes by 2 D L at most from s = 0 to
//! 1, so that makes 36 u L for both ends. Together with roundings of the ends themselves,
//! which are none, less than 64 u (L + e).

use std::cmp::Ordering;

use fearless_simd::{Level, Simd, dispatch};

use super::super::partials::UNIT;
use super::super::piece::Shape;
use super::along::{Along, safe_until};

/// See the [module](self).
#[derive(Debug, Clone)]
pub(super) struct TimeBox<const D: usize> {
    /// Regular up to here, exclusively; at least `t[0]`.
    pub(super) safe: f64,
    pub(super) cell: usize,
    /// The lower corner in the cell, and halvings along each axis.
    pub(super) low: [f64; D],
    pub(super) level: [i32; D],
    /// The part of the way, exactly.
    pub(super) t: [f64; 2],
    /// Empty for one that waits among many: they are computed again.
    pub(super) coefficients: Vec<f64>,
    /// By how much they may be wrong.
    pub(super) error: f64,
    /// No coefficient is larger, nor the value at any point.
    pub(super) largest: f64,
}

impl<const D: usize> TimeBox<D> {
    /// Slab k.
    pub(super) fn slab(&self, k: usize) -> &[f64] {
        let count = self.coefficients.len() / (D + 1);
        &self.coefficients[k * count..(k + 1) * count]
    }

    /// The polynomial along the way at a corner.
    pub(super) fn at_corner(&self, shape: &Shape, corner: usize) -> Along {
        let index = shape.corner(corner);
        let mut along = [0.0; 4];
        for k in 0..=D {
            along[k] = self.slab(k)[index];
        }
        along
    }

    /// The polynomial along the way at a point of the box, from 0 to 1 along each axis. It
    /// errs by 256 units relative to the largest coefficient more than they do.
    pub(super) fn at(&self, shape: &Shape, place: [f64; 3]) -> Along {
        let mut along = [0.0; 4];
        for k in 0..=D {
            along[k] = shape.value(self.slab(k), place);
        }
        along
    }

    /// The place on the way for s from 0 to 1 in the box, nearly.
    pub(super) fn time(&self, s: f64) -> f64 {
        self.t[0] + s * (self.t[1] - self.t[0])
    }

    /// Finds out how far the box is safe: infinitely if all of it is. Better bounds of the
    /// slabs are looked for only if they could lead beyond the start and `wanted`.
    pub(super) fn bound(&mut self, shape: &Shape, wanted: f64, scratch: &mut Vec<f64>) {
        self.safe = self.t[0];
        if self.error == f64::INFINITY {
            return;
        }
        let mut least = [0.0; 4];
        let mut largest = 0.0_f64;
        let mut better_first = false;
        for k in 0..=D {
            let bounds = shape.bounds(self.slab(k));
            least[k] = bounds.min - self.error;
            largest = largest.max(bounds.max.abs()).max(bounds.min.abs());
            better_first |= k == 0 && bounds.low_corner.0 > self.error;
        }
        self.largest = largest;
        self.safe = end_of::<D>(self.t, &least);
        if self.safe < wanted && better_first {
            for k in (0..=D).rev() {
                let bound = shape.lower_bound(self.slab(k), false, scratch);
                // The last is the one that folds: what does not help there helps nowhere.
                if k == D && bound - self.error <= least[k] {
                    break;
                }
                least[k] = least[k].max(bound - self.error);
            }
            self.safe = self.safe.max(end_of::<D>(self.t, &least));
        }
    }

    /// Keeps the part of the way from `from` to `to`, both within that of the box.
    pub(super) fn restrict(&mut self, level: Level, from: f64, to: f64) {
        let [start, end] = self.t;
        let high = ((to - start) / (end - start)).min(1.0);
        let low = ((from - start) / (to - start)).clamp(0.0, 1.0);
        if to < end {
            dispatch!(level, s => keep::<_, D>(s, &mut self.coefficients, high, false));
        }
        if from > start {
            dispatch!(level, s => keep::<_, D>(s, &mut self.coefficients, low, true));
        }
        self.t = [from, to];
        self.error += 64.0 * UNIT * (self.largest + self.error);
    }

    /// Cuts the box in the middle of an axis.
    pub(super) fn cut(mut self, shape: &Shape, axis: usize) -> [Self; 2] {
        let count = self.coefficients.len() / (D + 1);
        let mut low = Self {
            coefficients: vec![0.0; self.coefficients.len()],
            ..self
        };
        let slabs = low.coefficients.chunks_exact_mut(count);
        for (low, high) in slabs.zip(self.coefficients.chunks_exact_mut(count)) {
            shape.split(axis, low, high);
        }
        let mut high = self;
        high.low[axis] += 0.5_f64.powi(high.level[axis] + 1);
        for half in [&mut low, &mut high] {
            half.level[axis] += 1;
            half.error = shape.error_after_split(axis, half.error, half.largest);
        }
        [low, high]
    }

    /// How much the coefficients are curved along each axis, and last along the way.
    pub(super) fn curvatures(&self, shape: &Shape) -> ([f64; 3], f64) {
        let mut most = [0.0_f64; 3];
        for k in 0..=D {
            let each = shape.curvatures(self.slab(k));
            most = std::array::from_fn(|axis| most[axis].max(each[axis]));
        }
        let mut along = 0.0_f64;
        for k in 0..D - 1 {
            let (a, b, c) = (self.slab(k), self.slab(k + 1), self.slab(k + 2));
            for ((a, b), c) in a.iter().zip(b).zip(c) {
                along = along.max((a - 2.0 * b + c).abs());
            }
        }
        (most, along)
    }

    /// From and to along each axis of the cell.
    pub(super) fn size(&self) -> [f64; D] {
        self.level.map(|level| 0.5_f64.powi(level))
    }
}

/// Up to where all polynomials with coefficients of at least these on a part of the way are
/// positive, rounded down; infinite if they are in all of it.
pub(super) fn end_of<const D: usize>([from, to]: [f64; 2], least: &Along) -> f64 {
    let until = safe_until::<D>(least);
    if until == f64::INFINITY {
        return until;
    }
    let end = from + until * (to - from).next_down();
    end.next_down().max(from)
}

/// The part before or after `s`, by de Casteljau's algorithm.
#[inline(always)]
fn keep<S: Simd, const D: usize>(_: S, coefficients: &mut [f64], s: f64, upper: bool) {
    let count = coefficients.len() / (D + 1);
    let rest = 1.0 - s;
    for step in 1..=D {
        for i in 0..=D - step {
            // The upper part keeps what is at the end, the lower part what is at the start.
            let k = if upper { i } else { D - 1 - i };
            let (before, after) = coefficients.split_at_mut((k + 1) * count);
            let (a, b) = (&mut before[k * count..], &mut after[..count]);
            if upper {
                for (a, b) in a.iter_mut().zip(&*b) {
                    *a = rest * *a + s * *b;
                }
            } else {
                for (b, a) in b.iter_mut().zip(&*a) {
                    *b = rest * *a + s * *b;
                }
            }
        }
    }
}

impl<const D: usize> PartialEq for TimeBox<D> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<const D: usize> Eq for TimeBox<D> {}

impl<const D: usize> PartialOrd for TimeBox<D> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The greatest is the one that may fold first; of equals, the first cell and place.
impl<const D: usize> Ord for TimeBox<D> {
    fn cmp(&self, other: &Self) -> Ordering {
        let places = || {
            let mut axes = 0..D;
            axes.find_map(|a| {
                let order = other.low[a].total_cmp(&self.low[a]);
                (order != Ordering::Equal).then_some(order)
            })
        };
        other
            .safe
            .total_cmp(&self.safe)
            .then(other.cell.cmp(&self.cell))
            .then_with(|| places().unwrap_or(Ordering::Equal))
    }
}
