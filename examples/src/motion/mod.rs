//! Where a hand's motion comes from: a script or recordings.
//!
//! A motion moves the *simulated devices*; the loop itself reads only their bytes.

mod closure;
mod grasp_plan;
mod noise;
mod recording;
mod script;

use glove_io::{JointAngles, Pose};

pub use recording::{OutOfReach, Recording, RecordingSource};
pub use script::{NoGrasp, Script};

/// What a real hand does at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionSample {
    /// Pose of the tracker's receiver on the wrist, world frame.
    pub wrist: Pose,
    /// Joint angles.
    pub angles: JointAngles,
    /// Whether the switch on the glove's wrist is held down.
    pub wrist_switch: bool,
}

/// A named instant, for pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyMoment {
    /// Seconds from the start.
    pub time_s: f64,
    /// Caption.
    pub name: &'static str,
}

/// A hand motion over time.
pub trait Motion {
    /// What the hand does `time_s` seconds after the start.
    fn sample(&self, time_s: f64) -> MotionSample;

    /// How long it takes, seconds.
    fn duration_s(&self) -> f64;

    /// Instants worth a picture, in order; empty if only the outcome tells.
    fn key_moments(&self) -> &[KeyMoment];

    /// Where the object stands: its pose at rest in the world.
    fn object_place(&self) -> Pose;
}
