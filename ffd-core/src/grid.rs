//! The shape of a lattice: everything but its displacements.

use crate::bspline::{Axis, CellBasis, Degree, Knots};
use crate::{FfdError, Frame};

/// What lies around a lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Border {
    /// Nothing: the deformation ends abruptly at the box.
    #[default]
    Free,
    /// `degree` further layers of fixed control points on each side (the phantom points
    /// of \[GD01\]): the box grows by `degree` cells a side, at its border the
    /// deformation joins the identity as smoothly as two cells join each other, and all
    /// control points of the lattice itself stay free. Needs uniform knots.
    Identity,
}

/// A grid of cells with B-splines of some degree along each axis: a lattice without its
/// displacements.
///
/// See the [crate documentation](crate) for the order of control points. `D` is 2 or 3.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<const D: usize> {
    axes: [Axis; D],
    frame: Frame<D>,
    border: Border,
}

/// Where a point is: its cell, and its position within, from 0 to 1 along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Location<const D: usize> {
    /// Counted from the first cell of the domain: with an identity border, `degree`
    /// cells before the lattice's own.
    pub(crate) cell: [usize; D],
    pub(crate) t: [f64; D],
}

impl<const D: usize> Grid<D> {
    /// A grid with uniform knots and nothing around.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NoCells`] if `cells` contains a zero;
    /// * [`FfdError::TooManyControlPoints`] if a displacement for each would not fit
    ///   into memory.
    pub fn new(degree: [Degree; D], cells: [usize; D], frame: Frame<D>) -> Result<Self, FfdError> {
        Self::assemble(degree, cells, [Knots::Uniform; D], frame, Border::Free)
    }

    /// One clamped cell: Bernstein polynomials over the whole box, the lattice of
    /// Sederberg and Parry, with `degree + 1` control points per axis.
    ///
    /// # Errors
    ///
    /// None in practice; the signature is that of the other constructors.
    pub fn bezier(degree: [Degree; D], frame: Frame<D>) -> Result<Self, FfdError> {
        Self::assemble(degree, [1; D], [Knots::Clamped; D], frame, Border::Free)
    }

    /// The same grid with other knots.
    ///
    /// # Errors
    ///
    /// [`FfdError::ClampedBorder`] if an axis becomes clamped and the grid has an
    /// identity border.
    pub fn with_knots(self, knots: [Knots; D]) -> Result<Self, FfdError> {
        Self::assemble(self.degree(), self.cells(), knots, self.frame, self.border)
    }

    /// The same grid with another border.
    ///
    /// # Errors
    ///
    /// [`FfdError::ClampedBorder`] if the border is the identity and an axis is clamped.
    pub fn with_border(self, border: Border) -> Result<Self, FfdError> {
        Self::assemble(
            self.degree(),
            self.cells(),
            self.knots(),
            self.frame,
            border,
        )
    }

    /// From all parts.
    pub(crate) fn assemble(
        degree: [Degree; D],
        cells: [usize; D],
        knots: [Knots; D],
        frame: Frame<D>,
        border: Border,
    ) -> Result<Self, FfdError> {
        if let Some(axis) = cells.iter().position(|&n| n == 0) {
            return Err(FfdError::NoCells { axis });
        }
        if border == Border::Identity
            && let Some(axis) = knots.iter().position(|&k| k == Knots::Clamped)
        {
            return Err(FfdError::ClampedBorder { axis });
        }
        // All control points, with those of a border, so that no later sum overflows.
        let fits = degree
            .iter()
            .zip(cells)
            .try_fold(1_usize, |count, (n, cells)| {
                count.checked_mul(cells.checked_add(3 * n.get())?)
            });
        fits.and_then(|count| count.checked_mul(size_of::<[f64; D]>()))
            .filter(|&bytes| isize::try_from(bytes).is_ok())
            .ok_or_else(|| FfdError::TooManyControlPoints {
                cells: cells.to_vec(),
            })?;
        let mut axes = Vec::with_capacity(D);
        for axis in 0..D {
            axes.push(Axis::new(degree[axis], cells[axis], knots[axis])?);
        }
        Ok(Self {
            axes: axes.try_into().expect("one for each dimension"),
            frame,
            border,
        })
    }

    /// The axes.
    #[must_use]
    pub fn axes(&self) -> &[Axis; D] {
        &self.axes
    }

    /// The degree along each axis.
    #[must_use]
    pub fn degree(&self) -> [Degree; D] {
        self.axes.each_ref().map(Axis::degree)
    }

    /// The number of cells along each axis, without those of an identity border.
    #[must_use]
    pub fn cells(&self) -> [usize; D] {
        self.axes.each_ref().map(Axis::cells)
    }

    /// The knots along each axis.
    #[must_use]
    pub fn knots(&self) -> [Knots; D] {
        self.axes.each_ref().map(Axis::knots)
    }

    /// Where the grid lies in the world.
    #[must_use]
    pub fn frame(&self) -> &Frame<D> {
        &self.frame
    }

    /// What lies around it.
    #[must_use]
    pub fn border(&self) -> Border {
        self.border
    }

    /// The number of control points along each axis: cells plus degree. The fixed ones
    /// of an identity border do not count.
    #[must_use]
    pub fn control_points_per_axis(&self) -> [usize; D] {
        self.axes.each_ref().map(Axis::control_point_count)
    }

    /// The number of control points.
    #[must_use]
    pub fn control_point_count(&self) -> usize {
        self.control_points_per_axis().iter().product()
    }

    /// The linear index of the control point with the given index along each axis.
    ///
    /// # Panics
    ///
    /// If there is no such control point.
    #[must_use]
    pub fn control_point(&self, indices: [usize; D]) -> usize {
        let per_axis = self.control_points_per_axis();
        let inside = indices.iter().zip(per_axis).all(|(&i, n)| i < n);
        assert!(
            inside,
            "control point {indices:?} of {per_axis:?} does not exist"
        );
        (0..D)
            .rev()
            .fold(0, |index, axis| index * per_axis[axis] + indices[axis])
    }

    /// The index along each axis of the control point with the given linear index.
    ///
    /// # Panics
    ///
    /// If there is no such control point.
    #[must_use]
    pub fn control_point_indices(&self, control_point: usize) -> [usize; D] {
        let count = self.control_point_count();
        assert!(
            control_point < count,
            "control point {control_point} of {count} does not exist"
        );
        let mut rest = control_point;
        self.control_points_per_axis().map(|n| {
            let index = rest % n;
            rest /= n;
            index
        })
    }

    /// The world position at which the control point with the given linear index rests.
    ///
    /// With uniform knots, control points near the border rest outside the box, except
    /// for degree 1.
    ///
    /// # Panics
    ///
    /// If there is no such control point.
    #[must_use]
    pub fn rest_position(&self, control_point: usize) -> [f64; D] {
        let indices = self.control_point_indices(control_point);
        self.frame.to_world(std::array::from_fn(|axis| {
            self.axes[axis].rest_coordinate(indices[axis])
        }))
    }

    /// The box on which the deformation is defined, in lattice coordinates: lowest and
    /// highest along each axis. `[0, cells]`, and `degree` more on each side with an
    /// identity border.
    #[must_use]
    pub fn domain(&self) -> [[f64; 2]; D] {
        std::array::from_fn(|axis| {
            let layers = self.layers(axis) as f64;
            [-layers, self.axes[axis].cells() as f64 + layers]
        })
    }

    /// Whether a world point lies in the closed domain. Decided in computed lattice
    /// coordinates: in a frame that rounds, a point on the border may fall on either
    /// side.
    #[must_use]
    pub fn contains(&self, world: [f64; D]) -> bool {
        self.locate(world).is_some()
    }

    /// The largest absolute value of a world coordinate in the domain: the size that
    /// error bounds of this crate refer to.
    #[must_use]
    pub fn size(&self) -> f64 {
        let domain = self.domain();
        let mut size = 0.0_f64;
        for corner in 0..1_usize << D {
            let u = std::array::from_fn(|axis| domain[axis][corner >> axis & 1]);
            for c in self.frame.to_world(u) {
                size = size.max(c.abs());
            }
        }
        size
    }

    /// What differs first from another grid, in the plural; nothing if they are the same.
    pub(crate) fn difference(&self, other: &Self) -> Option<&'static str> {
        if self == other {
            None
        } else if self.degree() != other.degree() {
            Some("degrees")
        } else if self.cells() != other.cells() {
            Some("numbers of cells")
        } else if self.knots() != other.knots() {
            Some("knots")
        } else if self.border() != other.border() {
            Some("borders")
        } else {
            Some("frames")
        }
    }

    /// Fixed layers of control points on each side of an axis, and cells of the domain
    /// before the first of the grid.
    #[inline(always)]
    pub(crate) fn layers(&self, axis: usize) -> usize {
        match self.border {
            Border::Free => 0,
            Border::Identity => self.axes[axis].degree().get(),
        }
    }

    /// Cells of the domain along an axis.
    #[inline(always)]
    pub(crate) fn domain_cells(&self, axis: usize) -> usize {
        self.axes[axis].cells() + 2 * self.layers(axis)
    }

    /// The kind of knots around a cell of the domain: see [`Axis::kind_of_cell`].
    #[inline(always)]
    pub(crate) fn kind_of_cell(&self, axis: usize, cell: usize) -> usize {
        // With a border the knots are uniform, and all cells are of one kind.
        self.axes[axis].kind_of_cell(
            cell.saturating_sub(self.layers(axis))
                .min(self.axes[axis].cells() - 1),
        )
    }

    /// The basis along an axis of the cell where a point is.
    #[inline(always)]
    pub(crate) fn basis(&self, axis: usize, location: &Location<D>) -> &CellBasis<f64> {
        &self.axes[axis].bases()[self.kind_of_cell(axis, location.cell[axis])]
    }

    /// Basis functions that are not zero in a cell, per axis.
    #[inline(always)]
    pub(crate) fn order(&self) -> [usize; D] {
        self.axes.each_ref().map(|axis| axis.degree().order())
    }

    /// Whether all cells of the domain have the same cubic basis along all axes.
    pub(crate) fn is_cubic_everywhere(&self) -> bool {
        let uniform = |axis: &Axis| axis.bases().len() == 1;
        self.order() == [4; D] && self.axes.iter().all(uniform)
    }

    /// The cell of a world point; `None` outside the domain and for points that are not
    /// finite.
    #[inline(always)]
    pub(crate) fn locate(&self, world: [f64; D]) -> Option<Location<D>> {
        self.locate_lattice(self.frame.to_lattice(world))
    }

    /// The same for the nearest point of the domain: coordinates beyond an end are moved
    /// to that end. `None` for points that are not finite.
    pub(crate) fn locate_nearest(&self, world: [f64; D]) -> Option<Location<D>> {
        let domain = self.domain();
        let mut u = self.frame.to_lattice(world);
        for axis in 0..D {
            if u[axis].is_nan() {
                return None;
            }
            u[axis] = u[axis].clamp(domain[axis][0], domain[axis][1]);
        }
        self.locate_lattice(u)
    }

    /// The cell of a point in lattice coordinates.
    #[inline(always)]
    pub(crate) fn locate_lattice(&self, u: [f64; D]) -> Option<Location<D>> {
        let mut location = Location {
            cell: [0; D],
            t: [0.0; D],
        };
        for axis in 0..D {
            let low = self.layers(axis) as f64;
            let cells = self.domain_cells(axis);
            let from_low = u[axis] + low;
            // `u` itself is compared, so that no rounding moves a point inside.
            if !(u[axis] >= -low && u[axis] <= cells as f64 - low) {
                return None;
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between 0 and the number of cells"
            )]
            let cell = (from_low as usize).min(cells - 1);
            location.cell[axis] = cell;
            location.t[axis] = (u[axis] - (cell as f64 - low)).clamp(0.0, 1.0);
        }
        Some(location)
    }
}
