//! The determinant of the Jacobian over a picture, as colours.

use ffd_core::Lattice;

use crate::ink::rgb;
use crate::raster::{Image, to_bytes};

/// Places a side at which the determinant is computed for each pixel.
const SAMPLES: usize = 2;

/// From shrinking to growing; in between nothing changes. Blue and orange are told apart
/// by colour-blind eyes, too, and both ends are dark.
const DIVERGING: [[f32; 3]; 5] = [
    rgb(0x17_40_6D),
    rgb(0x72_A9_D0),
    rgb(0xF5_F2_EB),
    rgb(0xE8_9C_5B),
    rgb(0x8E_2F_0B),
];
/// Stripes where the picture is turned over or squeezed flat: in no other colour.
const FOLDED: [[f32; 3]; 2] = [rgb(0x2B_06_3D), rgb(0xFF_3D_9A)];
/// Width of both stripes together, in pixels.
const STRIPES: usize = 8;

/// The most that colours are told apart: 16 times the area, and a 16th.
const MOST_DOUBLINGS: f64 = 4.0;

/// Between which values the determinant lies, as far as it was computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The least value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
    /// The part of the picture where it is zero or negative: where the map folds.
    pub folded: f64,
}

/// The determinant at points of a regular net.
#[derive(Debug, Clone)]
pub struct DeterminantField {
    width: usize,
    values: Vec<f64>,
    range: Range,
}

impl DeterminantField {
    /// For a picture of `size` pixels on which one pixel is `scale` world units long.
    #[must_use]
    pub fn new(lattice: &Lattice<2>, size: [usize; 2], scale: f64) -> Self {
        let [width, height] = size.map(|n| n * SAMPLES);
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let world = [x, y].map(|n| (n as f64 + 0.5) * scale / SAMPLES as f64);
                values.push(
                    lattice
                        .evaluate(world)
                        .map_or(1.0, |there| there.determinant),
                );
            }
        }
        let folded = values.iter().filter(|&&det| is_folded(det)).count();
        let range = Range {
            min: values.iter().copied().fold(f64::INFINITY, f64::min),
            max: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            folded: folded as f64 / values.len() as f64,
        };
        Self {
            width,
            values,
            range,
        }
    }

    /// Between which values it lies.
    #[must_use]
    pub fn range(&self) -> Range {
        self.range
    }

    /// How many doublings of area, and halvings, the colours have to show.
    #[must_use]
    pub fn doublings(&self) -> f64 {
        let Range { min, max, .. } = self.range;
        let halvings = if min > 0.0 { -min.log2() } else { 0.0 };
        let doublings = if max > 0.0 { max.log2() } else { 0.0 };
        f64::max(halvings, doublings)
            .ceil()
            .clamp(1.0, MOST_DOUBLINGS)
    }

    /// The field in colours.
    #[must_use]
    pub fn to_image(&self) -> Image {
        let doublings = self.doublings();
        let (width, height) = (
            self.width / SAMPLES,
            self.values.len() / self.width / SAMPLES,
        );
        let mut image = Image::filled(width, height, [0.0; 3]);
        for (number, pixel) in image.rgb.iter_mut().enumerate() {
            let (x, y) = (number % width, number / width);
            let mut mean = [0.0; 3];
            for sample in 0..SAMPLES * SAMPLES {
                let (i, j) = (sample % SAMPLES, sample / SAMPLES);
                let det = self.values[SAMPLES * x + i + self.width * (SAMPLES * y + j)];
                let colour = if is_folded(det) {
                    folded_colour(x, y)
                } else {
                    colour(det, doublings)
                };
                for (mean, c) in mean.iter_mut().zip(colour) {
                    *mean += c / 4.0;
                }
            }
            *pixel = to_bytes(mean);
        }
        image
    }
}

/// Not-a-number, from sums that overflow, is nothing good either.
fn is_folded(det: f64) -> bool {
    det.is_nan() || det <= 0.0
}

/// The colour of a positive determinant; equal ratios are equal steps.
pub(super) fn colour(det: f64, doublings: f64) -> [f32; 3] {
    let t = (det.log2() / doublings).clamp(-1.0, 1.0);
    let position = (t + 1.0) * 2.0;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 4"
    )]
    let first = (position as usize).min(3);
    #[expect(clippy::cast_possible_truncation, reason = "between 0 and 1")]
    let part = (position - first as f64) as f32;
    let [from, to] = [DIVERGING[first], DIVERGING[first + 1]];
    [0, 1, 2].map(|c| from[c] + part * (to[c] - from[c]))
}

/// The colour of a pixel where the determinant is not positive.
pub(super) fn folded_colour(x: usize, y: usize) -> [f32; 3] {
    FOLDED[usize::from((x + y) % STRIPES >= STRIPES / 2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::lattice_at_rest;

    #[test]
    fn a_fold_is_found_and_marked() {
        let picture = Image::filled(70, 70, [0.5; 3]);
        let mut lattice = lattice_at_rest(&picture, 7).unwrap();
        let still = DeterminantField::new(&lattice, [70, 70], 1.0);
        let one = Range {
            min: 1.0,
            max: 1.0,
            folded: 0.0,
        };
        assert_eq!(still.range(), one);
        let white = to_bytes(DIVERGING[2]);
        assert!(still.to_image().rgb.iter().all(|&pixel| pixel == white));

        let middle = lattice.grid().control_point([1, 1]);
        lattice.set_displacement(middle, [40.0, 0.0]).unwrap();
        let folded = DeterminantField::new(&lattice, [70, 70], 1.0);
        let range = folded.range();
        assert!(range.min < 0.0 && range.max > 1.0);
        assert!(range.folded > 0.01 && range.folded < 0.5);
        let image = folded.to_image();
        assert!(
            FOLDED
                .iter()
                .all(|&stripe| image.rgb.contains(&to_bytes(stripe)))
        );
    }

    #[test]
    fn colours_diverge_from_one() {
        let entries = [(1.0, 2), (4.0, 4), (1e300, 4), (0.5, 1), (0.0, 0)];
        for (det, entry) in entries {
            assert_eq!(
                to_bytes(colour(det, 2.0)),
                to_bytes(DIVERGING[entry]),
                "{det}"
            );
        }
    }
}
