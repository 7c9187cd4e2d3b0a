//! Soft shadows from a depth picture taken by the light.

use super::scan::Facet;
use super::tessellate::Triangle;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Texels along each side of the map.
const SIZE: usize = 768;

/// Radius of the blur in texels: shadows are a little soft.
const BLUR: f64 = 9.0;

/// Texels kept empty along the border: what is outside the map, or so close to
/// its border that the filter would leave it, is out of reach of all shadows.
const MARGIN: f64 = 2.0 * BLUR + 1.0;

/// Comparisons per point, and how many of them settle a clear case.
const TAPS: usize = 24;
const PROBES: usize = 8;

/// Steepest slope followed when the comparison depth is carried from a point
/// to its neighbours; beyond it, the light only grazes the surface anyway.
const STEEPEST: f64 = 3.0;

/// What parallel light from one direction reaches.
#[derive(Debug)]
pub(super) struct ShadowMap {
    /// Towards the light, and the two axes of the map in units of a texel.
    towards: DVec3,
    axes: [DVec3; 2],
    origin: DVec2,
    texel: f64,
    /// Height along `towards` of the surface nearest to the light.
    height: Vec<f32>,
    /// Where to compare, in texels.
    taps: [DVec2; TAPS],
    bias: f64,
}

impl ShadowMap {
    /// Light from the unit direction `towards`.
    pub(super) fn new(triangles: &[Triangle], towards: DVec3) -> Self {
        let (u, v) = towards.any_orthonormal_pair();
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in triangles.iter().flat_map(|t| t.corners) {
            let p = DVec2::new(p.dot(u), p.dot(v));
            low = low.min(p);
            high = high.max(p);
        }
        let extent = (high - low).max_element().max(f64::MIN_POSITIVE);
        let texel = extent / (SIZE as f64 - 2.0 * MARGIN);
        let axes = [u / texel, v / texel];
        let origin = low / texel - MARGIN;

        let mut height = vec![f32::NEG_INFINITY; SIZE * SIZE];
        for triangle in triangles {
            let corners = triangle.corners.map(|p| {
                let at = DVec2::new(p.dot(axes[0]), p.dot(axes[1])) - origin;
                at.extend(p.dot(towards))
            });
            if let Some(facet) = Facet::parallel(corners, SIZE, SIZE) {
                facet.scan(&(0..SIZE), |x, y, h| {
                    let texel = &mut height[x + SIZE * y];
                    *texel = texel.max(to_f32(h));
                });
            }
        }

        // Vogel's spiral has even density. The probes come first, and are every
        // third point of it, so that they are spread like all.
        let golden = TAU * (1.0 - 5.0_f64.sqrt().recip());
        let taps = std::array::from_fn(|i| {
            let rank = (i * (TAPS / PROBES)) % TAPS + i / PROBES;
            let distance = BLUR * ((rank as f64 + 0.5) / TAPS as f64).sqrt();
            DVec2::from_angle(golden * rank as f64) * distance
        });
        Self {
            towards,
            axes,
            origin,
            texel,
            height,
            taps,
            bias: 2.0 * texel,
        }
    }

    /// The fraction of the light that reaches a point of a surface with unit
    /// `normal`.
    ///
    /// Neighbouring texels are compared with the tangent plane, not with the
    /// height of the point: a slope does not shade itself.
    pub(super) fn visible(&self, point: DVec3, normal: DVec3) -> f64 {
        let facing = normal.dot(self.towards);
        let at = DVec2::new(point.dot(self.axes[0]), point.dot(self.axes[1])) - self.origin;
        let across = DVec2::new(normal.dot(self.axes[0]), normal.dot(self.axes[1]));
        // Both the axes and the map count in texels, hence the square.
        let slope = across * (-self.texel * self.texel / facing.abs().max(1e-3));
        let slope = slope.clamp_length_max(STEEPEST * self.texel);
        let height = point.dot(self.towards) + self.bias;

        let inside = at.cmpge(DVec2::splat(BLUR)).all()
            && at.cmple(DVec2::splat(SIZE as f64 - BLUR - 1.0)).all();
        if !inside {
            return 1.0;
        }
        let lit = |tap: &DVec2| {
            let to = at + *tap;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "inside the map"
            )]
            let texel = to.x as usize + SIZE * to.y as usize;
            usize::from(f64::from(self.height[texel]) <= height + slope.dot(*tap))
        };
        let probed: usize = self.taps[..PROBES].iter().map(lit).sum();
        if probed == 0 || probed == PROBES {
            return probed as f64 / PROBES as f64;
        }
        let rest: usize = self.taps[PROBES..].iter().map(lit).sum();
        (probed + rest) as f64 / TAPS as f64
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "half precision of the map is far below its bias"
)]
fn to_f32(height: f64) -> f32 {
    height as f32
}
