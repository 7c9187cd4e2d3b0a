//! The uniform B-spline basis: knots at the integers.
//!
//! Inside one cell, with local coordinate `t` in `[0, 1]`, the functions of
//! degree p that are not zero are `b₀ᵖ … bₚᵖ`. They follow from those of degree
//! p − 1 by
//!
//! ```text
//! p bⱼᵖ(t) = (t + p − j) bⱼ₋₁ᵖ⁻¹(t) + (j + 1 − t) bⱼᵖ⁻¹(t),     b₀⁰ = 1,
//! ```
//!
//! with functions out of range taken as zero, and the derivative is
//! `bⱼᵖ' = bⱼ₋₁ᵖ⁻¹ − bⱼᵖ⁻¹`. All terms are positive: each value is accurate to a
//! few units in its last place.
//!
//! # References
//!
//! * C. de Boor, *On calculating with B-splines*, Journal of Approximation
//!   Theory 6 (1972); the recursion for arbitrary knots.

use super::degree::{Degree, MAX_ORDER};

/// Writes the basis functions of one cell and their derivatives to `out`.
///
/// Row k of `out` receives the k-th derivatives with respect to `t`; row 0 the
/// values. Column j belongs to control point s + j, where s is the number of the
/// cell. Columns beyond the degree become zero, and so do rows.
/// `t` is the position within the cell, from 0 to 1; outside, the polynomials
/// are continued.
///
/// # Example
///
/// The quadratic functions in the middle of a cell:
///
/// ```
/// use ffd_core::{Degree, MAX_ORDER, uniform_basis};
///
/// let mut basis = [[f64::NAN; MAX_ORDER]; 2];
/// uniform_basis(Degree::QUADRATIC, 0.5, &mut basis);
/// assert_eq!(basis[0][..3], [0.125, 0.75, 0.125]);
/// assert_eq!(basis[1][..3], [-0.5, 0.0, 0.5]);
/// ```
pub fn uniform_basis<const ROWS: usize>(
    degree: Degree,
    t: f64,
    out: &mut [[f64; MAX_ORDER]; ROWS],
) {
    let n = degree.get();
    *out = [[0.0; MAX_ORDER]; ROWS];
    let mut basis = [0.0; MAX_ORDER];
    basis[0] = 1.0;
    for p in 0..=n {
        if p > 0 {
            raise(&mut basis, p, t);
        }
        // The k-th derivative needs the basis of degree n − k.
        if let Some(row) = out.get_mut(n - p) {
            *row = basis;
            for _ in p..n {
                difference(row);
            }
        }
    }
}

/// Lattice coordinate at which control point `index` rests: its value there
/// makes the spline the identity.
#[must_use]
pub fn rest_coordinate(degree: Degree, index: usize) -> f64 {
    index as f64 - 0.5 * (degree.get() - 1) as f64
}

/// Turns the basis of degree `p − 1` into that of degree `p`.
fn raise(basis: &mut [f64; MAX_ORDER], p: usize, t: f64) {
    for j in (0..=p).rev() {
        let before = if j > 0 { basis[j - 1] } else { 0.0 };
        let rising = t + (p - j) as f64;
        let falling = (j + 1) as f64 - t;
        basis[j] = (rising * before + falling * basis[j]) / p as f64;
    }
}

/// Replaces each entry by its predecessor minus itself.
fn difference(row: &mut [f64; MAX_ORDER]) {
    for j in (1..MAX_ORDER).rev() {
        row[j] = row[j - 1] - row[j];
    }
    row[0] = -row[0];
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn degrees() -> impl Strategy<Value = Degree> {
        (1_usize..=5).prop_map(|n| Degree::new(n).unwrap())
    }

    /// The textbook recursion over knots 0, 1, 2, …: the function of degree `p`
    /// that starts at knot `i`, at position `u`.
    fn cox_de_boor(i: usize, p: usize, u: f64) -> f64 {
        let knot = i as f64;
        if p == 0 {
            return f64::from(u8::from(knot <= u && u < knot + 1.0));
        }
        let span = p as f64;
        (u - knot) / span * cox_de_boor(i, p - 1, u)
            + (knot + span + 1.0 - u) / span * cox_de_boor(i + 1, p - 1, u)
    }

    /// Roundings in one value: each of at most five levels multiplies by terms
    /// with one rounding and adds two more for product, sum and quotient.
    const VALUE_TOLERANCE: f64 = 5.0 * 4.0 * f64::EPSILON;

    proptest! {
        /// Function j of a cell is the B-spline that starts n − j knots before it.
        #[test]
        fn values_are_those_of_the_cox_de_boor_recursion(degree in degrees(), t in 0.0..1.0_f64) {
            let n = degree.get();
            let mut basis = [[f64::NAN; MAX_ORDER]; 1];
            uniform_basis(degree, t, &mut basis);
            let (values, beyond) = basis[0].split_at(n + 1);
            for (j, value) in values.iter().enumerate() {
                // t + n is rounded: an error of at most 4 ε in the argument,
                // where slopes are at most 1.
                let expected = cox_de_boor(j, n, t + n as f64);
                let difference = (value - expected).abs();
                prop_assert!(difference <= 2.0 * VALUE_TOLERANCE + 4.0 * f64::EPSILON);
            }
            prop_assert!(beyond.iter().all(|b| b.to_bits() == 0));
        }

        /// The functions are not negative and add up to one, hence all their
        /// derivatives add up to zero.
        #[test]
        fn partition_of_unity(degree in degrees(), t in 0.0..=1.0_f64) {
            let mut basis = [[f64::NAN; MAX_ORDER]; 3];
            uniform_basis(degree, t, &mut basis);
            prop_assert!(basis[0].iter().all(|&b| b >= 0.0));
            let sums = basis.map(|row| row.iter().sum::<f64>());
            // Five additions of numbers that add up to at most 2ᵏ.
            let tolerance = VALUE_TOLERANCE + 5.0 * f64::EPSILON;
            prop_assert!((sums[0] - 1.0).abs() <= tolerance);
            prop_assert!(sums[1].abs() <= 2.0 * tolerance);
            prop_assert!(sums[2].abs() <= 4.0 * tolerance);
        }

        /// Each row is the derivative of the row before, by central differences.
        #[test]
        fn derivatives_are_the_limit_of_differences(degree in degrees(), t in 0.001..0.999_f64) {
            let h = 1e-4;
            let mut at = [[[f64::NAN; MAX_ORDER]; 3]; 3];
            for (rows, t) in at.iter_mut().zip([t - h, t, t + h]) {
                uniform_basis(degree, t, rows);
            }
            // A k-th derivative is a sum of values ≤ 1 with 2ᵏ as the sum of the
            // absolute factors: at most 2⁴ remains after two rows, so the
            // formula is off by h²/6 · 2⁴. Rounding of a value ≤ 2 is divided
            // by h; t ± h is rounded too, where slopes are at most 4.
            let tolerance = h * h / 6.0 * 16.0
                + (2.0 * VALUE_TOLERANCE + 4.0 * f64::EPSILON) / h;
            let [low, middle, high] = at;
            for k in 0..2 {
                for j in 0..MAX_ORDER {
                    let slope = (high[k][j] - low[k][j]) / (2.0 * h);
                    prop_assert!((slope - middle[k + 1][j]).abs() <= tolerance);
                }
            }
        }

        /// With control points at rest a spline is the identity.
        #[test]
        fn rest_coordinates_reproduce_the_position(
            degree in degrees(),
            cell in 0_usize..20,
            t in 0.0..=1.0_f64,
        ) {
            let mut basis = [[f64::NAN; MAX_ORDER]; 2];
            uniform_basis(degree, t, &mut basis);
            let sum = |row: [f64; MAX_ORDER]| -> f64 {
                (0..=degree.get()).map(|j| row[j] * rest_coordinate(degree, cell + j)).sum()
            };
            // Coordinates are below 25; 6 products and sums.
            let tolerance = 25.0 * (VALUE_TOLERANCE + 7.0 * f64::EPSILON);
            prop_assert!((sum(basis[0]) - (cell as f64 + t)).abs() <= tolerance);
            prop_assert!((sum(basis[1]) - 1.0).abs() <= 2.0 * tolerance);
        }
    }

    #[test]
    fn derivatives_beyond_the_degree_vanish() {
        let mut basis = [[f64::NAN; MAX_ORDER]; 4];
        uniform_basis(Degree::LINEAR, 0.25, &mut basis);
        assert_eq!(basis[0][..2], [0.75, 0.25]);
        assert_eq!(basis[1][..2], [-1.0, 1.0]);
        assert_eq!(basis[2..], [[0.0; MAX_ORDER]; 2]);
    }
}
