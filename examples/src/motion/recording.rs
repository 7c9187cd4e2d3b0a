//! Recordings of real hands as a motion.
//!
//! Joint angles and wrist poses were recorded at different times and rates. Each
//! plays at its own rate; the shorter one goes back and forth until the longer one
//! ends, so that nothing jumps.

use glam::{DMat3, DQuat, DVec3};
use glove_io::{
    JointAngles, Pose,
    hand::{Finger, HandModel},
};

use super::{KeyMoment, Motion, MotionSample};
use crate::geometry::Rigid;

/// Rate of VirtualHand text recordings, samples per second.
const JOINT_RATE_HZ: f64 = 24.0;
/// Rate of the pose recordings, samples per second.
const POSE_RATE_HZ: f64 = 100.0;
/// Least distance of the receiver in front of the transmitter after re-centring,
/// metres: the tracker is unambiguous in one hemisphere only.
const CLEARANCE_M: f64 = 0.1;

/// Range of the tracker with reduced accuracy (\[Ma98\] section 2.1.2), metres.
const RANGE_M: f64 = 3.05;

/// A recording moves farther than a tracker reaches.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "matrix {matrix}: the hand is {distance_m:.2} m from the transmitter even after centring, but the tracker reaches {RANGE_M} m; are these metres?"
)]
pub struct OutOfReach {
    /// Which matrix, counted from 1.
    pub matrix: usize,
    /// Its distance, metres.
    pub distance_m: f64,
}

/// Places for the object that are worth trying.
const VARIANTS: usize = 16;

/// What was recorded; at least one of the two.
#[derive(Debug, Clone, Default)]
pub struct RecordingSource {
    /// Joint angles, if recorded.
    pub joints: Option<Vec<JointAngles>>,
    /// Wrist poses in the recording's table frame (z up, metres), if recorded.
    pub poses: Option<Vec<Pose>>,
}

/// A hand that moves as recorded.
#[derive(Debug, Clone)]
pub struct Recording {
    joints: Vec<JointAngles>,
    poses: Vec<Rigid>,
    object_place: Pose,
    duration_s: f64,
}

impl Recording {
    /// Moves the poses into the tracker's range and puts the object where the
    /// recorded hand likeliest meets it.
    ///
    /// Without joint angles the hand stays flat, without poses it stays in one place.
    ///
    /// # Errors
    ///
    /// [`OutOfReach`] if the poses span more than the tracker's range.
    pub fn new(source: RecordingSource, hand: &HandModel) -> Result<Self, OutOfReach> {
        let source = RecordingSource {
            joints: source.joints.filter(|joints| !joints.is_empty()),
            poses: source.poses.filter(|poses| !poses.is_empty()),
        };
        let joints = source
            .joints
            .unwrap_or_else(|| vec![JointAngles::default()]);
        let poses = source.poses.map_or_else(
            || {
                vec![Rigid::from(Pose {
                    position_m: [0.0, 0.0, -0.4],
                    ..Pose::IDENTITY
                })]
            },
            |poses| recentred(&poses),
        );
        for (index, pose) in poses.iter().enumerate() {
            let distance_m = pose.translation.length();
            if distance_m > RANGE_M {
                let matrix = index + 1;
                return Err(OutOfReach { matrix, distance_m });
            }
        }
        let length = |count: usize, rate: f64| (count - 1) as f64 / rate;
        let duration_s = length(joints.len(), JOINT_RATE_HZ).max(length(poses.len(), POSE_RATE_HZ));
        let mut recording = Self {
            joints,
            poses,
            object_place: Pose::IDENTITY,
            duration_s,
        };
        if let Some(&place) = recording.candidate_places(hand).first() {
            recording.object_place = place;
        }
        Ok(recording)
    }

    /// Variants with the object in other places where the recorded hand could meet
    /// it, the likeliest first.
    #[must_use]
    pub fn variants(&self, hand: &HandModel) -> Vec<Self> {
        self.candidate_places(hand)
            .into_iter()
            .take(VARIANTS)
            .map(|object_place| Self {
                object_place,
                ..self.clone()
            })
            .collect()
    }

    /// Places between thumb and fingertips, at instants when the hand is closed and
    /// moves little. The first tenth of the recording is left for approaching.
    fn candidate_places(&self, hand: &HandModel) -> Vec<Pose> {
        let step = 1.0 / JOINT_RATE_HZ;
        let tips = |time: f64| {
            let sample = self.sample(time);
            let pose = hand.pose(&sample.wrist, &sample.angles);
            let tip = |f: Finger| DVec3::from_array(pose.fingers[f.index()].tip_center_m());
            let fingers = (tip(Finger::Index) + tip(Finger::Middle) + tip(Finger::Ring)) / 3.0;
            (tip(Finger::Thumb), fingers)
        };
        let mut scored = Vec::new();
        let mut time = 0.1 * self.duration_s;
        while time <= self.duration_s {
            let ((thumb, fingers), (_, before)) = (tips(time), tips(time - step));
            // Metres of opening and metres per second of speed, the latter less.
            let score = thumb.distance(fingers) + 0.1 * before.distance(fingers) / step;
            scored.push((score, (thumb + fingers) / 2.0));
            time += step;
        }
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut places: Vec<DVec3> = Vec::new();
        for (_, point) in scored {
            // Places closer than this are one and the same.
            if places.iter().all(|p| p.distance(point) > 0.03) {
                places.push(point);
            }
        }
        places
            .into_iter()
            .map(|translation| {
                Rigid {
                    rotation: DQuat::IDENTITY,
                    translation,
                }
                .into()
            })
            .collect()
    }
}

impl Motion for Recording {
    fn sample(&self, time_s: f64) -> MotionSample {
        let (a, b, t) = bracket(time_s * JOINT_RATE_HZ, self.joints.len());
        let angles = JointAngles(std::array::from_fn(|i| {
            let (a, b) = (self.joints[a].0[i], self.joints[b].0[i]);
            a + (b - a) * t
        }));
        let (a, b, t) = bracket(time_s * POSE_RATE_HZ, self.poses.len());
        MotionSample {
            wrist: self.poses[a].interpolate(&self.poses[b], t).into(),
            angles,
            wrist_switch: false,
        }
    }

    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn key_moments(&self) -> &[KeyMoment] {
        &[]
    }

    fn object_place(&self) -> Pose {
        self.object_place
    }
}

/// The two samples round `position` and the fraction between them, going back and
/// forth over `count` samples.
fn bracket(position: f64, count: usize) -> (usize, usize, f64) {
    let last = (count - 1) as f64;
    if count == 1 {
        return (0, 0, 0.0);
    }
    let folded = position.max(0.0).rem_euclid(2.0 * last);
    let place = if folded > last {
        2.0 * last - folded
    } else {
        folded
    };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and count - 1"
    )]
    let index = (place.floor() as usize).min(count - 2);
    (index, index + 1, place - index as f64)
}

/// From a table frame (z up) to the world (y up), moved so that all positions lie
/// in front of the transmitter, centred sideways and in height. How the receiver
/// sat on the hand is not recorded; x along the fingers and z out of the back of
/// the hand makes the palm face what it reaches for.
fn recentred(poses: &[Pose]) -> Vec<Rigid> {
    let upright = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    // The hand's axes (x right, y up, z back) in the receiver's (x forward, y left, z up).
    let mounting = DQuat::from_mat3(&DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X));
    let mut turned: Vec<Rigid> = poses
        .iter()
        .map(|&pose| {
            let Rigid {
                rotation,
                translation,
            } = pose.into();
            Rigid {
                rotation: upright * rotation * mounting,
                translation: upright * translation,
            }
        })
        .collect();
    let points = || turned.iter().map(|r| r.translation);
    let low = points().fold(DVec3::INFINITY, DVec3::min);
    let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
    let middle = (low + high) / 2.0;
    let shift = DVec3::new(-middle.x, -middle.y, -high.z - CLEARANCE_M);
    for rigid in &mut turned {
        rigid.translation += shift;
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_go_back_and_forth() {
        assert_eq!(bracket(0.0, 3), (0, 1, 0.0));
        assert_eq!(bracket(1.5, 3), (1, 2, 0.5));
        assert_eq!(bracket(2.0, 3), (1, 2, 1.0));
        assert_eq!(bracket(2.5, 3), (1, 2, 0.5));
        assert_eq!(bracket(4.25, 3), (0, 1, 0.25));
        assert_eq!(bracket(7.0, 1), (0, 0, 0.0));
    }

    /// Wherever the table was, the poses end up in front of the transmitter.
    #[test]
    fn poses_are_moved_into_range() {
        let pose = |x: f64, y: f64, z: f64| Pose {
            position_m: [x, y, z],
            ..Pose::IDENTITY
        };
        let moved = recentred(&[pose(1.0, 2.0, 1.5), pose(1.4, 2.6, 1.7)]);
        for rigid in &moved {
            assert!(rigid.translation.z <= -CLEARANCE_M + 1e-12);
        }
        // Up on the table is up in the world.
        assert!((moved[1].translation.y - moved[0].translation.y - 0.2).abs() < 1e-12);
    }
}
