//! The deformation at one point: image, Jacobian, second derivatives.

use fearless_simd::{Level, Simd, dispatch};

use crate::blend::{blend, blend_with_partials};
use crate::bspline::MAX_ORDER;
use crate::frame::unit_entry;
use crate::grid::Location;
use crate::lattice::CellBlock;
use crate::matrix::{Matrix, determinant};
use crate::rows::{Rows, cubic};
use crate::{FfdError, Lattice};

/// What becomes of points outside the domain of a lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Outside {
    /// They stay where they are. With a free border, space is torn along the box.
    #[default]
    Keep,
    /// They move by the displacement of the nearest point of the domain, nearest in
    /// lattice coordinates: each one that is beyond an end is taken back to it.
    Clamp,
    /// They are an error, and nothing is deformed.
    Error,
}

/// The deformation at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation<const D: usize> {
    /// The image of the point.
    pub position: [f64; D],
    /// Entry `[r][c]` is the derivative of coordinate r of the image with respect to
    /// coordinate c of the point.
    pub jacobian: [[f64; D]; D],
    /// The determinant of the Jacobian: how much volume grows, negative where space is
    /// turned inside out.
    pub determinant: f64,
}

impl<const D: usize> Lattice<D> {
    /// The image of a world point. Points outside the domain, and points that are not
    /// finite, stay as they are ([`Outside::Keep`]).
    ///
    /// Displacements are added to the point itself, so a lattice at rest returns it
    /// unchanged, except that −0 becomes 0 inside the domain.
    ///
    /// Costs `Π (degree + 1)` multiplications and additions per coordinate, whatever
    /// the number of cells, and allocates nothing. For many points see
    /// [`Lattice::deform_points`] and [`Embedding`](crate::Embedding), which give the
    /// same results to the last bit.
    #[must_use]
    pub fn deform_point(&self, world: [f64; D]) -> [f64; D] {
        match self.grid().locate(world) {
            Some(location) => self.moved_once(world, &location),
            None => world,
        }
    }

    /// The image of a world point, with a choice of what happens outside the domain.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NonFinitePoint`];
    /// * [`FfdError::PointOutside`] with [`Outside::Error`]; with [`Outside::Clamp`] only
    ///   for a point so far away that its lattice coordinates are not finite. Both carry
    ///   index 0.
    pub fn deform_point_with(
        &self,
        world: [f64; D],
        outside: Outside,
    ) -> Result<[f64; D], FfdError> {
        check_point(0, world)?;
        match locate_with(self.grid(), 0, world, outside)? {
            Some(location) => Ok(self.moved_once(world, &location)),
            None => Ok(world),
        }
    }

    /// Image, Jacobian and determinant at a world point; `None` outside the domain and
    /// for points that are not finite.
    ///
    /// With degree 1 along an axis the derivative jumps at the knots; there it is
    /// that of the cell above, and at the upper border that of the last cell. Where
    /// displacements are near the largest numbers there are, sums may overflow.
    #[must_use]
    pub fn evaluate(&self, world: [f64; D]) -> Option<Evaluation<D>> {
        let location = self.grid().locate(world)?;
        Some(self.evaluate_at(world, &location))
    }

    /// The deformation at a point outside the domain.
    pub(crate) fn evaluate_beyond(&self, world: [f64; D], outside: Outside) -> Evaluation<D> {
        if outside == Outside::Clamp
            && let Some(location) = self.grid().locate_nearest(world)
        {
            let (u, domain) = (self.grid().frame().to_lattice(world), self.grid().domain());
            let clamped = std::array::from_fn(|i| u[i] < domain[i][0] || u[i] > domain[i][1]);
            return self.evaluate_clamped(world, &location, clamped);
        }
        Evaluation {
            position: world,
            jacobian: std::array::from_fn(|r| std::array::from_fn(|c| unit_entry(r, c))),
            determinant: 1.0,
        }
    }

    /// Image, Jacobian and determinant of a point at a known place.
    pub(crate) fn evaluate_at(&self, world: [f64; D], location: &Location<D>) -> Evaluation<D> {
        self.evaluate_clamped(world, location, [false; D])
    }

    /// The same for a point that moves as a place of the domain does, whatever happens
    /// along clamped axes.
    fn evaluate_clamped(
        &self,
        world: [f64; D],
        location: &Location<D>,
        clamped: [bool; D],
    ) -> Evaluation<D> {
        let order = self.grid().order();
        let weights = std::array::from_fn(|axis| {
            let basis = self.grid().basis(axis, location);
            basis.values_and_slopes(order[axis] - 1, location.t[axis], 0.0, 1.0)
        });
        let block = self.block(location.cell);
        let (moved, mut partials) = blend_with_partials(order, &weights, &block, 0.0);
        for axis in (0..D).filter(|&axis| clamped[axis]) {
            partials[axis] = [0.0; D];
        }
        let inverse = self.grid().frame().inverse();
        let jacobian: Matrix<D> = std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let mut chain = partials[0][r] * inverse[0][c];
                for a in 1..D {
                    chain += partials[a][r] * inverse[a][c];
                }
                unit_entry(r, c) + chain
            })
        });
        Evaluation {
            position: std::array::from_fn(|c| world[c] + moved[c]),
            jacobian,
            determinant: determinant(&jacobian),
        }
    }

    /// The second derivatives of the deformation at a world point: entry `[r][a][b]` is
    /// that of coordinate r of the image with respect to coordinates a and b of the
    /// point. `None` outside the domain and for points that are not finite.
    ///
    /// They are continuous for degree 3 and more; where they jump, at knots of lower
    /// degrees, they are those of the cell above.
    #[must_use]
    pub fn second_derivatives(&self, world: [f64; D]) -> Option<[[[f64; D]; D]; D]> {
        let location = self.grid().locate(world)?;
        let order = self.grid().order();
        let rows: [[_; 3]; D] = std::array::from_fn(|axis| {
            let basis = self.grid().basis(axis, &location);
            let (n, t) = (order[axis] - 1, location.t[axis]);
            let [values, slopes] = basis.values_and_slopes(n, t, 0.0, 1.0);
            [values, slopes, basis.curvatures(n, t, 0.0, 1.0)]
        });
        let block = self.block(location.cell);
        // With respect to lattice coordinates a and b.
        let mut inner = [[[0.0; D]; D]; D];
        for a in 0..D {
            for b in 0..D {
                let weights = std::array::from_fn(|axis| {
                    rows[axis][usize::from(axis == a) + usize::from(axis == b)]
                });
                inner[a][b] = blend(order, &weights, &block, 0.0);
            }
        }
        let inverse = self.grid().frame().inverse();
        let mut out = [[[0.0; D]; D]; D];
        for (r, out) in out.iter_mut().enumerate() {
            for (a, out) in out.iter_mut().enumerate() {
                for (b, out) in out.iter_mut().enumerate() {
                    for i in 0..D {
                        for j in 0..D {
                            *out += inner[i][j][r] * inverse[i][a] * inverse[j][b];
                        }
                    }
                }
            }
        }
        Some(out)
    }

    /// The image of a point at a known place.
    fn moved_once(&self, world: [f64; D], location: &Location<D>) -> [f64; D] {
        dispatch!(Level::new(), simd => self.moved(simd, world, location))
    }

    /// The same, within a loop that runs at some SIMD level.
    #[inline(always)]
    pub(crate) fn moved<S: Simd>(
        &self,
        simd: S,
        world: [f64; D],
        location: &Location<D>,
    ) -> [f64; D] {
        let order = self.grid().order();
        let is_cubic = order == [4; D];
        let mut weights = [[0.0; MAX_ORDER]; D];
        for axis in 0..D {
            // Known when compiled, the usual degree is faster.
            let degree = if is_cubic { 3 } else { order[axis] - 1 };
            let basis = self.grid().basis(axis, location);
            weights[axis] = basis.values(degree, location.t[axis], 0.0, 1.0);
        }
        if is_cubic {
            return self.moved_cubic(simd, world, location.cell, &weights);
        }
        let block = self.block(location.cell);
        add(world, blend(order, &weights, &block, 0.0))
    }

    /// The image of a point of a cell of a cubic lattice, with the basis functions there.
    #[inline(always)]
    pub(crate) fn moved_cubic<S: Simd>(
        &self,
        simd: S,
        world: [f64; D],
        cell: [usize; D],
        weights: &[[f64; MAX_ORDER]; D],
    ) -> [f64; D] {
        let block = self.block(cell);
        let moved = match block.rows() {
            Some(rows) => cubic(simd, rows, weights),
            None => cubic_at_border(simd, &block, weights),
        };
        add(world, moved)
    }
}

#[inline(always)]
fn add<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    let mut sum = a;
    for c in 0..D {
        sum[c] += b[c];
    }
    sum
}

/// In a cell some of whose control points are fixed ones of an identity border, which
/// are nowhere in memory.
#[inline(never)]
fn cubic_at_border<S: Simd, const D: usize>(
    simd: S,
    block: &CellBlock<'_, D>,
    weights: &[[f64; MAX_ORDER]; D],
) -> [f64; D] {
    let mut components = [0.0; 4 * 4 * 4 * 3];
    block.gather(&mut components, |component| component);
    let rows = Rows {
        components: &components,
        row: 4 * D,
        plane: 16 * D,
    };
    simd.vectorize(
        #[inline(always)]
        || cubic(simd, rows, weights),
    )
}

/// Where a finite point is evaluated; `None` if it stays as it is.
pub(crate) fn locate_with<const D: usize>(
    grid: &crate::Grid<D>,
    index: usize,
    world: [f64; D],
    outside: Outside,
) -> Result<Option<Location<D>>, FfdError> {
    match outside {
        Outside::Keep => Ok(grid.locate(world)),
        Outside::Clamp | Outside::Error => {
            let location = match outside {
                Outside::Clamp => grid.locate_nearest(world),
                _ => grid.locate(world),
            };
            location.map(Some).ok_or_else(|| FfdError::PointOutside {
                index,
                point: world.to_vec(),
            })
        }
    }
}

pub(crate) fn check_point<const D: usize>(index: usize, point: [f64; D]) -> Result<(), FfdError> {
    match point.iter().position(|c| !c.is_finite()) {
        None => Ok(()),
        Some(component) => Err(FfdError::NonFinitePoint {
            index,
            component,
            value: point[component],
        }),
    }
}
