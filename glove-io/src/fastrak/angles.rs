//! Azimuth, elevation and roll.
//!
//! `R = Rz(azimuth) · Ry(elevation) · Rx(roll)` rotates the receiver's axes
//! into the transmitter's (FASTRAK manual, attitude matrix). The half-angle
//! products below are those of the three quaternions.

use crate::Quaternion;
use crate::math::{atan2, sin_cos, sqrt};

/// Smallest cosine of the elevation at which azimuth and roll are told apart.
///
/// A unit quaternion in double precision gives the arguments of the arc
/// tangents with errors of about 1e-15, so that at this elevation the angles
/// still have an error of 1e-15 / 1e-9 = 1e-6 rad, below the printed digits.
const GIMBAL_LOCK_COSINE: f64 = 1e-9;

/// The quaternion of `[azimuth, elevation, roll]` in radians, each within ±2π.
pub(super) fn to_quaternion(angles_rad: [f64; 3]) -> Quaternion {
    let [(sa, ca), (se, ce), (sr, cr)] = angles_rad.map(|angle| sin_cos(0.5 * angle));
    Quaternion {
        x: ca * ce * sr - sa * se * cr,
        y: ca * se * cr + sa * ce * sr,
        z: sa * ce * cr - ca * se * sr,
        w: ca * ce * cr + sa * se * sr,
    }
}

/// `[azimuth, elevation, roll]` in radians of a unit quaternion.
///
/// With the receiver pointing straight up or down only the sum or difference
/// of azimuth and roll is determined; roll is then zero.
pub(super) fn from_quaternion(q: Quaternion) -> [f64; 3] {
    let Quaternion { x, y, z, w } = q;
    // Elements of the first column and of the last row of the matrix.
    let (r00, r10, r20) = (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y + w * z),
        2.0 * (x * z - w * y),
    );
    let (r21, r22) = (2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y));
    let cosine = sqrt(r00 * r00 + r10 * r10);
    let elevation = atan2(-r20, cosine);
    if cosine < GIMBAL_LOCK_COSINE {
        let (r01, r11) = (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z));
        return [atan2(-r01, r11), elevation, 0.0];
    }
    [atan2(r10, r00), elevation, atan2(r21, r22)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, PI};
    use proptest::prelude::*;

    /// The sine of half the angle between two rotations.
    fn distance(a: Quaternion, b: Quaternion) -> f64 {
        let x = a.w * b.x - a.x * b.w - a.y * b.z + a.z * b.y;
        let y = a.w * b.y - a.y * b.w - a.z * b.x + a.x * b.z;
        let z = a.w * b.z - a.z * b.w - a.x * b.y + a.y * b.x;
        sqrt(x * x + y * y + z * z)
    }

    proptest! {
        /// Angles and quaternion describe the same rotation, gimbal lock included.
        #[test]
        fn angles_of_a_rotation_rebuild_it(
            azimuth in -PI..PI,
            elevation in prop_oneof![-FRAC_PI_2..=FRAC_PI_2, Just(FRAC_PI_2), Just(-FRAC_PI_2)],
            roll in -PI..PI,
        ) {
            let q = to_quaternion([azimuth, elevation, roll]);
            let rebuilt = to_quaternion(from_quaternion(q));
            // Errors of a few ε in R; near gimbal lock individual angles lose
            // digits, but together they stay a rotation within √ε.
            prop_assert!(distance(q, rebuilt) <= f64::EPSILON.sqrt());
        }
    }

    #[test]
    fn documented_quaternion() {
        let q = to_quaternion([30.0, 20.0, 10.0].map(f64::to_radians));
        for (found, printed) in [
            (q.w, 0.951_549),
            (q.x, 0.038_135),
            (q.y, 0.189_308),
            (q.z, 0.239_298),
        ] {
            assert!((found - printed).abs() <= 0.5e-6, "{found}");
        }
        let degrees = from_quaternion(q).map(f64::to_degrees);
        for (found, expected) in degrees.into_iter().zip([30.0, 20.0, 10.0]) {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
    }
}
