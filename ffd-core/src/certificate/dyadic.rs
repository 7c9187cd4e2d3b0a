//! Binary fractions.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

use dashu_int::{IBig, Sign};

use super::cell::decode;

/// An integer times a power of two, exactly.
#[derive(Debug, Clone)]
pub(super) struct Dyadic {
    mantissa: IBig,
    exponent: i64,
}

impl Dyadic {
    pub(super) fn new(mantissa: IBig, exponent: i64) -> Self {
        Self { mantissa, exponent }
    }

    pub(super) fn zero() -> Self {
        Self::new(IBig::ZERO, 0)
    }

    /// A finite floating-point number.
    pub(super) fn from_f64(x: f64) -> Self {
        let (mantissa, exponent) = decode(x);
        Self { mantissa, exponent }
    }

    pub(super) fn from_count(count: usize) -> Self {
        Self::new(IBig::from(count), 0)
    }

    pub(super) fn sign(&self) -> Ordering {
        if self.mantissa.is_zero() {
            Ordering::Equal
        } else if self.mantissa.sign() == Sign::Negative {
            Ordering::Less
        } else {
            Ordering::Greater
        }
    }

    pub(super) fn abs(&self) -> Self {
        if self.sign() == Ordering::Less {
            -self
        } else {
            self.clone()
        }
    }

    pub(super) fn is_below(&self, other: &Self) -> bool {
        (self - other).sign() == Ordering::Less
    }

    /// The mantissa at a lower exponent.
    fn at(&self, exponent: i64) -> IBig {
        let shift = usize::try_from(self.exponent - exponent);
        &self.mantissa << shift.expect("the lower of two exponents")
    }
}

impl Add for &Dyadic {
    type Output = Dyadic;

    fn add(self, other: Self) -> Dyadic {
        if self.mantissa.is_zero() {
            return other.clone();
        }
        if other.mantissa.is_zero() {
            return self.clone();
        }
        let exponent = self.exponent.min(other.exponent);
        Dyadic::new(self.at(exponent) + other.at(exponent), exponent)
    }
}

impl Neg for &Dyadic {
    type Output = Dyadic;

    fn neg(self) -> Dyadic {
        Dyadic::new(-&self.mantissa, self.exponent)
    }
}

impl Sub for &Dyadic {
    type Output = Dyadic;

    fn sub(self, other: Self) -> Dyadic {
        self + &-other
    }
}

impl Mul for &Dyadic {
    type Output = Dyadic;

    fn mul(self, other: Self) -> Dyadic {
        Dyadic::new(
            &self.mantissa * &other.mantissa,
            self.exponent + other.exponent,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic() {
        let [a, b, c] = [0.75, -3.0, 2.0_f64.powi(-1074)].map(Dyadic::from_f64);
        assert_eq!(
            (&(&a * &b) + &Dyadic::from_f64(2.25)).sign(),
            Ordering::Equal
        );
        assert_eq!((&a - &b).sign(), Ordering::Greater);
        assert!(b.is_below(&a) && !a.is_below(&a));
        assert!(c.abs().is_below(&a) && Dyadic::zero().is_below(&c));
        assert!(a.is_below(&b.abs()) && !(&a + &c).is_below(&a));
        assert_eq!((&Dyadic::from_count(3) + &b).sign(), Ordering::Equal);
    }
}
