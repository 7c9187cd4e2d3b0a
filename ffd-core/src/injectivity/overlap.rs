//! Two places with the same image.
//!
//! One place, p, is given exactly. From near another one, Newton's method finds a q with
//! G(q) ≈ G(p), approximately. That there is an exact one is shown by Krawczyk's test
//! (R. Krawczyk, *Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken*,
//! Computing 4, 1969): with a fixed matrix C, the map `t ↦ t − C (G(t) − G(p))` takes the
//! box `|t − t₀| ≤ r`, which lies in the interior of a cell, into the points at most
//!
//! ```text
//! |C (G(t₀) − G(p))| + |I − C J| r
//! ```
//!
//! away from t₀, with the largest entries of |I − C J| over the box. Where that is less than
//! r along every axis, there is one fixed point in the box and no other; and C is regular, as
//! I − C J is a contraction, so that the fixed point has the image of p.

use super::boxes::{Boxes, is_contraction};
use super::partials::UNIT;
use super::positions::Positions;
use crate::frame::unit_entry;
use crate::matrix::{Matrix, multiply, solve};

/// A place: a cell and the position in it.
pub(super) type CellPlace<const D: usize> = ([usize; D], [f64; D]);

/// The place with the image of another one is within `radius` of `other`, and `point` is
/// not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Overlap<const D: usize> {
    pub(super) point: CellPlace<D>,
    pub(super) other: CellPlace<D>,
    pub(super) radius: f64,
}

/// Newton's method takes no more steps.
const STEPS: usize = 12;

/// Positions of q are multiples of this, so that the ends of a box are exact numbers.
const GRAIN: f64 = 1.0 / (1_u64 << 44) as f64;

/// Half sizes of boxes that are tried.
const RADII: [f64; 4] = [
    1.0 / (1 << 28) as f64,
    1.0 / (1 << 22) as f64,
    1.0 / (1 << 16) as f64,
    1.0 / (1 << 10) as f64,
];

/// Looks for a place inside the domain with the image of `point` and proves that there is
/// one. `point` and `start`, where the search begins, are in lattice coordinates.
pub(super) fn prove<const D: usize>(
    positions: &mut Positions<'_, D>,
    point: [f64; D],
    start: [f64; D],
) -> Option<Overlap<D>> {
    let point = positions.locate(point);
    let (image, _) = positions.evaluate(point.0, point.1);
    let (cell, t) = newton(positions, image, start)?;
    let t = t.map(|t| (t / GRAIN).round() * GRAIN);
    let inside = t.iter().fold(0.5_f64, |m, &t| m.min(t).min(1.0 - t));
    let distance = (0..D).fold(0.0_f64, |m, a| {
        let cells = point.0[a] as f64 - cell[a] as f64;
        m.max((cells + (point.1[a] - t[a])).abs())
    });
    RADII
        .iter()
        // Twice the radius covers the roundings of the distance, which is small then.
        .filter(|&&radius| radius < inside && distance > 2.0 * radius)
        .find(|&&radius| has_root(positions, point, (cell, t), radius))
        .map(|&radius| Overlap {
            point,
            other: (cell, t),
            radius,
        })
}

/// A place in the interior of the domain with the given image, approximately.
fn newton<const D: usize>(
    positions: &Positions<'_, D>,
    image: [f64; D],
    start: [f64; D],
) -> Option<CellPlace<D>> {
    let mut u = start;
    for _ in 0..STEPS {
        let (cell, t) = positions.locate(u);
        let (here, jacobian) = positions.evaluate(cell, t);
        let step = solve(&jacobian, std::array::from_fn(|c| here[c] - image[c]));
        let mut moved = 0.0_f64;
        for a in 0..D {
            let next = (u[a] - step[a]).clamp(0.0, positions.cells[a] as f64);
            if next.is_nan() {
                return None;
            }
            moved = moved.max((next - u[a]).abs());
            u[a] = next;
        }
        if moved < 1e-11 {
            return Some(positions.locate(u));
        }
    }
    None
}

/// Whether there is exactly one place with the image of `point` within `radius` of another
/// one, which is at least as far from the border of its cell.
fn has_root<const D: usize>(
    positions: &mut Positions<'_, D>,
    point: CellPlace<D>,
    (cell, t): CellPlace<D>,
    radius: f64,
) -> bool {
    let mut images = Vec::with_capacity(2);
    for (cell, t) in [point, (cell, t)] {
        positions.bezier(cell, &t.map(|t| [t, t]), &mut images);
    }
    let (_, jacobian) = positions.evaluate(cell, t);
    // Column by column.
    let columns: Matrix<D> =
        std::array::from_fn(|c| solve(&jacobian, std::array::from_fn(|r| unit_entry(r, c))));
    let after: Matrix<D> = std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]));
    if !after.iter().flatten().all(|x| x.abs() < 1e100) {
        return false;
    }
    let residual = std::array::from_fn(|c| images[1][c] - images[0][c]);
    let newton = multiply(&after, residual);
    let part = t.map(|t| [t - radius, t + radius]);
    let mut boxes = Boxes::default();
    let Some(deviation) = boxes.deviation_in_cell(positions, cell, &part, &after) else {
        return false;
    };
    let error = 2.0 * positions.error + 4.0 * UNIT * positions.largest;
    is_contraction(&deviation, D)
        && (0..D).all(|r| {
            let row: f64 = after[r].iter().map(|x| x.abs()).sum();
            // The product with C is rounded too.
            let size: f64 = (0..D).map(|c| (after[r][c] * residual[c]).abs()).sum();
            let shift = newton[r].abs() + 1.01 * row * error + 8.0 * UNIT * size;
            let spread: f64 = deviation[r].iter().sum();
            shift + spread * radius < 0.99 * radius
        })
}

#[cfg(test)]
mod tests {
    use super::super::samples::{check_overlap, clamped, grid, mapped, noisy, wound};
    use super::*;
    use crate::*;

    #[test]
    fn evidence_can_be_checked_again() {
        for (turns, pitch) in [(1.05, 0.0), (1.3, 0.2), (1.7, 1.0)] {
            let flat = mapped(grid([3; 2], [24, 2]), wound(24.0, 2.0, turns, pitch));
            check_overlap(&flat, &flat.check(&CheckOptions::default()));
            let solid = clamped([2, 3, 3], [24, 1, 2]);
            let solid = mapped(solid, wound(24.0, 1.0, turns, pitch));
            check_overlap(&solid, &solid.check(&CheckOptions::default()));
        }
    }

    /// From anywhere, nothing but the point itself has its image.
    #[test]
    fn a_map_that_is_one_to_one_has_no_overlap() {
        let lattice = noisy(grid([3; 3], [2; 3]), 0.3, 5);
        assert!(lattice.check(&CheckOptions::default()).is_injective());
        let mut positions = Positions::new(&lattice).unwrap();
        for number in 0..64 {
            let start: [f64; 3] = std::array::from_fn(|a| f64::from(number >> (2 * a) & 3) / 1.5);
            assert_eq!(prove(&mut positions, [0.0, 0.75, 1.25], start), None);
            assert_eq!(prove(&mut positions, [0.5, 0.75, 1.25], start), None);
        }
    }
}
