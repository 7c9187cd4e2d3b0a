//! The way back: from the image of a point to the point.
//!
//! Inverted is the map F that leaves points outside the domain where they are
//! ([`Outside::Keep`](crate::Outside::Keep)), the one of
//! [`Lattice::deform_point`]. A point q can have a preimage inside the domain, and is
//! its own preimage if it lies outside.
//!
//! # Method
//!
//! Newton's method, damped by halving steps, starts from the point of the domain that
//! is nearest to q and usually needs five or six evaluations. Where it fails, the domain
//! is searched by branch and bound:
//!
//! 1. cells are discarded by the bounds of their displacements, many at a time;
//! 2. a box within a cell is discarded if the Bézier control points of F on it lie on
//!    one side of q, along an axis of the world or along a gradient of a lattice
//!    coordinate (then the bounds shrink with the square of the box);
//! 3. from the middle of each box that remains, Newton's method is tried on the
//!    polynomial of that cell, which has no creases; then the box is cut in two.
//!
//! Bounds are widened by what rounding can do, so *not in the image* is a proof.
//!
//! # References
//!
//! * E. Sherbrooke, N. Patrikalakis, *Computation of the solutions of nonlinear
//!   polynomial systems*, Computer Aided Geometric Design 10 (1993): subdivision of
//!   Bernstein forms.

mod bounds;
mod newton;
mod search;
mod undo;

use bounds::Rounding;
use search::Outcome;
pub use undo::UndoReport;

use crate::{Border, Lattice};

/// Boxes that a search may look at unless told otherwise.
const BUDGET: usize = 20_000;

/// The points that a deformation moves to a given one, as far as they were looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Preimage<const D: usize> {
    /// There is none: the point is not in the image. For a lattice this is proven, not
    /// just that none was found. For a sequence it is if each of its lattices has at most
    /// one preimage of a point inside its domain: see [`Sequence::inverse_point`].
    ///
    /// [`Sequence::inverse_point`]: crate::Sequence::inverse_point
    None,
    /// The preimage; where the deformation folds, one of those inside the domain.
    One([f64; D]),
    /// Two. For a lattice they are one inside its domain, and the given point itself,
    /// which lies outside of it and stays where it is. For a sequence of lattices they
    /// come about in the same way at one of them.
    Two([[f64; D]; 2]),
}

impl<const D: usize> Preimage<D> {
    /// The preimage; of two, the one that was inside the domain.
    #[must_use]
    pub fn point(&self) -> Option<[f64; D]> {
        match *self {
            Self::None => None,
            Self::One(point) | Self::Two([point, _]) => Some(point),
        }
    }
}

/// Why a preimage could not be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InverseError {
    /// A point is infinite or NaN.
    #[error("component {component} of point {index} is {value}")]
    NonFinitePoint {
        /// Index of the point.
        index: usize,
        /// Which coordinate.
        component: usize,
        /// Its value.
        value: f64,
    },
    /// Numbers of the lattice are too large to compute with: sums could overflow.
    #[error("a lattice of size {size} is too large to be inverted: 1e290 is the limit")]
    TooLarge {
        /// Its [size](Inverse::size).
        size: f64,
    },
    /// The search has neither found a preimage inside the domain nor shown that there is
    /// none. Either its budget is spent, or rounding hides what happens in the boxes that
    /// are left. That takes a map that folds or is singular near by, nearly parallel
    /// axes, or a box whose cells are tiny beside its distance from the origin.
    #[error(
        "undecided after {boxes} boxes whether the point is in the image: {nearest:?} comes \
         within {residual}"
    )]
    Unresolved {
        /// The point of the domain whose image came nearest.
        nearest: Vec<f64>,
        /// How near: the distance of its image.
        residual: f64,
        /// Whether the point itself lies outside the domain, and so is a preimage.
        outside: bool,
        /// The boxes looked at.
        boxes: usize,
    },
    /// A sequence has so many lattices with two preimages that not all ways back could be
    /// followed.
    #[error("more than {steps} steps lead back through the sequence")]
    TooManyWays {
        /// The steps that were taken.
        steps: usize,
    },
}

/// A lattice made ready for inversion of many points.
///
/// # Accuracy
///
/// Let q = F(x) for an x in the domain. If F is injective, the preimage y that is found
/// satisfies
///
/// * |F(y) − q| ≤ 16 ε · [size](Inverse::size), and
/// * |y − x| ≤ 64 ε · size · max(1, ‖J(x)⁻¹‖), except where J is nearly singular,
///
/// with ε = 2⁻⁵² and F as computed by [`Lattice::deform_point`]. Both grow where
/// computing F itself is less accurate than that: with the condition number of the
/// frame's axes if these are nearly parallel, and where F stretches space so much that
/// numbers next to each other have images farther apart, with about 4 ‖J‖ in place of
/// 16; a good y near by is taken then. A q that misses the image by no more than rounding
/// can explain may be given the nearest point of the domain.
///
/// A y on the border of the domain is moved inside by a rounding error if need be, so
/// that [`Lattice::deform_point`] does deform it. If q lies outside the domain and y is
/// the same point up to rounding, they count as one, q.
///
/// # Example
///
/// ```
/// use ffd_core::{Degree, Frame, Grid, Inverse, Lattice, Preimage};
///
/// // One control point in the middle moved by half a cell.
/// let grid = Grid::new([Degree::CUBIC; 2], [4, 4], Frame::unit())?;
/// let mut lattice = Lattice::at_rest(grid)?;
/// lattice.set_displacement(24, [0.5, 0.25])?;
///
/// let inverse = Inverse::new(&lattice);
/// let x = [1.75, 2.125];
/// let Preimage::One(y) = inverse.point(lattice.deform_point(x))? else { panic!() };
/// assert!((y[0] - x[0]).abs() < 1e-14 && (y[1] - x[1]).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Inverse<'a, const D: usize> {
    lattice: &'a Lattice<D>,
    size: f64,
    /// The least and the largest displacement, per component.
    hull: [[f64; 2]; D],
    rounding: Rounding<D>,
    budget: usize,
}

impl<'a, const D: usize> Inverse<'a, D> {
    /// Looks at each control point once.
    #[must_use]
    pub fn new(lattice: &'a Lattice<D>) -> Self {
        let grid = lattice.grid();
        let mut hull = match grid.border() {
            Border::Free => [[f64::INFINITY, f64::NEG_INFINITY]; D],
            Border::Identity => [[0.0; 2]; D],
        };
        for &displacement in lattice.displacements() {
            bounds::extend(&mut hull, displacement);
        }
        let largest = hull
            .iter()
            .flatten()
            .fold(0.0_f64, |most, c| most.max(c.abs()));
        Self {
            lattice,
            size: grid.size() + largest,
            hull,
            rounding: Rounding::new(grid),
            budget: BUDGET,
        }
    }

    /// The same with another limit on the boxes that a search may look at for one
    /// point. The default, 20 000, takes about a tenth of a second in three dimensions;
    /// it is rarely spent, on maps that fold many times or in strongly skewed frames.
    #[must_use]
    pub fn with_budget(self, boxes: usize) -> Self {
        Self {
            budget: boxes,
            ..self
        }
    }

    /// The size that error bounds refer to: that of the grid
    /// ([`Grid::size`](crate::Grid::size)) plus the largest absolute value of a
    /// component of a displacement. No coordinate of the domain or of its image is
    /// larger.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.size
    }

    /// The preimages of a world point.
    ///
    /// Costs five or six evaluations of the lattice with Jacobian. If the deformation is
    /// far from the identity, or the point is near the image but not in it, a search adds
    /// some hundred of them, and time proportional to the number of control points; only
    /// then is memory allocated.
    ///
    /// # Errors
    ///
    /// * [`InverseError::NonFinitePoint`], with index 0;
    /// * [`InverseError::TooLarge`];
    /// * [`InverseError::Unresolved`].
    pub fn point(&self, q: [f64; D]) -> Result<Preimage<D>, InverseError> {
        if let Some(component) = q.iter().position(|c| !c.is_finite()) {
            return Err(InverseError::NonFinitePoint {
                index: 0,
                component,
                value: q[component],
            });
        }
        self.check_size()?;
        let outside = !self.lattice.grid().contains(q);
        let inside = match self.inside(q) {
            Outcome::Found { y, residual } => Some((y, residual)),
            Outcome::Excluded => None,
            Outcome::Unresolved {
                nearest,
                residual,
                boxes,
            } => {
                return Err(InverseError::Unresolved {
                    nearest: nearest.to_vec(),
                    residual,
                    outside,
                    boxes,
                });
            }
        };
        Ok(match (inside, outside) {
            (None, false) => Preimage::None,
            (Some((y, _)), false) => Preimage::One(y),
            (Some((y, residual)), true) if !self.same(y, q, residual) => Preimage::Two([y, q]),
            (_, true) => Preimage::One(q),
        })
    }

    fn check_size(&self) -> Result<(), InverseError> {
        if self.size <= 1e290 {
            Ok(())
        } else {
            Err(InverseError::TooLarge { size: self.size })
        }
    }

    /// A preimage in the domain.
    fn inside(&self, q: [f64; D]) -> Outcome<D> {
        let Some(cells) = self.reachable(q) else {
            return Outcome::Excluded;
        };
        let first = self.newton(q, q);
        match first {
            Some(end) if self.accepted(&end) => end.found(),
            best => self.search(q, &cells, best),
        }
    }

    /// Whether y, whose image is q but for a residual, is q itself as far as that tells.
    fn same(&self, y: [f64; D], q: [f64; D], residual: f64) -> bool {
        let tolerance = f64::EPSILON * self.size * f64::max(16.0, 4.0 * residual);
        (0..D).all(|c| (y[c] - q[c]).abs() <= tolerance)
    }
}

impl<const D: usize> Lattice<D> {
    /// The points that [`Lattice::deform_point`] moves to `q`: see [`Preimage`], and
    /// [`Inverse`] for the accuracy and the cost. To invert many points, make an
    /// [`Inverse`] once, or call [`Lattice::undo_points`]: here all control points are
    /// looked at each time.
    ///
    /// # Errors
    ///
    /// Those of [`Inverse::point`].
    ///
    /// # Example
    ///
    /// A box of length 2 that is moved by 1 covers what lies to the right of it:
    ///
    /// ```
    /// use ffd_core::{Degree, Frame, Grid, Lattice, Preimage};
    ///
    /// let grid = Grid::new([Degree::LINEAR; 2], [2, 2], Frame::unit())?;
    /// let shift = Lattice::new(grid, vec![[1.0, 0.0]; 9])?;
    /// assert_eq!(shift.inverse_point([1.5, 1.0])?, Preimage::One([0.5, 1.0]));
    /// let two = Preimage::Two([[1.5, 1.0], [2.5, 1.0]]);
    /// assert_eq!(shift.inverse_point([2.5, 1.0])?, two);
    /// assert_eq!(shift.inverse_point([3.5, 1.0])?, Preimage::One([3.5, 1.0]));
    /// assert_eq!(shift.inverse_point([0.5, 1.0])?, Preimage::None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn inverse_point(&self, q: [f64; D]) -> Result<Preimage<D>, InverseError> {
        Inverse::new(self).point(q)
    }
}
