//! The lattice: a grid and the displacements of its control points.

use crate::blend::Block;
use crate::bspline::{Axis, Insertion};
use crate::rows::Rows;
use crate::{FfdError, Grid};

/// A lattice of displaced control points: the deformation `x ↦ x + Σ Bᵢ(x) dᵢ`.
///
/// `dᵢ` is the displacement of control point i from where it rests, a world vector. See
/// the [crate documentation](crate) for the order of control points. A value of this
/// type is always valid: shapes fit and every number is finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice<const D: usize> {
    grid: Grid<D>,
    displacements: Vec<[f64; D]>,
}

impl<const D: usize> Lattice<D> {
    /// A lattice with the given displacements, in linear order and world units.
    ///
    /// # Errors
    ///
    /// * [`FfdError::DisplacementCount`] if there is not one displacement per
    ///   control point, `Π (cells + degree)` in all;
    /// * [`FfdError::NonFiniteDisplacement`].
    pub fn new(grid: Grid<D>, displacements: Vec<[f64; D]>) -> Result<Self, FfdError> {
        check_count(&grid, displacements.len())?;
        for (i, &displacement) in displacements.iter().enumerate() {
            check_finite(i, displacement)?;
        }
        Ok(Self {
            grid,
            displacements,
        })
    }

    /// A lattice whose control points are all where they rest: the identity.
    ///
    /// # Errors
    ///
    /// [`FfdError::TooManyControlPoints`] if memory does not suffice.
    pub fn at_rest(grid: Grid<D>) -> Result<Self, FfdError> {
        let displacements = zeros(grid.control_point_count(), &grid)?;
        Ok(Self {
            grid,
            displacements,
        })
    }

    /// The shape of the lattice.
    #[must_use]
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The displacement of each control point from rest, a world vector, in
    /// linear order.
    #[must_use]
    pub fn displacements(&self) -> &[[f64; D]] {
        &self.displacements
    }

    /// Moves one control point: `displacement` is where it is from where it rests.
    ///
    /// # Errors
    ///
    /// [`FfdError::NonFiniteDisplacement`]; nothing is changed then.
    ///
    /// # Panics
    ///
    /// If there is no such control point.
    pub fn set_displacement(
        &mut self,
        control_point: usize,
        displacement: [f64; D],
    ) -> Result<(), FfdError> {
        check_finite(control_point, displacement)?;
        self.displacements[control_point] = displacement;
        Ok(())
    }

    /// Moves all control points, without allocation.
    ///
    /// # Errors
    ///
    /// As [`Lattice::new`]; nothing is changed then.
    pub fn set_displacements(&mut self, displacements: &[[f64; D]]) -> Result<(), FfdError> {
        check_count(&self.grid, displacements.len())?;
        for (i, &displacement) in displacements.iter().enumerate() {
            check_finite(i, displacement)?;
        }
        self.displacements.copy_from_slice(displacements);
        Ok(())
    }

    /// Adds to the displacements of all control points, without allocation.
    ///
    /// # Errors
    ///
    /// As [`Lattice::new`], for the sums; nothing is changed then.
    pub fn add_displacements(&mut self, changes: &[[f64; D]]) -> Result<(), FfdError> {
        check_count(&self.grid, changes.len())?;
        let sum = |a: [f64; D], b: [f64; D]| std::array::from_fn(|c| a[c] + b[c]);
        for (i, (&old, &change)) in self.displacements.iter().zip(changes).enumerate() {
            check_finite(i, sum(old, change))?;
        }
        for (old, &change) in self.displacements.iter_mut().zip(changes) {
            *old = sum(*old, change);
        }
        Ok(())
    }

    /// The same deformation on a grid with every cell cut into `factors[i]` equal parts
    /// along axis i (knot insertion).
    ///
    /// With an identity border, the fixed layers become thinner; the new lattice has
    /// more cells of its own instead, so that its domain stays the same.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NoCells`] if a factor is zero;
    /// * [`FfdError::TooManyControlPoints`], also if memory does not suffice;
    /// * [`FfdError::AxisLength`] if cells become too short to compute with, and
    ///   [`FfdError::NonFiniteDisplacement`] if displacements are so large that sums
    ///   overflow.
    ///
    /// # Example
    ///
    /// ```
    /// use ffd_core::{Degree, Frame, Grid, Lattice};
    ///
    /// let grid = Grid::new([Degree::CUBIC; 2], [2, 2], Frame::unit())?;
    /// let mut lattice = Lattice::at_rest(grid)?;
    /// lattice.set_displacement(12, [0.5, 0.25])?;
    /// let fine = lattice.refine([2, 2])?;
    /// assert_eq!(fine.grid().cells(), [4, 4]);
    /// let [a, b] = [&lattice, &fine].map(|l| l.deform_point([1.3, 0.7]));
    /// assert!((a[0] - b[0]).abs() < 1e-15 && (a[1] - b[1]).abs() < 1e-15);
    /// # Ok::<(), ffd_core::FfdError>(())
    /// ```
    pub fn refine(&self, factors: [usize; D]) -> Result<Self, FfdError> {
        let grid = &self.grid;
        let too_many = || FfdError::TooManyControlPoints {
            cells: std::iter::zip(grid.cells(), factors)
                .map(|(cells, factor)| cells.saturating_mul(factor))
                .collect(),
        };
        // Cells of the whole domain are cut; with a border, the outermost `degree` on
        // each side are the new border.
        let mut cells = [0; D];
        for axis in 0..D {
            let cut = grid.domain_cells(axis).checked_mul(factors[axis]);
            cells[axis] = cut
                .ok_or_else(too_many)?
                .saturating_sub(2 * grid.layers(axis));
        }
        let axes = grid.frame().axes();
        let finer_axes = std::array::from_fn(|i| axes[i].map(|x| x / factors[i].max(1) as f64));
        let origin = grid.frame().to_world(std::array::from_fn(|axis| {
            let layers = grid.layers(axis) as f64;
            layers / factors[axis].max(1) as f64 - layers
        }));
        if let Some(axis) = factors.iter().position(|&factor| factor == 0) {
            return Err(FfdError::NoCells { axis });
        }
        let frame = crate::Frame::new(origin, finer_axes)?;
        let finer = Grid::assemble(grid.degree(), cells, grid.knots(), frame, grid.border())?;

        let mut per_axis = grid.control_points_per_axis();
        let mut displacements = self.displacements.clone();
        for axis in 0..D {
            displacements =
                self.refine_axis(&finer, axis, factors[axis], per_axis, &displacements)?;
            per_axis[axis] = finer.control_points_per_axis()[axis];
        }
        Self::new(finer, displacements)
    }

    /// Inserts knots along one axis into the values of control points whose number per
    /// axis is given.
    fn refine_axis(
        &self,
        finer: &Grid<D>,
        axis: usize,
        factor: usize,
        per_axis: [usize; D],
        values: &[[f64; D]],
    ) -> Result<Vec<[f64; D]>, FfdError> {
        let grid = &self.grid;
        // The whole domain as an axis of its own, border and all.
        let whole = |grid: &Grid<D>| {
            let own = &grid.axes()[axis];
            Axis::new(own.degree(), grid.domain_cells(axis), own.knots())
        };
        let insertion = Insertion::new(whole(grid)?, whole(finer)?, factor);
        let (layers, finer_layers) = (grid.layers(axis), finer.layers(axis));
        let (old, new) = (per_axis[axis], finer.axes()[axis].control_point_count());

        let stride: usize = per_axis[..axis].iter().product();
        let outer: usize = per_axis[axis + 1..].iter().product();
        let mut out = zeros(stride * new * outer, finer)?;
        for j in 0..new {
            let (first, weights) = insertion.row(j + finer_layers);
            for (m, &weight) in weights[..grid.order()[axis]].iter().enumerate() {
                // Control points of the border do not move.
                let Some(from) = (first + m).checked_sub(layers).filter(|&i| i < old) else {
                    continue;
                };
                for k in 0..outer {
                    for i in 0..stride {
                        let value = values[i + stride * (from + old * k)];
                        let sum = &mut out[i + stride * (j + new * k)];
                        for c in 0..D {
                            sum[c] += weight * value[c];
                        }
                    }
                }
            }
        }
        Ok(out)
    }

    /// The displacements of the control points that act on a cell of the domain; zero
    /// for those of an identity border.
    #[inline(always)]
    pub(crate) fn block(&self, cell: [usize; D]) -> CellBlock<'_, D> {
        let per_axis = self.grid.control_points_per_axis();
        let mut stride = [1; D];
        for axis in 1..D {
            stride[axis] = stride[axis - 1] * per_axis[axis - 1];
        }
        CellBlock {
            displacements: &self.displacements,
            order: self.grid.order(),
            per_axis,
            stride,
            // Wraps around below zero, and then is no control point.
            first: std::array::from_fn(|axis| cell[axis].wrapping_sub(self.grid.layers(axis))),
        }
    }
}

/// See [`Lattice::block`].
#[derive(Clone, Copy)]
pub(crate) struct CellBlock<'a, const D: usize> {
    displacements: &'a [[f64; D]],
    order: [usize; D],
    per_axis: [usize; D],
    stride: [usize; D],
    first: [usize; D],
}

impl<'a, const D: usize> CellBlock<'a, D> {
    /// Where the control point with the given index along an axis is in memory, counted
    /// from the first that acts on the cell; `None` for one of a border.
    #[inline(always)]
    fn offset(&self, axis: usize, index: usize) -> Option<usize> {
        let i = self.first[axis].wrapping_add(index);
        (i < self.per_axis[axis]).then(|| i * self.stride[axis])
    }

    /// The displacement of the control point with the given index along each axis,
    /// counted from the first that acts on the cell.
    pub(crate) fn displacement(&self, index: [usize; D]) -> [f64; D] {
        std::array::from_fn(|c| self.component(index, c))
    }

    /// The displacements where they are in memory; `None` if some are of a border.
    #[inline(always)]
    pub(crate) fn rows(&self) -> Option<Rows<'a>> {
        let mut start = 0;
        for axis in 0..D {
            self.offset(axis, self.order[axis] - 1)?;
            start += self.offset(axis, 0)?;
        }
        Some(Rows {
            components: self.displacements[start..].as_flattened(),
            row: self.stride[1] * D,
            plane: self.stride[D - 1] * D,
        })
    }

    /// Writes all displacements to the beginning of `out`, first axis fastest, and
    /// returns their number of components.
    pub(crate) fn gather<T>(&self, out: &mut [T], convert: impl Fn(f64) -> T) -> usize {
        let row_len = self.order[0] * D;
        let planes = if D == 3 { self.order[D - 1] } else { 1 };
        let whole = self.offset(0, 0).is_some() && self.offset(0, self.order[0] - 1).is_some();
        let rows = out.chunks_exact_mut(row_len);
        let mut count = 0;
        for (number, out) in rows.take(planes * self.order[1]).enumerate() {
            let (j, k) = (number % self.order[1], number / self.order[1]);
            let plane = if D == 3 {
                self.offset(D - 1, k)
            } else {
                Some(0)
            };
            let row = plane.and_then(|plane| Some(plane + self.offset(1, j)?));
            count += row_len;
            if let (Some(row), true) = (row, whole) {
                let row = &self.displacements[row + self.first[0]..][..self.order[0]];
                let row = row.as_flattened();
                // Rows of cubic lattices are short and of known length: without a call.
                if let (Ok(row), Ok(out)) = (
                    <&[f64; 12]>::try_from(row),
                    <&mut [T; 12]>::try_from(&mut *out),
                ) {
                    for (out, &value) in out.iter_mut().zip(row) {
                        *out = convert(value);
                    }
                    continue;
                }
                for (out, &value) in out.iter_mut().zip(row) {
                    *out = convert(value);
                }
                continue;
            }
            for (i, out) in out.chunks_exact_mut(D).enumerate() {
                let at = row.and_then(|row| Some(row + self.offset(0, i)?));
                let value = at.map_or([0.0; D], |at| self.displacements[at]);
                for (out, value) in out.iter_mut().zip(value) {
                    *out = convert(value);
                }
            }
        }
        count
    }
}

impl<const D: usize> Block<f64, D> for CellBlock<'_, D> {
    #[inline(always)]
    fn component(&self, index: [usize; D], component: usize) -> f64 {
        let mut at = 0;
        for axis in 0..D {
            match self.offset(axis, index[axis]) {
                Some(offset) => at += offset,
                None => return 0.0,
            }
        }
        self.displacements[at][component]
    }
}

/// A list of zeros for a grid, if memory suffices.
fn zeros<const D: usize>(count: usize, grid: &Grid<D>) -> Result<Vec<[f64; D]>, FfdError> {
    let mut zeros = Vec::new();
    zeros
        .try_reserve_exact(count)
        .map_err(|_| FfdError::TooManyControlPoints {
            cells: grid.cells().to_vec(),
        })?;
    zeros.resize(count, [0.0; D]);
    Ok(zeros)
}

fn check_count<const D: usize>(grid: &Grid<D>, found: usize) -> Result<(), FfdError> {
    let expected = grid.control_point_count();
    if found == expected {
        Ok(())
    } else {
        Err(FfdError::DisplacementCount { expected, found })
    }
}

fn check_finite<const D: usize>(
    control_point: usize,
    displacement: [f64; D],
) -> Result<(), FfdError> {
    match displacement.iter().position(|c| !c.is_finite()) {
        None => Ok(()),
        Some(component) => Err(FfdError::NonFiniteDisplacement {
            control_point,
            component,
            value: displacement[component],
        }),
    }
}
