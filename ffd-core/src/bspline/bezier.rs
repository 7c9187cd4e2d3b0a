//! From B-splines to the Bernstein polynomials of one cell.

use super::{axis::Axis, basis::CellBasis, degree::MAX_ORDER};

/// The matrix that turns the control values of a spline in one cell into those of its
/// Bézier form: row i holds the weights of Bézier value i. No weight is negative, and
/// each row adds up to one. Entries beyond the order are zero.
pub(crate) type ToBezier = [[f64; MAX_ORDER]; MAX_ORDER];

/// The matrices of one cell, for splines of the degree of its axis and for their
/// derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BezierTables {
    /// For splines on the axis.
    pub(crate) full: ToBezier,
    /// For splines on the same knots of one degree less: the derivatives.
    pub(crate) slope: ToBezier,
}

impl BezierTables {
    /// Those of every kind of cell: see [`Axis::kind_of_cell`].
    pub(crate) fn of_axis(axis: &Axis) -> Vec<Self> {
        let n = axis.degree().get();
        (0..axis.bases().len())
            .map(|kind| {
                let cell = axis.cell_of_kind(kind);
                let of_degree = |n| to_bezier(n, &CellBasis::new(n, |i| axis.knot(cell, i)));
                Self {
                    full: of_degree(n),
                    slope: of_degree(n - 1),
                }
            })
            .collect()
    }
}

/// Bézier value i is the polar form at n − i zeros and i ones (L. Ramshaw, *Blossoms are
/// polar forms*, Computer Aided Geometric Design 6, 1989).
fn to_bezier(degree: usize, basis: &CellBasis<f64>) -> ToBezier {
    let mut rows = [[0.0; MAX_ORDER]; MAX_ORDER];
    for (i, row) in rows[..=degree].iter_mut().enumerate() {
        let mut arguments = [0.0; MAX_ORDER];
        arguments[degree - i..degree].fill(1.0);
        *row = basis.blossoms(&arguments[..degree], 0.0, 1.0);
    }
    rows
}
