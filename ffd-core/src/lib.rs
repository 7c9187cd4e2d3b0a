//! Free-form deformation by B-spline lattices in two and three dimensions.
//!
//! A lattice of control points lies around an object. Moving a control point
//! moves the space near it, and the object with it (T. Sederberg, S. Parry,
//! *Free-form deformation of solid geometric models*, SIGGRAPH 1986; here with
//! uniform B-splines in place of Bernstein polynomials, so that a control point
//! acts only nearby).
//!
//! * [`Lattice`] holds the displacements of the control points, deforms points
//!   and gives the Jacobian of the deformation.
//! * [`Frame`] places a lattice in the world: any affine box.
//! * [`Degree`] and [`uniform_basis`] are the B-splines underneath.
//!
//! # Conventions
//!
//! Per axis of degree n with a cells, there are a + n control points; with uniform
//! knots control point i rests at lattice coordinate i − (n − 1)/2, with clamped ones
//! the outermost rest on the ends of the box. Displacements are world vectors in
//! *linear order*: control point (i, j, k) of an nx × ny × nz lattice is number
//! i + nx (j + ny k). Matrices are row-major, `m[row][column]`.
//!
//! # Example
//!
//! Shearing a square: every control point moves right by half its height.
//!
//! ```
//! use ffd_core::{Degree, Frame, Grid, Lattice};
//!
//! let grid = Grid::new([Degree::CUBIC; 2], [4, 4], Frame::unit())?;
//! let displacements = (0..grid.control_point_count())
//!     .map(|i| [0.5 * grid.rest_position(i)[1], 0.0])
//!     .collect();
//! let lattice = Lattice::new(grid, displacements)?;
//!
//! let [x, y] = lattice.deform_point([1.0, 3.0]);
//! assert!((x - 2.5).abs() < 1e-14 && (y - 3.0).abs() < 1e-14);
//! // Outside the box nothing moves.
//! assert_eq!(lattice.deform_point([5.0, 3.0]), [5.0, 3.0]);
//! # Ok::<(), ffd_core::FfdError>(())
//! ```

#![allow(
    clippy::needless_range_loop,
    reason = "axes and components index several arrays at once, as in the formulas"
)]

mod blend;
mod bspline;
mod bulk;
mod direct;
mod embedding;
mod error;
mod evaluate;
#[cfg(feature = "serde")]
mod form;
mod frame;
mod grid;
mod inverse;
mod kernel;
mod lattice;
mod matrix;
mod rows;
mod scalar;
mod sequence;
mod tangent;

pub use bspline::{Axis, Degree, Knots, MAX_ORDER};
pub use direct::{Constraint, DirectError, DirectManipulation, Fit, Merged, Pull, PullOptions};
pub use embedding::Embedding;
pub use error::FfdError;
pub use evaluate::{Evaluation, Outside};
pub use frame::Frame;
pub use grid::{Border, Grid};
pub use inverse::{Inverse, InverseError, Preimage, UndoReport};
pub use lattice::Lattice;
pub use scalar::Scalar;
pub use sequence::Sequence;
pub use tangent::{transform_normal, transform_tangent};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
