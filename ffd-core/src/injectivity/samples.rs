//! Lattices for tests.

use proptest::prelude::*;

use super::cones::Cones;
use super::partials::Partials;
use crate::matrix::solve;
use crate::{Degree, Evidence, Frame, Grid, Knots, Lattice, Outcome, Verdict};

/// The lattice whose control points are moved from where they rest by a map, both in
/// lattice coordinates.
pub(super) fn mapped<const D: usize>(
    grid: Grid<D>,
    map: impl Fn([f64; D]) -> [f64; D],
) -> Lattice<D> {
    let axes = grid.frame().axes();
    let displacements = (0..grid.control_point_count())
        .map(|i| {
            let indices = grid.control_point_indices(i);
            let rest = std::array::from_fn(|a| grid.axes()[a].rest_coordinate(indices[a]));
            let image = map(rest);
            std::array::from_fn(|c| (0..D).map(|a| (image[a] - rest[a]) * axes[a][c]).sum())
        })
        .collect();
    Lattice::new(grid, displacements).unwrap()
}

pub(super) fn grid<const D: usize>(degree: [usize; D], cells: [usize; D]) -> Grid<D> {
    let degree = degree.map(|n| Degree::new(n).unwrap());
    Grid::new(degree, cells, Frame::unit()).unwrap()
}

pub(super) fn clamped<const D: usize>(degree: [usize; D], cells: [usize; D]) -> Grid<D> {
    grid(degree, cells).with_knots([Knots::Clamped; D]).unwrap()
}

/// A strip along the first axis, `length` long and `width` wide, is wound by a number of
/// turns (anticlockwise, the last axis of the plane pointing inwards); from one turn to the
/// next its distance from the middle grows by `pitch`.
pub(super) fn wound<const D: usize>(
    length: f64,
    width: f64,
    turns: f64,
    pitch: f64,
) -> impl Fn([f64; D]) -> [f64; D] {
    let total = turns * std::f64::consts::TAU;
    let radius = length / total;
    move |u| {
        let angle = total * u[0] / length;
        let r = radius + pitch * turns * u[0] / length - (u[1] - 0.5 * width);
        let mut image = u;
        image[0] = r * angle.sin();
        image[1] = radius - r * angle.cos();
        image
    }
}

/// The same displacements in another frame: those of the map in lattice coordinates.
pub(super) fn in_frame<const D: usize>(lattice: &Lattice<D>, frame: Frame<D>) -> Lattice<D> {
    let old = lattice.grid();
    let grid = Grid::new(old.degree(), old.cells(), frame)
        .unwrap()
        .with_knots(old.knots())
        .unwrap();
    let displacements = lattice
        .displacements()
        .iter()
        .map(|d| {
            let d: [f64; D] = old
                .frame()
                .inverse()
                .map(|row| (0..D).map(|c| row[c] * d[c]).sum());
            std::array::from_fn(|c| (0..D).map(|a| d[a] * frame.axes()[a][c]).sum())
        })
        .collect();
    Lattice::new(grid, displacements).unwrap()
}

/// Displacements of up to `size`, one after the other from a seed.
pub(super) fn noisy<const D: usize>(grid: Grid<D>, size: f64, seed: u64) -> Lattice<D> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        size * ((state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    };
    let displacements = (0..grid.control_point_count())
        .map(|_| std::array::from_fn(|_| next()))
        .collect();
    Lattice::new(grid, displacements).unwrap()
}

/// The evidence for an overlap, looked at with the public functions: Newton's method on the
/// world map goes from `other` to a place within its box whose image is that of `point` up
/// to rounding, and `point` is farther away. In a unit frame, where the world is the lattice.
pub(super) fn check_overlap<const D: usize>(lattice: &Lattice<D>, verdict: &Verdict<D>) {
    let Outcome::NotInjective(Evidence::Overlap {
        point,
        other,
        radius,
    }) = verdict.outcome
    else {
        panic!("{verdict:?}");
    };
    assert!(!verdict.is_injective() && verdict.irregular_cells.is_empty());
    assert!(other.t.iter().all(|&t| radius < t && t < 1.0 - radius));
    assert!(point.t.iter().all(|t| (0.0..=1.0).contains(t)));
    let image = lattice.deform_point(point.world);
    let mut q = other.world;
    for _ in 0..5 {
        let there = lattice.evaluate(q).unwrap();
        let residual = std::array::from_fn(|c| there.position[c] - image[c]);
        let step = solve(&there.jacobian, residual);
        q = std::array::from_fn(|a| q[a] - step[a]);
    }
    let last = lattice.evaluate(q).unwrap().position;
    let apart = |a: [f64; D], b: [f64; D]| (0..D).fold(0.0_f64, |m, c| m.max((a[c] - b[c]).abs()));
    assert!(apart(last, image) < 1e-13);
    assert!(apart(q, other.world) <= radius);
    assert!(apart(point.world, other.world) > radius);
}

/// Lattices with up to `cells` cells along each axis in skewed frames, of degrees from 1 to
/// `degree` and all kinds of knots, whose control points move by up to a random part of
/// `amplitude` cells along each axis.
pub(super) fn lattices<const D: usize>(
    degree: usize,
    cells: usize,
    amplitude: f64,
) -> impl Strategy<Value = Lattice<D>> {
    let knots = prop_oneof![2 => Just(Knots::Uniform), 1 => Just(Knots::Clamped)];
    let per_axis = proptest::collection::vec((1..=degree, 1..=cells, knots), D);
    let skew = proptest::collection::vec(-0.2..0.2_f64, D * D);
    (per_axis, skew, 0.0..amplitude, any::<u64>()).prop_map(|(axes, skew, amplitude, seed)| {
        let degree = std::array::from_fn(|a| Degree::new(axes[a].0).unwrap());
        let rows = std::array::from_fn(|r| {
            std::array::from_fn(|c| skew[r * D + c] + if r == c { 1.5 } else { 0.0 })
        });
        let frame = Frame::new([0.25; D], rows).unwrap();
        let grid = Grid::new(degree, std::array::from_fn(|a| axes[a].1), frame).unwrap();
        let grid = grid.with_knots(std::array::from_fn(|a| axes[a].2)).unwrap();
        noise(grid, amplitude, seed)
    })
}

/// A lattice whose control points move by up to `amplitude` cells along each axis.
pub(super) fn noise<const D: usize>(grid: Grid<D>, amplitude: f64, seed: u64) -> Lattice<D> {
    let axes = grid.frame().axes();
    let mut state = seed;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let displacements = (0..grid.control_point_count())
        .map(|_| {
            let u: [f64; D] = std::array::from_fn(|_| amplitude * next());
            std::array::from_fn(|c| (0..D).map(|a| u[a] * axes[a][c]).sum())
        })
        .collect();
    Lattice::new(grid, displacements).unwrap()
}

/// The lattice of an affine map `x ↦ M x` of unit cells.
pub(super) fn linear<const D: usize>(n: usize, cells: usize, m: [[f64; D]; D]) -> Lattice<D> {
    let grid = Grid::new([Degree::new(n).unwrap(); D], [cells; D], Frame::unit()).unwrap();
    let displacements = (0..grid.control_point_count())
        .map(|i| {
            let x = grid.rest_position(i);
            std::array::from_fn(|r| (0..D).map(|c| m[r][c] * x[c]).sum::<f64>() - x[r])
        })
        .collect();
    Lattice::new(grid, displacements).unwrap()
}

/// Which cells pass the conic-hull test around the axes of the lattice, by number.
pub(super) fn passing_cells<const D: usize>(partials: &Partials<D>) -> Vec<bool> {
    let mut passes = Vec::new();
    Cones::new(partials).test(partials, |_, pass| passes.push(pass));
    passes
}
