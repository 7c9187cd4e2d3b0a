//! The matrix B of basis functions: a row for each constraint, a column for each control
//! point that may move.

use super::sparse::SparseRows;
use crate::{Grid, MAX_ORDER, grid::Location};

/// The matrix B, or some rows of it.
pub(super) struct Rows {
    pub(super) matrix: SparseRows,
    /// The Euclidean norm of each row.
    pub(super) norms: Vec<f64>,
    /// The control point of each column.
    pub(super) control_points: Vec<usize>,
}

/// Gathers rows.
pub(super) struct RowBuilder<'a, const D: usize> {
    grid: &'a Grid<D>,
    /// For each control point its column, [`FIXED`], or [`UNUSED`].
    columns: Vec<usize>,
    rows: Rows,
}

/// Of a control point that must not move.
const FIXED: usize = usize::MAX;
/// Of a control point that is in no row so far.
const UNUSED: usize = usize::MAX - 1;

/// The basis functions of a point along one axis that are not zero, of control points
/// that exist: those of an identity border do not move and are left out.
#[derive(Clone, Copy)]
struct Window {
    first: usize,
    weights: [f64; MAX_ORDER],
    len: usize,
}

impl<'a, const D: usize> RowBuilder<'a, D> {
    /// With room for some rows. The `fixed` control points must exist.
    pub(super) fn new(grid: &'a Grid<D>, fixed: &[usize], row_count: usize) -> Self {
        let mut columns = vec![UNUSED; grid.control_point_count()];
        for &control_point in fixed {
            columns[control_point] = FIXED;
        }
        let most: usize = grid.order().iter().product();
        Self {
            grid,
            columns,
            rows: Rows {
                matrix: SparseRows::with_capacity(row_count, row_count * most),
                norms: Vec::with_capacity(row_count),
                control_points: Vec::with_capacity(most),
            },
        }
    }

    /// Adds the row of a point, if its norm is at least `smallest`. Returns its norm.
    pub(super) fn push(&mut self, location: &Location<D>, smallest: f64) -> f64 {
        let windows: [Window; D] = std::array::from_fn(|axis| self.window(axis, location));
        let [x, y] = [windows[0], windows[1]];
        let z = if D == 3 { windows[2] } else { Window::one() };
        let [nx, ny] = [0, 1].map(|axis| self.grid.axes()[axis].control_point_count());
        // An upper bound that ignores fixed control points; without them, the norm.
        let bound = x.norm() * y.norm() * z.norm();
        if bound < smallest {
            return bound;
        }
        let rows = &mut self.rows;
        let known = rows.control_points.len();
        for k in 0..z.len {
            for j in 0..y.len {
                let weight = z.weights[k] * y.weights[j];
                let start = x.first + nx * (y.first + j + ny * (z.first + k));
                let columns = &mut self.columns[start..start + x.len];
                for (i, column) in columns.iter_mut().enumerate() {
                    if *column == FIXED {
                        continue;
                    }
                    if *column == UNUSED {
                        *column = rows.control_points.len();
                        rows.control_points.push(start + i);
                    }
                    rows.matrix.push(*column, weight * x.weights[i]);
                }
            }
        }
        let entries = rows.matrix.open_row();
        let norm = entries.iter().map(|w| w * w).sum::<f64>().sqrt();
        if norm < smallest {
            rows.matrix.discard_row();
            for control_point in rows.control_points.drain(known..) {
                self.columns[control_point] = UNUSED;
            }
        } else {
            rows.matrix.end_row();
            rows.norms.push(norm);
        }
        norm
    }

    pub(super) fn finish(self) -> Rows {
        let mut rows = self.rows;
        rows.matrix.set_column_count(rows.control_points.len());
        rows
    }

    fn window(&self, axis: usize, location: &Location<D>) -> Window {
        let grid = self.grid;
        let order = grid.order()[axis];
        let basis = grid.basis(axis, location);
        let weights = basis.values(order - 1, location.t[axis], 0.0, 1.0);
        let (cell, layers) = (location.cell[axis], grid.layers(axis));
        let count = grid.axes()[axis].control_point_count();
        // Functions whose control point exists: layers ≤ cell + j < layers + count.
        let mut begin = layers.saturating_sub(cell);
        let mut end = order.min((layers + count).saturating_sub(cell));
        // On a knot, one or more of them are zero.
        while begin < end && weights[begin] <= 0.0 {
            begin += 1;
        }
        while begin < end && weights[end - 1] <= 0.0 {
            end -= 1;
        }
        let mut window = Window {
            first: (cell + begin).saturating_sub(layers),
            weights: [0.0; MAX_ORDER],
            len: end - begin,
        };
        window.weights[..end - begin].copy_from_slice(&weights[begin..end]);
        window
    }
}

impl Window {
    /// That of the axis that a plane lacks.
    fn one() -> Self {
        let mut weights = [0.0; MAX_ORDER];
        weights[0] = 1.0;
        Self {
            first: 0,
            weights,
            len: 1,
        }
    }

    fn norm(&self) -> f64 {
        let squares = self.weights[..self.len].iter().map(|w| w * w);
        squares.sum::<f64>().sqrt()
    }
}
