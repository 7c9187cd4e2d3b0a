//! Degrees for which this crate is made.

use crate::FfdError;

/// The highest number of basis functions that are not zero at a point: the
/// highest degree plus one.
pub const MAX_ORDER: usize = 6;

/// The degree of a B-spline, from 1 to 5.
///
/// A spline of degree n has n − 1 continuous derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Degree(usize);

impl Degree {
    /// Degree 1: continuous, with creases at the knots.
    pub const LINEAR: Self = Self(1);
    /// Degree 2: one continuous derivative.
    pub const QUADRATIC: Self = Self(2);
    /// Degree 3: two continuous derivatives; the usual choice.
    pub const CUBIC: Self = Self(3);

    /// A degree from 1 to 5.
    ///
    /// # Errors
    ///
    /// [`FfdError::Degree`] for any other number.
    pub fn new(degree: usize) -> Result<Self, FfdError> {
        let max = MAX_ORDER - 1;
        if (1..=max).contains(&degree) {
            Ok(Self(degree))
        } else {
            Err(FfdError::Degree { degree, max })
        }
    }

    /// The degree as a number.
    #[must_use]
    pub fn get(self) -> usize {
        self.0
    }

    /// The number of basis functions that are not zero inside a cell: the
    /// degree plus one.
    #[must_use]
    pub fn order(self) -> usize {
        self.0 + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_to_five_are_degrees() {
        for degree in [0, 6, usize::MAX] {
            let error = FfdError::Degree { degree, max: 5 };
            assert_eq!(Degree::new(degree), Err(error));
        }
        for degree in 1..=5 {
            assert_eq!(Degree::new(degree).unwrap().get(), degree);
        }
        assert_eq!(Degree::new(3), Ok(Degree::CUBIC));
    }
}
