//! Bringing images up to date after some control points have moved.

use fearless_simd::Level;

use super::Embedding;
use super::run::Workspace;
use crate::scalar::Scalar;
use crate::{FfdError, Lattice, Outside};

impl<S: Scalar, const D: usize> Embedding<S, D> {
    /// Brings `out` up to date after some control points have moved: evaluates only the
    /// points in cells on which one of them acts, and returns how many these are.
    ///
    /// `out` holds the images before the move, from [`Embedding::deform_into`] or from
    /// here. Besides, it costs a step for each occupied cell and point outside, and
    /// `Π (degree + 1)` for each moved control point. The first call allocates a mark for
    /// each cell of the grid, later ones nothing.
    ///
    /// # Errors
    ///
    /// As [`Embedding::deform_into`].
    ///
    /// # Panics
    ///
    /// If there is no control point of a given index.
    pub fn update_into<P>(
        &mut self,
        lattice: &Lattice<D>,
        moved: &[usize],
        out: &mut [P],
    ) -> Result<usize, FfdError>
    where
        P: From<[S; D]>,
    {
        self.check(lattice, "images", out.len())?;
        let count = self.grid.control_point_count();
        if let Some(index) = moved.iter().find(|&&index| index >= count) {
            panic!("control point {index} of {count} does not exist");
        }
        let cells: usize = (0..D).map(|axis| self.grid.domain_cells(axis)).product();
        self.touched.resize(cells, false);
        self.mark(moved, true);
        let level = Level::new();
        let mut workspace = Workspace::new();
        let mut updated = 0;
        for (batch, out) in self.batches.iter().zip(out.chunks_mut(self.batch_size)) {
            for run in &self.runs[batch.runs.clone()] {
                if self.touched[self.number_of(run.cell)] {
                    updated += run.points.len();
                    self.deform_run(level, lattice, run, &mut workspace, out);
                }
            }
            if self.outside != Outside::Clamp {
                continue;
            }
            for &(index, point) in &self.beyond[batch.beyond.clone()] {
                let nearest = self.grid.locate_nearest(point.map(S::to_f64));
                if nearest.is_some_and(|at| self.touched[self.number_of(at.cell)]) {
                    updated += 1;
                    out[index % self.batch_size] = P::from(self.beyond_image(lattice, point));
                }
            }
        }
        self.mark(moved, false);
        Ok(updated)
    }

    /// Sets the marks of all cells on which control points act.
    fn mark(&mut self, control_points: &[usize], mark: bool) {
        let order = self.grid.order();
        let acted_on: usize = order.iter().product();
        for &control_point in control_points {
            let indices = self.grid.control_point_indices(control_point);
            'cells: for mut number in 0..acted_on {
                let mut cell = [0; D];
                for axis in 0..D {
                    // Control point i acts on cells i − n to i of the domain.
                    let last = indices[axis] + self.grid.layers(axis);
                    let Some(index) = last.checked_sub(number % order[axis]) else {
                        continue 'cells;
                    };
                    if index >= self.grid.domain_cells(axis) {
                        continue 'cells;
                    }
                    cell[axis] = index;
                    number /= order[axis];
                }
                let number = self.number_of(cell);
                self.touched[number] = mark;
            }
        }
    }

    /// The number of a cell of the domain.
    fn number_of(&self, cell: [usize; D]) -> usize {
        let number = |number, axis| number * self.grid.domain_cells(axis) + cell[axis];
        (0..D).rev().fold(0, number)
    }
}
