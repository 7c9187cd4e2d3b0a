//! Collision of the hand with an object's surface.
//!
//! [Ma98] (section 4.4.1) approximates the finger segments by cylinders and the
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
        let cylinders = finger.segments().map(
            |Segment {
                 start_m,
                 end_m,
                 radius_m,
             }| {
                Cylinder::new(start_m, end_m, radius_m).expect("finger segments are finite")
            },
        );
        let tip = Sphere::new(finger.tip_center_m(), finger.tip_radius_m())
            .expect("fingertips are finite");
        Self { cylinders, tip }
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

    /// Where the fingertip touches the surface: the surface point nearest to the
    /// centre of the tip, if it lies within the radius and [`TOUCH_MARGIN_M`], or,
    /// when the side of the distal segment touches first, within one more radius.
    #[must_use]
    pub fn tip_contact(&self, surface: Surface<'_>) -> Option<Contact> {
        let Surface { tree, positions } = surface;
        tree.sphere_contact(positions, &self.tip, TOUCH_MARGIN_M)
            .or_else(|| {
                let distal = self.cylinders[2];
                let padded = Cylinder::new(
                    distal.start(),
                    distal.end(),
                    distal.radius() + TOUCH_MARGIN_M,
                )
                .expect("larger than a valid cylinder");
                tree.any(positions, &padded)
                    .then(|| tree.sphere_contact(positions, &self.tip, self.tip.radius()))
                    .flatten()
            })
    }
}
