//! The sensors of a CyberGlove and the joint angles they measure.

use core::ops::{Index, IndexMut};

/// Sensors of the fully equipped glove.
pub const SENSOR_COUNT: usize = 22;

/// One sensor of the 22-sensor glove, in record order.
///
/// The 18-sensor glove lacks the four sensors named `…Dip`; see
/// [`SensorCount::sensors`](crate::cyberglove::SensorCount::sensors).
///
/// # Reference
///
/// Virtual Technologies, *CyberGlove Reference Manual*, 1998: 24 slots in six
/// groups of four (thumb, index, middle, ring, little finger, palm and wrist).
/// Slots 7 and 23 were never built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Sensor {
    /// Roll of the thumb across the palm.
    ThumbRoll,
    /// Flexion of the thumb at its knuckle (MCP).
    ThumbMcp,
    /// Flexion of the thumb at its last joint (IP).
    ThumbIp,
    /// Angle between thumb and index finger.
    ThumbAbduction,
    /// Flexion of the index finger at its knuckle (MCP).
    IndexMcp,
    /// Flexion of the index finger at its middle joint (PIP).
    IndexPip,
    /// Flexion of the index finger at its last joint (DIP).
    IndexDip,
    /// Flexion of the middle finger at its knuckle (MCP).
    MiddleMcp,
    /// Flexion of the middle finger at its middle joint (PIP).
    MiddlePip,
    /// Flexion of the middle finger at its last joint (DIP).
    MiddleDip,
    /// Angle between index and middle finger.
    MiddleIndexAbduction,
    /// Flexion of the ring finger at its knuckle (MCP).
    RingMcp,
    /// Flexion of the ring finger at its middle joint (PIP).
    RingPip,
    /// Flexion of the ring finger at its last joint (DIP).
    RingDip,
    /// Angle between middle and ring finger.
    RingMiddleAbduction,
    /// Flexion of the little finger at its knuckle (MCP).
    LittleMcp,
    /// Flexion of the little finger at its middle joint (PIP).
    LittlePip,
    /// Flexion of the little finger at its last joint (DIP).
    LittleDip,
    /// Angle between ring and little finger.
    LittleRingAbduction,
    /// Arch of the palm: the little finger rotating across it.
    PalmArch,
    /// Flexion of the wrist.
    WristPitch,
    /// Radial and ulnar deviation of the wrist.
    WristYaw,
}

impl Sensor {
    /// All sensors in record order.
    pub const ALL: [Self; SENSOR_COUNT] = [
        Self::ThumbRoll,
        Self::ThumbMcp,
        Self::ThumbIp,
        Self::ThumbAbduction,
        Self::IndexMcp,
        Self::IndexPip,
        Self::IndexDip,
        Self::MiddleMcp,
        Self::MiddlePip,
        Self::MiddleDip,
        Self::MiddleIndexAbduction,
        Self::RingMcp,
        Self::RingPip,
        Self::RingDip,
        Self::RingMiddleAbduction,
        Self::LittleMcp,
        Self::LittlePip,
        Self::LittleDip,
        Self::LittleRingAbduction,
        Self::PalmArch,
        Self::WristPitch,
        Self::WristYaw,
    ];

    /// Place in the record of a 22-sensor glove and in [`JointAngles`], from 0.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Slot number 0–22 in the glove's 24-slot tables; also its bit in a mask.
    #[must_use]
    pub const fn slot(self) -> u8 {
        let index = self as u8;
        // Slot 7, the absolute abduction of the index finger, has no sensor.
        if index < 7 { index } else { index + 1 }
    }

    /// The name the ROS drivers publish the sensor under.
    #[must_use]
    pub const fn ros_name(self) -> &'static str {
        match self {
            Self::ThumbRoll => "G_ThumbRotate",
            Self::ThumbMcp => "G_ThumbMPJ",
            Self::ThumbIp => "G_ThumbIJ",
            Self::ThumbAbduction => "G_ThumbAb",
            Self::IndexMcp => "G_IndexMPJ",
            Self::IndexPip => "G_IndexPIJ",
            Self::IndexDip => "G_IndexDIJ",
            Self::MiddleMcp => "G_MiddleMPJ",
            Self::MiddlePip => "G_MiddlePIJ",
            Self::MiddleDip => "G_MiddleDIJ",
            Self::MiddleIndexAbduction => "G_MiddleIndexAb",
            Self::RingMcp => "G_RingMPJ",
            Self::RingPip => "G_RingPIJ",
            Self::RingDip => "G_RingDIJ",
            Self::RingMiddleAbduction => "G_RingMiddleAb",
            Self::LittleMcp => "G_PinkieMPJ",
            Self::LittlePip => "G_PinkiePIJ",
            Self::LittleDip => "G_PinkieDIJ",
            Self::LittleRingAbduction => "G_PinkieRingAb",
            Self::PalmArch => "G_PalmArch",
            Self::WristPitch => "G_WristPitch",
            Self::WristYaw => "G_WristYaw",
        }
    }

    /// Whether the sensor sits on a distal joint, which 18-sensor gloves lack.
    pub(crate) const fn is_distal(self) -> bool {
        matches!(
            self,
            Self::IndexDip | Self::MiddleDip | Self::RingDip | Self::LittleDip
        )
    }
}

/// The 22 joint angles of a hand in radians, in the record order of [`Sensor`].
///
/// Signs follow the VirtualHand library: bending a joint towards the palm is
/// *negative*, bending it backwards positive. Abductions are relative, between
/// neighbouring fingers. The table shows what each value rotates.
///
/// | index | sensor | joint | motion |
/// |---|---|---|---|
/// | 0 | [`ThumbRoll`](Sensor::ThumbRoll) | thumb CMC | roll about the thumb's roll axis |
/// | 1 | [`ThumbMcp`](Sensor::ThumbMcp) | thumb MCP | flexion − |
/// | 2 | [`ThumbIp`](Sensor::ThumbIp) | thumb IP | flexion − |
/// | 3 | [`ThumbAbduction`](Sensor::ThumbAbduction) | thumb CMC | abduction from the index finger |
/// | 4, 5, 6 | [`IndexMcp`](Sensor::IndexMcp), [`IndexPip`](Sensor::IndexPip), [`IndexDip`](Sensor::IndexDip) | index MCP, PIP, DIP | flexion − |
/// | 7, 8, 9 | [`MiddleMcp`](Sensor::MiddleMcp), [`MiddlePip`](Sensor::MiddlePip), [`MiddleDip`](Sensor::MiddleDip) | middle MCP, PIP, DIP | flexion − |
/// | 10 | [`MiddleIndexAbduction`](Sensor::MiddleIndexAbduction) | index and middle MCP | relative abduction |
/// | 11, 12, 13 | [`RingMcp`](Sensor::RingMcp), [`RingPip`](Sensor::RingPip), [`RingDip`](Sensor::RingDip) | ring MCP, PIP, DIP | flexion − |
/// | 14 | [`RingMiddleAbduction`](Sensor::RingMiddleAbduction) | middle and ring MCP | relative abduction |
/// | 15, 16, 17 | [`LittleMcp`](Sensor::LittleMcp), [`LittlePip`](Sensor::LittlePip), [`LittleDip`](Sensor::LittleDip) | little MCP, PIP, DIP | flexion − |
/// | 18 | [`LittleRingAbduction`](Sensor::LittleRingAbduction) | ring and little MCP | relative abduction |
/// | 19 | [`PalmArch`](Sensor::PalmArch) | little and ring CMC | flexion − |
/// | 20 | [`WristPitch`](Sensor::WristPitch) | wrist | flexion − |
/// | 21 | [`WristYaw`](Sensor::WristYaw) | wrist | radial and ulnar deviation |
///
/// # Example
///
/// ```
/// use glove_io::{JointAngles, Sensor};
///
/// let mut angles = JointAngles::default();
/// angles[Sensor::IndexPip] = -0.5; // bent by half a radian
/// assert_eq!(angles.0[5], -0.5);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointAngles(pub [f64; SENSOR_COUNT]);

impl Index<Sensor> for JointAngles {
    type Output = f64;

    fn index(&self, sensor: Sensor) -> &f64 {
        &self.0[sensor.index()]
    }
}

impl IndexMut<Sensor> for JointAngles {
    fn index_mut(&mut self, sensor: Sensor) -> &mut f64 {
        &mut self.0[sensor.index()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_order_and_slots() {
        for (index, sensor) in Sensor::ALL.into_iter().enumerate() {
            assert_eq!(sensor.index(), index);
        }
        let slots = Sensor::ALL.map(Sensor::slot);
        assert_eq!(
            slots,
            [
                0, 1, 2, 3, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22
            ]
        );
        assert_eq!(Sensor::LittleMcp.ros_name(), "G_PinkieMPJ");
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "the value is copied, not computed")]
    fn angles_are_indexed_by_sensor() {
        let mut angles = JointAngles::default();
        angles[Sensor::WristYaw] = 0.25;
        assert_eq!(angles.0[21], 0.25);
        assert_eq!(angles[Sensor::WristYaw], 0.25);
    }
}
