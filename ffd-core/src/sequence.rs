//! Lattices applied one after another.

use crate::frame::unit_entry;
use crate::matrix::{Matrix, determinant};
use crate::{Evaluation, FfdError, Lattice, Outside, Scalar};

/// Lattices that are applied in order: what one does to a point is the input of the
/// next. Their grids need not have anything in common.
///
/// Without lattices it is the identity. See [`Sequence::inverse_point`] for the way
/// back.
///
/// # Example
///
/// Twice to the right by half a unit, as long as the point is in the box:
///
/// ```
/// use ffd_core::{Degree, Frame, Grid, Lattice, Sequence};
///
/// let grid = Grid::new([Degree::LINEAR; 2], [2, 2], Frame::unit())?;
/// let shift = Lattice::new(grid, vec![[0.5, 0.0]; 9])?;
/// let sequence = Sequence::new(vec![shift.clone(), shift]);
/// assert_eq!(sequence.deform_point([0.25, 1.0]), [1.25, 1.0]);
/// assert_eq!(sequence.deform_point([1.75, 1.0]), [2.25, 1.0]);
/// # Ok::<(), ffd_core::FfdError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sequence<const D: usize> {
    lattices: Vec<Lattice<D>>,
}

impl<const D: usize> Sequence<D> {
    /// The given lattices, the first to be applied first.
    #[must_use]
    pub fn new(lattices: Vec<Lattice<D>>) -> Self {
        Self { lattices }
    }

    /// Adds a lattice that is applied after the others.
    pub fn push(&mut self, lattice: Lattice<D>) {
        self.lattices.push(lattice);
    }

    /// The lattices, in the order in which they are applied.
    #[must_use]
    pub fn lattices(&self) -> &[Lattice<D>] {
        &self.lattices
    }

    /// The image of a world point. A lattice leaves points outside its domain where
    /// they are, and points that are not finite.
    #[must_use]
    pub fn deform_point(&self, world: [f64; D]) -> [f64; D] {
        let next = |point, lattice: &Lattice<D>| lattice.deform_point(point);
        self.lattices.iter().fold(world, next)
    }

    /// The image of a world point, with a choice of what a lattice does to a point
    /// outside its domain.
    ///
    /// # Errors
    ///
    /// Those of [`Lattice::deform_point_with`], for whichever lattice comes first;
    /// they name the point as that lattice received it.
    pub fn deform_point_with(
        &self,
        world: [f64; D],
        outside: Outside,
    ) -> Result<[f64; D], FfdError> {
        crate::evaluate::check_point(0, world)?;
        let next = |point, lattice: &Lattice<D>| lattice.deform_point_with(point, outside);
        self.lattices.iter().try_fold(world, next)
    }

    /// Deforms points in place: see [`Lattice::deform_points`]. A lattice leaves points
    /// outside its domain where they are; how many lay outside is returned for each
    /// lattice.
    ///
    /// # Errors
    ///
    /// [`FfdError::NonFinitePoint`]. No point is changed if it is one of those given;
    /// a point that a lattice moves out of the range of numbers stops the next one.
    pub fn deform_points<S, P>(&self, points: &mut [P]) -> Result<Vec<usize>, FfdError>
    where
        S: Scalar,
        P: Copy + Into<[S; D]> + From<[S; D]>,
    {
        let deform = |lattice: &Lattice<D>| lattice.deform_points::<S, P>(points, Outside::Keep);
        self.lattices.iter().map(deform).collect()
    }

    /// Image, Jacobian and determinant at a world point, by the chain rule. A lattice
    /// that the point lies outside of contributes the identity.
    ///
    /// `None` for points that are not finite, or that a lattice moves out of the range
    /// of numbers.
    #[must_use]
    pub fn evaluate(&self, world: [f64; D]) -> Option<Evaluation<D>> {
        let mut position = world;
        let mut jacobian: Matrix<D> =
            std::array::from_fn(|r| std::array::from_fn(|c| unit_entry(r, c)));
        for lattice in &self.lattices {
            if let Some(there) = lattice.evaluate(position) {
                position = there.position;
                jacobian = product(&there.jacobian, &jacobian);
            }
        }
        if !position.iter().all(|c| c.is_finite()) {
            return None;
        }
        Some(Evaluation {
            position,
            jacobian,
            determinant: determinant(&jacobian),
        })
    }
}

/// A single lattice, as a sequence of one.
impl<const D: usize> From<Lattice<D>> for Sequence<D> {
    fn from(lattice: Lattice<D>) -> Self {
        Self::new(vec![lattice])
    }
}

fn product<const D: usize>(a: &Matrix<D>, b: &Matrix<D>) -> Matrix<D> {
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let mut sum = a[r][0] * b[0][c];
            for k in 1..D {
                sum += a[r][k] * b[k][c];
            }
            sum
        })
    })
}
