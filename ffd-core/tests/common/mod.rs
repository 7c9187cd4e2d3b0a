//! Lattices to test with, and the slow formulation to test against.
#![allow(dead_code, reason = "each test uses a part of this")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::needless_range_loop,
    reason = "small numbers; indices as in the formulas"
)]

use ffd_core::{Border, Degree, Frame, Grid, Knots, Lattice};
use proptest::array::UniformArrayStrategy;
use proptest::prelude::*;

/// A skewed and mirrored frame, to catch mixed-up rows, columns and signs. Its axes are
/// between 0.5 and 1.6 long and its inverse has entries below 3 and row sums below 4.
pub(crate) fn frame<const D: usize>() -> Frame<D> {
    let axes3 = [[0.5, 0.25, 0.0], [0.125, 1.0, -0.25], [0.0, 0.5, -1.5]];
    let axes2 = [[0.5, 0.25, 0.0], [0.5, -1.0, 0.0]];
    let origin = [3.0, -1.0, 2.0];
    let axes = |i: usize, c: usize| if D == 2 { axes2[i][c] } else { axes3[i][c] };
    Frame::new(
        std::array::from_fn(|c| origin[c]),
        std::array::from_fn(|i| std::array::from_fn(|c| axes(i, c))),
    )
    .unwrap()
}

pub(crate) fn degree() -> impl Strategy<Value = Degree> {
    (1_usize..=5).prop_map(|n| Degree::new(n).unwrap())
}

/// `D` independent values.
pub(crate) fn each<const D: usize, S: Strategy>(
    strategy: S,
) -> UniformArrayStrategy<S, [S::Value; D]> {
    UniformArrayStrategy::new(strategy)
}

/// Grids of every degree, kind of knots and border, with up to `most` cells per axis.
pub(crate) fn grid<const D: usize>(most: usize) -> impl Strategy<Value = Grid<D>> {
    let knots = prop_oneof![Just(Knots::Uniform), Just(Knots::Clamped)];
    (
        each::<D, _>(degree()),
        each::<D, _>(1..=most),
        each::<D, _>(knots),
        any::<bool>(),
    )
        .prop_map(|(degree, cells, knots, border)| {
            let grid = Grid::new(degree, cells, frame()).unwrap();
            if border {
                grid.with_border(Border::Identity).unwrap()
            } else {
                grid.with_knots(knots).unwrap()
            }
        })
}

/// Lattices on such grids, displaced by up to `most_displacement` per component.
pub(crate) fn lattice<const D: usize>(
    most_cells: usize,
    most_displacement: f64,
) -> impl Strategy<Value = Lattice<D>> {
    grid(most_cells).prop_flat_map(move |grid| {
        let displacement = each::<D, _>(-most_displacement..=most_displacement);
        proptest::collection::vec(displacement, grid.control_point_count())
            .prop_map(move |displacements| Lattice::new(grid.clone(), displacements).unwrap())
    })
}

/// The lattice on a grid with the given displacement of the control point at each place.
pub(crate) fn displaced<const D: usize>(
    grid: Grid<D>,
    displacement: impl Fn([f64; D]) -> [f64; D],
) -> Lattice<D> {
    let displacements = (0..grid.control_point_count())
        .map(|i| displacement(grid.rest_position(i)))
        .collect();
    Lattice::new(grid, displacements).unwrap()
}

/// The world point at the given fractions of the domain.
pub(crate) fn at<const D: usize>(grid: &Grid<D>, fractions: [f64; D]) -> [f64; D] {
    let domain = grid.domain();
    grid.frame().to_world(std::array::from_fn(|i| {
        domain[i][0] + fractions[i] * (domain[i][1] - domain[i][0])
    }))
}

/// The slow formulation: for one axis the `k`-th derivative of the B-spline of degree
/// `p` that begins at knot `i`, straight from the recursion over the knots, at `u` in
/// the cell that begins at knot `cell`.
fn spline(knot: &dyn Fn(isize) -> f64, cell: isize, k: usize, i: isize, p: isize, u: f64) -> f64 {
    let over = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
    let (left, right) = (knot(i + p) - knot(i), knot(i + p + 1) - knot(i + 1));
    if p == 0 {
        let inside = i == cell && k == 0;
        f64::from(u8::from(inside))
    } else if k == 0 {
        over((u - knot(i)) * spline(knot, cell, 0, i, p - 1, u), left)
            + over(
                (knot(i + p + 1) - u) * spline(knot, cell, 0, i + 1, p - 1, u),
                right,
            )
    } else {
        p as f64
            * (over(spline(knot, cell, k - 1, i, p - 1, u), left)
                - over(spline(knot, cell, k - 1, i + 1, p - 1, u), right))
    }
}

/// The sum over all control points of displacement times basis functions, with the
/// given order of derivative along each axis, at lattice coordinates `u` in the cell
/// that contains them (the one above at a knot).
pub(crate) fn slow_sum<const D: usize>(
    lattice: &Lattice<D>,
    u: [f64; D],
    derivative: [usize; D],
) -> [f64; D] {
    let grid = lattice.grid();
    let domain = grid.domain();
    let mut sum = [0.0; D];
    for (index, displacement) in lattice.displacements().iter().enumerate() {
        let indices = grid.control_point_indices(index);
        let mut weight = 1.0;
        for axis in 0..D {
            let (n, cells) = (grid.degree()[axis].get(), grid.cells()[axis]);
            let knots = grid.knots()[axis];
            let knot = move |i: isize| match knots {
                Knots::Uniform => i as f64,
                Knots::Clamped => i.clamp(0, cells as isize) as f64,
            };
            let cell = u[axis].floor().min(domain[axis][1] - 1.0) as isize;
            let first = indices[axis] as isize - n as isize;
            weight *= spline(&knot, cell, derivative[axis], first, n as isize, u[axis]);
        }
        for c in 0..D {
            sum[c] += weight * displacement[c];
        }
    }
    sum
}
