//! Tetrahedral linear elasticity driven by displacements of its surface.
//!
//! A hand that deforms an object prescribes *where* a few surface nodes go, not
//! which forces act on them. This crate finds the displacement of every other
//! node from those few: it factors the stiffness matrix of a body once, condenses
//! it to a set of contact nodes whenever that set changes, and then answers each
//! frame with one small dense product.
//!
//! The types follow the order in which things become known, so that a later
//! stage cannot be asked for before an earlier one exists:
//!
//! | stage | type | cost | changes when |
//! |---|---|---|---|
//! | topology and rest shape | [`TetMesh`] | `O(#V + #T)` | a mesh is loaded |
//! | assembled and factored | [`ElasticBody`] | one sparse Cholesky | the rest shape or the material changes |
//! | condensed to the contacts | [`ContactSet`] | `3 #C` solves | a contact begins or ends |
//! | displaced | [`ContactSet::displacements_into`] | `9 #V #C` multiply-adds, no allocation | every frame |
//!
//! Nothing needs to be clamped: a body held by three or more nodes that are not
//! on one line is fully determined, and that free-floating case is the normal one
//! (\[Ma98\] attaches the object to the palm and displaces five fingertips).
//!
//! # Conventions
//!
//! SI units (metre, pascal, newton). Positions are `#V × 3`, tetrahedra `#T × 4`
//! with zero-based indices and positive orientation
//! `(x₁ − x₀) · ((x₂ − x₀) × (x₃ − x₀)) > 0`; surface triangles wind
//! counter-clockwise seen from outside. Displacements are small-strain and
//! linear: large rotations of a part of the body make it swell.
//!
//! # Example
//!
//! ```
//! use fem_tet::{ContactSet, ElasticBody, Material, TetMesh};
//!
//! // A bar of two tetrahedra sharing a face, pulled 1 mm longer at its two tips.
//! let positions = vec![
//!     [0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.05, 0.0],
//!     [0.0, 0.0, 0.1], [0.0, 0.0, -0.1],
//! ];
//! let mesh = TetMesh::new(positions, vec![[0, 1, 2, 3], [0, 2, 1, 4]])?;
//! let body = ElasticBody::new(mesh, Material::new(20e3, 0.3)?)?;
//!
//! let contacts = ContactSet::at_nodes(&body, &[3, 4, 1])?;
//! let mut u = vec![[0.0; 3]; 5];
//! contacts.displacements_into(&[[0.0, 0.0, 5e-4], [0.0, 0.0, -5e-4], [0.0; 3]], &mut u);
//! assert_eq!(u[3], [0.0, 0.0, 5e-4]); // contact nodes go exactly where they are told
//! assert!(u[2][1] < 0.0);             // and the waist narrows (Poisson)
//! # Ok::<(), fem_tet::FemError>(())
//! ```
//!
//! # References
//!
//! * \[Ma98\] Ma Mun Chung, *Interacting with a virtually deformable object using an
//!   instrumented glove*, M.Phil. thesis, The Chinese University of Hong Kong,
//!   1998, chapters 3 and 6.
//! * \[JP99\] D. James, D. Pai, *`ArtDefo`: accurate real time deformable objects*,
//!   SIGGRAPH 1999: the capacitance matrix for changing contacts.

mod assembly;
mod body;
mod contact;
mod element;
mod error;
mod factor;
pub mod io;
mod material;
mod mesh;
mod rigid;
mod volume;

pub use body::ElasticBody;
pub use contact::{Contact, ContactSet};
pub use error::{FemError, FreeMotion, MeshError};
pub use material::Material;
pub use mesh::{TetMesh, surface_triangles};
pub use volume::{largest_safe_fraction, total_volume, volume_ratios};

/// The README's code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
