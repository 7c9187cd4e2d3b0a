//! Fitting the spheres to the positions.

use glam::DVec3;

use crate::mesh::check_positions;
use crate::tree::Contents;
use crate::{MeshError, Sphere, SphereTree};

/// Radii are rounded up by this factor. The norm of a difference is right to
/// five roundings of ε/2 and a sum adds one more; the rest is reserve.
const ROUND_UP: f64 = 1.0 + 8.0 * f64::EPSILON;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    lo: DVec3,
    hi: DVec3,
}

impl Bounds {
    const EMPTY: Self = Self {
        lo: DVec3::INFINITY,
        hi: DVec3::NEG_INFINITY,
    };

    fn union(self, other: Self) -> Self {
        Self {
            lo: self.lo.min(other.lo),
            hi: self.hi.max(other.hi),
        }
    }

    fn including(self, point: DVec3) -> Self {
        self.union(Self {
            lo: point,
            hi: point,
        })
    }

    fn center(self) -> DVec3 {
        0.5 * (self.lo + self.hi)
    }

    /// Distance from `center` to the farthest corner.
    fn reach(self, center: DVec3) -> f64 {
        (self.hi - center).max(center - self.lo).length()
    }
}

impl SphereTree {
    /// Fits the spheres to moved vertices of the same triangles.
    ///
    /// Costs O(#V + #T) and does not allocate. Queries stay exact however far
    /// the vertices move; they become slower as triangles that were neighbours
    /// drift apart, because the grouping is kept. Use
    /// [`rebuild`](Self::rebuild) to group anew.
    ///
    /// # Errors
    ///
    /// * [`MeshError::PositionCount`] if the number of positions differs from
    ///   the number of vertices the tree was built over.
    /// * [`MeshError::PositionOutOfRange`] for the first position that is not
    ///   finite or exceeds [`MAX_COORDINATE`](crate::MAX_COORDINATE).
    ///
    /// The tree is unchanged in both cases.
    ///
    /// # Example
    ///
    /// ```
    /// use spheretree::{Mesh, Sphere, SphereTree};
    ///
    /// let mut positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];
    /// let mut tree = SphereTree::build(Mesh::new(&positions, &[[0, 1, 2]])?);
    /// let tip = Sphere::new([0.25, 0.25, 5.0], 0.5)?;
    /// assert!(!tree.any(&positions, &tip));
    /// positions.iter_mut().for_each(|p| p[2] += 5.0);
    /// tree.refit(&positions)?;
    /// assert!(tree.any(&positions, &tip));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn refit(&mut self, positions: &[[f64; 3]]) -> Result<(), MeshError> {
        if positions.len() != self.vertex_count {
            return Err(MeshError::PositionCount {
                expected: self.vertex_count,
                found: positions.len(),
            });
        }
        check_positions(positions)?;
        self.fit(positions);
        Ok(())
    }

    /// Computes boxes and spheres from the leaves up.
    ///
    /// Spheres are centred in the box of their contents. A leaf reaches to its
    /// farthest corner. An inner node would be tightest that way too, at the
    /// cost of visiting every triangle once per level; it takes the smaller of
    /// two bounds instead, the farthest corner of its box and the farthest
    /// point of a child sphere.
    pub(crate) fn fit(&mut self, positions: &[[f64; 3]]) {
        self.bounds.resize(self.nodes.len(), Bounds::EMPTY);
        // Breadth-first order puts children after their parent.
        for node in (0..self.nodes.len()).rev() {
            let mut bounds = Bounds::EMPTY;
            let mut reach = 0.0_f64;
            let center = match self.nodes[node].contents {
                Contents::Triangles { start, end } => {
                    let triangles = &self.triangles[start as usize..end as usize];
                    let corners = triangles.as_flattened().iter();
                    let corners = corners.map(|&v| DVec3::from(positions[v as usize]));
                    bounds = corners.clone().fold(bounds, Bounds::including);
                    let center = bounds.center();
                    let reach_squared = corners
                        .map(|corner| corner.distance_squared(center))
                        .fold(0.0, f64::max);
                    reach = reach_squared.sqrt();
                    center
                }
                Contents::Children { start, end } => {
                    let children = start as usize..end as usize;
                    for &child in &self.bounds[children.clone()] {
                        bounds = bounds.union(child);
                    }
                    let center = bounds.center();
                    for child in &self.nodes[children] {
                        let to_child = child.sphere.center_vec().distance(center);
                        reach = reach.max(to_child + child.sphere.radius());
                    }
                    reach = reach.min(bounds.reach(center));
                    center
                }
            };
            self.bounds[node] = bounds;
            self.nodes[node].sphere = Sphere::from_parts(center, reach * ROUND_UP);
        }
    }
}
