//! The verdicts of the methods other than the exact one.
//!
//! | method | proves, where it passes | see |
//! |---|---|---|
//! | `Phi` | `det J > 0` | [`phi`] |
//! | `Conic` | at least that; more for some cones | [`hull`] |
//! | `ChoiLee` | one-to-one | [`choi_lee`] |
//! | `Paper` | the sign of `det J` everywhere | [`paper`] |
//!
//! Only the last can find out that a map is not one-to-one. Where another does not pass, the
//! verdict is undecided.

use super::checker::globally;
use super::hull::Failure;
use super::search::{Search, Sign, State};
use super::verdict::{Evidence, Map, Outcome, Theorem, Undecided, Verdict};
use super::{CheckOptions, ConicHull, Effort, Method, choi_lee, hull, paper, phi};
use crate::{Border, Lattice};

/// The verdict of a method. Cells that pass the conic-hull test are known to `search` if
/// [`uses_cones`].
pub(super) fn judge<const D: usize>(
    lattice: &Lattice<D>,
    options: &CheckOptions,
    search: &mut Search<D>,
) -> Verdict<D> {
    let known = |states: &[State<D>], cell: usize| matches!(states[cell], State::Cones);
    let plain = (0..D).all(|axis| search.partials.plain(axis).is_some());
    let vectors = match options.method {
        Method::ChoiLee => false,
        Method::Conic(hull) if hull.one_for_all && !hull.off_axis && plain => {
            !hull::pass_as_one(&search.partials)
        }
        _ if uses_cones(options.method) => {
            !(0..search.states.len()).all(|cell| known(&search.states, cell))
        }
        _ => true,
    };
    if vectors {
        search.partials.prepare();
    }
    let partials = &search.partials;
    let whole = |cell| Failure {
        cell,
        part: [[0.0, 1.0]; D],
    };
    let smooth = partials.degree.iter().all(|&n| n >= 2);
    let after = std::array::from_fn(|r| std::array::from_fn(|c| crate::frame::unit_entry(r, c)));
    // What fails, and the theorem that comes with it if nothing does.
    let (failure, free) = match options.method {
        Method::Exact | Method::Paper => return judge_as_paper(lattice, options, search),
        Method::Phi => (phi::failing_cell(partials).map(whole), None),
        Method::Conic(hull) => {
            let known = |cell: usize| known(&search.states, cell);
            let failure = hull::test(partials, hull, &options.budget, known);
            let free = match hull {
                ConicHull {
                    one_for_all: true, ..
                } => Some(Theorem::CommonCones),
                ConicHull {
                    off_axis: false, ..
                } if smooth => Some(Theorem::PMatrix { after }),
                _ => None,
            };
            (failure, free)
        }
        Method::ChoiLee => (
            choi_lee::failing_cell(lattice, partials).map(whole),
            Some(Theorem::DisplacementBound),
        ),
    };
    let free = if lattice.grid().border() == Border::Identity {
        Some(Theorem::IdentityBorder)
    } else {
        free
    };
    let regular = failure.is_none();
    let outcome = match (failure, free) {
        (None, Some(theorem)) => Outcome::Injective(theorem),
        (None, None) => Outcome::LocallyInjective,
        (Some(Failure { cell, part }), _) => Outcome::Undecided(Undecided {
            cell,
            part,
            det: [f64::NEG_INFINITY, f64::INFINITY],
        }),
    };
    let low = if regular { 0.0 } else { f64::NEG_INFINITY };
    Verdict {
        map: Map::BSpline,
        method: options.method,
        outcome,
        min_det: [low, f64::INFINITY],
        irregular_cells: Vec::new(),
        doubtful_cells: Vec::new(),
        effort: Effort::default(),
    }
}

/// Whether a method needs to know which cells pass the conic-hull test.
pub(super) fn uses_cones(method: Method) -> bool {
    match method {
        Method::Exact => true,
        Method::Conic(hull) => !hull.one_for_all && !hull.off_axis,
        Method::Paper | Method::Phi | Method::ChoiLee => false,
    }
}

fn judge_as_paper<const D: usize>(
    lattice: &Lattice<D>,
    options: &CheckOptions,
    search: &mut Search<D>,
) -> Verdict<D> {
    let found = paper::test(lattice, search, &options.budget);
    search.effort.boxes += found.boxes;
    let regular = matches!(found.sign, Sign::Positive);
    let mut irregular_cells = Vec::new();
    let outcome = match found.sign {
        Sign::Positive => globally(lattice, options, search, false),
        Sign::Negative => Outcome::Reversed,
        Sign::Both { positive, negative } => {
            irregular_cells.push(negative.cell);
            Outcome::NotInjective(Evidence::BothSigns { positive, negative })
        }
        Sign::Zero { zero, reversed } => Outcome::Degenerate { zero, reversed },
        Sign::Undecided(undecided) => Outcome::Undecided(undecided),
    };
    let [low, high] = found.least;
    let low = if regular { low } else { f64::NEG_INFINITY };
    Verdict {
        map: Map::BSpline,
        method: options.method,
        outcome,
        min_det: search.partials.divide_by_frame([low, high]),
        irregular_cells,
        doubtful_cells: Vec::new(),
        effort: search.effort,
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{lattices, linear, noise};
    use super::*;
    use crate::{Degree, Frame, Grid};
    use proptest::prelude::*;

    fn conic(one_for_all: bool, subdivisions: u32, off_axis: bool) -> Method {
        Method::Conic(ConicHull {
            one_for_all,
            subdivisions,
            off_axis,
        })
    }

    fn check<const D: usize>(lattice: &Lattice<D>, method: Method) -> Verdict<D> {
        let mut options = CheckOptions {
            method,
            ..CheckOptions::default()
        };
        options.budget.boxes = 2000;
        lattice.check(&options)
    }

    fn methods() -> Vec<Method> {
        let mut methods = vec![Method::Phi, Method::ChoiLee];
        for subdivisions in [0, 1, 2] {
            for (one_for_all, off_axis) in
                [(false, false), (false, true), (true, false), (true, true)]
            {
                methods.push(conic(one_for_all, subdivisions, off_axis));
            }
        }
        methods
    }

    /// No method calls a map regular that is not.
    fn implies_regularity<const D: usize>(lattice: &Lattice<D>) -> Result<(), TestCaseError> {
        let exact = check(lattice, Method::Exact);
        // Maps with an overlap alone are regular.
        let overlap = matches!(
            exact.outcome,
            Outcome::NotInjective(Evidence::Overlap { .. })
        );
        for method in methods() {
            let verdict = check(lattice, method);
            prop_assert_eq!(verdict.method, method);
            if verdict.is_regular() {
                let regular = exact.is_regular() || overlap;
                prop_assert!(regular, "{:?} but {:?}", verdict, exact);
                prop_assert!(!(overlap && verdict.is_injective()));
                prop_assert!(verdict.min_det[0].to_bits() == 0 && verdict.min_det[1] > 1e300);
            } else {
                prop_assert!(matches!(verdict.outcome, Outcome::Undecided(_)));
            }
        }
        let order = [conic(true, 0, false), conic(false, 0, false), Method::Phi];
        let passed = order.map(|method| check(lattice, method).is_regular());
        prop_assert!(passed.is_sorted(), "{:?}", passed);
        Ok(())
    }

    /// The exact test of the paper never contradicts ours.
    fn agrees<const D: usize>(lattice: &Lattice<D>) -> Result<(), TestCaseError> {
        let (exact, paper) = (check(lattice, Method::Exact), check(lattice, Method::Paper));
        let undecided = |v: &Verdict<D>| matches!(v.outcome, Outcome::Undecided(_));
        if !undecided(&exact) && !undecided(&paper) {
            prop_assert_eq!(exact.is_regular(), paper.is_regular());
            let bad = |v: &Verdict<D>| matches!(v.outcome, Outcome::NotInjective(_));
            prop_assert_eq!(bad(&exact), bad(&paper));
        }
        let [low, high] = paper.min_det;
        prop_assert!(low <= exact.min_det[1] && exact.min_det[0] <= high);
        if let Outcome::NotInjective(Evidence::BothSigns { positive, negative }) = paper.outcome {
            prop_assert_eq!(paper.irregular_cells, [negative.cell]);
            // Where J jumps, its value is that of another cell.
            if is_smooth(lattice) {
                let at = |world| lattice.evaluate(world).map(|e| e.determinant);
                prop_assert!(at(positive.world).is_none_or(|d| d > -1e-9));
                prop_assert!(at(negative.world).is_none_or(|d| d < 1e-9));
            }
        }
        Ok(())
    }

    fn is_smooth<const D: usize>(lattice: &Lattice<D>) -> bool {
        lattice.grid().degree().iter().all(|n| n.get() >= 2)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// In the plane.
        #[test]
        fn sufficient_tests_imply_regularity_in_the_plane(lattice in lattices::<2>(5, 2, 1.0)) {
            implies_regularity(&lattice)?;
        }

        /// The exact tests agree.
        #[test]
        fn the_paper_agrees_in_the_plane(lattice in lattices::<2>(4, 2, 1.2)) {
            agrees(&lattice)?;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        /// In space.
        #[test]
        fn sufficient_tests_imply_regularity_in_space(lattice in lattices::<3>(3, 2, 0.8)) {
            implies_regularity(&lattice)?;
        }

        /// The exact tests agree.
        #[test]
        fn the_paper_agrees_in_space(lattice in lattices::<3>(2, 2, 1.0)) {
            agrees(&lattice)?;
        }
    }

    /// Each variant names the theorem that it deserves.
    #[test]
    fn theorems() {
        let smooth = linear(2, 2, [[1.1, 0.1, 0.0], [0.0, 0.9, 0.0], [0.1, 0.0, 1.0]]);
        let creased = linear(1, 2, [[1.1, 0.1, 0.0], [0.0, 0.9, 0.0], [0.1, 0.0, 1.0]]);
        let name =
            |lattice: &Lattice<3>, method| check(lattice, method).theorem().map(|t| t.name());
        for subdivisions in [0, 2] {
            for off_axis in [false, true] {
                let all = conic(true, subdivisions, off_axis);
                assert_eq!(name(&smooth, all), Some("common_cones"));
                assert_eq!(name(&creased, all), Some("common_cones"));
            }
            let on_axis = conic(false, subdivisions, false);
            assert_eq!(name(&smooth, on_axis), Some("p_matrix"));
            assert_eq!(name(&creased, on_axis), None);
            let off_axis = conic(false, subdivisions, true);
            assert_eq!(name(&smooth, off_axis), None);
            assert!(check(&smooth, off_axis).is_regular());
        }
        assert_eq!(name(&smooth, Method::Phi), None);
        assert!(check(&smooth, Method::Phi).is_regular());
        let little = noise(smooth.grid().clone(), 0.3, 7);
        assert_eq!(name(&little, Method::ChoiLee), Some("displacement_bound"));
        let more = noise(smooth.grid().clone(), 0.6, 7);
        assert_eq!(check(&more, Method::ChoiLee).outcome.name(), "undecided");
    }

    #[test]
    fn a_border_makes_regular_maps_injective() {
        let grid = Grid::new([Degree::CUBIC; 2], [3; 2], Frame::unit()).unwrap();
        let grid = grid.with_border(Border::Identity).unwrap();
        let lattice = noise(grid, 0.1, 3);
        for method in methods().into_iter().chain([Method::Paper]) {
            let verdict = check(&lattice, method);
            assert_eq!(
                verdict.theorem(),
                Some(Theorem::IdentityBorder),
                "{method:?}"
            );
        }
    }

    #[test]
    fn a_checker_follows_changes_with_every_method() {
        let grid = Grid::new([Degree::CUBIC; 2], [6, 4], Frame::unit()).unwrap();
        let rest = noise(grid, 0.05, 11);
        for method in methods().into_iter().chain([Method::Paper]) {
            let options = CheckOptions {
                method,
                ..CheckOptions::default()
            };
            let mut lattice = rest.clone();
            let mut checker = crate::Checker::new(&lattice, &options);
            assert!(checker.verdict().is_regular(), "{method:?}");
            for d in [[1.9, 0.3], [-0.05, 0.02]] {
                lattice.set_displacement(31, d).unwrap();
                let updated = checker.update(&lattice, &[31]).unwrap().clone();
                assert_eq!(updated, lattice.check(&options), "{method:?}");
            }
            assert!(checker.verdict().is_regular(), "{method:?}");
        }
    }

    #[test]
    fn huge_numbers_are_no_reason_to_panic() {
        let grid = Grid::new([Degree::QUADRATIC; 3], [2; 3], Frame::unit()).unwrap();
        for amplitude in [1e300, 1e160] {
            let lattice = noise(grid.clone(), amplitude, 5);
            for method in methods().into_iter().chain([Method::Paper]) {
                let verdict = check(&lattice, method);
                assert_eq!(verdict.outcome.name(), "undecided", "{method:?}");
            }
        }
    }
}
