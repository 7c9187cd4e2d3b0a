//! Strips wound round to more than a ring.
//!
//! In lattice coordinates control point (i, j) of a strip lies at `(r − vⱼ) p(i)`, with p(i)
//! on the unit circle at the angle 2π i / P. The map is `F(u, v) = (r − v) C(u)`, with the
//! periodic spline C, and `det J = (r − v) C × C′`. C is a mean of n + 1 neighbouring points
//! p, C′ one of the n edges between them, and
//!
//! ```text
//! p(i) × (p(j + 1) − p(j)) = 2 sin(π/P) cos(2π (j − i + ½)/P).
//! ```
//!
//! Since `|j − i + ½| ≤ n − ½`, all of these are positive if P > 4 n − 2: then `det J > 0`,
//! and F(u + P, v) = F(u, v).

use super::field::{in_cells, rest};
use super::grids::{GridOptions, Shape, int};
use super::numbers::{Layout, Made};
use crate::{Knots, Lattice};
use proptest::strategy::Strategy;
use std::f64::consts::{PI, TAU};

/// How many units of the last binary digit of a control point are one.
const UNIT: f64 = 4096.0;

/// Fewest cells once round along an axis of degree n.
fn fewest(n: usize) -> usize {
    (4 * n).max(8)
}

/// Lattices with `det J > 0` everywhere that are not one-to-one all the same: a strip is
/// wound round and lies on itself for one to four cells, where points that are once round
/// apart have exactly the same image.
///
/// The strip is one cell wide (and one thick); along it there are as many cells as it takes,
/// uniform knots, and the border is free, whatever the options say. Control points are off
/// the ring by a little, the same in each turn.
///
/// They shrink to a round strip of degree and length as low as allowed, in the unit frame.
pub fn overlapping<const D: usize>(
    options: GridOptions,
) -> impl Strategy<Value = Lattice<D>> + Clone + Send + Sync {
    let are_sound = options.check();
    let options = GridOptions {
        cells: [1, 1],
        ..options.with_free_border()
    };
    let layout = are_sound.map(|()| {
        let mut layout = Layout::default();
        options.push::<D>(&mut layout);
        // The axis along the strip; cells round, and more.
        layout.push(0..=int(D - 1));
        layout.push(0..=8);
        layout.push(0..=3);
        let mut points = [1 + options.degrees[1]; D];
        points[0] = fewest(options.degrees[1]) + 8;
        layout.push_field(points, 64);
        layout
    });
    Made::new("overlapping lattice", layout, move |mut reader| {
        let mut shape = Shape::<D>::read(&options, &mut reader);
        let along = reader.next_index();
        let across = (along + 1) % D;
        let n = shape.degrees[along];
        let round = fewest(n) + reader.next_index();
        shape.cells[along] = round + 1 + reader.next_index();
        shape.knots[along] = Knots::Uniform;
        let numbers = reader.rest();
        let grid = shape.grid()?;

        // Edges along the strip are about as long as cells.
        let radius = round as f64 / TAU + 1.0;
        let steepest = (n as f64 - 0.5) * TAU / round as f64;
        // Not more than det J. Moving control points by a part of it changes det J by less
        // than 64 times as much, even along clamped axes. Rounding moves them by 1/8192.
        let margin = 2.0 * (PI / round as f64).sin() * steepest.cos();
        let noise = margin / 128.0;
        let points_along = fewest(options.degrees[1]) + 8;
        let point = |i: usize| -> [f64; D] {
            let mut indices = grid.control_point_indices(i);
            let mut place = rest(&grid, i);
            // The same numbers in every turn, to the last digit.
            indices[along] %= round;
            let (sin, cos) = (TAU * indices[along] as f64 / round as f64).sin_cos();
            // The second axis points inwards: otherwise the ring would be a mirror image.
            let inwards = radius - place[across];
            place[along] = inwards * cos;
            place[across] = inwards * sin;
            let mut number = 0;
            for axis in (0..D).rev().filter(|&axis| axis != along) {
                number = number * (1 + options.degrees[1]) + indices[axis];
            }
            number = number * points_along + indices[along];
            std::array::from_fn(|c| {
                let off = noise * f64::from(numbers[D * number + c]) / 64.0;
                short(place[c] + off)
            })
        };
        let points: Vec<[f64; D]> = (0..grid.control_point_count()).map(point).collect();
        let rests: Vec<[f64; D]> = (0..points.len()).map(|i| rest(&grid, i)).collect();
        // Where rests are thirds or fifths, the map is off by their rounding, in each turn.
        in_cells(grid, |i| {
            std::array::from_fn(|c| points[i][c] - short(rests[i][c]))
        })
    })
}

/// The nearest of the short numbers, differences of which are not rounded, nor are their
/// products with the components of axes.
fn short(x: f64) -> f64 {
    (x * UNIT).round() / UNIT
}
