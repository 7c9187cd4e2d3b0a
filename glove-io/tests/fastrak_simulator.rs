//! The simulated FASTRAK, spoken to as real clients do.

use glove_io::fastrak::{self, Encoding, Item, OutputList, Station, Units};
use glove_io::sim::Fastrak;
use glove_io::{Pose, Quaternion};
use proptest::prelude::*;

fn ask_tracker(tracker: &mut Fastrak, bytes: &[u8]) -> Vec<u8> {
    let mut reply = Vec::new();
    tracker.receive(bytes, &mut reply);
    reply
}

/// The start-up of VRPN's driver: silence, status, settings, stream.
#[test]
fn tracker_answers_vrpn() {
    let mut tracker = Fastrak::default();
    let pose = Pose {
        position_m: [0.1, 0.2, -0.4],
        orientation: Quaternion {
            x: 0.0,
            y: 0.6,
            z: 0.0,
            w: 0.8,
        },
    };
    tracker.set_pose(Station::One, pose).unwrap();
    assert_eq!(ask_tracker(&mut tracker, b"c"), b"");
    let status = ask_tracker(&mut tracker, b"S");
    assert_eq!(status.len(), 55);
    assert!(status.starts_with(b"21S3F0    F31 ") && status.ends_with(b"\r\n"));
    let set_up = b"O1,2,11,0\rO2,2,11,0\rx0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\rfC";
    assert_eq!(ask_tracker(&mut tracker, set_up), b"");

    let mut bytes = Vec::new();
    for _ in 0..3 {
        tracker.tick(&mut bytes);
    }
    assert_eq!(bytes.len(), 3 * 32);
    let format = fastrak::RecordFormat {
        items: OutputList::try_new(&[Item::Position, Item::Quaternion, Item::Space]).unwrap(),
        encoding: Encoding::Binary,
        units: Units::Inches,
    };
    let mut poses = Vec::new();
    fastrak::Parser::new(format).push(&bytes, |record| poses.extend(record.to_world()));
    assert_eq!(poses.len(), 3);
    for found in poses {
        for (a, b) in found.position_m.iter().zip(pose.position_m) {
            // Single precision of at most 0.4 m.
            assert!((a - b).abs() <= 0.4 * 0.5_f64.powi(24), "{a} for {b}");
        }
        assert!((found.orientation.y - 0.6).abs() <= 0.5_f64.powi(23));
    }
}

#[test]
fn tracker_reads_settings_back() {
    let mut tracker = Fastrak::default();
    assert_eq!(ask_tracker(&mut tracker, b"O1\r"), b"21O 2 4 1\r\n");
    // CR, LF, both, or empty lines: clients differ.
    for end in ["\r", "\n", "\r\n", "\n\r", "\r\r\n\n"] {
        let command = format!("O1,2,11,1{end}O1{end}");
        assert_eq!(
            ask_tracker(&mut tracker, command.as_bytes()),
            b"21O 211 1\r\n"
        );
    }
    assert_eq!(ask_tracker(&mut tracker, b"l1\r"), b"21l1000\r\n");
    assert_eq!(ask_tracker(&mut tracker, b"l3,1\nl2\n"), b"22l1010\r\n");
    assert_eq!(ask_tracker(&mut tracker, b"H1,1,0,0\r"), b"");
    let both = ask_tracker(&mut tracker, b"O1,2,1\rO3,2,1\rP");
    assert_eq!(
        both,
        b"01    0.00   0.00   0.00\r\n03    0.00   0.00   0.00\r\n"
    );
    // Metres to centimetres; forward is −z in the world and x for the tracker.
    let pose = Pose {
        position_m: [0.0, 0.0, -1.5],
        ..Pose::IDENTITY
    };
    tracker.set_pose(Station::One, pose).unwrap();
    assert_eq!(
        ask_tracker(&mut tracker, b"l3,0\ruP"),
        b"01  150.00   0.00   0.00\r\n"
    );
}

#[test]
fn tracker_reports_errors() {
    let mut tracker = Fastrak::default();
    for (command, code) in [
        ("K1", "-99"),
        ("O1,2,,1", "-1"),
        ("O1,two", "-2"),
        ("O5,2", "-3"),
        ("O1,2,3", "-3"),
        ("l1,2", "-3"),
        ("H", "-1"),
    ] {
        let reply = ask_tracker(&mut tracker, format!("{command}\r").as_bytes());
        let expected = format!("2 E*ERROR*{command}*ERROR* EC {code} *PS 0 *FL 0 *ST 0\r\n");
        assert_eq!(String::from_utf8(reply).unwrap(), expected);
    }
    // Far too long, then in order again.
    let mut endless = vec![b'O'; 10_000];
    endless.push(b'\r');
    let reply = ask_tracker(&mut tracker, &endless);
    assert!(reply.len() < 400 && reply.starts_with(b"2 E*ERROR*OOO"));
    assert_eq!(ask_tracker(&mut tracker, b"O1\r"), b"21O 2 4 1\r\n");
}

#[test]
fn poses_that_cannot_be_sent_are_refused() {
    let mut tracker = Fastrak::default();
    let zero = Quaternion {
        w: 0.0,
        ..Quaternion::IDENTITY
    };
    for pose in [
        Pose {
            position_m: [f64::NAN, 0.0, 0.0],
            ..Pose::IDENTITY
        },
        Pose {
            position_m: [10.0, 0.0, 0.0],
            ..Pose::IDENTITY
        },
        Pose {
            orientation: zero,
            ..Pose::IDENTITY
        },
    ] {
        assert!(tracker.set_pose(Station::Two, pose).is_err());
    }
}

/// Bytes that mean something to the tracker, and others.
fn command_bytes() -> impl Strategy<Value = Vec<u8>> {
    let known = b"PSCcFfUuOlH123,40\r\n".to_vec();
    prop::collection::vec(
        prop_oneof![any::<u8>(), prop::sample::select(known)],
        0..200,
    )
}

proptest! {
    /// Commands may arrive in pieces of any size; no bytes panic.
    #[test]
    fn splitting_commands_changes_no_reply(bytes in command_bytes(), cut in any::<prop::sample::Index>()) {
        let (head, tail) = bytes.split_at(cut.index(bytes.len() + 1));
        let (mut whole, mut pieces) = (Fastrak::default(), Fastrak::default());
        let mut reply = ask_tracker(&mut pieces, head);
        pieces.receive(tail, &mut reply);
        prop_assert_eq!(ask_tracker(&mut whole, &bytes), reply);
    }

    /// Whatever the client did, a tracker in text mode sends records a parser reads.
    #[test]
    fn streams_of_the_tracker_are_read_without_loss(
        position in [-2.0..2.0_f64, -2.0..2.0, -2.0..2.0],
        ticks in 1..10_usize,
    ) {
        let mut tracker = Fastrak::default();
        tracker.set_pose(Station::One, Pose { position_m: position, ..Pose::IDENTITY })?;
        let mut bytes = ask_tracker(&mut tracker, b"uC");
        for _ in 0..ticks {
            tracker.tick(&mut bytes);
        }
        let format = fastrak::RecordFormat { units: Units::Centimetres, ..Default::default() };
        let mut parser = fastrak::Parser::new(format);
        let mut count = 0;
        parser.push(&bytes, |record| {
            count += 1;
            let found = record.to_world().expect("the default list has both").position_m;
            for (a, b) in found.into_iter().zip(position) {
                // Half of 0.01 cm, and a few roundings.
                assert!((a - b).abs() <= 0.5e-4 + 1e-12, "{a} for {b}");
            }
        });
        prop_assert_eq!(count, ticks);
        prop_assert_eq!(parser.counters().dropped_bytes, 0);
    }
}
