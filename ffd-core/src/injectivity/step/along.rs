//! Polynomials of degree two or three along the way, in Bernstein form on [0, 1].

/// Halvings in the search for a root: what is left is below a double's last digits.
const HALVINGS: u32 = 48;

/// Sums of larger coefficients might overflow.
const LARGEST: f64 = 1e300;

/// A polynomial in s by its Bernstein coefficients; of which there are `D + 1`.
pub(in super::super) type Along = [f64; 4];

/// Cuts in the middle.
fn halves<const D: usize>(p: &Along) -> [Along; 2] {
    let (mut low, mut high) = (*p, *p);
    for step in 1..=D {
        for k in 0..=D - step {
            high[k] = 0.5 * (high[k] + high[k + 1]);
        }
        low[step] = high[0];
    }
    [low, high]
}

/// Whether all coefficients are positive.
pub(super) fn is_positive<const D: usize>(p: &Along) -> bool {
    p[..=D].iter().all(|&c| c > 0.0)
}

/// A place not far behind the first at which the polynomial is zero or negative, where its
/// value as computed by halving is so.
///
/// A few hundred roundings relative to the largest coefficient are in the value.
pub(super) fn first_fall<const D: usize>(p: &Along) -> Option<f64> {
    // What is not a number is neither positive nor not, in all of its halves.
    if is_positive::<D>(p) || !p[..=D].iter().all(|c| c.abs() <= LARGEST) {
        return None;
    }
    fall_in::<D>(p, 0.0, 0)
}

/// The same in a part, halved a number of times, that begins somewhere.
fn fall_in<const D: usize>(p: &Along, from: f64, level: u32) -> Option<f64> {
    if p[0] <= 0.0 {
        return Some(from);
    }
    if is_positive::<D>(p) {
        return None;
    }
    let size = 0.5_f64.powi(level.cast_signed());
    if level == HALVINGS {
        // Positive here, not so at the end perhaps.
        return (p[D] <= 0.0).then_some(from + size);
    }
    let [low, high] = halves::<D>(p);
    fall_in::<D>(&low, from, level + 1)
        .or_else(|| fall_in::<D>(&high, from + 0.5 * size, level + 1))
}

/// Up to which s, exclusively, all polynomials with coefficients of at least these are
/// positive: where the convex hull of the points (k / D, coefficient k) meets zero; infinite
/// if it does not. Rounded down.
pub(super) fn safe_until<const D: usize>(least: &Along) -> f64 {
    let mut until = f64::INFINITY;
    for (j, &low) in least[..=D].iter().enumerate() {
        // Nor is what is not a number positive.
        if low > 0.0 {
            continue;
        }
        if j == 0 || low.is_nan() {
            return 0.0;
        }
        for (i, &high) in least[..j].iter().enumerate() {
            if high > 0.0 {
                // All terms have the same sign, and each is rounded once or twice.
                let part = high / (high - low);
                let at = (i as f64 + (j - i) as f64 * part) / D as f64;
                until = until.min(at * (1.0 - 8.0 * f64::EPSILON));
            }
        }
    }
    until
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_known_polynomials() {
        // (1 − 2s)(1 − s)², 1 − s³ / 0.3, and a parabola that stays positive.
        let found = first_fall::<3>(&[1.0, 1.0 / 3.0 - 1.0 / 3.0, -1.0 / 3.0 + 1.0 / 3.0, 0.0]);
        assert_eq!(found, Some(1.0));
        let found = first_fall::<3>(&[1.0, 1.0, 1.0, 1.0 - 1.0 / 0.3]).unwrap();
        assert!((found - 0.3_f64.cbrt()).abs() < 1e-13, "{found}");
        assert_eq!(first_fall::<2>(&[1.0, -0.9, 1.0, 0.0]), None);
        assert_eq!(first_fall::<2>(&[1.0, f64::NAN, 1.0, 0.0]), None);
        assert_eq!(first_fall::<2>(&[f64::INFINITY, -1.0, 1.0, 0.0]), None);
        assert_eq!(
            first_fall::<2>(&[1.0, -1.1, 1.0, 0.0]).map(|s| s < 0.5),
            Some(true)
        );
    }

    #[test]
    fn the_hull_is_below() {
        assert_eq!(safe_until::<3>(&[1.0, 2.0, 0.5, 0.1]), f64::INFINITY);
        assert_eq!(safe_until::<3>(&[0.0, 2.0, 0.5, 0.1]), 0.0);
        assert_eq!(safe_until::<3>(&[f64::NAN, 2.0, 0.5, 0.1]), 0.0);
        assert_eq!(safe_until::<3>(&[1.0, f64::NAN, 0.5, 0.1]), 0.0);
        let until = safe_until::<2>(&[1.0, 3.0, -1.0, 0.0]);
        assert!(until < 0.5 && until > 0.5 - 1e-14);
        // The segment from the third point to the last comes later.
        let until = safe_until::<3>(&[1.0, 1.0, 1.0, -3.0]);
        assert!((until - 0.25).abs() < 1e-14, "{until}");
    }
}
