//! The lattice of control points.

use crate::bspline::{Degree, rest_coordinate};
use crate::{FfdError, Frame};

/// A uniform B-spline lattice in `D` = 2 or 3 dimensions.
///
/// The deformation is `x ↦ x + Σ Bᵢ(x) dᵢ` with one world vector `dᵢ` per control
/// point; see the [crate documentation](crate) for the order of control points.
/// A value of this type is always valid: shapes fit and every number is finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice<const D: usize> {
    degree: [Degree; D],
    cells: [usize; D],
    frame: Frame<D>,
    displacements: Vec<[f64; D]>,
}

impl<const D: usize> Lattice<D> {
    /// A lattice with the given displacements, in linear order and world units.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NoCells`] if `cells` contains a zero;
    /// * [`FfdError::TooManyControlPoints`] if their number overflows;
    /// * [`FfdError::DisplacementCount`] if there is not one displacement per
    ///   control point, `Π (cells + degree)` in all;
    /// * [`FfdError::NonFiniteDisplacement`].
    pub fn new(
        degree: [Degree; D],
        cells: [usize; D],
        frame: Frame<D>,
        displacements: Vec<[f64; D]>,
    ) -> Result<Self, FfdError> {
        let expected = count_control_points(degree, cells)?;
        if displacements.len() != expected {
            return Err(FfdError::DisplacementCount {
                expected,
                found: displacements.len(),
            });
        }
        let components = displacements.as_flattened().iter().enumerate();
        for (i, &value) in components {
            if !value.is_finite() {
                return Err(FfdError::NonFiniteDisplacement {
                    control_point: i / D,
                    component: i % D,
                    value,
                });
            }
        }
        Ok(Self {
            degree,
            cells,
            frame,
            displacements,
        })
    }

    /// A lattice whose control points are all where they rest: the identity.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NoCells`] if `cells` contains a zero;
    /// * [`FfdError::TooManyControlPoints`] if memory does not suffice.
    pub fn at_rest(
        degree: [Degree; D],
        cells: [usize; D],
        frame: Frame<D>,
    ) -> Result<Self, FfdError> {
        let count = count_control_points(degree, cells)?;
        let mut displacements = Vec::new();
        displacements
            .try_reserve_exact(count)
            .map_err(|_| too_many(cells))?;
        displacements.resize(count, [0.0; D]);
        Ok(Self {
            degree,
            cells,
            frame,
            displacements,
        })
    }

    /// The degree along each axis.
    #[must_use]
    pub fn degree(&self) -> [Degree; D] {
        self.degree
    }

    /// The number of cells along each axis.
    #[must_use]
    pub fn cells(&self) -> [usize; D] {
        self.cells
    }

    /// Where the lattice lies in the world.
    #[must_use]
    pub fn frame(&self) -> &Frame<D> {
        &self.frame
    }

    /// The displacement of each control point from rest, a world vector, in
    /// linear order.
    #[must_use]
    pub fn displacements(&self) -> &[[f64; D]] {
        &self.displacements
    }

    /// The number of control points.
    #[must_use]
    pub fn control_point_count(&self) -> usize {
        self.displacements.len()
    }

    /// The number of control points along each axis: cells plus degree.
    #[must_use]
    pub fn control_points_per_axis(&self) -> [usize; D] {
        std::array::from_fn(|axis| self.cells[axis] + self.degree[axis].get())
    }

    /// The world position at which the control point with the given linear
    /// index rests.
    ///
    /// Control points near the border rest outside the box, except for degree 1.
    ///
    /// # Panics
    ///
    /// If there is no such control point.
    #[must_use]
    pub fn rest_position(&self, control_point: usize) -> [f64; D] {
        let count = self.control_point_count();
        assert!(
            control_point < count,
            "control point {control_point} of {count} does not exist"
        );
        let mut rest = control_point;
        let per_axis = self.control_points_per_axis();
        self.frame.to_world(std::array::from_fn(|axis| {
            let index = rest % per_axis[axis];
            rest /= per_axis[axis];
            rest_coordinate(self.degree[axis], index)
        }))
    }
}

/// The product of cells plus degree, if that many displacements fit into the
/// address space.
fn count_control_points<const D: usize>(
    degree: [Degree; D],
    cells: [usize; D],
) -> Result<usize, FfdError> {
    if let Some(axis) = cells.iter().position(|&n| n == 0) {
        return Err(FfdError::NoCells { axis });
    }
    let count = degree
        .iter()
        .zip(cells)
        .try_fold(1_usize, |count, (degree, n)| {
            count.checked_mul(n.checked_add(degree.get())?)
        });
    count
        .filter(|count| {
            count
                .checked_mul(size_of::<[f64; D]>())
                .is_some_and(|bytes| isize::try_from(bytes).is_ok())
        })
        .ok_or_else(|| too_many(cells))
}

fn too_many<const D: usize>(cells: [usize; D]) -> FfdError {
    FfdError::TooManyControlPoints {
        cells: cells.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBIC: [Degree; 2] = [Degree::CUBIC; 2];

    #[test]
    #[expect(
        clippy::float_cmp,
        reason = "sums and products of small integers are exact"
    )]
    fn control_points_are_counted_and_placed_in_linear_order() {
        let frame = Frame::new([100.0, 0.0], [[10.0, 0.0], [0.0, 1.0]]).unwrap();
        let lattice = Lattice::at_rest([Degree::LINEAR, Degree::CUBIC], [2, 1], frame).unwrap();
        assert_eq!(lattice.control_points_per_axis(), [3, 4]);
        assert_eq!(lattice.control_point_count(), 12);
        assert_eq!(lattice.rest_position(0), [100.0, -1.0]);
        assert_eq!(lattice.rest_position(2), [120.0, -1.0]);
        assert_eq!(lattice.rest_position(3), [100.0, 0.0]);
        assert_eq!(lattice.rest_position(11), [120.0, 2.0]);
    }

    #[test]
    fn bad_shapes_are_named() {
        let frame = Frame::unit();
        assert_eq!(
            Lattice::at_rest(CUBIC, [3, 0], frame),
            Err(FfdError::NoCells { axis: 1 })
        );
        for cells in [
            [usize::MAX, 1],
            [usize::MAX / 2, 2],
            [1 << 40, 1 << 40],
            [1 << 55, 1],
        ] {
            let error = FfdError::TooManyControlPoints {
                cells: cells.to_vec(),
            };
            assert_eq!(Lattice::at_rest(CUBIC, cells, frame), Err(error.clone()));
            assert!(Lattice::new(CUBIC, cells, frame, Vec::new()).is_err());
        }
        assert_eq!(
            Lattice::new(CUBIC, [1, 1], frame, vec![[0.0; 2]; 15]),
            Err(FfdError::DisplacementCount {
                expected: 16,
                found: 15
            })
        );
    }

    #[test]
    fn a_displacement_that_is_not_finite_is_named() {
        let mut displacements = vec![[0.0; 2]; 16];
        displacements[7][1] = f64::INFINITY;
        assert_eq!(
            Lattice::new(CUBIC, [1, 1], Frame::unit(), displacements),
            Err(FfdError::NonFiniteDisplacement {
                control_point: 7,
                component: 1,
                value: f64::INFINITY
            })
        );
    }
}
