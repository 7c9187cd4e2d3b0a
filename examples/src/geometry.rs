//! Poses as rigid maps.

use glam::{DQuat, DVec3};
use glove_io::{Pose, Quaternion};

/// A rotation followed by a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// The rotation.
    pub rotation: DQuat,
    /// The translation, metres.
    pub translation: DVec3,
}

impl Rigid {
    /// The map that moves nothing.
    pub const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        translation: DVec3::ZERO,
    };

    /// First `other`, then this.
    #[must_use]
    pub fn after(&self, other: &Self) -> Self {
        Self {
            // Products drift off the unit sphere over thousands of frames.
            rotation: (self.rotation * other.rotation).normalize(),
            translation: self.point(other.translation),
        }
    }

    /// The map that undoes this one.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self {
            rotation,
            translation: rotation * -self.translation,
        }
    }

    /// Where a point goes.
    #[must_use]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// Between this (`t = 0`) and `other` (`t = 1`), turning the short way.
    #[must_use]
    pub fn interpolate(&self, other: &Self, t: f64) -> Self {
        Self {
            rotation: self.rotation.slerp(other.rotation, t),
            translation: self.translation.lerp(other.translation, t),
        }
    }
}

impl From<Pose> for Rigid {
    fn from(pose: Pose) -> Self {
        let Quaternion { x, y, z, w } = pose.orientation;
        Self {
            rotation: DQuat::from_xyzw(x, y, z, w),
            translation: DVec3::from_array(pose.position_m),
        }
    }
}

impl From<Rigid> for Pose {
    fn from(map: Rigid) -> Self {
        let DQuat { x, y, z, w } = map.rotation;
        Self {
            position_m: map.translation.to_array(),
            orientation: Quaternion { x, y, z, w },
        }
    }
}
