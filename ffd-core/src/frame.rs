//! Where a lattice lies in the world.

use crate::FfdError;

/// Axes that span less than this, when scaled to length 1, count as dependent.
///
/// The condition number is then at most 3^1.5 / 1e-10, so lattice coordinates
/// still have about five correct digits.
const SMALLEST_VOLUME: f64 = 1e-10;

/// Lengths of axes whose squares and inverses neither overflow nor underflow.
const LENGTHS: std::ops::RangeInclusive<f64> = 1e-150..=1e150;

/// An affine box: the map from lattice coordinates to the world and back.
///
/// `world = origin + Σ uᵢ axisᵢ`, where lattice coordinate `u = 0` is the corner
/// of the first cell (not the first control point) and `axisᵢ` the world vector
/// of one cell. Axes may be skewed and mirrored. `D` is 2 or 3; any other number
/// does not compile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<const D: usize> {
    origin: [f64; D],
    axes: [[f64; D]; D],
    /// Row i is the gradient of lattice coordinate i.
    inverse: [[f64; D]; D],
}

impl<const D: usize> Frame<D> {
    /// A frame with the given corner, and `axes[i]` as the vector of one cell
    /// along axis i.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NonFiniteOrigin`];
    /// * [`FfdError::AxisLength`] for an axis that is zero or not finite;
    /// * [`FfdError::SingularFrame`] if the axes are linearly dependent, or so
    ///   nearly that coordinates would lose ten digits. The lengths of the axes
    ///   do not matter for that.
    ///
    /// # Example
    ///
    /// ```
    /// use ffd_core::{FfdError, Frame};
    ///
    /// let frame = Frame::new([10.0, 0.0], [[2.0, 0.0], [1.0, 1.0]])?;
    /// assert_eq!(frame.to_world([1.0, 3.0]), [15.0, 3.0]);
    /// assert_eq!(frame.to_lattice([15.0, 3.0]), [1.0, 3.0]);
    /// assert!(Frame::new([0.0, 0.0], [[1.0, 2.0], [2.0, 4.0]]).is_err());
    /// # Ok::<(), FfdError>(())
    /// ```
    pub fn new(origin: [f64; D], axes: [[f64; D]; D]) -> Result<Self, FfdError> {
        const { assert!(D == 2 || D == 3, "lattices have two or three dimensions") };
        for (component, value) in origin.into_iter().enumerate() {
            if !value.is_finite() {
                return Err(FfdError::NonFiniteOrigin { component, value });
            }
        }
        let lengths = axes.map(|a| a.iter().map(|x| x * x).sum::<f64>().sqrt());
        for (axis, length) in lengths.into_iter().enumerate() {
            if !LENGTHS.contains(&length) {
                return Err(FfdError::AxisLength { axis, length });
            }
        }
        let columns: [[f64; D]; D] =
            std::array::from_fn(|i| std::array::from_fn(|c| axes[i][c] / lengths[i]));
        let (mut inverse, volume) = inverse_of_columns(columns);
        // A NaN, too, is no volume.
        if volume.is_nan() || volume < SMALLEST_VOLUME {
            return Err(FfdError::SingularFrame { volume });
        }
        for (row, length) in inverse.iter_mut().zip(lengths) {
            *row = row.map(|x| x / length);
        }
        Ok(Self {
            origin,
            axes,
            inverse,
        })
    }

    /// The frame in which lattice and world coordinates are the same.
    #[must_use]
    pub fn unit() -> Self {
        const { assert!(D == 2 || D == 3, "lattices have two or three dimensions") };
        let identity = std::array::from_fn(|r| std::array::from_fn(|c| unit_entry(r, c)));
        Self {
            origin: [0.0; D],
            axes: identity,
            inverse: identity,
        }
    }

    /// The frame of an axis-aligned box that is divided into `cells`.
    ///
    /// # Errors
    ///
    /// * [`FfdError::NoCells`] if a number of cells is zero;
    /// * those of [`Frame::new`], in particular [`FfdError::AxisLength`] if the box is
    ///   flat.
    ///
    /// `max` may lie below `min`: the axis then points
    /// backwards.
    ///
    /// # Example
    ///
    /// ```
    /// use ffd_core::Frame;
    ///
    /// let frame = Frame::of_box([0.0, 0.0], [1.0, 2.0], [4, 4])?;
    /// assert_eq!(frame.axes(), [[0.25, 0.0], [0.0, 0.5]]);
    /// # Ok::<(), ffd_core::FfdError>(())
    /// ```
    pub fn of_box(min: [f64; D], max: [f64; D], cells: [usize; D]) -> Result<Self, FfdError> {
        if let Some(axis) = cells.iter().position(|&n| n == 0) {
            return Err(FfdError::NoCells { axis });
        }
        let axes = std::array::from_fn(|i| {
            let length = (max[i] - min[i]) / cells[i] as f64;
            std::array::from_fn(|c| if c == i { length } else { 0.0 })
        });
        Self::new(min, axes)
    }

    /// World position of lattice coordinate 0.
    #[must_use]
    pub fn origin(&self) -> [f64; D] {
        self.origin
    }

    /// World vectors of one cell along each axis.
    #[must_use]
    pub fn axes(&self) -> [[f64; D]; D] {
        self.axes
    }

    /// The Jacobian of [`Frame::to_lattice`]: row i is the gradient of lattice
    /// coordinate i.
    #[must_use]
    pub fn inverse(&self) -> [[f64; D]; D] {
        self.inverse
    }

    /// The world position of lattice coordinates `u`.
    #[must_use]
    pub fn to_world(&self, u: [f64; D]) -> [f64; D] {
        std::array::from_fn(|c| {
            let along: f64 = (0..D).map(|i| u[i] * self.axes[i][c]).sum();
            self.origin[c] + along
        })
    }

    /// The lattice coordinates of a world position.
    #[must_use]
    #[inline(always)]
    pub fn to_lattice(&self, world: [f64; D]) -> [f64; D] {
        // Loops, so that everything is inlined into the loops over points.
        let mut from_origin = world;
        for c in 0..D {
            from_origin[c] -= self.origin[c];
        }
        let mut u = [0.0; D];
        for i in 0..D {
            u[i] = self.inverse[i][0] * from_origin[0];
            for c in 1..D {
                u[i] += self.inverse[i][c] * from_origin[c];
            }
        }
        u
    }
}

/// Entry of the identity matrix.
pub(crate) fn unit_entry(row: usize, column: usize) -> f64 {
    if row == column { 1.0 } else { 0.0 }
}

/// The inverse of the matrix with the given columns, and the absolute value of
/// its determinant, by Gauss–Jordan elimination with row pivots. If that is zero the
/// inverse means nothing.
fn inverse_of_columns<const D: usize>(columns: [[f64; D]; D]) -> ([[f64; D]; D], f64) {
    let mut left: [[f64; D]; D] = std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]));
    let mut right = std::array::from_fn(|r| std::array::from_fn(|c| unit_entry(r, c)));
    let mut volume = 1.0;
    for k in 0..D {
        let pivot = (k..D)
            .max_by(|&a, &b| left[a][k].abs().total_cmp(&left[b][k].abs()))
            .unwrap_or(k);
        left.swap(k, pivot);
        right.swap(k, pivot);
        let scale = left[k][k];
        volume *= scale.abs();
        if volume == 0.0 {
            return (right, 0.0);
        }
        left[k] = left[k].map(|x| x / scale);
        right[k] = right[k].map(|x| x / scale);
        let (left_k, right_k): ([f64; D], [f64; D]) = (left[k], right[k]);
        for r in (0..D).filter(|&r| r != k) {
            let factor = left[r][k];
            for c in 0..D {
                left[r][c] -= factor * left_k[c];
                right[r][c] -= factor * right_k[c];
            }
        }
    }
    (right, volume)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::array::{uniform2, uniform3};
    use proptest::prelude::*;

    /// The round trip through a frame with entries up to 2 at points up to 20
    /// cells away. If the axes span at least 0.1 when scaled to length 1, the
    /// scaled matrix has a condition number of at most D^(D/2) / 0.1 < 52
    /// (singular values multiply to the volume and none is above √D), and
    /// elimination loses at most a few times that: 200 ε relative to the
    /// farthest corner, in units of the shortest axis.
    fn check_round_trip<const D: usize>(
        frame: &Frame<D>,
        u: [f64; D],
    ) -> Result<(), TestCaseError> {
        let lengths = frame
            .axes()
            .map(|a| a.iter().map(|x| x * x).sum::<f64>().sqrt());
        let shortest = lengths.into_iter().fold(f64::INFINITY, f64::min);
        let far = 20.0 * lengths.iter().sum::<f64>() + 100.0;
        let tolerance = 200.0 * f64::EPSILON * 52.0 * far / shortest;
        let back = frame.to_lattice(frame.to_world(u));
        for i in 0..D {
            prop_assert!((back[i] - u[i]).abs() <= tolerance, "{back:?} from {u:?}");
        }
        Ok(())
    }

    fn volume<const D: usize>(axes: [[f64; D]; D]) -> f64 {
        let scaled = axes.map(|a| {
            let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
            a.map(|x| x / length)
        });
        inverse_of_columns(scaled).1
    }

    proptest! {
        /// Lattice coordinates survive the way to the world and back in 2-D …
        #[test]
        fn round_trip_2d(
            origin in uniform2(-50.0..50.0_f64),
            axes in uniform2(uniform2(-2.0..2.0_f64)).prop_filter("flat", |&a| volume(a) > 0.1),
            u in uniform2(-20.0..20.0_f64),
        ) {
            check_round_trip(&Frame::new(origin, axes).unwrap(), u)?;
        }

        /// … and in 3-D.
        #[test]
        fn round_trip_3d(
            origin in uniform3(-50.0..50.0_f64),
            axes in uniform3(uniform3(-2.0..2.0_f64)).prop_filter("flat", |&a| volume(a) > 0.1),
            u in uniform3(-20.0..20.0_f64),
        ) {
            check_round_trip(&Frame::new(origin, axes).unwrap(), u)?;
        }
    }

    #[test]
    fn scale_does_not_make_a_frame_singular() {
        for scale in [1e-140, 1.0, 1e140] {
            let frame = Frame::new(
                [0.0; 3],
                [[scale, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
            );
            let u = frame.unwrap().to_lattice([scale, 2.0, 3.0]);
            for (found, expected) in u.into_iter().zip([1.0, 2.0, -3.0]) {
                assert!((found - expected).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn bad_frames_are_named() {
        let axes = [[1.0, 0.0], [0.0, 1.0]];
        assert!(matches!(
            Frame::new([0.0, f64::NAN], axes),
            Err(FfdError::NonFiniteOrigin { component: 1, value }) if value.is_nan()
        ));
        for bad in [0.0, 1e-200, 1e200, f64::INFINITY, f64::NAN] {
            let result = Frame::new([0.0; 2], [[1.0, 0.0], [0.0, bad]]);
            assert!(
                matches!(result, Err(FfdError::AxisLength { axis: 1, .. })),
                "{bad}"
            );
        }
        for tilt in [0.0, 1e-12] {
            let flat = [[1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [5.0, 5.0, tilt]];
            let result = Frame::new([0.0; 3], flat);
            assert!(matches!(result, Err(FfdError::SingularFrame { volume }) if volume < 1e-10));
        }
    }
}
