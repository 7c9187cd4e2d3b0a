//! From sensor bytes to joint angles and back.
//!
//! A bend sensor is close to linear, so each one has an offset and a gain in
//! the form of the VirtualHand library,
//!
//! ```text
//! angle = −gain · (raw − offset)        raw = offset − angle / gain
//! ```
//!
//! with the angle in radians and raw values in counts 1–255. With a positive
//! gain a larger count means more flexion, which is a more negative angle.

use crate::joints::{JointAngles, SENSOR_COUNT, Sensor};

/// Offset and gain of one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorCalibration {
    /// Raw value at angle zero, in counts; need not be a whole number.
    pub offset: f64,
    /// Radians per count, sign reversed: `angle = −gain · (raw − offset)`.
    pub gain: f64,
}

impl SensorCalibration {
    /// Maps count 1 to `first_rad` and count 255 to `last_rad`.
    const fn spanning(first_rad: f64, last_rad: f64) -> Self {
        let gain = (first_rad - last_rad) / 254.0;
        Self {
            offset: 1.0 + first_rad / gain,
            gain,
        }
    }

    /// The angle in radians of a raw value.
    #[must_use]
    pub fn angle(&self, raw: u8) -> f64 {
        -self.gain * (f64::from(raw) - self.offset)
    }

    /// The raw value of an angle, before truncation and clamping.
    fn raw(&self, angle_rad: f64) -> f64 {
        self.offset - angle_rad / self.gain
    }
}

/// Offsets and gains of all 22 sensors, checked when it is made.
///
/// This is the sensor map alone: abductions stay relative between neighbouring
/// fingers.
///
/// # Example
///
/// ```
/// use glove_io::{Calibration, Sensor};
///
/// let calibration = Calibration::average();
/// let angles = calibration.angles(&[128; 22]);
/// // Half way between +0.80 and −2.45 rad.
/// assert!((angles[Sensor::IndexPip] - -0.825).abs() < 1e-12);
///
/// let (raw, clamped) = calibration.raw_values(&angles);
/// assert_eq!(clamped, 0);
/// assert!(raw.iter().all(|&value| value.abs_diff(128) <= 1));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    sensors: [SensorCalibration; SENSOR_COUNT],
}

impl Calibration {
    /// Takes one offset and gain per sensor, in record order.
    ///
    /// # Errors
    ///
    /// * [`CalibrationError::NotFinite`] if an offset or a gain is NaN or
    ///   infinite.
    /// * [`CalibrationError::ZeroGain`] if a gain is zero: the sensor would
    ///   report the same angle for every raw value.
    pub fn try_new(sensors: [SensorCalibration; SENSOR_COUNT]) -> Result<Self, CalibrationError> {
        for (sensor, calibration) in Sensor::ALL.into_iter().zip(sensors) {
            let SensorCalibration { offset, gain } = calibration;
            if !(offset.is_finite() && gain.is_finite()) {
                return Err(CalibrationError::NotFinite {
                    sensor,
                    offset,
                    gain,
                });
            }
            if gain == 0.0 {
                return Err(CalibrationError::ZeroGain { sensor });
            }
        }
        Ok(Self { sensors })
    }

    /// A stated default for simulators and for a first look without calibration.
    ///
    /// It spreads the counts 1–255 evenly over the ranges below. It belongs to
    /// no real glove, whose sensors differ by tens of counts, and a knuckle bent
    /// far backwards, by 0.7 rad say, is beyond its range.
    ///
    /// | sensors | count 1 | count 255 |
    /// |---|---|---|
    /// | flexion of thumb and fingers | +0.80 rad | −2.45 rad |
    /// | thumb roll | +0.5 rad | −2.0 rad |
    /// | all abductions, palm arch | +1.2 rad | −1.2 rad |
    /// | wrist pitch and yaw | +1.6 rad | −1.6 rad |
    #[must_use]
    pub fn average() -> Self {
        Self {
            sensors: Sensor::ALL.map(|sensor| match sensor {
                Sensor::ThumbRoll => SensorCalibration::spanning(0.5, -2.0),
                Sensor::ThumbAbduction
                | Sensor::MiddleIndexAbduction
                | Sensor::RingMiddleAbduction
                | Sensor::LittleRingAbduction
                | Sensor::PalmArch => SensorCalibration::spanning(1.2, -1.2),
                Sensor::WristPitch | Sensor::WristYaw => SensorCalibration::spanning(1.6, -1.6),
                _ => SensorCalibration::spanning(0.80, -2.45),
            }),
        }
    }

    /// Offsets and gains in record order.
    #[must_use]
    pub fn sensors(&self) -> &[SensorCalibration; SENSOR_COUNT] {
        &self.sensors
    }

    /// The joint angles of a record of the 22-sensor glove.
    #[must_use]
    pub fn angles(&self, raw: &[u8; SENSOR_COUNT]) -> JointAngles {
        let mut angles = JointAngles::default();
        for ((angle, calibration), &raw) in angles.0.iter_mut().zip(&self.sensors).zip(raw) {
            *angle = calibration.angle(raw);
        }
        angles
    }

    /// The record a glove would send for these angles, and how many values had
    /// to be clamped.
    ///
    /// Raw values are truncated toward zero, then clamped to 1–255, as the
    /// VirtualHand library does. Where nothing is clamped,
    /// [`angles`](Self::angles) gives every angle back to within one count,
    /// that is, `|gain|`. A NaN becomes 1 and counts as clamped.
    #[must_use]
    pub fn raw_values(&self, angles: &JointAngles) -> ([u8; SENSOR_COUNT], usize) {
        let mut raw = [1; SENSOR_COUNT];
        let mut clamped = 0;
        for ((raw, calibration), &angle) in raw.iter_mut().zip(&self.sensors).zip(&angles.0) {
            let exact = calibration.raw(angle);
            if !(1.0..256.0).contains(&exact) {
                clamped += 1;
            }
            *raw = truncate(exact).max(1);
        }
        (raw, clamped)
    }
}

/// Truncates toward zero into 0–255; NaN becomes 0.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the saturating cast is the truncation and the upper clamp"
)]
fn truncate(raw: f64) -> u8 {
    raw as u8
}

/// Why offsets and gains are not a calibration.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// An offset or a gain is NaN or infinite.
    #[error("the calibration of {sensor:?} is not finite: offset {offset}, gain {gain}")]
    NotFinite {
        /// The sensor concerned.
        sensor: Sensor,
        /// Its offset.
        offset: f64,
        /// Its gain.
        gain: f64,
    },
    /// A gain is zero.
    #[error("the gain of {sensor:?} is zero, so its angle would never change")]
    ZeroGain {
        /// The sensor concerned.
        sensor: Sensor,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Inside the range, decoding an encoded angle errs by one count at most.
        #[test]
        fn one_count_is_all_that_is_lost(
            offset in 20.0..230.0_f64,
            gain in prop_oneof![-0.03..-0.002_f64, 0.002..0.03_f64],
            exact_raw in 1.0..255.0_f64,
        ) {
            let sensor = SensorCalibration { offset, gain };
            let calibration = Calibration::try_new([sensor; SENSOR_COUNT])?;
            let angle = -gain * (exact_raw - offset);
            let (raw, clamped) = calibration.raw_values(&JointAngles([angle; SENSOR_COUNT]));
            let decoded = calibration.angles(&raw)[Sensor::IndexMcp];
            // Six roundings, each of a number below 512 counts, shift the raw
            // value by less than 6 · 512 ε / 2 before it is truncated.
            let tol = gain.abs() * (1.0 + 2048.0 * f64::EPSILON);
            prop_assert!((decoded - angle).abs() <= tol, "{decoded} for {angle}");
            // Rounding may push an exact 1.0 just below the range.
            prop_assert!(clamped == 0 || exact_raw < 1.0 + 1e-9);
        }

        /// Counts survive a round trip up to the truncation of a rounded value.
        #[test]
        fn every_count_is_reached(raw in 1_u8..=255) {
            let calibration = Calibration::average();
            let angles = calibration.angles(&[raw; SENSOR_COUNT]);
            for value in calibration.raw_values(&angles).0 {
                prop_assert!(value == raw || value + 1 == raw);
            }
        }
    }

    #[test]
    fn the_average_covers_the_stated_ranges() {
        let average = Calibration::average();
        let (first, last) = (average.angles(&[1; 22]), average.angles(&[255; 22]));
        for (sensor, from, to) in [
            (Sensor::ThumbIp, 0.80, -2.45),
            (Sensor::LittleDip, 0.80, -2.45),
            (Sensor::ThumbRoll, 0.5, -2.0),
            (Sensor::LittleRingAbduction, 1.2, -1.2),
            (Sensor::PalmArch, 1.2, -1.2),
            (Sensor::WristYaw, 1.6, -1.6),
        ] {
            // A handful of roundings at magnitude 255 counts · 0.0126 rad.
            assert!((first[sensor] - from).abs() < 1e-14);
            assert!((last[sensor] - to).abs() < 1e-14);
        }
    }

    #[test]
    fn values_beyond_the_range_are_clamped_and_counted() {
        let mut angles = JointAngles([0.0; 22]);
        angles[Sensor::IndexMcp] = -9.0;
        angles[Sensor::IndexPip] = 9.0;
        angles[Sensor::IndexDip] = f64::NAN;
        let (raw, clamped) = Calibration::average().raw_values(&angles);
        assert_eq!(raw[4..7], [255, 1, 1]);
        assert_eq!(clamped, 3);
    }

    #[test]
    fn useless_values_are_refused() {
        let good = SensorCalibration {
            offset: 50.0,
            gain: 0.4,
        };
        let mut sensors = [good; SENSOR_COUNT];
        sensors[3].gain = 0.0;
        assert_eq!(
            Calibration::try_new(sensors),
            Err(CalibrationError::ZeroGain {
                sensor: Sensor::ThumbAbduction
            })
        );
        sensors[2].offset = f64::INFINITY;
        assert!(matches!(
            Calibration::try_new(sensors),
            Err(CalibrationError::NotFinite {
                sensor: Sensor::ThumbIp,
                ..
            })
        ));
    }
}
