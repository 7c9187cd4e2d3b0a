//! Which point of the surface is nearest?

use glam::DVec3;

use crate::SphereTree;
use crate::mesh::in_range;
use crate::stack::Stack;
use crate::tree::Contents;
use crate::triangle::{Feature, closest_on_triangle};

/// The point of the surface nearest to a given one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// Id of the triangle it lies on, the lowest where several are nearest.
    pub triangle: u32,
    /// Its weights for the three corners: none negative, sum 1.
    pub barycentric: [f64; 3],
    /// The point itself, the corners weighted by `barycentric`.
    pub point: [f64; 3],
    /// Its distance from the given point, unsigned.
    pub distance: f64,
    /// Whether it is a corner of the triangle, on an edge, or inside.
    pub feature: Feature,
}

/// The best point so far, with the place of its triangle in Morton order.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    pub(crate) closest: Closest,
    pub(crate) slot: u32,
}

/// A node still to be visited, with a lower bound of its distance.
#[derive(Clone, Copy, Default)]
struct Candidate {
    bound: f64,
    node: u32,
}

impl SphereTree {
    /// Finds the surface point nearest to `point`, if it is no farther than
    /// `max_distance`.
    ///
    /// Pass [`f64::INFINITY`] to search without limit; a close limit makes the
    /// search cheaper. The nodes nearest to `point` are visited first, and those
    /// farther than the best point so far are left out. No allocation.
    ///
    /// `positions` are those the tree was last built or refitted with. The
    /// distance is accurate to a few roundings of the distance from `point` to
    /// the farthest corner of the triangle. Triangles that share the nearest
    /// edge or vertex tie exactly; distances that differ by less than that
    /// accuracy may come out in either order.
    ///
    /// The answer is `None` for an empty tree, if nothing is within
    /// `max_distance`, if `max_distance` is negative or NaN, and if `point` is
    /// not finite or exceeds [`MAX_COORDINATE`](crate::MAX_COORDINATE).
    ///
    /// # Panics
    ///
    /// If the number of positions differs from the number of vertices the tree
    /// was built over.
    ///
    /// # Example
    ///
    /// ```
    /// use spheretree::{Feature, Mesh, SphereTree};
    ///
    /// let positions = [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]];
    /// let tree = SphereTree::build(Mesh::new(&positions, &[[0, 1, 2]])?);
    /// let closest = tree.closest_point(&positions, [1., -3., 4.], 10.0).expect("in reach");
    /// assert_eq!(closest.point, [1.0, 0.0, 0.0]);
    /// assert_eq!(closest.distance, 5.0);
    /// assert_eq!(closest.feature, Feature::Edge);
    /// assert!(tree.closest_point(&positions, [1., -3., 4.], 4.9).is_none());
    /// # Ok::<(), spheretree::MeshError>(())
    /// ```
    pub fn closest_point(
        &self,
        positions: &[[f64; 3]],
        point: [f64; 3],
        max_distance: f64,
    ) -> Option<Closest> {
        let found = self.find_closest(positions, point, max_distance)?;
        Some(found.closest)
    }

    /// [`Self::closest_point`], with the place of the triangle.
    pub(crate) fn find_closest(
        &self,
        positions: &[[f64; 3]],
        point: [f64; 3],
        max_distance: f64,
    ) -> Option<Found> {
        self.assert_matches(positions);
        if self.nodes.is_empty() || !in_range(point) {
            return None;
        }
        let target = DVec3::from(point);
        let mut best: Option<Found> = None;
        let mut pending = Stack::new();
        pending.push(Candidate {
            bound: self.nodes[0].sphere.distance_bound(target),
            node: 0,
        });
        while let Some(candidate) = pending.pop() {
            // Equal bounds are visited: a lower id may be among them.
            let limit = best.map_or(max_distance, |best| best.closest.distance);
            if candidate.bound > limit {
                continue;
            }
            match self.nodes[candidate.node as usize].contents {
                Contents::Triangles { start, end } => {
                    for slot in start..end {
                        self.improve(positions, target, slot, max_distance, &mut best);
                    }
                }
                Contents::Children { start, end } => {
                    let mut children = [Candidate::default(); 8];
                    let children = &mut children[..(end - start) as usize];
                    for (child, node) in children.iter_mut().zip(start..end) {
                        let bound = self.nodes[node as usize].sphere.distance_bound(target);
                        *child = Candidate { bound, node };
                    }
                    // The nearest child last, to be popped first.
                    children.sort_unstable_by(|a, b| b.bound.total_cmp(&a.bound));
                    children.iter().for_each(|&child| pending.push(child));
                }
            }
        }
        best
    }

    /// Replaces `best` if the triangle is nearer, or as near with a lower id.
    fn improve(
        &self,
        positions: &[[f64; 3]],
        target: DVec3,
        slot: u32,
        max_distance: f64,
        best: &mut Option<Found>,
    ) {
        let corners = self.corners(positions, slot).map(DVec3::from);
        let nearest = closest_on_triangle(target, corners);
        let distance = nearest.distance_squared.sqrt();
        let triangle = self.ids[slot as usize];
        let better = match best {
            None => distance <= max_distance,
            Some(Found { closest, .. }) => {
                (distance, triangle) < (closest.distance, closest.triangle)
            }
        };
        if better {
            let [u, v, w] = nearest.barycentric;
            let point = u * corners[0] + v * corners[1] + w * corners[2];
            let closest = Closest {
                triangle,
                barycentric: nearest.barycentric,
                point: point.to_array(),
                distance,
                feature: nearest.feature,
            };
            *best = Some(Found { closest, slot });
        }
    }
}
