//! `any` and `collect` give what testing every triangle gives.
#![allow(clippy::float_cmp, reason = "these laws hold to the last bit")]

mod common;

use common::{Surface, cylinder, globe, soup, sphere};
use proptest::prelude::*;
use spheretree::{Cylinder, Probe, Sphere, SphereTree};

fn check_touched(
    tree: &SphereTree,
    surface: &Surface,
    probe: &impl Probe,
) -> Result<(), TestCaseError> {
    let expected = surface.touched_by(probe);
    let mut touched = vec![u32::MAX; 3];
    tree.collect(&surface.positions, probe, &mut touched);
    prop_assert_eq!(tree.any(&surface.positions, probe), !expected.is_empty());
    prop_assert_eq!(touched, expected);
    Ok(())
}

proptest! {
    /// Random soups: the tree leaves out nothing.
    #[test]
    fn soups_are_searched_completely(surface in soup(), s in sphere(), c in cylinder()) {
        let tree = surface.tree();
        check_touched(&tree, &surface, &s)?;
        check_touched(&tree, &surface, &c)?;
    }

    /// A closed surface with triangles of similar size, and degenerate ones.
    #[test]
    fn a_globe_is_searched_completely(s in sphere(), c in cylinder()) {
        let surface = globe(20, 30);
        let tree = surface.tree();
        check_touched(&tree, &surface, &s)?;
        check_touched(&tree, &surface, &c)?;
    }

    /// A sphere whose radius is exactly the distance of the surface still
    /// finds it: the tree loses nothing to rounding.
    #[test]
    fn barely_touching_spheres_are_searched_completely(surface in soup(), s in sphere()) {
        let tree = surface.tree();
        if let Some(closest) = tree.closest_point(&surface.positions, s.center(), f64::INFINITY) {
            for radius in [closest.distance.next_down().max(0.0), closest.distance, closest.distance.next_up()] {
                check_touched(&tree, &surface, &Sphere::new(s.center(), radius)?)?;
            }
        }
    }

    /// Another order of the triangles changes the ids and nothing else.
    #[test]
    fn the_order_of_triangles_does_not_matter(surface in soup(), c in cylinder(), key in any::<u64>()) {
        let mut order: Vec<usize> = (0..surface.triangles.len()).collect();
        order.sort_by(|&a, &b| {
            let rank = |t| common::noise(key, t)[0];
            rank(a).total_cmp(&rank(b))
        });
        let shuffled = Surface {
            triangles: order.iter().map(|&t| surface.triangles[t]).collect(),
            positions: surface.positions.clone(),
        };
        let mut touched = Vec::new();
        shuffled.tree().collect(&shuffled.positions, &c, &mut touched);
        let mut touched: Vec<usize> = touched.iter().map(|&id| order[id as usize]).collect();
        touched.sort_unstable();
        let mut expected = Vec::new();
        surface.tree().collect(&surface.positions, &c, &mut expected);
        prop_assert!(touched.into_iter().eq(expected.into_iter().map(|id| id as usize)));
    }

    /// Scaling everything by a power of two, from micrometres to kilometres,
    /// is exact and changes no answer.
    #[test]
    fn scale_does_not_matter(
        surface in soup(),
        s in sphere(),
        c in cylinder(),
        exponent in -20..11,
    ) {
        let factor = 2.0_f64.powi(exponent);
        let scaled = |p: [f64; 3]| p.map(|x| factor * x);
        let large = Surface {
            positions: surface.positions.iter().map(|&p| scaled(p)).collect(),
            triangles: surface.triangles.clone(),
        };
        let large_s = Sphere::new(scaled(s.center()), factor * s.radius())?;
        let large_c = Cylinder::new(scaled(c.start()), scaled(c.end()), factor * c.radius())?;
        let (tree, large_tree) = (surface.tree(), large.tree());

        let (mut touched, mut large_touched) = (Vec::new(), Vec::new());
        tree.collect(&surface.positions, &s, &mut touched);
        large_tree.collect(&large.positions, &large_s, &mut large_touched);
        prop_assert_eq!(&touched, &large_touched);
        tree.collect(&surface.positions, &c, &mut touched);
        large_tree.collect(&large.positions, &large_c, &mut large_touched);
        prop_assert_eq!(&touched, &large_touched);

        let closest = tree.closest_point(&surface.positions, s.center(), 1.0);
        let large_closest = large_tree.closest_point(&large.positions, large_s.center(), factor);
        prop_assert_eq!(closest.map(|c| c.triangle), large_closest.map(|c| c.triangle));
        prop_assert_eq!(closest.map(|c| c.barycentric), large_closest.map(|c| c.barycentric));
        prop_assert_eq!(closest.map(|c| factor * c.distance), large_closest.map(|c| c.distance));
        for level in 0..=tree.depth() {
            let spheres = tree.level(level).map(|s| (scaled(s.center()), factor * s.radius()));
            let large_spheres = large_tree.level(level).map(|s| (s.center(), s.radius()));
            prop_assert!(spheres.eq(large_spheres));
        }
    }
}

/// Shapes can be passed as trait objects, so that a hand is one list.
#[test]
fn shapes_can_be_mixed_in_a_list() {
    let surface = globe(8, 12);
    let tree = surface.tree();
    let hand: [Box<dyn Probe>; 2] = [
        Box::new(Sphere::new([1.0, 0.0, 0.0], 0.1).unwrap()),
        Box::new(Cylinder::new([2.0, 0.0, 0.0], [3.0, 0.0, 0.0], 0.1).unwrap()),
    ];
    let touches = hand
        .each_ref()
        .map(|shape| tree.any(&surface.positions, shape.as_ref()));
    assert_eq!(touches, [true, false]);
}

#[test]
#[should_panic(expected = "one position per vertex")]
fn positions_of_another_mesh_panic() {
    let surface = globe(4, 6);
    let probe = Sphere::new([0.0; 3], 1.0).unwrap();
    surface.tree().any(&surface.positions[1..], &probe);
}
