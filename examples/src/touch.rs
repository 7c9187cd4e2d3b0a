//! Collision of the hand with an object's surface.
//!
//! \[Ma98\] (section 4.4.1) approximates the finger segments by cylinders and the
//! fingertips by spheres; the palm takes no part. Everything here happens in the
//! object's own frame: the hand is brought there, the surface stays.

use glove_io::hand::{FingerPose, Segment};
use spheretree::{Contact, Cylinder, Sphere, SphereTree};

/// How close to the surface a fingertip counts as touching it, metres. A blocked
/// finger stops within a tenth of this.
pub const TOUCH_MARGIN_M: f64 = 1e-3;

/// A surface that can be touched: positions of its vertices and a tree over its
/// triangles, built or refitted with these positions.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// The tree.
    pub tree: &'a SphereTree,
    /// The positions it covers.
    pub positions: &'a [[f64; 3]],
}

/// What a finger has to do with a surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Touch {
    /// Nothing.
    #[default]
    Apart,
    /// A segment is at the surface, but not the fingertip.
    Finger,
    /// The fingertip is at the surface, here.
    Fingertip(Contact),
}

/// The shapes of one finger: three cylinders and a sphere.
#[derive(Debug, Clone, Copy)]
pub struct FingerShapes {
    cylinders: [Cylinder; 3],
    tip: Sphere,
}

impl FingerShapes {
    /// The shapes of a finger whose points are given in the surface's frame.
    ///
    /// # Panics
    ///
    /// If the finger is not finite; poses from parsed records always are.
    #[must_use]
    pub fn new(finger: &FingerPose) -> Self {
        Self::padded(finger, 0.0)
    }

    /// The shapes with all radii larger by `pad_m`.
    ///
    /// # Panics
    ///
    /// As [`FingerShapes::new`], and if `pad_m` is negative beyond a radius or not
    /// finite.
    #[must_use]
    pub fn padded(finger: &FingerPose, pad_m: f64) -> Self {
        let cylinder = |Segment {
                            start_m,
                            end_m,
                            radius_m,
                        }: Segment| {
            Cylinder::new(start_m, end_m, radius_m + pad_m).expect("finger segments are finite")
        };
        Self {
            cylinders: finger.segments().map(cylinder),
            tip: Sphere::new(finger.tip_center_m(), finger.tip_radius_m() + pad_m)
                .expect("fingertips are finite"),
        }
    }

    /// Whether any part of the finger enters the surface.
    #[must_use]
    pub fn hit(&self, surface: Surface<'_>) -> bool {
        self.distal_hits(surface) || self.palmward_hit(surface)
    }

    /// Whether the distal segment or the fingertip enters the surface.
    #[must_use]
    pub fn distal_hits(&self, Surface { tree, positions }: Surface<'_>) -> bool {
        tree.any(positions, &self.tip) || tree.any(positions, &self.cylinders[2])
    }

    /// Whether one of the two segments nearer to the palm enters the surface.
    #[must_use]
    pub fn palmward_hit(&self, Surface { tree, positions }: Surface<'_>) -> bool {
        self.cylinders[..2].iter().any(|c| tree.any(positions, c))
    }
}

impl Touch {
    /// What this finger touches, within [`TOUCH_MARGIN_M`].
    ///
    /// A fingertip touches at the surface point nearest to its centre. Where the
    /// side of the distal segment is at the surface, that counts as the fingertip
    /// as long as the tip itself is within one more radius.
    #[must_use]
    pub fn of(finger: &FingerPose, surface: Surface<'_>) -> Self {
        let Surface { tree, positions } = surface;
        let padded = FingerShapes::padded(finger, TOUCH_MARGIN_M);
        if padded.distal_hits(surface)
            && let Some(contact) =
                tree.sphere_contact(positions, &padded.tip, finger.tip_radius_m())
        {
            Self::Fingertip(contact)
        } else if padded.hit(surface) {
            Self::Finger
        } else {
            Self::Apart
        }
    }

    /// The contact of the fingertip, if it touches.
    #[must_use]
    pub fn fingertip(&self) -> Option<Contact> {
        match self {
            Self::Fingertip(contact) => Some(*contact),
            Self::Apart | Self::Finger => None,
        }
    }
}
