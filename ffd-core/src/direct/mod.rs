//! Direct manipulation: points are dragged, control points follow.
//!
//! With B the matrix of basis functions, a row for each constraint and a column for each
//! control point, displacements ΔP of the control points move the points by `B ΔP`
//! (\[GD01\], eq. 3). Among all ΔP that move them by the displacements ΔF asked for, the
//! one with the smallest sum of squares is `ΔP = B⁺ ΔF = Bᵀ (B Bᵀ)⁻¹ ΔF` (eq. 4).
//!
//! [`Lattice::pull`] does all at once; [`DirectManipulation`] does once what depends on
//! the points only, for points that are dragged over many frames.
//!
//! # References
//!
//! * \[GD01\] J. Gain, N. Dodgson, *Preventing self-intersection under free-form
//!   deformation*, IEEE Transactions on Visualization and Computer Graphics 7 (2001),
//!   section 4.
//! * W. Hsu, J. Hughes, H. Kaufman, *Direct manipulation of free-form deformations*,
//!   SIGGRAPH 1992: the pseudoinverse.

mod duplicates;
mod error;
mod factor;
mod injective;
mod least_norm;
mod manipulation;
mod rows;
mod sparse;

pub use error::DirectError;
pub use injective::{InjectiveOptions, InjectivePull, Scope, StepPolicy, Stopped};
pub use manipulation::DirectManipulation;

use crate::Lattice;

/// A point and where it is to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constraint<const D: usize> {
    /// A world point, before any deformation.
    pub point: [f64; D],
    /// How far its image is to move, a world vector.
    pub displacement: [f64; D],
    /// How much it matters next to others, 1 by default. Without effect on
    /// [`Fit::Exact`].
    pub weight: f64,
}

impl<const D: usize> Constraint<D> {
    /// A constraint of weight 1.
    #[must_use]
    pub fn new(point: [f64; D], displacement: [f64; D]) -> Self {
        Self {
            point,
            displacement,
            weight: 1.0,
        }
    }
}

/// How well constraints are met.
///
/// In all cases, of the displacements of control points that do equally well those with
/// the smallest sum of squares are taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Fit {
    /// Each is met to 1e-12 of the largest displacement, or none is: constraints that
    /// contradict each other are refused ([`DirectError::Inconsistent`]).
    ///
    /// So are constraints that nearly do. If points are a small fraction δ of a cell
    /// apart and their displacements differ by about as much as they are long, control
    /// points must move about 1/δ times as far, and the last digits of such large numbers
    /// are longer than 1e-12 from about δ = 1e-4 on. Displacements that vary smoothly
    /// from point to point, as of a rigid motion, can be met at any distance above 1e-5
    /// of a cell.
    #[default]
    Exact,
    /// The sum of weight times squared distance from the target is made as small as can
    /// be. Never refuses: what cannot be met is left over
    /// ([`DirectManipulation::residuals`]).
    ///
    /// Combinations of constraints that would need control points to move many times as
    /// far as points may be left over too: 1e10 times, and 1e5 times if there are more
    /// than some 300 constraints and some depend on others.
    LeastSquares,
    /// As least squares, plus `damping` times the sum of squares of the control points'
    /// displacements: soft constraints, which give way rather than move control points
    /// far. With a weight of 1, a damping of 1 lets a point in the middle of a cubic cell
    /// in space go about a tenth of the way.
    Damped {
        /// Positive; without unit.
        damping: f64,
    },
}

/// How to pull.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PullOptions<'a> {
    /// How well constraints are met.
    pub fit: Fit,
    /// Linear indices of control points that must not move. Any order; repetitions do no
    /// harm.
    pub fixed: &'a [usize],
}

/// A constraint on the same point as an earlier one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Merged {
    /// The later constraint.
    pub constraint: usize,
    /// The first one on this point.
    pub into: usize,
}

/// What became of the constraints of a pull.
#[derive(Debug, Clone, PartialEq)]
pub struct Pull<const D: usize> {
    /// Constraints on the same point as an earlier one, in ascending order.
    pub merged: Vec<Merged>,
    /// For each constraint, what its point still lacks of its displacement.
    pub residuals: Vec<[f64; D]>,
    /// The length of the longest residual.
    pub largest_residual: f64,
}

impl<const D: usize> Lattice<D> {
    /// Moves control points such that the images of some points move by given
    /// displacements.
    ///
    /// The change comes on top of the displacements that the lattice has: the image of
    /// each constraint's point moves from where it is now.
    ///
    /// # Errors
    ///
    /// As [`DirectManipulation::new`], [`DirectManipulation::solve_into`] and
    /// [`Lattice::add_displacements`]. The lattice is unchanged then.
    ///
    /// # Example
    ///
    /// ```
    /// use ffd_core::{Constraint, Degree, Frame, Grid, Lattice, PullOptions};
    ///
    /// let grid = Grid::new([Degree::CUBIC; 3], [4, 4, 4], Frame::unit())?;
    /// let mut lattice = Lattice::at_rest(grid)?;
    /// let pull = lattice.pull(
    ///     &[
    ///         Constraint::new([1.0, 2.0, 2.0], [0.0, 0.5, 0.0]),
    ///         Constraint::new([3.0, 2.0, 2.0], [0.0; 3]),
    ///     ],
    ///     &PullOptions::default(),
    /// )?;
    /// assert!(pull.largest_residual < 1e-12 && pull.merged.is_empty());
    /// let [x, y, z] = lattice.deform_point([1.0, 2.0, 2.0]);
    /// assert!((x - 1.0).abs() < 1e-12 && (y - 2.5).abs() < 1e-12 && (z - 2.0).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn pull(
        &mut self,
        constraints: &[Constraint<D>],
        options: &PullOptions<'_>,
    ) -> Result<Pull<D>, DirectError> {
        let points: Vec<_> = constraints.iter().map(|c| c.point).collect();
        let weights: Vec<_> = constraints.iter().map(|c| c.weight).collect();
        let displacements: Vec<_> = constraints.iter().map(|c| c.displacement).collect();
        let mut manipulation =
            DirectManipulation::with_weights(self.grid(), &points, &weights, options)?;
        let mut changes = vec![[0.0; D]; self.grid().control_point_count()];
        let largest_residual = manipulation.solve_into(&displacements, &mut changes)?;
        self.add_displacements(&changes)?;
        Ok(Pull {
            merged: manipulation.merged().to_vec(),
            residuals: manipulation.residuals().to_vec(),
            largest_residual,
        })
    }
}
