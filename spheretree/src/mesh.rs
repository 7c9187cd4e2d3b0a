//! A borrowed, validated triangle mesh.

use crate::MeshError;

/// The largest magnitude a coordinate or a radius may have: 2²⁵⁰ ≈ 1.8e75.
///
/// Products of four lengths, the highest power that occurs, then stay finite.
pub const MAX_COORDINATE: f64 = {
    let root = (1_u128 << 125) as f64;
    root * root
};

/// Triangles over vertex positions, borrowed from the caller and checked once.
///
/// Any triangle soup is allowed: open, not connected, with repeated or
/// degenerate triangles, with vertices that no triangle uses, or empty.
///
/// # Example
///
/// ```
/// use spheretree::{Mesh, MeshError};
///
/// let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];
/// assert!(Mesh::new(&positions, &[[0, 1, 2]]).is_ok());
/// assert_eq!(
///     Mesh::new(&positions, &[[0, 1, 3]]).unwrap_err(),
///     MeshError::VertexOutOfRange { triangle: 0, vertex: 3, vertex_count: 3 },
/// );
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mesh<'a> {
    positions: &'a [[f64; 3]],
    triangles: &'a [[u32; 3]],
}

impl<'a> Mesh<'a> {
    /// Checks and borrows a mesh.
    ///
    /// # Shapes and units
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `positions` | `#V × 3` | any length |
    /// | `triangles` | `#T × 3`, zero-based | – |
    ///
    /// # Errors
    ///
    /// * [`MeshError::PositionOutOfRange`] for the first position, used or not,
    ///   that is not finite or exceeds [`MAX_COORDINATE`].
    /// * [`MeshError::VertexOutOfRange`] for the first index `≥ #V`.
    /// * [`MeshError::TooManyTriangles`] if `#T ≥ 2³¹`.
    pub fn new(positions: &'a [[f64; 3]], triangles: &'a [[u32; 3]]) -> Result<Self, MeshError> {
        if i32::try_from(triangles.len()).is_err() {
            return Err(MeshError::TooManyTriangles {
                triangle_count: triangles.len(),
            });
        }
        check_positions(positions)?;
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= positions.len()) {
                return Err(MeshError::VertexOutOfRange {
                    triangle,
                    vertex,
                    vertex_count: positions.len(),
                });
            }
        }
        Ok(Self {
            positions,
            triangles,
        })
    }

    /// The vertex positions.
    pub fn positions(&self) -> &'a [[f64; 3]] {
        self.positions
    }

    /// The vertex indices of each triangle, all in range.
    pub fn triangles(&self) -> &'a [[u32; 3]] {
        self.triangles
    }
}

/// Whether every coordinate is finite and at most [`MAX_COORDINATE`].
pub(crate) fn in_range(point: [f64; 3]) -> bool {
    point.iter().all(|x| x.abs() <= MAX_COORDINATE)
}

/// Finds the first position that is out of range.
pub(crate) fn check_positions(positions: &[[f64; 3]]) -> Result<(), MeshError> {
    match positions.iter().position(|&p| !in_range(p)) {
        Some(vertex) => Err(MeshError::PositionOutOfRange { vertex }),
        None => Ok(()),
    }
}
