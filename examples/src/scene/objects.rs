//! The thesis's four objects, built to a chosen resolution, and objects from files.
//!
//! \[Ma98\] (section 6.2) squeezes a cube, a ball, a strawberry and a tube of
//! toothpaste. Round bodies are an inner block wrapped in layers ("O-grid"): a
//! cube whose edges were bent onto a sphere would leave flat tetrahedra along them.

use std::fmt;

use fem_tet::{Material, MeshError, TetMesh, io::ObjectFile};
use glam::DVec3;

use super::hex::HexMesh;

/// A shape that is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ObjectKind {
    /// 6 cm a side.
    Cube,
    /// 6.4 cm across.
    Ball,
    /// 7 cm wide, 7 cm tall, pointed below.
    Strawberry,
    /// 13 cm long with a round cap and a crimped end, lying along x.
    Tube,
}

impl fmt::Display for ObjectKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cube => "cube",
            Self::Ball => "ball",
            Self::Strawberry => "strawberry",
            Self::Tube => "tube",
        })
    }
}

/// Cells across an object: 3 to 16, which is some 70 to 9 000 nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Resolution(u32);

impl Resolution {
    /// Smallest and largest number of cells across.
    pub const RANGE: std::ops::RangeInclusive<u32> = 3..=16;

    /// `None` unless `cells` is in [`Resolution::RANGE`].
    #[must_use]
    pub fn new(cells: u32) -> Option<Self> {
        Self::RANGE.contains(&cells).then_some(Self(cells))
    }

    /// Whether this is finer than the default.
    #[must_use]
    pub fn is_fine(self) -> bool {
        self > Self::default()
    }

    /// A share of the cells, rounded, at least one.
    fn share(self, fraction: f64) -> u32 {
        let cells = (f64::from(self.0) * fraction).round().max(1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 1 and 29"
        )]
        let cells = cells as u32;
        cells
    }
}

impl Default for Resolution {
    /// About 300 nodes, a little more than the thesis's 267.
    fn default() -> Self {
        Self(5)
    }
}

/// A deformable object at rest in its place: centred on the origin.
#[derive(Debug, Clone)]
pub struct Object {
    /// The object's name in reports.
    pub name: String,
    /// Mesh and the triangles to draw and to touch.
    pub file: ObjectFile,
    /// What it is made of.
    pub material: Material,
}

impl Object {
    /// Builds one of the four objects.
    ///
    /// # Errors
    ///
    /// [`MeshError`] if the construction fails, which would be a defect of this
    /// module: every resolution is tested.
    pub fn build(kind: ObjectKind, resolution: Resolution) -> Result<Self, MeshError> {
        let mesh = match kind {
            ObjectKind::Cube => cube(resolution.0, 0.06)?,
            ObjectKind::Ball => ball(resolution, |p| p * 0.032)?,
            ObjectKind::Strawberry => ball(resolution, strawberry)?,
            ObjectKind::Tube => tube(resolution)?,
        };
        Ok(Self {
            name: kind.to_string(),
            file: ObjectFile::from_mesh(mesh),
            material: soft(),
        })
    }

    /// An object read from a file, moved so that the middle of its bounding box is
    /// the origin. Without a display list its surface is drawn.
    ///
    /// # Errors
    ///
    /// [`MeshError`] if moving it makes an element flat, as in a mesh much farther
    /// from the origin than it is large.
    pub fn from_file(name: &str, file: ObjectFile) -> Result<Self, MeshError> {
        let display = file.display;
        let (mut positions, tets) = file.mesh.into_parts();
        let points = || positions.iter().map(|&p| DVec3::from_array(p));
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let middle = low * 0.5 + high * 0.5;
        for p in &mut positions {
            *p = (DVec3::from_array(*p) - middle).to_array();
        }
        let mesh = TetMesh::new(positions, tets)?;
        let mut file = ObjectFile::from_mesh(mesh);
        if !display.is_empty() {
            file.display = display;
        }
        Ok(Self {
            name: name.to_owned(),
            file,
            material: soft(),
        })
    }
}

/// A soft foam. Only Poisson's ratio shapes what is seen: displacements do not
/// depend on Young's modulus, forces are proportional to it.
fn soft() -> Material {
    Material::new(20e3, 0.4).expect("constants in range")
}

fn cube(cells: u32, side: f64) -> Result<TetMesh, MeshError> {
    let mut mesh = HexMesh::default();
    let step = side / f64::from(cells);
    for [i, j, k] in grid([cells; 3]) {
        let corners = cell_corners([i, j, k]).map(|c| {
            mesh.vertex([c[0], c[1], c[2], 0], || {
                c.map(|n| f64::from(n) * step - side / 2.0)
            })
        });
        mesh.push(corners);
    }
    mesh.into_tets()
}

/// A unit ball, mapped by `shape`: a rounded inner cube of `n³` cells and layers
/// between it and the sphere.
fn ball(resolution: Resolution, shape: impl Fn(DVec3) -> DVec3) -> Result<TetMesh, MeshError> {
    let (n, layers) = (resolution.share(0.6), resolution.share(0.4));
    let position = |[i, j, k, layer]: [u32; 4]| {
        let cube = DVec3::from([i, j, k].map(|c| f64::from(c) / f64::from(n) * 2.0 - 1.0));
        let point = wrapped(cube, 0.42, f64::from(layer) / f64::from(layers));
        shape(point).to_array()
    };
    let mut mesh = HexMesh::default();
    for cell in grid([n; 3]) {
        let corners = cell_corners(cell).map(|[i, j, k]| {
            let key = [i, j, k, 0];
            mesh.vertex(key, || position(key))
        });
        mesh.push(corners);
    }
    for axis in 0..3 {
        for side in [0, n] {
            for [u, v, layer] in grid([n, n, layers]) {
                let corners = cell_corners([u, v, layer]).map(|[u, v, l]| {
                    let mut key = [0, 0, 0, l];
                    key[axis] = side;
                    key[(axis + 1) % 3] = u;
                    key[(axis + 2) % 3] = v;
                    mesh.vertex(key, || position(key))
                });
                // Outward is the third direction: right-handed on the far side only.
                mesh.push(if side == 0 {
                    mirrored(corners)
                } else {
                    corners
                });
            }
        }
    }
    mesh.into_tets()
}

/// A point of an O-grid: of the inner block, of half size `core`, at `outward` zero, and
/// on the unit sphere (or circle, for points of a plane) at one. `block` is the place in
/// the block, each coordinate from −1 to 1.
fn wrapped(block: DVec3, core: f64, outward: f64) -> DVec3 {
    let length = block.length();
    if length == 0.0 {
        return block;
    }
    // Corners drawn half way towards the sphere keep the cells at the edges open.
    let inner = core * block.lerp(block * (block.abs().max_element() / length), 0.5);
    // Equal angles rather than equal steps spread the cells over the sphere.
    let outer = (block * std::f64::consts::FRAC_PI_4).map(f64::tan);
    inner.lerp(outer.normalize(), outward)
}

/// A unit ball to a strawberry: wide shoulders, a point below, a dent at the stalk.
fn strawberry(p: DVec3) -> DVec3 {
    let width = 0.030 * (1.0 + 0.28 * p.y - 0.10 * p.y * p.y);
    let around = p.x * p.x + p.z * p.z;
    let dent = 0.006 * (-6.0 * around).exp() * p.y.max(0.0).powi(2);
    DVec3::new(p.x * width, p.y * 0.036 - dent, p.z * width)
}

/// A tube along x: discs with an inner square and one ring of layers, stacked.
fn tube(resolution: Resolution) -> Result<TetMesh, MeshError> {
    let (n, layers) = (resolution.share(0.4), resolution.share(0.2));
    let slices = resolution.share(1.8);
    let position = |[i, j, layer, slice]: [u32; 4]| {
        let [x, y] = [i, j].map(|c| f64::from(c) / f64::from(n) * 2.0 - 1.0);
        let outward = f64::from(layer) / f64::from(layers);
        let disc = wrapped(DVec3::new(x, y, 0.0), 0.45, outward);
        let along = f64::from(slice) / f64::from(slices);
        let (half_height, half_width) = tube_profile(along);
        [
            (along - 0.5) * 0.13,
            disc.x * half_height,
            disc.y * half_width,
        ]
    };
    let mut mesh = HexMesh::default();
    for [i, j, slice] in grid([n, n, slices]) {
        let corners = cell_corners([i, j, slice]).map(|[i, j, slice]| {
            let key = [i, j, 0, slice];
            mesh.vertex(key, || position(key))
        });
        // (y, z, x) is right-handed.
        mesh.push(corners);
    }
    for axis in 0..2 {
        for side in [0, n] {
            for [u, layer, slice] in grid([n, layers, slices]) {
                let corners = cell_corners([u, layer, slice]).map(|[u, l, slice]| {
                    let mut key = [0, 0, l, slice];
                    key[axis] = side;
                    key[1 - axis] = u;
                    mesh.vertex(key, || position(key))
                });
                // Along the side, then outward: right-handed on two of the four sides.
                let flipped = (axis == 0) == (side == n);
                mesh.push(if flipped { mirrored(corners) } else { corners });
            }
        }
    }
    mesh.into_tets()
}

/// Half height (y) and half width (z) of the tube, metres, from the crimped end
/// at 0 to the cap at 1.
fn tube_profile(along: f64) -> (f64, f64) {
    let smooth = |from: f64, to: f64| {
        let t = ((along - from) / (to - from)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    // The flat end is wider than the round body it is pressed from.
    let (fill, neck) = (smooth(0.0, 0.55), smooth(0.82, 0.92));
    let height = (0.005 + 0.014 * fill) * (1.0 - neck) + 0.010 * neck;
    let width = (0.025 - 0.006 * fill) * (1.0 - neck) + 0.010 * neck;
    (height, width)
}

fn grid(cells: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    let [a, b, c] = cells;
    (0..c).flat_map(move |k| (0..b).flat_map(move |j| (0..a).map(move |i| [i, j, k])))
}

fn cell_corners([i, j, k]: [u32; 3]) -> [[u32; 3]; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|c| [i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)])
}

/// The same hexahedron with its first direction reversed.
fn mirrored(c: [u32; 8]) -> [u32; 8] {
    [c[1], c[0], c[3], c[2], c[5], c[4], c[7], c[6]]
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum as _;
    use fem_tet::{surface_triangles, total_volume};

    use super::*;

    /// Every object at every resolution is a sound mesh, closed, in one piece,
    /// and of good enough quality for linear elasticity.
    #[test]
    fn all_objects_are_sound() {
        for kind in ObjectKind::value_variants() {
            for cells in Resolution::RANGE {
                let resolution = Resolution::new(cells).expect("in range");
                let object = Object::build(*kind, resolution).expect("a sound mesh");
                let worst = worst_quality(&object.file.mesh);
                assert!(worst > 0.04, "{kind} at {cells}: quality {worst}");
            }
        }
    }

    /// Volume over that of the regular tetrahedron with the same mean square edge:
    /// 1 is regular, 0 flat.
    fn worst_quality(mesh: &TetMesh) -> f64 {
        let p = |v: u32| DVec3::from_array(mesh.positions()[v as usize]);
        mesh.tets()
            .iter()
            .map(|t| {
                let x = t.map(p);
                let six_volume = (x[1] - x[0]).dot((x[2] - x[0]).cross(x[3] - x[0]));
                let mean_square = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
                    .map(|(a, b)| x[a].distance_squared(x[b]))
                    .iter()
                    .sum::<f64>()
                    / 6.0;
                six_volume * std::f64::consts::SQRT_2 / mean_square.powf(1.5)
            })
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_default_size_is_the_thesis_s() {
        for kind in ObjectKind::value_variants() {
            let object = Object::build(*kind, Resolution::default()).expect("a sound mesh");
            let nodes = object.file.mesh.positions().len();
            assert!((267..=345).contains(&nodes), "{kind}: {nodes} nodes");
        }
    }

    #[test]
    fn volumes_are_those_of_the_shapes() {
        let volume = |kind, cells| {
            let object = Object::build(kind, Resolution(cells)).expect("a sound mesh");
            total_volume(object.file.mesh.positions(), object.file.mesh.tets())
        };
        assert!((volume(ObjectKind::Cube, 4) - 0.06_f64.powi(3)).abs() < 1e-15);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.032_f64.powi(3);
        let error = |cells| 1.0 - volume(ObjectKind::Ball, cells) / exact;
        // Inscribed, and second order: four times closer at twice the resolution.
        assert!(error(5) > 0.0 && error(5) < 0.15, "{}", error(5));
        assert!(error(16) < error(8) / 3.5, "{} {}", error(8), error(16));
    }

    /// Euler's formula V − E + F = 2 on the surface: one closed sphere each.
    #[test]
    fn surfaces_are_spheres() {
        for kind in ObjectKind::value_variants() {
            let object = Object::build(*kind, Resolution::default()).expect("a sound mesh");
            let triangles = surface_triangles(object.file.mesh.tets());
            let mut vertices: Vec<u32> = triangles.as_flattened().to_vec();
            vertices.sort_unstable();
            vertices.dedup();
            assert_eq!(vertices.len() * 2, triangles.len() + 4, "{kind}");
        }
    }
}
