//! Many points in any order, in place.

use fearless_simd::{Level, Simd, dispatch};

use crate::evaluate::{check_point, locate_with};
use crate::kernel::CHUNK;
use crate::places::Places;
use crate::scalar::Scalar;
use crate::{FfdError, Lattice, Outside};

/// Points handed to a thread at a time.
#[cfg(feature = "rayon")]
const POINTS_PER_TASK: usize = 1 << 12;

impl<const D: usize> Lattice<D> {
    /// Deforms points in place and returns how many lie outside the domain.
    ///
    /// `points` may be of any vector type that converts to and from `[S; D]`, with `S`
    /// either `f64` or `f32`, which the compiler finds by itself; the computation is in `f64` throughout, and `f64` results
    /// are equal to those of [`Lattice::deform_point_with`] to the last bit. Nothing is
    /// allocated. To deform the same points again and again, bind them to the grid with
    /// an [`Embedding`](crate::Embedding).
    ///
    /// # Errors
    ///
    /// * [`FfdError::NonFinitePoint`];
    /// * [`FfdError::PointOutside`] with [`Outside::Error`]; with [`Outside::Clamp`] only
    ///   for a point so far away that its lattice coordinates are not finite;
    ///
    /// each with the index of the first such point. No point is changed then.
    ///
    /// # Example
    ///
    /// ```
    /// use ffd_core::{Degree, Frame, Grid, Lattice, Outside};
    /// use glam::Vec3;
    ///
    /// let grid = Grid::new([Degree::CUBIC; 3], [2, 2, 2], Frame::unit())?;
    /// let displacements = vec![[0.0, 0.5, 0.0]; grid.control_point_count()];
    /// let lattice = Lattice::new(grid, displacements)?;
    /// let mut mesh = [Vec3::ONE, Vec3::new(9.0, 1.0, 1.0)];
    /// let outside = lattice.deform_points(&mut mesh, Outside::Keep)?;
    /// assert_eq!(mesh, [Vec3::new(1.0, 1.5, 1.0), Vec3::new(9.0, 1.0, 1.0)]);
    /// assert_eq!(outside, 1);
    /// # Ok::<(), ffd_core::FfdError>(())
    /// ```
    pub fn deform_points<S, P>(&self, points: &mut [P], outside: Outside) -> Result<usize, FfdError>
    where
        S: Scalar,
        P: Copy + Into<[S; D]> + From<[S; D]>,
    {
        self.check_points::<S, P>(0, points, outside)?;
        Ok(self.deform_checked::<S, P>(Level::new(), points, outside))
    }

    /// [`Lattice::deform_points`] on the threads of the current rayon pool. The result is
    /// the same to the last bit.
    ///
    /// # Errors
    ///
    /// As [`Lattice::deform_points`].
    #[cfg(feature = "rayon")]
    pub fn par_deform_points<S, P>(
        &self,
        points: &mut [P],
        outside: Outside,
    ) -> Result<usize, FfdError>
    where
        S: Scalar,
        P: Copy + Into<[S; D]> + From<[S; D]> + Send + Sync,
    {
        use rayon::prelude::*;

        let first_error = points
            .par_chunks(POINTS_PER_TASK)
            .enumerate()
            .find_map_first(|(task, points)| {
                self.check_points::<S, P>(task * POINTS_PER_TASK, points, outside)
                    .err()
            });
        match first_error {
            Some(error) => Err(error),
            None => {
                let level = Level::new();
                let tasks = points.par_chunks_mut(POINTS_PER_TASK);
                Ok(tasks
                    .map(|points| self.deform_checked::<S, P>(level, points, outside))
                    .sum())
            }
        }
    }

    /// Finds the first point that cannot be deformed; the first of `points` has index
    /// `first`.
    fn check_points<S, P>(
        &self,
        first: usize,
        points: &[P],
        outside: Outside,
    ) -> Result<(), FfdError>
    where
        S: Scalar,
        P: Copy + Into<[S; D]>,
    {
        for (chunk, points) in points.chunks(CHUNK).enumerate() {
            // All at once first: a product with zero is zero, or NaN for what is not finite.
            let mut zeros = [0.0; D];
            for &point in points {
                let world = in_double::<S, P, D>(point);
                for c in 0..D {
                    zeros[c] += 0.0 * world[c];
                }
            }
            if outside == Outside::Keep && !zeros.iter().any(|zero| zero.is_nan()) {
                continue;
            }
            for (i, &point) in points.iter().enumerate() {
                let index = first + chunk * CHUNK + i;
                let world = in_double::<S, P, D>(point);
                check_point(index, world)?;
                locate_with(self.grid(), index, world, outside)?;
            }
        }
        Ok(())
    }

    /// Deforms points that were checked.
    pub(crate) fn deform_checked<S, P>(
        &self,
        level: Level,
        points: &mut [P],
        outside: Outside,
    ) -> usize
    where
        S: Scalar,
        P: Copy + Into<[S; D]> + From<[S; D]>,
    {
        // Through a buffer of one type, so that the loop over it is compiled once.
        let mut buffer = [[0.0; D]; CHUNK];
        let mut places = Places::new();
        let mut count = 0;
        for points in points.chunks_mut(CHUNK) {
            let buffer = &mut buffer[..points.len()];
            for (world, &point) in buffer.iter_mut().zip(&*points) {
                *world = in_double::<S, P, D>(point);
            }
            count +=
                dispatch!(level, simd => self.deform_buffer(simd, buffer, &mut places, outside));
            for (point, world) in points.iter_mut().zip(&*buffer) {
                let mut image = [S::from_f64(0.0); D];
                for c in 0..D {
                    image[c] = S::from_f64(world[c]);
                }
                *point = P::from(image);
            }
        }
        count
    }

    /// Deforms finite points that do not lie outside if that is an error.
    #[inline(always)]
    fn deform_buffer<V: Simd>(
        &self,
        simd: V,
        points: &mut [[f64; D]],
        places: &mut Places<D>,
        outside: Outside,
    ) -> usize {
        let together = self.grid().is_cubic_everywhere();
        if together {
            places.find(simd, self.grid(), points);
        }
        let mut count = 0;
        for (i, world) in points.iter_mut().enumerate() {
            if together && places.is_inside(i) {
                *world = self.moved_cubic(simd, *world, places.cell(i), &places.weights(i));
                continue;
            }
            if let Some(location) = self.grid().locate(*world) {
                *world = self.moved(simd, *world, &location);
                continue;
            }
            count += 1;
            if outside == Outside::Clamp
                && let Some(location) = self.grid().locate_nearest(*world)
            {
                *world = self.moved(simd, *world, &location);
            }
        }
        count
    }
}

#[inline(always)]
fn in_double<S: Scalar, P: Into<[S; D]>, const D: usize>(point: P) -> [f64; D] {
    // Loops, here and above: `array::map` is not inlined everywhere.
    let point: [S; D] = point.into();
    let mut world = [0.0; D];
    for c in 0..D {
        world[c] = point[c].to_f64();
    }
    world
}
