//! How far a lattice can go: never beyond the truth, and close to it.

use std::time::Instant;

use crate::families::{Random, in_lattice_coordinates, random_grid, random_lattice, scaled};
use crate::oracle::{Oracle, determinant, exact};
use dashu_ratio::RBig;
use ffd_core::{
    Border, Budget, CheckOptions, Degree, FfdError, Frame, Grid, Knots, Lattice, SafeStep,
    StepOptions,
};

fn step<const D: usize>(from: &Lattice<D>, to: &Lattice<D>) -> SafeStep<D> {
    let options = StepOptions::default();
    from.largest_safe_step(to, &options).expect("the same grid")
}

/// The determinant at a place of the domain at a time, exactly, times a positive constant.
fn det_at<const D: usize>(
    ends: &[Oracle<'_, D>; 2],
    cell: [usize; D],
    place: [f64; D],
    t: f64,
) -> RBig {
    let [start, end] = [0, 1].map(|i| ends[i].lattice_jacobian(cell, place));
    let t = exact(t);
    let mixed: [[RBig; D]; D] = std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let (a, b): (&RBig, &RBig) = (&start[r][c], &end[r][c]);
            a + (b - a) * &t
        })
    });
    determinant(&mixed)
}

/// The lattice at a time, rounded.
fn between<const D: usize>(from: &Lattice<D>, to: &Lattice<D>, t: f64) -> Lattice<D> {
    let both = from.displacements().iter().zip(to.displacements());
    let mixed = both.map(|(a, b)| std::array::from_fn(|c| a[c] + t * (b[c] - a[c])));
    Lattice::new(from.grid().clone(), mixed.collect()).expect("finite as before")
}

/// Holds the claims against exact values at the corners and in the middle of all cells, and
/// against the verdict on lattices on the way.
#[track_caller]
fn assert_true<const D: usize>(from: &Lattice<D>, to: &Lattice<D>, step: &SafeStep<D>) {
    let ends = [Oracle::new(from), Oracle::new(to)];
    let [low, high] = step.t;
    assert!((0.0..=1.0).contains(&low) && low <= high, "{step:?}");
    for cell in ends[0].all_cells() {
        for corner in 0..=1_usize << D {
            let place = std::array::from_fn(|a| {
                let end = f64::from(u8::from(corner >> a & 1 == 1));
                if corner == 1 << D { 0.5 } else { end }
            });
            for t in [low, 0.75 * low] {
                let det = det_at(&ends, cell, place, t);
                assert!(det > RBig::ZERO, "{cell:?} {place:?} at {t}: {step:?}");
            }
        }
    }
    // Rounded displacements are not on the way, so not too close to its end.
    for t in [1.0 - 1e-4, 0.8, 0.4] {
        let there = between(from, to, t * low);
        let options = CheckOptions {
            global: false,
            ..CheckOptions::default()
        };
        assert!(there.check(&options).is_regular(), "{t} {step:?}");
    }
    match step.place {
        None => assert!(high == f64::INFINITY, "{step:?}"),
        Some(place) => {
            let det = det_at(&ends, place.cell, place.t, high);
            assert!(det <= RBig::ZERO, "{step:?}");
        }
    }
}

/// The enclosure is as narrow as asked for, and contains the first fold.
#[track_caller]
fn assert_first_fold<const D: usize>(step: &SafeStep<D>, expected: f64) {
    let [low, high] = step.t;
    // The fold itself may not be a binary fraction.
    assert!(
        low < expected && expected <= high * (1.0 + 1e-15),
        "{expected}: {step:?}"
    );
    assert!(high - low <= 1e-6 * high, "{expected}: {step:?}");
}

/// Lattice coordinates shrink by factors 1 − cₐ t along each axis; so that control points
/// are exact, with uniform knots.
fn shrinking<const D: usize>(degree: usize, frame: Frame<D>, c: [f64; D]) -> [Lattice<D>; 2] {
    let degree = Degree::new(degree).expect("1 to 5");
    let grid = Grid::new([degree; D], std::array::from_fn(|a| 1 + a % 2), frame);
    let grid = grid.expect("a small grid");
    let places = (0..grid.control_point_count()).map(|index| {
        let at = grid.control_point_indices(index);
        let place = |a: usize| at[a] as f64 - (degree.get() as f64 - 1.0) / 2.0;
        std::array::from_fn(|a| -c[a] * place(a))
    });
    let displacements: Vec<_> = places.collect();
    let end = in_lattice_coordinates(grid.clone(), &displacements);
    [Lattice::at_rest(grid).expect("memory"), end]
}

/// Half of the entries are far from orthogonal, and one axis is mirrored.
fn skew<const D: usize>() -> Frame<D> {
    let axes = [[2.0, 0.25, 0.0], [0.5, -1.0, 0.25], [0.0, 0.75, 1.5]];
    let axes = std::array::from_fn(|a| std::array::from_fn(|c| axes[a][c]));
    Frame::new([8.0; D], axes).expect("not singular")
}

#[test]
fn first_folds_of_all_orders_in_the_plane() {
    for frame in [Frame::unit(), skew()] {
        for degree in [1, 2, 3, 5] {
            for (c, expected) in [
                ([2.0, 0.0], 0.5),
                ([2.0, 2.0], 0.5),
                ([3.0, 3.0], 1.0 / 3.0),
                ([1.0, 1.0], 1.0),
                ([1.25, 3.0], 1.0 / 3.0),
                ([-4.0, 1.75], 4.0 / 7.0),
                ([1024.0, 1.0], 1.0 / 1024.0),
            ] {
                let [from, to] = shrinking(degree, frame, c);
                let found = step(&from, &to);
                assert_first_fold(&found, expected);
                if c == [2.0, 2.0] {
                    assert_eq!(found.t[1], 0.5);
                }
            }
        }
    }
}

#[test]
fn first_folds_of_all_orders_in_space() {
    for (degree, frame) in [(1, skew()), (2, Frame::unit()), (3, Frame::unit())] {
        for (c, expected) in [
            ([0.0, 2.0, 0.0], 0.5),
            ([2.0, 2.0, 0.0], 0.5),
            ([0.0, 3.0, 3.0], 1.0 / 3.0),
            ([1.5, 1.5, 1.5], 2.0 / 3.0),
            ([1.25, 3.0, 2.0], 1.0 / 3.0),
        ] {
            let [from, to] = shrinking(degree, frame, c);
            assert_first_fold(&step(&from, &to), expected);
        }
    }
}

/// The determinant touches zero at half the way, and is positive at all others: bisection
/// by a test of lattices would not notice.
#[test]
fn a_fold_is_not_stepped_over() {
    let [from, to] = shrinking(3, Frame::unit(), [2.0, 2.0]);
    let options = CheckOptions::default();
    for t in [0.25, 0.499, 0.501, 0.75, 1.0] {
        assert!(between(&from, &to, t).check(&options).is_regular());
    }
    assert_first_fold(&step(&from, &to), 0.5);
}

#[test]
fn random_lattices_from_rest() {
    for seed in 0..60 {
        let random = &mut Random::new(seed);
        let degree = [0; 2].map(|_| 1 + random.below(4));
        let grid = random_grid(random, degree, 3);
        let to = random_lattice(random, grid.clone(), 2.0);
        let from = Lattice::at_rest(grid).expect("memory");
        let found = step(&from, &to);
        assert_true(&from, &to, &found);
        assert!(found.t[1] == f64::INFINITY || found.t[1] - found.t[0] <= 1e-6 * found.t[1]);
        if found.t[1] == f64::INFINITY {
            assert_eq!(found.t[0], 1.0, "seed {seed}");
        }
    }
    for seed in 0..8 {
        let random = &mut Random::new(seed);
        let degree = [0; 3].map(|_| 1 + random.below(3));
        let grid = random_grid(random, degree, 2);
        let to = random_lattice(random, grid.clone(), 2.0);
        let from = Lattice::at_rest(grid).expect("memory");
        let found = step(&from, &to);
        assert_true(&from, &to, &found);
        assert!(found.t[1] == f64::INFINITY || found.t[1] - found.t[0] <= 1e-6 * found.t[1]);
    }
}

#[test]
fn random_lattices_from_regular_ones() {
    for seed in 100..130 {
        let random = &mut Random::new(seed);
        let degree = [0; 2].map(|_| 1 + random.below(4));
        let grid = random_grid(random, degree, 3);
        let [from, to] = [0.25, 1.5].map(|most| random_lattice(random, grid.clone(), most));
        let found = step(&from, &to);
        if from.check(&CheckOptions::default()).is_regular() {
            assert_true(&from, &to, &found);
            assert!(found.t[1] == f64::INFINITY || found.t[1] - found.t[0] <= 1e-6 * found.t[1]);
        } else {
            assert_eq!(found.t[0], 0.0);
        }
    }
}

/// Half as far takes twice as long.
#[test]
fn time_scales() {
    for seed in 200..220 {
        let random = &mut Random::new(seed);
        let grid = random_grid(random, [3, 2], 2);
        let to = random_lattice(random, grid.clone(), 2.0);
        let from = Lattice::at_rest(grid).expect("memory");
        let [low, high] = step(&from, &to).t;
        // Powers of two are exact.
        let half = step(&from, &scaled(&to, 0.5)).t;
        if 2.0 * high <= 1.0 {
            assert!(
                half[0] <= 2.0 * high && 2.0 * low <= half[1],
                "{seed}: {half:?}"
            );
        } else if low >= 0.5 {
            assert_eq!(half, [1.0, f64::INFINITY], "{seed}: {low} {high}");
        }
    }
}

#[test]
fn harmless_ways_have_no_end() {
    let random = &mut Random::new(7);
    let grid = random_grid::<3>(random, [3; 3], 2);
    let from = Lattice::at_rest(grid.clone()).expect("memory");
    let to = random_lattice(random, grid.clone(), 0.0625);
    let infinite = [1.0, f64::INFINITY];
    assert_eq!(step(&from, &to).t, infinite);
    assert_eq!(step(&to, &from).t, infinite);
    assert_eq!(step(&to, &to).t, infinite);
    assert_eq!(step(&to, &to).place, None);
}

#[test]
fn irregular_beginnings_go_nowhere() {
    let [rest, shrunk] = shrinking(3, Frame::unit(), [1.0, 1.0]);
    assert_eq!(step(&shrunk, &rest).t, [0.0, 0.0]);
    let [rest, mirrored] = shrinking(3, Frame::unit(), [2.0, 0.0]);
    assert_eq!(step(&mirrored, &rest).t, [0.0, 0.0]);
}

#[test]
fn grids_must_be_the_same() {
    let grid = |degree: usize, cells, frame| {
        Grid::new([Degree::new(degree).expect("small"); 2], [cells; 2], frame).expect("small")
    };
    let first = grid(3, 2, Frame::unit());
    let clamped = first.clone().with_knots([Knots::Clamped, Knots::Uniform]);
    let bordered = first.clone().with_border(Border::Identity);
    for (other, expected) in [
        (grid(2, 2, Frame::unit()), "degrees"),
        (grid(3, 3, Frame::unit()), "numbers of cells"),
        (grid(3, 2, skew()), "frames"),
        (clamped.expect("free"), "knots"),
        (bordered.expect("uniform"), "borders"),
    ] {
        let [from, to] = [&first, &other].map(|g| Lattice::at_rest(g.clone()).expect("memory"));
        let refused = from.largest_safe_step(&to, &StepOptions::default());
        assert_eq!(refused, Err(FfdError::DifferentGrids { what: expected }));
    }
}

/// Neither the size of a cell nor that of displacements matters.
#[test]
fn scales_do_not_matter() {
    for size in [1e-12, 1.0, 1e12] {
        let axes = [[size, 0.25 * size], [-0.5 * size, size]];
        let frame = Frame::new([3.0; 2], axes).expect("not singular");
        let grid = Grid::new([Degree::CUBIC; 2], [2, 2], frame).expect("small");
        let from = Lattice::at_rest(grid.clone()).expect("memory");
        for far in [1.0, 1e12, 1e150] {
            let to = random_lattice(&mut Random::new(3), grid.clone(), 4.0);
            let found = step(&from, &scaled(&to, far));
            assert_true(&from, &scaled(&to, far), &found);
            assert!(
                found.t[1] - found.t[0] <= 1e-6 * found.t[1],
                "{size} {far}: {found:?}"
            );
        }
    }
}

/// A way of which nothing can be said in floating point ends with the budget.
#[test]
fn the_search_ends() {
    let grid = Grid::new([Degree::CUBIC; 2], [3, 3], Frame::unit()).expect("small");
    let from = Lattice::at_rest(grid.clone()).expect("memory");
    let to = random_lattice(&mut Random::new(5), grid, 4.0);
    for (boxes, exact_boxes) in [(0, 0), (0, 30), (5, 0), (100, 30)] {
        for (width, far) in [(1e-6, 1.0), (0.0, 1.0), (f64::NAN, 1.0), (1e-6, 1e300)] {
            let budget = Budget { boxes, exact_boxes };
            let options = StepOptions { width, budget };
            let to = scaled(&to, far);
            let start = Instant::now();
            let found = from
                .largest_safe_step(&to, &options)
                .expect("the same grid");
            assert_true(&from, &to, &found);
            assert!(start.elapsed().as_secs() < 20);
        }
    }
}
