//! Joint angles and wrist pose to points in space.

use glam::{DQuat, DVec3};

use super::{
    limits,
    limits::limited,
    skeleton::{FINGERS, THUMB},
};
use crate::{JointAngles, Pose, Quaternion, Sensor};

/// A finger segment: the part between two neighbouring points of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// End nearer to the wrist, world frame, metres.
    pub start_m: [f64; 3],
    /// End nearer to the tip, world frame, metres.
    pub end_m: [f64; 3],
    /// Radius, metres.
    pub radius_m: f64,
}

/// One finger in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerPose {
    /// The chain of points from the palm to the end of the distal bone's tissue,
    /// world frame, metres. The last is the very tip of the finger.
    pub points_m: [[f64; 3]; 4],
    /// Radii of the three segments, metres; the tip is round with the last one.
    pub radii_m: [f64; 3],
}

impl FingerPose {
    /// Centre of the sphere that rounds the fingertip, world frame, metres: one
    /// radius inward from the tip.
    #[must_use]
    pub fn tip_center_m(&self) -> [f64; 3] {
        let [.., joint, tip] = self.points_m.map(DVec3::from_array);
        (tip - (tip - joint).normalize() * self.radii_m[2]).to_array()
    }

    /// Radius of the fingertip sphere, metres.
    #[must_use]
    pub fn tip_radius_m(&self) -> f64 {
        self.radii_m[2]
    }

    /// The three segments, the one at the palm first. The distal one ends at the
    /// centre of the fingertip sphere.
    #[must_use]
    pub fn segments(&self) -> [Segment; 3] {
        let ends = [self.points_m[1], self.points_m[2], self.tip_center_m()];
        std::array::from_fn(|i| Segment {
            start_m: self.points_m[i],
            end_m: ends[i],
            radius_m: self.radii_m[i],
        })
    }
}

/// A hand in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandPose {
    /// The wrist, after the wrist joint's own rotation: the frame of the palm.
    pub palm: Pose,
    /// The fingers, in the order of [`Finger::ALL`](super::Finger::ALL).
    pub fingers: [FingerPose; 5],
    /// Bases of the metacarpals of index, middle, ring and little finger, world
    /// frame, metres: with the first points of the fingers they outline the palm.
    pub metacarpal_bases_m: [[f64; 3]; 4],
}

/// A hand whose bones are known.
///
/// # Example
///
/// ```
/// use glove_io::{JointAngles, Pose, hand::{Finger, HandModel}};
///
/// let hand = HandModel::average_right();
/// let flat = hand.pose(&Pose::IDENTITY, &JointAngles::default());
/// let middle = flat.fingers[Finger::Middle.index()];
/// // Stretched out, the middle finger reaches 19.4 cm forward of the wrist.
/// assert!((middle.points_m[3][2] + 0.194).abs() < 0.0005);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct HandModel {
    scale: f64,
}

impl HandModel {
    /// An average adult right hand (see the [module's references](super)),
    /// 0.194 m from the wrist to the tip of the middle finger.
    #[must_use]
    pub fn average_right() -> Self {
        Self { scale: 1.0 }
    }

    /// The same hand with every length and radius multiplied by `factor`.
    ///
    /// # Panics
    ///
    /// Unless `factor`, and the hand's scale after it, are positive and finite.
    #[must_use]
    pub fn scaled_by(self, factor: f64) -> Self {
        let scale = self.scale * factor;
        assert!(scale > 0.0 && scale.is_finite(), "scale factor {factor}");
        Self { scale }
    }

    /// Where the hand is, from the pose of the tracker's receiver on the wrist and
    /// the joint angles. Angles are limited to their ranges first.
    #[must_use]
    pub fn pose(&self, wrist: &Pose, angles: &JointAngles) -> HandPose {
        let Quaternion { x, y, z, w } = wrist.orientation;
        let flexion = limited(-angles[Sensor::WristPitch], &limits::WRIST_FLEXION);
        let deviation = limited(angles[Sensor::WristYaw], &limits::WRIST_DEVIATION);
        let palm = Joint {
            position: DVec3::from_array(wrist.position_m),
            rotation: DQuat::from_xyzw(x, y, z, w) * turn(deviation, flexion),
        };
        let arch = limited(-angles[Sensor::PalmArch], &limits::PALM_ARCH);
        let arches = [0.0, 0.0, 0.5 * arch, arch];
        let spreads = spreads(angles);
        let mut metacarpal_bases_m = [[0.0; 3]; 4];
        let fingers: [FingerPose; 5] = std::array::from_fn(|f| match f {
            0 => self.thumb(&palm, angles),
            _ => {
                let i = f - 1;
                let base = palm.at(self.scaled(FINGERS[i].base_m));
                metacarpal_bases_m[i] = base.to_array();
                self.finger(i, &palm, angles, spreads[i], arches[i])
            }
        });
        let DQuat { x, y, z, w } = palm.rotation;
        HandPose {
            palm: Pose {
                position_m: palm.position.to_array(),
                orientation: Quaternion { x, y, z, w },
            },
            fingers,
            metacarpal_bases_m,
        }
    }

    fn finger(
        &self,
        i: usize,
        palm: &Joint,
        angles: &JointAngles,
        spread: f64,
        arch: f64,
    ) -> FingerPose {
        let bones = &FINGERS[i];
        let [mcp, pip, dip] = flexion_sensors(i).map(|s| -angles[s]);
        let metacarpal = Joint {
            position: palm.at(self.scaled(bones.base_m)),
            rotation: palm.rotation * turn(-bones.metacarpal_fan_rad, arch),
        };
        let [proximal, intermediate, distal] = bones.phalanges_m;
        // The knuckle turns with its metacarpal: an arched palm bends no knuckle.
        let first = Joint {
            position: metacarpal.along(bones.metacarpal_m * self.scale),
            rotation: metacarpal.rotation
                * turn(
                    bones.metacarpal_fan_rad - bones.finger_fan_rad + spread,
                    limited(mcp, &limits::MCP_FLEXION),
                ),
        };
        let second = first.next(proximal * self.scale, limited(pip, &limits::PIP_FLEXION));
        let third = second.next(
            intermediate * self.scale,
            limited(dip, &limits::DIP_FLEXION),
        );
        let tip = third.along((distal + bones.tip_tissue_m) * self.scale);
        FingerPose {
            points_m: [first.position, second.position, third.position, tip].map(|p| p.to_array()),
            radii_m: bones.radii_m.map(|r| r * self.scale),
        }
    }

    fn thumb(&self, palm: &Joint, angles: &JointAngles) -> FingerPose {
        let roll = limited(-angles[Sensor::ThumbRoll], &limits::THUMB_ROLL);
        let abduction = limited(-angles[Sensor::ThumbAbduction], &limits::THUMB_ABDUCTION);
        let mcp = limited(-angles[Sensor::ThumbMcp], &limits::THUMB_MCP_FLEXION);
        let ip = limited(-angles[Sensor::ThumbIp], &limits::THUMB_IP_FLEXION);
        // At zero roll the nail looks away from the palm's side (−x), so that
        // flexion bends the thumb across the palm.
        let nail_outward = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let first = Joint {
            position: palm.at(self.scaled(THUMB.base_m)),
            rotation: palm.rotation
                * DQuat::from_rotation_z(roll)
                * DQuat::from_rotation_y(THUMB.rest_abduction_rad + abduction)
                * nail_outward,
        };
        let [metacarpal, proximal, distal] = THUMB.bones_m.map(|l| l * self.scale);
        let second = first.next(metacarpal, mcp);
        let third = second.next(proximal, ip);
        let tip = third.along(distal + THUMB.tip_tissue_m * self.scale);
        FingerPose {
            points_m: [first.position, second.position, third.position, tip].map(|p| p.to_array()),
            radii_m: THUMB.radii_m.map(|r| r * self.scale),
        }
    }

    fn scaled(&self, point: [f64; 3]) -> DVec3 {
        DVec3::from_array(point) * self.scale
    }
}

/// A joint: its position, and the rotation of the bone that starts there.
struct Joint {
    position: DVec3,
    rotation: DQuat,
}

impl Joint {
    /// A point given in this frame.
    fn at(&self, local: DVec3) -> DVec3 {
        self.position + self.rotation * local
    }

    /// The point at `length` along the bone.
    fn along(&self, length: f64) -> DVec3 {
        self.at(DVec3::new(0.0, 0.0, -length))
    }

    /// The joint at the end of this bone, bent by `flexion`.
    fn next(&self, length: f64, flexion: f64) -> Self {
        Self {
            position: self.along(length),
            rotation: self.rotation * turn(0.0, flexion),
        }
    }
}

/// Abduction towards the thumb's side (about +y), then flexion (about −x).
fn turn(abduction: f64, flexion: f64) -> DQuat {
    DQuat::from_rotation_y(abduction) * DQuat::from_rotation_x(-flexion)
}

/// Rotation of index, middle, ring and little finger about y from the relative
/// abduction sensors.
fn spreads(angles: &JointAngles) -> [f64; 4] {
    let ring = -angles[Sensor::RingMiddleAbduction];
    [
        angles[Sensor::MiddleIndexAbduction],
        0.0,
        ring,
        ring - angles[Sensor::LittleRingAbduction],
    ]
    .map(|angle| limited(angle, &limits::SPREAD))
}

/// MCP, PIP and DIP flexion sensors of index, middle, ring and little finger.
fn flexion_sensors(i: usize) -> [Sensor; 3] {
    use Sensor::{
        IndexDip, IndexMcp, IndexPip, LittleDip, LittleMcp, LittlePip, MiddleDip, MiddleMcp,
        MiddlePip, RingDip, RingMcp, RingPip,
    };
    [
        [IndexMcp, IndexPip, IndexDip],
        [MiddleMcp, MiddlePip, MiddleDip],
        [RingMcp, RingPip, RingDip],
        [LittleMcp, LittlePip, LittleDip],
    ][i]
}
