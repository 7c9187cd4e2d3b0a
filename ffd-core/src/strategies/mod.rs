//! Lattices to test with, for [proptest](https://docs.rs/proptest): strategies for lattices
//! about which it is known whether they fold (feature `proptest`).
//!
//! Whoever writes code that says something of this kind (a detector of folds, a penalty on
//! them, the same computation on a graphics card) wants to know whether it is right, near
//! the limit most of all. Few random lattices are near the limit, and none of those
//! that overlap without folding is found by chance.
//!
//! | strategy | lattices | `det J` | one-to-one | known from |
//! |---|---|---|---|---|
//! | [`injective`] | small displacements, and an affine map of them | > 0 | yes | the bound of Choi and Lee |
//! | [`near_limit`] | scaled to just before a fold, or just beyond | > 0, or both signs | | [`Lattice::check`](crate::Lattice::check) |
//! | [`folded`] | far beyond | both signs | no | clear values at two points |
//! | [`degenerate`] | polynomials | ≥ 0, exactly zero somewhere | | construction |
//! | [`overlapping`] | strips wound round to more than a ring | > 0 | no | construction |
//! | [`reversed`] | mirror images | < 0 | yes | the bound of Choi and Lee |
//! | [`known`] | all of these, with their [`Class`] | | | |
//! | [`lattices`] | any, by the size of displacements | | | |
//! | [`grids`] | | | | |
//!
//! [`GridOptions`] say which degrees, knots, borders, frames and how many cells there may
//! be. Control points are displaced in cells, so verdicts do not depend on the frame.
//!
//! # Shrinking
//!
//! A lattice that refutes a claim shrinks to one with few cells and low degrees, in the unit
//! frame, in which few control points are displaced, by round numbers. On the way it stays
//! in its class: each step is proven anew, or leaves alone what the class rests on.
//!
//! # Example
//!
//! Whoever looks at the determinant at 5 × 5 points of each cell misses folds. Numbers that
//! bound the derivatives do not.
//!
//! ```
//! use ffd_core::Lattice;
//! use ffd_core::strategies::{GridOptions, Known, known, near_limit};
//! use proptest::prelude::*;
//! use proptest::test_runner::{TestError, TestRunner};
//!
//! /// Looks for a fold, and says whether there is none.
//! fn looks_regular(lattice: &Lattice<2>) -> bool {
//!     let grid = lattice.grid();
//!     let points = grid.cells().map(|cells| 4 * cells + 1);
//!     (0..points[0] * points[1]).all(|k| {
//!         let u = [k % points[0], k / points[0]].map(|i| 0.25 * i as f64);
//!         match lattice.evaluate(grid.frame().to_world(u)) {
//!             Some(there) => there.determinant > 0.0,
//!             None => true, // rounded out of the domain
//!         }
//!     })
//! }
//!
//! /// Whether neighbouring control points move alike: by less than half a cell, in the
//! /// unit frame and with uniform knots. Then ‖J − I‖ < 1, rows summed: no fold.
//! fn moves_alike(lattice: &Lattice<2>) -> bool {
//!     let grid = lattice.grid();
//!     let d = lattice.displacements();
//!     (0..d.len()).all(|i| {
//!         (0..2).all(|axis| {
//!             let mut next = grid.control_point_indices(i);
//!             next[axis] += 1;
//!             next[axis] == grid.control_points_per_axis()[axis] || {
//!                 let j = grid.control_point(next);
//!                 (0..2).all(|c| (d[j][c] - d[i][c]).abs() < 0.5)
//!             }
//!         })
//!     })
//! }
//!
//! let options = GridOptions {
//!     knots: Some(ffd_core::Knots::Uniform),
//!     border: Some(ffd_core::Border::Free),
//!     frames: ffd_core::strategies::Frames::Unit,
//!     ..GridOptions::default()
//! };
//!
//! // It misses folds, in lattices as simple as this:
//! let refuted = TestRunner::deterministic().run(&near_limit::<2>(options, 1e-3), |it| {
//!     prop_assert_eq!(looks_regular(&it.lattice), it.class.is_regular());
//!     Ok(())
//! });
//! let Err(TestError::Fail(_, Known { lattice, .. })) = refuted else { panic!() };
//! assert_eq!(lattice.grid().cells(), [1, 1]);
//!
//! // This claims less, and never too much.
//! TestRunner::deterministic().run(&known::<2>(options), |it| {
//!     prop_assert!(it.class.is_regular() || !moves_alike(&it.lattice));
//!     Ok(())
//! })?;
//! # Ok::<(), TestError<Known<2>>>(())
//! ```

mod class;
mod degenerate;
mod field;
mod grids;
mod numbers;
mod rings;
mod signs;

pub use class::{Class, Known};
pub use degenerate::degenerate;
pub use field::{injective, lattices, reversed};
pub use grids::{Frames, GridOptions, grids};
pub use rings::overlapping;
pub use signs::{folded, near_limit};

use proptest::prop_oneof;
use proptest::strategy::Strategy;

/// Lattices of all classes, each as often; those [near the limit](near_limit) within 1/1000.
///
/// What the options ask of borders, knots and cells is left aside by the strategies that
/// cannot do it: see each of them.
///
/// They shrink within their class, and to another if that will do.
///
/// # Example
///
/// ```
/// use ffd_core::{CheckOptions, strategies::{GridOptions, known}};
/// use proptest::{prelude::*, test_runner::TestRunner};
///
/// let mut runner = TestRunner::new(ProptestConfig::with_cases(32));
/// runner.run(&known::<2>(GridOptions::default()), |known| {
///     let verdict = known.lattice.check(&CheckOptions::default());
///     prop_assert!(known.class.allows(&verdict.outcome));
///     Ok(())
/// })?;
/// # Ok::<(), proptest::test_runner::TestError<ffd_core::strategies::Known<2>>>(())
/// ```
pub fn known<const D: usize>(
    options: GridOptions,
) -> impl Strategy<Value = Known<D>> + Clone + Send + Sync {
    let of = |class| move |lattice| Known::new(lattice, class);
    prop_oneof![
        injective(options).prop_map(of(Class::Injective)),
        near_limit(options, 1e-3),
        folded(options).prop_map(of(Class::Folded)),
        degenerate(options).prop_map(of(Class::Degenerate)),
        overlapping(options).prop_map(of(Class::Overlapping)),
        reversed(options).prop_map(of(Class::Reversed)),
    ]
}
