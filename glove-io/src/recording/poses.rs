//! Poses as homogeneous matrices.

use super::{RecordingError, numbered_lines, parse_number};
use crate::Pose;

/// Reads a recording of poses.
///
/// Each pose is a homogeneous matrix: four lines of four numbers separated by
/// blanks, the translation in metres in the last column. Blank lines separate
/// the matrices. Lines end in LF or CR LF. The poses are in the frame of the
/// file, whichever that is; nothing is converted.
///
/// # Errors
///
/// The first defect, with its line and value counted from 1:
///
/// * [`RecordingError::Empty`] if there is no matrix.
/// * [`RecordingError::ValueCount`] if a line does not have four numbers.
/// * [`RecordingError::NotANumber`] or [`RecordingError::NotFinite`] if a value
///   is not a finite number.
/// * [`RecordingError::LineCount`] if a matrix does not have four lines.
/// * [`RecordingError::NotAPose`] if [`Pose::from_matrix`] refuses it.
///
/// # Example
///
/// ```
/// use glove_io::recording::parse_pose_recording;
///
/// let text = "1 0 0 0.5\n0 1 0 1.1\n0 0 1 0\n0 0 0 1\n";
/// let poses = parse_pose_recording(text)?;
/// assert_eq!(poses[0].position_m, [0.5, 1.1, 0.0]);
/// # Ok::<(), glove_io::recording::RecordingError>(())
/// ```
pub fn parse_pose_recording(text: &str) -> Result<Vec<Pose>, RecordingError> {
    let mut poses = Vec::new();
    let mut block = Block::default();
    for (line, content) in numbered_lines(text) {
        if content.trim().is_empty() {
            poses.extend(block.finish()?);
        } else {
            block.add(line, content)?;
        }
    }
    poses.extend(block.finish()?);
    if poses.is_empty() {
        return Err(RecordingError::Empty);
    }
    Ok(poses)
}

/// The lines of a matrix read so far.
#[derive(Default)]
struct Block {
    first_line: usize,
    line_count: usize,
    matrix: [[f64; 4]; 4],
}

impl Block {
    fn add(&mut self, line: usize, content: &str) -> Result<(), RecordingError> {
        if self.line_count == 0 {
            self.first_line = line;
        }
        let row = parse_row(line, content)?;
        // Surplus lines are only counted: `finish` reports how many there are.
        if let Some(place) = self.matrix.get_mut(self.line_count) {
            *place = row;
        }
        self.line_count += 1;
        Ok(())
    }

    /// Ends the matrix, if one has begun.
    fn finish(&mut self) -> Result<Option<Pose>, RecordingError> {
        let block = std::mem::take(self);
        let line = block.first_line;
        match block.line_count {
            0 => Ok(None),
            4 => Pose::from_matrix(&block.matrix)
                .map(Some)
                .map_err(|source| RecordingError::NotAPose { line, source }),
            found => Err(RecordingError::LineCount { line, found }),
        }
    }
}

fn parse_row(line: usize, content: &str) -> Result<[f64; 4], RecordingError> {
    let found = content.split_whitespace().count();
    if found != 4 {
        return Err(RecordingError::ValueCount {
            line,
            found,
            expected: 4,
        });
    }
    let mut row = [0.0; 4];
    for ((number, text), value) in row.iter_mut().zip(content.split_whitespace()).zip(1..) {
        *number = parse_number(text, line, value)?;
    }
    Ok(row)
}
