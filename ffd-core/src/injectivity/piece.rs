//! Bernstein coefficients of a polynomial over a box, and what can be told from them.
//!
//! A polynomial lies between its smallest and its largest coefficient; at the corners of the
//! box it is equal to the corner coefficients. Cutting the box into halves (de Casteljau)
//! brings coefficients and values together, quadratically in the size of the box.
//!
//! Where that is too slow, [`lower`](super::lower) has better bounds.

use fearless_simd::{Level, Simd, dispatch};

use super::partials::UNIT;

/// The highest number of coefficients along an axis: three times the highest degree.
pub(super) const MOST: usize = 15;

/// Lines along the first axis that are cut together.
const LINES: usize = 8;

/// The degrees of a polynomial along up to three axes, and constants that depend on them.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub(super) level: Level,
    /// Coefficients along each axis; 1 for a third axis that is not there.
    pub(super) counts: [usize; 3],
}

/// The least and the largest coefficient; the same of the corners, and which they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) min: f64,
    pub(super) max: f64,
    /// Smallest corner value and corner number: bit a says whether it is the upper end of
    /// axis a.
    pub(super) low_corner: (f64, usize),
    pub(super) high_corner: (f64, usize),
}

impl Shape {
    pub(super) fn new(degree: &[usize]) -> Self {
        let mut counts = [1; 3];
        for (count, n) in counts.iter_mut().zip(degree) {
            *count = n + 1;
        }
        Self {
            level: Level::new(),
            counts,
        }
    }

    pub(super) fn dimension(&self) -> usize {
        if self.counts[2] == 1 { 2 } else { 3 }
    }

    /// The index of a corner's coefficient.
    pub(super) fn corner(&self, corner: usize) -> usize {
        let [n0, n1, n2] = self.counts;
        let end = |axis: usize, n: usize| (n - 1) * (corner >> axis & 1);
        end(0, n0) + n0 * (end(1, n1) + n1 * end(2, n2))
    }

    pub(super) fn bounds(&self, coefficients: &[f64]) -> Bounds {
        let (min, max) = dispatch!(self.level, s => range(s, coefficients));
        let mut bounds = Bounds {
            min,
            max,
            low_corner: (f64::INFINITY, 0),
            high_corner: (f64::NEG_INFINITY, 0),
        };
        for corner in 0..1 << self.dimension() {
            let value = coefficients[self.corner(corner)];
            if value < bounds.low_corner.0 {
                bounds.low_corner = (value, corner);
            }
            if value > bounds.high_corner.0 {
                bounds.high_corner = (value, corner);
            }
        }
        bounds
    }

    /// Cuts the box in the middle of an axis: `low` becomes the lower half, and `high`,
    /// which holds the whole box, the upper half. Coefficients err by at most `count − 1`
    /// roundings more.
    pub(super) fn split(&self, axis: usize, low: &mut [f64], high: &mut [f64]) {
        let stride: usize = self.counts[..axis].iter().product();
        let count = self.counts[axis];
        if axis == 0 {
            dispatch!(self.level, s => split_lines(s, count, low, high));
        } else {
            dispatch!(self.level, s => split_slabs(s, stride, count, low, high));
        }
    }

    /// The error of both halves if that of the whole was `error` and no coefficient is
    /// larger than `largest`.
    pub(super) fn error_after_split(&self, axis: usize, error: f64, largest: f64) -> f64 {
        1.001 * UNIT * (self.counts[axis] - 1) as f64 * (largest + error) + error
    }

    /// The largest second difference along each axis.
    pub(super) fn curvatures(&self, coefficients: &[f64]) -> [f64; 3] {
        dispatch!(self.level, s => curvatures(s, self.counts, coefficients))
    }

    /// The axis along which the coefficients are curved most.
    pub(super) fn most_curved_axis(&self, coefficients: &[f64]) -> usize {
        let curvature = self.curvatures(coefficients);
        let mut most = 0;
        for axis in 1..self.dimension() {
            if curvature[axis] > curvature[most] {
                most = axis;
            }
        }
        most
    }
}

#[inline(always)]
pub(super) fn range<S: Simd>(_: S, coefficients: &[f64]) -> (f64, f64) {
    let (chunks, rest) = coefficients.as_chunks::<8>();
    let (mut min, mut max) = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
    for chunk in chunks {
        for i in 0..8 {
            min[i] = if chunk[i] < min[i] { chunk[i] } else { min[i] };
            max[i] = if chunk[i] > max[i] { chunk[i] } else { max[i] };
        }
    }
    let mut all = (f64::INFINITY, f64::NEG_INFINITY);
    for i in 0..8 {
        all = (all.0.min(min[i]), all.1.max(max[i]));
    }
    for &c in rest {
        all = (all.0.min(c), all.1.max(c));
    }
    all
}

#[inline(always)]
fn split_slabs<S: Simd>(_: S, stride: usize, count: usize, low: &mut [f64], high: &mut [f64]) {
    let slabs = high.chunks_exact_mut(stride * count);
    for (high, low) in slabs.zip(low.chunks_exact_mut(stride * count)) {
        low[..stride].copy_from_slice(&high[..stride]);
        for step in 1..count {
            for i in 0..count - step {
                let (this, next) = high[i * stride..(i + 2) * stride].split_at_mut(stride);
                for (this, next) in this.iter_mut().zip(&*next) {
                    *this = 0.5 * (*this + *next);
                }
            }
            low[step * stride..(step + 1) * stride].copy_from_slice(&high[..stride]);
        }
    }
}

/// Along the first axis, where a vector would have to hold parts of one line: several lines
/// are transposed and cut together.
#[inline(always)]
fn split_lines<S: Simd>(_: S, count: usize, low: &mut [f64], high: &mut [f64]) {
    let lines = high.len() / count;
    let mut line = 0;
    while line < lines {
        let here = (lines - line).min(LINES);
        let mut columns = [[0.0; LINES]; MOST];
        for l in 0..here {
            for (i, &value) in high[(line + l) * count..][..count].iter().enumerate() {
                columns[i][l] = value;
            }
        }
        let mut lower = [[0.0; LINES]; MOST];
        lower[0] = columns[0];
        for step in 1..count {
            for i in 0..count - step {
                for l in 0..LINES {
                    columns[i][l] = 0.5 * (columns[i][l] + columns[i + 1][l]);
                }
            }
            lower[step] = columns[0];
        }
        for l in 0..here {
            for i in 0..count {
                high[(line + l) * count + i] = columns[i][l];
                low[(line + l) * count + i] = lower[i][l];
            }
        }
        line += here;
    }
}

/// The largest second difference along each axis.
#[inline(always)]
fn curvatures<S: Simd>(_: S, counts: [usize; 3], coefficients: &[f64]) -> [f64; 3] {
    let mut most = [0.0; 3];
    let mut stride = 1;
    for axis in 0..3 {
        let count = counts[axis];
        let mut lanes = [0.0_f64; 8];
        if count > 2 {
            for slab in coefficients.chunks_exact(stride * count) {
                let len = stride * (count - 2);
                let (a, b, c) = (
                    &slab[..len],
                    &slab[stride..][..len],
                    &slab[2 * stride..][..len],
                );
                for i in 0..len {
                    let second = (a[i] - 2.0 * b[i] + c[i]).abs();
                    let lane = &mut lanes[i % 8];
                    *lane = if second > *lane { second } else { *lane };
                }
            }
        }
        most[axis] = lanes.iter().fold(0.0_f64, |m, &l| m.max(l));
        stride *= count;
    }
    most
}
