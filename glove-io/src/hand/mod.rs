//! Forward kinematics: from joint angles and a wrist pose to fingers in space.
//!
//! The hand is a right hand in OpenXR's axes: in its wrist frame −z points along
//! the straight middle finger, +y out of the back of the hand, +x away from the
//! thumb. Each finger is a chain of four points, three segments between them, and
//! a round tip; \[Ma98\] (section 4.4.1) approximates the fifteen segments by
//! cylinders and the five fingertips by spheres.
//!
//! | finger | points | segments |
//! |---|---|---|
//! | thumb | CMC, MCP, IP, tip | metacarpal, proximal, distal |
//! | others | MCP, PIP, DIP, tip | proximal, intermediate, distal |
//!
//! # Rotations
//!
//! Write `F(θ)` for flexion, a turn about a joint's −x by `θ`, and `A(θ)` for
//! abduction towards the thumb's side, a turn about its y. A bone points along the
//! −z of its joint. Down a chain, the rotations multiply from left to right:
//!
//! | joint | rotation | `θ` from the sensors of [`Sensor`](crate::Sensor) |
//! |---|---|---|
//! | wrist | `A(θ) F(φ)` | `θ` = `WristYaw`, `φ` = −`WristPitch` |
//! | base of a metacarpal | `A(−fan) F(arch)` | arch = −`PalmArch` for the little, half of it for the ring finger, else 0 |
//! | MCP | `A(fan − finger's fan + θ) F(φ)` | `θ`: see below; `φ` = −`…Mcp` |
//! | PIP, DIP | `F(φ)` | `φ` = −`…Pip`, −`…Dip` |
//! | base of the thumb | turn about z by `ρ`, `A(rest + θ)`, quarter turn about z | `ρ` = −`ThumbRoll`, `θ` = −`ThumbAbduction` |
//! | thumb MCP, IP | `F(φ)` | `φ` = −`ThumbMcp`, −`ThumbIp` |
//!
//! The fans spread metacarpals and straight fingers over the plane of the palm. The
//! glove measures abductions *between* fingers, positive when they part; the middle
//! finger is taken as the reference: `θ` is `MiddleIndexAbduction` for the index
//! finger, −`RingMiddleAbduction` for the ring finger, and that minus
//! `LittleRingAbduction` for the little finger. The thumb's abduction has the sign of
//! flexion instead: it opens as the sensor's angle falls, as in VirtualHand
//! recordings. The thumb rolls across the palm about the direction of the hand; that
//! axis is our choice. The quarter turn makes it bend across the palm.
//!
//! Every angle is first limited to its anatomical range ([`limits`]), so that any
//! 22 numbers, NaN and infinities included, give a finite hand.
//!
//! # References
//!
//! * \[BK10\] A. Buryanov, V. Kotiuk, *Proportions of hand segments*, Int. J.
//!   Morphol. 28(3), 2010, table 1: bone lengths and soft tissue of the tips.
//! * \[Gre91\] T. Greiner, *Hand anthropometry of U.S. Army personnel*, 1991: wrist
//!   to tip distances and joint breadths, which place the bases of the fingers.
//! * \[AAOS\] American Academy of Orthopaedic Surgeons, *Joint motion: method of
//!   measuring and recording*, 1965: ranges of motion. Thumb roll and palm arch, and
//!   the extension of knuckles and thumb, are not in it and are our choice.
//! * \[Ma98\] Ma Mun Chung, *Interacting with a virtually deformable object using an
//!   instrumented glove*, M.Phil. thesis, The Chinese University of Hong Kong, 1998.

mod kinematics;
pub mod limits;
mod skeleton;

pub use kinematics::{FingerPose, HandModel, HandPose, Segment};

/// The five fingers, thumb first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Finger {
    /// First digit.
    Thumb,
    /// Second digit, the thesis's "first finger".
    Index,
    /// Third digit.
    Middle,
    /// Fourth digit.
    Ring,
    /// Fifth digit.
    Little,
}

impl Finger {
    /// All five, in the order of [`HandPose::fingers`].
    pub const ALL: [Self; 5] = [
        Self::Thumb,
        Self::Index,
        Self::Middle,
        Self::Ring,
        Self::Little,
    ];

    /// Position in [`Finger::ALL`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Name in lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thumb => "thumb",
            Self::Index => "index",
            Self::Middle => "middle",
            Self::Ring => "ring",
            Self::Little => "little",
        }
    }
}
