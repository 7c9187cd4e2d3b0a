//! Drawings of lattices in the plane.

use examples::{
    ink::{Ink, length, sub},
    raster::Image,
};
use ffd_core::{Constraint, Grid, Lattice};

use crate::look::{BLUE, RED, SLATE};

const WHITE: [f32; 3] = [1.0; 3];
/// Straight pieces of the border of a cell, and of a circle.
const PIECES: u32 = 24;
const AROUND: u32 = 400;
/// Rows of samples in a row of pixels.
const SUBROWS: usize = 4;

/// A picture of a rectangle of the plane, y up.
#[derive(Debug, Clone)]
pub(crate) struct Drawing {
    pub(crate) image: Image,
    /// The world point at the upper left corner, and pixels for a unit of length.
    corner: [f64; 2],
    scale: f64,
}

impl Drawing {
    /// An empty one of some width in pixels.
    pub(crate) fn new(low: [f64; 2], high: [f64; 2], width: usize) -> Self {
        let size = sub(high, low);
        let scale = width as f64 / size[0];
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "about as large as the width"
        )]
        let height = (scale * size[1]).round() as usize;
        Self {
            image: Image::filled(width, height, WHITE),
            corner: [low[0], high[1]],
            scale,
        }
    }

    fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            (x - self.corner[0]) * self.scale,
            (self.corner[1] - y) * self.scale,
        ]
    }

    fn paint(&mut self, colour: [f32; 3], opacity: f32, draw: impl FnOnce(&Self, &mut Ink)) {
        let mut ink = Ink::for_image(&self.image);
        draw(self, &mut ink);
        ink.paint(&mut self.image, colour, opacity);
    }

    /// Control points, and lines between neighbours.
    pub(crate) fn control_points(&mut self, lattice: &Lattice<2>) {
        let grid = lattice.grid();
        let place = |i: usize| {
            let (rest, by) = (grid.rest_position(i), lattice.displacements()[i]);
            [rest[0] + by[0], rest[1] + by[1]]
        };
        self.paint(SLATE, 0.55, |drawing, ink| {
            for (i, j) in neighbours(grid) {
                ink.line([i, j].map(|i| drawing.pixel(place(i))), 1.2);
            }
        });
        self.paint(SLATE, 1.0, |drawing, ink| {
            for i in 0..grid.control_point_count() {
                ink.disc(drawing.pixel(place(i)), 3.4);
            }
        });
    }

    /// The borders of the cells as the lattice deforms them.
    pub(crate) fn cells(&mut self, lattice: &Lattice<2>, opacity: f32) {
        self.paint(RED, opacity, |drawing, ink| {
            for line in cell_borders(lattice.grid()) {
                let image = line.iter().map(|&p| drawing.pixel(lattice.deform_point(p)));
                ink.polyline(&image.collect::<Vec<_>>(), 1.8);
            }
        });
    }

    /// Outlines of some cells of the domain at rest.
    pub(crate) fn outlines(&mut self, grid: &Grid<2>, cells: &[[usize; 2]], colour: [f32; 3]) {
        let domain = grid.domain();
        self.paint(colour, 1.0, |drawing, ink| {
            for cell in cells {
                let corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]].map(|corner| {
                    let u = [0, 1].map(|c| domain[c][0] + (cell[c] + corner[c]) as f64);
                    drawing.pixel(grid.frame().to_world(u))
                });
                ink.polyline(&corners, 1.8);
            }
        });
    }

    /// A closed curve and what it goes round: darker where it does so more than once.
    pub(crate) fn blob(&mut self, curve: &[[f64; 2]]) {
        let curve: Vec<_> = curve.iter().map(|&p| self.pixel(p)).collect();
        fill(&mut self.image, &curve);
        self.paint(BLUE, 1.0, |_, ink| _ = ink.polyline(&curve, 3.0));
    }

    /// Arrows from points to where they are to go.
    pub(crate) fn constraints(&mut self, constraints: &[Constraint<2>]) {
        for (halo, colour) in [(1.6, WHITE), (0.0, RED)] {
            self.paint(colour, 1.0, |drawing, ink| {
                for constraint in constraints {
                    let [from, by] = [constraint.point, constraint.displacement];
                    let (at, tip) = (
                        drawing.pixel(from),
                        drawing.pixel([from[0] + by[0], from[1] + by[1]]),
                    );
                    arrow(ink, at, tip, halo);
                }
            });
        }
    }

    /// Where points have arrived.
    pub(crate) fn targets(&mut self, constraints: &[Constraint<2>]) {
        for (radius, colour) in [(6.0, WHITE), (4.4, RED)] {
            self.paint(colour, 1.0, |drawing, ink| {
                for Constraint {
                    point: p,
                    displacement: d,
                    ..
                } in constraints
                {
                    ink.disc(drawing.pixel([p[0] + d[0], p[1] + d[1]]), radius);
                }
            });
        }
    }

    /// Colours every pixel by the place it shows.
    pub(crate) fn colour(&mut self, colour: impl Fn([f64; 2]) -> [f32; 3]) {
        let (width, height) = (self.image.width, self.image.height);
        for y in 0..height {
            for x in 0..width {
                let at = [
                    self.corner[0] + (x as f64 + 0.5) / self.scale,
                    self.corner[1] - (y as f64 + 0.5) / self.scale,
                ];
                let dot = Image::filled(1, 1, colour(at));
                self.image.rgb[x + width * y] = dot.rgb[0];
            }
        }
    }
}

/// A circle, closed.
pub(crate) fn circle(centre: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    let point = |i: u32| {
        let (sin, cos) =
            (std::f64::consts::TAU * f64::from(i % AROUND) / f64::from(AROUND)).sin_cos();
        [centre[0] + radius * cos, centre[1] + radius * sin]
    };
    (0..=AROUND).map(point).collect()
}

/// The image of a curve.
pub(crate) fn image_of(curve: &[[f64; 2]], lattice: &Lattice<2>) -> Vec<[f64; 2]> {
    curve.iter().map(|&p| lattice.deform_point(p)).collect()
}

fn neighbours(grid: &Grid<2>) -> Vec<(usize, usize)> {
    let [nx, ny] = grid.control_points_per_axis();
    let mut pairs = Vec::new();
    for j in 0..ny {
        for i in 0..nx {
            let here = grid.control_point([i, j]);
            if i + 1 < nx {
                pairs.push((here, grid.control_point([i + 1, j])));
            }
            if j + 1 < ny {
                pairs.push((here, grid.control_point([i, j + 1])));
            }
        }
    }
    pairs
}

/// The borders of the lattice's own cells at rest, as polylines.
fn cell_borders(grid: &Grid<2>) -> Vec<Vec<[f64; 2]>> {
    let cells = grid.cells();
    let mut lines = Vec::new();
    for along in 0..2 {
        let across = 1 - along;
        for line in 0..=cells[across] {
            let pieces = PIECES as usize * cells[along];
            let points = (0..=pieces).map(|piece| {
                let mut u = [0.0; 2];
                u[across] = line as f64;
                u[along] = piece as f64 / f64::from(PIECES);
                grid.frame().to_world(u)
            });
            lines.push(points.collect());
        }
    }
    lines
}

fn arrow(ink: &mut Ink, at: [f64; 2], tip: [f64; 2], halo: f64) {
    let way = sub(tip, at);
    let long = length(way);
    ink.disc(at, 4.4 + halo);
    if long == 0.0 {
        return;
    }
    let ahead = way.map(|c| c / long);
    // A short arrow has a small head.
    let head = f64::min(13.0, 0.75 * long);
    let neck = sub(tip, ahead.map(|c| c * head));
    let wing = |side: f64| {
        let aside = [-ahead[1], ahead[0]];
        [0, 1].map(|c| neck[c] + side * 0.45 * head * aside[c])
    };
    ink.line([at, neck], 3.0 + 2.0 * halo);
    ink.triangle([tip, wing(1.0), wing(-1.0)], halo);
}

/// Paints what a closed curve goes round, once for each time it does.
fn fill(image: &mut Image, curve: &[[f64; 2]]) {
    let width = image.width;
    for y in 0..image.height {
        let mut turns = vec![0.0; width];
        for subrow in 0..SUBROWS {
            let level = y as f64 + (subrow as f64 + 0.5) / SUBROWS as f64;
            let mut crossings: Vec<_> = curve
                .windows(2)
                .filter(|ends| (ends[0][1] <= level) != (ends[1][1] <= level))
                .map(|ends| {
                    let part = (level - ends[0][1]) / (ends[1][1] - ends[0][1]);
                    let x = ends[0][0] + part * (ends[1][0] - ends[0][0]);
                    (x, if ends[0][1] <= level { 1.0 } else { -1.0 })
                })
                .collect();
            crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut winding: f64 = 0.0;
            for pair in crossings.windows(2) {
                winding += pair[0].1;
                add_span(
                    &mut turns,
                    [pair[0].0, pair[1].0],
                    winding.abs() / SUBROWS as f64,
                );
            }
        }
        for (x, &turns) in turns.iter().enumerate() {
            if turns > 0.0 {
                #[expect(clippy::cast_possible_truncation, reason = "between 0 and 1")]
                let clear = 0.78_f64.powf(turns) as f32;
                let pixel = &mut image.rgb[x + width * y];
                let below = pixel.map(|c| f32::from(c) / 255.0);
                let mixed = [0, 1, 2].map(|c| clear * below[c] + (1.0 - clear) * BLUE[c]);
                *pixel = Image::filled(1, 1, mixed).rgb[0];
            }
        }
    }
}

/// Adds an amount to the pixels of a row, by how much of each the span covers.
fn add_span(row: &mut [f64], [from, to]: [f64; 2], amount: f64) {
    let width = row.len() as f64;
    let (from, to) = (from.clamp(0.0, width), to.clamp(0.0, width));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the row"
    )]
    let (first, end) = (from as usize, to.ceil() as usize);
    for (x, part) in row.iter_mut().enumerate().take(end).skip(first) {
        let covered = f64::min(to, x as f64 + 1.0) - f64::max(from, x as f64);
        *part += amount * covered.max(0.0);
    }
}
