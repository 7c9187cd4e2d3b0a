//! Shapes that can be held against the tree.

mod cylinder;
mod sphere;

pub use cylinder::Cylinder;
pub use sphere::Sphere;

/// A shape that can be held against a sphere tree.
///
/// Implement it for a shape of your own to use it in [`SphereTree::any`] and
/// [`SphereTree::collect`].
///
/// # Contract
///
/// If [`intersects_triangle`](Self::intersects_triangle) accepts a triangle,
/// [`overlaps_sphere`](Self::overlaps_sphere) must accept every sphere that
/// contains its three corners, rounding included. Otherwise triangles are
/// missed. The reverse is not needed: accepting too many spheres costs time
/// only.
///
/// [`SphereTree::any`]: crate::SphereTree::any
/// [`SphereTree::collect`]: crate::SphereTree::collect
pub trait Probe {
    /// Whether the shape may reach into the sphere (broad phase).
    fn overlaps_sphere(&self, sphere: &Sphere) -> bool;

    /// Whether the shape and the triangle have a point in common (narrow
    /// phase).
    fn intersects_triangle(&self, corners: [[f64; 3]; 3]) -> bool;
}

/// Slack of a broad-phase test, relative to the sum of the lengths involved.
///
/// Let `M` be the sum of the radius of the covering sphere and the radius and
/// length of the shape. A narrow phase that accepts handles lengths up to
/// `2 M`, and its chain of operations — difference, change of frame, clipping
/// or projection, norm — is shorter than forty roundings of ε/2 each. What it
/// accepts is therefore within `40 ε M` of the shape, and the broad-phase
/// distance is as accurate. 128 ε covers both.
const SLACK: f64 = 128.0 * f64::EPSILON;
