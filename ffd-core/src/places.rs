//! Where the points of a chunk are in a cubic lattice with uniform knots.
//!
//! Cells and basis functions are found for all points first, one in each lane of a
//! vector, with the operations of [`Grid::locate`] and [`CellBasis::values`] in the same
//! order. The CPU would otherwise wait, in each point, for one result after the other.
//!
//! [`CellBasis::values`]: crate::bspline::CellBasis::values

use fearless_simd::{Select as _, Simd, SimdBase, SimdFloat};

use crate::Grid;
use crate::bspline::MAX_ORDER;
use crate::kernel::CHUNK;

/// Places of up to [`CHUNK`] points.
pub(crate) struct Places<const D: usize> {
    /// World coordinates, one list for each.
    world: [[f64; CHUNK]; D],
    /// 1 inside the domain, 0 outside.
    inside: [f64; CHUNK],
    /// Whole numbers: see [`Location::cell`](crate::grid::Location::cell).
    cell: [[f64; CHUNK]; D],
    /// The four basis functions along each axis.
    weights: [[[f64; CHUNK]; 4]; D],
}

impl<const D: usize> Places<D> {
    pub(crate) fn new() -> Self {
        let zeros = [0.0; CHUNK];
        Self {
            world: [zeros; D],
            inside: zeros,
            cell: [zeros; D],
            weights: [[zeros; 4]; D],
        }
    }

    /// Finds the places of points.
    #[inline(always)]
    pub(crate) fn find<S: Simd>(&mut self, simd: S, grid: &Grid<D>, points: &[[f64; D]]) {
        for (i, point) in points.iter().enumerate() {
            for c in 0..D {
                self.world[c][i] = point[c];
            }
        }
        let (zero, one) = (S::f64s::splat(simd, 0.0), S::f64s::splat(simd, 1.0));
        let (origin, inverse) = (grid.frame().origin(), grid.frame().inverse());
        let mut at = 0;
        while at < points.len() {
            let lanes = at..at + S::f64s::LEN;
            let mut inside = one;
            let mut from_origin = [zero; D];
            for c in 0..D {
                let world = S::f64s::from_slice(simd, &self.world[c][lanes.clone()]);
                from_origin[c] = world - origin[c];
            }
            for axis in 0..D {
                let mut u = from_origin[0] * inverse[axis][0];
                for c in 1..D {
                    u += from_origin[c] * inverse[axis][c];
                }
                let low = grid.layers(axis) as f64;
                let cells = grid.domain_cells(axis) as f64;
                let after = u.simd_ge(S::f64s::splat(simd, -low));
                let before = u.simd_le(S::f64s::splat(simd, cells - low));
                inside = (after & before).select(inside, zero);

                let last = S::f64s::splat(simd, cells - 1.0);
                let cell = (u + low).floor().min(last).max(zero);
                let t = (u - (cell - low)).min(one).max(zero);
                cell.store_slice(&mut self.cell[axis][lanes.clone()]);
                let basis = grid.axes()[axis].bases()[0].values(3, t, zero, one);
                for j in 0..4 {
                    basis[j].store_slice(&mut self.weights[axis][j][lanes.clone()]);
                }
            }
            inside.store_slice(&mut self.inside[lanes]);
            at += S::f64s::LEN;
        }
    }

    /// Whether a point is in the domain.
    #[inline(always)]
    pub(crate) fn is_inside(&self, point: usize) -> bool {
        self.inside[point] > 0.0
    }

    /// The cell of a point inside.
    #[inline(always)]
    pub(crate) fn cell(&self, point: usize) -> [usize; D] {
        let mut cell = [0; D];
        for axis in 0..D {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between 0 and the number of cells"
            )]
            let number = self.cell[axis][point] as usize;
            cell[axis] = number;
        }
        cell
    }

    /// The basis functions at a point inside.
    #[inline(always)]
    pub(crate) fn weights(&self, point: usize) -> [[f64; MAX_ORDER]; D] {
        let mut weights = [[0.0; MAX_ORDER]; D];
        for axis in 0..D {
            for j in 0..4 {
                weights[axis][j] = self.weights[axis][j][point];
            }
        }
        weights
    }
}
