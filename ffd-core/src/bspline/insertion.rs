//! Knot insertion along one axis: the same spline with every cell cut into equal parts.

use super::{axis::Axis, degree::MAX_ORDER};

/// How the control points of a finer axis follow from those of a coarser one.
///
/// The value of a new control point is the polar form of the spline at the knots inside
/// the support of its basis function (L. Ramshaw, *Blossoms are polar forms*, Computer
/// Aided Geometric Design 6, 1989), taken from a cell in the middle of that support.
#[derive(Debug)]
pub(crate) struct Insertion {
    coarse: Axis,
    fine: Axis,
    factor: usize,
}

impl Insertion {
    /// From `coarse` to `fine`, which must have the same degree and kind of knots and
    /// `factor` times as many cells.
    pub(crate) fn new(coarse: Axis, fine: Axis, factor: usize) -> Self {
        debug_assert_eq!(coarse.cells() * factor, fine.cells());
        Self {
            coarse,
            fine,
            factor,
        }
    }

    /// The first old control point that new one `j` depends on, and the weights of
    /// those from there on.
    pub(crate) fn row(&self, j: usize) -> (usize, [f64; MAX_ORDER]) {
        let (fine, factor) = (&self.fine, self.factor);
        let n = fine.degree().get();
        // The basis function of control point j lives on cells j − n to j.
        let fine_cell = j.saturating_sub(n.div_ceil(2)).min(fine.cells() - 1);
        let cell = fine_cell / factor;
        let mut knots = [0.0; MAX_ORDER - 1];
        for (i, knot) in knots[..n].iter_mut().enumerate() {
            let from_fine_cell = (j + i + 1).cast_signed() - (n + fine_cell).cast_signed();
            let position = (fine_cell % factor) as f64 + fine.knot(fine_cell, from_fine_cell);
            *knot = position / factor as f64;
        }
        let basis = &self.coarse.bases()[self.coarse.kind_of_cell(cell)];
        (cell, basis.blossoms(&knots[..n], 0.0, 1.0))
    }
}
