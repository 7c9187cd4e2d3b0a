//! Meshes, shapes and slow reference code shared by the tests.
#![allow(dead_code, reason = "each test binary uses a part of it")]

use glam::{DQuat, DVec3};
use proptest::prelude::*;
use spheretree::{Cylinder, Mesh, Probe, Sphere, SphereTree};

/// An owned mesh.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Surface {
    pub(crate) fn mesh(&self) -> Mesh<'_> {
        Mesh::new(&self.positions, &self.triangles).expect("the test mesh is valid")
    }

    pub(crate) fn tree(&self) -> SphereTree {
        SphereTree::build(self.mesh())
    }

    pub(crate) fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// The ids that the narrow phase alone gives.
    pub(crate) fn touched_by(&self, probe: &impl Probe) -> Vec<u32> {
        (0_u32..)
            .zip(0..self.triangles.len())
            .filter(|&(_, t)| probe.intersects_triangle(self.corners(t)))
            .map(|(id, _)| id)
            .collect()
    }
}

/// A unit sphere of latitude rings. The triangles at the poles are degenerate,
/// which makes it the better test.
pub(crate) fn globe(rings: u32, meridians: u32) -> Surface {
    let positions = (0..=rings)
        .flat_map(|i| {
            let (sin_lat, cos_lat) =
                (std::f64::consts::PI * f64::from(i) / f64::from(rings)).sin_cos();
            (0..meridians).map(move |j| {
                let longitude = std::f64::consts::TAU * f64::from(j) / f64::from(meridians);
                [
                    sin_lat * longitude.cos(),
                    cos_lat,
                    sin_lat * longitude.sin(),
                ]
            })
        })
        .collect();
    let triangles = (0..rings)
        .flat_map(|i| {
            (0..meridians).flat_map(move |j| {
                let vertex = |i: u32, j: u32| i * meridians + j % meridians;
                let [a, b] = [vertex(i, j), vertex(i, j + 1)];
                let [c, d] = [vertex(i + 1, j), vertex(i + 1, j + 1)];
                [[a, b, c], [b, d, c]]
            })
        })
        .collect();
    Surface {
        positions,
        triangles,
    }
}

/// Reproducible noise in [−1, 1] per coordinate, after `SplitMix64`.
pub(crate) fn noise(seed: u64, index: usize) -> [f64; 3] {
    [1, 2, 3].map(|axis| {
        let mut z = seed
            .wrapping_mul(0x2545_f491_4f6c_dd1d)
            .wrapping_add((index as u64 * 4 + axis).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let bits = u32::try_from((z ^ (z >> 31)) >> 32).expect("32 bits are left");
        f64::from(bits) / f64::from(1_u32 << 31) - 1.0
    })
}

pub(crate) fn point(extent: f64) -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-extent..extent)
}

/// Triangles over few random vertices: long, crossing, sometimes degenerate.
fn tangle() -> impl Strategy<Value = Surface> {
    (1_u32..30, 0_usize..80).prop_flat_map(|(vertices, triangles)| {
        let positions = prop::collection::vec(point(1.0), vertices as usize);
        let triangles = prop::collection::vec(prop::array::uniform3(0..vertices), triangles);
        (positions, triangles).prop_map(|(positions, triangles)| Surface {
            positions,
            triangles,
        })
    })
}

/// Small triangles of very different sizes, strewn over the unit cube.
fn confetti() -> impl Strategy<Value = Surface> {
    let triangle = (point(1.0), prop::array::uniform3(point(1.0)), -8..0);
    prop::collection::vec(triangle, 0..150).prop_map(|list| {
        let positions: Vec<[f64; 3]> = list
            .iter()
            .flat_map(|&(center, corners, exponent)| {
                let size = 2.0_f64.powi(exponent);
                corners.map(|c| [0, 1, 2].map(|k| center[k] + size * c[k]))
            })
            .collect();
        let count = u32::try_from(list.len()).expect("at most 150");
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Surface {
            positions,
            triangles,
        }
    })
}

/// Random soups, empty ones included.
pub(crate) fn soup() -> impl Strategy<Value = Surface> {
    prop_oneof![tangle(), confetti()]
}

/// Radii from thin to half the object, and zero.
fn radius() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.0..0.1, 0.0..0.6]
}

pub(crate) fn sphere() -> impl Strategy<Value = Sphere> {
    (point(1.2), radius()).prop_map(|(c, r)| Sphere::new(c, r).expect("valid"))
}

pub(crate) fn cylinder() -> impl Strategy<Value = Cylinder> {
    let end = prop_oneof![
        4 => point(1.2).prop_map(Some),
        1 => Just(None),
    ];
    (point(1.2), end, radius())
        .prop_map(|(start, end, r)| Cylinder::new(start, end.unwrap_or(start), r).expect("valid"))
}

pub(crate) fn rotation() -> impl Strategy<Value = DQuat> {
    prop::array::uniform4(-1.0..1.0_f64)
        .prop_filter("a quaternion of some length", |q| {
            q.iter().map(|x| x * x).sum::<f64>() > 0.1
        })
        .prop_map(|q| DQuat::from_array(q).normalize())
}

/// Least value of a convex function over a triangle, by two nested searches.
///
/// With a unit-sized triangle and a function that changes no faster than its
/// argument, the value is right to about 1e-8.
pub(crate) fn minimum_over_triangle(corners: [[f64; 3]; 3], f: impl Fn(DVec3) -> f64) -> f64 {
    let [a, b, c] = corners.map(DVec3::from);
    minimum_over_unit_interval(|s| {
        minimum_over_unit_interval(|t| f(a + s * ((b - a) + t * (c - b))))
    })
}

/// Golden-section search for the least value of a convex function.
fn minimum_over_unit_interval(f: impl Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut lo, mut hi) = (0.0, 1.0);
    let (mut x, mut y) = (1.0 - GOLDEN, GOLDEN);
    let (mut fx, mut fy) = (f(x), f(y));
    let mut least = f(0.0).min(f(1.0)).min(fx).min(fy);
    // 0.618^42 < 2e-9
    for _ in 0..42 {
        if fx < fy {
            (hi, y, fy) = (y, x, fx);
            x = hi - GOLDEN * (hi - lo);
            fx = f(x);
        } else {
            (lo, x, fx) = (x, y, fy);
            y = lo + GOLDEN * (hi - lo);
            fy = f(y);
        }
        least = least.min(fx).min(fy);
    }
    least
}

/// Whether the point is in the sphere, without any slack.
pub(crate) fn contains(sphere: &Sphere, point: [f64; 3]) -> bool {
    let offset = DVec3::from(point) - DVec3::from(sphere.center());
    offset.length_squared() <= sphere.radius() * sphere.radius()
}

/// Fails unless every triangle is inside one sphere of every level.
pub(crate) fn check_cover(tree: &SphereTree, surface: &Surface) -> Result<(), TestCaseError> {
    for level in 0..=tree.depth() {
        let spheres: Vec<Sphere> = tree.level(level).collect();
        for t in 0..surface.triangles.len() {
            let corners = surface.corners(t);
            let covered = |s: &Sphere| corners.iter().all(|&c| contains(s, c));
            prop_assert!(
                spheres.iter().any(covered),
                "triangle {t} sticks out of level {level}"
            );
        }
    }
    Ok(())
}
