//! Every level covers the surface: after building, refitting and rebuilding,
//! and for degenerate input.

mod common;

use common::{Surface, check_cover, cylinder, globe, noise, soup, sphere};
use proptest::prelude::*;
use spheretree::{Cylinder, MAX_COORDINATE, Mesh, MeshError, Sphere, SphereTree};

proptest! {
    /// Every triangle lies in one sphere of each level.
    #[test]
    fn every_level_covers_the_surface(surface in soup()) {
        let tree = surface.tree();
        check_cover(&tree, &surface)?;
        prop_assert_eq!(tree.triangle_count(), surface.triangles.len());
        let deepest: Vec<_> = tree.level(tree.depth()).collect();
        prop_assert!(tree.level(usize::MAX).eq(deepest), "levels beyond the last repeat it");
    }

    /// A refitted tree, a rebuilt one and a new one find the same triangles,
    /// however the vertices have moved.
    #[test]
    fn refit_and_rebuild_agree(
        surface in soup(),
        amplitude in prop_oneof![0.0..0.1_f64, 0.0..3.0_f64],
        seed in any::<u64>(),
        s in sphere(),
        c in cylinder(),
    ) {
        let mut refitted = surface.tree();
        let mut moved = surface;
        deform(&mut moved, seed, amplitude);
        refitted.refit(&moved.positions)?;
        check_cover(&refitted, &moved)?;
        let mut rebuilt = globe(3, 5).tree();
        rebuilt.rebuild(moved.mesh());
        prop_assert!(rebuilt.level(3).eq(moved.tree().level(3)));
        let (mut from_refitted, mut from_rebuilt) = (Vec::new(), Vec::new());
        refitted.collect(&moved.positions, &s, &mut from_refitted);
        rebuilt.collect(&moved.positions, &s, &mut from_rebuilt);
        prop_assert_eq!(&from_refitted, &from_rebuilt);
        refitted.collect(&moved.positions, &c, &mut from_refitted);
        rebuilt.collect(&moved.positions, &c, &mut from_rebuilt);
        prop_assert_eq!(&from_refitted, &from_rebuilt);
        prop_assert_eq!(
            refitted.closest_point(&moved.positions, s.center(), f64::INFINITY),
            rebuilt.closest_point(&moved.positions, s.center(), f64::INFINITY)
        );
    }
}

fn deform(surface: &mut Surface, seed: u64, amplitude: f64) {
    for (index, position) in surface.positions.iter_mut().enumerate() {
        let shift = noise(seed, index);
        *position = [0, 1, 2].map(|k| position[k] + amplitude * shift[k]);
    }
}

/// Two hundred deformations in a row, from slight to a complete tangle.
#[test]
fn the_cover_survives_two_hundred_deformations() {
    let mut surface = globe(10, 14);
    let mut tree = surface.tree();
    for step in 0..200 {
        deform(&mut surface, step, 0.02);
        tree.refit(&surface.positions).unwrap();
        check_cover(&tree, &surface).unwrap();
    }
}

/// Levels get finer: on a globe, the spheres shrink towards the leaves.
#[test]
fn levels_refine() {
    let tree = globe(40, 60).tree();
    let largest: Vec<f64> = (0..=tree.depth())
        .map(|level| tree.level(level).map(|s| s.radius()).fold(0.0, f64::max))
        .collect();
    // The box of a unit globe has a half-diagonal of √3.
    assert!(largest[0] < 1.74, "{largest:?}");
    assert!(largest.is_sorted_by(|a, b| a >= b), "{largest:?}");
    assert!(largest[tree.depth()] < 0.35, "{largest:?}");
}

#[test]
fn bad_meshes_are_refused_with_the_index() {
    let mut positions = [[0.0; 3]; 4];
    let triangles = [[0, 1, 2], [1, 4, 2]];
    assert_eq!(
        Mesh::new(&positions, &triangles).unwrap_err(),
        MeshError::VertexOutOfRange {
            triangle: 1,
            vertex: 4,
            vertex_count: 4
        }
    );
    for bad in [f64::NAN, f64::NEG_INFINITY, MAX_COORDINATE.next_up()] {
        positions[3] = [0.0, 0.0, bad];
        assert_eq!(
            Mesh::new(&positions, &[]).unwrap_err(),
            MeshError::PositionOutOfRange { vertex: 3 }
        );
    }
}

/// A refused refit leaves the tree as it was.
#[test]
fn a_refused_refit_changes_nothing() {
    let surface = globe(6, 8);
    let mut tree = surface.tree();
    let spheres = |tree: &SphereTree| -> Vec<Sphere> {
        (0..=tree.depth())
            .flat_map(|level| tree.level(level).collect::<Vec<_>>())
            .collect()
    };
    let before = spheres(&tree);

    let mut moved: Vec<_> = surface
        .positions
        .iter()
        .map(|p| p.map(|x| x + 1.0))
        .collect();
    moved[17][1] = f64::NAN;
    assert_eq!(
        tree.refit(&moved),
        Err(MeshError::PositionOutOfRange { vertex: 17 })
    );
    let (expected, found) = (moved.len(), moved.len() - 1);
    assert_eq!(
        tree.refit(&moved[1..]),
        Err(MeshError::PositionCount { expected, found })
    );
    assert_eq!(spheres(&tree), before);
}

/// Builds, checks the cover, asks everything once, refits.
fn exercise(positions: &[[f64; 3]], triangles: &[[u32; 3]], scale: f64) -> usize {
    let surface = Surface {
        positions: positions.to_vec(),
        triangles: triangles.to_vec(),
    };
    let mut tree = surface.tree();
    let mut touched = Vec::new();
    for center in [[0.0; 3], [scale, 0.0, -scale]] {
        for radius in [0.0, scale] {
            let sphere = Sphere::new(center, radius).unwrap();
            tree.collect(positions, &sphere, &mut touched);
            assert_eq!(touched, surface.touched_by(&sphere));
            tree.sphere_contact(positions, &sphere, scale);
            let cylinder = Cylinder::new(center, [0.0, scale, 0.0], radius).unwrap();
            tree.collect(positions, &cylinder, &mut touched);
            assert_eq!(touched, surface.touched_by(&cylinder));
        }
        let closest = tree.closest_point(positions, center, f64::INFINITY);
        assert_eq!(closest.is_some(), !triangles.is_empty());
        assert!(closest.is_none_or(|c| c.distance.is_finite()));
    }
    tree.refit(positions).unwrap();
    tree.depth()
}

#[test]
fn an_empty_mesh_is_a_tree_without_hits() {
    for tree in [
        SphereTree::default(),
        SphereTree::build(Mesh::new(&[], &[]).unwrap()),
    ] {
        let sphere = Sphere::new([0.0; 3], 1.0).unwrap();
        assert!(!tree.any(&[], &sphere));
        assert_eq!(
            (tree.triangle_count(), tree.depth(), tree.level(0).count()),
            (0, 0, 0)
        );
    }
    // Vertices without triangles.
    exercise(&[[1.0; 3], [2.0; 3]], &[], 1.0);
}

#[test]
fn one_triangle_is_one_node() {
    let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(exercise(&positions, &[[0, 1, 2]], 1.0), 0);
}

/// Five thousand equal triangles, where halving space never ends.
#[test]
fn duplicates_end() {
    let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let depth = exercise(&positions, &[[0, 1, 2]; 5000], 1.0);
    assert!(depth <= 4, "{depth}");
    exercise(&[[0.25; 3]], &[[0, 0, 0]; 5000], 1.0);
}

/// Everything on one line, and everything in one plane.
#[test]
fn collinear_and_planar_soups_are_fine() {
    let line: Vec<_> = (0..300)
        .map(|i| [0.01, 0.02, 0.03].map(|x| x * f64::from(i)))
        .collect();
    let triangles: Vec<_> = (0..298).map(|i| [i, i + 1, i + 2]).collect();
    exercise(&line, &triangles, 1.0);
    let plane: Vec<_> = (0..300)
        .map(|i| [noise(1, i)[0], 0.0, noise(2, i)[0]])
        .collect();
    exercise(&plane, &triangles, 1.0);
}

/// The largest coordinates allowed do not overflow.
#[test]
fn the_largest_coordinates_work() {
    let positions: Vec<_> = (0..60)
        .map(|i| noise(3, i).map(|x| MAX_COORDINATE * x.signum() * x.abs().sqrt()))
        .collect();
    let triangles: Vec<_> = (0..58).map(|i| [i, i + 1, i + 2]).collect();
    exercise(&positions, &triangles, MAX_COORDINATE);
    let surface = Surface {
        positions,
        triangles,
    };
    check_cover(&surface.tree(), &surface).unwrap();
}

/// Subnormal coordinates end without a panic.
#[test]
fn subnormal_coordinates_end() {
    let tiny = f64::from_bits(1);
    let positions: Vec<_> = (0..60)
        .map(|i| noise(4, i).map(|x| (x * 100.0).round() * tiny))
        .collect();
    let triangles: Vec<_> = (0..58).map(|i| [i, i + 1, i + 2]).collect();
    exercise(&positions, &triangles, 50.0 * tiny);
}

/// A tiny part far from the origin next to a large one: cells as small as
/// keys allow, triangles of very different size.
#[test]
fn extreme_contrasts_of_size_are_fine() {
    let mut positions: Vec<_> = (0..100)
        .map(|i| noise(5, i).map(|x| 1e3 + 1e-6 * x))
        .collect();
    positions.extend((0..100).map(|i| noise(6, i).map(|x| 1e3 * x)));
    let triangles: Vec<_> = (0..198).map(|i| [i, i + 1, i + 2]).collect();
    exercise(&positions, &triangles, 1e3);
    let surface = Surface {
        positions,
        triangles,
    };
    check_cover(&surface.tree(), &surface).unwrap();
}
