//! The floor: the backdrop's colour, a grid that fades away, and shadows.

use super::camera::Camera;
use super::contact::ContactMap;
use super::shadow::ShadowMap;
use super::tessellate::Triangle;
use glam::{DVec2, DVec3};

/// What is left of the floor's light in full shadow: bluish, as from the sky.
const SHADED: DVec3 = DVec3::new(0.56, 0.59, 0.64);

/// What is left right under an object, where the sky is hidden as well.
const CONTACT: f64 = 0.55;

/// Half the width of a grid line in pixels, and how much light it takes away.
const HALF_LINE: f64 = 0.5;
const LINE_DEPTH: f64 = 0.16;

/// A floor at one height.
#[derive(Debug)]
pub(super) struct Ground {
    eye: DVec3,
    y: f64,
    /// Middle and half the diameter of the scene's outline on the floor.
    centre: DVec2,
    reach: f64,
    grid: f64,
    contact: ContactMap,
}

impl Ground {
    pub(super) fn new(y: f64, camera: &Camera, triangles: &[Triangle]) -> Self {
        let (low, high) = footprint(triangles);
        let (centre, reach) = (0.5 * (low + high), 0.5 * low.distance(high));
        Self {
            eye: camera.eye,
            y,
            centre,
            reach,
            grid: round_step(reach / 3.0),
            contact: ContactMap::new(triangles, y, [low, high]),
        }
    }

    /// Inverse of the depth at which the ray from the eye meets the floor; zero
    /// or negative if it does not.
    pub(super) fn inverse_depth(&self, ray: DVec3) -> f64 {
        ray.y / (self.y - self.eye.y)
    }

    /// The light from the floor along the first ray; the others are those of
    /// the next pixel in each direction. `backdrop` is what it fades into.
    pub(super) fn light(&self, rays: [DVec3; 3], backdrop: DVec3, shadow: &ShadowMap) -> DVec3 {
        let [point, right, below] = rays.map(|r| self.eye + r / self.inverse_depth(r));
        let flat = |p: DVec3| DVec2::new(p.x, p.z);
        let pixel = (flat(right - point)).abs() + (flat(below - point)).abs();

        let distance = flat(point).distance(self.centre) / self.reach;
        let fade = 1.0 - smoothstep(1.2, 4.0, distance);
        let position = flat(point) / self.grid;
        let from_line = (position - position.round()).abs() * self.grid;
        let cover = (HALF_LINE + 0.5 - from_line / pixel).clamp(DVec2::ZERO, DVec2::ONE);
        // Far away, lines closer than a few pixels would run together.
        let sparse = (self.grid / (6.0 * pixel)).min(DVec2::ONE);
        let line = (cover * sparse).max_element() * LINE_DEPTH * fade;

        let visible = shadow.visible(point, DVec3::Y);
        let contact = 1.0 - (1.0 - CONTACT) * self.contact.closeness(flat(point));
        backdrop * SHADED.lerp(DVec3::ONE, visible) * contact * (1.0 - line)
    }
}

/// The box around the scene seen from above, in x and z; of size 2 if empty.
fn footprint(triangles: &[Triangle]) -> (DVec2, DVec2) {
    let corners = triangles.iter().flat_map(|t| t.corners);
    corners
        .map(|p| (DVec2::new(p.x, p.z), DVec2::new(p.x, p.z)))
        .reduce(|(low, high), (p, _)| (low.min(p), high.max(p)))
        .filter(|(low, high)| low != high)
        .unwrap_or((DVec2::NEG_ONE, DVec2::ONE))
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `length`.
fn round_step(length: f64) -> f64 {
    let decade = 10.0_f64.powf(length.log10().floor());
    [5.0, 2.0]
        .into_iter()
        .map(|factor| factor * decade)
        .find(|&step| step <= length)
        .unwrap_or(decade)
}

fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
