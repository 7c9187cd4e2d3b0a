//! Floating-point numbers as exact ones, and what the oracle needs to compute with.

use dashu_int::IBig;
use dashu_ratio::RBig;

/// What polynomials have as coefficients: integers where signs must be right, `f64`
/// where an estimate will do.
pub(crate) trait Number: Clone + PartialOrd {
    fn zero() -> Self;
    fn sum(&self, other: &Self) -> Self;
    fn difference(&self, other: &Self) -> Self;
    fn product(&self, other: &Self) -> Self;
    fn times(&self, factor: u64) -> Self;
    /// This times 2^`exponent`.
    fn doubled(&self, exponent: usize) -> Self;
    /// Rounded somehow: for decisions that only cost or save time.
    fn rounded(&self) -> f64;
}

impl Number for IBig {
    fn zero() -> Self {
        Self::ZERO
    }

    fn sum(&self, other: &Self) -> Self {
        self + other
    }

    fn difference(&self, other: &Self) -> Self {
        self - other
    }

    fn product(&self, other: &Self) -> Self {
        self * other
    }

    fn times(&self, factor: u64) -> Self {
        self * Self::from(factor)
    }

    fn doubled(&self, exponent: usize) -> Self {
        self << exponent
    }

    fn rounded(&self) -> f64 {
        self.to_f64().value()
    }
}

impl Number for f64 {
    fn zero() -> Self {
        0.0
    }

    fn sum(&self, other: &Self) -> Self {
        self + other
    }

    fn difference(&self, other: &Self) -> Self {
        self - other
    }

    fn product(&self, other: &Self) -> Self {
        self * other
    }

    fn times(&self, factor: u64) -> Self {
        self * factor as Self
    }

    fn doubled(&self, exponent: usize) -> Self {
        self * (1_u64 << exponent) as Self
    }

    fn rounded(&self) -> f64 {
        *self
    }
}

/// A finite number as an odd integer (or zero) and the power of two to multiply it with.
fn decode(x: f64) -> (i64, i64) {
    assert!(x.is_finite(), "{x} is no real number");
    let bits = x.to_bits();
    let (field, fraction) = ((bits >> 52 & 0x7ff) as i64, (bits & ((1 << 52) - 1)) as i64);
    let (mantissa, exponent) = if field == 0 {
        (fraction, -1074)
    } else {
        (fraction | 1 << 52, field - 1075)
    };
    if mantissa == 0 {
        return (0, 0);
    }
    let zeros = mantissa.trailing_zeros();
    let odd = mantissa >> zeros;
    (
        if x.is_sign_negative() { -odd } else { odd },
        exponent + i64::from(zeros),
    )
}

/// 2^`exponent`.
pub(crate) fn power_of_two(exponent: i64) -> RBig {
    let power = RBig::from(IBig::ONE << exponent.unsigned_abs() as usize);
    if exponent < 0 {
        RBig::ONE / power
    } else {
        power
    }
}

/// A finite floating-point number, exactly.
pub(crate) fn exact(x: f64) -> RBig {
    let (odd, exponent) = decode(x);
    RBig::from(odd) * power_of_two(exponent)
}

/// Integers that are the given numbers times 2^−`exponent`, and that exponent.
pub(crate) fn integers(values: &[f64]) -> (Vec<IBig>, i64) {
    let parts: Vec<_> = values.iter().map(|&x| decode(x)).collect();
    let exponent = parts
        .iter()
        .filter(|(odd, _)| *odd != 0)
        .map(|&(_, exponent)| exponent)
        .min()
        .unwrap_or(0);
    let integer = |&(odd, own): &(i64, i64)| match odd {
        0 => IBig::ZERO,
        _ => IBig::from(odd) << (own - exponent) as usize,
    };
    (parts.iter().map(integer).collect(), exponent)
}

/// Integers that are the given fractions times a common denominator, and that denominator.
pub(crate) fn over_common_denominator(fractions: &[RBig]) -> (Vec<IBig>, IBig) {
    let mut denominator = RBig::ONE;
    for fraction in fractions {
        denominator *= RBig::from((fraction * &denominator).denominator().clone());
    }
    let integers = fractions
        .iter()
        .map(|fraction| (fraction * &denominator).numerator().clone())
        .collect();
    (integers, denominator.numerator().clone())
}

pub(crate) fn binomial(n: usize, k: usize) -> u64 {
    (0..k).fold(1, |b, i| b * (n - i) as u64 / (i + 1) as u64)
}
