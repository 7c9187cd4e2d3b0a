//! When the determinant first falls to zero at some points: no proof of anything, but it
//! tells how far along the way it is worth looking.

use std::collections::BTreeSet;

use super::along::{Along, first_fall};
use crate::matrix::{Matrix, determinant};
use crate::{Evaluation, Lattice};

/// Rounds of the search for an earlier place, and the smallest step in cells: when the
/// determinant falls to zero is known much better than where.
const ROUNDS: usize = 24;
const SMALLEST_STEP: f64 = 0.01;

/// A point of the domain in lattice coordinates, and when the determinant falls to zero there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guess<const D: usize> {
    pub(super) at: [f64; D],
    pub(super) t: f64,
}

/// The earliest fall at the corners and the middles of the given cells, and at places near
/// the best.
pub(super) fn earliest<const D: usize>(
    from: &Lattice<D>,
    to: &Lattice<D>,
    cells: [usize; D],
    among: &[[usize; D]],
) -> Option<Guess<D>> {
    let mut best: Option<Guess<D>> = None;
    for cell in among {
        improve(from, to, cell.map(|i| i as f64 + 0.5), &mut best);
    }
    // Corners once, by their indices.
    let corners = among.iter().flat_map(|cell| {
        (0..1_usize << D).map(move |corner| std::array::from_fn(|a| cell[a] + (corner >> a & 1)))
    });
    let corners: BTreeSet<[usize; D]> = corners.collect();
    for corner in corners {
        improve(from, to, corner.map(|i| i as f64), &mut best);
    }
    let mut step = 0.25;
    for _ in 0..ROUNDS {
        let Some(start) = best else { break };
        if step < SMALLEST_STEP {
            break;
        }
        for axis in 0..D {
            for direction in [-step, step] {
                let mut at = start.at;
                at[axis] = (at[axis] + direction).clamp(0.0, cells[axis] as f64);
                improve(from, to, at, &mut best);
            }
        }
        if best.is_some_and(|best| best.t < start.t) {
            continue;
        }
        step *= 0.5;
    }
    best
}

fn improve<const D: usize>(
    from: &Lattice<D>,
    to: &Lattice<D>,
    at: [f64; D],
    best: &mut Option<Guess<D>>,
) {
    let grid = from.grid();
    let u = std::array::from_fn(|axis| at[axis] - grid.layers(axis) as f64);
    let world = grid.frame().to_world(u);
    let Some(location) = grid.locate_nearest(world) else {
        return;
    };
    let [start, end] = [from, to].map(|lattice| lattice.evaluate_at(world, &location));
    let mut along = along(&start, &end);
    // Only what comes before the best is of interest.
    let until = best.map_or(1.0, |best| best.t);
    for step in 1..=D {
        for k in (step..=D).rev() {
            along[k] = (1.0 - until) * along[k - 1] + until * along[k];
        }
    }
    if let Some(s) = first_fall::<D>(&along)
        && (best.is_none() || s < 1.0)
    {
        *best = Some(Guess { at, t: s * until });
    }
}

/// The determinant of Jacobians on the way from one to the other.
fn along<const D: usize>(start: &Evaluation<D>, end: &Evaluation<D>) -> Along {
    let mut along = [0.0; 4];
    for choice in 0..1_usize << D {
        let matrix: Matrix<D> = std::array::from_fn(|r| {
            let of = if choice >> r & 1 == 1 { end } else { start };
            of.jacobian[r]
        });
        let k = choice.count_ones() as usize;
        let share = if k == 0 || k == D { 1.0 } else { D as f64 };
        along[k] += determinant(&matrix) / share;
    }
    along
}
