//! Reading text recordings, good and bad.

use glove_io::recording::{RecordingError, parse_joint_recording, parse_pose_recording};
use glove_io::{JointAngles, PoseError};
use proptest::prelude::*;

fn line_with(value: &str, place: usize) -> String {
    let mut values = ["0"; 22];
    values[place - 1] = value;
    values.join(" : ")
}

#[test]
fn joint_errors_name_line_and_value() {
    let parse = |text: &str| parse_joint_recording(text).unwrap_err();
    assert_eq!(parse(""), RecordingError::Empty);
    assert_eq!(parse("\r\n \n"), RecordingError::Empty);
    assert_eq!(
        parse(&format!("\n{}", line_with("*", 5))),
        RecordingError::Wildcard { line: 2, value: 5 }
    );
    assert_eq!(
        parse("0 : 0 : 0"),
        RecordingError::ValueCount {
            line: 1,
            found: 3,
            expected: 22
        }
    );
    for (text, place) in [("", 1), ("abc", 7), ("1.234,5", 22), ("1 2", 3)] {
        assert!(
            matches!(
                parse(&line_with(text, place)),
                RecordingError::NotANumber { line: 1, value, .. } if value == place
            ),
            "{text}"
        );
    }
    for text in ["NaN", "inf", "-infinity", "1e999"] {
        assert!(
            matches!(
                parse(&line_with(text, 4)),
                RecordingError::NotFinite {
                    line: 1,
                    value: 4,
                    ..
                }
            ),
            "{text}"
        );
    }
    let degrees = parse(&line_with("-45,0", 6));
    assert_eq!(
        degrees.to_string(),
        "line 1, value 6: -45 is more than a full turn in radians; is the recording in degrees?"
    );
}

#[test]
fn pose_errors_name_the_line() {
    let parse = |text: &str| parse_pose_recording(text).unwrap_err();
    let identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    assert_eq!(parse("\n\n"), RecordingError::Empty);
    assert_eq!(
        parse(&format!("{identity}\n1 0 0 0\n0 1 0 0\n")),
        RecordingError::LineCount { line: 6, found: 2 }
    );
    assert_eq!(
        parse(&format!("{identity}{identity}")),
        RecordingError::LineCount { line: 1, found: 8 }
    );
    assert_eq!(
        parse("1 0 0\n"),
        RecordingError::ValueCount {
            line: 1,
            found: 3,
            expected: 4
        }
    );
    assert!(matches!(
        parse("1 0 0 0\n0 1 0 x\n"),
        RecordingError::NotANumber {
            line: 2,
            value: 4,
            ..
        }
    ));
    let mirrored = "\n1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n";
    assert_eq!(
        parse(mirrored),
        RecordingError::NotAPose {
            line: 2,
            source: PoseError::Reflection
        }
    );
}

#[test]
#[expect(
    clippy::float_cmp,
    reason = "the printed positions are exact in binary"
)]
fn six_digit_matrices_are_poses() {
    // A rotation by 30° about z, by 20° about y, by 10° about x, printed with
    // six digits, and CR LF.
    let text = "0.813798 -0.440970 0.378522 1.25\r\n\
                0.469846 0.882564 0.018029 0.75\r\n\
                -0.342020 0.163176 0.925417 2.0\r\n\
                0 0 0 1\r\n";
    let poses = parse_pose_recording(text).unwrap();
    assert_eq!(poses[0].position_m, [1.25, 0.75, 2.0]);
    let q = poses[0].orientation;
    for (found, printed) in [
        (q.w, 0.951_549),
        (q.x, 0.038_135),
        (q.y, 0.189_308),
        (q.z, 0.239_298),
    ] {
        // Both sides are rounded at the sixth digit; the quotient in the
        // conversion passes entry errors on at most tripled.
        assert!((found - printed).abs() <= 2e-6, "{found} for {printed}");
    }
}

proptest! {
    /// Printed recordings are read back exactly, with either decimal mark.
    #[test]
    fn reading_inverts_printing(
        frames in prop::collection::vec(prop::array::uniform22(-6.0..6.0_f64), 1..5),
        comma in any::<bool>(),
        end in prop_oneof![Just("\n"), Just("\r\n"), Just("\n\n")],
    ) {
        let mut text = String::new();
        for frame in &frames {
            let line = frame.map(|angle| angle.to_string()).join(" : ");
            text += &if comma { line.replace('.', ",") } else { line };
            text += end;
        }
        let expected: Vec<_> = frames.into_iter().map(JointAngles).collect();
        prop_assert_eq!(parse_joint_recording(&text)?, expected);
    }

    /// No text panics.
    #[test]
    fn any_text_is_an_answer_or_an_error(text in "[-0-9:*.,einaNf \r\n\u{e9}]{0,300}") {
        let _ = parse_joint_recording(&text);
        let _ = parse_pose_recording(&text);
    }
}
