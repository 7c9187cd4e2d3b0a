//! The whole loop, from device bytes to deformed positions.

#![expect(clippy::float_cmp, reason = "equal runs are equal to the last bit")]

use examples::{
    devices::{Device, Fault, FaultKind},
    grasp::{GraspEvent, GraspRules, Phase},
    motion::{Motion, Script},
    rehearsal,
    report::{Report, position_hash},
    scene::{Object, ObjectKind, Resolution},
    session::{self, Outcome, SessionError, SessionOptions},
    soft_body::SoftBody,
};
use glove_io::hand::{FingerPose, HandModel};

/// Few enough frames for an unoptimised build, enough for every phase.
const FRAMES: usize = 450;

fn body(kind: ObjectKind, cells: u32) -> SoftBody {
    let resolution = Resolution::new(cells).expect("in range");
    SoftBody::new(Object::build(kind, resolution).expect("sound")).expect("one piece")
}

fn options(frames: usize, script: &Script) -> SessionOptions {
    SessionOptions {
        frames,
        frame_s: script.duration_s() / frames as f64,
        rules: GraspRules::default(),
        fault: None,
    }
}

/// The script as the program plays it, rehearsed.
fn script(body: &SoftBody, seed: u64) -> Script {
    let hand = HandModel::average_right();
    let variants = Script::variants(&hand, body.surface(), seed).expect("a grasp");
    let options = options(FRAMES, &variants[0]);
    rehearsal::best(variants, &hand, body, &options)
        .expect("the devices work")
        .expect("a variant")
}

fn play(body: &SoftBody, script: &Script, fault: Option<Fault>) -> Result<Outcome, SessionError> {
    let options = SessionOptions {
        fault,
        ..options(FRAMES, script)
    };
    let hand = HandModel::average_right();
    session::run(&options, script, &hand, body.clone(), |_, _| ())
}

#[test]
fn both_sides_are_squeezed_and_the_shape_is_kept_between() {
    for kind in [ObjectKind::Ball, ObjectKind::Tube] {
        let body = body(kind, 4);
        let initial_m3 = body.volume_m3();
        let script = script(&body, 1);
        let outcome = play(&body, &script, None).expect("the devices work");
        let report = Report::new(
            &outcome,
            Some(1),
            script.duration_s() / FRAMES as f64,
            initial_m3,
            std::time::Duration::ZERO,
        );
        // Squeezed and released; squeezed and kept; squeezed from another side.
        assert_eq!(report.grasps.len(), 3, "{kind}");
        for grasp in &report.grasps {
            assert!(
                grasp.most_fingers >= 3 && grasp.elastic_frames > 0,
                "{kind}"
            );
        }
        let [kept] = report.kept_shapes[..] else {
            panic!("{kind}: the shape is kept once")
        };
        assert!((kept.rest_volume_before_m3 / initial_m3 - 1.0).abs() < 1e-12);
        // What is kept is what was squeezed: the same volume, no displacement left.
        let change = kept.rest_volume_after_m3 / kept.deformed_volume_m3 - 1.0;
        assert!(change.abs() < 1e-12, "{kind}: {change}");
        assert!(kept.largest_displacement_before_m > 2e-3, "{kind}");
        assert_eq!(kept.largest_displacement_after_m, 0.0);
        // It still is what the object is at the end.
        let at_end = outcome.object.volume_m3() / kept.rest_volume_after_m3 - 1.0;
        assert!(at_end.abs() < 1e-12, "{kind}: {at_end}");
        assert_eq!(
            outcome.object.largest_displacement_m(),
            0.0,
            "released at the end"
        );
    }
}

#[test]
fn equal_runs_are_equal_and_other_seeds_differ() {
    let body = body(ObjectKind::Ball, 3);
    let hash = |seed| {
        let outcome = play(&body, &script(&body, seed), None).expect("the devices work");
        position_hash(&outcome.positions)
    };
    let first = hash(1);
    assert_eq!(first, hash(1));
    assert_ne!(first, hash(2));
}

/// The loop follows the bytes: a damaged byte moves the virtual hand, in that frame.
#[test]
fn a_damaged_byte_moves_the_hand() {
    let body = body(ObjectKind::Ball, 3);
    let script = script(&body, 1);
    let frame = 10;
    let hands = |fault: Option<Fault>| -> Vec<[FingerPose; 5]> {
        let options = SessionOptions {
            fault,
            ..options(20, &script)
        };
        let mut hands = Vec::new();
        let hand = HandModel::average_right();
        session::run(&options, &script, &hand, body.clone(), |snapshot, _| {
            hands.push(snapshot("").hand.fingers);
        })
        .expect("one fault is survived");
        hands
    };
    let healthy = hands(None);
    for device in [Device::Glove, Device::Tracker] {
        for kind in [FaultKind::Flip, FaultKind::Drop] {
            let damaged = hands(Some(Fault {
                device,
                kind,
                frame,
            }));
            assert_eq!(healthy[..frame], damaged[..frame]);
            assert_ne!(healthy[frame], damaged[frame], "{device:?} {kind:?}");
        }
    }
}

#[test]
fn a_dead_line_ends_the_session_with_a_clear_message() {
    let body = body(ObjectKind::Ball, 3);
    let script = script(&body, 1);
    let message = |device| {
        let fault = Fault {
            device,
            kind: FaultKind::Cut,
            frame: 100,
        };
        let Err(error) = play(&body, &script, Some(fault)) else {
            panic!("a dead line was not noticed")
        };
        error.to_string()
    };
    // 100 records of 25 bytes, and the half of one; no byte after that.
    assert_eq!(
        message(Device::Glove),
        "glove: the byte stream is truncated: no complete record since frame 99, and it ends 12 bytes into a record, at byte 2512"
    );
    // 32 bytes a record.
    assert_eq!(
        message(Device::Tracker),
        "tracker: the byte stream is truncated: no complete record since frame 99, and it ends 16 bytes into a record, at byte 3216"
    );
}

/// While the object is rigid no part of a finger is inside it; while it is attached
/// it keeps its place in the palm.
#[test]
fn the_rigid_object_is_not_entered() {
    let body = body(ObjectKind::Cube, 3);
    let script = script(&body, 1);
    let hand = HandModel::average_right();
    let mut attached_frames = 0;
    session::run(
        &options(FRAMES, &script),
        &script,
        &hand,
        body.clone(),
        |snapshot, record| {
            if record.phase == Phase::Deforming || record.frame > FRAMES / 2 {
                return;
            }
            attached_frames += usize::from(record.phase == Phase::Attached);
            // The nearest vertex of the object to each fingertip is outside the tip, but
            // for what the margin of a hundredth of a millimetre and the surface between
            // vertices allow.
            let now = snapshot("");
            for finger in &now.hand.fingers {
                let centre = glam::DVec3::from_array(finger.tip_center_m());
                let nearest = now
                    .positions
                    .iter()
                    .map(|&p| centre.distance(glam::DVec3::from_array(p)))
                    .fold(f64::INFINITY, f64::min);
                assert!(
                    nearest >= finger.tip_radius_m() - 2e-5,
                    "frame {}: {nearest}",
                    record.frame
                );
            }
        },
    )
    .expect("the devices work");
    assert!(attached_frames > 0);
}

/// Five fingertips by default, three on request: elasticity starts earlier then.
#[test]
fn three_fingertips_start_earlier() {
    let body = body(ObjectKind::Ball, 4);
    let script = script(&body, 1);
    let hand = HandModel::average_right();
    let first_elastic = |fingers_to_deform| {
        let options = SessionOptions {
            rules: GraspRules {
                fingers_to_deform,
                ..GraspRules::default()
            },
            ..options(FRAMES, &script)
        };
        let outcome = session::run(&options, &script, &hand, body.clone(), |_, _| ())
            .expect("the devices work");
        outcome
            .events
            .iter()
            .find(|e| e.event == GraspEvent::BecameElastic)
            .map(|e| e.frame)
            .expect("it is squeezed")
    };
    let (three, five) = (first_elastic(3), first_elastic(5));
    assert!(three < five, "{three} {five}");
}
