//! The tests of single shapes, against slow or literal formulations.

mod common;

use common::{cylinder, minimum_over_triangle, point, rotation, sphere};
use glam::DVec3;
use proptest::prelude::*;
use spheretree::{Cylinder, MAX_COORDINATE, Probe, ShapeError, Sphere};

/// The cylinder-sphere test of the thesis, case by case (equations 4.7 to
/// 4.9), with the test against the lower bound that it leaves to the reader.
/// The axis is z, the caps are at `cl_z` and `cu_z`.
fn thesis_test(s: [f64; 3], r_s: f64, r_c: f64, cl_z: f64, cu_z: f64) -> bool {
    let d_min = (s[0] * s[0] + s[1] * s[1]).sqrt();
    if d_min > r_c + r_s {
        return false;
    }
    if cl_z <= s[2] && s[2] <= cu_z {
        return true;
    }
    let delta_z = if s[2] > cu_z {
        s[2] - cu_z
    } else {
        cl_z - s[2]
    };
    if delta_z > r_s {
        return false;
    }
    let nrad = (r_s * r_s - delta_z * delta_z).sqrt();
    d_min <= r_c + nrad
}

/// Negative inside a solid cylinder, positive outside, and convex.
fn outside_of(cylinder: &Cylinder, x: DVec3) -> f64 {
    let (start, end) = (DVec3::from(cylinder.start()), DVec3::from(cylinder.end()));
    let axis = (end - start).try_normalize().unwrap_or(DVec3::Z);
    let z = (x - start).dot(axis);
    let rho = (x - start).cross(axis).length();
    (rho - cylinder.radius())
        .max(-z)
        .max(z - start.distance(end))
}

/// Halves the interval of floats between a refused and an accepted value until
/// they are neighbours, and returns the accepted one.
fn barely_accepted(refused: f64, accepted: f64, accept: impl Fn(f64) -> bool) -> f64 {
    let (mut lo, mut hi) = (refused.to_bits(), accepted.to_bits());
    while hi - lo > 1 {
        let middle = lo + (hi - lo) / 2;
        if accept(f64::from_bits(middle)) {
            hi = middle;
        } else {
            lo = middle;
        }
    }
    f64::from_bits(hi)
}

/// The smallest sphere around a corner, or the middle, that covers the
/// triangle as tightly as the tree would at best.
fn covering_spheres(corners: [[f64; 3]; 3]) -> Vec<Sphere> {
    let vertices = corners.map(DVec3::from);
    let centroid = vertices.into_iter().sum::<DVec3>() / 3.0;
    let midpoint = 0.5 * (vertices[0] + vertices[1]);
    [vertices[0], vertices[1], vertices[2], centroid, midpoint]
        .into_iter()
        .map(|center| {
            let reach = vertices
                .iter()
                .map(|v| v.distance(center))
                .fold(0.0, f64::max);
            Sphere::new(center.to_array(), reach).expect("valid")
        })
        .collect()
}

proptest! {
    /// In any pose, our cylinder-sphere test is that of the thesis.
    #[test]
    fn cylinder_meets_sphere_as_in_the_thesis(
        s in point(2.0),
        (r_s, r_c, cl_z, h) in (0.0..1.5_f64, 0.0..1.0_f64, -1.0..1.0_f64, 0.01..2.0_f64),
        rotation in rotation(),
        shift in point(3.0),
    ) {
        let cu_z = cl_z + h;
        // The pose rounds lengths below 10 a few times: skip what is closer to
        // the border than a thousand ulp of that.
        let dr = (s[0].hypot(s[1]) - r_c).max(0.0);
        let dz = (cl_z - s[2]).max(s[2] - cu_z).max(0.0);
        prop_assume!((dr.hypot(dz) - r_s).abs() > 1e4 * f64::EPSILON);

        let place = |x: [f64; 3]| (rotation * DVec3::from(x) + DVec3::from(shift)).to_array();
        let cylinder = Cylinder::new(place([0., 0., cl_z]), place([0., 0., cu_z]), r_c)?;
        let sphere = Sphere::new(place(s), r_s)?;
        prop_assert_eq!(cylinder.overlaps_sphere(&sphere), thesis_test(s, r_s, r_c, cl_z, cu_z));
    }

    /// A cylinder meets a triangle if and only if the least value of its convex
    /// indicator over the triangle is negative.
    #[test]
    fn cylinder_meets_triangle_as_by_minimisation(
        cylinder in cylinder(),
        corners in prop::array::uniform3(point(1.5)),
    ) {
        let least = minimum_over_triangle(corners, |x| outside_of(&cylinder, x));
        // The minimisation is right to 1e-8 or so; closer cases are left out.
        prop_assume!(least.abs() > 1e-7);
        prop_assert_eq!(cylinder.intersects_triangle(corners), least < 0.0, "least {}", least);
    }

    /// A sphere meets a triangle if and only if the least distance from its
    /// centre is below its radius.
    #[test]
    fn sphere_meets_triangle_as_by_minimisation(
        sphere in sphere(),
        corners in prop::array::uniform3(point(1.5)),
    ) {
        let center = DVec3::from(sphere.center());
        let least = minimum_over_triangle(corners, |x| x.distance(center)) - sphere.radius();
        prop_assume!(least.abs() > 1e-7);
        prop_assert_eq!(sphere.intersects_triangle(corners), least < 0.0, "least {}", least);
    }

    /// The order of the corners and of the ends does not matter, away from the
    /// border.
    #[test]
    fn the_cylinder_test_has_the_symmetries_of_its_arguments(
        (start, end, radius) in (point(1.2), point(1.2), 0.01..0.6_f64),
        [a, b, c] in prop::array::uniform3(point(1.5)),
    ) {
        let cylinder = Cylinder::new(start, end, radius)?;
        // On the border, rounding decides, differently for each order.
        let least = minimum_over_triangle([a, b, c], |x| outside_of(&cylinder, x));
        prop_assume!(least.abs() > 1e-7);
        let hit = cylinder.intersects_triangle([a, b, c]);
        let reversed = Cylinder::new(end, start, radius)?;
        for corners in [[b, c, a], [c, a, b], [c, b, a]] {
            prop_assert_eq!(cylinder.intersects_triangle(corners), hit);
            prop_assert_eq!(reversed.intersects_triangle(corners), hit);
        }
    }

    /// Broad phase never misses: what a sphere of the least accepted radius
    /// touches, it also reaches through a sphere that covers it, to the last
    /// bit.
    #[test]
    fn a_barely_touching_sphere_reaches_every_cover(
        center in point(2.0),
        corners in prop::array::uniform3(point(1.0)),
        scale in -30..10,
    ) {
        let scaled = |p: [f64; 3]| p.map(|x| x * 2.0_f64.powi(scale));
        let (center, corners) = (scaled(center), corners.map(scaled));
        let sphere = |radius| Sphere::new(center, radius).expect("valid");
        let radius = barely_accepted(0.0, 1e6, |r| sphere(r).intersects_triangle(corners));
        for cover in covering_spheres(corners) {
            prop_assert!(sphere(radius).overlaps_sphere(&cover));
        }
    }

    /// The same for the radius and for the length of a cylinder.
    #[test]
    fn a_barely_touching_cylinder_reaches_every_cover(
        start in point(2.0),
        direction in point(1.0),
        corners in prop::array::uniform3(point(1.0)),
        size in prop_oneof![Just(0.0), Just(1e-12), Just(1e-3), Just(1.0)],
        radius in 0.0..0.5_f64,
    ) {
        // From points to large triangles, around the same place.
        let corners = corners.map(|c| [0, 1, 2].map(|k| corners[0][k] + size * (c[k] - corners[0][k])));
        let end = [0, 1, 2].map(|k| start[k] + direction[k]);
        let wide = |r| Cylinder::new(start, end, r).expect("valid");
        if wide(10.0).intersects_triangle(corners) {
            let least = barely_accepted(0.0, 10.0, |r| wide(r).intersects_triangle(corners));
            for cover in covering_spheres(corners) {
                prop_assert!(wide(least).overlaps_sphere(&cover), "radius {}", least);
            }
        }
        let long = |t: f64| {
            let end = [0, 1, 2].map(|k| start[k] + t * direction[k]);
            Cylinder::new(start, end, radius).expect("valid")
        };
        if long(10.0).intersects_triangle(corners) {
            let least = barely_accepted(0.0, 10.0, |t| long(t).intersects_triangle(corners));
            for cover in covering_spheres(corners) {
                prop_assert!(long(least).overlaps_sphere(&cover), "length {}", least);
            }
        }
    }

    /// The hardest case for the slack: a flat triangle on a ray away from the
    /// shape, so that shape, triangle and covering sphere touch in one point.
    #[test]
    fn a_barely_touching_shape_reaches_a_tangent_cover(
        (start, axis, side) in (point(2.0), point(1.0), point(1.0)),
        along in 0.0..1.0_f64,
        (near, length, middle) in (0.01..2.0_f64, 0.0..2.0_f64, 0.0..1.0_f64),
        exponent in -40..1,
    ) {
        let far = near + length * 2.0_f64.powi(exponent);
        let (start, axis) = (DVec3::from(start), DVec3::from(axis));
        let away = DVec3::from(side).cross(axis);
        prop_assume!(axis.length() > 0.1 && away.length() > 0.1);
        let tangent = |from: DVec3, direction: DVec3| {
            let at = |t: f64| from + t * direction;
            let corners = [at(near), at(far), at(near + middle * (far - near))];
            let center = 0.5 * (at(near) + at(far));
            let reach = corners.iter().map(|c| c.distance(center)).fold(0.0, f64::max);
            let cover = Sphere::new(center.to_array(), reach).expect("valid");
            (corners.map(|c| c.to_array()), cover)
        };

        let ball = |r| Sphere::new(start.to_array(), r).expect("valid");
        let (corners, cover) = tangent(start, away);
        let least = barely_accepted(0.0, 10.0, |r| ball(r).intersects_triangle(corners));
        prop_assert!(ball(least).overlaps_sphere(&cover));

        let wide = |r| Cylinder::new(start.to_array(), (start + axis).to_array(), r).expect("valid");
        let (corners, cover) = tangent(start + along * axis, away);
        let least = barely_accepted(0.0, 10.0, |r| wide(r).intersects_triangle(corners));
        prop_assert!(wide(least).overlaps_sphere(&cover));

        let long = |t: f64| Cylinder::new(start.to_array(), (start + t * axis).to_array(), 1.0).expect("valid");
        let (corners, cover) = tangent(start + along * away.normalize(), axis);
        let least = barely_accepted(0.0, 10.0, |t| long(t).intersects_triangle(corners));
        prop_assert!(long(least).overlaps_sphere(&cover));
    }
}

/// Shapes without extent still meet what passes through them.
#[test]
fn points_lines_and_discs_are_shapes() {
    let across = [[-1., -1., 0.], [3., -1., 0.], [-1., 3., 0.]];
    let point = Sphere::new([0.0; 3], 0.0).unwrap();
    assert!(point.intersects_triangle(across));
    let line = Cylinder::new([0., 0., -1.], [0., 0., 1.], 0.0).unwrap();
    assert!(line.intersects_triangle(across));
    let disc = Cylinder::new([0.0; 3], [0.0; 3], 0.5).unwrap();
    assert!(disc.intersects_triangle(across));
    let parallel_above = across.map(|[x, y, _]| [x, y, 0.25]);
    assert!(!disc.intersects_triangle(parallel_above));
    // Standing on the plane of the disc, crossing it at x = 0.25.
    assert!(disc.intersects_triangle([[0.25, -1., -1.], [0.25, 1., -1.], [0.25, 0., 2.]]));
}

/// A cap is closed: a corner on it touches, at its rim as well.
#[test]
fn touching_is_hitting() {
    let cylinder = Cylinder::new([0.0; 3], [0., 0., 2.], 1.0).unwrap();
    assert!(cylinder.intersects_triangle([[0., 0., 2.], [1., 0., 3.], [0., 1., 3.]]));
    assert!(cylinder.intersects_triangle([[1., 0., 2.], [2., 0., 3.], [2., 1., 3.]]));
    let next_above = 2.0_f64.next_up();
    assert!(!cylinder.intersects_triangle([[0., 0., next_above], [1., 0., 3.], [0., 1., 3.]]));
}

/// Shapes that are no shapes are refused, with the reason.
#[test]
fn impossible_shapes_are_refused() {
    for radius in [-1.0, f64::INFINITY, 2.0 * MAX_COORDINATE] {
        let expected = Err(ShapeError::RadiusOutOfRange { radius });
        assert_eq!(Sphere::new([0.0; 3], radius), expected);
    }
    assert!(matches!(
        Cylinder::new([0.0; 3], [1.0; 3], f64::NAN),
        Err(ShapeError::RadiusOutOfRange { radius }) if radius.is_nan()
    ));
    let point = [0.0, f64::INFINITY, 0.0];
    let expected = ShapeError::PointOutOfRange { point };
    assert_eq!(Sphere::new(point, 1.0), Err(expected.clone()));
    assert_eq!(Cylinder::new(point, [0.0; 3], 1.0), Err(expected.clone()));
    assert_eq!(Cylinder::new([0.0; 3], point, 1.0), Err(expected));
}
