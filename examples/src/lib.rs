//! What the programs share: the stages of the glove-driven deformation loop.
//!
//! ```text
//! motion (script | recording)
//!   └ devices ── bytes ── receiver ── hand sample
//!        └ hand_proxy ── the virtual hand, which does not enter the object
//!             └ touch ── contacts of the fingertips
//!                  └ grasp ── which fingertips hold the object
//!                       └ soft_body ── deformed positions (deformer: elastic solid or
//!                            │         lattice), tree brought up to date
//!                            └ session ── frame records, snapshots
//!                                 └ report | picture | vtu | object file
//! ```
//!
//! One direction, one owner per arrow. See [`session::run`].
//!
//! Beside the loop stand three programs for free-form deformation: `ffd`, which deforms
//! mesh files, `warp`, which warps a picture (see [`warp`]), and `figures`, which draws and
//! measures the figures of the paper ([`mesh_crossings`] counts where meshes cross).
//! [`command`] is what they have in common.

pub mod command;
pub mod deformer;
pub mod devices;
pub mod geometry;
pub mod grasp;
pub mod hand_proxy;
pub mod ink;
pub mod mesh_crossings;
pub mod mesh_file;
pub mod moments;
pub mod motion;
pub mod output;
pub mod picture;
pub mod raster;
pub mod rehearsal;
pub mod report;
pub mod scene;
pub mod session;
pub mod soft_body;
pub mod touch;
pub mod vtu;
pub mod warp;

/// Compiles and runs the examples of the guide.
#[cfg(doctest)]
#[doc = include_str!("../../docs/src/injectivity.md")]
#[doc = include_str!("../../docs/src/certificates.md")]
#[doc = include_str!("../../docs/src/sculpting.md")]
struct Guide;

/// Compiles and runs the examples of the guide to property tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/src/property-testing.md")]
struct PropertyTesting;
