//! The basis functions of one cell, for any knots.
//!
//! In a cell between the knots `κ₀ = 0` and `κ₁ = 1` the functions of degree p that
//! are not zero are `b₀ᵖ … bₚᵖ`. They follow from those of degree p − 1 by
//!
//! ```text
//! bⱼᵖ(t) = (t − κⱼ₋ₚ) qⱼ₋₁(t) + (κⱼ₊₁ − t) qⱼ(t),     qᵣ = bᵣᵖ⁻¹ / (κᵣ₊₁ − κᵣ₊₁₋ₚ),
//! ```
//!
//! with `b₀⁰ = 1` and functions out of range taken as zero, and the derivatives are
//! `bⱼᵖ' = p (qⱼ₋₁ − qⱼ)`. In the values all terms are positive: each is accurate to a
//! few units in its last place.
//!
//! Everything here is generic over the number type, so that a single point, a vector of
//! points, and both precisions run through the same operations in the same order.
//!
//! # References
//!
//! * C. de Boor, *On calculating with B-splines*, Journal of Approximation
//!   Theory 6 (1972).

use std::ops::{Add, Mul, Sub};

use super::degree::MAX_ORDER;

/// Arithmetic of one number or of a vector of independent numbers, with `T` the type of
/// one number. Addition, subtraction and multiplication only, never fused.
pub(crate) trait Real<T>:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Sub<T, Output = Self>
    + Mul<Output = Self>
    + Mul<T, Output = Self>
{
}

impl<T, V> Real<T> for V where
    V: Copy
        + Add<Output = V>
        + Sub<Output = V>
        + Sub<T, Output = V>
        + Mul<Output = V>
        + Mul<T, Output = V>
{
}

/// Highest degree.
const MOST: usize = MAX_ORDER - 1;

/// The constants of the recursion in one cell: its knots, in cell lengths from the
/// cell's beginning, and the inverses of their differences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CellBasis<T> {
    /// `low[i] = κ₋ᵢ`.
    low: [T; MOST],
    /// `high[i] = κᵢ₊₁`.
    high: [T; MOST],
    /// `inverse[p − 1][r] = 1 / (κᵣ₊₁ − κᵣ₊₁₋ₚ)`.
    inverse: [[T; MOST]; MOST],
    /// `scaled[p − 1][r] = p / (κᵣ₊₁ − κᵣ₊₁₋ₚ)`, for derivatives.
    scaled: [[T; MOST]; MOST],
}

impl CellBasis<f64> {
    /// The constants for the knots `knot(1 − n) ≤ … ≤ knot(0) = 0 < knot(1) = 1 ≤ … ≤ knot(n)`.
    pub(crate) fn new(degree: usize, knot: impl Fn(isize) -> f64) -> Self {
        let mut basis = Self {
            low: [0.0; MOST],
            high: [1.0; MOST],
            inverse: [[0.0; MOST]; MOST],
            scaled: [[0.0; MOST]; MOST],
        };
        for i in 0..degree {
            basis.low[i] = knot(-i.cast_signed());
            basis.high[i] = knot(i.cast_signed() + 1);
        }
        for p in 1..=degree {
            for r in 0..p {
                let difference = basis.high[r] - basis.low[p - r - 1];
                basis.inverse[p - 1][r] = 1.0 / difference;
                basis.scaled[p - 1][r] = p as f64 / difference;
            }
        }
        basis
    }

    /// The same constants in another precision.
    pub(crate) fn convert<T: Copy>(&self, to: impl Fn(f64) -> T) -> CellBasis<T> {
        CellBasis {
            low: self.low.map(&to),
            high: self.high.map(&to),
            inverse: self.inverse.map(|row| row.map(&to)),
            scaled: self.scaled.map(|row| row.map(&to)),
        }
    }
}

impl<T: Copy> CellBasis<T> {
    /// The `degree + 1` basis functions at `t` from 0 to 1. Entries beyond are `zero`.
    #[inline(always)]
    pub(crate) fn values<V: Real<T>>(
        &self,
        degree: usize,
        t: V,
        zero: V,
        one: V,
    ) -> [V; MAX_ORDER] {
        let mut basis = linear(t, zero, one);
        self.raise_to(&mut basis, degree, t, zero);
        basis
    }

    /// The basis functions and their first derivatives with respect to `t`.
    #[inline(always)]
    pub(crate) fn values_and_slopes<V: Real<T>>(
        &self,
        degree: usize,
        t: V,
        zero: V,
        one: V,
    ) -> [[V; MAX_ORDER]; 2] {
        let mut basis = linear(t, zero, one);
        self.raise_to(&mut basis, degree - 1, t, zero);
        let mut slopes = basis;
        if degree == 1 {
            slopes[0] = zero - one;
            slopes[1] = one;
        } else {
            self.differentiate(&mut slopes, degree, zero);
            self.raise(&mut basis, degree, t, zero);
        }
        [basis, slopes]
    }

    /// Second derivatives of the basis functions with respect to `t`.
    pub(crate) fn curvatures<V: Real<T>>(
        &self,
        degree: usize,
        t: V,
        zero: V,
        one: V,
    ) -> [V; MAX_ORDER] {
        if degree == 1 {
            return [zero; MAX_ORDER];
        }
        // Degree n − 2, differentiated twice.
        let mut basis = [zero; MAX_ORDER];
        if degree == 2 {
            basis[0] = one;
        } else {
            basis = self.values(degree - 2, t, zero, one);
        }
        self.differentiate(&mut basis, degree - 1, zero);
        self.differentiate(&mut basis, degree, zero);
        basis
    }

    /// The polar forms (blossoms) of the basis functions: multi-affine, symmetric in
    /// `arguments`, and equal to the values where all arguments are equal.
    pub(crate) fn blossoms<V: Real<T>>(&self, arguments: &[V], zero: V, one: V) -> [V; MAX_ORDER] {
        let mut basis = [zero; MAX_ORDER];
        basis[0] = one;
        for (i, &argument) in arguments.iter().enumerate() {
            if i == 0 {
                basis = linear(argument, zero, one);
            } else {
                self.raise(&mut basis, i + 1, argument, zero);
            }
        }
        basis
    }

    /// Turns functions of degree 1 into those of `degree`.
    #[inline(always)]
    fn raise_to<V: Real<T>>(&self, basis: &mut [V; MAX_ORDER], degree: usize, t: V, zero: V) {
        // Written out, so that where the degree is known to the compiler it unrolls each
        // step and keeps the functions in registers.
        if degree >= 2 {
            self.raise(basis, 2, t, zero);
        }
        if degree >= 3 {
            self.raise(basis, 3, t, zero);
        }
        if degree >= 4 {
            self.raise(basis, 4, t, zero);
        }
        if degree >= 5 {
            self.raise(basis, 5, t, zero);
        }
    }

    /// Turns functions of degree `p − 1` into those of degree `p`.
    #[inline(always)]
    fn raise<V: Real<T>>(&self, basis: &mut [V; MAX_ORDER], p: usize, t: V, zero: V) {
        // The part of the function before that reaches into this one.
        let mut carried = zero;
        for r in 0..p {
            let quotient = basis[r] * self.inverse[p - 1][r];
            basis[r] = carried - (t - self.high[r]) * quotient;
            carried = (t - self.low[p - r - 1]) * quotient;
        }
        basis[p] = carried;
    }

    /// Turns functions (or derivatives) of degree `p − 1` into derivatives of degree
    /// `p`, of one order more.
    #[inline(always)]
    fn differentiate<V: Real<T>>(&self, basis: &mut [V; MAX_ORDER], p: usize, zero: V) {
        let mut before = zero;
        for r in 0..p {
            let quotient = basis[r] * self.scaled[p - 1][r];
            basis[r] = before - quotient;
            before = quotient;
        }
        basis[p] = before;
    }
}

/// The functions of degree 1, which are the same for all knots.
#[inline(always)]
fn linear<V: Copy + Sub<Output = V>>(t: V, zero: V, one: V) -> [V; MAX_ORDER] {
    let mut basis = [zero; MAX_ORDER];
    basis[0] = one - t;
    basis[1] = t;
    basis
}
