//! `closest_point` and `sphere_contact` against brute force.
#![allow(clippy::float_cmp, reason = "these laws hold to the last bit")]

mod common;

use common::{Surface, globe, minimum_over_triangle, point, soup};
use glam::DVec3;
use proptest::prelude::*;
use spheretree::{Closest, Feature, Mesh, Sphere, SphereTree};

/// The nearest of all triangles, each asked on its own; ties go to the first.
fn brute_force(surface: &Surface, target: [f64; 3]) -> Option<Closest> {
    let mut best: Option<Closest> = None;
    for (id, triangle) in (0_u32..).zip(&surface.triangles) {
        let list = [*triangle];
        let alone = SphereTree::build(Mesh::new(&surface.positions, &list).expect("valid"));
        let closest = alone
            .closest_point(&surface.positions, target, f64::INFINITY)
            .expect("there is one triangle");
        if best.is_none_or(|best| closest.distance < best.distance) {
            best = Some(Closest {
                triangle: id,
                ..closest
            });
        }
    }
    best
}

proptest! {
    /// The walk through the tree finds the same point, to the bit, as asking
    /// every triangle; and a limit hides it if and only if it is farther.
    #[test]
    fn pruning_loses_nothing(surface in soup(), target in point(2.0)) {
        let tree = surface.tree();
        let expected = brute_force(&surface, target);
        let closest = tree.closest_point(&surface.positions, target, f64::INFINITY);
        prop_assert_eq!(closest, expected);
        if let Some(closest) = closest {
            let limited = |limit| tree.closest_point(&surface.positions, target, limit);
            prop_assert_eq!(limited(closest.distance), expected);
            prop_assert_eq!(limited(closest.distance.next_down()), None);
        }
    }

    /// The distance is the minimum over the triangle, the weights are convex,
    /// and point, weights, distance and feature agree.
    #[test]
    fn the_closest_point_is_right(corners in prop::array::uniform3(point(1.0)), target in point(2.0)) {
        let tree = SphereTree::build(Mesh::new(&corners, &[[0, 1, 2]])?);
        let closest = tree.closest_point(&corners, target, f64::INFINITY).expect("one triangle");
        let goal = DVec3::from(target);
        let least = minimum_over_triangle(corners, |x| x.distance(goal));
        prop_assert!((closest.distance - least).abs() < 1e-7, "{} {}", closest.distance, least);

        // Lengths are below 8, and every chain has fewer than 20 roundings.
        let tolerance = 20.0 * 8.0 * f64::EPSILON;
        let gap = DVec3::from(closest.point).distance(goal) - closest.distance;
        prop_assert!(gap.abs() <= tolerance, "{gap:e}");
        let weights = closest.barycentric;
        prop_assert!(weights.iter().all(|&w| w >= 0.0));
        prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() <= tolerance);
        let zeros = weights.iter().filter(|&&w| w <= 0.0).count();
        let expected = match closest.feature {
            Feature::Vertex => 2,
            Feature::Edge => 1,
            Feature::Face => 0,
        };
        prop_assert_eq!(zeros, expected);
    }

    /// The hardest case for the pruning: a flat triangle on a ray away from
    /// the target, whose sphere is as far as the triangle itself.
    #[test]
    fn a_limit_at_the_distance_is_enough(
        target in point(2.0),
        direction in point(1.0),
        (near, length, middle) in (0.0..2.0_f64, 0.0..2.0_f64, 0.0..1.0_f64),
        exponent in -40..1,
    ) {
        let length = length * 2.0_f64.powi(exponent);
        let at = |t: f64| [0, 1, 2].map(|k| target[k] + t * direction[k]);
        let positions = [at(near), at(near + length), at(near + middle * length)];
        let tree = SphereTree::build(Mesh::new(&positions, &[[0, 1, 2]])?);
        let limited = |limit| tree.closest_point(&positions, target, limit);
        let closest = limited(f64::INFINITY);
        prop_assert_eq!(limited(closest.expect("one triangle").distance), closest);
    }

    /// A sphere touches at its closest point, within the margin, and the depth
    /// is what is left of the radius.
    #[test]
    fn contacts_are_closest_points(
        center in point(1.5),
        radius in 0.0..0.5_f64,
        margin in 0.0..0.5_f64,
    ) {
        let surface = globe(12, 18);
        let tree = surface.tree();
        let sphere = Sphere::new(center, radius)?;
        let contact = tree.sphere_contact(&surface.positions, &sphere, margin);
        let closest = tree.closest_point(&surface.positions, center, radius + margin);
        prop_assert_eq!(contact.map(|c| c.triangle), closest.map(|c| c.triangle));
        if let (Some(contact), Some(closest)) = (contact, closest) {
            prop_assert_eq!(contact.point, closest.point);
            prop_assert_eq!(contact.barycentric, closest.barycentric);
            prop_assert_eq!(contact.depth, radius - closest.distance);
            let normal = DVec3::from(contact.normal);
            prop_assert!((normal.length() - 1.0).abs() <= 4.0 * f64::EPSILON);
        }
    }
}

/// Triangles that share the nearest vertex or edge tie exactly, and the lowest
/// id wins whichever way round they are stored.
#[test]
fn ties_go_to_the_lowest_id() {
    // Two faces of a roof, ridge from vertex 0 to vertex 1, at odd numbers.
    let positions = [
        [0.1, 0.7, 0.3],
        [1.3, 0.9, 0.2],
        [0.2, 0.1, 1.7],
        [0.6, 0.2, -1.9],
    ];
    let above = [0.71, 3.3, 0.26];
    for triangles in [
        [[0, 1, 2], [1, 0, 3]],
        [[1, 0, 3], [0, 1, 2]],
        [[2, 0, 1], [3, 1, 0]],
        [[3, 1, 0], [1, 2, 0]],
    ] {
        let tree = SphereTree::build(Mesh::new(&positions, &triangles).unwrap());
        let closest = tree
            .closest_point(&positions, above, f64::INFINITY)
            .unwrap();
        assert_eq!((closest.triangle, closest.feature), (0, Feature::Edge));
    }
}

/// At a vertex the distance is zero for all triangles around it, and for those
/// at a pole there are many, in several leaves.
#[test]
fn vertices_belong_to_their_lowest_triangle() {
    let surface = globe(6, 20);
    let tree = surface.tree();
    for &vertex in &surface.positions {
        let closest = tree.closest_point(&surface.positions, vertex, 0.0);
        assert_eq!(closest, brute_force(&surface, vertex));
        assert_eq!(closest.map(|c| c.feature), Some(Feature::Vertex));
    }
}

/// On a globe whose triangles are counter-clockwise from outside, normals
/// point away from the centre.
#[test]
fn normals_point_outwards() {
    let surface = globe(12, 18);
    let tree = surface.tree();
    for seed in 0..200 {
        let direction = DVec3::from(common::noise(seed, 0)).normalize();
        let tip = Sphere::new((1.05 * direction).to_array(), 0.2).unwrap();
        let contact = tree.sphere_contact(&surface.positions, &tip, 0.0).unwrap();
        // Facets of 20 degrees tilt away by less than that.
        let slope = DVec3::from(contact.normal).dot(direction);
        assert!(
            slope > 20_f64.to_radians().cos(),
            "{slope} towards {direction}"
        );
    }
}

/// A triangle without area hands out the direction to the sphere.
#[test]
fn degenerate_triangles_have_a_usable_normal() {
    let positions = [[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
    let tree = SphereTree::build(Mesh::new(&positions, &[[0, 1, 2]]).unwrap());
    let normal_at = |center| {
        let tip = Sphere::new(center, 1.0).unwrap();
        tree.sphere_contact(&positions, &tip, 0.0).unwrap().normal
    };
    assert_eq!(normal_at([2.0, 0.5, 0.0]), [0.0, 1.0, 0.0]);
    assert_eq!(normal_at([2.0, 0.0, 0.0]), [0.0, 0.0, 1.0]);
}

/// Questions without an answer.
#[test]
fn nothing_is_near() {
    let surface = globe(4, 6);
    let tree = surface.tree();
    let ask = |point, limit| tree.closest_point(&surface.positions, point, limit);
    assert!(ask([2.0, 0.0, 0.0], 1.1).is_some());
    assert!(ask([2.0, 0.0, 0.0], 0.9).is_none());
    for limit in [-1.0, f64::NAN, f64::NEG_INFINITY] {
        assert!(ask([1.0, 0.0, 0.0], limit).is_none());
    }
    for x in [f64::NAN, f64::INFINITY, f64::MAX] {
        assert!(ask([x, 0.0, 0.0], f64::INFINITY).is_none());
    }
    let tip = Sphere::new([2.0, 0.0, 0.0], 1.1).unwrap();
    assert!(
        tree.sphere_contact(&surface.positions, &tip, f64::NAN)
            .is_none()
    );
    assert!(
        tree.sphere_contact(&surface.positions, &tip, -0.5)
            .is_none()
    );
}
