//! Construction: sort the triangles into octree cells and split.

use glam::DVec3;

use crate::morton::Cube;
use crate::tree::{Contents, Node};
use crate::{Mesh, Sphere, SphereTree};

/// A node with more triangles than this is split.
const LEAF_CAPACITY: usize = 8;

impl SphereTree {
    /// Builds the tree of a mesh.
    ///
    /// Triangles are assigned to octree cells by their centroids; see the
    /// [crate documentation](crate) for the method and its sources. Costs
    /// O(#T log #T) for sorting. Triangles with equal centroids, where an
    /// octree would split for ever, are shared out by index.
    ///
    /// # Example
    ///
    /// ```
    /// use spheretree::{Mesh, SphereTree};
    ///
    /// let positions = [[-2., 0., 0.], [2., 0., 0.], [0., 1., 0.]];
    /// let tree = SphereTree::build(Mesh::new(&positions, &[[0, 1, 2]])?);
    /// assert_eq!((tree.triangle_count(), tree.depth()), (1, 0));
    /// // Around the middle of the bounding box.
    /// let root = tree.level(0).next().expect("there is a root");
    /// assert_eq!(root.center(), [0.0, 0.5, 0.0]);
    /// # Ok::<(), spheretree::MeshError>(())
    /// ```
    pub fn build(mesh: Mesh<'_>) -> Self {
        let mut tree = Self::default();
        tree.rebuild(mesh);
        tree
    }

    /// Builds the tree anew, of this mesh or another, reusing its memory.
    ///
    /// The result equals [`build`](Self::build). Rebuild when a surface has
    /// deformed so much that refitted spheres overlap more than they need to.
    pub fn rebuild(&mut self, mesh: Mesh<'_>) {
        self.vertex_count = mesh.positions().len();
        self.sort(mesh);
        self.split();
        self.fit(mesh.positions());
    }

    /// Puts the triangles into Morton order.
    fn sort(&mut self, mesh: Mesh<'_>) {
        let centroid = |triangle: &[u32; 3]| {
            let corners = triangle.map(|v| DVec3::from(mesh.positions()[v as usize]));
            corners.into_iter().sum::<DVec3>() / 3.0
        };
        let cube = Cube::around(mesh.triangles().iter().map(centroid));
        let keys =
            (mesh.triangles().iter().zip(0_u32..)).map(|(t, id)| (cube.key(centroid(t)), id));
        self.keys.clear();
        self.keys.extend(keys);
        self.keys.sort_unstable();

        self.ids.clear();
        self.ids.extend(self.keys.iter().map(|&(_, id)| id));
        self.triangles.clear();
        let in_order = self.ids.iter().map(|&id| mesh.triangles()[id as usize]);
        self.triangles.extend(in_order);
    }

    /// Creates the nodes level by level, with spheres still to be fitted.
    fn split(&mut self) {
        self.nodes.clear();
        self.level_starts.clear();
        if self.keys.is_empty() {
            return;
        }
        self.level_starts.push(0);
        self.push_leaf(0, self.keys.len());
        let mut level_start = 0;
        while level_start < self.nodes.len() {
            let level_end = self.nodes.len();
            self.level_starts.push(level_end);
            for node in level_start..level_end {
                self.split_node(node);
            }
            level_start = level_end;
        }
    }

    /// Replaces a leaf that holds too many triangles by a node with children.
    fn split_node(&mut self, node: usize) {
        let Contents::Triangles { start, end } = self.nodes[node].contents else {
            unreachable!("nodes are created as leaves and split once");
        };
        let (mut start, end) = (start as usize, end as usize);
        if end - start <= LEAF_CAPACITY {
            return;
        }
        let first_child = self.nodes.len();
        let run_length = (end - start).div_ceil(8);
        // The highest bit in which the keys differ tells at which octree level
        // the contents first fall into different cells.
        let difference = self.keys[start].0 ^ self.keys[end - 1].0;
        while start < end {
            let run = &self.keys[start..end];
            let count = match difference.checked_ilog2() {
                Some(bit) => {
                    let shift = bit / 3 * 3;
                    let cell = run[0].0 >> shift;
                    run.partition_point(|&(key, _)| key >> shift == cell)
                }
                None => run_length.min(run.len()),
            };
            self.push_leaf(start, start + count);
            start += count;
        }
        self.nodes[node].contents = Contents::Children {
            start: index(first_child),
            end: index(self.nodes.len()),
        };
    }

    fn push_leaf(&mut self, start: usize, end: usize) {
        self.nodes.push(Node {
            sphere: Sphere::from_parts(DVec3::ZERO, 0.0),
            contents: Contents::Triangles {
                start: index(start),
                end: index(end),
            },
        });
    }
}

/// Narrows a place in one of the arrays.
fn index(place: usize) -> u32 {
    u32::try_from(place).expect("fewer than 2^31 triangles make fewer than 2^32 nodes")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stack::MAX_DEPTH;

    /// Checks the shape of the tree: children and triangles are partitioned,
    /// leaves are small, inner nodes have two to eight children.
    fn check_structure(tree: &SphereTree) {
        let (mut triangles, mut children) = (0, 1);
        for node in &tree.nodes {
            match node.contents {
                Contents::Triangles { start, end } => {
                    assert!((1..=LEAF_CAPACITY).contains(&((end - start) as usize)));
                    triangles += end - start;
                }
                Contents::Children { start, end } => {
                    assert_eq!(start, children, "children follow in order");
                    assert!((2..=8).contains(&(end - start)));
                    children = end;
                }
            }
        }
        assert_eq!(triangles as usize, tree.triangle_count());
        assert_eq!(children as usize, tree.nodes.len());
        assert!(tree.depth() <= MAX_DEPTH);
    }

    /// Points whose distances halve from one to the next give the deepest
    /// octree that the keys allow.
    #[test]
    fn depth_is_bounded_by_the_keys() {
        let positions: Vec<_> = (0..60)
            .flat_map(|k| [[0.5_f64.powi(k), 0.0, 0.0]; 5])
            .collect();
        let triangles: Vec<_> = (0..300).map(|v| [v; 3]).collect();
        let tree = SphereTree::build(Mesh::new(&positions, &triangles).unwrap());
        check_structure(&tree);
        assert!(tree.depth() > 15, "the tree is deep: {}", tree.depth());
    }

    /// A grid of 8 × 8 × 8 points falls into its octants, and those into
    /// theirs, of eight points each.
    #[test]
    fn a_grid_splits_into_octants() {
        let positions: Vec<_> = (0..512)
            .map(|i| [i % 8, i / 8 % 8, i / 64].map(f64::from))
            .collect();
        let triangles: Vec<_> = (0..512).map(|v| [v; 3]).collect();
        let tree = SphereTree::build(Mesh::new(&positions, &triangles).unwrap());
        check_structure(&tree);
        let counts: Vec<_> = (0..=tree.depth()).map(|n| tree.level(n).count()).collect();
        assert_eq!(counts, [1, 8, 64]);
        // Half-diagonals of cubes of 7, 3 and 1.
        for (level, side) in [7.0_f64, 3.0, 1.0].into_iter().enumerate() {
            let expected = 0.5 * side * 3.0_f64.sqrt();
            for sphere in tree.level(level) {
                assert!((sphere.radius() / expected - 1.0).abs() < 16.0 * f64::EPSILON);
            }
        }
    }

    /// Equal centroids are shared out in equal runs: 1000 triangles need three
    /// further splits by eight.
    #[test]
    fn duplicates_are_shared_out() {
        let triangles = vec![[0, 1, 2]; 1000];
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let tree = SphereTree::build(Mesh::new(&positions, &triangles).unwrap());
        check_structure(&tree);
        assert_eq!(tree.depth(), 3);
    }
}
