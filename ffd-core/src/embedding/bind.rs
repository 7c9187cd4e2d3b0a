//! Binding: points are located and sorted by cell.

use super::{Batch, Embedding, Run};
use crate::evaluate::{check_point, locate_with};
use crate::kernel::group;
use crate::scalar::Scalar;
use crate::{FfdError, Grid, Outside};

/// Points are sorted by cell within batches whose images take so many bytes: few enough
/// that they stay in the cache while they are written in the order of cells.
const BYTES_IN_BATCH: usize = 3 << 17;

/// Points in a run that make its set-up worth while; with fewer, larger batches.
const POINTS_IN_RUN: usize = 32;

/// A point inside: its cell, last axis first; its index in the batch; its position in
/// the cell.
type Located<const D: usize> = ([usize; D], u32, [f64; D]);

impl<S: Scalar, const D: usize> Embedding<S, D> {
    /// Binds points to a grid.
    ///
    /// `points` may be of any vector type that converts to and from `[S; D]`. Costs some
    /// ten evaluations of each point, and memory for about `2 D` numbers for each; much more
    /// on a grid so fine that few points share a cell. There,
    /// [`Lattice::deform_points`](crate::Lattice::deform_points) is the better choice.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NonFinitePoint`];
    /// * [`FfdError::PointOutside`] with [`Outside::Error`]; with [`Outside::Clamp`] only
    ///   for a point so far away that its lattice coordinates are not finite.
    pub fn new<P>(grid: &Grid<D>, points: &[P], outside: Outside) -> Result<Self, FfdError>
    where
        P: Copy + Into<[S; D]>,
    {
        let count = points.len();
        let batch_size = batch_size(grid, points);
        let mut bound = Self {
            grid: grid.clone(),
            bases: grid.axes().each_ref().map(|axis| {
                let bases = axis.bases().iter();
                bases.map(|basis| basis.convert(S::from_f64)).collect()
            }),
            inverse: grid.frame().inverse().map(|row| row.map(S::from_f64)),
            count,
            batch_size,
            batches: Vec::with_capacity(count.div_ceil(batch_size)),
            runs: Vec::new(),
            members: Vec::with_capacity(count),
            groups: Vec::with_capacity(2 * D * count),
            outside,
            beyond: Vec::new(),
            touched: Vec::new(),
        };
        let mut located = Vec::with_capacity(batch_size.min(count));
        for (batch, points) in points.chunks(batch_size).enumerate() {
            bound.bind_batch(batch * batch_size, points, &mut located)?;
        }
        Ok(bound)
    }

    /// Sorts the points of one batch.
    fn bind_batch<P>(
        &mut self,
        first: usize,
        points: &[P],
        located: &mut Vec<Located<D>>,
    ) -> Result<(), FfdError>
    where
        P: Copy + Into<[S; D]>,
    {
        let (first_run, first_beyond) = (self.runs.len(), self.beyond.len());
        located.clear();
        for (i, &point) in points.iter().enumerate() {
            let point: [S; D] = point.into();
            let world = point.map(S::to_f64);
            check_point(first + i, world)?;
            if let Some(point) = locate(&self.grid, i, world) {
                located.push(point);
            } else {
                locate_with(&self.grid, first + i, world, self.outside)?;
                self.beyond.push((first + i, point));
            }
        }
        located.sort_unstable_by_key(|&(cell, i, _)| (cell, i));
        for in_cell in located.chunk_by(|a, b| a.0 == b.0) {
            let (start, groups) = (self.members.len(), self.groups.len());
            for points_of_group in in_cell.chunks(group::<S>()) {
                let first = self.groups.len();
                let zero = S::from_f64(0.0);
                self.groups.resize(first + 2 * D * group::<S>(), zero);
                let lists = &mut self.groups[first..];
                for (lane, &(_, i, t)) in points_of_group.iter().enumerate() {
                    let point: [S; D] = points[i as usize].into();
                    self.members.push(i);
                    for axis in 0..D {
                        lists[axis * group::<S>() + lane] = S::from_f64(t[axis]);
                        lists[(D + axis) * group::<S>() + lane] = point[axis];
                    }
                }
            }
            let mut cell = in_cell[0].0;
            cell.reverse();
            self.runs.push(Run {
                cell,
                points: start..self.members.len(),
                groups,
            });
        }
        let jumps = located
            .windows(2)
            .filter(|pair| pair[1].1 != pair[0].1.wrapping_add(1));
        self.batches.push(Batch {
            runs: first_run..self.runs.len(),
            beyond: first_beyond..self.beyond.len(),
            scattered: jumps.count() > points.len() / 8,
        });
        Ok(())
    }
}

/// Where point `i` of a batch is, if it is inside.
fn locate<const D: usize>(grid: &Grid<D>, i: usize, world: [f64; D]) -> Option<Located<D>> {
    let location = grid.locate(world)?;
    // So that cells with a common last index come together.
    let mut cell = location.cell;
    cell.reverse();
    let i = u32::try_from(i).expect("batches are smaller than that");
    Some((cell, i, location.t))
}

/// How many points to sort at a time, judged by the first of them.
fn batch_size<S: Scalar, P: Copy + Into<[S; D]>, const D: usize>(
    grid: &Grid<D>,
    points: &[P],
) -> usize {
    let usual = BYTES_IN_BATCH / size_of::<[S; D]>();
    if points.len() <= usual {
        return usual;
    }
    let some = points[..usual].iter().enumerate();
    let mut cells: Vec<[usize; D]> = some
        .filter_map(|(i, &point)| locate(grid, i, point.into().map(S::to_f64)))
        .map(|(cell, _, _)| cell)
        .collect();
    cells.sort_unstable();
    let runs = cells.chunk_by(|a, b| a == b).count();
    // With twice as many points, there are at most twice as many in a cell.
    let times = (POINTS_IN_RUN * runs).div_ceil(cells.len().max(1));
    let most = 1 << 30;
    usual * times.clamp(1, points.len().min(most).div_ceil(usual))
}
