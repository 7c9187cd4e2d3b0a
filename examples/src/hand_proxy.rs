//! The virtual hand: the real hand, except that it does not enter the object.
//!
//! While the object is rigid, \[Ma98\] (section 4.5.3) recalls the last free position
//! of a finger that would penetrate it. Here the last free position is found along
//! the way from the last frame to this one, to a hundredth of a millimetre, so
//! that a fast finger neither jumps through a thin object nor stops far in front
//! of it. First the wrist moves with the fingers as they are, then all fingers
//! spread, then each one bends by itself: a blocked finger stops alone, a blocked hand
//! stops with all its fingers (the thesis's fingers would come off the palm).
//!
//! A finger that finds itself inside, because the object sprang back or was put
//! where the hand is, blocks nothing until it is out again.

use glove_io::{
    JointAngles, Sensor,
    hand::{Finger, HandModel, HandPose},
};

use crate::{
    geometry::Rigid,
    touch::{FingerShapes, Surface},
};

/// Steps along the way are at most this long at any point of the hand, metres:
/// less than half the thinnest fingertip.
const STEP_M: f64 = 3e-3;
/// A blocked motion stops this close in front of the first contact, metres.
const STOP_M: f64 = 1e-5;
/// Fingers keep this distance from the surface, metres, so that rounding never
/// puts one inside.
const CLEARANCE_M: f64 = 5e-6;
/// More steps than this in one frame mean that the tracker jumped (3 m); the way
/// is then cut into this many longer ones.
const MAX_STEPS: f64 = 1000.0;
/// No point of the hand is farther from the wrist, metres.
const HAND_REACH_M: f64 = 0.22;
/// No point of a finger is farther from its first joint, metres.
const FINGER_REACH_M: f64 = 0.11;

/// The flexion sensors of each finger, in the order of [`Finger::ALL`].
const FLEXION: [&[Sensor]; 5] = [
    &[
        Sensor::ThumbRoll,
        Sensor::ThumbAbduction,
        Sensor::ThumbMcp,
        Sensor::ThumbIp,
    ],
    &[Sensor::IndexMcp, Sensor::IndexPip, Sensor::IndexDip],
    &[Sensor::MiddleMcp, Sensor::MiddlePip, Sensor::MiddleDip],
    &[Sensor::RingMcp, Sensor::RingPip, Sensor::RingDip],
    &[Sensor::LittleMcp, Sensor::LittlePip, Sensor::LittleDip],
];
/// Sensors that move several fingers within the palm.
const SPREAD: [Sensor; 4] = [
    Sensor::MiddleIndexAbduction,
    Sensor::RingMiddleAbduction,
    Sensor::LittleRingAbduction,
    Sensor::PalmArch,
];

/// Where a hand is: its wrist in the object's frame, and its joint angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Posture {
    /// The wrist, before the wrist joint.
    pub wrist: Rigid,
    /// Joint angles.
    pub angles: JointAngles,
}

impl Posture {
    fn interpolate(&self, other: &Self, t: f64) -> Self {
        Self {
            wrist: self.wrist.interpolate(&other.wrist, t),
            angles: JointAngles(std::array::from_fn(|i| {
                let (a, b) = (self.angles.0[i], other.angles.0[i]);
                a + (b - a) * t
            })),
        }
    }

    /// The same posture with some sensors as in `other`.
    fn with(mut self, sensors: &[Sensor], other: &Self) -> Self {
        for &sensor in sensors {
            self.angles[sensor] = other.angles[sensor];
        }
        self
    }

    /// An upper bound for the way of any point of the hand from here to `other`,
    /// metres, along the arcs of the joints.
    fn way_m(&self, other: &Self) -> f64 {
        let turned = |sensors: &[Sensor]| -> f64 {
            sensors
                .iter()
                .map(|&s| (other.angles[s] - self.angles[s]).abs())
                .sum()
        };
        let whole = self.wrist.rotation.angle_between(other.wrist.rotation)
            + turned(&[Sensor::WristPitch, Sensor::WristYaw])
            + turned(&SPREAD);
        let bent = FLEXION.iter().map(|s| turned(s)).fold(0.0, f64::max);
        self.wrist.translation.distance(other.wrist.translation)
            + HAND_REACH_M * whole
            + FINGER_REACH_M * bent
    }
}

/// The virtual hand's memory: its last posture.
#[derive(Debug, Clone, Default)]
pub struct HandProxy {
    posture: Option<Posture>,
}

/// What came of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Advance {
    /// The posture reached.
    pub posture: Posture,
    /// The hand there, in the object's frame.
    pub hand: HandPose,
    /// Fingers that were inside the object to begin with.
    pub inside: [bool; 5],
}

impl HandProxy {
    /// Forgets the last posture: the next one is taken as it is.
    pub fn reset(&mut self) {
        self.posture = None;
    }

    /// Moves without regard to the surface, no point of the hand by more than
    /// `reach_m`: fingers that the rigid object had blocked catch up when it gives
    /// way, rather than jump.
    pub fn follow(&mut self, model: &HandModel, target: Posture, reach_m: f64) -> Advance {
        let posture = self.posture.map_or(target, |start| {
            let way_m = start.way_m(&target);
            if way_m > reach_m {
                start.interpolate(&target, reach_m / way_m)
            } else {
                target
            }
        });
        self.posture = Some(posture);
        Advance {
            posture,
            hand: pose(model, &posture),
            inside: [false; 5],
        }
    }

    /// Moves towards `target` as far as the surface allows. `carried` says that
    /// the object is fixed to the palm: the wrist then cannot push a finger into it.
    pub fn advance(
        &mut self,
        model: &HandModel,
        target: Posture,
        surface: Surface<'_>,
        carried: bool,
    ) -> Advance {
        let start = self.posture.unwrap_or(target);
        let wrist = Posture {
            wrist: target.wrist,
            ..start
        }
        .with(&[Sensor::WristPitch, Sensor::WristYaw], &target);
        let start = if carried { wrist } else { start };
        let inside = pose(model, &start)
            .fingers
            .map(|finger| FingerShapes::new(&finger).hit(surface));
        let blocked_by = |fingers: &[Finger], posture: &Posture| {
            let hand = pose(model, posture);
            fingers.iter().map(|f| f.index()).any(|f| {
                !inside[f] && FingerShapes::padded(&hand.fingers[f], CLEARANCE_M).hit(surface)
            })
        };

        let blocked = |p: &Posture| blocked_by(&Finger::ALL, p);
        let mut reached = last_free(&start, &wrist, blocked);
        reached = last_free(&reached, &reached.with(&SPREAD, &target), blocked);
        for (finger, sensors) in Finger::ALL.into_iter().zip(FLEXION) {
            let bent = reached.with(sensors, &target);
            reached = last_free(&reached, &bent, |p| blocked_by(&[finger], p));
        }
        self.posture = Some(reached);
        Advance {
            posture: reached,
            hand: pose(model, &reached),
            inside,
        }
    }
}

fn pose(model: &HandModel, posture: &Posture) -> HandPose {
    model.pose(&posture.wrist.into(), &posture.angles)
}

/// The last posture on the way before the first that is blocked; the start itself
/// is not asked.
fn last_free(start: &Posture, end: &Posture, blocked: impl Fn(&Posture) -> bool) -> Posture {
    let way_m = start.way_m(end);
    if way_m == 0.0 {
        return *start;
    }
    let steps = (way_m / STEP_M).ceil().min(MAX_STEPS);
    let at = |t: f64| start.interpolate(end, t);
    let (mut free, mut step) = (0.0, 0.0);
    while step < steps {
        step += 1.0;
        let mut first_blocked = step / steps;
        if !blocked(&at(first_blocked)) {
            free = first_blocked;
            continue;
        }
        while (first_blocked - free) * way_m > STOP_M {
            let middle = 0.5 * (free + first_blocked);
            if blocked(&at(middle)) {
                first_blocked = middle;
            } else {
                free = middle;
            }
        }
        return if free > 0.0 { at(free) } else { *start };
    }
    *end
}
