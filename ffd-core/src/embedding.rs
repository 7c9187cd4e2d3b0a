//! A mesh bound to a grid, to be deformed again and again.

use std::ops::Range;

use fearless_simd::Level;

use crate::bspline::{CellBasis, MAX_ORDER};
use crate::evaluate::{check_point, locate_with};
use crate::kernel::{CHUNK, Cell, GROUP};
use crate::scalar::Scalar;
use crate::{FfdError, Grid, Lattice, Outside, transform_normal};

/// Points are sorted by cell within blocks whose images take so many bytes at most: few
/// enough that they stay in the cache while they are written in the order of cells.
const MOST_BYTES_IN_BLOCK: usize = 3 << 17;
/// Points in a block: blocks of less would leave too few in each cell, and more could not
/// be numbered in 16 bits.
const POINTS_IN_BLOCK: std::ops::RangeInclusive<usize> = 1 << 13..=1 << 16;

/// Points bound to a grid, sorted by cell, ready to be deformed by any lattice on it.
///
/// Binding finds the cell of each point once. After that, each call evaluates the
/// points of a cell together, several in the lanes of a vector, writes their images in
/// the order in which the points were given, and allocates nothing. `S` is the precision
/// of the points and of the evaluation, `f64` or `f32`. Results do not depend on the
/// order of points, the number of threads, or the CPU.
///
/// In `f64`, images are equal to those of [`Lattice::deform_point`] to the last bit. In
/// `f32`, positions within cells are found in `f64` and rounded; the rest is computed
/// in `f32`. With x' the image, n the highest degree and d the largest component of a
/// displacement, each coordinate is off by at most `2⁻²⁴ (|x'| + (22 n + 5) d)`: in units
/// of 2⁻²⁴ d, 3 n from the rounded position (slopes add up to 2 n along each axis), 5 n
/// for the basis functions along each of three axes, n + 1 for each sum, and one for the
/// rounded displacements.
///
/// # Example
///
/// ```
/// use ffd_core::{Degree, Embedding, Frame, Grid, Lattice, Outside};
/// use glam::DVec3;
///
/// let grid = Grid::new([Degree::CUBIC; 3], [4, 4, 4], Frame::unit())?;
/// let mesh = [DVec3::new(2.0, 2.0, 2.0), DVec3::new(9.0, 9.0, 9.0)];
/// let bound = Embedding::<f64, 3>::new(&grid, &mesh, Outside::Keep)?;
/// assert_eq!(bound.outside().collect::<Vec<_>>(), [1]);
///
/// let mut lattice = Lattice::at_rest(grid)?;
/// let mut image = mesh;
/// for step in 1..=3 {
///     lattice.set_displacement(171, [0.0, 0.0, f64::from(step)])?;
///     bound.deform_into(&lattice, &mut image)?;
/// }
/// // Control point (3, 3, 3) has a weight of (2/3)³ where it rests.
/// assert!((image[0].z - (2.0 + 3.0 * 8.0 / 27.0)).abs() < 1e-14);
/// assert_eq!(image[1], mesh[1]);
/// # Ok::<(), ffd_core::FfdError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Embedding<S, const D: usize> {
    grid: Grid<D>,
    /// The basis of each kind of cell along each axis.
    bases: [Vec<CellBasis<S>>; D],
    inverse: [[S; D]; D],
    count: usize,
    block_size: usize,
    /// One for every `block_size` points.
    blocks: Vec<Block>,
    /// Points of one block in one cell, block after block.
    runs: Vec<Run<D>>,
    /// For each bound point in the order of runs: which point of its block it is.
    order: Vec<u16>,
    /// Positions of the points of each run, in groups: see [`GROUP`].
    groups: Vec<S>,
    outside: Outside,
    /// Points outside the domain, ascending.
    beyond: Vec<(usize, [S; D])>,
}

#[derive(Debug, Clone)]
struct Block {
    runs: Range<usize>,
    beyond: Range<usize>,
    /// Whether the order of cells jumps about in that of points.
    scattered: bool,
}

#[derive(Debug, Clone)]
struct Run<const D: usize> {
    cell: [usize; D],
    points: Range<usize>,
    /// Where its groups begin.
    groups: usize,
}

/// Components of the control displacements of a cell, at most.
const MOST_COMPONENTS: usize = MAX_ORDER * MAX_ORDER * MAX_ORDER * 3;
/// Components of an image and a Jacobian, at most.
const MOST_LISTS: usize = 3 + 3 * 3;

/// What the evaluation of a cell needs, made once for all cells.
struct Workspace<S> {
    displacements: [S; MOST_COMPONENTS],
    images: [[S; CHUNK]; MOST_LISTS],
}

impl<S: Scalar, const D: usize> Embedding<S, D> {
    /// Binds points to a grid.
    ///
    /// `points` may be of any vector type that converts to and from `[S; D]`.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NonFinitePoint`];
    /// * [`FfdError::PointOutside`] with [`Outside::Error`].
    pub fn new<P>(grid: &Grid<D>, points: &[P], outside: Outside) -> Result<Self, FfdError>
    where
        P: Copy + Into<[S; D]>,
    {
        let count = points.len();
        let (least, most) = POINTS_IN_BLOCK.into_inner();
        let block_size = (MOST_BYTES_IN_BLOCK / size_of::<[S; D]>()).clamp(least, most);
        let mut bound = Self {
            grid: grid.clone(),
            bases: grid.axes().each_ref().map(|axis| {
                axis.bases()
                    .iter()
                    .map(|b| b.convert(S::from_f64))
                    .collect()
            }),
            inverse: grid.frame().inverse().map(|row| row.map(S::from_f64)),
            count,
            block_size,
            blocks: Vec::with_capacity(count.div_ceil(block_size)),
            runs: Vec::new(),
            order: Vec::with_capacity(count),
            groups: Vec::with_capacity(2 * D * count),
            outside,
            beyond: Vec::new(),
        };
        let mut located = Vec::with_capacity(block_size.min(count));
        for (block, points) in points.chunks(block_size).enumerate() {
            bound.bind_block(block * block_size, points, &mut located)?;
        }
        Ok(bound)
    }

    /// Sorts the points of one block.
    fn bind_block<P>(
        &mut self,
        first: usize,
        points: &[P],
        located: &mut Vec<([usize; D], u16, [f64; D])>,
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
            let inside = match self.outside {
                Outside::Error => locate_with(&self.grid, first + i, world, Outside::Error)?,
                Outside::Keep | Outside::Clamp => self.grid.locate(world),
            };
            match inside {
                Some(location) => {
                    let mut cell = location.cell;
                    // Cells with a common last index come together.
                    cell.reverse();
                    let i = u16::try_from(i).expect("a block has at most 2¹⁶ points");
                    located.push((cell, i, location.t));
                }
                None => self.beyond.push((first + i, point)),
            }
        }
        located.sort_unstable_by_key(|&(cell, i, _)| (cell, i));
        for in_cell in located.chunk_by(|a, b| a.0 == b.0) {
            let (start, groups) = (self.order.len(), self.groups.len());
            for group in in_cell.chunks(GROUP) {
                let first = self.groups.len();
                self.groups.resize(first + 2 * D * GROUP, S::from_f64(0.0));
                let lists = &mut self.groups[first..];
                for (lane, &(_, i, t)) in group.iter().enumerate() {
                    let point: [S; D] = points[usize::from(i)].into();
                    self.order.push(i);
                    for axis in 0..D {
                        lists[axis * GROUP + lane] = S::from_f64(t[axis]);
                        lists[(D + axis) * GROUP + lane] = point[axis];
                    }
                }
            }
            let mut cell = in_cell[0].0;
            cell.reverse();
            self.runs.push(Run {
                cell,
                points: start..self.order.len(),
                groups,
            });
        }
        let jumps = located
            .windows(2)
            .filter(|pair| pair[1].1 != pair[0].1.wrapping_add(1));
        self.blocks.push(Block {
            runs: first_run..self.runs.len(),
            beyond: first_beyond..self.beyond.len(),
            scattered: jumps.count() > points.len() / 8,
        });
        Ok(())
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Indices of the points outside the domain of the grid, ascending.
    pub fn outside(&self) -> impl ExactSizeIterator<Item = usize> {
        self.beyond.iter().map(|&(index, _)| index)
    }

    /// Writes the images of all points to `out`, one for each, in their order.
    ///
    /// # Errors
    ///
    /// * [`FfdError::GridMismatch`] if the lattice is on another grid;
    /// * [`FfdError::LengthMismatch`]. `out` is untouched in both cases.
    pub fn deform_into<P>(&self, lattice: &Lattice<D>, out: &mut [P]) -> Result<(), FfdError>
    where
        P: From<[S; D]>,
    {
        self.check(lattice, "images", out.len())?;
        let level = Level::new();
        for (block, out) in self.blocks.iter().zip(out.chunks_mut(self.block_size)) {
            self.deform_block(level, lattice, block, out);
        }
        Ok(())
    }

    /// [`Embedding::deform_into`] on the threads of the current rayon pool. The result
    /// is the same to the last bit.
    ///
    /// # Errors
    ///
    /// As [`Embedding::deform_into`].
    #[cfg(feature = "rayon")]
    pub fn par_deform_into<P>(&self, lattice: &Lattice<D>, out: &mut [P]) -> Result<(), FfdError>
    where
        P: From<[S; D]> + Send,
    {
        use rayon::prelude::*;

        self.check(lattice, "images", out.len())?;
        let level = Level::new();
        self.blocks
            .par_iter()
            .zip(out.par_chunks_mut(self.block_size))
            .for_each(|(block, out)| self.deform_block(level, lattice, block, out));
        Ok(())
    }

    /// Brings `out` up to date after some control points have moved: evaluates only the
    /// points in cells on which one of them acts, and returns how many these are.
    ///
    /// `out` holds the images before the move, from [`Embedding::deform_into`] or from
    /// here. Costs one test for each occupied cell and moved control point, besides.
    ///
    /// # Errors
    ///
    /// As [`Embedding::deform_into`].
    ///
    /// # Panics
    ///
    /// If there is no control point of a given index.
    pub fn update_into<P>(
        &self,
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
        let level = Level::new();
        let mut workspace = Workspace::new();
        let mut updated = 0;
        for (block, out) in self.blocks.iter().zip(out.chunks_mut(self.block_size)) {
            for run in &self.runs[block.runs.clone()] {
                if moved.iter().any(|&index| self.acts_on(index, run.cell)) {
                    updated += run.points.len();
                    self.deform_run(level, lattice, run, &mut workspace, out);
                }
            }
            if self.outside == Outside::Clamp {
                updated += block.beyond.len();
                self.deform_beyond(lattice, block, out);
            }
        }
        Ok(updated)
    }

    /// Writes the images of all points, and the Jacobians of the deformation there:
    /// entry `[r][c]` is the derivative of coordinate r of the image with respect to
    /// coordinate c of the point. Outside the domain it is that of what happens there:
    /// the identity, or for [`Outside::Clamp`] without change along clamped axes.
    ///
    /// # Errors
    ///
    /// As [`Embedding::deform_into`], for both lists.
    pub fn deform_with_jacobians_into<P>(
        &self,
        lattice: &Lattice<D>,
        out: &mut [P],
        jacobians: &mut [[[S; D]; D]],
    ) -> Result<(), FfdError>
    where
        P: From<[S; D]>,
    {
        self.check(lattice, "images", out.len())?;
        self.check(lattice, "Jacobians", jacobians.len())?;
        let out = out.chunks_mut(self.block_size);
        let jacobians = jacobians.chunks_mut(self.block_size);
        for ((block, out), jacobians) in self.blocks.iter().zip(out).zip(jacobians) {
            self.block_with_jacobians(lattice, block, out, jacobians);
        }
        Ok(())
    }

    /// [`Embedding::deform_with_jacobians_into`] on the threads of the current rayon
    /// pool. The result is the same to the last bit.
    ///
    /// # Errors
    ///
    /// As [`Embedding::deform_into`], for both lists.
    #[cfg(feature = "rayon")]
    pub fn par_deform_with_jacobians_into<P>(
        &self,
        lattice: &Lattice<D>,
        out: &mut [P],
        jacobians: &mut [[[S; D]; D]],
    ) -> Result<(), FfdError>
    where
        P: From<[S; D]> + Send,
    {
        use rayon::prelude::*;

        self.check(lattice, "images", out.len())?;
        self.check(lattice, "Jacobians", jacobians.len())?;
        let out = out.par_chunks_mut(self.block_size);
        let jacobians = jacobians.par_chunks_mut(self.block_size);
        let blocks = self.blocks.par_iter().zip(out).zip(jacobians);
        blocks.for_each(|((block, out), jacobians)| {
            self.block_with_jacobians(lattice, block, out, jacobians);
        });
        Ok(())
    }

    /// Writes the images of all points and of one unit normal at each: normals of
    /// surfaces, which follow the inverse transpose of the Jacobian (see
    /// [`transform_normal`]).
    ///
    /// # Errors
    ///
    /// As [`Embedding::deform_into`], for all lists.
    pub fn deform_with_normals_into<P>(
        &self,
        lattice: &Lattice<D>,
        normals: &[P],
        out: &mut [P],
        out_normals: &mut [P],
    ) -> Result<(), FfdError>
    where
        P: Copy + Into<[S; D]> + From<[S; D]>,
    {
        self.check(lattice, "images", out.len())?;
        self.check(lattice, "normals", normals.len())?;
        self.check(lattice, "images of normals", out_normals.len())?;
        let normals = normals.chunks(self.block_size);
        let out = out.chunks_mut(self.block_size);
        let out_normals = out_normals.chunks_mut(self.block_size);
        let lists = normals.zip(out).zip(out_normals);
        for (block, ((normals, out), out_normals)) in self.blocks.iter().zip(lists) {
            self.block_with_normals(lattice, block, normals, out, out_normals);
        }
        Ok(())
    }

    /// [`Embedding::deform_with_normals_into`] on the threads of the current rayon pool.
    /// The result is the same to the last bit.
    ///
    /// # Errors
    ///
    /// As [`Embedding::deform_into`], for all lists.
    #[cfg(feature = "rayon")]
    pub fn par_deform_with_normals_into<P>(
        &self,
        lattice: &Lattice<D>,
        normals: &[P],
        out: &mut [P],
        out_normals: &mut [P],
    ) -> Result<(), FfdError>
    where
        P: Copy + Into<[S; D]> + From<[S; D]> + Send + Sync,
    {
        use rayon::prelude::*;

        self.check(lattice, "images", out.len())?;
        self.check(lattice, "normals", normals.len())?;
        self.check(lattice, "images of normals", out_normals.len())?;
        let normals = normals.par_chunks(self.block_size);
        let out = out.par_chunks_mut(self.block_size);
        let out_normals = out_normals.par_chunks_mut(self.block_size);
        let lists = normals.zip(out).zip(out_normals);
        let blocks = self.blocks.par_iter().zip(lists);
        blocks.for_each(|(block, ((normals, out), out_normals))| {
            self.block_with_normals(lattice, block, normals, out, out_normals);
        });
        Ok(())
    }

    fn block_with_jacobians<P: From<[S; D]>>(
        &self,
        lattice: &Lattice<D>,
        block: &Block,
        out: &mut [P],
        jacobians: &mut [[[S; D]; D]],
    ) {
        if block.scattered {
            touch(out);
            jacobians.fill([[S::from_f64(0.0); D]; D]);
        }
        self.evaluate_block(lattice, block, |i, image, jacobian| {
            out[i] = P::from(image);
            jacobians[i] = jacobian;
        });
    }

    fn block_with_normals<P>(
        &self,
        lattice: &Lattice<D>,
        block: &Block,
        normals: &[P],
        out: &mut [P],
        out_normals: &mut [P],
    ) where
        P: Copy + Into<[S; D]> + From<[S; D]>,
    {
        if block.scattered {
            touch(out);
            touch(out_normals);
        }
        self.evaluate_block(lattice, block, |i, image, jacobian| {
            out[i] = P::from(image);
            let jacobian = jacobian.map(|row| row.map(S::to_f64));
            let normal: [S; D] = normals[i].into();
            let normal = transform_normal(&jacobian, normal.map(S::to_f64));
            out_normals[i] = P::from(normal.map(S::from_f64));
        });
    }

    /// Calls `see` with the index within the block, image and Jacobian of every point.
    fn evaluate_block(
        &self,
        lattice: &Lattice<D>,
        block: &Block,
        mut see: impl FnMut(usize, [S; D], [[S; D]; D]),
    ) {
        let level = Level::new();
        let mut workspace = Workspace::new();
        let kernel = |cell: &Cell<'_, S>, out: &mut _| S::jacobians(level, cell, out);
        for run in &self.runs[block.runs.clone()] {
            self.evaluate(lattice, run, &mut workspace, kernel, |lists, lane, i| {
                let mut jacobian = [[S::from_f64(0.0); D]; D];
                for r in 0..D {
                    jacobian[r] = vector(&lists[D + D * r..], lane);
                }
                see(i, vector(lists, lane), jacobian);
            });
        }
        for &(index, point) in &self.beyond[block.beyond.clone()] {
            let world = point.map(S::to_f64);
            let there = lattice.evaluate_beyond(world, self.outside);
            see(
                index % self.block_size,
                there.position.map(S::from_f64),
                there.jacobian.map(|row| row.map(S::from_f64)),
            );
        }
    }

    fn deform_block<P: From<[S; D]>>(
        &self,
        level: Level,
        lattice: &Lattice<D>,
        block: &Block,
        out: &mut [P],
    ) {
        let mut workspace = Workspace::new();
        if block.scattered {
            touch(out);
        }
        for run in &self.runs[block.runs.clone()] {
            self.deform_run(level, lattice, run, &mut workspace, out);
        }
        self.deform_beyond(lattice, block, out);
    }

    fn deform_run<P: From<[S; D]>>(
        &self,
        level: Level,
        lattice: &Lattice<D>,
        run: &Run<D>,
        workspace: &mut Workspace<S>,
        out: &mut [P],
    ) {
        let kernel = |cell: &Cell<'_, S>, out: &mut _| S::values(level, cell, out);
        self.evaluate(lattice, run, workspace, kernel, |lists, i, index| {
            out[index] = P::from(vector(lists, i));
        });
    }

    fn deform_beyond<P: From<[S; D]>>(&self, lattice: &Lattice<D>, block: &Block, out: &mut [P]) {
        for &(index, point) in &self.beyond[block.beyond.clone()] {
            let image = match self.outside {
                Outside::Clamp => {
                    let world = point.map(S::to_f64);
                    let there = lattice.evaluate_beyond(world, Outside::Clamp);
                    there.position.map(S::from_f64)
                }
                Outside::Keep | Outside::Error => point,
            };
            out[index % self.block_size] = P::from(image);
        }
    }

    /// Evaluates the points of a run. Calls `see` for each with what the kernel wrote, in
    /// which lane, and with the point's index within its block.
    #[inline(always)]
    fn evaluate(
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
            for (i, &index) in self.order[start..end].iter().enumerate() {
                see(images, i, usize::from(index));
            }
            start = end;
        }
    }

    /// Whether a control point acts on a cell of the domain.
    fn acts_on(&self, control_point: usize, cell: [usize; D]) -> bool {
        let indices = self.grid.control_point_indices(control_point);
        let order = self.grid.order();
        (0..D).all(|axis| {
            let index = indices[axis] + self.grid.layers(axis);
            (cell[axis]..cell[axis] + order[axis]).contains(&index)
        })
    }

    fn check(
        &self,
        lattice: &Lattice<D>,
        what: &'static str,
        found: usize,
    ) -> Result<(), FfdError> {
        if *lattice.grid() != self.grid {
            return Err(FfdError::GridMismatch);
        }
        if found != self.count {
            return Err(FfdError::LengthMismatch {
                what,
                expected: self.count,
                found,
            });
        }
        Ok(())
    }
}

/// Brings memory that is about to be overwritten into the cache, in its order, which is
/// several times faster than in the order of cells.
fn touch<S: Scalar, P: From<[S; D]>, const D: usize>(out: &mut [P]) {
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

impl<S: Scalar> Workspace<S> {
    fn new() -> Self {
        let zero = S::from_f64(0.0);
        Self {
            displacements: [zero; MOST_COMPONENTS],
            images: [[zero; CHUNK]; MOST_LISTS],
        }
    }
}
