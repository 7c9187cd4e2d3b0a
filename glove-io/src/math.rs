//! The few elementary functions that `core` lacks.
//!
//! One implementation serves builds with and without the standard library, so
//! that the same bytes decode to the same numbers on every platform. The
//! domains are what a tracker needs; the tests compare with the standard
//! library.

use core::f64::consts::{FRAC_PI_2, PI};

/// `FRAC_PI_2 + FRAC_PI_2_TAIL` is π/2 to about 33 digits.
const FRAC_PI_2_TAIL: f64 = 6.123_233_995_736_766e-17;

/// Square root of a finite `x ≥ 0` that is zero or a normal number.
pub(crate) fn sqrt(x: f64) -> f64 {
    if x == 0.0 {
        return 0.0;
    }
    // Halving the exponent leaves a relative error of at most 6 %; each Newton
    // step squares it and halves it: 2e-3, 2e-6, 2e-12, rounding.
    let mut root = f64::from_bits((x.to_bits() >> 1) + (1023 << 51));
    for _ in 0..4 {
        root = 0.5 * (root + x / root);
    }
    root
}

/// `1 / (k (k + 1))` and `1 / (k (k − 1))` for k = 2, 4, … 16: ratios of
/// successive terms of sine and cosine, because a product takes a fraction of
/// the time of a quotient.
const SERIES: [(f64, f64); 8] = {
    let mut ratios = [(0.0, 0.0); 8];
    let (mut place, mut k) = (0, 2.0);
    while place < ratios.len() {
        ratios[place] = (1.0 / (k * (k + 1.0)), 1.0 / (k * (k - 1.0)));
        place += 1;
        k += 2.0;
    }
    ratios
};

/// Sine and cosine of `x` for `|x| ≤ 2π`.
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    let quadrant = round(x / FRAC_PI_2);
    let turns = f64::from(quadrant);
    let r = (x - turns * FRAC_PI_2) - turns * FRAC_PI_2_TAIL;
    // |r| ≤ π/4: the first neglected terms are below 5e-17.
    let r2 = r * r;
    let (mut sin, mut cos) = (1.0, 1.0);
    for (of_sin, of_cos) in SERIES.into_iter().rev() {
        sin = 1.0 - sin * (r2 * of_sin);
        cos = 1.0 - cos * (r2 * of_cos);
    }
    sin *= r;
    match quadrant.rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Angle of the vector `(x, y)` in `[−π, π]`; zero for the zero vector.
pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    let (near, far) = if y.abs() <= x.abs() {
        (y.abs(), x.abs())
    } else {
        (x.abs(), y.abs())
    };
    if far == 0.0 {
        return 0.0;
    }
    // tan(θ/2) = tan θ / (1 + √(1 + tan² θ)), twice: from θ ≤ π/4 to π/16,
    // where the series converges to 1e-17 within eleven terms.
    let mut t = near / far;
    for _ in 0..2 {
        t /= 1.0 + sqrt(1.0 + t * t);
    }
    let t2 = t * t;
    let mut series = 0.0;
    for k in (0..=10).rev() {
        series = 1.0 / f64::from(2 * k + 1) - t2 * series;
    }
    let octant = 4.0 * t * series;
    let quadrant = if y.abs() <= x.abs() {
        octant
    } else {
        FRAC_PI_2 - octant
    };
    let half_plane = if x < 0.0 { PI - quadrant } else { quadrant };
    half_plane.copysign(y)
}

/// Nearest integer, halves away from zero, saturating at the ends of `i32`.
#[expect(
    clippy::cast_possible_truncation,
    reason = "truncation after adding one half is the rounding; the cast saturates"
)]
pub(crate) fn round(x: f64) -> i32 {
    (x + 0.5_f64.copysign(x)) as i32
}

/// Nearest single-precision number; infinite when out of its range.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the device's floats are single precision"
)]
pub(crate) fn to_single(x: f64) -> f32 {
    x as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Newton's last step is correctly rounded up to one unit in the last place.
        #[test]
        fn sqrt_agrees_with_std(x in 1e-30..1e30_f64) {
            prop_assert!((sqrt(x) - x.sqrt()).abs() <= f64::EPSILON * x.sqrt());
        }

        /// Some ten operations on numbers of magnitude one at most.
        #[test]
        fn sin_cos_agrees_with_std(x in -2.0 * PI..=2.0 * PI) {
            let (sin, cos) = sin_cos(x);
            prop_assert!((sin - x.sin()).abs() <= 4.0 * f64::EPSILON);
            prop_assert!((cos - x.cos()).abs() <= 4.0 * f64::EPSILON);
        }

        /// The result is at most π, so its roundings are at most 2 ε each.
        #[test]
        fn atan2_agrees_with_std(y in -2.0..2.0_f64, x in -2.0..2.0_f64) {
            prop_assert!((atan2(y, x) - y.atan2(x)).abs() <= 8.0 * f64::EPSILON);
        }
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "these results are exact")]
    fn special_values() {
        assert_eq!(sqrt(0.0), 0.0);
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert_eq!(atan2(0.0, -1.0), PI);
        assert_eq!(atan2(-1.0, 0.0), -FRAC_PI_2);
        assert_eq!([round(0.5), round(-0.5), round(2.4)], [1, -1, 2]);
    }
}
