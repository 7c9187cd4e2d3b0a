//! Evaluation of the points of a batch, cell after cell.

use fearless_simd::Level;

use super::{Batch, Embedding, Run};
use crate::bspline::{CellBasis, MAX_ORDER};
use crate::kernel::{CHUNK, Cell};
use crate::scalar::Scalar;
use crate::{Lattice, Outside};

/// Components of the control displacements of a cell, at most.
const MOST_COMPONENTS: usize = MAX_ORDER * MAX_ORDER * MAX_ORDER * 3;
/// Components of an image and a Jacobian, at most.
const MOST_LISTS: usize = 3 + 3 * 3;

/// What the evaluation of a cell needs, made once for all cells.
pub(super) struct Workspace<S> {
    displacements: [S; MOST_COMPONENTS],
    images: [[S; CHUNK]; MOST_LISTS],
}

impl<S: Scalar> Workspace<S> {
    pub(super) fn new() -> Self {
        let zero = S::from_f64(0.0);
        Self {
            displacements: [zero; MOST_COMPONENTS],
            images: [[zero; CHUNK]; MOST_LISTS],
        }
    }
}

impl<S: Scalar, const D: usize> Embedding<S, D> {
    /// Calls `see` with the index within the batch, image and Jacobian of every point.
    pub(crate) fn evaluate_batch(
        &self,
        level: Level,
        lattice: &Lattice<D>,
        batch: &Batch,
        mut see: impl FnMut(usize, [S; D], [[S; D]; D]),
    ) {
        let mut workspace = Workspace::new();
        let kernel = |cell: &Cell<'_, S>, out: &mut _| S::jacobians(level, cell, out);
        for run in &self.runs[batch.runs.clone()] {
            self.evaluate_run(lattice, run, &mut workspace, kernel, |lists, lane, i| {
                let mut jacobian = [[S::from_f64(0.0); D]; D];
                for r in 0..D {
                    jacobian[r] = vector(&lists[D + D * r..], lane);
                }
                see(i, vector(lists, lane), jacobian);
            });
        }
        for &(index, point) in &self.beyond[batch.beyond.clone()] {
            let there = lattice.evaluate_beyond(point.map(S::to_f64), self.outside);
            see(
                index % self.batch_size,
                there.position.map(S::from_f64),
                there.jacobian.map(|row| row.map(S::from_f64)),
            );
        }
    }

    pub(crate) fn deform_batch<P: From<[S; D]>>(
        &self,
        level: Level,
        lattice: &Lattice<D>,
        batch: &Batch,
        out: &mut [P],
    ) {
        let mut workspace = Workspace::new();
        if batch.scattered {
            touch(out);
        }
        for run in &self.runs[batch.runs.clone()] {
            self.deform_run(level, lattice, run, &mut workspace, out);
        }
        for &(index, point) in &self.beyond[batch.beyond.clone()] {
            out[index % self.batch_size] = P::from(self.beyond_image(lattice, point));
        }
    }

    pub(super) fn deform_run<P: From<[S; D]>>(
        &self,
        level: Level,
        lattice: &Lattice<D>,
        run: &Run<D>,
        workspace: &mut Workspace<S>,
        out: &mut [P],
    ) {
        let kernel = |cell: &Cell<'_, S>, out: &mut _| S::values(level, cell, out);
        self.evaluate_run(lattice, run, workspace, kernel, |lists, lane, i| {
            out[i] = P::from(vector(lists, lane));
        });
    }

    /// The image of a point outside the domain.
    pub(super) fn beyond_image(&self, lattice: &Lattice<D>, point: [S; D]) -> [S; D] {
        match self.outside {
            Outside::Clamp => {
                let there = lattice.evaluate_beyond(point.map(S::to_f64), Outside::Clamp);
                there.position.map(S::from_f64)
            }
            Outside::Keep | Outside::Error => point,
        }
    }

    /// Evaluates the points of a run. Calls `see` for each with what the kernel wrote, in
    /// which lane, and with the point's index within its batch.
    #[inline(always)]
    fn evaluate_run(
        &self,
        lattice: &Lattice<D>,
        run: &Run<D>,
        workspace: &mut Workspace<S>,
        kernel: impl Fn(&Cell<'_, S>, &mut [[S; CHUNK]]),
        mut see: impl FnMut(&[[S; CHUNK]; MOST_LISTS], usize, usize),
    ) {
        let Workspace {
            displacements,
            images,
        } = workspace;
        let count = lattice.block(run.cell).gather(displacements, S::from_f64);
        let order = self.grid.order();
        let bases: [&CellBasis<S>; D] = std::array::from_fn(|axis| {
            &self.bases[axis][self.grid.kind_of_cell(axis, run.cell[axis])]
        });
        let mut start = run.points.start;
        while start < run.points.end {
            let end = (start + CHUNK).min(run.points.end);
            let cell = Cell {
                order: &order,
                bases: &bases,
                block: &displacements[..count],
                inverse: self.inverse.as_flattened(),
                groups: &self.groups[run.groups + 2 * D * (start - run.points.start)..],
                count: end - start,
            };
            kernel(&cell, images);
            for (lane, &i) in self.members[start..end].iter().enumerate() {
                see(images, lane, i as usize);
            }
            start = end;
        }
    }
}

/// Brings memory that is about to be overwritten into the cache, in its order, which is
/// several times faster than in the order of cells.
pub(super) fn touch<S: Scalar, P: From<[S; D]>, const D: usize>(out: &mut [P]) {
    for image in out {
        *image = P::from([S::from_f64(0.0); D]);
    }
}

/// The vector in one lane of the lists of its components.
#[inline(always)]
fn vector<S: Scalar, const D: usize>(lists: &[[S; CHUNK]], lane: usize) -> [S; D] {
    // A loop: `array::from_fn` with a closure is not inlined here.
    let mut vector = [S::from_f64(0.0); D];
    for c in 0..D {
        vector[c] = lists[c][lane];
    }
    vector
}
