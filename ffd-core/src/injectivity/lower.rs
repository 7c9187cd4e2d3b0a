//! Lower bounds of a polynomial over a box that are better than its smallest coefficient.
//!
//! Near a place where the polynomial is ε above zero, coefficients are positive only in
//! boxes of about √ε: so it takes about log 1/ε cuts to reach a minimum at a point, and
//! about 1/ε boxes to cover one along an oblique sheet. The bounds here depend on how the
//! polynomial is shaped, not on how small it is:
//!
//! 1. Where all differences along an axis have one sign, the polynomial is monotone, and
//!    its minimum lies on a face of the box: the axis is dropped.
//! 2. Where its second derivatives stay close to a positive definite matrix, it is convex,
//!    and lies above its tangent plane at any point; the tangent at the minimum, found by
//!    Newton's method, is a bound without any gap.
//! 3. Where it resembles squares, as along a sheet, these squares are subtracted. They are
//!    not negative, so the coefficients of the rest still bound the polynomial from below;
//!    and the rest varies only in the third order.
//!
//! All of that is about the polynomial with exactly the given coefficients. What is chosen by
//! rounded arithmetic, the point of the tangent and the squares, decides how good a bound
//! is, never whether it holds.

use fearless_simd::{Level, Simd, dispatch};

use super::partials::UNIT;
use super::piece::{MOST, Shape, range};

/// Value, gradient and second derivatives at a point.
#[derive(Debug, Clone, Copy)]
struct Expansion {
    value: f64,
    gradient: [f64; 3],
    hessian: [[f64; 3]; 3],
}

/// The polynomial on a box, or on a face of it.
#[derive(Debug)]
struct Form<'a> {
    level: Level,
    /// Coefficients along each axis; 1 along those that were dropped.
    counts: [usize; 3],
    coefficients: &'a mut Vec<f64>,
}

impl Shape {
    /// A lower bound of the polynomial with exactly the given coefficients; of its
    /// negative, if `negated`. `scratch` is overwritten.
    pub(super) fn lower_bound(
        &self,
        coefficients: &[f64],
        negated: bool,
        scratch: &mut Vec<f64>,
    ) -> f64 {
        scratch.clear();
        scratch.extend_from_slice(coefficients);
        if negated {
            for c in scratch.iter_mut() {
                *c = -*c;
            }
        }
        let mut form = Form {
            level: self.level,
            counts: self.counts,
            coefficients: scratch,
        };
        let _faces = form.drop_monotone_axes();
        let (least, most) = dispatch!(form.level, s => range(s, form.coefficients));
        let middle = form.expand([0.5; 3]);
        let tangent = form.bound_by_tangent(middle, least.abs().max(most.abs()));
        if tangent > 0.0 {
            return least.max(tangent);
        }
        let squares = form.bound_by_squares(&middle, least.abs().max(most.abs()));
        least.max(tangent).max(squares)
    }

    /// The value at a point of the box. It errs by less than 256 units relative to the
    /// largest coefficient: see the rounding of the tangent plane.
    pub(super) fn value(&self, coefficients: &[f64], at: [f64; 3]) -> f64 {
        let weights: [[[f64; MOST]; 3]; 3] =
            std::array::from_fn(|axis| bernstein_weights(self.counts[axis] - 1, at[axis]));
        dispatch!(self.level, s => expand(s, self.counts, &weights, coefficients)).value
    }

    /// A point of the box where the polynomial is nearly least, if it is convex around the
    /// middle; some point otherwise. `scratch` is overwritten.
    pub(super) fn lowest_place(&self, coefficients: &[f64], scratch: &mut Vec<f64>) -> [f64; 3] {
        scratch.clear();
        scratch.extend_from_slice(coefficients);
        let mut form = Form {
            level: self.level,
            counts: self.counts,
            coefficients: scratch,
        };
        let faces = form.drop_monotone_axes();
        let mut at = [0.5; 3];
        for _ in 0..4 {
            let here = form.expand(at);
            let scale: [f64; 3] = std::array::from_fn(|axis| 1.0 / here.hessian[axis][axis].sqrt());
            if (0..3).any(|axis| form.is_active(axis) && !scale[axis].is_finite()) {
                break;
            }
            form.step_towards_minimum(&here, &scale, &mut at);
        }
        std::array::from_fn(|axis| faces[axis].unwrap_or(at[axis]))
    }
}

impl Form<'_> {
    fn is_active(&self, axis: usize) -> bool {
        self.counts[axis] > 1
    }

    /// Restricts the polynomial to faces that its minimum lies on, and returns where they
    /// are. The sign of a difference of two numbers survives rounding.
    fn drop_monotone_axes(&mut self) -> [Option<f64>; 3] {
        let mut faces = [None; 3];
        let mut stride = 1;
        for axis in 0..3 {
            let count = self.counts[axis];
            if count == 1 {
                continue;
            }
            let coefficients = &*self.coefficients;
            let (rising, falling) =
                dispatch!(self.level, s => directions(s, stride, count, coefficients));
            if !(rising || falling) {
                stride *= count;
                continue;
            }
            let face = if rising { 0 } else { count - 1 };
            let mut kept = 0;
            for slab in (0..self.coefficients.len()).step_by(stride * count) {
                let from = slab + face * stride;
                self.coefficients.copy_within(from..from + stride, kept);
                kept += stride;
            }
            self.coefficients.truncate(kept);
            self.counts[axis] = 1;
            faces[axis] = Some(if rising { 0.0 } else { 1.0 });
        }
        faces
    }

    /// Value and derivatives at a point, nearly.
    fn expand(&self, at: [f64; 3]) -> Expansion {
        let weights: [[[f64; MOST]; 3]; 3] =
            std::array::from_fn(|axis| bernstein_weights(self.counts[axis] - 1, at[axis]));
        dispatch!(self.level, s => expand(s, self.counts, &weights, self.coefficients))
    }

    /// If the polynomial is convex, its tangent plane near the minimum.
    ///
    /// # Rounding
    ///
    /// Weights of an evaluation err by less than 3 · 14 units along each axis, sums add 15:
    /// less than 256 units in all, relative to the largest coefficient; twice the degree as
    /// much for a derivative.
    fn bound_by_tangent(&self, middle: Expansion, largest: f64) -> f64 {
        let Some(scale) = self.convexity(&middle.hessian, largest) else {
            return f64::NEG_INFINITY;
        };
        let mut at = [0.5; 3];
        let mut here = middle;
        for _ in 0..3 {
            self.step_towards_minimum(&here, &scale, &mut at);
            here = self.expand(at);
        }
        let mut bound = here.value - 256.0 * UNIT * largest;
        for axis in (0..3).filter(|&axis| self.is_active(axis)) {
            let (slope, position) = (here.gradient[axis], at[axis]);
            let error = 512.0 * UNIT * (self.counts[axis] - 1) as f64 * largest;
            bound += f64::min(-slope * position, slope * (1.0 - position)) - error;
        }
        bound
    }

    /// Whether the polynomial is convex in the box: then one over the roots of the
    /// diagonal of its second derivatives.
    ///
    /// Second derivatives lie between their Bernstein coefficients. Scaled to ones on the
    /// diagonal, they are a matrix C and something whose row sums are at most ρ; they are
    /// positive definite if C − ρ is. Roundings are far below the margin of a hundredth.
    fn convexity(&self, middle: &[[f64; 3]; 3], largest: f64) -> Option<[f64; 3]> {
        let mut scale = [0.0; 3];
        for axis in (0..3).filter(|&axis| self.is_active(axis)) {
            scale[axis] = 1.0 / middle[axis][axis].sqrt();
            // Also where the root is not a number.
            if middle[axis][axis] <= 0.0 || !scale[axis].is_finite() {
                return None;
            }
        }
        let mut center = [[0.0; 3]; 3];
        let mut radius = [0.0; 3];
        for a in 0..3 {
            if !self.is_active(a) {
                center[a][a] = 2.0;
                continue;
            }
            for b in a..3 {
                if !self.is_active(b) {
                    continue;
                }
                let counts = self.counts;
                let [low, high] = dispatch!(self.level, s => second_differences(s, counts, a, b, self.coefficients));
                let [m, n] = [counts[a], counts[b]].map(|count| (count - 1) as f64);
                let factor = if a == b { m * (m - 1.0) } else { m * n };
                let scaled = factor * scale[a] * scale[b];
                let rounding = 16.0 * UNIT * largest * scaled;
                let half = 0.5 * (high - low) * scaled + rounding;
                let mean = 0.5 * (high + low) * scaled;
                center[a][b] = mean;
                center[b][a] = mean;
                radius[a] += half;
                if a != b {
                    radius[b] += half;
                }
            }
        }
        let most = radius.iter().fold(0.0_f64, |m, &r| m.max(r));
        for a in 0..3 {
            center[a][a] -= most + 0.01;
        }
        is_positive_definite(&center).then_some(scale)
    }

    /// A step of Newton's method for the minimum in the box, with coordinates that would
    /// leave it held at its faces.
    fn step_towards_minimum(&self, here: &Expansion, scale: &[f64; 3], at: &mut [f64; 3]) {
        let mut free: [bool; 3] = std::array::from_fn(|axis| self.is_active(axis));
        let mut target = *at;
        for _ in 0..3 {
            // The matrix scaled to ones on the diagonal, and held coordinates left out.
            let mut matrix = [[0.0; 3]; 3];
            let mut right = [0.0; 3];
            for a in 0..3 {
                if !free[a] {
                    matrix[a][a] = 1.0;
                    continue;
                }
                let held: f64 = (0..3)
                    .filter(|&b| !free[b] && self.is_active(b))
                    .map(|b| here.hessian[a][b] * (target[b] - at[b]))
                    .sum();
                right[a] = -(here.gradient[a] + held) * scale[a];
                for b in (0..3).filter(|&b| free[b]) {
                    matrix[a][b] = here.hessian[a][b] * scale[a] * scale[b];
                }
            }
            let step = crate::matrix::solve(&matrix, right);
            let mut left = false;
            for a in (0..3).filter(|&a| free[a]) {
                let to = at[a] + step[a] * scale[a];
                target[a] = if to.is_nan() {
                    at[a]
                } else {
                    to.clamp(0.0, 1.0)
                };
                left |= !(0.0..=1.0).contains(&to);
            }
            if !left {
                break;
            }
            for (free, &to) in free.iter_mut().zip(&target) {
                *free &= to > 0.0 && to < 1.0;
            }
            if !free.contains(&true) {
                break;
            }
        }
        *at = target;
    }

    /// What is left after subtracting squares.
    ///
    /// # Rounding
    ///
    /// Each coefficient of a square is the result of fewer than 24 roundings of terms that
    /// add up to at most twice its largest value; and is subtracted.
    fn bound_by_squares(&mut self, middle: &Expansion, largest: f64) -> f64 {
        // A square needs degree 2.
        if self.counts.contains(&2) {
            return f64::NEG_INFINITY;
        }
        let (squares, count) = squares(middle.gradient, middle.hessian, self.counts);
        let squares = &squares[..count];
        if squares.is_empty() {
            return f64::NEG_INFINITY;
        }
        for &square in squares {
            let counts = self.counts;
            dispatch!(self.level, s => subtract(s, counts, square, self.coefficients));
        }
        let (min, _) = dispatch!(self.level, s => range(s, self.coefficients));
        let size: f64 = squares.iter().map(Square::largest).sum();
        min - UNIT * (64.0 * size + 8.0 * largest)
    }
}

/// By Gaussian elimination. Nothing that is not a number passes.
fn is_positive_definite(m: &[[f64; 3]; 3]) -> bool {
    let a = m[0][0];
    let (l1, l2) = (m[1][0] / a, m[2][0] / a);
    let b = m[1][1] - l1 * m[1][0];
    let off = m[2][1] - l1 * m[2][0];
    let c = m[2][2] - l2 * m[2][0] - off * off / b;
    a > 0.0 && b > 0.0 && c > 0.0
}

/// `½ d (l · y + s)²`, with y the position from the middle of the box.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Square {
    half: f64,
    direction: [f64; 3],
    shift: f64,
}

impl Square {
    /// At least the largest absolute coefficient, and the terms of each.
    fn largest(&self) -> f64 {
        let reach: f64 = self.direction.iter().map(|l| 0.5 * l.abs()).sum();
        2.0 * self.half * (reach + self.shift.abs()).powi(2)
    }
}

/// The positive part of an expansion: elimination with the largest diagonal entry as pivot,
/// as long as that is positive.
fn squares(
    mut gradient: [f64; 3],
    mut hessian: [[f64; 3]; 3],
    counts: [usize; 3],
) -> ([Square; 3], usize) {
    let mut all = [Square::default(); 3];
    let mut count = 0;
    let size = (0..3).fold(0.0_f64, |m, a| m.max(hessian[a][a]));
    while count < 3 {
        let mut pivot = 0;
        for a in 1..3 {
            if hessian[a][a] > hessian[pivot][pivot] {
                pivot = a;
            }
        }
        let d = hessian[pivot][pivot];
        if !(d > 1e-9 * size && d.is_finite()) {
            break;
        }
        let mut direction = hessian[pivot].map(|h| h / d);
        for a in 0..3 {
            // Where the pivot's row was eliminated before, and along dropped axes.
            if counts[a] == 1 {
                direction[a] = 0.0;
            }
        }
        // The square is zero on a plane through the box or at its border: else it would
        // be larger than what it stands for.
        let reach: f64 = direction.iter().map(|l| 0.5 * l.abs()).sum();
        let shift = (gradient[pivot] / d).clamp(-reach, reach);
        all[count] = Square {
            half: 0.5 * d,
            direction,
            shift,
        };
        count += 1;
        for a in 0..3 {
            gradient[a] -= d * shift * direction[a];
            for b in 0..3 {
                hessian[a][b] -= d * direction[a] * direction[b];
            }
        }
        hessian[pivot][pivot] = 0.0;
    }
    (all, count)
}

/// Whether all differences along an axis are at least zero, and whether at most zero.
#[inline(always)]
fn directions<S: Simd>(_: S, stride: usize, count: usize, coefficients: &[f64]) -> (bool, bool) {
    let (mut rising, mut falling) = (true, true);
    for slab in coefficients.chunks_exact(stride * count) {
        let len = stride * (count - 1);
        let (this, next) = (&slab[..len], &slab[stride..][..len]);
        let (mut up, mut down) = (true, true);
        for i in 0..len {
            up &= next[i] >= this[i];
            down &= next[i] <= this[i];
        }
        rising &= up;
        falling &= down;
        if !(rising || falling) {
            break;
        }
    }
    (rising, falling)
}

/// The least and the largest of the differences along axis a and then b.
#[inline(always)]
fn second_differences<S: Simd>(
    _: S,
    counts: [usize; 3],
    a: usize,
    b: usize,
    coefficients: &[f64],
) -> [f64; 2] {
    let stride = [1, counts[0], counts[0] * counts[1]];
    let mut ends = counts;
    ends[a] -= 1;
    ends[b] -= 1;
    let (p, q) = (stride[a], stride[b]);
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for k in 0..ends[2] {
        for j in 0..ends[1] {
            let start = j * stride[1] + k * stride[2];
            let row = &coefficients[start..start + p + q + ends[0]];
            for i in 0..ends[0] {
                let second = row[i + p + q] - row[i + p] - (row[i + q] - row[i]);
                let lane = i % 4;
                low[lane] = if second < low[lane] {
                    second
                } else {
                    low[lane]
                };
                high[lane] = if second > high[lane] {
                    second
                } else {
                    high[lane]
                };
            }
        }
    }
    [
        low.iter().fold(f64::INFINITY, |m, &x| m.min(x)),
        high.iter().fold(f64::NEG_INFINITY, |m, &x| m.max(x)),
    ]
}

/// Weights of the coefficients of a polynomial of degree n in its value and its first two
/// derivatives at t.
fn bernstein_weights(n: usize, t: f64) -> [[f64; MOST]; 3] {
    let mut rows = [[0.0; MOST]; 3];
    let mut basis = [0.0; MOST];
    basis[0] = 1.0;
    for degree in 0..=n {
        // Polynomials of degree n − r, differenced r times.
        let r = n - degree;
        if r <= 2 {
            let mut row = basis;
            for step in 0..r {
                for i in (1..=degree + step + 1).rev() {
                    row[i] = row[i - 1] - row[i];
                }
                row[0] = -row[0];
            }
            let factor: f64 = (degree + 1..=n).map(|i| i as f64).product();
            rows[r] = row.map(|w| w * factor);
        }
        for i in (1..=degree + 1).rev() {
            if i < MOST {
                basis[i] = basis[i] * (1.0 - t) + basis[i - 1] * t;
            }
        }
        basis[0] *= 1.0 - t;
    }
    rows
}

#[inline(always)]
fn expand<S: Simd>(
    _: S,
    counts: [usize; 3],
    weights: &[[[f64; MOST]; 3]; 3],
    coefficients: &[f64],
) -> Expansion {
    let plane = counts[0] * counts[1];
    // Along the last axis: one plane for each order of derivative.
    let mut planes = [[0.0; MOST * MOST]; 3];
    for (k, slab) in coefficients.chunks_exact(plane).enumerate() {
        for r in 0..3 {
            let weight = weights[2][r][k];
            for (sum, c) in planes[r][..plane].iter_mut().zip(slab) {
                *sum += weight * c;
            }
        }
    }
    // Then along the second: one row for each pair of orders up to two together.
    let mut rows = [[[0.0; MOST]; 3]; 3];
    for r2 in 0..3 {
        for (j, row) in planes[r2][..plane].chunks_exact(counts[0]).enumerate() {
            for r1 in 0..3 - r2 {
                let weight = weights[1][r1][j];
                for (sum, c) in rows[r2][r1].iter_mut().zip(row) {
                    *sum += weight * c;
                }
            }
        }
    }
    let at = |orders: [usize; 3]| -> f64 {
        let row = &rows[orders[2]][orders[1]];
        (0..counts[0])
            .map(|i| weights[0][orders[0]][i] * row[i])
            .sum()
    };
    let mut expansion = Expansion {
        value: at([0; 3]),
        gradient: [0.0; 3],
        hessian: [[0.0; 3]; 3],
    };
    for a in 0..3 {
        let mut orders = [0; 3];
        orders[a] = 1;
        expansion.gradient[a] = at(orders);
        for b in 0..3 {
            let mut orders = orders;
            orders[b] += 1;
            expansion.hessian[a][b] = at(orders);
        }
    }
    expansion
}

/// Subtracts the Bernstein coefficients of a square: with ξ = i/m − ½ along each axis,
/// those of `(l · y + s)²` are `(l · ξ + s)² − Σ l² i (m − i) / (m² (m − 1))`.
#[inline(always)]
fn subtract<S: Simd>(_: S, counts: [usize; 3], square: Square, out: &mut [f64]) {
    let mut linear = [[0.0; MOST]; 3];
    let mut correction = [[0.0; MOST]; 3];
    for axis in 0..3 {
        if counts[axis] < 3 {
            continue;
        }
        let (m, l) = (counts[axis] as f64 - 1.0, square.direction[axis]);
        for i in 0..counts[axis] {
            let i_ = i as f64;
            linear[axis][i] = l * (i_ / m - 0.5);
            correction[axis][i] = l * l * (i_ * (m - i_)) / (m * m * (m - 1.0));
        }
    }
    for (number, row) in out.chunks_exact_mut(counts[0]).enumerate() {
        let (j, k) = (number % counts[1], number / counts[1]);
        let base = linear[1][j] + linear[2][k] + square.shift;
        let less = correction[1][j] + correction[2][k];
        for (i, out) in row.iter_mut().enumerate() {
            let at = linear[0][i] + base;
            *out -= square.half * (at * at - (correction[0][i] + less));
        }
    }
}
