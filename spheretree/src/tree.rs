//! The tree and its parts.

use crate::Sphere;
use crate::refit::Bounds;

/// A sparse octree of spheres over the triangles of a mesh.
///
/// The sphere of every node covers all triangles below it, so that each level
/// is a coarser or finer cover of the whole surface. Nodes lie breadth-first
/// in one array, hence the children of a node are neighbours, and so are the
/// triangles of a leaf. A node has at least two children: octree cells that
/// would have a single child are skipped.
///
/// The tree keeps its own copy of the vertex indices, not of the positions;
/// see the [crate documentation](crate#conventions). [`Default`] is the tree of
/// an empty mesh.
#[derive(Debug, Clone, Default)]
pub struct SphereTree {
    /// Breadth-first, the root first; empty for an empty mesh.
    pub(crate) nodes: Vec<Node>,
    /// Boxes around the contents of the nodes, scratch of the refit.
    pub(crate) bounds: Vec<Bounds>,
    /// Where each level starts in `nodes`, and where the last one ends.
    pub(crate) level_starts: Vec<usize>,
    /// Caller's triangle ids in Morton order.
    pub(crate) ids: Vec<u32>,
    /// Vertex indices in the same order.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Morton keys with triangle ids, scratch of the build.
    pub(crate) keys: Vec<(u64, u32)>,
    /// Number of positions the triangles refer to.
    pub(crate) vertex_count: usize,
}

/// A sphere and what it covers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub(crate) sphere: Sphere,
    pub(crate) contents: Contents,
}

/// A half-open range, of triangles in Morton order or of nodes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Contents {
    Triangles { start: u32, end: u32 },
    Children { start: u32, end: u32 },
}

impl Node {
    fn is_leaf(&self) -> bool {
        matches!(self.contents, Contents::Triangles { .. })
    }
}

impl SphereTree {
    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Depth of the deepest leaf; the root alone, or no node at all, is 0.
    pub fn depth(&self) -> usize {
        // An empty tree has no level starts, one of depth d has d + 2.
        self.level_starts.len().saturating_sub(2)
    }

    /// The spheres of one level of approximation: the nodes at depth `level`,
    /// and the leaves above them.
    ///
    /// Every triangle lies completely inside one sphere of each level. Levels
    /// beyond [`depth`](Self::depth) repeat the deepest one, all leaves. An
    /// empty tree has no spheres.
    pub fn level(&self, level: usize) -> impl Iterator<Item = Sphere> {
        let level = level.min(self.depth());
        let bound = |level: usize| self.level_starts.get(level).copied().unwrap_or(0);
        let (start, end) = (bound(level), bound(level + 1));
        let leaves_above = self.nodes[..start].iter().filter(|node| node.is_leaf());
        leaves_above
            .chain(&self.nodes[start..end])
            .map(|node| node.sphere)
    }

    /// The corners of a triangle, given by its place in Morton order.
    pub(crate) fn corners(&self, positions: &[[f64; 3]], slot: u32) -> [[f64; 3]; 3] {
        self.triangles[slot as usize].map(|vertex| positions[vertex as usize])
    }

    /// Stops a caller who passes positions of another mesh.
    pub(crate) fn assert_matches(&self, positions: &[[f64; 3]]) {
        assert_eq!(
            positions.len(),
            self.vertex_count,
            "one position per vertex of the mesh the tree was built over is needed",
        );
    }
}
