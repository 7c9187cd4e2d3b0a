//! Laws for any lattice.

use crate::claims::{Judge, Standing, methods};
use crate::common::lattice;
use crate::families::{
    Random, in_lattice_coordinates, near_the_limit, random_grid, random_lattice,
};
use ffd_core::{
    Border, CheckOptions, Checker, Degree, FfdError, Frame, Grid, Lattice, Method, Outcome, Verdict,
};
use proptest::prelude::*;

/// Parts into which the oracle may cut a cell.
const BOXES: usize = 300;

fn with(method: Method) -> CheckOptions {
    CheckOptions {
        method,
        ..CheckOptions::default()
    }
}

/// No method claims what is not so, and those that decide agree.
fn check_methods<const D: usize>(lattice: &Lattice<D>) -> Result<(), TestCaseError> {
    let judge = Judge::new(lattice, BOXES);
    let mut decided: Vec<(Method, bool)> = Vec::new();
    for method in methods() {
        let verdict = lattice.check(&with(method));
        prop_assert_eq!(verdict.method, method);
        let standing = judge.check(&verdict);
        prop_assert!(standing.is_ok(), "{:?}: {:?}", method, standing);
        if !matches!(verdict.outcome, Outcome::Undecided(_)) {
            decided.push((method, verdict.is_regular()));
        }
        // Around a regular map with an identity border, all of space is mapped one to one.
        if method == Method::Exact && lattice.grid().border() == Border::Identity {
            prop_assert_eq!(verdict.is_regular(), verdict.is_injective());
        }
    }
    let all_alike = decided.windows(2).all(|pair| pair[0].1 == pair[1].1);
    prop_assert!(all_alike, "{decided:?}");
    Ok(())
}

/// The cells that are not regular are all named, and no others.
fn check_all_cells<const D: usize>(lattice: &Lattice<D>) -> Result<(), TestCaseError> {
    let judge = Judge::new(lattice, BOXES);
    let options = CheckOptions {
        all_cells: true,
        ..CheckOptions::default()
    };
    let verdict = lattice.check(&options);
    let standing = judge.check(&verdict);
    prop_assert!(standing.is_ok(), "{standing:?}");
    if matches!(verdict.outcome, Outcome::Undecided(_) | Outcome::Reversed) {
        return Ok(());
    }
    let mut named = verdict.irregular_cells.clone();
    named.sort_unstable();
    let mut expected = Vec::new();
    for cell in judge.oracle.all_cells() {
        let signs = judge.cell_signs(cell);
        // Where the oracle gave up, the verdict stands alone.
        let unknown = signs.open && !signs.negative && !signs.zero;
        if signs.negative || signs.zero || (unknown && named.contains(&cell)) {
            expected.push(cell);
        }
    }
    expected.sort_unstable();
    prop_assert_eq!(named, expected, "{:?}", verdict);
    Ok(())
}

/// The minimum of det J is enclosed as narrowly as asked.
fn check_enclosure<const D: usize>(lattice: &Lattice<D>, width: f64) -> Result<(), TestCaseError> {
    let judge = Judge::new(lattice, BOXES);
    let options = CheckOptions {
        enclose: Some(width),
        ..CheckOptions::default()
    };
    let verdict = lattice.check(&options);
    let standing = judge.check(&verdict);
    prop_assert!(standing.is_ok(), "{standing:?}");
    let [low, high] = verdict.min_det;
    prop_assert!(high - low <= width, "{verdict:?}");
    // Both say the same of the sign.
    prop_assert!(!verdict.is_regular() || low >= 0.0);
    if matches!(verdict.outcome, Outcome::NotInjective(_)) && high > 0.0 {
        let evidence = format!("{:?}", verdict.outcome);
        prop_assert!(evidence.contains("Overlap"), "{verdict:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_method_claims_what_is_not_so_2d(lattice in lattice::<2>(2, 0.5)) {
        check_methods(&lattice)?;
    }

    #[test]
    fn all_irregular_cells_are_named_2d(lattice in lattice::<2>(3, 0.6)) {
        check_all_cells(&lattice)?;
    }

    #[test]
    fn the_minimum_is_enclosed_2d(
        lattice in lattice::<2>(2, 0.5),
        width in (-30_i32..0).prop_map(|e| 2.0_f64.powi(e)),
    ) {
        check_enclosure(&lattice, width)?;
    }

    /// An update says what a fresh test would.
    #[test]
    fn updates_are_fresh_tests_2d(seed in any::<u64>()) {
        check_updates::<2>(seed, 5)?;
    }
}

/// In space everything takes longer. Degrees are lower here; the bulk run has the others.
fn lattice_3d(seed: u64, most: f64) -> Lattice<3> {
    let mut random = Random::new(seed);
    let degree = [0; 3].map(|_| 1 + random.below(3));
    let cells = if degree == [3; 3] { 1 } else { 2 };
    let grid = random_grid(&mut random, degree, cells);
    random_lattice(&mut random, grid, most)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn no_method_claims_what_is_not_so_3d(seed in any::<u64>()) {
        check_methods(&lattice_3d(seed, 0.25))?;
    }

    #[test]
    fn all_irregular_cells_are_named_3d(seed in any::<u64>()) {
        check_all_cells(&lattice_3d(seed, 0.75))?;
    }

    #[test]
    fn the_minimum_is_enclosed_3d(
        seed in any::<u64>(),
        width in (-30_i32..0).prop_map(|e| 2.0_f64.powi(e)),
    ) {
        check_enclosure(&lattice_3d(seed, 0.5), width)?;
    }

    #[test]
    fn updates_are_fresh_tests_3d(seed in any::<u64>()) {
        check_updates::<3>(seed, 2)?;
    }
}

/// Moves control points of a lattice several times.
fn check_updates<const D: usize>(seed: u64, most_degree: usize) -> Result<(), TestCaseError> {
    let mut random = Random::new(seed);
    let degree = [0; D].map(|_| 1 + random.below(most_degree));
    let grid = random_grid::<D>(&mut random, degree, 3);
    let mut lattice = random_lattice(&mut random, grid, 0.25);
    let options = CheckOptions {
        all_cells: random.coin(),
        enclose: random.coin().then_some(1e-3),
        method: if random.below(4) == 0 {
            let methods = methods();
            methods[random.below(methods.len())]
        } else {
            Method::Exact
        },
        ..CheckOptions::default()
    };
    let mut checker = Checker::new(&lattice, &options);
    for _ in 0..4 {
        let mut moved = Vec::new();
        for _ in 0..random.below(4) {
            let i = random.below(lattice.displacements().len());
            let most = [0.25, 1.5][random.below(2)];
            lattice
                .set_displacement(i, std::array::from_fn(|_| random.dyadic(most)))
                .expect("finite");
            moved.push(i);
        }
        let updated = checker
            .update(&lattice, &moved)
            .expect("the same grid")
            .clone();
        prop_assert_eq!(checker.verdict(), &updated);
        let fresh = lattice.check(&options);
        prop_assert_eq!(names(&updated), names(&fresh), "{:?}", options);
        if options.all_cells && options.method == Method::Exact {
            prop_assert_eq!(&updated.irregular_cells, &fresh.irregular_cells);
        }
        // Of several witnesses, and bounds, any is right.
        let judge = Judge::new(&lattice, BOXES);
        for verdict in [&updated, &fresh] {
            let standing = judge.check(verdict);
            prop_assert!(standing.is_ok(), "{:?}: {:?}", options, standing);
        }
    }
    Ok(())
}

#[test]
fn an_update_needs_the_same_grid() {
    let grid = |cells| Grid::new([Degree::CUBIC; 2], [cells, 1], Frame::unit()).unwrap();
    let [a, b] = [2, 3].map(|cells| Lattice::at_rest(grid(cells)).unwrap());
    let mut checker = Checker::new(&a, &CheckOptions::default());
    let error = checker.update(&b, &[]).unwrap_err();
    assert_eq!(error, FfdError::GridMismatch);
    assert!(checker.update(&a, &[0]).unwrap().is_injective());
}

fn names<const D: usize>(verdict: &Verdict<D>) -> (&'static str, Option<&'static str>) {
    let theorem = verdict.theorem();
    (
        verdict.outcome.name(),
        theorem.as_ref().map(ffd_core::Theorem::name),
    )
}

/// Frames in which no product of an axis and a short number is rounded: skewed, mirrored,
/// scaled, and with axes of very different lengths.
fn frames<const D: usize>() -> Vec<Frame<D>> {
    let skew = [[0.5, 0.25, 0.0], [0.125, 1.0, -0.25], [0.0, 0.5, 1.5]];
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let far = 2.0_f64.powi(40);
    let scaled = |matrix: [[f64; 3]; 3], factors: [f64; 3]| {
        Frame::new(
            std::array::from_fn(|c| c as f64 - 0.5),
            std::array::from_fn(|i| std::array::from_fn(|c| matrix[i][c] * factors[i])),
        )
        .expect("independent axes")
    };
    vec![
        scaled(unit, [1.0; 3]),
        scaled(skew, [1.0; 3]),
        scaled(skew, [-1.0, 1.0, 1.0]),
        scaled(skew, [far; 3]),
        scaled(skew, [1.0 / far, -1.0 / far, 1.0 / far]),
        scaled(unit, [far, 1.0 / far, -1.0]),
    ]
}

/// The same displacements in lattice coordinates have the same verdict in every frame.
fn check_frames<const D: usize>(seed: u64, most_degree: usize) {
    let mut random = Random::new(seed);
    let degree = [0; D].map(|_| 1 + random.below(most_degree));
    let grid = random_grid::<D>(&mut random, degree, 2);
    let most = [0.125, 0.25, 0.5][random.below(3)];
    let unit = Grid::new(grid.degree(), grid.cells(), Frame::unit())
        .and_then(|unit| unit.with_knots(grid.knots()))
        .and_then(|unit| unit.with_border(grid.border()))
        .expect("the same grid elsewhere");
    let mut in_unit_frame = random_lattice(&mut random, unit, most);
    if random.coin() {
        in_unit_frame = near_the_limit(&mut random, &in_unit_frame);
    }
    // At most 32 binary digits, so that products with axes and their sums are exact.
    let displacements = in_unit_frame.displacements();
    let lattices: Vec<Lattice<D>> = frames()
        .into_iter()
        .map(|frame| {
            let framed = Grid::new(grid.degree(), grid.cells(), frame)
                .and_then(|framed| framed.with_knots(grid.knots()))
                .and_then(|framed| framed.with_border(grid.border()))
                .expect("the same grid elsewhere");
            in_lattice_coordinates(framed, displacements)
        })
        .collect();
    for method in methods() {
        let verdicts: Vec<_> = lattices
            .iter()
            .map(|lattice| names(&lattice.check(&with(method))))
            .collect();
        let all_alike = verdicts.windows(2).all(|pair| pair[0] == pair[1]);
        assert!(all_alike, "seed {seed}, {method:?}: {verdicts:?}");
    }
}

#[test]
fn verdicts_do_not_depend_on_the_frame() {
    for seed in 0..30 {
        check_frames::<2>(seed, 4);
    }
    for seed in 0..8 {
        check_frames::<3>(seed, 2);
    }
    check_frames::<3>(8, 3);
}

/// A budget is kept, and what is said within it is right.
#[test]
fn every_budget_ends_with_a_right_claim_or_none() {
    for seed in 0..8 {
        let mut random = Random::new(seed);
        let degree = [0; 3].map(|_| 1 + random.below(2));
        let grid = random_grid(&mut random, degree, 2);
        let first = random_lattice(&mut random, grid, 0.5);
        let lattice = near_the_limit(&mut random, &first);
        let judge = Judge::new(&lattice, BOXES);
        for (boxes, exact_boxes) in [(0, 0), (1, 0), (0, 1), (7, 0), (20, 3), (1000, 10)] {
            for (all_cells, enclose) in [(false, None), (true, Some(1e-12))] {
                for method in methods() {
                    // Budgets are for the methods that decide; others are tried once.
                    let decides = matches!(method, Method::Exact | Method::Paper);
                    if !decides && (boxes, exact_boxes) != (7, 0) {
                        continue;
                    }
                    let mut options = CheckOptions {
                        all_cells,
                        enclose,
                        ..with(method)
                    };
                    options.budget.boxes = boxes;
                    options.budget.exact_boxes = exact_boxes;
                    let verdict = lattice.check(&options);
                    let standing = judge.check(&verdict);
                    assert!(standing.is_ok(), "seed {seed}, {options:?}: {standing:?}");
                    // The sign and the enclosure are searched for one after the other, both
                    // for positive and for mirrored maps, each with a box for every cell.
                    let cells: usize = judge.oracle.cells.iter().product();
                    let effort = verdict.effort;
                    let kept = effort.boxes <= 4 * (boxes + cells + 1)
                        && effort.exact_boxes <= 4 * (exact_boxes + 1);
                    assert!(kept || method != Method::Exact, "{options:?} {effort:?}");
                }
            }
        }
    }
}

/// The exact method decides what the oracle can: nothing here touches zero.
#[test]
fn the_exact_method_decides() {
    for seed in 100..130 {
        let mut random = Random::new(seed);
        let degree = [0; 2].map(|_| 1 + random.below(5));
        let grid = random_grid(&mut random, degree, 2);
        let first = random_lattice(&mut random, grid, 1.0);
        let lattice = near_the_limit(&mut random, &first);
        let verdict = lattice.check(&CheckOptions::default());
        let standing = Judge::new(&lattice, BOXES).check(&verdict);
        assert_eq!(standing, Ok(Standing::Confirmed), "seed {seed}");
        assert!(
            !matches!(verdict.outcome, Outcome::Undecided(_)),
            "seed {seed}"
        );
    }
}
