//! Warping backwards: for each place of the result, where in the source it comes from.
//!
//! The source is covered with a fine net of triangles, their corners are mapped forwards,
//! and each triangle that is drawn carries its source coordinates to the places it
//! covers. Compared with solving for the preimage of every place by Newton's method
//! ([`ffd_core::Lattice::inverse_point`]), this
//!
//! * costs one evaluation of the lattice for hundreds of places,
//! * needs no start value and cannot fail, and
//! * is off by at most h² |F″| / 8, which for triangles of h = 2 pixels of the result and
//!   a pull by half a cell is a few hundredths of a pixel.
//!
//! It leaves no holes. The edges of the picture are fixed, so the map has degree one:
//! around any place, triangles that keep their orientation exceed those turned over by
//! one, and at least one of the former covers it. Only these are drawn, so where the map
//! folds the picture looks like a folded sheet that is printed on one side. Where several
//! lie on each other, the one farther down and to the right in the source is on top.

use glam::DVec3;

use crate::ink::{bounds, cross, sub};
use crate::raster::{Image, from_linear, to_linear};

/// Places a side that are looked up for each pixel.
const SAMPLES: usize = 4;
/// Length of a triangle's side at rest, in pixels of the result.
const STEP: f64 = 2.0;

/// Where each place of a result comes from.
pub(super) struct BackwardMap {
    /// Places per row: [`SAMPLES`] for a pixel.
    width: usize,
    /// World coordinates in the source, row by row; NaN where nothing is.
    origins: Vec<[f32; 2]>,
}

impl BackwardMap {
    /// For a picture of `size` pixels on which one pixel is `scale` world units long.
    ///
    /// `forward` must keep the edges of the picture where they are.
    pub(super) fn new(
        forward: impl Fn([f64; 2]) -> [f64; 2],
        size: [usize; 2],
        scale: f64,
    ) -> Self {
        let [width, height] = size.map(|n| n * SAMPLES);
        let mut map = Self {
            width,
            origins: vec![[f32::NAN; 2]; width * height],
        };
        let world = size.map(|n| n as f64 * scale);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "no more than pixels"
        )]
        let steps = size.map(|n| (n as f64 / STEP).ceil() as usize);
        let corner = |i: usize, j: usize| -> Corner {
            let part = [i as f64 / steps[0] as f64, j as f64 / steps[1] as f64];
            let origin = [part[0] * world[0], part[1] * world[1]];
            let image = forward(origin);
            let place = image.map(|c| c / scale * SAMPLES as f64);
            Corner { origin, place }
        };
        let mut above: Vec<Corner> = (0..=steps[0]).map(|i| corner(i, 0)).collect();
        for j in 1..=steps[1] {
            let below: Vec<Corner> = (0..=steps[0]).map(|i| corner(i, j)).collect();
            for i in 0..steps[0] {
                map.draw([above[i], above[i + 1], below[i + 1]]);
                map.draw([above[i], below[i + 1], below[i]]);
            }
            above = below;
        }
        map
    }

    /// Draws a triangle, unless it is turned over.
    fn draw(&mut self, corners: [Corner; 3]) {
        let [a, b, c] = corners.map(|corner| corner.place);
        let area = cross(sub(b, a), sub(c, a));
        if area.is_nan() || area <= 0.0 {
            return;
        }
        let height = self.origins.len() / self.width;
        let [low, high] = bounds([a, b, c]);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates at zero, and the picture ends before"
        )]
        let place = |c: f64| c as usize;
        for y in place((low[1] - 0.5).ceil())..place(high[1] + 0.5).min(height) {
            for x in place((low[0] - 0.5).ceil())..place(high[0] + 0.5).min(self.width) {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let weights = [(b, c), (c, a), (a, b)]
                    .map(|(from, to)| cross(sub(to, from), sub(p, from)) / area);
                // Places on an edge belong to both sides, which agree on them; a little
                // more, as each side rounds for itself.
                if weights.iter().all(|&w| w >= -1e-9) {
                    let origin = [0, 1].map(|axis| {
                        let parts = weights.iter().zip(&corners);
                        parts
                            .map(|(w, corner)| w * corner.origin[axis])
                            .sum::<f64>()
                    });
                    #[expect(clippy::cast_possible_truncation, reason = "exact enough")]
                    let rounded = origin.map(|c| c as f32);
                    self.origins[x + self.width * y] = rounded;
                }
            }
        }
    }

    /// The source as the map shows it.
    pub(super) fn apply(&self, source: &Source) -> Image {
        let width = self.width / SAMPLES;
        let height = self.origins.len() / self.width / SAMPLES;
        let mut image = Image::filled(width, height, [0.0; 3]);
        for (number, pixel) in image.rgb.iter_mut().enumerate() {
            let (x, y) = (number % width * SAMPLES, number / width * SAMPLES);
            let mut light = DVec3::ZERO;
            for row in 0..SAMPLES {
                let first = x + self.width * (y + row);
                for &origin in &self.origins[first..first + SAMPLES] {
                    light += source.at(origin.map(f64::from));
                }
            }
            *pixel = from_linear(light / (SAMPLES * SAMPLES) as f64);
        }
        image
    }
}

#[derive(Clone, Copy)]
struct Corner {
    /// In the world.
    origin: [f64; 2],
    /// In places of the result.
    place: [f64; 2],
}

/// A picture as light, to be looked up between its pixels.
pub(super) struct Source {
    width: usize,
    height: usize,
    light: Vec<DVec3>,
}

impl Source {
    pub(super) fn new(image: &Image) -> Self {
        let light = |pixel: &[u8; 3]| to_linear(pixel.map(|c| f32::from(c) / 255.0));
        Self {
            width: image.width,
            height: image.height,
            light: image.rgb.iter().map(light).collect(),
        }
    }

    /// Linear between the centres of pixels, constant beyond the outermost.
    fn at(&self, world: [f64; 2]) -> DVec3 {
        let axis = |c: f64, count: usize| {
            let c = (c - 0.5).clamp(0.0, (count - 1) as f64);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between the first pixel and the last; NaN counts as the first"
            )]
            let first = (c as usize).min(count.saturating_sub(2));
            (first, c - first as f64)
        };
        let ((x, right), (y, down)) = (axis(world[0], self.width), axis(world[1], self.height));
        let pixel = |i: usize, j: usize| {
            let (i, j) = ((x + i).min(self.width - 1), (y + j).min(self.height - 1));
            self.light[i + self.width * j]
        };
        let upper = pixel(0, 0).lerp(pixel(1, 0), right);
        let lower = pixel(0, 1).lerp(pixel(1, 1), right);
        upper.lerp(lower, down)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::lattice_at_rest;
    use ffd_core::Lattice;

    fn lattice(amplitude: f64) -> (Image, Lattice<2>) {
        let picture = Image::filled(120, 90, [0.5; 3]);
        let mut lattice = lattice_at_rest(&picture, 12).unwrap();
        for i in 0..lattice.grid().control_point_count() {
            let [x, y] = lattice.grid().rest_position(i);
            let by = [(0.2 * y).sin(), (0.3 * x).cos()];
            lattice
                .set_displacement(i, by.map(|c| amplitude * c))
                .unwrap();
        }
        (picture, lattice)
    }

    /// Without folds, origins are the preimages that the inverse finds. Displacements of
    /// control points differ by 6 at most, so second derivatives are at most 4 · 6 / 10²
    /// along an axis, in cells of 10; a triangle's sides are one unit long, so an image is
    /// off by 0.24 · 2 / 8 at most, and an origin by not much more.
    #[test]
    fn origins_are_preimages() {
        let (_, lattice) = lattice(3.0);
        let map = BackwardMap::new(|x| lattice.deform_point(x), [240, 180], 0.5);
        for (number, origin) in map.origins.iter().enumerate().step_by(371) {
            let place = [number % map.width, number / map.width];
            let world = place.map(|n| (n as f64 + 0.5) * 0.5 / SAMPLES as f64);
            let expected = lattice.inverse_point(world).unwrap().point().unwrap();
            for axis in 0..2 {
                let error = (f64::from(origin[axis]) - expected[axis]).abs();
                assert!(error < 0.1, "{origin:?} for {expected:?}");
            }
        }
    }

    /// There are no holes, even where the picture is crumpled.
    #[test]
    fn every_place_has_an_origin() {
        for amplitude in [0.0, 3.0, 30.0, 300.0] {
            let (_, lattice) = lattice(amplitude);
            let map = BackwardMap::new(|x| lattice.deform_point(x), [60, 45], 2.0);
            assert!(
                map.origins.iter().flatten().all(|c| c.is_finite()),
                "{amplitude}"
            );
        }
    }

    #[test]
    fn a_lattice_at_rest_shows_the_source() {
        let mut picture = Image::filled(21, 14, [0.0; 3]);
        for (pixel, i) in picture.rgb.iter_mut().zip(0_u16..) {
            let (x, y) = (i % 21, i / 21);
            *pixel = [50 + 9 * x, 60 + 12 * y, 230 - 5 * (x + y)].map(|c| c.to_le_bytes()[0]);
        }
        let lattice = lattice_at_rest(&picture, 7).unwrap();
        let source = Source::new(&picture);
        // At nine times the size, a pixel in the middle of nine is mostly the one it was.
        let shown =
            BackwardMap::new(|x| lattice.deform_point(x), [189, 126], 1.0 / 9.0).apply(&source);
        for y in 0..14 {
            for x in 0..21 {
                let [a, b] = [
                    picture.rgb[x + 21 * y],
                    shown.rgb[9 * x + 4 + 189 * (9 * y + 4)],
                ];
                assert!(
                    a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1),
                    "{a:?} {b:?}"
                );
            }
        }
    }
}
