//! The first root of a polynomial with exactly known coefficients, also where it only
//! touches zero.
//!
//! Sturm's theorem counts the distinct roots between two places at which the polynomial is
//! not zero; double ones count once.

use dashu_int::{IBig, Sign};

use super::super::exact::decompose;

/// Halvings between two powers of two, at most.
const HALVINGS: usize = 60;

/// The exponent of the least normal number.
const LOWEST: i32 = -1022;

/// Relative width of an enclosure, where the root is not met exactly.
const WIDTH: f64 = 1e-12;

/// Coefficients of powers, the lowest first; the last is not zero.
type Powers = Vec<IBig>;

/// The first root in [0, 1] of a polynomial given by Bernstein coefficients: an interval
/// (a, b] that contains it and no other before; \[0, 0\] if it is not positive at 0, `None`
/// if there is no root.
pub(super) fn first_root(bernstein: &[IBig]) -> Option<[f64; 2]> {
    if bernstein[0] <= IBig::ZERO {
        return Some([0.0, 0.0]);
    }
    if bernstein.iter().all(|b| *b > IBig::ZERO) {
        return None;
    }
    let sturm = sequence(powers(bernstein));
    let changes = |t: f64| {
        let signs = sturm.iter().map(|p| sign(p, t)).filter(|&s| s != 0);
        let signs: Vec<i8> = signs.collect();
        signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    let at_zero = changes(0.0);
    let reaches = |t: f64| sign(&sturm[0], t) == 0 || changes(t) < at_zero;
    if !reaches(1.0) {
        return None;
    }
    // Between which powers of two, and then where between them.
    let (mut below, mut above) = (LOWEST - 1, 0);
    while above - below > 1 {
        let middle = i32::midpoint(below, above);
        if reaches(2.0_f64.powi(middle)) {
            above = middle;
        } else {
            below = middle;
        }
    }
    let mut high = 2.0_f64.powi(above);
    let mut low = if below < LOWEST {
        0.0
    } else {
        2.0_f64.powi(below)
    };
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if high - low <= WIDTH * high || middle <= low || middle >= high {
            break;
        }
        if reaches(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some([low, high])
}

/// From Bernstein coefficients.
fn powers(bernstein: &[IBig]) -> Powers {
    let n = bernstein.len() - 1;
    // Differences at the first coefficient, times binomial coefficients.
    let mut row = bernstein.to_vec();
    let mut powers = Vec::with_capacity(n + 1);
    let mut binomial = 1;
    for j in 0..=n {
        powers.push(&row[0] * binomial);
        for i in 0..n - j {
            row[i] = &row[i + 1] - &row[i];
        }
        binomial = binomial * (n - j) / (j + 1);
    }
    trim(powers)
}

fn trim(mut p: Powers) -> Powers {
    while p.last().is_some_and(IBig::is_zero) {
        p.pop();
    }
    p
}

/// The polynomial, its derivative, and negative remainders, each times a positive number.
fn sequence(p: Powers) -> Vec<Powers> {
    let derivative = p.iter().enumerate().skip(1).map(|(k, c)| c * k).collect();
    let mut all = vec![p, trim(derivative)];
    while let [.., a, b] = &all[..]
        && !b.is_empty()
    {
        let rest = negative_remainder(a, b);
        all.push(rest);
    }
    all.pop();
    all
}

/// Minus the remainder of a divided by b, times a positive number.
fn negative_remainder(a: &Powers, b: &Powers) -> Powers {
    let lead = b.last().expect("not the zero polynomial");
    let (size, negative) = (
        if lead.sign() == Sign::Negative {
            -lead
        } else {
            lead.clone()
        },
        lead.sign() == Sign::Negative,
    );
    let mut rest = a.clone();
    while rest.len() >= b.len() {
        let top = rest.last().expect("longer than b").clone();
        let factor = if negative { -top } else { top };
        let shift = rest.len() - b.len();
        for c in &mut rest {
            *c *= &size;
        }
        for (i, c) in b.iter().enumerate() {
            rest[shift + i] -= &factor * c;
        }
        // The leading coefficient is zero now.
        rest = trim(rest);
    }
    rest.into_iter().map(|c| -c).collect()
}

/// The sign at `t`, which is not negative.
fn sign(p: &Powers, t: f64) -> i8 {
    let (mantissa, exponent) = decompose(t);
    let trailing = mantissa.trailing_zeros().min(63);
    let (mantissa, exponent) = if mantissa == 0 {
        (0, 0)
    } else {
        (mantissa >> trailing, exponent + trailing.cast_signed())
    };
    // t = m / 2ᵉ is at most one; Horner's rule times 2^(e n).
    let scale = usize::try_from(-exponent).unwrap_or(0);
    let mut sum = IBig::ZERO;
    for (step, c) in p.iter().rev().enumerate() {
        sum = sum * mantissa + (c.clone() << (scale * step));
    }
    if sum.is_zero() {
        0
    } else if sum.sign() == Sign::Positive {
        1
    } else {
        -1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root(bernstein: &[i64]) -> Option<[f64; 2]> {
        first_root(&bernstein.iter().map(|&b| IBig::from(b)).collect::<Vec<_>>())
    }

    #[track_caller]
    fn assert_near(found: Option<[f64; 2]>, expected: f64) {
        let [low, high] = found.unwrap();
        assert!(
            low < expected && expected <= high && high - low <= 1e-12 * high,
            "{found:?}"
        );
    }

    #[test]
    fn double_roots_are_found() {
        // (1 − 2t)² and (1 − 3t)² = 1 − 6t + 9t².
        assert_eq!(root(&[1, -1, 1]).unwrap()[1], 0.5);
        assert_near(root(&[1, -1, 1]), 0.5);
        assert_near(root(&[1, -2, 4]), 1.0 / 3.0);
        // (1 − 3t)² raised to degree 3, and nearly that: no root.
        assert_near(root(&[3, -3, 0, 12]), 1.0 / 3.0);
        let big = 1_000_000_000_000;
        assert_eq!(root(&[3 * big + 1, -3 * big + 1, 1, 12 * big + 1]), None);
        // Slightly below: the first of two roots close to each other.
        let [low, high] = root(&[3 * big - 1, -3 * big - 1, -1, 12 * big - 1]).unwrap();
        assert!(low < high && high < 1.0 / 3.0 && low > 0.333_332);
    }

    #[test]
    fn other_roots() {
        // (1 − t)³ and (1 − t)², triple and double at the end.
        assert_near(root(&[1, 0, 0, 0]), 1.0);
        assert_near(root(&[1, 0, 0]), 1.0);
        assert_near(root(&[3, 2, 1, -2]), 0.735_139_259_049_901);
        // Positive throughout, with a negative coefficient.
        assert_eq!(root(&[2, -1, 2]), None);
        // Linear, of lower degree than it looks.
        assert_near(root(&[3, 1, -1, -3]), 0.5);
        // At once.
        assert_eq!(root(&[0, 1, 1]), Some([0.0, 0.0]));
        assert_eq!(root(&[-1, 1, 1]), Some([0.0, 0.0]));
        assert_eq!(root(&[0, 0, 0]), Some([0.0, 0.0]));
        // Very early.
        assert_near(root(&[1, -(1 << 60), -(1 << 60)]), 0.5_f64.powi(61));
    }
}
