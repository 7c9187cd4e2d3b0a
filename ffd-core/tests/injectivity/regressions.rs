//! What once went wrong.

use ffd_core::{
    Budget, CheckOptions, Checker, Degree, Evidence, Frame, Grid, Knots, Lattice, Outcome,
};

use crate::claims::Judge;
use crate::common::displaced;
use crate::families::{Random, random_lattice, scaled};

/// Enough for the oracle to decide each of these.
const ORACLE: usize = 3_000;

/// The sign of `det J` only.
fn sign() -> CheckOptions {
    CheckOptions {
        global: false,
        ..CheckOptions::default()
    }
}

fn grid<const D: usize>(degree: [usize; D], cells: [usize; D]) -> Grid<D> {
    Grid::new(
        degree.map(|n| Degree::new(n).unwrap()),
        cells,
        Frame::unit(),
    )
    .unwrap()
}

/// A strip with control points displaced at both ends, far from each other, each a little
/// further than allowed. The search ends with the first end that folds; then that one is put
/// back. Nothing may be taken from the other end that was only half proven.
#[test]
fn an_update_forgets_what_was_half_proven() {
    for seed in 0..200 {
        let mut random = Random::new(seed);
        let n = 2 + random.below(2);
        let mirrored = random.below(4) == 0;
        let grid = grid([n, n], [2 + 2 * n, 1]);
        let rest = displaced(grid.clone(), |[_, y]| {
            [0.0, if mirrored { -2.0 * y } else { 0.0 }]
        });
        let along = grid.control_points_per_axis()[0];
        let ends: [Vec<usize>; 2] = [false, true].map(|upper| {
            let all = 0..grid.control_point_count();
            all.filter(|&i| {
                let at = grid.control_point_indices(i)[0];
                if upper { at + 1 + n >= along } else { at <= n }
            })
            .collect()
        });
        let mut lattice = rest.clone();
        for end in &ends {
            let changes: Vec<[f64; 2]> = end
                .iter()
                .map(|_| [random.dyadic(1.0), random.dyadic(1.0)])
                .collect();
            let at = |t: f64, lattice: &Lattice<2>| {
                let mut moved = lattice.clone();
                for (&i, change) in end.iter().zip(&changes) {
                    let [x, y] = rest.displacements()[i];
                    let to = [x + t * change[0], y + t * change[1]];
                    moved.set_displacement(i, to).unwrap();
                }
                moved
            };
            let wanted = if mirrored {
                "reversed"
            } else {
                "locally_injective"
            };
            let (mut low, mut high) = (0.0, 4.0);
            for _ in 0..14 {
                let middle = f64::midpoint(low, high);
                let name = at(middle, &rest).check(&sign()).outcome.name();
                let holds = name == wanted || name == "injective";
                *(if holds { &mut low } else { &mut high }) = middle;
            }
            let beyond = [1e-4, 1e-3, 1e-2, 3e-2][random.below(4)];
            lattice = at(high * (1.0 + beyond), &lattice);
        }
        let checker = Checker::new(&lattice, &sign());
        for end in &ends {
            let (mut back, mut checker) = (lattice.clone(), checker.clone());
            for &i in end {
                back.set_displacement(i, rest.displacements()[i]).unwrap();
            }
            let updated = checker.update(&back, end).unwrap();
            Judge::new(&back, ORACLE).check(updated).unwrap();
            assert_eq!(
                updated.outcome.name(),
                back.check(&sign()).outcome.name(),
                "{seed}"
            );
        }
    }
}

/// A cell that is mirrored, with a zero at a corner; then the cell beside it is turned over.
#[test]
fn zeros_are_judged_anew_when_signs_change() {
    let grid = grid([1, 1], [2, 1]);
    let index = |i: usize, j: usize| i + 3 * j;
    let place = |lattice: &mut Lattice<2>, i: usize, j: usize, [x, y]: [f64; 2]| {
        let by = [x - i as f64, y - j as f64];
        lattice.set_displacement(index(i, j), by).unwrap();
    };
    let mut lattice = Lattice::at_rest(grid).unwrap();
    place(&mut lattice, 0, 0, [1.0, 0.0]);
    place(&mut lattice, 1, 0, [1.0, 0.0]);
    place(&mut lattice, 0, 1, [2.0, 1.0]);
    place(&mut lattice, 1, 1, [1.0, 1.0]);
    place(&mut lattice, 2, 0, [0.0, 0.0]);
    place(&mut lattice, 2, 1, [0.0, 1.0]);
    let mut checker = Checker::new(&lattice, &sign());
    let first = checker.verdict().outcome;
    assert!(
        matches!(first, Outcome::Degenerate { reversed: true, .. }),
        "{first:?}"
    );
    place(&mut lattice, 2, 0, [2.0, 0.0]);
    place(&mut lattice, 2, 1, [2.0, 1.0]);
    let moved = [index(2, 0), index(2, 1)];
    let updated = checker.update(&lattice, &moved).unwrap();
    let outcome = updated.outcome;
    let both = matches!(outcome, Outcome::NotInjective(Evidence::BothSigns { .. }));
    assert!(both, "{outcome:?}");
    Judge::new(&lattice, ORACLE).check(updated).unwrap();
}

/// Mirrored cells with an edge that is collapsed at a corner: `det J` is zero there, negative
/// near by and positive further on. The witness must not be that corner.
#[test]
fn a_witness_of_a_mirrored_map_is_negative() {
    for seed in 0..300 {
        let mut random = Random::new(seed);
        let degree = [1 + random.below(2), 2 + random.below(2)];
        let grid = grid(degree, [1, 1])
            .with_knots([Knots::Clamped; 2])
            .unwrap();
        let mut lattice = displaced(grid.clone(), |[_, y]| [0.0, -2.0 * y]);
        for i in 0..grid.control_point_count() {
            let [x, y] = lattice.displacements()[i];
            let by = [x + random.dyadic(0.5), y + random.dyadic(0.5)];
            lattice.set_displacement(i, by).unwrap();
        }
        let [x, y] = lattice.displacements()[0];
        let between = grid.axes()[0].rest_coordinate(1);
        lattice.set_displacement(1, [x - between, y]).unwrap();
        let judge = Judge::new(&lattice, ORACLE);
        for all_cells in [false, true] {
            let options = CheckOptions {
                all_cells,
                ..sign()
            };
            judge.check(&lattice.check(&options)).unwrap();
        }
    }
}

/// With a small budget, cells that fold are either listed or said to be in doubt.
#[test]
fn no_cell_is_left_out_of_both_lists() {
    let mut in_doubt = 0;
    for seed in 0..60 {
        let mut random = Random::new(seed);
        let degree = [0; 2].map(|_| 2 + random.below(2));
        let lattice = random_lattice(&mut random, grid(degree, [4, 4]), 0.75);
        let judge = Judge::new(&lattice, ORACLE);
        for (boxes, exact_boxes) in [(0, 0), (4, 0), (10, 1), (100, 10)] {
            let options = CheckOptions {
                all_cells: true,
                budget: Budget { boxes, exact_boxes },
                ..sign()
            };
            let verdict = lattice.check(&options);
            if matches!(verdict.outcome, Outcome::Reversed) {
                continue;
            }
            for cell in judge.oracle.all_cells() {
                let signs = judge.cell_signs(cell);
                let irregular = signs.negative || signs.zero;
                let listed = verdict.irregular_cells.contains(&cell);
                let doubtful = verdict.doubtful_cells.contains(&cell);
                assert!(!listed || irregular, "{seed} {cell:?}");
                assert!(listed || doubtful || !irregular, "{seed} {cell:?}");
                in_doubt += usize::from(doubtful);
            }
        }
    }
    assert!(in_doubt > 0, "small budgets leave something in doubt");
}

/// Control vectors so large that single precision overflows in the products: lattices just
/// past the limit, turned and blown up.
#[test]
fn large_maps_do_not_overflow() {
    for (degree, size) in [(3, 2e11), (4, 8e10), (5, 5e10), (5, 1e30), (5, 1e99)] {
        for seed in 0..3 {
            let mut random = Random::new(seed);
            let grid = grid([degree; 3], [2, 2, 2]);
            let noise = random_lattice(&mut random, grid.clone(), 1.0);
            let (mut low, mut high) = (0.0, 3.0);
            for _ in 0..12 {
                let middle = f64::midpoint(low, high);
                let regular = scaled(&noise, middle).check(&sign()).is_regular();
                *(if regular { &mut low } else { &mut high }) = middle;
            }
            let (sin, cos) = (0.5 + random.dyadic(1.0)).sin_cos();
            for amplitude in [0.9 * low, 1.02 * high] {
                let small = scaled(&noise, amplitude);
                let mut displacements = Vec::new();
                for (i, d) in small.displacements().iter().enumerate() {
                    let rest = grid.rest_position(i);
                    let [x, y, z] = std::array::from_fn(|c| rest[c] + d[c]);
                    let turned = [cos * x - sin * y, sin * x + cos * y, z];
                    let turned = [
                        turned[0],
                        cos * turned[1] - sin * z,
                        sin * turned[1] + cos * z,
                    ];
                    displacements.push(std::array::from_fn(|c| size * turned[c] - rest[c]));
                }
                let large = Lattice::new(grid.clone(), displacements).unwrap();
                let [expected, found] = [&small, &large].map(|l| l.check(&sign()));
                // The last digit of a coordinate is far below the distance to the limit.
                assert_eq!(
                    found.is_regular(),
                    expected.is_regular(),
                    "{degree} {size:e} {seed}"
                );
                assert!(found.min_det[0] <= found.min_det[1]);
            }
        }
    }
}

/// A horseshoe whose arms bulge until they meet: one side of the domain meets itself.
#[test]
fn a_side_that_crosses_itself_is_found() {
    let name = |by: f64| {
        let lattice = displaced(grid([2, 2], [40, 1]), |x| {
            let along = x[0] / 40.0;
            let bulge = |c: f64| (-(along - c).powi(2) / 0.002).exp();
            let shift = x[1] * by * (bulge(0.15) - bulge(0.85));
            let (sin, cos) = (1.5 * std::f64::consts::PI * (along - 0.5)).sin_cos();
            let radius = 10.0 - 2.0 * x[1];
            [radius * sin + shift - x[0], -radius * cos - x[1]]
        });
        let verdict = lattice.check(&CheckOptions::default());
        Judge::new(&lattice, ORACLE).check(&verdict).unwrap();
        verdict.outcome.name()
    };
    assert_eq!(name(7.0), "injective");
    assert_eq!(name(10.0), "not_injective");
}

/// The exact stage in a mirrored frame: a zero on a plane, and a map just short of it.
#[test]
fn exact_arithmetic_sees_that_a_frame_is_mirrored() {
    let frame = Frame::new([0.0; 2], [[0.0, 1.0], [1.0, 0.0]]).unwrap();
    let flat = Grid::new([Degree::QUADRATIC; 2], [2, 2], frame).unwrap();
    let collapsed = displaced(flat.clone(), |[x, _]| [-x, 0.0]);
    let verdict = collapsed.check(&CheckOptions::default());
    assert!(matches!(verdict.outcome, Outcome::Degenerate { .. }));
    // Two shears, whose determinant 1 − s is far below what rounding does to it.
    let tiny = 2_f64.powi(-50);
    for (left, word) in [(tiny, "locally_injective"), (-tiny, "reversed")] {
        let nearly = displaced(flat.clone(), |[x, y]| [(1.0 - left) * y, x]);
        let verdict = nearly.check(&sign());
        assert_eq!(verdict.outcome.name(), word);
        assert!(verdict.effort.exact_boxes > 0);
        Judge::new(&nearly, ORACLE).check(&verdict).unwrap();
    }
}

/// `det J` along the first axis is a quadratic spline that touches zero in the middle of the
/// first cell, where cutting finds it, and at a third of the last one, where it cannot.
#[test]
fn a_zero_does_not_hide_a_doubt() {
    let along = [0.0, -0.25, -1.5, -1.75, -3.125, -2.25];
    let grid = grid([3, 2], [3, 1]);
    let displacements = (0..grid.control_point_count())
        .map(|i| [along[grid.control_point_indices(i)[0]], 0.0])
        .collect();
    let lattice = Lattice::new(grid, displacements).unwrap();
    let options = CheckOptions {
        all_cells: true,
        budget: Budget {
            boxes: 10_000,
            exact_boxes: 100,
        },
        ..sign()
    };
    let verdict = lattice.check(&options);
    assert!(
        matches!(verdict.outcome, Outcome::Undecided(_)),
        "{verdict:?}"
    );
    assert_eq!(verdict.irregular_cells, [[0, 0]]);
    assert_eq!(verdict.doubtful_cells, [[2, 0]]);
    Judge::new(&lattice, ORACLE).check(&verdict).unwrap();
}
