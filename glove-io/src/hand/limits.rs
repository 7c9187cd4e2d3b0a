//! Ranges of motion (\[AAOS\], see [the module's references](super#references)),
//! radians, flexion positive.
//!
//! Sensors and their calibration err; a joint never bends further than these.

use std::ops::RangeInclusive;

const fn degrees(low: f64, high: f64) -> RangeInclusive<f64> {
    RangeInclusive::new(low.to_radians(), high.to_radians())
}

/// Flexion at the metacarpophalangeal joints of the four fingers; a little
/// extension is normal.
pub const MCP_FLEXION: RangeInclusive<f64> = degrees(-20.0, 90.0);
/// Flexion at the proximal interphalangeal joints.
pub const PIP_FLEXION: RangeInclusive<f64> = degrees(0.0, 100.0);
/// Flexion at the distal interphalangeal joints.
pub const DIP_FLEXION: RangeInclusive<f64> = degrees(0.0, 90.0);
/// Abduction of a finger from its rest direction.
pub const SPREAD: RangeInclusive<f64> = degrees(-20.0, 20.0);
/// Abduction of the thumb in the plane of the palm.
pub const THUMB_ABDUCTION: RangeInclusive<f64> = degrees(0.0, 70.0);
/// Roll of the thumb across the palm.
pub const THUMB_ROLL: RangeInclusive<f64> = degrees(-30.0, 110.0);
/// Flexion at the thumb's metacarpophalangeal joint.
pub const THUMB_MCP_FLEXION: RangeInclusive<f64> = degrees(-10.0, 50.0);
/// Flexion at the thumb's interphalangeal joint; many thumbs bend back a little.
pub const THUMB_IP_FLEXION: RangeInclusive<f64> = degrees(-20.0, 80.0);
/// Flexion of the little metacarpal that arches the palm.
pub const PALM_ARCH: RangeInclusive<f64> = degrees(0.0, 25.0);
/// Wrist flexion, extension negative.
pub const WRIST_FLEXION: RangeInclusive<f64> = degrees(-70.0, 80.0);
/// Wrist deviation, radial positive.
pub const WRIST_DEVIATION: RangeInclusive<f64> = degrees(-30.0, 20.0);

/// `angle` limited to `range`; NaN becomes the lower end.
#[must_use]
pub fn limited(angle: f64, range: &RangeInclusive<f64>) -> f64 {
    angle.max(*range.start()).min(*range.end())
}
