//! Smooth shapes, drawn by how much of each pixel they cover.

use crate::raster::{Image, to_bytes};

/// The part of each pixel that is covered by shapes. Shapes that overlap count once, so
/// that they can be painted together in one translucent colour.
#[derive(Debug, Clone)]
pub struct Ink {
    width: usize,
    height: usize,
    coverage: Vec<f32>,
}

impl Ink {
    /// Nothing, for a picture.
    #[must_use]
    pub fn for_image(image: &Image) -> Self {
        Self {
            width: image.width,
            height: image.height,
            coverage: vec![0.0; image.rgb.len()],
        }
    }

    /// A shape that lies within `reach` of a box, given by the signed distance from it.
    fn add(
        &mut self,
        corners: [[f64; 2]; 2],
        reach: f64,
        distance: impl Fn([f64; 2]) -> f64,
    ) -> &mut Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates at zero, and the picture ends before"
        )]
        let pixel = |c: f64| c as usize;
        let [low, high] = corners;
        let reach = reach + 1.0;
        let columns = pixel(low[0] - reach)..pixel(high[0] + reach + 1.0).min(self.width);
        for y in pixel(low[1] - reach)..pixel(high[1] + reach + 1.0).min(self.height) {
            for x in columns.clone() {
                let d = distance([x as f64 + 0.5, y as f64 + 0.5]);
                #[expect(clippy::cast_possible_truncation, reason = "between 0 and 1")]
                let part = (0.5 - d).clamp(0.0, 1.0) as f32;
                let pixel = &mut self.coverage[x + self.width * y];
                *pixel = pixel.max(part);
            }
        }
        self
    }

    /// A filled circle.
    pub fn disc(&mut self, centre: [f64; 2], radius: f64) -> &mut Self {
        self.add([centre; 2], radius, |p| length(sub(p, centre)) - radius)
    }

    /// A circle of some width.
    pub fn ring(&mut self, centre: [f64; 2], radius: f64, width: f64) -> &mut Self {
        self.add([centre; 2], radius + width, |p| {
            (length(sub(p, centre)) - radius).abs() - width / 2.0
        })
    }

    /// A line with round ends.
    pub fn line(&mut self, [a, b]: [[f64; 2]; 2], width: f64) -> &mut Self {
        let along = sub(b, a);
        let squared = dot(along, along);
        self.add(bounds([a, b]), width / 2.0, |p| {
            let t = if squared > 0.0 {
                (dot(sub(p, a), along) / squared).clamp(0.0, 1.0)
            } else {
                0.0
            };
            length([p[0] - a[0] - t * along[0], p[1] - a[1] - t * along[1]]) - width / 2.0
        })
    }

    /// Lines from point to point.
    pub fn polyline(&mut self, points: &[[f64; 2]], width: f64) -> &mut Self {
        for ends in points.windows(2) {
            self.line([ends[0], ends[1]], width);
        }
        self
    }

    /// A box with round corners, which lie within `low` and `high`.
    pub fn rounded(&mut self, low: [f64; 2], high: [f64; 2], radius: f64) -> &mut Self {
        self.add([low, high], 0.0, |p| {
            let beyond = [0, 1].map(|c| {
                let middle = f64::midpoint(low[c], high[c]);
                (p[c] - middle).abs() - (high[c] - low[c]) / 2.0 + radius
            });
            let outside = length(beyond.map(|d| d.max(0.0)));
            outside + f64::max(beyond[0], beyond[1]).min(0.0) - radius
        })
    }

    /// A triangle, whose corners may come in any order, grown by `margin`.
    pub fn triangle(&mut self, corners: [[f64; 2]; 3], margin: f64) -> &mut Self {
        let [a, b, c] = corners;
        let turn = cross(sub(b, a), sub(c, a)).signum();
        self.add(bounds(corners), margin, |p| {
            let edges = [(a, b), (b, c), (c, a)].map(|(from, to)| {
                let edge = sub(to, from);
                -turn * cross(edge, sub(p, from)) / length(edge).max(f64::MIN_POSITIVE)
            });
            edges.into_iter().fold(f64::NEG_INFINITY, f64::max) - margin
        })
    }

    /// Paints all shapes in one colour; `opacity` is from 0 to 1.
    pub fn paint(&self, image: &mut Image, colour: [f32; 3], opacity: f32) {
        for (pixel, &part) in image.rgb.iter_mut().zip(&self.coverage) {
            if part > 0.0 {
                let over = part * opacity;
                let mut mixed = [0.0; 3];
                for ((mixed, &below), colour) in mixed.iter_mut().zip(&*pixel).zip(colour) {
                    *mixed = over * colour + (1.0 - over) * f32::from(below) / 255.0;
                }
                *pixel = to_bytes(mixed);
            }
        }
    }
}

/// An sRGB colour as it is written on the web.
#[must_use]
pub const fn rgb(hex: u32) -> [f32; 3] {
    let [_, r, g, b] = hex.to_be_bytes();
    [r as f32 / 255.0, g as f32 / 255.0, b as f32 / 255.0]
}

/// The vector from `b` to `a`.
#[must_use]
pub fn sub(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Twice the area of the triangle 0, a, b; negative if it turns the other way.
#[must_use]
pub fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The length of a vector.
#[must_use]
pub fn length(a: [f64; 2]) -> f64 {
    a[0].hypot(a[1])
}

/// The lowest and highest coordinates.
#[must_use]
pub fn bounds<const N: usize>(points: [[f64; 2]; N]) -> [[f64; 2]; 2] {
    let ends = [f64::min as fn(f64, f64) -> f64, f64::max];
    ends.map(|end| [0, 1].map(|c| points.iter().map(|p| p[c]).fold(points[0][c], end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The area of shapes, in pixels.
    fn area(draw: impl Fn(&mut Ink)) -> f64 {
        let image = Image::filled(64, 64, [0.0; 3]);
        let mut ink = Ink::for_image(&image);
        draw(&mut ink);
        ink.coverage.iter().map(|&c| f64::from(c)).sum()
    }

    #[test]
    fn shapes_cover_their_area() {
        let near = |found: f64, expected: f64| {
            assert!(
                (found / expected - 1.0).abs() < 0.01,
                "{found} for {expected}"
            );
        };
        let pi = std::f64::consts::PI;
        near(area(|ink| _ = ink.disc([31.3, 30.8], 20.0)), 400.0 * pi);
        near(
            area(|ink| _ = ink.ring([31.3, 30.8], 20.0, 4.0)),
            160.0 * pi,
        );
        let line = [[10.2, 10.7], [40.1, 50.9]];
        let expected = 6.0 * length(sub(line[1], line[0])) + 9.0 * pi;
        near(area(|ink| _ = ink.line(line, 6.0)), expected);
        // Twice the same counts once, and what lies outside does not.
        near(
            area(|ink| _ = ink.line(line, 6.0).line(line, 6.0)),
            expected,
        );
        near(area(|ink| _ = ink.disc([64.0, 64.0], 20.0)), 100.0 * pi);
        near(
            area(|ink| _ = ink.rounded([10.0, 12.0], [40.0, 52.0], 5.0)),
            30.0 * 40.0 - 25.0 * (4.0 - pi),
        );
        let corners = [[10.0, 10.0], [10.0, 50.0], [50.0, 10.0]];
        near(area(|ink| _ = ink.triangle(corners, 0.0)), 800.0);
    }
}
