//! A mesh bound to a grid, to be deformed again and again.

mod bind;
mod run;
mod update;

use std::ops::Range;

use fearless_simd::Level;

use crate::bspline::CellBasis;
use crate::scalar::Scalar;
use crate::{FfdError, Grid, Lattice, Outside, transform_normal};
use run::touch;

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
/// rounded displacements. That is as long as no number leaves the range of `f32`: a
/// displacement above 3e38, or a cell narrower than 3e-39, gives infinity or NaN, and below
/// 1e-38 digits are lost.
///
/// # Example
///
/// ```
/// use ffd_core::{Degree, Embedding, Frame, Grid, Lattice, Outside};
/// use glam::DVec3;
///
/// let grid = Grid::new([Degree::CUBIC; 3], [4, 4, 4], Frame::unit())?;
/// let mesh = [DVec3::new(2.0, 2.0, 2.0), DVec3::new(9.0, 9.0, 9.0)];
/// let bound = Embedding::new(&grid, &mesh, Outside::Keep)?;
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
    batch_size: usize,
    /// One for every `batch_size` points.
    pub(crate) batches: Vec<Batch>,
    /// Points of one batch in one cell, batch after batch.
    runs: Vec<Run<D>>,
    /// For each point inside, in the order of runs: which one of its batch it is.
    members: Vec<u32>,
    /// Positions of the points of each run: see [`Cell::groups`](crate::kernel::Cell).
    groups: Vec<S>,
    outside: Outside,
    /// Points outside the domain, ascending.
    beyond: Vec<(usize, [S; D])>,
    /// For each cell of the domain whether it is to be updated; empty before the first
    /// update, and all false between two of them.
    touched: Vec<bool>,
}

/// Some points that follow each other, so that their images are written to one place.
#[derive(Debug, Clone)]
pub(crate) struct Batch {
    runs: Range<usize>,
    beyond: Range<usize>,
    /// Whether the order of cells jumps about in that of points.
    scattered: bool,
}

/// Points of a batch in one cell.
#[derive(Debug, Clone)]
struct Run<const D: usize> {
    cell: [usize; D],
    /// Entries of `members`.
    points: Range<usize>,
    /// Where its groups begin.
    groups: usize,
}

impl<S: Scalar, const D: usize> Embedding<S, D> {
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
        for (batch, out) in self.batches.iter().zip(out.chunks_mut(self.batch_size)) {
            self.deform_batch(level, lattice, batch, out);
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
        self.batches
            .par_iter()
            .zip(out.par_chunks_mut(self.batch_size))
            .for_each(|(batch, out)| self.deform_batch(level, lattice, batch, out));
        Ok(())
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
        let out = out.chunks_mut(self.batch_size);
        let jacobians = jacobians.chunks_mut(self.batch_size);
        for ((batch, out), jacobians) in self.batches.iter().zip(out).zip(jacobians) {
            self.batch_with_jacobians(lattice, batch, out, jacobians);
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
        let out = out.par_chunks_mut(self.batch_size);
        let jacobians = jacobians.par_chunks_mut(self.batch_size);
        let batches = self.batches.par_iter().zip(out).zip(jacobians);
        batches.for_each(|((batch, out), jacobians)| {
            self.batch_with_jacobians(lattice, batch, out, jacobians);
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
        let normals = normals.chunks(self.batch_size);
        let out = out.chunks_mut(self.batch_size);
        let out_normals = out_normals.chunks_mut(self.batch_size);
        let lists = normals.zip(out).zip(out_normals);
        for (batch, ((normals, out), out_normals)) in self.batches.iter().zip(lists) {
            self.batch_with_normals(lattice, batch, normals, out, out_normals);
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
        let normals = normals.par_chunks(self.batch_size);
        let out = out.par_chunks_mut(self.batch_size);
        let out_normals = out_normals.par_chunks_mut(self.batch_size);
        let lists = normals.zip(out).zip(out_normals);
        let batches = self.batches.par_iter().zip(lists);
        batches.for_each(|(batch, ((normals, out), out_normals))| {
            self.batch_with_normals(lattice, batch, normals, out, out_normals);
        });
        Ok(())
    }

    fn batch_with_jacobians<P: From<[S; D]>>(
        &self,
        lattice: &Lattice<D>,
        batch: &Batch,
        out: &mut [P],
        jacobians: &mut [[[S; D]; D]],
    ) {
        if batch.scattered {
            touch(out);
            jacobians.fill([[S::from_f64(0.0); D]; D]);
        }
        self.evaluate_batch(Level::new(), lattice, batch, |i, image, jacobian| {
            out[i] = P::from(image);
            jacobians[i] = jacobian;
        });
    }

    fn batch_with_normals<P>(
        &self,
        lattice: &Lattice<D>,
        batch: &Batch,
        normals: &[P],
        out: &mut [P],
        out_normals: &mut [P],
    ) where
        P: Copy + Into<[S; D]> + From<[S; D]>,
    {
        if batch.scattered {
            touch(out);
            touch(out_normals);
        }
        self.evaluate_batch(Level::new(), lattice, batch, |i, image, jacobian| {
            out[i] = P::from(image);
            let jacobian = jacobian.map(|row| row.map(S::to_f64));
            let normal: [S; D] = normals[i].into();
            let normal = transform_normal(&jacobian, normal.map(S::to_f64));
            out_normals[i] = P::from(normal.map(S::from_f64));
        });
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
