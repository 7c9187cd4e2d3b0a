//! One axis of a lattice: degree, cells and knots.

use super::{
    basis::CellBasis,
    degree::{Degree, MAX_ORDER},
};
use crate::FfdError;

/// Where the knots of an axis lie.
///
/// Inside the lattice they are at the integers, one between any two cells; the kinds
/// differ at the ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Knots {
    /// The integers go on beyond the ends: every basis function is a copy of the
    /// others. Control points near an end rest outside the box (except for degree 1).
    #[default]
    Uniform,
    /// The first and the last knot are repeated `degree` times more: the outermost
    /// control points rest on the ends and move them by just as much as themselves.
    /// With one cell, these are the Bernstein polynomials: a Bézier axis.
    Clamped,
}

/// One axis of a lattice: a B-spline basis over the interval `[0, cells]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    degree: Degree,
    cells: usize,
    knots: Knots,
    /// The constants of every kind of cell: see [`Axis::kind_of_cell`].
    bases: Vec<CellBasis<f64>>,
}

impl Axis {
    /// An axis with the given number of cells.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NoCells`] (of axis 0) if there are none;
    /// * [`FfdError::TooManyControlPoints`] if they cannot be told apart in lattice
    ///   coordinates: from 2⁵² on.
    pub fn new(degree: Degree, cells: usize, knots: Knots) -> Result<Self, FfdError> {
        if cells == 0 {
            return Err(FfdError::NoCells { axis: 0 });
        }
        if cells as u64 >= 1 << 52 {
            return Err(FfdError::TooManyControlPoints { cells: vec![cells] });
        }
        let mut axis = Self {
            degree,
            cells,
            knots,
            bases: Vec::new(),
        };
        let n = degree.get();
        axis.bases = (0..axis.kinds_of_cells())
            .map(|kind| {
                let cell = axis.cell_of_kind(kind);
                CellBasis::new(n, |i| axis.knot(cell, i))
            })
            .collect();
        Ok(axis)
    }

    /// The degree of the polynomials.
    #[must_use]
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// Where the knots lie.
    #[must_use]
    pub fn knots(&self) -> Knots {
        self.knots
    }

    /// The number of control points: cells plus degree.
    #[must_use]
    pub fn control_point_count(&self) -> usize {
        self.cells + self.degree.get()
    }

    /// The coordinate at which control point `index` rests: the Greville abscissa, the
    /// mean of the `degree` knots inside the support of its basis function. With all
    /// control points at rest the spline is the identity. For uniform knots this is
    /// `index − (degree − 1) / 2`.
    ///
    /// # Panics
    ///
    /// If there is no such control point.
    #[must_use]
    pub fn rest_coordinate(&self, index: usize) -> f64 {
        let count = self.control_point_count();
        assert!(
            index < count,
            "control point {index} of {count} does not exist"
        );
        let n = self.degree.get();
        match self.knots {
            Knots::Uniform => index as f64 - 0.5 * (n - 1) as f64,
            Knots::Clamped => {
                let sum: f64 = (0..n)
                    .map(|i| (index + i + 1).saturating_sub(n).min(self.cells) as f64)
                    .sum();
                sum / n as f64
            }
        }
    }

    /// Writes the basis functions of a cell and their derivatives to `out`.
    ///
    /// `t` is the position within the cell, from 0 to 1; outside, the polynomials are
    /// continued. Row k of `out` receives the k-th derivatives with respect to `t`, row
    /// 0 the values; there are at most three rows. Column j belongs to control point
    /// `cell + j`; columns beyond the degree become zero.
    ///
    /// # Panics
    ///
    /// If there is no such cell.
    ///
    /// # Example
    ///
    /// The quadratic functions in the middle of a cell:
    ///
    /// ```
    /// use ffd_core::{Axis, Degree, Knots, MAX_ORDER};
    ///
    /// let mut basis = [[f64::NAN; MAX_ORDER]; 2];
    /// let axis = Axis::new(Degree::QUADRATIC, 4, Knots::Uniform)?;
    /// axis.basis(1, 0.5, &mut basis);
    /// assert_eq!(basis[0][..3], [0.125, 0.75, 0.125]);
    /// assert_eq!(basis[1][..3], [-0.5, 0.0, 0.5]);
    /// # Ok::<(), ffd_core::FfdError>(())
    /// ```
    pub fn basis<const ROWS: usize>(
        &self,
        cell: usize,
        t: f64,
        out: &mut [[f64; MAX_ORDER]; ROWS],
    ) {
        const { assert!(ROWS <= 3, "there are values and two derivatives") };
        assert!(
            cell < self.cells,
            "cell {cell} of {} does not exist",
            self.cells
        );
        let basis = &self.bases[self.kind_of_cell(cell)];
        let n = self.degree.get();
        let [values, slopes] = basis.values_and_slopes(n, t, 0.0, 1.0);
        let rows = [values, slopes, basis.curvatures(n, t, 0.0, 1.0)];
        out.copy_from_slice(&rows[..ROWS]);
    }

    /// Knot `i`, counted from the beginning of a cell, in cell lengths from there.
    pub(crate) fn knot(&self, cell: usize, i: isize) -> f64 {
        let cell = cell.cast_signed();
        match self.knots {
            Knots::Uniform => i as f64,
            Knots::Clamped => ((cell + i).clamp(0, self.cells.cast_signed()) - cell) as f64,
        }
    }

    /// The constants of every kind of cell.
    pub(crate) fn bases(&self) -> &[CellBasis<f64>] {
        &self.bases
    }

    /// Cells with the same knots around are of the same kind: all cells of a uniform
    /// axis, and all of a clamped one that are `degree − 1` cells away from both ends.
    #[inline]
    pub(crate) fn kind_of_cell(&self, cell: usize) -> usize {
        if self.bases.len() == 1 {
            return 0;
        }
        let near = self.near_an_end();
        if cell < near {
            cell
        } else {
            // Counted from the end there are as many again.
            let last = self.kinds_of_cells() - 1;
            last - (self.cells - 1 - cell).min(last - near)
        }
    }

    fn kinds_of_cells(&self) -> usize {
        (2 * self.near_an_end() + 1).min(self.cells)
    }

    /// A cell of a kind.
    pub(crate) fn cell_of_kind(&self, kind: usize) -> usize {
        if kind <= self.near_an_end() {
            kind
        } else {
            self.cells - (self.kinds_of_cells() - kind)
        }
    }

    /// How many cells at each end see the repeated knots there.
    fn near_an_end(&self) -> usize {
        match self.knots {
            Knots::Uniform => 0,
            Knots::Clamped => (self.degree.get() - 1).min(self.cells - 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn axes() -> impl Strategy<Value = Axis> {
        let knots = prop_oneof![Just(Knots::Uniform), Just(Knots::Clamped)];
        (1_usize..=5, 1_usize..=12, knots)
            .prop_map(|(n, cells, knots)| Axis::new(Degree::new(n).unwrap(), cells, knots).unwrap())
    }

    /// Knot `i` of an axis, counted from the beginning of the axis.
    fn knot(axis: &Axis, i: isize) -> f64 {
        axis.knot(0, i)
    }

    /// The textbook recursion, with the convention 0/0 = 0: the function of degree `p`
    /// whose support begins at knot `i`, within the cell that begins at knot `cell`.
    fn cox_de_boor(axis: &Axis, cell: isize, i: isize, p: isize, u: f64) -> f64 {
        if p == 0 {
            return f64::from(u8::from(i == cell));
        }
        let part = |numerator: f64, denominator: f64, i| {
            if denominator > 0.0 {
                numerator / denominator * cox_de_boor(axis, cell, i, p - 1, u)
            } else {
                0.0
            }
        };
        part(u - knot(axis, i), knot(axis, i + p) - knot(axis, i), i)
            + part(
                knot(axis, i + p + 1) - u,
                knot(axis, i + p + 1) - knot(axis, i + 1),
                i + 1,
            )
    }

    /// Roundings in one value: on each of at most five levels a product of three
    /// factors, two of them rounded, and a sum.
    const VALUE_TOLERANCE: f64 = 5.0 * 6.0 * f64::EPSILON;

    proptest! {
        /// Function j of a cell is the B-spline whose support begins n − j knots before.
        #[test]
        fn values_are_those_of_the_cox_de_boor_recursion(
            axis in axes(),
            cell in 0.0..1.0_f64,
            t in 0.0..=1.0_f64,
        ) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 12")]
            let cell = (cell * axis.cells() as f64) as usize;
            let n = axis.degree().get();
            let mut basis = [[f64::NAN; MAX_ORDER]; 1];
            axis.basis(cell, t, &mut basis);
            let (values, beyond) = basis[0].split_at(n + 1);
            for (j, value) in values.iter().enumerate() {
                let begin = (cell + j).cast_signed() - n.cast_signed();
                let u = t + cell as f64;
                let expected =
                    cox_de_boor(&axis, cell.cast_signed(), begin, n.cast_signed(), u);
                // t + cell is rounded: an error of at most 8 ε in the argument, where
                // slopes are at most the degree.
                let tolerance = 2.0 * VALUE_TOLERANCE + 8.0 * 5.0 * f64::EPSILON;
                prop_assert!((value - expected).abs() <= tolerance);
            }
            prop_assert!(beyond.iter().all(|b| b.to_bits() == 0));
        }

        /// The functions are not negative and add up to one, hence all their
        /// derivatives add up to zero.
        #[test]
        fn partition_of_unity(axis in axes(), cell in 0_usize..12, t in 0.0..=1.0_f64) {
            let mut basis = [[f64::NAN; MAX_ORDER]; 3];
            axis.basis(cell % axis.cells(), t, &mut basis);
            prop_assert!(basis[0].iter().all(|&b| b >= 0.0));
            let sums = basis.map(|row| row.iter().sum::<f64>());
            // Five additions; differences of functions of a lower degree, times at most
            // the degree for each derivative and doubled by the difference.
            let tolerance = VALUE_TOLERANCE + 5.0 * f64::EPSILON;
            prop_assert!((sums[0] - 1.0).abs() <= tolerance);
            prop_assert!(sums[1].abs() <= 10.0 * tolerance);
            prop_assert!(sums[2].abs() <= 100.0 * tolerance);
        }

        /// Each row is the derivative of the row before, by central differences.
        #[test]
        fn derivatives_are_the_limit_of_differences(
            axis in axes(),
            cell in 0_usize..12,
            t in 0.001..0.999_f64,
        ) {
            let h = 1e-4;
            let mut at = [[[f64::NAN; MAX_ORDER]; 3]; 3];
            for (rows, t) in at.iter_mut().zip([t - h, t, t + h]) {
                axis.basis(cell % axis.cells(), t, rows);
            }
            // A k-th derivative is a sum of values ≤ 1 with at most (2 · 5)ᵏ as the sum
            // of the absolute factors: fourth derivatives stay below 5 · 4 · 3 · 2 · 2⁴,
            // so the formula is off by h²/6 of that. Rounding of a value or slope is
            // divided by h; t ± h is rounded too, where slopes are at most 80.
            let tolerance = h * h / 6.0 * 1920.0
                + (20.0 * VALUE_TOLERANCE + 80.0 * f64::EPSILON) / h;
            let [low, middle, high] = at;
            for k in 0..2 {
                for j in 0..MAX_ORDER {
                    let slope = (high[k][j] - low[k][j]) / (2.0 * h);
                    prop_assert!((slope - middle[k + 1][j]).abs() <= tolerance);
                }
            }
        }

        /// With control points at rest a spline is the identity.
        #[test]
        fn rest_coordinates_reproduce_the_position(
            axis in axes(),
            cell in 0_usize..12,
            t in 0.0..=1.0_f64,
        ) {
            let cell = cell % axis.cells();
            let mut basis = [[f64::NAN; MAX_ORDER]; 2];
            axis.basis(cell, t, &mut basis);
            let sum = |row: [f64; MAX_ORDER]| -> f64 {
                (0..=axis.degree().get())
                    .map(|j| row[j] * axis.rest_coordinate(cell + j))
                    .sum()
            };
            // Coordinates are below 15; 6 products and sums; slopes add up to at most
            // 2 · 5 in absolute value.
            let tolerance = 15.0 * (VALUE_TOLERANCE + 8.0 * f64::EPSILON);
            prop_assert!((sum(basis[0]) - (cell as f64 + t)).abs() <= tolerance);
            prop_assert!((sum(basis[1]) - 1.0).abs() <= 10.0 * tolerance);
        }
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "these values are exact")]
    fn one_clamped_cell_has_the_bernstein_polynomials() {
        let axis = Axis::new(Degree::CUBIC, 1, Knots::Clamped).unwrap();
        let mut basis = [[f64::NAN; MAX_ORDER]; 1];
        axis.basis(0, 0.5, &mut basis);
        assert_eq!(basis[0], [0.125, 0.375, 0.375, 0.125, 0.0, 0.0]);
        let rest: Vec<f64> = (0..4).map(|i| axis.rest_coordinate(i) * 3.0).collect();
        assert_eq!(rest, [0.0, 1.0, 2.0, 3.0]);
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "these values are exact")]
    fn second_derivatives_of_a_line_vanish() {
        let axis = Axis::new(Degree::LINEAR, 1, Knots::Uniform).unwrap();
        let mut basis = [[f64::NAN; MAX_ORDER]; 3];
        axis.basis(0, 0.25, &mut basis);
        assert_eq!(basis[0][..2], [0.75, 0.25]);
        assert_eq!(basis[1][..2], [-1.0, 1.0]);
        assert_eq!(basis[2], [0.0; MAX_ORDER]);
    }

    #[test]
    fn an_axis_has_cells() {
        let error = Axis::new(Degree::CUBIC, 0, Knots::Uniform).unwrap_err();
        assert_eq!(error, FfdError::NoCells { axis: 0 });
    }
}
