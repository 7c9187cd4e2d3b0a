//! Recordings: the bytes of devices as they came ([`raw`]), and joint angles and
//! poses as text.
//!
//! The readers of text take all of it, check every number, and name line and
//! value of the first one that is wrong. Work and memory are in proportion to
//! the length of the text.

mod joints;
mod poses;
pub mod raw;

pub use joints::parse_joint_recording;
pub use poses::parse_pose_recording;

use crate::PoseError;

/// Characters of a bad value that an error repeats.
const QUOTED: usize = 24;

/// What is wrong with a recording in text. Lines and values are counted from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// There is nothing but blank lines.
    #[error("the recording is empty")]
    Empty,
    /// A line has too few or too many values.
    #[error("line {line} has {found} values instead of {expected}")]
    ValueCount {
        /// Line number.
        line: usize,
        /// How many values there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A value is `*`: the line is a pattern to match against, not a sample.
    #[error("line {line}, value {value}: `*` stands for any angle, so this is no recorded sample")]
    Wildcard {
        /// Line number.
        line: usize,
        /// Place in the line.
        value: usize,
    },
    /// A value is not a number.
    #[error("line {line}, value {value}: `{text}` is not a number")]
    NotANumber {
        /// Line number.
        line: usize,
        /// Place in the line.
        value: usize,
        /// The beginning of the value.
        text: String,
    },
    /// A value is NaN, infinite, or too large for a double.
    #[error("line {line}, value {value}: `{text}` is not finite")]
    NotFinite {
        /// Line number.
        line: usize,
        /// Place in the line.
        value: usize,
        /// The beginning of the value.
        text: String,
    },
    /// An angle is beyond a full turn.
    #[error(
        "line {line}, value {value}: {angle} is more than a full turn in radians; \
         is the recording in degrees?"
    )]
    BeyondFullTurn {
        /// Line number.
        line: usize,
        /// Place in the line.
        value: usize,
        /// The angle as written.
        angle: f64,
    },
    /// A matrix has fewer or more than four lines.
    #[error("the matrix that begins on line {line} has {found} lines instead of 4")]
    LineCount {
        /// First line of the matrix.
        line: usize,
        /// How many lines it has.
        found: usize,
    },
    /// A matrix is not a pose.
    #[error("the matrix that begins on line {line} is not a pose: {source}")]
    NotAPose {
        /// First line of the matrix.
        line: usize,
        /// What is wrong with it.
        source: PoseError,
    },
}

/// All lines, without their ends, with their numbers.
fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().zip(1..).map(|(line, number)| (number, line))
}

/// Reads one finite number with a decimal point.
fn parse_number(text: &str, line: usize, value: usize) -> Result<f64, RecordingError> {
    let quoted = |text: &str| text.chars().take(QUOTED).collect();
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(_) => Err(RecordingError::NotFinite {
            line,
            value,
            text: quoted(text),
        }),
        Err(_) => Err(RecordingError::NotANumber {
            line,
            value,
            text: quoted(text),
        }),
    }
}
