//! Volumes of deformed elements and the largest displacement that inverts none.

use crate::mesh::corners;

/// Signed volume of the whole mesh, cubic metres.
///
/// # Panics
///
/// If `tets` refers to a position that does not exist.
#[must_use]
pub fn total_volume(positions: &[[f64; 3]], tets: &[[u32; 4]]) -> f64 {
    tets.iter()
        .map(|tet| six_volume(positions, tet))
        .sum::<f64>()
        / 6.0
}

/// Volume of every deformed tetrahedron over its rest volume, in order: 1 is
/// unchanged, 0 flat, negative inverted.
///
/// # Panics
///
/// If `rest` and `deformed` differ in length or `tets` refers to a position that
/// does not exist.
pub fn volume_ratios<'a>(
    rest: &'a [[f64; 3]],
    deformed: &'a [[f64; 3]],
    tets: &'a [[u32; 4]],
) -> impl Iterator<Item = f64> + 'a {
    assert_eq!(rest.len(), deformed.len(), "rest and deformed positions");
    tets.iter()
        .map(move |tet| six_volume(deformed, tet) / six_volume(rest, tet))
}

/// The largest `t ≤ 1` for which every tetrahedron of `rest + s · displacement`
/// keeps at least `min_ratio` of its rest volume for all `0 ≤ s ≤ t`.
///
/// The volume of a tetrahedron is cubic in `s`; its first crossing is isolated by
/// the Bernstein form and de Casteljau subdivision, so no crossing between
/// samples is missed. The answer errs to the safe side: by less than 2⁻³⁰ in `t`,
/// and a volume that rounding cannot tell from the limit counts as reaching it.
///
/// # Panics
///
/// If `rest` and `displacement` differ in length, `tets` refers to a position
/// that does not exist, or `min_ratio` is not below 1.
#[must_use]
pub fn largest_safe_fraction(
    rest: &[[f64; 3]],
    displacement: &[[f64; 3]],
    tets: &[[u32; 4]],
    min_ratio: f64,
) -> f64 {
    assert_eq!(rest.len(), displacement.len(), "rest and displacement");
    assert!(min_ratio < 1.0, "min_ratio must be below 1");
    let mut safe = 1.0;
    for tet in tets {
        let [x0, x1, x2, x3] = corners(rest, tet);
        let [u0, u1, u2, u3] = corners(displacement, tet);
        let (a, b, c) = (x1 - x0, x2 - x0, x3 - x0);
        let (p, q, r) = (u1 - u0, u2 - u0, u3 - u0);
        // det(D + s U) in powers of s.
        let rest_volume = a.dot(b.cross(c));
        let linear = p.dot(b.cross(c)) + a.dot(q.cross(c)) + a.dot(b.cross(r));
        let quadratic = a.dot(q.cross(r)) + p.dot(b.cross(r)) + p.dot(q.cross(c));
        let cubic = p.dot(q.cross(r));
        let c0 = rest_volume * (1.0 - min_ratio);
        let bernstein = [
            c0,
            c0 + linear / 3.0,
            c0 + (2.0 * linear + quadratic) / 3.0,
            c0 + linear + quadratic + cubic,
        ];
        // Forming the coefficients rounds each product at most a dozen times, and
        // 30 subdivisions average three times each: below 128 ε of the largest
        // volume the edges could span.
        let span =
            (a.length() + p.length()) * (b.length() + q.length()) * (c.length() + r.length());
        let margin = 128.0 * f64::EPSILON * span;
        if let Some(t) = first_not_above(bernstein, margin, safe) {
            safe = t;
        }
    }
    safe
}

/// Start of the first piece of `[0, limit]`, at most 2⁻³⁰ long, on which the
/// cubic with these Bernstein coefficients on `[0, 1]` is not proven above `margin`.
fn first_not_above(coefficients: [f64; 4], margin: f64, limit: f64) -> Option<f64> {
    let above = |c: &[f64; 4]| c.iter().all(|&v| v > margin);
    if above(&coefficients) {
        return None;
    }
    // Depth first, leftmost piece first. Every split leaves one right half
    // waiting, and a piece is split at most 30 times.
    let mut stack = [(0.0, 1.0, coefficients); 32];
    let mut waiting = 1;
    while waiting > 0 {
        waiting -= 1;
        let (start, width, c) = stack[waiting];
        if start >= limit {
            return None;
        }
        if above(&c) {
            continue;
        }
        if width <= 1.0 / f64::from(1 << 30) {
            return Some(start);
        }
        let (left, right) = split(c);
        let half = width / 2.0;
        stack[waiting] = (start + half, half, right);
        stack[waiting + 1] = (start, half, left);
        waiting += 2;
    }
    None
}

/// De Casteljau at the midpoint.
fn split([a, b, c, d]: [f64; 4]) -> ([f64; 4], [f64; 4]) {
    let mid = |x: f64, y: f64| (x + y) / 2.0;
    let (ab, bc, cd) = (mid(a, b), mid(b, c), mid(c, d));
    let (abc, bcd) = (mid(ab, bc), mid(bc, cd));
    let centre = mid(abc, bcd);
    ([a, ab, abc, centre], [centre, bcd, cd, d])
}

fn six_volume(positions: &[[f64; 3]], tet: &[u32; 4]) -> f64 {
    let [x0, x1, x2, x3] = corners(positions, tet);
    (x1 - x0).dot((x2 - x0).cross(x3 - x0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    const TETS: [[u32; 4]; 1] = [[0, 1, 2, 3]];

    #[test]
    fn an_apex_pushed_through_its_base_stops_at_the_plane() {
        let mut u = [[0.0; 3]; 4];
        u[3] = [0.0, 0.0, -4.0];
        // Height 1 − 4 s: a tenth of the volume is left at s = 0.9 / 4.
        let t = largest_safe_fraction(&REST, &u, &TETS, 0.1);
        assert!(t <= 0.225 && t > 0.225 - 1e-9, "{t}");
    }

    /// The volume (1 − 2 s)² touches zero at s = ½ and is positive again, which
    /// no test of the end point sees. Near a double zero the margin of a few
    /// hundred ε moves the answer by its square root.
    #[test]
    fn a_touching_zero_counts() {
        let mut u = [[0.0; 3]; 4];
        u[1] = [-2.0, 0.0, 0.0];
        u[2] = [0.0, -2.0, 0.0];
        let t = largest_safe_fraction(&REST, &u, &TETS, 0.0);
        assert!(t <= 0.5 && t > 0.5 - 1e-6, "{t}");
    }

    #[test]
    fn harmless_motion_is_not_limited() {
        let u = [[0.1, 0.2, 0.3]; 4];
        assert!(largest_safe_fraction(&REST, &u, &TETS, 0.5) >= 1.0);
    }
}
