//! The pinhole camera and its pixel grid.

use glam::DVec3;

/// Nothing nearer than this fraction of the distance from eye to target is seen.
const NEAR_FRACTION: f64 = 1e-3;

/// A perspective camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    pub(super) eye: DVec3,
    pub(super) right: DVec3,
    pub(super) up: DVec3,
    pub(super) forward: DVec3,
    pub(super) near: f64,
    tan_half_fov: f64,
}

impl Camera {
    /// A camera at `eye` with `target` in the middle of its picture.
    ///
    /// `up` appears upright in the picture. Where it is parallel to the line of
    /// sight the camera picks some perpendicular direction instead.
    /// `vertical_fov_rad` is the angle between the upper and the lower border.
    ///
    /// # Panics
    ///
    /// If `eye` and `target` coincide or are not finite, or if the angle is not
    /// between 0 and π.
    #[must_use]
    pub fn look_at(eye: [f64; 3], target: [f64; 3], up: [f64; 3], vertical_fov_rad: f64) -> Self {
        assert!(
            vertical_fov_rad > 0.0 && vertical_fov_rad < std::f64::consts::PI,
            "a field of view of {vertical_fov_rad} rad cannot be drawn"
        );
        let eye = DVec3::from(eye);
        let sight = DVec3::from(target) - eye;
        let forward = sight
            .try_normalize()
            .expect("the eye must be away from the target");
        let right = forward
            .cross(DVec3::from(up))
            .try_normalize()
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        Self {
            eye,
            right,
            up: right.cross(forward),
            forward,
            near: NEAR_FRACTION * sight.length(),
            tan_half_fov: (0.5 * vertical_fov_rad).tan(),
        }
    }

    /// `world` in camera axes: x right, y up, z forward.
    pub(super) fn to_camera(self, world: DVec3) -> DVec3 {
        let v = world - self.eye;
        DVec3::new(v.dot(self.right), v.dot(self.up), v.dot(self.forward))
    }

    /// The direction `(x, y, 1)` in camera axes, in world axes.
    ///
    /// Its length is chosen such that a multiple `t` of it reaches depth `t`.
    pub(super) fn ray_to_world(self, ray: DVec3) -> DVec3 {
        self.right * ray.x + self.up * ray.y + self.forward * ray.z
    }
}

/// The grid of samples that a camera is seen through.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewport {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Step between two samples on the plane at depth 1.
    pub(super) step: f64,
}

impl Viewport {
    pub(super) fn new(camera: &Camera, width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            step: 2.0 * camera.tan_half_fov / height as f64,
        }
    }

    /// The ray through sample coordinates `(x, y)`, in camera axes.
    pub(super) fn ray(self, x: f64, y: f64) -> DVec3 {
        DVec3::new(
            (x - 0.5 * self.width as f64) * self.step,
            (0.5 * self.height as f64 - y) * self.step,
            1.0,
        )
    }

    /// Rewrites a linear function of the ray as `[per x, per y, constant]` in
    /// sample coordinates.
    pub(super) fn pull_back(self, f: DVec3) -> DVec3 {
        DVec3::new(f.x * self.step, -f.y * self.step, f.dot(self.ray(0.0, 0.0)))
    }

    /// Where a point in camera axes with positive depth is seen, in samples.
    pub(super) fn project(self, p: DVec3) -> [f64; 2] {
        [
            0.5 * self.width as f64 + p.x / (p.z * self.step),
            0.5 * self.height as f64 - p.y / (p.z * self.step),
        ]
    }
}
