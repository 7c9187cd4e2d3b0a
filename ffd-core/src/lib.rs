//! Free-form deformation by B-spline lattices in two and three dimensions.
//!
//! A lattice of control points lies around an object. Moving a control point
//! moves the space near it, and the object with it (T. Sederberg, S. Parry,
//! *Free-form deformation of solid geometric models*, SIGGRAPH 1986; with B-splines in
//! place of Bernstein polynomials, so that a control point acts only nearby: J. Gain,
//! N. Dodgson, *Preventing self-intersection under free-form deformation*, IEEE
//! Transactions on Visualization and Computer Graphics 7(4), 2001, section 3).
//!
//! | to | use |
//! |---|---|
//! | lay cells around an object | [`Frame`], [`Grid`], with [`Knots`] and [`Border`] |
//! | move control points | [`Lattice`] |
//! | drag points of the object itself | [`Lattice::pull`], [`DirectManipulation`] |
//! | drag them far without folding | [`Grid::injective_pull`] |
//! | deform a point, with Jacobian or second derivatives | [`Lattice::deform_point`], [`Lattice::evaluate`], [`Lattice::second_derivatives`] |
//! | deform many points once | [`Lattice::deform_points`] |
//! | deform a mesh in every frame | [`Embedding`] |
//! | take normals and tangents along | [`Embedding::deform_with_normals_into`], [`transform_normal`], [`transform_tangent`] |
//! | apply several deformations | [`Sequence`] |
//! | go back | [`Lattice::inverse_point`], [`Inverse`], [`Sequence::undo_points`] |
//! | find out whether it folds | [`Lattice::check`]; [`Checker`] in every frame |
//! | prove that to others | [`Lattice::certify`], [`Certificate`] |
//! | find out how far it can go before it folds | [`Lattice::largest_safe_step`] |
//! | cut cells without changing anything | [`Lattice::refine`] |
//! | store | features `serde`: see [Files](#files) |
//! | test code of your own | feature `proptest`: `strategies` for lattices of which it is known whether they fold |
//!
//! Points are `[f64; D]`; functions over many points take slices of any vector type that
//! converts to and from `[f64; D]` or `[f32; D]`: arrays, glam, nalgebra, mint, cgmath.
//!
//! # Conventions
//!
//! Per axis of degree n with a cells, there are a + n control points; with uniform
//! knots control point i rests at lattice coordinate i − (n − 1)/2, with clamped ones
//! the outermost rest on the ends of the box. Displacements are world vectors in
//! *linear order*: control point (i, j, k) of an nx × ny × nz lattice is number
//! i + nx (j + ny k). Matrices are row-major, `m[row][column]`.
//!
//! # Files
//!
//! With feature `serde`, a lattice is read and written as
//!
//! ```json
//! {"degree": [3, 3], "cells": [1, 1], "knots": ["uniform", "uniform"],
//!  "origin": [0, 0], "axes": [[1, 0], [0, 1]], "border": "free",
//!  "displacements": [[0, 0], [0.5, 0]]}
//! ```
//!
//! (with sixteen displacements in place of the two shown): `origin` is the world position
//! of lattice coordinate 0, `axes` the world vectors of one cell, `displacements` world
//! vectors in linear order. `knots` and `border` may be left out. A sequence is
//! `{"sequence": [lattice, …]}`. Reading checks everything that the constructors check;
//! with `serde_json`, enable its feature `float_roundtrip`, or the last digit of some
//! numbers is lost.
//!
//! # Does it fold?
//!
//! [`Lattice::check`] judges the map `F(x) = x + Σ Bᵢ(A⁻¹(x − o)) dᵢ` on its closed domain,
//! with the stored numbers taken as exact real numbers. A map is *regular* if the determinant
//! of `J = ∂F/∂x` is positive everywhere on the closed domain. The [outcome](Outcome) is
//!
//! | word | proven is |
//! |---|---|
//! | `injective` | regular, and one-to-one on the domain by a [`Theorem`] |
//! | `locally_injective` | regular, but no theorem that was tried excludes that distant points have the same image |
//! | `not_injective` | `det J` has both signs, or two points have the same image: [`Evidence`] |
//! | `degenerate` | `det J` is exactly zero somewhere, and of the same sign elsewhere |
//! | `reversed` | `det J < 0` on the closed domain |
//! | `undecided` | nothing; [`Undecided`] tells where the [`Budget`] was spent |
//!
//! Regular is less than one-to-one: a strip that is bent round further than to a ring is
//! regular and lies on itself. Theorem 1 of \[GD01\] overlooks that unless the border of
//! the lattice is fixed. With an [identity border](Border::Identity) regular maps are
//! one-to-one, on all of space, and so are compositions of them.
//!
//! Along an axis of degree 1, J jumps between cells; regular then means that `det J > 0` on
//! each closed cell, with the Jacobian of that cell, which makes the map a local
//! homeomorphism as well.
//!
//! ```
//! use ffd_core::{CheckOptions, Degree, Frame, Grid, Lattice, Outcome};
//!
//! let grid = Grid::new([Degree::CUBIC; 2], [3, 3], Frame::unit())?;
//! let mut lattice = Lattice::at_rest(grid)?;
//! lattice.set_displacement(14, [0.3, 0.1])?;
//! let options = CheckOptions { enclose: Some(1e-3), ..CheckOptions::default() };
//! let verdict = lattice.check(&options);
//! assert!(verdict.is_injective());
//! let [low, high] = verdict.min_det;
//! assert!(0.0 < low && high < 1.0 && high - low <= 1e-3);
//!
//! lattice.set_displacement(14, [3.0, 0.0])?;
//! let folded = lattice.check(&options);
//! assert!(matches!(folded.outcome, Outcome::NotInjective(_)));
//! # Ok::<(), ffd_core::FfdError>(())
//! ```
//!
//! # Limits
//!
//! `det J > 0` at some points, from [`Lattice::evaluate`], does not prove that a deformation
//! does not fold; [`Lattice::check`] does. With a [free](Border::Free) border, points outside
//! stay where they are and space is torn along the box; with an
//! [identity](Border::Identity) border it is not. Only vertices are deformed: straight
//! edges between them stay straight, so a coarse mesh can intersect itself although the
//! deformation is one-to-one.
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
mod certificate;
mod direct;
mod embedding;
mod error;
mod evaluate;
#[cfg(feature = "serde")]
mod form;
mod frame;
mod grid;
mod injectivity;
mod inverse;
mod kernel;
mod lattice;
#[cfg(test)]
mod levels;
mod matrix;
mod places;
mod rows;
mod scalar;
mod sequence;
#[cfg(feature = "proptest")]
pub mod strategies;
mod tangent;

pub use bspline::{Axis, Degree, Knots, MAX_ORDER};
pub use certificate::{
    Certificate, CertificateError, Certified, Claim, CutsError, Proven, Uncertified,
};
pub use direct::{
    Constraint, DirectError, DirectManipulation, Fit, InjectiveOptions, InjectivePull, Merged,
    Pull, PullOptions, Scope, StepPolicy, Stopped,
};
pub use embedding::Embedding;
pub use error::FfdError;
pub use evaluate::{Evaluation, Outside};
pub use frame::Frame;
pub use grid::{Border, Grid};
pub use injectivity::{
    Budget, CheckOptions, Checker, ConicHull, Effort, Evidence, Map, Method, Outcome, Place,
    SafeStep, StepOptions, Theorem, Undecided, Verdict,
};
pub use inverse::{Inverse, InverseError, Preimage, UndoReport};
pub use lattice::Lattice;
pub use scalar::Scalar;
pub use sequence::Sequence;
pub use tangent::{transform_normal, transform_tangent};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
