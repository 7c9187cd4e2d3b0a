//! What can go wrong when points are pulled.

use crate::FfdError;

/// Why constraints were refused.
///
/// Constraints are named by their position in the list that was given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DirectError {
    /// The point of a constraint is infinite or NaN.
    #[error("component {component} of the point of constraint {constraint} is {value}")]
    NonFinitePoint {
        /// Which constraint.
        constraint: usize,
        /// Which coordinate.
        component: usize,
        /// Its value.
        value: f64,
    },
    /// The displacement of a constraint is infinite or NaN.
    #[error("component {component} of the displacement of constraint {constraint} is {value}")]
    NonFiniteDisplacement {
        /// Which constraint.
        constraint: usize,
        /// Which coordinate.
        component: usize,
        /// Its value.
        value: f64,
    },
    /// A weight is not a positive number.
    #[error("the weight of constraint {constraint} is {weight}: it must be positive and finite")]
    Weight {
        /// Which constraint.
        constraint: usize,
        /// Its weight.
        weight: f64,
    },
    /// The damping is not a positive number.
    #[error("the damping is {damping}: it must be positive and finite")]
    Damping {
        /// The damping asked for.
        damping: f64,
    },
    /// A point lies outside the domain of the grid, where no control point acts.
    #[error("the point of constraint {constraint}, {point:?}, lies outside the lattice")]
    PointOutside {
        /// Which constraint.
        constraint: usize,
        /// Where its point is.
        point: Vec<f64>,
    },
    /// A control point that is to stay fixed does not exist.
    #[error("control point {control_point} cannot be fixed: there are only {count}")]
    FixedOutOfRange {
        /// The index given.
        control_point: usize,
        /// Number of control points.
        count: usize,
    },
    /// A point is to be moved that no free control point moves noticeably.
    #[error(
        "no free control point reaches constraint {constraint}: control points would have to move \
         {factor:e} times as far as its point"
    )]
    Unreachable {
        /// Which constraint.
        constraint: usize,
        /// How much farther all control points together would have to move than the
        /// point; infinite if none acts on it.
        factor: f64,
    },
    /// Constraints contradict each other, or so nearly that no lattice of 64-bit numbers
    /// meets them all.
    #[error(
        "constraints {constraints:?} contradict each other: at best one of them is missed by \
         {distance:e}"
    )]
    Inconsistent {
        /// The constraints, in ascending order. If several groups that have nothing to do
        /// with each other are contradictory, this is the one with the largest distance.
        constraints: Vec<usize>,
        /// By how much they disagree, a length in world units: for constraints on the same
        /// point the difference of their displacements, otherwise the largest distance
        /// that is left in the best compromise.
        distance: f64,
    },
    /// A list has the wrong length.
    #[error("{what}: {expected} entries are needed, {found} were given")]
    LengthMismatch {
        /// Which list.
        what: &'static str,
        /// The length it should have.
        expected: usize,
        /// Its length.
        found: usize,
    },
    /// A matrix could not be factored. Not known to happen.
    #[error("the {unknowns} equations could not be solved: {reason}")]
    Factorisation {
        /// Number of equations.
        unknowns: usize,
        /// What the factorisation said.
        reason: String,
    },
    /// A control point would have to move farther than 64-bit numbers reach.
    #[error("the displacement of control point {control_point} overflows")]
    Overflow {
        /// Linear index of the control point.
        control_point: usize,
    },
    /// The lattice could not take the change.
    #[error(transparent)]
    Lattice(#[from] FfdError),
}
