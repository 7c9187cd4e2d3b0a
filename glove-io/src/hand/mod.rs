//! Forward kinematics: from joint angles and a wrist pose to fingers in space.
//!
//! The hand is a right hand in OpenXR's axes: in its wrist frame −z points along
//! the straight middle finger, +y out of the back of the hand, +x away from the
//! thumb. Each finger is a chain of four points, three segments between them, and
//! a round tip; [Ma98] (section 4.4.1) approximates the fifteen segments by
//! cylinders and the five fingertips by spheres.
//!
//! | finger | points | segments |
//! |---|---|---|
//! | thumb | CMC, MCP, IP, tip | metacarpal, proximal, distal |
//! | others | MCP, PIP, DIP, tip | proximal, intermediate, distal |
//!
//! # Rotations
//!
//! Flexion by `θ` turns about the joint's −x, abduction about its y, abduction
//! first. The glove measures abductions *between* fingers; the middle finger is
//! taken as the reference, the index finger gets the middle–index angle, the ring
//! finger the ring–middle angle, and the little finger both angles on its side.
//! The palm arch flexes the little metacarpal, and the ring metacarpal by half.
//! The thumb turns at its CMC joint by abduction in the palm's plane, then rolls
//! across the palm about the direction of the hand; that roll axis is our choice.
//! Every angle is first limited to its anatomical range ([`limits`]).
//!
//! # References
//!
//! * [BK10] A. Buryanov, V. Kotiuk, *Proportions of hand segments*, Int. J.
//!   Morphol. 28(3), 2010, table 1: bone lengths and soft tissue of the tips.
//! * [Gre91] T. Greiner, *Hand anthropometry of U.S. Army personnel*, 1991: wrist
//!   to tip distances and joint breadths, which place the bases of the fingers.
//! * [AAOS] American Academy of Orthopaedic Surgeons, *Joint motion: method of
//!   measuring and recording*, 1965: ranges of motion.
//! * [Ma98] Ma Mun Chung, *Interacting with a virtually deformable object using an
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
