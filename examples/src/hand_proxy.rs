//! The virtual hand: the real hand, except that it does not enter the object.
//!
//! While the object is rigid, \[Ma98\] (section 4.5.3) recalls the last free position
//! of a finger that would penetrate it. Here the last free position is found along
//! the way from the last frame to this one, to a hundredth of a millimetre, so
//! that a fast finger neither jumps through a thin object nor stops far in front
//! of it. First the hand as a whole moves with its fingers as they are, then each
//! finger bends by itself: a blocked finger stops alone, a blocked hand stops with
//! all its fingers (the thesis's fingers would come off the palm).

use glam::DVec3;
use glove_io::{
    JointAngles, Sensor,
    hand::{Finger, FingerPose, HandModel, HandPose},
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
/// More steps than this in one frame mean that the tracker jumped (3 m); the way
/// is then cut into this many longer ones.
const MAX_STEPS: f64 = 1000.0;

/// The flexion sensors of each finger, in the order of [`Finger::ALL`]. All other
/// sensors move several fingers at once and belong to the hand as a whole.
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
}

/// The virtual hand's memory: its last free posture.
#[derive(Debug, Clone, Default)]
pub struct HandProxy {
    free: Option<Posture>,
}

/// What came of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Advance {
    /// The posture reached.
    pub posture: Posture,
    /// The hand there, in the object's frame.
    pub hand: HandPose,
    /// Whether the hand is free of the object. It is not as long as it started
    /// inside, for instance when the object was put where the hand is.
    pub free: bool,
}

impl HandProxy {
    /// Forgets the last posture: the next one is taken as it is.
    pub fn reset(&mut self) {
        self.free = None;
    }

    /// Moves without regard to the surface, no point of the hand by more than
    /// `reach_m`: fingers that the rigid object had blocked catch up when it gives
    /// way, rather than jump.
    pub fn follow(&mut self, model: &HandModel, target: Posture, reach_m: f64) -> Advance {
        let posture = self.free.map_or(target, |start| {
            let way = longest_way(&pose(model, &start).fingers, &pose(model, &target).fingers);
            if way > reach_m {
                start.interpolate(&target, reach_m / way)
            } else {
                target
            }
        });
        self.free = Some(posture);
        Advance {
            posture,
            hand: pose(model, &posture),
            free: true,
        }
    }

    /// Moves towards `target` as far as the surface allows. `carried` says that
    /// the object is fixed to the palm: the hand as a whole then cannot hit it.
    pub fn advance(
        &mut self,
        model: &HandModel,
        target: Posture,
        surface: Surface<'_>,
        carried: bool,
    ) -> Advance {
        let Some(start) = self.free else {
            let hand = pose(model, &target);
            let free = !hand
                .fingers
                .iter()
                .any(|f| FingerShapes::new(f).hit(surface));
            self.free = free.then_some(target);
            return Advance {
                posture: target,
                hand,
                free,
            };
        };

        // The hand as a whole, fingers bent as they were.
        let mut whole = Posture {
            wrist: target.wrist,
            angles: target.angles,
        };
        for sensor in FLEXION.into_iter().flatten() {
            whole.angles[*sensor] = start.angles[*sensor];
        }
        let mut reached = whole;
        if !carried {
            let t = free_fraction(
                |t| pose(model, &start.interpolate(&whole, t)).fingers,
                surface,
            );
            reached = start.interpolate(&whole, t);
        }

        // Each finger by itself.
        for (finger, sensors) in Finger::ALL.into_iter().zip(FLEXION) {
            let mut bent = reached;
            for &sensor in sensors {
                bent.angles[sensor] = target.angles[sensor];
            }
            let from = reached;
            let t = free_fraction(
                |t| [pose(model, &from.interpolate(&bent, t)).fingers[finger.index()]],
                surface,
            );
            reached = from.interpolate(&bent, t);
        }
        self.free = Some(reached);
        Advance {
            posture: reached,
            hand: pose(model, &reached),
            free: true,
        }
    }
}

fn pose(model: &HandModel, posture: &Posture) -> HandPose {
    model.pose(&posture.wrist.into(), &posture.angles)
}

/// The largest fraction of the way, up to the first contact, on which none of the
/// fingers enters the surface. The start is free, or was when the surface had its
/// last shape; then the fingers stay where they are until the way leads out.
fn free_fraction<const N: usize>(
    fingers_at: impl Fn(f64) -> [FingerPose; N],
    surface: Surface<'_>,
) -> f64 {
    let hit = |t: f64| {
        fingers_at(t)
            .iter()
            .any(|finger| FingerShapes::new(finger).hit(surface))
    };
    let length = longest_way(&fingers_at(0.0), &fingers_at(1.0));
    if length == 0.0 {
        return 0.0;
    }
    let steps = (length / STEP_M).ceil().min(MAX_STEPS);
    let mut free = 0.0;
    let mut step = 0.0;
    while step < steps {
        step += 1.0;
        let mut blocked = step / steps;
        if !hit(blocked) {
            free = blocked;
            continue;
        }
        while (blocked - free) * length > STOP_M {
            let middle = 0.5 * (free + blocked);
            if hit(middle) {
                blocked = middle;
            } else {
                free = middle;
            }
        }
        return free;
    }
    1.0
}

/// The longest way of any joint or tip from one pose to another, metres.
fn longest_way(from: &[FingerPose], to: &[FingerPose]) -> f64 {
    from.iter()
        .zip(to)
        .flat_map(|(a, b)| a.points_m.iter().zip(&b.points_m))
        .map(|(&a, &b)| DVec3::from_array(a).distance(DVec3::from_array(b)))
        .fold(0.0, f64::max)
}
