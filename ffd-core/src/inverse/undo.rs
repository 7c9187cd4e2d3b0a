//! Undoing deformations: many points, and sequences of lattices.

use crate::{Lattice, Sequence};

use super::{Inverse, InverseError, Preimage};

/// Inverses that are computed for one point of a sequence at most, besides one for each
/// lattice.
const MOST_STEPS: usize = 1000;

/// What became of points that a deformation was undone for. Indices ascend.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct UndoReport {
    /// Points with two preimages: see [`Preimage::Two`]. They were moved to the first.
    pub two_preimages: Vec<usize>,
    /// Points that are not in the image of the deformation, proven as far as
    /// [`Preimage::None`] is; they were not moved.
    pub not_in_image: Vec<usize>,
    /// Points for which the search gave up ([`InverseError::Unresolved`],
    /// [`InverseError::TooManyWays`]); they were not moved.
    pub unresolved: Vec<usize>,
}

impl UndoReport {
    /// Whether all points were moved to the only preimage there is.
    #[must_use]
    pub fn is_unique(&self) -> bool {
        *self == Self::default()
    }
}

impl<const D: usize> Lattice<D> {
    /// Moves points to where [`Lattice::deform_point`] has moved them from, and reports
    /// those for which that cannot be told: they may have two preimages, or none.
    ///
    /// See [`Inverse`] for accuracy and cost. Points are independent of each other, and
    /// each takes the result of [`Inverse::point`].
    ///
    /// # Errors
    ///
    /// [`InverseError::NonFinitePoint`] and [`InverseError::TooLarge`]; no point is
    /// moved then.
    ///
    /// # Example
    ///
    /// ```
    /// use ffd_core::{Degree, Frame, Grid, Lattice};
    ///
    /// let grid = Grid::new([Degree::CUBIC; 2], [4, 4], Frame::unit())?;
    /// let mut lattice = Lattice::at_rest(grid)?;
    /// lattice.set_displacement(24, [0.5, 0.25])?;
    ///
    /// let points = [[1.0, 1.0], [2.0, 2.5], [9.0, 9.0]];
    /// let mut moved = points.map(|x| lattice.deform_point(x));
    /// let report = lattice.undo_points(&mut moved)?;
    /// assert!(report.is_unique());
    /// for (a, b) in points.iter().zip(moved) {
    ///     assert!((a[0] - b[0]).abs() < 1e-14 && (a[1] - b[1]).abs() < 1e-14);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn undo_points<P>(&self, points: &mut [P]) -> Result<UndoReport, InverseError>
    where
        P: Copy + Into<[f64; D]> + From<[f64; D]>,
    {
        undo(&[Inverse::new(self)], points)
    }
}

impl<const D: usize> Sequence<D> {
    /// The points that [`Sequence::deform_point`] moves to `q`, through the inverses of
    /// the lattices in reverse order.
    ///
    /// Where a lattice has two preimages, both are followed; the one inside its domain
    /// comes first. With more than two ways back, the first two are given. Where a
    /// lattice folds space, only one of its preimages inside the domain is followed:
    /// then [`Preimage::None`] is certain for that one alone.
    ///
    /// # Errors
    ///
    /// Those of [`Inverse::point`], for whichever lattice they occur at: a point in
    /// [`InverseError::Unresolved`] is one that this lattice deforms.
    ///
    /// # Example
    ///
    /// ```
    /// use ffd_core::{Degree, Frame, Grid, Lattice, Preimage, Sequence};
    ///
    /// let grid = Grid::new([Degree::LINEAR; 2], [2, 2], Frame::unit())?;
    /// let right = Lattice::new(grid.clone(), vec![[0.5, 0.0]; 9])?;
    /// let up = Lattice::new(grid, vec![[0.0, 0.5]; 9])?;
    /// let sequence = Sequence::new(vec![right, up]);
    /// assert_eq!(sequence.deform_point([1.0, 0.5]), [1.5, 1.0]);
    /// assert_eq!(sequence.inverse_point([1.5, 1.0])?, Preimage::One([1.0, 0.5]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn inverse_point(&self, q: [f64; D]) -> Result<Preimage<D>, InverseError> {
        check_points(&[q])?;
        back(&self.inverses(), q, &mut 0)
    }

    /// Moves points to where [`Sequence::deform_point`] has moved them from: see
    /// [`Lattice::undo_points`] and [`Sequence::inverse_point`].
    ///
    /// # Errors
    ///
    /// [`InverseError::NonFinitePoint`] and [`InverseError::TooLarge`]; no point is
    /// moved then.
    pub fn undo_points<P>(&self, points: &mut [P]) -> Result<UndoReport, InverseError>
    where
        P: Copy + Into<[f64; D]> + From<[f64; D]>,
    {
        undo(&self.inverses(), points)
    }

    fn inverses(&self) -> Vec<Inverse<'_, D>> {
        self.lattices().iter().map(Inverse::new).collect()
    }
}

/// Moves points back through the inverses of lattices that were applied in order.
fn undo<P, const D: usize>(
    inverses: &[Inverse<'_, D>],
    points: &mut [P],
) -> Result<UndoReport, InverseError>
where
    P: Copy + Into<[f64; D]> + From<[f64; D]>,
{
    check_points(points)?;
    for inverse in inverses {
        inverse.check_size()?;
    }
    let mut report = UndoReport::default();
    for (index, point) in points.iter_mut().enumerate() {
        match back(inverses, (*point).into(), &mut 0) {
            Ok(Preimage::None) => report.not_in_image.push(index),
            Ok(Preimage::One(before)) => *point = before.into(),
            Ok(Preimage::Two([before, _])) => {
                *point = before.into();
                report.two_preimages.push(index);
            }
            Err(InverseError::Unresolved { .. } | InverseError::TooManyWays { .. }) => {
                report.unresolved.push(index);
            }
            Err(error) => return Err(error),
        }
    }
    Ok(report)
}

fn check_points<P, const D: usize>(points: &[P]) -> Result<(), InverseError>
where
    P: Copy + Into<[f64; D]>,
{
    for (index, &point) in points.iter().enumerate() {
        let point: [f64; D] = point.into();
        if let Some(component) = point.iter().position(|c| !c.is_finite()) {
            return Err(InverseError::NonFinitePoint {
                index,
                component,
                value: point[component],
            });
        }
    }
    Ok(())
}

/// The way back through several lattices, the last one first. `steps` counts those that
/// were taken: with two ways at each lattice there are exponentially many.
fn back<const D: usize>(
    inverses: &[Inverse<'_, D>],
    q: [f64; D],
    steps: &mut usize,
) -> Result<Preimage<D>, InverseError> {
    let Some((last, before)) = inverses.split_last() else {
        return Ok(Preimage::One(q));
    };
    match last.point(q)? {
        Preimage::None => Ok(Preimage::None),
        Preimage::One(point) => back(before, point, steps),
        Preimage::Two([inside, outside]) => {
            let first = back(before, inside, steps)?;
            if matches!(first, Preimage::Two(_)) {
                return Ok(first);
            }
            // The first way back costs one step for each lattice; others are counted.
            *steps += before.len();
            if *steps > MOST_STEPS {
                return Err(InverseError::TooManyWays { steps: MOST_STEPS });
            }
            let second = back(before, outside, steps)?;
            Ok(match (first.point(), second.point()) {
                (Some(a), Some(b)) => Preimage::Two([a, b]),
                (None, _) => second,
                (_, None) => first,
            })
        }
    }
}
