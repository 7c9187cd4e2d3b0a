//! Tetrahedral meshes: storage, checks, surface.

use glam::DVec3;

use crate::MeshError;

/// The four faces of a positively oriented tetrahedron, counter-clockwise seen
/// from outside, as local vertex numbers.
const OUTWARD_FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// `|6 V| / l³` below which a tetrahedron counts as flat. A regular tetrahedron
/// has 0.71; at 1e-10 the stiffness of an element exceeds that of its neighbours
/// by more than double precision can carry through a factorisation.
const FLAT: f64 = 1e-10;

/// A checked tetrahedral mesh: every index exists, every coordinate is finite,
/// every tetrahedron has positive volume, every vertex is used, no face belongs
/// to more than two tetrahedra.
#[derive(Debug, Clone, PartialEq)]
pub struct TetMesh {
    positions: Vec<[f64; 3]>,
    tets: Vec<[u32; 4]>,
}

impl TetMesh {
    /// Checks and takes over a mesh.
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `positions` | `#V × 3` | m |
    /// | `tets` | `#T × 4`, zero-based, positively oriented | – |
    ///
    /// # Errors
    ///
    /// A [`MeshError`] that names the first defect found. Sizes are judged
    /// relative to each element, so a mesh in micrometres or kilometres passes
    /// or fails alike.
    pub fn new(positions: Vec<[f64; 3]>, tets: Vec<[u32; 4]>) -> Result<Self, MeshError> {
        if tets.is_empty() {
            return Err(MeshError::Empty {
                vertex_count: positions.len(),
                tet_count: 0,
            });
        }
        if u32::try_from(positions.len()).is_err() {
            return Err(MeshError::TooManyVertices {
                vertex_count: positions.len(),
            });
        }
        check_indices(&positions, &tets)?;
        check_shapes(&positions, &tets)?;
        let faces = sorted_faces(&tets);
        for window in faces.windows(3) {
            if window[0].key == window[2].key {
                return Err(MeshError::OverusedFace {
                    tet: window[2].tet,
                    face: window[0].key,
                });
            }
        }
        Ok(Self { positions, tets })
    }

    /// Vertex positions, `#V × 3`, metres.
    #[must_use]
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Vertex indices of the tetrahedra, `#T × 4`.
    #[must_use]
    pub fn tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// Gives back positions and tetrahedra.
    #[must_use]
    pub fn into_parts(self) -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
        (self.positions, self.tets)
    }
}

/// The triangles that belong to one tetrahedron only, counter-clockwise seen
/// from outside, in order of their tetrahedra.
///
/// `O(#T log #T)`. The tetrahedra must be positively oriented.
#[must_use]
pub fn surface_triangles(tets: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let faces = sorted_faces(tets);
    let mut outer: Vec<(usize, [u32; 3])> = faces
        .chunk_by(|a, b| a.key == b.key)
        .filter(|group| group.len() == 1)
        .map(|group| (group[0].tet * 4 + group[0].local, group[0].triangle))
        .collect();
    outer.sort_unstable_by_key(|&(order, _)| order);
    outer.into_iter().map(|(_, triangle)| triangle).collect()
}

struct Face {
    key: [u32; 3],
    tet: usize,
    local: usize,
    triangle: [u32; 3],
}

fn sorted_faces(tets: &[[u32; 4]]) -> Vec<Face> {
    let mut faces: Vec<Face> = tets
        .iter()
        .enumerate()
        .flat_map(|(tet, vertices)| {
            OUTWARD_FACES
                .iter()
                .enumerate()
                .map(move |(local, corners)| {
                    let triangle = corners.map(|c| vertices[c]);
                    let mut key = triangle;
                    key.sort_unstable();
                    Face {
                        key,
                        tet,
                        local,
                        triangle,
                    }
                })
        })
        .collect();
    faces.sort_unstable_by_key(|face| (face.key, face.tet, face.local));
    faces
}

fn check_indices(positions: &[[f64; 3]], tets: &[[u32; 4]]) -> Result<(), MeshError> {
    for (vertex, &position) in positions.iter().enumerate() {
        if !position.iter().all(|c| c.is_finite()) {
            return Err(MeshError::NonFinite { vertex, position });
        }
    }
    let mut used = vec![false; positions.len()];
    for (tet, vertices) in tets.iter().enumerate() {
        for (corner, &vertex) in vertices.iter().enumerate() {
            let Some(flag) = used.get_mut(vertex as usize) else {
                return Err(MeshError::VertexOutOfRange {
                    tet,
                    vertex,
                    vertex_count: positions.len(),
                });
            };
            *flag = true;
            if vertices[..corner].contains(&vertex) {
                return Err(MeshError::RepeatedVertex { tet, vertex });
            }
        }
    }
    match used.iter().position(|&flag| !flag) {
        Some(vertex) => Err(MeshError::Orphan { vertex }),
        None => Ok(()),
    }
}

fn check_shapes(positions: &[[f64; 3]], tets: &[[u32; 4]]) -> Result<(), MeshError> {
    for (tet, vertices) in tets.iter().enumerate() {
        let x = corners(positions, vertices);
        let edges = [
            x[1] - x[0],
            x[2] - x[0],
            x[3] - x[0],
            x[2] - x[1],
            x[3] - x[1],
            x[3] - x[2],
        ];
        // Scaled by the longest edge first, so that neither tiny nor huge
        // meshes underflow or overflow in the products.
        let longest = edges.iter().map(|e| e.length()).fold(0.0, f64::max);
        let relative_volume = if longest > 0.0 {
            (edges[0] / longest).dot((edges[1] / longest).cross(edges[2] / longest))
        } else {
            0.0
        };
        // NaN comes from differences that overflow.
        if relative_volume.is_nan() || relative_volume.abs() < FLAT {
            return Err(MeshError::Flat {
                tet,
                relative_volume,
            });
        }
        if relative_volume < 0.0 {
            return Err(MeshError::Inverted {
                tet,
                volume: relative_volume * longest.powi(3) / 6.0,
            });
        }
    }
    Ok(())
}

/// The corners of one tetrahedron.
pub(crate) fn corners(positions: &[[f64; 3]], tet: &[u32; 4]) -> [DVec3; 4] {
    tet.map(|v| DVec3::from_array(positions[v as usize]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];

    #[test]
    fn every_defect_is_named() {
        let new = |p: &[[f64; 3]], t: &[[u32; 4]]| TetMesh::new(p.to_vec(), t.to_vec());
        let ok = [[0, 1, 2, 3]];
        assert!(new(&CORNERS, &ok).is_ok());
        assert!(matches!(new(&CORNERS, &[]), Err(MeshError::Empty { .. })));
        assert_eq!(
            new(&CORNERS, &[[0, 1, 2, 4]]),
            Err(MeshError::VertexOutOfRange {
                tet: 0,
                vertex: 4,
                vertex_count: 4
            })
        );
        assert_eq!(
            new(&CORNERS, &[[0, 1, 1, 3]]),
            Err(MeshError::RepeatedVertex { tet: 0, vertex: 1 })
        );
        let mut nan = CORNERS;
        nan[2][1] = f64::NAN;
        assert!(matches!(
            new(&nan, &ok),
            Err(MeshError::NonFinite { vertex: 2, .. })
        ));
        assert!(matches!(
            new(&CORNERS, &[[0, 2, 1, 3]]),
            Err(MeshError::Inverted { tet: 0, .. })
        ));
        let mut flat = CORNERS;
        flat[3] = [0.3, 0.3, 0.0];
        assert!(matches!(
            new(&flat, &ok),
            Err(MeshError::Flat { tet: 0, .. })
        ));
        let mut orphan = CORNERS.to_vec();
        orphan.push([2.0, 2.0, 2.0]);
        assert_eq!(new(&orphan, &ok), Err(MeshError::Orphan { vertex: 4 }));
        let three = [[0, 1, 2, 3]; 3];
        assert!(matches!(
            new(&CORNERS, &three),
            Err(MeshError::OverusedFace { tet: 2, .. })
        ));
    }

    /// Judging sizes relative to the element makes the verdict independent of
    /// the unit of length, down to where the coordinates themselves vanish.
    #[test]
    fn scale_does_not_change_the_verdict() {
        for scale in [1e-100, 1e-9, 1.0, 1e9, 1e100] {
            let scaled = CORNERS.map(|p| p.map(|c| c * scale));
            assert!(TetMesh::new(scaled.to_vec(), vec![[0, 1, 2, 3]]).is_ok());
            assert!(matches!(
                TetMesh::new(scaled.to_vec(), vec![[0, 2, 1, 3]]),
                Err(MeshError::Inverted { .. })
            ));
        }
    }

    /// Outward normals: the divergence theorem gives the volume from the surface.
    #[test]
    fn surface_encloses_the_volume() {
        let positions = [CORNERS.as_slice(), &[[1.0, 1.0, 1.0]]].concat();
        let tets = [[0, 1, 2, 3], [1, 2, 3, 4]];
        let triangles = surface_triangles(&tets);
        assert_eq!(triangles.len(), 6);
        let enclosed: f64 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| DVec3::from_array(positions[v as usize]));
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let expected = crate::total_volume(&positions, &tets);
        assert!((enclosed - expected).abs() < 1e-15);
        assert!((expected - 0.5).abs() < 1e-15);
    }
}
