//! Where objects are so close to the floor that they hide the sky from it.
//!
//! The underside of the scene is drawn as a coarse height field, its closeness
//! to the floor is blurred, and the result is looked up between grid points.

use super::scan::Facet;
use super::tessellate::Triangle;
use glam::{DVec2, DVec3};

/// Grid points along each side, and those kept empty along the border.
const SIZE: usize = 160;
const MARGIN: usize = 24;

/// Half the width of the blur, applied three times to come close to a Gaussian.
const BLUR: usize = 4;
const PASSES: usize = 3;

/// Height above the floor from which an object no longer darkens it, relative
/// to the longer side of the scene.
const FADE_HEIGHT: f64 = 0.2;

/// Darkening of the floor by what is close above it.
#[derive(Debug)]
pub(super) struct ContactMap {
    low: DVec2,
    cell: f64,
    /// Between 0 (open sky) and 1.
    closeness: Vec<f64>,
}

impl ContactMap {
    /// The map for a floor at height `ground_y` under a scene whose `x` and `z`
    /// lie in `footprint`.
    pub(super) fn new(triangles: &[Triangle], ground_y: f64, footprint: [DVec2; 2]) -> Self {
        let side = (footprint[1] - footprint[0]).max_element();
        let cell = side / (SIZE - 2 * MARGIN) as f64;
        let low = footprint[0] - MARGIN as f64 * cell;
        let mut closeness = vec![0.0_f64; SIZE * SIZE];
        for triangle in triangles {
            let corners = triangle.corners.map(|p| {
                let at = (DVec2::new(p.x, p.z) - low) / cell;
                let height = (p.y - ground_y) / (FADE_HEIGHT * side);
                DVec3::new(at.x, at.y, 1.0 - height)
            });
            if let Some(facet) = Facet::parallel(corners, SIZE, SIZE) {
                facet.scan(&(0..SIZE), |x, y, close| {
                    let value = &mut closeness[x + SIZE * y];
                    *value = value.max(close.min(1.0));
                });
            }
        }
        for _ in 0..PASSES {
            closeness = blurred_and_turned(&blurred_and_turned(&closeness));
        }
        Self {
            low,
            cell,
            closeness,
        }
    }

    /// Closeness above floor position `(x, z)`.
    pub(super) fn closeness(&self, at: DVec2) -> f64 {
        let position = (at - self.low) / self.cell - 0.5;
        let last = DVec2::splat((SIZE - 1) as f64);
        if !(position.cmpge(DVec2::ZERO).all() && position.cmplt(last).all()) {
            return 0.0;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "inside the grid"
        )]
        let i = position.x as usize + SIZE * position.y as usize;
        let f = position.fract();
        let row = |i: usize| self.closeness[i] * (1.0 - f.x) + self.closeness[i + 1] * f.x;
        row(i) * (1.0 - f.y) + row(i + SIZE) * f.y
    }
}

/// A running mean along the rows, written to columns: twice is once per axis.
fn blurred_and_turned(map: &[f64]) -> Vec<f64> {
    let mut turned = vec![0.0; map.len()];
    for (y, row) in map.chunks_exact(SIZE).enumerate() {
        for x in 0..SIZE {
            let window = &row[x.saturating_sub(BLUR)..(x + BLUR + 1).min(SIZE)];
            turned[y + SIZE * x] = window.iter().sum::<f64>() / (2 * BLUR + 1) as f64;
        }
    }
    turned
}
