//! Shapes as triangles with a normal and a colour at each corner.

use super::image::to_linear;
use super::light::Finish;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Faces that meet at more than this angle (cos 40°) keep a visible crease.
const CREASE_COS: f64 = 0.766;

/// Steps around a round cone; the caps have the same steps along a meridian.
const AROUND: usize = 24;

/// Colour of a [`Mesh`], in sRGB.
#[derive(Debug, Clone, Copy)]
pub enum Paint<'a> {
    /// The same everywhere.
    Uniform([f32; 3]),
    /// One per vertex, blended in between.
    PerVertex(&'a [[f32; 3]]),
}

/// A triangle mesh to draw.
#[derive(Debug, Clone, Copy)]
pub struct Mesh<'a> {
    /// `#V × 3`, world coordinates.
    pub positions: &'a [[f64; 3]],
    /// `#T × 3`, indices of vertices; both sides are drawn.
    pub triangles: &'a [[u32; 3]],
    /// Colour of the surface.
    pub paint: Paint<'a>,
    /// Draws the edges of the triangles as thin dark lines.
    pub wireframe: bool,
    /// How the surface reflects light.
    pub finish: Finish,
}

/// A triangle ready to be lit.
#[derive(Debug, Clone)]
pub(super) struct Triangle {
    pub(super) corners: [DVec3; 3],
    pub(super) normals: [DVec3; 3],
    /// Linear light.
    pub(super) colours: [DVec3; 3],
    pub(super) wireframe: bool,
    pub(super) finish: Finish,
}

/// The triangles of `mesh` that have finite corners.
///
/// The normal at a corner is the mean over the faces around its vertex that
/// meet this face below the crease angle, weighted by their angle at the vertex
/// (G. Thürmer, C. Wüthrich, *Computing Vertex Normals from Polygonal Facets*,
/// Journal of Graphics Tools 3(1), 1998).
///
/// # Panics
///
/// If an index or the list of colours does not fit the vertices.
pub(super) fn mesh_triangles(mesh: &Mesh<'_>) -> Vec<Triangle> {
    let count = mesh.positions.len();
    if let Paint::PerVertex(colours) = mesh.paint {
        assert_eq!(colours.len(), count, "one colour per vertex is needed");
    }
    let faces: Vec<[usize; 3]> = mesh
        .triangles
        .iter()
        .map(|t| t.map(|v| v as usize))
        .collect();
    let corners = |face: [usize; 3]| face.map(|v| DVec3::from(mesh.positions[v]));
    let normals: Vec<DVec3> = faces
        .iter()
        .map(|&f| {
            let [a, b, c] = corners(f);
            (b - a).cross(c - a).normalize_or_zero()
        })
        .collect();

    let mut around = vec![Vec::new(); count];
    for (face, &vertices) in faces.iter().enumerate() {
        let p = corners(vertices);
        for i in 0..3 {
            let angle = (p[(i + 1) % 3] - p[i]).angle_between(p[(i + 2) % 3] - p[i]);
            around[vertices[i]].push((face, angle));
        }
    }

    faces
        .iter()
        .enumerate()
        .filter(|&(_, &f)| corners(f).iter().all(|p| p.is_finite()))
        .map(|(face, &vertices)| Triangle {
            corners: corners(vertices),
            normals: vertices.map(|v| {
                around[v]
                    .iter()
                    .filter(|&&(other, _)| normals[other].dot(normals[face]) > CREASE_COS)
                    .map(|&(other, angle)| normals[other] * angle)
                    .sum::<DVec3>()
                    .try_normalize()
                    .unwrap_or(normals[face])
            }),
            colours: match mesh.paint {
                Paint::Uniform(colour) => [to_linear(colour); 3],
                Paint::PerVertex(colours) => vertices.map(|v| to_linear(colours[v])),
            },
            wireframe: mesh.wireframe,
            finish: mesh.finish,
        })
        .collect()
}

/// The convex hull of two spheres.
///
/// A normal that makes the angle `π/2 − φ` with the axis belongs to the first
/// sphere while `sin φ ≤ (r₀ − r₁) / length`, and to the second one above.
pub(super) fn round_cone(
    ends: [DVec3; 2],
    radii: [f64; 2],
    colour: DVec3,
    finish: Finish,
) -> Vec<Triangle> {
    let span = ends[1] - ends[0];
    let slope = (radii[0] - radii[1]) / span.length();
    let axis = span.try_normalize().unwrap_or(DVec3::Y);
    let (u, v) = axis.any_orthonormal_pair();
    // Where one sphere holds the other, or where the ends coincide, only the
    // larger sphere is left.
    let tangent = if slope.abs() < 1.0 {
        slope.asin()
    } else {
        FRAC_PI_2.copysign(radii[0] - radii[1])
    };

    let rings: Vec<Vec<(DVec3, DVec3)>> = [(-FRAC_PI_2, tangent), (tangent, FRAC_PI_2)]
        .iter()
        .enumerate()
        .flat_map(|(end, &(from, to))| {
            let steps = meridian_steps(to - from);
            (0..=steps).map(move |i| (end, from + (to - from) * f64::from(i) / f64::from(steps)))
        })
        .map(|(end, latitude)| {
            (0..AROUND)
                .map(|j| {
                    let longitude = TAU * j as f64 / AROUND as f64;
                    let across = u * longitude.cos() + v * longitude.sin();
                    let normal = axis * latitude.sin() + across * latitude.cos();
                    (ends[end] + normal * radii[end], normal)
                })
                .collect()
        })
        .collect();

    let triangle = |corners: [(DVec3, DVec3); 3]| Triangle {
        corners: corners.map(|c| c.0),
        normals: corners.map(|c| c.1),
        colours: [colour; 3],
        wireframe: false,
        finish,
    };
    let mut triangles = Vec::with_capacity(2 * AROUND * (rings.len() - 1));
    for pair in rings.windows(2) {
        for j in 0..AROUND {
            let k = (j + 1) % AROUND;
            triangles.push(triangle([pair[0][j], pair[0][k], pair[1][k]]));
            triangles.push(triangle([pair[0][j], pair[1][k], pair[1][j]]));
        }
    }
    triangles
}

/// How many steps approximate an arc of at most half a turn.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the angle is in [0, π]"
)]
fn meridian_steps(angle: f64) -> u32 {
    (angle / TAU * AROUND as f64).ceil().max(1.0) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let positions = (0..8_u32)
            .map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from))
            .collect();
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles = quads
            .iter()
            .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
            .collect();
        (positions, triangles)
    }

    #[test]
    fn a_cube_keeps_flat_faces() {
        let (positions, triangles) = cube();
        for t in mesh_triangles(&Mesh {
            positions: &positions,
            triangles: &triangles,
            paint: Paint::Uniform([0.5; 3]),
            wireframe: false,
            finish: Finish::Satin,
        }) {
            let [a, b, c] = t.corners;
            let face = (b - a).cross(c - a).normalize();
            assert!(t.normals.iter().all(|n| n.abs_diff_eq(face, 1e-15)));
        }
    }

    #[test]
    fn a_round_cone_touches_both_spheres_and_faces_outwards() {
        let ends = [DVec3::ZERO, DVec3::new(0.0, 3.0, 0.0)];
        let radii = [1.0, 0.5];
        for t in round_cone(ends, radii, DVec3::ONE, Finish::Skin) {
            for (p, n) in t.corners.into_iter().zip(t.normals) {
                let gap = [0, 1].map(|i| (p.distance(ends[i]) - radii[i]).abs());
                assert!(gap[0].min(gap[1]) < 1e-12);
                assert!((0..2).all(|i| p.distance(ends[i]) > radii[i] - 1e-12));
                let [a, b, c] = t.corners;
                let area = (b - a).cross(c - a);
                assert!(area.length() < 1e-12 || area.dot(n) > 0.0);
            }
        }
    }

    #[test]
    fn a_cone_shorter_than_its_radii_is_the_larger_sphere() {
        for (radii, centre) in [([2.0, 0.5], 0.0), ([0.5, 2.0], 1.0)] {
            let ends = [DVec3::ZERO, DVec3::X];
            for t in round_cone(ends, radii, DVec3::ONE, Finish::Skin) {
                let area = (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]);
                let on_larger = |p: DVec3| (p.distance(DVec3::X * centre) - 2.0).abs() < 1e-12;
                assert!(area.length() < 1e-12 || t.corners.into_iter().all(on_larger));
            }
        }
    }
}
