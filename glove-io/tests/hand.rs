//! Laws of the hand's forward kinematics, and a second formulation of it.

#![cfg(feature = "hand")]

use std::ops::RangeInclusive;

use glove_io::hand::{Finger, FingerPose, HandModel, HandPose, limits};
use glove_io::{JointAngles, Pose, Quaternion, SENSOR_COUNT, Sensor};
use proptest::prelude::*;

type Point = [f64; 3];
type Matrix = [[f64; 4]; 4];

/// A finger other than the thumb as the sources and the drawing of the palm give it,
/// millimetres and radians.
struct FingerRow {
    base: Point,
    metacarpal_fan: f64,
    finger_fan: f64,
    /// Metacarpal, proximal, intermediate, distal phalanx, tissue of the tip.
    lengths: [f64; 5],
    radii: Point,
}

const FINGERS: [FingerRow; 4] = [
    FingerRow {
        base: [-16.0, 0.0, -35.0],
        metacarpal_fan: -0.14,
        finger_fan: -0.07,
        lengths: [68.12, 39.78, 22.38, 15.82, 3.84],
        radii: [9.5, 8.5, 7.5],
    },
    FingerRow {
        base: [-3.0, 0.0, -37.0],
        metacarpal_fan: -0.02,
        finger_fan: 0.0,
        lengths: [64.60, 44.63, 26.33, 17.40, 3.95],
        radii: [9.8, 8.6, 7.7],
    },
    FingerRow {
        base: [9.0, 0.0, -37.0],
        metacarpal_fan: 0.12,
        finger_fan: 0.05,
        lengths: [58.00, 41.37, 25.65, 17.30, 3.95],
        radii: [9.2, 8.0, 7.2],
    },
    FingerRow {
        base: [19.0, 0.0, -33.0],
        metacarpal_fan: 0.26,
        finger_fan: 0.13,
        lengths: [53.69, 32.74, 18.11, 15.96, 3.73],
        radii: [8.2, 7.0, 6.3],
    },
];

const THUMB_BASE: Point = [-24.0, -6.0, -23.0];
const THUMB_REST: f64 = 0.15;
/// Metacarpal, proximal, distal phalanx, tissue of the tip.
const THUMB_LENGTHS: [f64; 4] = [46.22, 31.57, 21.67, 5.67];
const THUMB_RADII: Point = [11.5, 10.5, 9.5];

/// Wrist to tip, male means of Greiner 1991, thumb first, millimetres.
const GREINER: [f64; 5] = [137.9, 185.2, 194.5, 185.0, 159.9];

const FLEXIONS: [[Sensor; 3]; 4] = [
    [Sensor::IndexMcp, Sensor::IndexPip, Sensor::IndexDip],
    [Sensor::MiddleMcp, Sensor::MiddlePip, Sensor::MiddleDip],
    [Sensor::RingMcp, Sensor::RingPip, Sensor::RingDip],
    [Sensor::LittleMcp, Sensor::LittlePip, Sensor::LittleDip],
];

// Rotations and chains as homogeneous matrices.

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..4).map(|k| a[r][k] * b[k][c]).sum()))
}

fn chain<const N: usize>(links: [Matrix; N]) -> Matrix {
    links
        .iter()
        .skip(1)
        .fold(links[0], |so_far, link| product(&so_far, link))
}

fn translation([x, y, z]: Point) -> Matrix {
    [
        [1.0, 0.0, 0.0, x],
        [0.0, 1.0, 0.0, y],
        [0.0, 0.0, 1.0, z],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

/// Turn by `angle` about the unit vector `axis` (Rodrigues).
fn rotation([x, y, z]: Point, angle: f64) -> Matrix {
    let (s, c) = angle.sin_cos();
    let v = 1.0 - c;
    [
        [c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0.0],
        [y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0.0],
        [z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

fn flexion(angle: f64) -> Matrix {
    rotation([-1.0, 0.0, 0.0], angle)
}

fn abduction(angle: f64) -> Matrix {
    rotation([0.0, 1.0, 0.0], angle)
}

/// To the far end of a bone.
fn bone(length: f64) -> Matrix {
    translation([0.0, 0.0, -length])
}

fn origin(m: &Matrix) -> Point {
    [m[0][3], m[1][3], m[2][3]]
}

fn apply(m: &Matrix, [x, y, z]: Point) -> Point {
    origin(&product(m, &translation([x, y, z])))
}

fn degrees(angle: f64, low: f64, high: f64) -> f64 {
    angle.clamp(low.to_radians(), high.to_radians())
}

/// Points of the fingers, thumb first, by the table of the module's documentation.
fn reference(wrist: &Matrix, scale: f64, angles: &JointAngles) -> (Matrix, [[Point; 4]; 5]) {
    let metres = scale * 1e-3;
    let at = |base: Point| translation(base.map(|mm| mm * metres));
    let length = |mm: f64| bone(mm * metres);
    let flexed = |sensor: Sensor, low, high| flexion(degrees(-angles[sensor], low, high));
    let palm = chain([
        *wrist,
        abduction(degrees(angles[Sensor::WristYaw], -30.0, 20.0)),
        flexed(Sensor::WristPitch, -70.0, 80.0),
    ]);

    let arch = degrees(-angles[Sensor::PalmArch], 0.0, 25.0);
    let ring = -angles[Sensor::RingMiddleAbduction];
    let moving = [
        (angles[Sensor::MiddleIndexAbduction], 0.0),
        (0.0, 0.0),
        (ring, arch / 2.0),
        (ring - angles[Sensor::LittleRingAbduction], arch),
    ];
    let finger = |i: usize| {
        let row = &FINGERS[i];
        let [metacarpal, proximal, intermediate, distal, tissue] = row.lengths;
        let (spread, arch) = moving[i];
        let mcp = chain([
            palm,
            at(row.base),
            abduction(-row.metacarpal_fan),
            flexion(arch),
            length(metacarpal),
        ]);
        let pip = chain([
            mcp,
            abduction(row.metacarpal_fan - row.finger_fan + degrees(spread, -20.0, 20.0)),
            flexed(FLEXIONS[i][0], -20.0, 90.0),
            length(proximal),
        ]);
        let dip = chain([
            pip,
            flexed(FLEXIONS[i][1], 0.0, 100.0),
            length(intermediate),
        ]);
        let tip = chain([
            dip,
            flexed(FLEXIONS[i][2], 0.0, 90.0),
            length(distal + tissue),
        ]);
        [mcp, pip, dip, tip].map(|joint| origin(&joint))
    };
    let [metacarpal, proximal, distal, tissue] = THUMB_LENGTHS;
    let cmc = product(&palm, &at(THUMB_BASE));
    let mcp = chain([
        cmc,
        rotation(
            [0.0, 0.0, 1.0],
            degrees(-angles[Sensor::ThumbRoll], -30.0, 110.0),
        ),
        abduction(THUMB_REST + degrees(-angles[Sensor::ThumbAbduction], 0.0, 70.0)),
        rotation([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2),
        length(metacarpal),
    ]);
    let ip = chain([mcp, flexed(Sensor::ThumbMcp, -10.0, 50.0), length(proximal)]);
    let tip = chain([
        ip,
        flexed(Sensor::ThumbIp, -20.0, 80.0),
        length(distal + tissue),
    ]);
    let thumb = [cmc, mcp, ip, tip].map(|joint| origin(&joint));
    (palm, [thumb, finger(0), finger(1), finger(2), finger(3)])
}

// Helpers.

fn distance(a: Point, b: Point) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

fn hand(angles: &JointAngles) -> HandPose {
    HandModel::average_right().pose(&Pose::IDENTITY, angles)
}

fn with(settings: &[(Sensor, f64)]) -> JointAngles {
    let mut angles = JointAngles::default();
    for &(sensor, angle) in settings {
        angles[sensor] = angle;
    }
    angles
}

fn finger(pose: &HandPose, finger: Finger) -> FingerPose {
    pose.fingers[finger.index()]
}

fn tip(pose: &HandPose, of: Finger) -> Point {
    finger(pose, of).points_m[3]
}

/// All points of a hand.
fn points(pose: &HandPose) -> impl Iterator<Item = Point> {
    let fingers = pose.fingers.into_iter().flat_map(|f| f.points_m);
    let bases = pose.metacarpal_bases_m.into_iter();
    bases.chain(fingers).chain([pose.palm.position_m])
}

/// Angles twice as wide as any joint goes, so that limits take part.
fn angles() -> impl Strategy<Value = JointAngles> {
    prop::collection::vec(-3.0..3.0_f64, SENSOR_COUNT)
        .prop_map(|v| JointAngles(v.try_into().expect("one angle per sensor")))
}

/// Every number there is, NaN and infinities included.
fn any_angles() -> impl Strategy<Value = JointAngles> {
    prop::collection::vec(prop::num::f64::ANY, SENSOR_COUNT)
        .prop_map(|v| JointAngles(v.try_into().expect("one angle per sensor")))
}

/// A rigid motion both ways: as a pose and as a matrix.
fn motion() -> impl Strategy<Value = (Pose, Matrix)> {
    let axis = prop::array::uniform3(-1.0..1.0_f64)
        .prop_filter("a direction", |v| distance(*v, [0.0; 3]) > 0.1);
    let position = prop::array::uniform3(-2.0..2.0_f64);
    (axis, -3.0..3.0_f64, position).prop_map(|(axis, angle, position_m)| {
        let length = distance(axis, [0.0; 3]);
        let axis = axis.map(|c| c / length);
        let (s, w) = (0.5 * angle).sin_cos();
        let [x, y, z] = axis.map(|c| c * s);
        let orientation = Quaternion { x, y, z, w };
        let matrix = product(&translation(position_m), &rotation(axis, angle));
        (
            Pose {
                position_m,
                orientation,
            },
            matrix,
        )
    })
}

/// Hamilton's product: `b`, then `a`.
fn compose(a: &Pose, a_matrix: &Matrix, b: &Pose) -> Pose {
    let (p, q) = (a.orientation, b.orientation);
    Pose {
        position_m: apply(a_matrix, b.position_m),
        orientation: Quaternion {
            x: p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
            y: p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
            z: p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w,
            w: p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
        },
    }
}

/// A chain multiplies at most ten rotations, each right to a few ε, on at most 0.3 m
/// of hand, at most 7 m (two motions) from the origin. Sums of a dozen terms of that
/// size are within 64 ε of it.
const TOLERANCE_M: f64 = 64.0 * 7.0 * f64::EPSILON;

proptest! {
    /// Quaternions in the crate and homogeneous matrices here put every point at the
    /// same place, within and beyond the limits.
    #[test]
    fn matrices_give_the_same_hand((wrist, matrix) in motion(), angles in angles(), scale in 0.5..1.5_f64) {
        let pose = HandModel::average_right().scaled_by(scale).pose(&wrist, &angles);
        let (palm, expected) = reference(&matrix, scale, &angles);
        for (finger, expected) in pose.fingers.iter().zip(expected) {
            for (found, expected) in finger.points_m.into_iter().zip(expected) {
                prop_assert!(distance(found, expected) <= TOLERANCE_M, "{found:?} {expected:?}");
            }
        }
        for (found, row) in pose.metacarpal_bases_m.into_iter().zip(&FINGERS) {
            let expected = apply(&palm, row.base.map(|mm| mm * scale * 1e-3));
            prop_assert!(distance(found, expected) <= TOLERANCE_M);
        }
        // The palm's own axes: a quaternion's matrix, column by column.
        prop_assert!(distance(pose.palm.position_m, origin(&palm)) <= TOLERANCE_M);
        let Quaternion { x, y, z, w } = pose.palm.orientation;
        let forward = [-2.0 * (x * z + w * y), -2.0 * (y * z - w * x), 2.0 * (x * x + y * y) - 1.0];
        let up = [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)];
        for (axis, found) in [([0.0, 0.0, -1.0], forward), ([0.0, 1.0, 0.0], up)] {
            let expected = apply(&palm, axis);
            let expected = std::array::from_fn(|i| expected[i] - origin(&palm)[i]);
            prop_assert!(distance(found, expected) <= TOLERANCE_M);
        }
    }

    /// Moving the wrist moves the hand: pose(W ∘ wrist) = W(pose(wrist)).
    #[test]
    fn a_moved_wrist_moves_the_hand(
        (moved, matrix) in motion(),
        (wrist, _) in motion(),
        angles in angles(),
    ) {
        let model = HandModel::average_right();
        let before = model.pose(&wrist, &angles);
        let after = model.pose(&compose(&moved, &matrix, &wrist), &angles);
        for (before, after) in points(&before).zip(points(&after)) {
            prop_assert!(distance(apply(&matrix, before), after) <= TOLERANCE_M);
        }
    }

    /// Bones keep their lengths and joints stay finite, whatever the angles.
    #[test]
    fn bones_keep_their_lengths(angles in any_angles()) {
        let pose = hand(&angles);
        prop_assert!(points(&pose).flatten().all(f64::is_finite));
        let mut bones = Vec::new();
        for (i, row) in FINGERS.iter().enumerate() {
            let [a, b, c, d] = pose.fingers[i + 1].points_m;
            let [metacarpal, proximal, intermediate, distal, tissue] = row.lengths;
            bones.extend([
                (pose.metacarpal_bases_m[i], a, metacarpal),
                (a, b, proximal),
                (b, c, intermediate),
                (c, d, distal + tissue),
            ]);
        }
        let [a, b, c, d] = finger(&pose, Finger::Thumb).points_m;
        let [metacarpal, proximal, distal, tissue] = THUMB_LENGTHS;
        bones.extend([(a, b, metacarpal), (b, c, proximal), (c, d, distal + tissue)]);
        for (start, end, mm) in bones {
            prop_assert!((distance(start, end) - mm * 1e-3).abs() <= TOLERANCE_M);
        }
    }

    /// Limiting is the identity inside a range and never leaves it.
    #[test]
    #[expect(clippy::float_cmp, reason = "the angle is copied, not computed")]
    fn limited_angles_are_in_range(angle in prop::num::f64::ANY) {
        let range = &limits::MCP_FLEXION;
        let found = limits::limited(angle, range);
        prop_assert!(range.contains(&found));
        prop_assert!(!range.contains(&angle) || found == angle);
        prop_assert!(!angle.is_nan() || found == *range.start());
    }

    /// Bending any joints of a finger, and no matter how far, brings its tip below
    /// the plane of the palm, on the palm's side.
    #[test]
    fn fingers_curl_towards_the_palm(flexions in prop::array::uniform3(0.0..2.0_f64), which in 0..4_usize) {
        prop_assume!(flexions.iter().any(|&f| f > 0.01));
        let bent: Vec<_> = FLEXIONS[which].into_iter().zip(flexions.map(|f| -f)).collect();
        let y = hand(&with(&bent)).fingers[which + 1].points_m[3][1];
        // The shortest distal bone turned by 0.01 rad.
        prop_assert!(y < -1.9e-4, "{y}");
    }

    /// The palm arch carries ring and little finger as they are: it changes no
    /// distance between two points of one finger.
    #[test]
    fn the_palm_arch_bends_no_finger(angles in angles(), arch in -0.5..0.0_f64) {
        let (mut flat, mut arched) = (angles, angles);
        flat[Sensor::PalmArch] = 0.0;
        arched[Sensor::PalmArch] = arch;
        let (flat, arched) = (hand(&flat), hand(&arched));
        for i in 0..4 {
            let chain = |pose: &HandPose| {
                let [a, b, c, d] = pose.fingers[i + 1].points_m;
                [pose.metacarpal_bases_m[i], a, b, c, d]
            };
            let (flat, arched) = (chain(&flat), chain(&arched));
            for j in 0..5 {
                for k in 0..j {
                    let change = distance(flat[j], flat[k]) - distance(arched[j], arched[k]);
                    prop_assert!(change.abs() <= TOLERANCE_M);
                }
            }
        }
    }

    /// Rolling and bending the thumb opposes it: its tip comes nearer to the base of
    /// the little finger than it lies in the flat hand.
    #[test]
    fn the_thumb_opposes(roll in 0.3..1.9_f64, mcp in 0.1..0.8_f64, ip in 0.1..1.3_f64) {
        let reach = |angles: &JointAngles| {
            let pose = hand(angles);
            distance(tip(&pose, Finger::Thumb), finger(&pose, Finger::Little).points_m[0])
        };
        let opposed = with(&[
            (Sensor::ThumbRoll, -roll),
            (Sensor::ThumbMcp, -mcp),
            (Sensor::ThumbIp, -ip),
        ]);
        prop_assert!(reach(&opposed) < reach(&JointAngles::default()));
    }

    /// A larger hand is the same hand, magnified about the wrist.
    #[test]
    fn scaling_magnifies(angles in angles(), factor in 0.5..2.0_f64) {
        let one = hand(&angles);
        let other = HandModel::average_right().scaled_by(factor).pose(&Pose::IDENTITY, &angles);
        for (a, b) in points(&one).zip(points(&other)) {
            prop_assert!(distance(a.map(|c| c * factor), b) <= TOLERANCE_M);
        }
        for (a, b) in one.fingers.iter().zip(&other.fingers) {
            for (a, b) in a.radii_m.into_iter().zip(b.radii_m) {
                prop_assert!((a * factor - b).abs() <= f64::EPSILON);
            }
        }
    }

    /// Segments follow each other from the palm to the centre of the fingertip's
    /// sphere, which touches the very tip from inside, on the distal bone.
    #[test]
    #[expect(clippy::float_cmp, reason = "the points are copied, not computed")]
    fn segments_and_tip_fit_together((wrist, _) in motion(), angles in angles()) {
        let pose = HandModel::average_right().pose(&wrist, &angles);
        let radii = [THUMB_RADII].into_iter().chain(FINGERS.map(|row| row.radii));
        for (finger, radii) in pose.fingers.iter().zip(radii) {
            let segments = finger.segments();
            let center = finger.tip_center_m();
            let [a, b, c, end] = finger.points_m;
            prop_assert_eq!(segments.map(|s| s.start_m), [a, b, c]);
            prop_assert_eq!(segments.map(|s| s.end_m), [b, c, center]);
            prop_assert_eq!(segments.map(|s| s.radius_m), finger.radii_m);
            prop_assert_eq!(finger.tip_radius_m(), finger.radii_m[2]);
            for (found, mm) in finger.radii_m.into_iter().zip(radii) {
                prop_assert!((found - mm * 1e-3).abs() <= f64::EPSILON);
            }
            prop_assert!((distance(center, end) - finger.tip_radius_m()).abs() <= TOLERANCE_M);
            let detour = distance(c, center) + distance(center, end) - distance(c, end);
            prop_assert!(detour.abs() <= TOLERANCE_M);
        }
    }
}

#[test]
fn straight_fingers_are_as_long_as_measured() {
    let flat = hand(&JointAngles::default());
    for (of, mean_mm) in Finger::ALL.into_iter().zip(GREINER) {
        let reach_mm = 1e3 * distance(tip(&flat, of), [0.0; 3]);
        assert!(
            (reach_mm - mean_mm).abs() < 5.0,
            "{}: {reach_mm:.1} mm, {mean_mm} mm measured",
            of.name()
        );
    }
}

/// Infinite angles mean the end of the range, NaN its lower end.
#[test]
fn wild_angles_mean_limits() {
    // Each sensor by itself, with its range and the sign in which it is limited.
    let (flexed, abducted): (f64, f64) = (-1.0, 1.0);
    let mut cases: Vec<(Sensor, RangeInclusive<f64>, f64)> = vec![
        (Sensor::ThumbRoll, limits::THUMB_ROLL, flexed),
        (Sensor::ThumbMcp, limits::THUMB_MCP_FLEXION, flexed),
        (Sensor::ThumbIp, limits::THUMB_IP_FLEXION, flexed),
        (Sensor::ThumbAbduction, limits::THUMB_ABDUCTION, flexed),
        (Sensor::MiddleIndexAbduction, limits::SPREAD, abducted),
        (Sensor::LittleRingAbduction, limits::SPREAD, flexed),
        (Sensor::PalmArch, limits::PALM_ARCH, flexed),
        (Sensor::WristPitch, limits::WRIST_FLEXION, flexed),
        (Sensor::WristYaw, limits::WRIST_DEVIATION, abducted),
    ];
    for [mcp, pip, dip] in FLEXIONS {
        cases.push((mcp, limits::MCP_FLEXION, flexed));
        cases.push((pip, limits::PIP_FLEXION, flexed));
        cases.push((dip, limits::DIP_FLEXION, flexed));
    }
    for (sensor, range, sign) in cases {
        for (wild, limit) in [
            (f64::NAN, *range.start()),
            (f64::NEG_INFINITY, *range.start()),
            (f64::INFINITY, *range.end()),
        ] {
            let found = hand(&with(&[(sensor, sign * wild)]));
            let expected = hand(&with(&[(sensor, sign * limit)]));
            assert_eq!(found, expected, "{sensor:?} at {wild}");
        }
    }
    // Moves two fingers: outward as far as they go.
    let found = hand(&with(&[(Sensor::RingMiddleAbduction, f64::INFINITY)]));
    let limit = *limits::SPREAD.end();
    let expected = hand(&with(&[(Sensor::RingMiddleAbduction, limit)]));
    assert_eq!(found, expected);
}

/// Abductions between fingers are positive when they part; the thumb parts from the
/// index finger, and bends across the palm, as its angles fall.
#[test]
fn signs_of_abduction_and_thumb() {
    let flat = hand(&JointAngles::default());
    let gap = |pose: &HandPose, a, b| distance(tip(pose, a), tip(pose, b));
    for (sensor, a, b, angle) in [
        (
            Sensor::MiddleIndexAbduction,
            Finger::Index,
            Finger::Middle,
            0.2,
        ),
        (
            Sensor::RingMiddleAbduction,
            Finger::Middle,
            Finger::Ring,
            0.2,
        ),
        (
            Sensor::LittleRingAbduction,
            Finger::Ring,
            Finger::Little,
            0.2,
        ),
        (Sensor::ThumbAbduction, Finger::Thumb, Finger::Index, -0.2),
    ] {
        let spread = hand(&with(&[(sensor, angle)]));
        assert!(gap(&spread, a, b) > gap(&flat, a, b) + 0.01, "{sensor:?}");
    }
    for sensor in [Sensor::ThumbMcp, Sensor::ThumbIp] {
        let bent = hand(&with(&[(sensor, -0.5)]));
        // +x is away from the thumb.
        assert!(tip(&bent, Finger::Thumb)[0] > tip(&flat, Finger::Thumb)[0] + 0.005);
    }
}

#[test]
fn fingers_know_their_place() {
    for (place, finger) in Finger::ALL.into_iter().enumerate() {
        assert_eq!(finger.index(), place);
    }
    let names = Finger::ALL.map(Finger::name);
    assert_eq!(names, ["thumb", "index", "middle", "ring", "little"]);
}

#[test]
#[should_panic(expected = "scale factor 0")]
fn a_hand_of_no_size_is_refused() {
    let _ = HandModel::average_right().scaled_by(0.0);
}
