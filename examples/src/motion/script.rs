//! A script of hand motion: two grasps from two sides, with a kept shape between.

use glam::{DQuat, DVec3};
use glove_io::{
    Pose, Sensor,
    hand::{Finger, HandModel},
};

use super::{
    KeyMoment, Motion, MotionSample,
    grasp_plan::{APPROACH_M, GraspPlan, OPEN_M},
    noise::{SplitMix64, Tremor},
};
use crate::{geometry::Rigid, touch::Surface};

/// Where the object stands: in front of the transmitter, within the half metre in
/// which the tracker is most accurate, metres.
const PLACE_M: DVec3 = DVec3::new(0.0, 0.0, -0.4);
/// How far the attached object is lifted, metres.
const LIFT_M: f64 = 0.05;

/// A point of the time line.
struct Keyframe {
    time_s: f64,
    /// Wrist, world frame.
    wrist: Rigid,
    /// Which of the two grasps the fingers follow.
    grasp: usize,
    /// Fingertips beyond the surface along their way, metres; negative is open.
    depth_m: f64,
    /// How far thumb and little finger stay behind the others, metres.
    lag_m: f64,
}

/// A scripted hand.
pub struct Script {
    grasps: [GraspPlan; 2],
    keyframes: Vec<Keyframe>,
    key_moments: Vec<KeyMoment>,
    /// The wrist switch is down between these two times.
    switch_s: [f64; 2],
    /// Differences between fingers: how much further each closes, metres.
    bias_m: [f64; 5],
    finger_tremor: [Tremor; 5],
    wrist_tremor: [Tremor; 3],
}

/// The hand of the script cannot take hold of the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the scripted hand finds no grasp in which all five fingertips reach the object; it should be 3 to 10 cm across"
)]
pub struct NoGrasp;

impl Script {
    /// Variants of the script for an object whose rest surface is given: the same
    /// first grasp, and second grasps from different sides, the most promising first.
    ///
    /// # Errors
    ///
    /// [`NoGrasp`] if the object is too large, too small or too oddly shaped.
    pub fn variants(
        hand: &HandModel,
        surface: Surface<'_>,
        seed: u64,
    ) -> Result<Vec<Self>, NoGrasp> {
        let plan = |turn_deg: f64| GraspPlan::find(hand, surface, turn_deg.to_radians());
        let first = plan(0.0).or_else(|| plan(90.0)).ok_or(NoGrasp)?;
        let mut seconds: Vec<GraspPlan> = [90.0, 180.0, -90.0, 135.0, -135.0]
            .into_iter()
            .filter_map(plan)
            .collect();
        // Away from the dents of the first grasp is better: a centimetre is worth a
        // tenth of a score of about two.
        let promise = |plan: &GraspPlan| plan.score + 10.0 * plan.distance_m(&first);
        seconds.sort_by(|a, b| promise(b).total_cmp(&promise(a)));
        if seconds.is_empty() {
            return Err(NoGrasp);
        }
        Ok(seconds
            .into_iter()
            .map(|second| Self::new([first, second], seed))
            .collect())
    }

    fn new(grasps: [GraspPlan; 2], seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let at = |grasp: usize, up_m: f64| {
            let mut wrist = grasps[grasp].wrist;
            wrist.translation += PLACE_M + DVec3::Y * up_m;
            wrist
        };
        let mut keyframes = Vec::new();
        let mut add = |time_s: f64, grasp: usize, up_m: f64, depth_mm: f64, lag_mm: f64| {
            keyframes.push(Keyframe {
                time_s,
                wrist: at(grasp, up_m),
                grasp,
                depth_m: depth_mm * 1e-3,
                lag_m: lag_mm * 1e-3,
            });
        };
        let open = -OPEN_M * 1e3;
        // Approach, close, lift by three fingers; thumb and little finger follow.
        add(0.0, 0, APPROACH_M, open, 0.0);
        add(0.3, 0, APPROACH_M, open, 0.0);
        add(1.3, 0, 0.0, open, 0.0);
        add(2.3, 0, 0.0, 2.5, 10.0);
        add(2.6, 0, 0.0, 2.5, 10.0);
        add(3.3, 0, LIFT_M, 2.5, 10.0);
        add(3.8, 0, LIFT_M, 2.5, 0.0);
        // Squeeze: small, medium, large.
        add(4.2, 0, LIFT_M, 4.0, 0.0);
        add(4.8, 0, LIFT_M, 4.0, 0.0);
        add(5.2, 0, LIFT_M, 6.5, 0.0);
        add(5.8, 0, LIFT_M, 6.5, 0.0);
        add(6.3, 0, LIFT_M, 9.5, 0.0);
        add(7.0, 0, LIFT_M, 9.5, 0.0);
        // Release; the object springs back and stays where it is.
        add(7.8, 0, LIFT_M, -12.0, 0.0);
        add(8.3, 0, LIFT_M, -12.0, 0.0);
        // Take it again, squeeze, press the switch: keep shape.
        add(9.2, 0, LIFT_M, 2.5, 0.0);
        add(9.8, 0, LIFT_M, 9.0, 0.0);
        add(10.6, 0, LIFT_M, 9.0, 0.0);
        add(11.2, 0, LIFT_M, open, 0.0);
        add(11.8, 0, APPROACH_M, open, 0.0);
        // From another side; the surface may now lie deeper than it was planned for.
        add(13.2, 1, APPROACH_M, open, 0.0);
        add(14.2, 1, 0.0, open, 0.0);
        add(15.4, 1, 0.0, 8.0, 0.0);
        add(16.2, 1, 0.0, 12.5, 0.0);
        add(17.0, 1, 0.0, 12.5, 0.0);
        add(17.8, 1, 0.0, -12.0, 0.0);
        add(18.0, 1, 0.0, -12.0, 0.0);
        let key_moments = [
            (1.0, "before"),
            (3.2, "lifted"),
            (4.7, "small squeeze"),
            (5.7, "medium squeeze"),
            (6.9, "large squeeze"),
            (8.2, "released"),
            (11.6, "shape kept"),
            (16.9, "second grasp"),
        ]
        .map(|(time_s, name)| KeyMoment { time_s, name })
        .to_vec();
        Self {
            grasps,
            keyframes,
            key_moments,
            switch_s: [10.2, 10.6],
            bias_m: std::array::from_fn(|_| 4e-4 * random.signed()),
            finger_tremor: std::array::from_fn(|_| Tremor::new(&mut random, 3e-4)),
            wrist_tremor: std::array::from_fn(|_| Tremor::new(&mut random, 3e-4)),
        }
    }
}

impl Motion for Script {
    fn sample(&self, time_s: f64) -> MotionSample {
        let next = self
            .keyframes
            .partition_point(|k| k.time_s <= time_s)
            .clamp(1, self.keyframes.len() - 1);
        let (a, b) = (&self.keyframes[next - 1], &self.keyframes[next]);
        let t = ((time_s - a.time_s) / (b.time_s - a.time_s)).clamp(0.0, 1.0);
        let t = t * t * (3.0 - 2.0 * t);
        let closure = |key: &Keyframe| {
            let depths = std::array::from_fn(|f| {
                let lag = if matches!(Finger::ALL[f], Finger::Thumb | Finger::Little) {
                    key.lag_m
                } else {
                    0.0
                };
                key.depth_m - lag + self.bias_m[f] + self.finger_tremor[f].at(time_s)
            });
            self.grasps[key.grasp].closure(depths).angles()
        };
        let (from, to) = (closure(a), closure(b));
        let mut angles = from;
        for sensor in Sensor::ALL {
            angles[sensor] += (to[sensor] - from[sensor]) * t;
        }
        let mut wrist = a.wrist.interpolate(&b.wrist, t);
        if a.grasp != b.grasp {
            // Round the object, not through it: turn about its vertical axis.
            wrist = around(PLACE_M, &a.wrist, &b.wrist, t);
        }
        wrist.translation +=
            DVec3::from_array(std::array::from_fn(|i| self.wrist_tremor[i].at(time_s)));
        MotionSample {
            wrist: wrist.into(),
            angles,
            wrist_switch: (self.switch_s[0]..self.switch_s[1]).contains(&time_s),
        }
    }

    fn duration_s(&self) -> f64 {
        self.keyframes.last().map_or(0.0, |k| k.time_s)
    }

    fn key_moments(&self) -> &[KeyMoment] {
        &self.key_moments
    }

    fn object_place(&self) -> Pose {
        Rigid {
            rotation: DQuat::IDENTITY,
            translation: PLACE_M,
        }
        .into()
    }
}

/// From one pose to another as seen from a centre that both are turned about.
fn around(centre: DVec3, a: &Rigid, b: &Rigid, t: f64) -> Rigid {
    let local = |r: &Rigid| r.rotation.conjugate() * (r.translation - centre);
    let rotation = a.rotation.slerp(b.rotation, t);
    Rigid {
        rotation,
        translation: centre + rotation * local(a).lerp(local(b), t),
    }
}
