//! The strategies for users keep what they promise, and shrink to what is simple.

use crate::claims::{Judge, methods};
use crate::oracle::{Oracle, Signs};
use ffd_core::strategies::{
    Class, Frames, GridOptions, Known, degenerate, folded, grids, injective, known, lattices,
    near_limit, overlapping, reversed,
};
use ffd_core::{Border, CheckOptions, Frame, Grid, Knots, Lattice, Method, Outcome};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};

/// Parts into which the oracle may cut a cell.
const BOXES: usize = 400;

/// The same cases each time. Hardly any numbers are drawn in vain.
fn runner(cases: u32) -> TestRunner {
    let config = Config {
        cases,
        max_local_rejects: 2 + cases / 10,
        failure_persistence: None,
        ..Config::default()
    };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// In space the oracle takes seconds for high degrees.
fn low_degrees() -> GridOptions {
    GridOptions {
        degrees: [1, 2],
        ..GridOptions::default()
    }
}

/// A class is that of exact arithmetic, and of the crate's own test.
fn check_class<const D: usize>(
    lattice: &Lattice<D>,
    class: Class,
) -> Result<&'static str, TestCaseError> {
    let signs = Judge::new(lattice, BOXES).signs();
    let right = match class {
        Class::Injective | Class::Regular | Class::Overlapping => signs.only_positive(),
        Class::Degenerate => signs.zero && !signs.negative && !signs.open,
        Class::Folded => signs.both(),
        Class::Reversed => {
            signs
                == Signs {
                    negative: true,
                    ..Signs::default()
                }
        }
        _ => false,
    };
    prop_assert!(right, "{class:?}: {signs:?}");
    let outcome = lattice.check(&CheckOptions::default()).outcome;
    prop_assert!(class.allows(&outcome), "{class:?}: {outcome:?}");
    Ok(outcome.name())
}

/// Cases of a strategy; and what the crate's own test says of them.
fn check_all<const D: usize>(
    cases: u32,
    strategy: impl Strategy<Value = (Lattice<D>, Class)>,
) -> Vec<&'static str> {
    let names = std::cell::RefCell::new(Vec::new());
    let outcome = runner(cases).run(&strategy, |(lattice, class)| {
        let name = check_class(&lattice, class)?;
        names.borrow_mut().push(name);
        Ok(())
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
    names.into_inner()
}

fn of<const D: usize>(class: Class) -> impl Fn(Lattice<D>) -> (Lattice<D>, Class) + Clone {
    move |lattice| (lattice, class)
}

fn pair<const D: usize>(known: Known<D>) -> (Lattice<D>, Class) {
    (known.lattice, known.class)
}

/// How many of the names are `name`.
fn count(names: &[&str], name: &str) -> usize {
    names.iter().filter(|&&n| n == name).count()
}

#[test]
fn injective_lattices_are_injective() {
    let any = GridOptions::default();
    let strategy = injective::<2>(any).prop_map(of(Class::Injective));
    let names = check_all(150, strategy);
    assert!(count(&names, "injective") >= 140, "{names:?}");
    let strategy = injective::<3>(low_degrees()).prop_map(of(Class::Injective));
    check_all(40, strategy);
}

#[test]
fn reversed_lattices_are_reversed() {
    let strategy = reversed::<2>(GridOptions::default()).prop_map(of(Class::Reversed));
    let names = check_all(150, strategy);
    assert_eq!(count(&names, "reversed"), 150);
    let strategy = reversed::<3>(low_degrees()).prop_map(of(Class::Reversed));
    check_all(40, strategy);
}

#[test]
fn folded_lattices_are_folded() {
    let names = check_all(
        150,
        folded::<2>(GridOptions::default()).prop_map(of(Class::Folded)),
    );
    assert_eq!(count(&names, "not_injective"), 150);
    check_all(40, folded::<3>(low_degrees()).prop_map(of(Class::Folded)));
}

#[test]
fn degenerate_lattices_touch_zero() {
    let any = GridOptions::default();
    let names = check_all(200, degenerate::<2>(any).prop_map(of(Class::Degenerate)));
    assert_eq!(count(&names, "degenerate"), 200);
    check_all(
        50,
        degenerate::<3>(low_degrees()).prop_map(of(Class::Degenerate)),
    );
    let cubic = GridOptions {
        cells: [1, 1],
        degrees: [3, 3],
        ..any
    };
    check_all(20, degenerate::<3>(cubic).prop_map(of(Class::Degenerate)));
}

#[test]
fn lattices_near_the_limit_are_what_they_are_called() {
    let names = check_all(
        150,
        near_limit::<2>(GridOptions::default(), 1e-3).prop_map(pair),
    );
    // About as many on either side.
    let folded = count(&names, "not_injective");
    assert!((50..100).contains(&folded), "{names:?}");
    assert_eq!(count(&names, "undecided"), 0);
    check_all(40, near_limit::<3>(low_degrees(), 1e-6).prop_map(pair));
}

/// On the other side of the limit, by the gap, the class is another.
#[test]
fn the_limit_is_near() {
    for gap in [0.5, 1e-2, 1e-7] {
        let strategy = near_limit::<2>(GridOptions::default(), gap);
        let outcome = runner(30).run(&strategy, |known| {
            let factor = match known.class {
                Class::Folded => (1.0 + gap).powi(-2),
                _ => 1.0 + gap,
            };
            // The regular side of a folded lattice, or the other of a regular one, lies
            // between: the interval is known to contain a change.
            let changes = (0..=64).any(|step| {
                let part = 1.0 + (factor - 1.0) * f64::from(step) / 64.0;
                let scaled = crate::families::scaled(&known.lattice, part);
                let verdict = scaled.check(&CheckOptions::default());
                verdict.is_regular() != known.class.is_regular()
            });
            prop_assert!(changes, "{known:?}");
            Ok(())
        });
        if let Err(error) = outcome {
            panic!("{gap}: {error}");
        }
    }
}

/// Strips overlap exactly, where they are once round apart.
fn check_overlaps<const D: usize>(cases: u32, options: GridOptions) {
    let outcome = runner(cases).run(&overlapping::<D>(options), |lattice| {
        let name = check_class(&lattice, Class::Overlapping)?;
        prop_assert!(
            ["locally_injective", "not_injective"].contains(&name),
            "{name}"
        );
        let oracle = Oracle::new(&lattice);
        let along = (0..D)
            .max_by_key(|&axis| oracle.cells[axis])
            .expect("an axis");
        let start = oracle.image([0; D], [0.5; D]);
        let meets = (1..oracle.cells[along]).any(|cell| {
            let mut far = [0; D];
            far[along] = cell;
            oracle.image(far, [0.5; D]) == start
        });
        prop_assert!(meets);
        Ok(())
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
}

#[test]
fn overlapping_lattices_overlap() {
    check_overlaps::<2>(100, GridOptions::default());
    check_overlaps::<3>(10, low_degrees());
    // The steepest there are.
    for [along, across] in [[5, 5], [5, 1], [1, 5]] {
        let options = GridOptions {
            degrees: [along.min(across), along.max(across)],
            ..GridOptions::default()
        };
        check_overlaps::<2>(30, options);
    }
}

#[test]
fn all_classes_are_known() {
    let names = check_all(120, known::<2>(GridOptions::default()).prop_map(pair));
    for name in ["injective", "degenerate", "reversed", "not_injective"] {
        assert!(count(&names, name) >= 5, "{name}: {names:?}");
    }
}

/// No method contradicts what is known, in the plane and in space.
fn check_methods<const D: usize>(cases: u32, options: GridOptions) {
    let outcome = runner(cases).run(&known::<D>(options), |known| {
        for method in methods() {
            // It takes a millisecond a cell in space, optimised.
            if D == 3 && method == Method::Paper {
                continue;
            }
            let check = CheckOptions {
                method,
                ..CheckOptions::default()
            };
            let outcome = known.lattice.check(&check).outcome;
            prop_assert!(known.class.allows(&outcome), "{method:?}: {outcome:?}");
        }
        Ok(())
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
}

#[test]
fn no_method_contradicts_what_is_known() {
    check_methods::<2>(150, GridOptions::default());
    let cheap = GridOptions {
        degrees: [1, 3],
        ..GridOptions::default()
    };
    check_methods::<3>(100, cheap);
}

/// Cutting cells changes nothing but the last digits, which matter only where the
/// determinant touches zero.
#[test]
fn refined_lattices_are_of_the_same_class() {
    fn check<const D: usize>(cases: u32, options: GridOptions, factors: [usize; D]) {
        let outcome = runner(cases).run(&known::<D>(options), |known| {
            if known.class == Class::Degenerate {
                return Ok(());
            }
            let refined = known.lattice.refine(factors).expect("a small lattice");
            let [coarse, fine] =
                [&known.lattice, &refined].map(|lattice| lattice.check(&CheckOptions::default()));
            prop_assert!(known.class.allows(&fine.outcome), "{fine:?}");
            prop_assert_eq!(coarse.is_regular(), fine.is_regular());
            Ok(())
        });
        if let Err(error) = outcome {
            panic!("{error}");
        }
    }
    check::<2>(150, GridOptions::default(), [2, 3]);
    check::<3>(60, low_degrees(), [1, 2, 2]);
}

#[test]
fn seeds_determine_lattices() {
    let draw = || {
        let mut runner = runner(1);
        let strategy = known::<3>(GridOptions::default());
        let mut one = || strategy.new_tree(&mut runner).unwrap().current();
        [(); 10].map(|()| one())
    };
    assert_eq!(draw(), draw());
}

/// What options ask for is what grids have, and all of it.
#[test]
fn options_are_honoured() {
    let options = GridOptions {
        cells: [2, 3],
        degrees: [2, 4],
        knots: Some(Knots::Clamped),
        border: None,
        frames: Frames::Scaled,
    };
    let (mut cells, mut degrees) = ([0; 10], [0; 10]);
    let mut runner = runner(1);
    let strategy = lattices::<3>(options, 0.25);
    for _ in 0..200 {
        let lattice = strategy.new_tree(&mut runner).unwrap().current();
        let grid = lattice.grid();
        assert_eq!(
            (grid.knots(), grid.border()),
            ([Knots::Clamped; 3], Border::Free)
        );
        for axis in 0..3 {
            cells[grid.cells()[axis]] += 1;
            degrees[grid.degree()[axis].get()] += 1;
            let vector = grid.frame().axes()[axis];
            assert!((0..3).all(|c| (vector[c] > 0.0) == (c == axis)));
        }
        for d in lattice.displacements() {
            let inverse = grid.frame().inverse();
            assert!((0..3).all(|i| (inverse[i][i] * d[i]).abs() <= 0.25));
        }
    }
    assert!(cells[2] > 200 && cells[3] > 200 && cells.iter().sum::<i32>() == 600);
    assert!(degrees[2..5].iter().all(|&n| n > 150) && degrees.iter().sum::<i32>() == 600);

    // All kinds, where nothing is asked for.
    let mut seen = std::collections::BTreeSet::new();
    let strategy = grids::<2>(GridOptions::default());
    for _ in 0..200 {
        let grid = strategy.new_tree(&mut runner).unwrap().current();
        let clamped = grid.knots().map(|knots| knots == Knots::Clamped);
        let is_unit = *grid.frame() == Frame::unit();
        seen.insert((clamped, grid.border() == Border::Identity, is_unit));
    }
    // Four kinds of knots, or a border; in two kinds of frames.
    assert_eq!(seen.len(), 10, "{seen:?}");
    let bordered = GridOptions {
        border: Some(Border::Identity),
        ..GridOptions::default()
    };
    let grid = grids::<3>(bordered)
        .new_tree(&mut runner)
        .unwrap()
        .current();
    assert_eq!(grid.border(), Border::Identity);
}

#[test]
fn impossible_options_are_refused() {
    let any = GridOptions::default();
    let refused = |options: GridOptions, message: &str| {
        let mut runner = runner(1);
        for reason in [
            grids::<2>(options).new_tree(&mut runner).map(|_| ()),
            known::<3>(options).new_tree(&mut runner).map(|_| ()),
        ] {
            assert_eq!(reason.unwrap_err().message(), message);
        }
    };
    let cells = "cells: from 1 to 33 is no range between 1 and 32";
    refused(
        GridOptions {
            cells: [1, 33],
            ..any
        },
        cells,
    );
    let cells = "cells: from 0 to 2 is no range between 1 and 32";
    refused(
        GridOptions {
            cells: [0, 2],
            ..any
        },
        cells,
    );
    let degrees = "degrees: from 3 to 2 is no range between 1 and 5";
    refused(
        GridOptions {
            degrees: [3, 2],
            ..any
        },
        degrees,
    );
    let degrees = "degrees: from 1 to 6 is no range between 1 and 5";
    refused(
        GridOptions {
            degrees: [1, 6],
            ..any
        },
        degrees,
    );
    let both = GridOptions {
        knots: Some(Knots::Clamped),
        border: Some(Border::Identity),
        ..any
    };
    refused(both, "an identity border needs uniform knots");
    assert!(
        lattices::<2>(any, f64::NAN)
            .new_tree(&mut runner(1))
            .is_err()
    );
    assert!(near_limit::<2>(any, 0.0).new_tree(&mut runner(1)).is_err());
    // Thirds cannot be without rounding.
    let thirds = GridOptions {
        degrees: [3, 3],
        knots: Some(Knots::Clamped),
        ..any
    };
    assert!(degenerate::<2>(thirds).new_tree(&mut runner(1)).is_err());
}

/// The smallest lattice that refutes a claim.
fn smallest<T: std::fmt::Debug>(
    strategy: &impl Strategy<Value = T>,
    claim: impl Fn(&T) -> bool,
) -> T {
    let outcome = runner(256).run(strategy, |value| {
        prop_assert!(claim(&value));
        Ok(())
    });
    match outcome {
        Err(TestError::Fail(_, value)) => value,
        other => panic!("not refuted: {other:?}"),
    }
}

/// One cell in the unit frame, of the lowest degree, with this many control points moved.
fn check_simple<const D: usize>(lattice: &Lattice<D>, moved: usize) {
    let grid = lattice.grid();
    assert_eq!(grid.cells(), [1; D], "{lattice:?}");
    assert_eq!(*grid.frame(), Frame::unit(), "{lattice:?}");
    assert_eq!(grid.border(), Border::Free);
    assert_eq!(grid.knots(), [Knots::Uniform; D], "{lattice:?}");
    let displacements = lattice.displacements().iter();
    let count = displacements.filter(|&&d| d != [0.0; D]).count();
    assert!(count <= moved, "{lattice:?}");
}

#[test]
fn what_folds_shrinks_to_one_pull() {
    // "No lattice folds."
    let options = GridOptions::default();
    let regular = |lattice: &Lattice<2>| lattice.check(&CheckOptions::default()).is_regular();
    let lattice = smallest(&lattices::<2>(options, 2.0), regular);
    check_simple(&lattice, 1);
    let lattice = smallest(&folded::<2>(options), |_| false);
    check_simple(&lattice, 1);
    let lattice = smallest(&near_limit::<2>(options, 1e-3), |known| {
        known.class.is_regular()
    });
    assert_eq!(lattice.class, Class::Folded);
    check_simple(&lattice.lattice, 1);
    let lattice = smallest(&lattices::<3>(options, 2.0), |lattice: &Lattice<3>| {
        lattice.check(&CheckOptions::default()).is_regular()
    });
    check_simple(&lattice, 1);
}

/// What is not due to a single control point keeps those it is due to.
#[test]
fn shrinking_keeps_what_matters() {
    let apart = |lattice: &Lattice<2>| {
        let d = lattice.displacements();
        let moved: Vec<_> = d.iter().filter(|d| d[0].abs() > 0.75).collect();
        moved.len() < 2
    };
    let lattice = smallest(&lattices::<2>(GridOptions::default(), 1.0), apart);
    check_simple(&lattice, 2);
    for d in lattice.displacements() {
        assert!(
            *d == [0.0; 2] || (d[0].abs() <= 1.0 && d[1] == 0.0),
            "{d:?}"
        );
    }
    // Nor is a class left.
    let lattice = smallest(&degenerate::<2>(GridOptions::default()), |_| false);
    let outcome = lattice.check(&CheckOptions::default()).outcome;
    assert!(matches!(outcome, Outcome::Degenerate { .. }), "{outcome:?}");
    assert_eq!(lattice.grid().cells(), [1, 1]);
    let lattice = smallest(&overlapping::<2>(GridOptions::default()), |_| false);
    assert_eq!(lattice.grid().cells(), [9, 1]);
    let lattice = smallest(&reversed::<2>(GridOptions::default()), |_| false);
    assert_eq!(lattice.deform_point([0.25, 0.5]), [-0.25, 0.5]);
    let lattice = smallest(&injective::<2>(GridOptions::default()), |_| false);
    check_simple(&lattice, 0);
}

/// A claim about grids is refuted by the smallest grid.
#[test]
fn grids_shrink_to_the_smallest() {
    let options = GridOptions {
        cells: [1, 5],
        ..GridOptions::default()
    };
    let grid: Grid<3> = smallest(&grids(options), |grid| {
        grid.cells()[1] < 3 || grid.degree()[2].get() < 2
    });
    assert_eq!(grid.cells(), [1, 3, 1]);
    assert_eq!(grid.degree().map(|n| n.get()), [1, 1, 2]);
    assert_eq!(*grid.frame(), Frame::unit());
}
