//! How far each finger is closed: one number per finger instead of twenty angles.

use glove_io::{JointAngles, Sensor, hand::Finger};

/// Closure of the five fingers, 0 open to 1 fully closed, and how they close.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Closure {
    pub(super) fingers: [f64; 5],
    pub(super) style: Style,
}

/// The way a hand closes, the same throughout a grasp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Style {
    /// Roll of the thumb across the palm.
    pub(super) thumb_roll_rad: f64,
    /// Flexion of the fingers' middle joints when closed: small for flat fingers
    /// against a flat side, large for fingers that curl round the object.
    pub(super) curl_rad: f64,
}

impl Closure {
    /// Joint angles of the hand so closed. Flexion is negative in the glove's
    /// convention. The joints of a finger bend together, the distal ones by two
    /// thirds of the middle ones, as in a relaxed grasp.
    pub(super) fn angles(&self) -> JointAngles {
        let mut angles = JointAngles::default();
        let degrees = |open: f64, closed: f64, s: f64| (open + (closed - open) * s).to_radians();
        let thumb = self.fingers[Finger::Thumb.index()];
        angles[Sensor::ThumbRoll] = -self.style.thumb_roll_rad;
        angles[Sensor::ThumbAbduction] = -degrees(55.0, 5.0, thumb);
        angles[Sensor::ThumbMcp] = -degrees(0.0, 45.0, thumb);
        angles[Sensor::ThumbIp] = -degrees(0.0, 55.0, thumb);
        for (finger, [mcp, pip, dip]) in [
            (
                Finger::Index,
                [Sensor::IndexMcp, Sensor::IndexPip, Sensor::IndexDip],
            ),
            (
                Finger::Middle,
                [Sensor::MiddleMcp, Sensor::MiddlePip, Sensor::MiddleDip],
            ),
            (
                Finger::Ring,
                [Sensor::RingMcp, Sensor::RingPip, Sensor::RingDip],
            ),
            (
                Finger::Little,
                [Sensor::LittleMcp, Sensor::LittlePip, Sensor::LittleDip],
            ),
        ] {
            let s = self.fingers[finger.index()];
            angles[mcp] = -degrees(10.0, 88.0, s);
            angles[pip] = -degrees(12.0, self.style.curl_rad.to_degrees(), s);
            angles[dip] = angles[pip] * 2.0 / 3.0;
        }
        angles
    }
}
