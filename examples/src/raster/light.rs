//! How much light a surface sends to the eye.
//!
//! One key light that casts shadows, one fill light from the other side, and
//! light from sky and floor. The lights turn with the camera about the vertical
//! axis, so that a scene looks alike from all sides.

use super::camera::Camera;
use glam::DVec3;

const KEY: f64 = 0.78;
const FILL: f64 = 0.16;
const SKY: DVec3 = DVec3::new(0.34, 0.36, 0.40);
const FLOOR: DVec3 = DVec3::new(0.20, 0.19, 0.18);
const SHINE: f64 = 0.22;
const SHINE_EXPONENT: i32 = 48;

/// How far light creeps around skin, per colour: red goes farthest.
const SKIN_WRAP: DVec3 = DVec3::new(0.36, 0.18, 0.12);

/// How a surface reflects light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finish {
    /// Diffuse, with a soft highlight.
    Satin,
    /// Like a hand: light bleeds into the shade with a warm tint, and the
    /// highlight is faint.
    Skin,
}

/// The lights of a picture, as unit vectors towards them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lights {
    pub(super) key: DVec3,
    fill: DVec3,
}

impl Lights {
    pub(super) fn new(camera: &Camera) -> Self {
        let back = camera.right.cross(DVec3::Y);
        Self {
            key: (DVec3::Y - 0.5 * camera.right + 0.55 * back).normalize(),
            fill: (0.35 * DVec3::Y + camera.right + 0.4 * back).normalize(),
        }
    }

    /// The light from a point with unit `normal`, towards unit `to_eye`.
    ///
    /// `visible_key` is the fraction of the key light that is not in shadow.
    pub(super) fn shade(
        &self,
        normal: DVec3,
        to_eye: DVec3,
        albedo: DVec3,
        finish: Finish,
        visible_key: f64,
    ) -> DVec3 {
        let (wrap, shine) = match finish {
            Finish::Satin => (DVec3::ZERO, SHINE),
            Finish::Skin => (SKIN_WRAP, 0.4 * SHINE),
        };
        let lambert =
            (DVec3::splat(normal.dot(self.key)) + wrap).max(DVec3::ZERO) / (DVec3::ONE + wrap);
        let key = lambert * (KEY * visible_key);
        let fill = FILL * normal.dot(self.fill).max(0.0);
        let ambient = FLOOR.lerp(SKY, 0.5 + 0.5 * normal.y);
        let highlight = normal
            .dot((self.key + to_eye).normalize_or_zero())
            .max(0.0)
            .powi(SHINE_EXPONENT)
            * shine
            * visible_key;
        albedo * (key + ambient + fill) + highlight
    }
}
