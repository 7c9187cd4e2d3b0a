//! What can be wrong with a mesh or a shape.

/// Why a mesh, or new positions for it, were refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to vertex {vertex}, but there are only {vertex_count}")]
    VertexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex index it holds.
        vertex: u32,
        /// Number of vertices in the mesh.
        vertex_count: usize,
    },
    /// A position is NaN, infinite, or beyond
    /// [`MAX_COORDINATE`](crate::MAX_COORDINATE).
    #[error("the position of vertex {vertex} is not finite or exceeds 2^250")]
    PositionOutOfRange {
        /// Index of the first such vertex.
        vertex: usize,
    },
    /// New positions do not match the vertices the tree was built over.
    #[error("the tree was built over {expected} vertices, but {found} positions were given")]
    PositionCount {
        /// Number of vertices of the mesh the tree was built over.
        expected: usize,
        /// Number of positions given.
        found: usize,
    },
    /// The mesh has more triangles than 32-bit node indices can address.
    #[error("{triangle_count} triangles are more than the supported 2^31 - 1")]
    TooManyTriangles {
        /// Number of triangles in the mesh.
        triangle_count: usize,
    },
}

/// Why a shape was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A centre or an end of an axis is NaN, infinite, or beyond
    /// [`MAX_COORDINATE`](crate::MAX_COORDINATE).
    #[error("the point {point:?} is not finite or exceeds 2^250")]
    PointOutOfRange {
        /// The point as given.
        point: [f64; 3],
    },
    /// A radius is negative, NaN, or beyond
    /// [`MAX_COORDINATE`](crate::MAX_COORDINATE).
    #[error("the radius {radius} is not between 0 and 2^250")]
    RadiusOutOfRange {
        /// The radius as given.
        radius: f64,
    },
}
