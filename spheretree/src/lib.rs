//! Octree sphere trees: which part of a deforming surface does a hand touch?
//!
//! # Bird's-eye view
//!
//! A [`SphereTree`] is built over the triangles of a [`Mesh`]. Their centroids
//! are sorted along a Morton curve, which groups them into the cells of an
//! octree; each cell gets a sphere that covers its triangles. A query walks
//! down from the root, leaves out every sphere it does not reach, and tests
//! the few triangles that remain exactly. When the surface deforms,
//! [`SphereTree::refit`] moves the spheres without sorting again.
//!
//! | question | method |
//! |---|---|
//! | Does the shape touch the surface at all? | [`SphereTree::any`] |
//! | Which triangles does it touch? | [`SphereTree::collect`] |
//! | Which surface point is nearest? | [`SphereTree::closest_point`] |
//! | Where, and how deep, does a fingertip press? | [`SphereTree::sphere_contact`] |
//! | How does the tree see the object? | [`SphereTree::level`] |
//!
//! A shape that can be asked about is a [`Probe`]: [`Sphere`] and the
//! flat-capped [`Cylinder`] are, and so is any type of yours that keeps the
//! trait's contract.
//!
//! # Example
//!
//! ```
//! use spheretree::{Cylinder, Mesh, Sphere, SphereTree};
//!
//! // A unit square in the plane z = 0, cut along its diagonal.
//! let positions = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
//! let triangles = [[0, 1, 2], [0, 2, 3]];
//! let tree = SphereTree::build(Mesh::new(&positions, &triangles)?);
//!
//! // A pin through the lower triangle.
//! let pin = Cylinder::new([0.8, 0.2, -1.0], [0.8, 0.2, 1.0], 0.05)?;
//! let mut touched = Vec::new();
//! tree.collect(&positions, &pin, &mut touched);
//! assert_eq!(touched, [0]);
//!
//! // A fingertip of radius 0.5 whose centre is 0.25 above the upper one.
//! let tip = Sphere::new([0.25, 0.75, 0.25], 0.5)?;
//! let contact = tree.sphere_contact(&positions, &tip, 0.0).expect("they touch");
//! assert_eq!(contact.triangle, 1);
//! assert_eq!(contact.depth, 0.25);
//! assert_eq!(contact.normal, [0.0, 0.0, 1.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//!
//! * Lengths have one unit throughout, whichever the caller uses; metres in
//!   this suite. No tolerance is absolute, so micrometres and kilometres work
//!   alike: results scale exactly with powers of two.
//! * Products of four lengths occur. They stay finite because coordinates
//!   beyond [`MAX_COORDINATE`] are refused. Features smaller than about 1e-70
//!   units are processed, but their products underflow and results there are
//!   not reliable.
//! * Triangles are counter-clockwise seen from outside; only
//!   [`Contact::normal`] depends on it. Triangles without area are allowed.
//! * Shapes are closed sets: touching is hitting.
//! * The tree keeps the triangles, the caller keeps the positions and hands
//!   them to every query. They must be the positions the tree was last built
//!   or refitted with: other ones of the same number are not detected and lead
//!   to missed triangles.
//! * Answers do not depend on the order in which the tree is walked: ids come
//!   sorted, and ties go to the lowest triangle id.
//!
//! # Limits
//!
//! Distances are unsigned: the tree answers for the surface and does not know
//! inside from outside. Queries see one instant, so a shape that jumps across a
//! thin object between two frames is not noticed.
//!
//! # References
//!
//! * \[Ma98\] Ma M. C., *Interacting with a virtually deformable object using
//!   an instrumented glove*, M.Phil. thesis, The Chinese University of Hong
//!   Kong, 1998, chapter 4. This crate departs from it: spheres cover
//!   triangles, not only vertices, since a finger can press on a face between
//!   them; contents are assigned by cell, so that none is stored twice; levels
//!   of the octree at which nothing is separated are skipped; duplicate points
//!   cannot make the construction endless.
//! * \[PG95\] I. J. Palmer, R. L. Grimsdale, *Collision Detection for Animation
//!   using Sphere-Trees*, Computer Graphics Forum 14(2), 1995.
//! * \[Eri05\] C. Ericson, *Real-Time Collision Detection*, Morgan Kaufmann,
//!   2005: closest points, distances of spheres, linear octrees.

mod build;
mod closest;
mod contact;
mod error;
mod mesh;
mod morton;
mod query;
mod refit;
mod shape;
mod stack;
mod tree;
mod triangle;

pub use closest::Closest;
pub use contact::Contact;
pub use error::{MeshError, ShapeError};
pub use mesh::{MAX_COORDINATE, Mesh};
pub use shape::{Cylinder, Probe, Sphere};
pub use tree::SphereTree;
pub use triangle::Feature;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
