//! What can go wrong, and where.

use std::fmt;

/// A defect of a tetrahedral mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// There is nothing to compute on.
    #[error(
        "the mesh has {vertex_count} vertices and {tet_count} tetrahedra; at least one tetrahedron is needed"
    )]
    Empty {
        /// Number of vertices.
        vertex_count: usize,
        /// Number of tetrahedra.
        tet_count: usize,
    },
    /// More vertices than a 32-bit index can name.
    #[error("the mesh has {vertex_count} vertices, more than 32-bit indices can name")]
    TooManyVertices {
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} is not finite: ({}, {}, {})", position[0], position[1], position[2])]
    NonFinite {
        /// Index of the vertex.
        vertex: usize,
        /// Its position.
        position: [f64; 3],
    },
    /// A tetrahedron refers to a vertex that does not exist.
    #[error("tetrahedron {tet} refers to vertex {vertex}, but there are only {vertex_count}")]
    VertexOutOfRange {
        /// Index of the tetrahedron.
        tet: usize,
        /// The vertex index it holds.
        vertex: u32,
        /// Number of vertices in the mesh.
        vertex_count: usize,
    },
    /// A tetrahedron names the same vertex twice.
    #[error("tetrahedron {tet} names vertex {vertex} twice")]
    RepeatedVertex {
        /// Index of the tetrahedron.
        tet: usize,
        /// The vertex that is repeated.
        vertex: u32,
    },
    /// A tetrahedron is turned inside out.
    #[error(
        "tetrahedron {tet} is inverted: its volume is {volume:.3e} m³; swap two of its vertices"
    )]
    Inverted {
        /// Index of the tetrahedron.
        tet: usize,
        /// Its signed volume, cubic metres.
        volume: f64,
    },
    /// A tetrahedron is flat relative to its size.
    #[error(
        "tetrahedron {tet} is flat: six times its volume is {relative_volume:.3e} of its longest edge cubed"
    )]
    Flat {
        /// Index of the tetrahedron.
        tet: usize,
        /// `6 V / l³` with `l` the longest edge.
        relative_volume: f64,
    },
    /// A vertex belongs to no tetrahedron.
    #[error("vertex {vertex} belongs to no tetrahedron")]
    Orphan {
        /// Index of the vertex.
        vertex: usize,
    },
    /// More than two tetrahedra share one face.
    #[error("the face ({}, {}, {}) belongs to more than two tetrahedra, the last of them {tet}", face[0], face[1], face[2])]
    OverusedFace {
        /// Index of the third tetrahedron found on the face.
        tet: usize,
        /// The vertices of the face, ascending.
        face: [u32; 3],
    },
}

impl MeshError {
    /// The tetrahedron to look at, where the defect is one of a tetrahedron.
    #[must_use]
    pub fn tet(&self) -> Option<usize> {
        match *self {
            Self::VertexOutOfRange { tet, .. }
            | Self::RepeatedVertex { tet, .. }
            | Self::Inverted { tet, .. }
            | Self::Flat { tet, .. }
            | Self::OverusedFace { tet, .. } => Some(tet),
            _ => None,
        }
    }

    /// The vertex to look at, where the defect is one of a vertex.
    #[must_use]
    pub fn vertex(&self) -> Option<usize> {
        match *self {
            Self::NonFinite { vertex, .. } | Self::Orphan { vertex } => Some(vertex),
            _ => None,
        }
    }
}

/// A rigid motion that a set of contacts leaves free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FreeMotion {
    /// No contact: the body can move and turn as a whole.
    Everything,
    /// One contact: the body can turn about it in any direction.
    AboutContact(usize),
    /// All contacts lie on one line, through these two: the body can turn about it.
    AboutLine(usize, usize),
}

impl fmt::Display for FreeMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Everything => write!(f, "every translation and rotation (there is no contact)"),
            Self::AboutContact(a) => write!(f, "rotation about contact {a}"),
            Self::AboutLine(a, b) => {
                write!(f, "rotation about the line through contacts {a} and {b}")
            }
        }
    }
}

/// What can go wrong when a body is assembled, factored or held.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FemError {
    /// The mesh has a defect.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A material constant is out of range.
    #[error("{name} is {value}; it must be {requirement}")]
    Material {
        /// Name of the constant.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The range it must be in.
        requirement: &'static str,
    },
    /// The mesh falls into parts that share no vertex.
    #[error(
        "the mesh falls into {parts} disconnected parts; vertex {vertex} is not joined to vertex 0"
    )]
    Disconnected {
        /// Number of parts.
        parts: usize,
        /// A vertex outside the first part.
        vertex: usize,
    },
    /// Parts of the mesh hang together by an edge or a vertex only and can swing, or the
    /// mesh is so slender that double precision cannot tell (a rod of square section and
    /// some three thousand times its thickness).
    #[error(
        "the mesh is a mechanism or far too slender: parts of it hang together by an edge or a vertex, or by next to nothing (near vertex {vertex}, pivot {pivot_ratio:.1e} of its diagonal)"
    )]
    Mechanism {
        /// Vertex whose pivot is smallest.
        vertex: usize,
        /// Smallest Cholesky pivot relative to the diagonal of the stiffness matrix.
        pivot_ratio: f64,
    },
    /// The factorisation failed or its probe solution does not solve the system.
    #[error("the factorisation of {unknowns} unknowns is unusable: {reason}")]
    Factorisation {
        /// Number of unknowns.
        unknowns: usize,
        /// What was observed.
        reason: String,
    },
    /// A contact node does not exist.
    #[error("contact {contact} is at node {node}, but there are only {vertex_count}")]
    ContactOutOfRange {
        /// Position in the list of contacts.
        contact: usize,
        /// The node index given.
        node: u32,
        /// Number of vertices in the mesh.
        vertex_count: usize,
    },
    /// The weights of a contact make no mean.
    #[error("not a contact: {reason}")]
    ContactWeights {
        /// What is wrong with them.
        reason: &'static str,
    },
    /// A contact prescribes what the others already determine.
    #[error("contact {contact} prescribes what the contacts before it already determine")]
    DependentContact {
        /// Position in the list of contacts.
        contact: usize,
    },
    /// The contacts do not hold the body.
    #[error("the contacts do not hold the body: {free} stays free")]
    UnderConstrained {
        /// The motion that stays free.
        free: FreeMotion,
    },
}
