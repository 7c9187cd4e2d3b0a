//! The deformation of points, and its Jacobian.
//!
//! A point in cell `(s, …)` is moved by the `(degree + 1)^D` control points from
//! `s` on in each direction, weighted by a product of basis functions, one per
//! axis. The sum is taken along the first axis first, where control points lie
//! next to each other in memory.

use crate::Lattice;
use crate::bspline::{MAX_ORDER, uniform_basis};
use crate::frame::unit_entry;

/// Where a point is: its first control point, and the basis functions of every
/// axis with `ROWS − 1` derivatives.
struct Located<const D: usize, const ROWS: usize> {
    first_control_point: usize,
    basis: [[[f64; MAX_ORDER]; ROWS]; D],
}

impl<const D: usize> Lattice<D> {
    /// The image of a world point; `None` outside the closed box of the lattice
    /// and for points that are not finite.
    ///
    /// Displacements are added to the point itself, so a lattice at rest returns
    /// it unchanged to the last bit, except that −0 becomes 0. The border is
    /// decided in computed lattice coordinates: in a frame that rounds, a point
    /// on it may fall on either side.
    ///
    /// Costs `Π (degree + 1)` multiplications and additions per coordinate,
    /// whatever the number of cells, and allocates nothing.
    #[must_use]
    pub fn deform_point(&self, world: [f64; D]) -> Option<[f64; D]> {
        let located = self.locate::<1>(world)?;
        let weights = located.basis.map(|[values]| values);
        let moved = self.blend(&weights, located.first_control_point);
        Some(std::array::from_fn(|c| world[c] + moved[c]))
    }

    /// The Jacobian of the deformation at a world point: entry `[r][c]` is the
    /// derivative of coordinate r of the image with respect to coordinate c of
    /// the point. `None` where [`Lattice::deform_point`] has no image.
    ///
    /// With degree 1 along an axis the derivative jumps at the knots; there it is
    /// that of the cell above, and at the upper border that of the last cell.
    #[must_use]
    pub fn jacobian_at(&self, world: [f64; D]) -> Option<[[f64; D]; D]> {
        let located = self.locate::<2>(world)?;
        // Derivatives with respect to each lattice coordinate.
        let partials: [[f64; D]; D] = std::array::from_fn(|axis| {
            let weights = std::array::from_fn(|a| located.basis[a][usize::from(a == axis)]);
            self.blend(&weights, located.first_control_point)
        });
        let inverse = self.frame().inverse();
        Some(std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let chain: f64 = (0..D).map(|a| partials[a][r] * inverse[a][c]).sum();
                unit_entry(r, c) + chain
            })
        }))
    }

    fn locate<const ROWS: usize>(&self, world: [f64; D]) -> Option<Located<D, ROWS>> {
        let coordinates = self.frame().to_lattice(world);
        let per_axis = self.control_points_per_axis();
        let mut located = Located {
            first_control_point: 0,
            basis: [[[0.0; MAX_ORDER]; ROWS]; D],
        };
        let mut stride = 1;
        for axis in 0..D {
            let (u, cells) = (coordinates[axis], self.cells()[axis]);
            if !(0.0..=cells as f64).contains(&u) {
                return None;
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "u is in [0, cells]"
            )]
            let cell = (u as usize).min(cells - 1);
            located.first_control_point += cell * stride;
            stride *= per_axis[axis];
            let t = u - cell as f64;
            uniform_basis(self.degree()[axis], t, &mut located.basis[axis]);
        }
        Some(located)
    }

    /// The displacements from control point `first` on, weighted by a product of
    /// one weight per axis.
    fn blend(&self, weights: &[[f64; MAX_ORDER]; D], first: usize) -> [f64; D] {
        let per_axis = self.control_points_per_axis();
        self.blend_axes(weights, D - 1, per_axis[..D - 1].iter().product(), first)
    }

    /// The same for axes `0..=axis`, where `stride` is the distance between two
    /// control points along `axis`.
    fn blend_axes(
        &self,
        weights: &[[f64; MAX_ORDER]; D],
        axis: usize,
        stride: usize,
        first: usize,
    ) -> [f64; D] {
        let mut sum = [0.0; D];
        for (j, weight) in weights[axis][..self.degree()[axis].order()]
            .iter()
            .enumerate()
        {
            let start = first + j * stride;
            let term = if axis == 0 {
                self.displacements()[start]
            } else {
                let below = axis - 1;
                let stride = stride / self.control_points_per_axis()[below];
                self.blend_axes(weights, below, stride, start)
            };
            for c in 0..D {
                sum[c] += weight * term[c];
            }
        }
        sum
    }
}
