//! Positions and orientations in the world frame.

use crate::math::sqrt;

/// A rotation as a quaternion `w + x i + y j + z k`.
///
/// Of unit length wherever this crate hands it out in a [`Pose`]. `q` and `−q`
/// are the same rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quaternion {
    /// Coefficient of i.
    pub x: f64,
    /// Coefficient of j.
    pub y: f64,
    /// Coefficient of k.
    pub z: f64,
    /// Scalar part, the cosine of half the angle of rotation.
    pub w: f64,
}

impl Quaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self {
        x: 0.0,
        y: 0.0,
        z: 0.0,
        w: 1.0,
    };

    /// The quaternion of unit length in the same direction.
    ///
    /// `None` if there is none within reach of double precision: a component
    /// is not finite, or the squared length over- or underflows.
    ///
    /// # Example
    ///
    /// ```
    /// let q = glove_io::Quaternion { x: 0.0, y: 3.0, z: 0.0, w: 4.0 };
    /// let unit = q.normalized().unwrap();
    /// assert!((unit.y - 0.6).abs() < 1e-15 && (unit.w - 0.8).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn normalized(self) -> Option<Self> {
        let squared = self.x * self.x + self.y * self.y + self.z * self.z + self.w * self.w;
        if !squared.is_normal() {
            return None;
        }
        let length = sqrt(squared);
        Some(Self {
            x: self.x / length,
            y: self.y / length,
            z: self.z / length,
            w: self.w / length,
        })
    }
}

impl Default for Quaternion {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// A position and an orientation in the world frame.
///
/// The world is right-handed with x to the right, y up and −z forward (OpenXR).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position `[x, y, z]` in metres.
    pub position_m: [f64; 3],
    /// Rotation from the body's axes to the world's.
    pub orientation: Quaternion,
}

impl Pose {
    /// At the origin, axes parallel to the world's.
    pub const IDENTITY: Self = Self {
        position_m: [0.0; 3],
        orientation: Quaternion::IDENTITY,
    };

    /// Largest departure from `RᵀR = I` that [`from_matrix`](Self::from_matrix)
    /// accepts.
    ///
    /// A component printed with six significant digits is wrong by at most
    /// e = 5·10⁻⁷, and a unit column `a` has `|a₁| + |a₂| + |a₃| ≤ √3`. The dot
    /// product of two columns is then wrong by at most `2√3 e + 3e²`, which is
    /// 1.74·10⁻⁶. Twice that is allowed, for recorders that computed in single
    /// precision before they printed.
    pub const ORTHONORMALITY_TOLERANCE: f64 = 3.5e-6;

    /// Reads a row-major homogeneous matrix `[R t; 0 1]`.
    ///
    /// The translation is in metres. The rotation may carry the rounding of
    /// six printed digits; the resulting quaternion has unit length.
    ///
    /// # Errors
    ///
    /// * [`PoseError::NotFinite`] if an entry is NaN or infinite.
    /// * [`PoseError::LastRow`] if the last row is not `0 0 0 1`.
    /// * [`PoseError::NotOrthonormal`] if the columns of R are not orthonormal
    ///   within [`ORTHONORMALITY_TOLERANCE`](Self::ORTHONORMALITY_TOLERANCE).
    /// * [`PoseError::Reflection`] if `det R < 0`.
    ///
    /// # Example
    ///
    /// A quarter turn about the upward axis takes −z (forward) to −x (left):
    ///
    /// ```
    /// # use glove_io::Pose;
    /// let pose = Pose::from_matrix(&[
    ///     [0.0, 0.0, 1.0, 0.3],
    ///     [0.0, 1.0, 0.0, 1.2],
    ///     [-1.0, 0.0, 0.0, -0.5],
    ///     [0.0, 0.0, 0.0, 1.0],
    /// ])?;
    /// assert_eq!(pose.position_m, [0.3, 1.2, -0.5]);
    /// assert!((pose.orientation.y - 0.5_f64.sqrt()).abs() < 1e-15);
    /// # Ok::<(), glove_io::PoseError>(())
    /// ```
    #[expect(
        clippy::missing_panics_doc,
        reason = "a matrix that passed the checks has a quaternion"
    )]
    pub fn from_matrix(matrix: &[[f64; 4]; 4]) -> Result<Self, PoseError> {
        for (row, values) in matrix.iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                if !value.is_finite() {
                    return Err(PoseError::NotFinite { row, column });
                }
            }
        }
        #[expect(
            clippy::float_cmp,
            reason = "recorders print exactly these digits, and other rows mean something else"
        )]
        if matrix[3] != [0.0, 0.0, 0.0, 1.0] {
            return Err(PoseError::LastRow { found: matrix[3] });
        }
        let m = |row: usize, column: usize| matrix[row][column];
        for a in 0..3 {
            for b in a..3 {
                let dot = m(0, a) * m(0, b) + m(1, a) * m(1, b) + m(2, a) * m(2, b);
                let expected = if a == b { 1.0 } else { 0.0 };
                let departure = (dot - expected).abs();
                // A product of huge entries may overflow to NaN: refuse it too.
                if departure.is_nan() || departure > Self::ORTHONORMALITY_TOLERANCE {
                    return Err(PoseError::NotOrthonormal { departure });
                }
            }
        }
        let det = m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1))
            - m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0))
            + m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0));
        if det < 0.0 {
            return Err(PoseError::Reflection);
        }
        let orientation = quaternion_of_rotation(matrix)
            .normalized()
            .expect("Shepperd's quaternion of a rotation has a length of at least two");
        Ok(Self {
            position_m: [m(0, 3), m(1, 3), m(2, 3)],
            orientation,
        })
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// A multiple of the quaternion of a rotation matrix.
///
/// S. W. Shepperd, *Quaternion from rotation matrix*, Journal of Guidance and
/// Control 1(3), 1978: of the four formulas take the one whose divisor is the
/// largest component; here, leave the division to the normalisation.
fn quaternion_of_rotation(m: &[[f64; 4]; 4]) -> Quaternion {
    let (xx, yy, zz) = (m[0][0], m[1][1], m[2][2]);
    // Off-diagonal sums and differences: 4xy, 4xz, 4yz and 4wx, 4wy, 4wz.
    let (xy, xz, yz) = (m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]);
    let (wx, wy, wz) = (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]);
    let squares = [
        1.0 + xx - yy - zz,
        1.0 - xx + yy - zz,
        1.0 - xx - yy + zz,
        1.0 + xx + yy + zz,
    ];
    let largest = squares.iter().copied().fold(f64::MIN, f64::max);
    let [x, y, z, w] = if squares[3] >= largest {
        [wx, wy, wz, squares[3]]
    } else if squares[0] >= largest {
        [squares[0], xy, xz, wx]
    } else if squares[1] >= largest {
        [xy, squares[1], yz, wy]
    } else {
        [xz, yz, squares[2], wz]
    };
    Quaternion { x, y, z, w }
}

/// Why a matrix is not a pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// An entry is NaN or infinite.
    #[error("the entry in row {row}, column {column} (counted from 0) is not finite")]
    NotFinite {
        /// Row, counted from 0.
        row: usize,
        /// Column, counted from 0.
        column: usize,
    },
    /// The last row of a homogeneous matrix must be `0 0 0 1`.
    #[error("the last row is {found:?} where a pose has [0, 0, 0, 1]")]
    LastRow {
        /// The last row as it is.
        found: [f64; 4],
    },
    /// The upper left 3×3 block is not a rotation.
    #[error("the columns of the rotation depart by {departure:.1e} from being orthonormal")]
    NotOrthonormal {
        /// The offending entry of `|RᵀR − I|`.
        departure: f64,
    },
    /// The upper left 3×3 block mirrors space.
    #[error("the determinant is negative: the matrix mirrors, it does not rotate")]
    Reflection,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The rotation matrix of a unit quaternion.
    fn matrix(q: Quaternion, t: [f64; 3]) -> [[f64; 4]; 4] {
        let Quaternion { x, y, z, w } = q;
        [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - w * z),
                2.0 * (x * z + w * y),
                t[0],
            ],
            [
                2.0 * (x * y + w * z),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - w * x),
                t[1],
            ],
            [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                1.0 - 2.0 * (x * x + y * y),
                t[2],
            ],
            [0.0, 0.0, 0.0, 1.0],
        ]
    }

    fn unit() -> impl Strategy<Value = Quaternion> {
        [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0, -1.0..1.0].prop_filter_map(
            "too short to normalise well",
            |[x, y, z, w]| {
                (x * x + y * y + z * z + w * w > 0.01)
                    .then(|| Quaternion { x, y, z, w }.normalized())
                    .flatten()
            },
        )
    }

    proptest! {
        /// The matrix of a unit quaternion gives that quaternion back, up to sign.
        #[test]
        fn matrices_give_their_quaternion_back(q in unit()) {
            let pose = Pose::from_matrix(&matrix(q, [1.0, 2.0, 3.0]))?;
            let p = pose.orientation;
            let dot = p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w;
            // Entries carry a few ε; Shepperd's divisor is at least 1 of 2.
            for (a, b) in [(p.x, q.x), (p.y, q.y), (p.z, q.z), (p.w, q.w)] {
                prop_assert!((a - b * dot.signum()).abs() <= 16.0 * f64::EPSILON);
            }
        }

        /// Rounding to six digits is forgiven; an error 20 times larger is not.
        #[test]
        fn six_printed_digits_suffice(q in unit()) {
            let mut printed = matrix(q, [0.0; 3]);
            for value in printed[..3].iter_mut().flat_map(|row| &mut row[..3]) {
                *value = format!("{value:.6}").parse().expect("a printed number parses");
            }
            prop_assert!(Pose::from_matrix(&printed).is_ok());
            for row in &mut printed[..3] {
                row[1] *= 1.0 + 1e-5;
            }
            let refused = matches!(
                Pose::from_matrix(&printed),
                Err(PoseError::NotOrthonormal { .. })
            );
            prop_assert!(refused);
        }
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "components of half turns are exact")]
    fn half_turns_use_every_branch() {
        for (axis, m) in [[1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]
            .into_iter()
            .enumerate()
        {
            let mut matrix = [[0.0; 4]; 4];
            for i in 0..3 {
                matrix[i][i] = m[i];
            }
            matrix[3][3] = 1.0;
            let q = Pose::from_matrix(&matrix).unwrap().orientation;
            assert_eq!([q.x, q.y, q.z][axis], 1.0);
            assert_eq!(q.w, 0.0);
        }
    }

    #[test]
    fn errors_name_the_cause() {
        let good = matrix(Quaternion::IDENTITY, [0.0; 3]);
        let mut bad = good;
        bad[1][3] = f64::NAN;
        assert_eq!(
            Pose::from_matrix(&bad),
            Err(PoseError::NotFinite { row: 1, column: 3 })
        );
        let mut bad = good;
        bad[3][0] = 0.1;
        assert!(matches!(
            Pose::from_matrix(&bad),
            Err(PoseError::LastRow { .. })
        ));
        let mut bad = good;
        bad[2][2] = -1.0;
        assert_eq!(Pose::from_matrix(&bad), Err(PoseError::Reflection));
        let mut bad = good;
        bad[0][0] = 1e200;
        assert!(matches!(
            Pose::from_matrix(&bad),
            Err(PoseError::NotOrthonormal { .. })
        ));
    }
}
