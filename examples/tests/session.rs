//! The whole loop, from device bytes to deformed positions.

#![expect(clippy::float_cmp, reason = "equal runs are equal to the last bit")]

use examples::{
    deformer::{Deformer, DeformerKind},
    devices::{Device, Fault, FaultKind},
    geometry::Rigid,
    grasp::{GraspEvent, GraspRules, Phase},
    hand_proxy::{HandProxy, Posture},
    motion::{KeyMoment, Motion, MotionSample, Script},
    rehearsal,
    report::{FrameRecord, Report, position_hash},
    scene::{Object, ObjectKind, Resolution},
    session::{self, Outcome, SessionError, SessionOptions, Snapshot},
    soft_body::SoftBody,
    touch::{FingerShapes, Surface},
};
use glove_io::{
    JointAngles, Pose, Sensor,
    hand::{Finger, FingerPose, HandModel},
};
use spheretree::{Mesh, SphereTree};

/// Few enough frames for an unoptimised build, enough for every phase.
const FRAMES: usize = 450;

fn body(kind: ObjectKind, cells: u32) -> SoftBody {
    body_with(DeformerKind::Fem, kind, cells)
}

fn body_with(deformer: DeformerKind, kind: ObjectKind, cells: u32) -> SoftBody {
    let resolution = Resolution::new(cells).expect("in range");
    let object = Object::build(kind, resolution).expect("sound");
    SoftBody::new(object, deformer).expect("one piece")
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
    use DeformerKind::{Fem, Ffd};
    for (deformer, kind) in [
        (Fem, ObjectKind::Ball),
        (Fem, ObjectKind::Tube),
        (Ffd, ObjectKind::Ball),
        (Ffd, ObjectKind::Cube),
    ] {
        let body = body_with(deformer, kind, 4);
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
        assert_eq!(report.object.deformer, deformer);
        check_certificates(&outcome, &report, kind);
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
    // While the hand approaches; later the object may hold it back.
    let frame = 2;
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

/// A script whose fingers also spread and whose palm arches, to and fro.
struct Wiggling(Script);

impl Motion for Wiggling {
    fn sample(&self, time_s: f64) -> MotionSample {
        let mut sample = self.0.sample(time_s);
        for (i, sensor) in [
            Sensor::MiddleIndexAbduction,
            Sensor::RingMiddleAbduction,
            Sensor::LittleRingAbduction,
            Sensor::PalmArch,
        ]
        .into_iter()
        .enumerate()
        {
            sample.angles[sensor] += 0.3 * (3.0 * time_s + i as f64).sin();
        }
        sample
    }

    fn duration_s(&self) -> f64 {
        self.0.duration_s()
    }

    fn key_moments(&self) -> &[KeyMoment] {
        &[]
    }

    fn object_place(&self) -> Pose {
        self.0.object_place()
    }
}

/// While the object is rigid no part of a finger is inside it, whatever the hand does:
/// the same shapes, brought into the world, against a tree built there.
#[test]
fn the_rigid_object_is_not_entered() {
    for kind in [ObjectKind::Cube, ObjectKind::Ball] {
        let body = body(kind, 3);
        let motion = Wiggling(script(&body, 1));
        let hand = HandModel::average_right();
        let triangles = body.triangles().to_vec();
        let (mut attached, mut touching) = (0, 0);
        let watch = |snapshot: &dyn Fn(&str) -> Snapshot, record: &FrameRecord| {
            // Up to the first release: a body that springs back may catch a finger.
            if record.phase == Phase::Deforming || record.frame * 5 > FRAMES * 2 {
                return;
            }
            attached += usize::from(record.phase == Phase::Attached);
            touching += usize::from(record.touching.contains(&true));
            let now = snapshot("");
            let mesh = Mesh::new(&now.positions, &triangles).expect("sound");
            let tree = SphereTree::build(mesh);
            let surface = Surface {
                tree: &tree,
                positions: &now.positions,
            };
            for (finger, pose) in Finger::ALL.iter().zip(&now.hand.fingers) {
                assert!(
                    !FingerShapes::new(pose).hit(surface),
                    "{kind}, frame {}: {} is inside",
                    record.frame,
                    finger.name()
                );
            }
        };
        let options = options(FRAMES, &motion.0);
        session::run(&options, &motion, &hand, body.clone(), watch).expect("the devices work");
        assert!(attached > 0 && touching > 0, "{kind}");
    }
}

/// A finger that finds itself inside blocks nothing: the hand gets out.
#[test]
fn a_hand_inside_the_object_gets_out() {
    let body = body(ObjectKind::Ball, 4);
    let hand = HandModel::average_right();
    let posture = |up_m: f64| Posture {
        wrist: Rigid {
            translation: glam::DVec3::new(0.0, up_m, 0.11),
            ..Rigid::IDENTITY
        },
        angles: JointAngles::default(),
    };
    let mut proxy = HandProxy::default();
    proxy.follow(&hand, posture(0.0), f64::INFINITY);
    let stuck = proxy.advance(&hand, posture(0.005), body.surface(), false);
    assert!(stuck.inside.contains(&true), "the test starts inside");
    assert_eq!(stuck.posture, posture(0.005));
    let out = proxy.advance(&hand, posture(0.3), body.surface(), false);
    assert_eq!(out.posture, posture(0.3));
    // And once out it is kept out.
    let back = proxy.advance(&hand, posture(0.0), body.surface(), false);
    assert!(back.posture.wrist.translation.y > 0.02);
    assert_eq!(back.inside, [false; 5]);
}

/// Fingers that catch up with the real hand do so in bounded steps, and arrive.
#[test]
fn catching_up_is_gradual() {
    let hand = HandModel::average_right();
    let posture = |flexion: f64| Posture {
        wrist: Rigid::IDENTITY,
        angles: JointAngles([-flexion; 22]),
    };
    let mut proxy = HandProxy::default();
    let mut last = proxy.follow(&hand, posture(0.0), 0.002);
    for _ in 0..2000 {
        let next = proxy.follow(&hand, posture(0.4), 0.002);
        for (a, b) in last.hand.fingers.iter().zip(&next.hand.fingers) {
            for (a, b) in a.points_m.iter().zip(&b.points_m) {
                let way = glam::DVec3::from_array(*a).distance(glam::DVec3::from_array(*b));
                assert!(way <= 0.002, "{way}");
            }
        }
        last = next;
    }
    assert_eq!(last.posture, posture(0.4));
}

/// A lattice takes the touched points where the fingertips go, and the object with them;
/// what is far away stays.
#[test]
fn in_a_lattice_touched_points_go_with_the_fingertips() {
    let mut body = body_with(DeformerKind::Ffd, ObjectKind::Cube, 6);
    let rest = body.rest().positions().to_vec();
    // Opposite corners of the cube, 10 cm apart.
    let corner = |sign: f64| {
        let far = |x: &[f64; 3]| sign * (x[0] + x[1] + x[2]);
        let nodes = (0..rest.len()).max_by(|&a, &b| far(&rest[a]).total_cmp(&far(&rest[b])));
        nodes.expect("nodes")
    };
    let (pressed, other) = (corner(1.0), corner(-1.0));
    let contact = |node: usize| {
        let node = u32::try_from(node).expect("few nodes");
        fem_tet::Contact::weighted(&[(node, 1.0)]).expect("one node")
    };
    body.hold(vec![contact(pressed)])
        .expect("one point is enough");
    let inward = [-4e-3, -3e-3, -2e-3];
    assert_eq!(body.displace(&[inward]).fraction, 1.0);
    for (found, asked) in body.displacements()[pressed].iter().zip(inward) {
        assert!((found - asked).abs() < 1e-14);
    }
    assert_eq!(body.displacements()[other], [0.0; 3]);
    body.relax();
    assert_eq!(body.positions(), rest);
}

/// In a lattice, every frame in which the object gives way is certified, and all of it can
/// be undone.
fn check_certificates(outcome: &Outcome, report: &Report, kind: ObjectKind) {
    let Some(free_form) = &report.free_form else {
        assert_eq!(report.object.deformer, DeformerKind::Fem);
        return;
    };
    let certified = outcome.frames.iter().filter(|f| f.certificate.is_some());
    let count = certified.count();
    assert!(
        count > 0 && count == free_form.min_det_by_frame.len(),
        "{kind}"
    );
    assert_eq!(free_form.verdicts.get("injective"), Some(&count), "{kind}");
    let [low, high] = free_form.min_det;
    assert!(
        0.0 < low && low <= high && high < 1.0,
        "{kind}: {low} {high}"
    );
    assert_eq!(free_form.journal, report.kept_shapes.len());
    // The object is 0.1 m large, and displacements are rounded a few times.
    let error = free_form.round_trip_error_m.expect("there is a way back");
    assert!(error < 1e-14, "{kind}: {error:e}");
}

/// Fingertips that ask for a fold are followed up to it, frame by frame, and no farther.
#[test]
fn a_lattice_stops_before_it_folds() {
    let mut body = body_with(DeformerKind::Ffd, ObjectKind::Cube, 6);
    let rest = body.rest().positions().to_vec();
    let far = |x: &[f64; 3]| x[0] + x[1] + x[2];
    let corner = (0..rest.len()).max_by(|&a, &b| far(&rest[a]).total_cmp(&far(&rest[b])));
    let corner = u32::try_from(corner.expect("nodes")).expect("few nodes");
    let contact = fem_tet::Contact::weighted(&[(corner, 1.0)]).expect("one node");
    body.hold(vec![contact]).expect("one point is enough");
    let mut stopped = 0;
    for frame in 0..12 {
        // Inward, 1 cm more each time: in the end beyond the opposite corner.
        let step = body.displace(&[[-0.01 * f64::from(frame); 3]]);
        let certified = step.certificate.expect("in a lattice");
        assert_eq!(certified.verdict, "injective", "{frame}");
        assert!(certified.min_det[0] > 0.0, "{frame}: {certified:?}");
        stopped += usize::from(certified.step < 1.0);
        let file = body.to_file().expect("no element is turned inside out");
        assert_eq!(file.mesh.positions(), body.positions());
    }
    assert!(stopped > 3, "{stopped}");
    let Deformer::FreeForm(free_form) = body.deformer() else {
        panic!("a lattice");
    };
    let (journal, moved) = free_form.journal().expect("in range");
    assert_eq!((journal.lattices().len(), moved), (1, glam::DVec3::ZERO));
    let error = free_form
        .round_trip_error_m(body.positions())
        .expect("in range");
    // One lattice near its limit: its inverse magnifies rounding by 1 / det.
    assert!(error.expect("a way back") < 1e-9, "{error:?}");
}

/// A fingertip on a thin wall presses on its own side of it only.
#[test]
fn a_patch_does_not_reach_through_a_thin_wall() {
    // The crimped end of the tube is a centimetre thick.
    let body = body(ObjectKind::Tube, 8);
    let rest = body.positions();
    let tip = spheretree::Sphere::new([-0.055, 0.012, 0.0], 0.008).expect("a sphere");
    let surface = body.surface();
    let contact = surface
        .tree
        .sphere_contact(surface.positions, &tip, 0.0)
        .expect("it rests on the end");
    let patch = body.patch(&contact, 0.012);
    let below = rest
        .iter()
        .filter(|p| p[1] < -1e-3)
        .any(|&p| glam::DVec3::from_array(p).distance(contact.point.into()) < 0.012);
    assert!(below, "the other side is within reach");
    for &(node, _) in patch.weights() {
        assert!(rest[node as usize][1] > -1e-9, "{node}");
    }
}

/// A fingertip that takes hold of a deformed surface leaves it where it is.
#[test]
fn taking_hold_does_not_move_the_surface() {
    let body = body(ObjectKind::Ball, 4);
    let script = script(&body, 1);
    let hand = HandModel::average_right();
    let options = SessionOptions {
        rules: GraspRules {
            fingers_to_deform: 4,
            ..GraspRules::default()
        },
        ..options(3600, &script)
    };
    let mut before: Vec<f64> = Vec::new();
    let mut largest = 0.0_f64;
    let mut joined = 0;
    let mut holding = 0;
    session::run(
        &options,
        &script,
        &hand,
        body.clone(),
        |snapshot, record| {
            if record.frame > 1000 {
                return;
            }
            let now = snapshot("").displacement_m;
            let fingers = record.touching.iter().filter(|&&t| t).count();
            if record.phase == Phase::Deforming && holding >= 4 && fingers > holding {
                joined += 1;
                for (a, b) in before.iter().zip(&now) {
                    largest = largest.max((a - b).abs());
                }
            }
            holding = fingers;
            before = now;
        },
    )
    .expect("the devices work");
    assert!(joined > 0, "the last finger joins the others");
    // In a frame of 5 ms fingers move by 1.3 mm at most, and the surface with them.
    assert!(largest < 3e-3, "{largest}");
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
