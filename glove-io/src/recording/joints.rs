//! Joint angles as the VirtualHand software records them.

use core::f64::consts::TAU;

use super::{RecordingError, numbered_lines, parse_number};
use crate::{JointAngles, SENSOR_COUNT};

/// Reads a recording of joint angles.
///
/// Each line is one sample: 22 angles in radians, in the order and with the
/// signs of [`JointAngles`], separated by colons with blanks around them. The
/// decimal mark may be a comma, as on a German or French computer, or a point.
/// Lines end in LF or CR LF; blank lines are ignored. The format has no times:
/// the rate is known to whoever made the recording.
///
/// # Errors
///
/// The first defect, with its line and value counted from 1:
///
/// * [`RecordingError::Empty`] if there is no sample.
/// * [`RecordingError::ValueCount`] if a line does not have 22 values.
/// * [`RecordingError::Wildcard`] if a value is `*`.
/// * [`RecordingError::NotANumber`] or [`RecordingError::NotFinite`] if a value
///   is not a finite number.
/// * [`RecordingError::BeyondFullTurn`] if an angle is outside ±2π, probably
///   because the file is in degrees.
///
/// # Example
///
/// ```
/// use glove_io::{Sensor, recording::parse_joint_recording};
///
/// let line = ["-0,25"; 22].join(" : ");
/// let samples = parse_joint_recording(&format!("{line}\r\n{line}\r\n"))?;
/// assert_eq!(samples.len(), 2);
/// assert_eq!(samples[0][Sensor::IndexPip], -0.25);
/// # Ok::<(), glove_io::recording::RecordingError>(())
/// ```
pub fn parse_joint_recording(text: &str) -> Result<Vec<JointAngles>, RecordingError> {
    let samples = numbered_lines(text)
        .filter(|(_, content)| !content.trim().is_empty())
        .map(|(line, content)| parse_sample(line, content))
        .collect::<Result<Vec<_>, _>>()?;
    if samples.is_empty() {
        return Err(RecordingError::Empty);
    }
    Ok(samples)
}

fn parse_sample(line: usize, content: &str) -> Result<JointAngles, RecordingError> {
    let found = content.split(':').count();
    if found != SENSOR_COUNT {
        return Err(RecordingError::ValueCount {
            line,
            found,
            expected: SENSOR_COUNT,
        });
    }
    let mut angles = JointAngles::default();
    for ((angle, text), value) in angles.0.iter_mut().zip(content.split(':')).zip(1..) {
        let text = text.trim();
        if text == "*" {
            return Err(RecordingError::Wildcard { line, value });
        }
        *angle = if text.contains(',') {
            parse_number(&text.replace(',', "."), line, value)?
        } else {
            parse_number(text, line, value)?
        };
        if angle.abs() > TAU {
            return Err(RecordingError::BeyondFullTurn {
                line,
                value,
                angle: *angle,
            });
        }
    }
    Ok(angles)
}
