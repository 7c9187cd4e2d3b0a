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
//! Per axis of degree n with a cells, the knots are the integers from 0 to a,
//! there are a + n control points, and control point i rests at lattice
//! coordinate i − (n − 1)/2. Displacements are world vectors in *linear order*:
//! control point (i, j, k) of an nx × ny × nz lattice is number
//! i + nx (j + ny k). Matrices are row-major, `m[row][column]`.
//!
//! # Limits
//!
//! The box of the lattice is all there is: points outside have no image, and
//! nothing joins the deformation smoothly to the space around. A deformation
//! with large displacements can fold; `det J > 0` at some points, from
//! [`Lattice::jacobian_at`], does not prove the contrary.
//!
//! # Example
//!
//! Shearing a square: every control point moves right by half its height.
//!
//! ```
//! use ffd_core::{Degree, Frame, Lattice};
//!
//! let frame = Frame::unit();
//! let at_rest = Lattice::at_rest([Degree::CUBIC; 2], [4, 4], frame)?;
//! let displacements = (0..at_rest.control_point_count())
//!     .map(|i| [0.5 * at_rest.rest_position(i)[1], 0.0])
//!     .collect();
//! let lattice = Lattice::new([Degree::CUBIC; 2], [4, 4], frame, displacements)?;
//!
//! let [x, y] = lattice.deform_point([1.0, 3.0]).expect("inside the box");
//! assert!((x - 2.5).abs() < 1e-14 && (y - 3.0).abs() < 1e-14);
//! assert_eq!(lattice.deform_point([5.0, 3.0]), None);
//! # Ok::<(), ffd_core::FfdError>(())
//! ```

mod bspline;
mod deform;
mod error;
mod frame;
mod lattice;

pub use bspline::{Degree, MAX_ORDER, rest_coordinate, uniform_basis};
pub use error::FfdError;
pub use frame::Frame;
pub use lattice::Lattice;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
