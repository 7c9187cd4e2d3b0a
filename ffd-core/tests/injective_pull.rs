//! Direct manipulation in steps that do not fold, through the public interface.

#![expect(clippy::float_cmp, reason = "what must be equal is compared")]

#[path = "common/mod.rs"]
mod common;

use common::{at, each};
use ffd_core::{
    Border, Budget, CheckOptions, Constraint, Degree, DirectError, FfdError, Frame, Grid,
    InjectiveOptions, InjectivePull, Inverse, Knots, Outcome, Preimage, Scope, Sequence,
    StepPolicy, Stopped,
};
use proptest::prelude::*;

const POLICIES: [StepPolicy; 3] = [StepPolicy::Paper, StepPolicy::Exact, StepPolicy::Greedy];

fn with(policy: StepPolicy) -> InjectiveOptions<'static> {
    InjectiveOptions {
        policy,
        ..InjectiveOptions::default()
    }
}

fn cubic<const D: usize>(cells: usize) -> Grid<D> {
    Grid::new([Degree::CUBIC; D], [cells; D], Frame::unit()).unwrap()
}

fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    std::iter::zip(a, b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

/// What every pull has to keep, whatever became of it.
fn check_promises<const D: usize>(
    grid: &Grid<D>,
    constraints: &[Constraint<D>],
    pull: &InjectivePull<D>,
) -> Result<(), TestCaseError> {
    let steps = pull.sequence.lattices();
    prop_assert_eq!(steps.len(), pull.verdicts.len());
    prop_assert_eq!(steps.len(), pull.fractions.len());
    prop_assert_eq!(pull.stopped.is_none(), pull.achieved == 1.0);
    prop_assert!(pull.fractions.is_sorted_by(|a, b| a < b));
    // Regular, and so one-to-one on space, says the exact test of each step anew.
    prop_assert_eq!(pull.scope(), Scope::Space);
    for step in steps {
        prop_assert_eq!(step.grid().border(), Border::Identity);
        prop_assert!(step.check(&CheckOptions::default()).is_injective());
    }
    // Points are where they were promised to be: the lattice has a size of some cells.
    let longest_axis = |a: f64, b: [f64; D]| a.max(distance(b, [0.0; D]));
    let size = grid.frame().axes().into_iter().fold(0.0, longest_axis);
    for (i, constraint) in constraints.iter().enumerate() {
        prop_assert_eq!(pull.sequence.deform_point(constraint.point), pull.points[i]);
        let promised = std::array::from_fn(|c| {
            constraint.point[c] + pull.achieved * constraint.displacement[c]
        });
        let missed = distance(promised, pull.points[i]);
        prop_assert!(missed <= 1e-9 * size, "{i}: {missed:e}");
        let target: [f64; D] =
            std::array::from_fn(|c| constraint.point[c] + constraint.displacement[c]);
        let rest = std::array::from_fn(|c| target[c] - pull.points[i][c]);
        prop_assert_eq!(pull.residuals[i], rest);
    }
    Ok(())
}

/// By how much a point can be missed when the steps are undone: what [`ffd_core::Inverse`]
/// says of one lattice, `64 ε size max(1, ‖J⁻¹‖)`, and what is missed before, magnified by
/// `‖J⁻¹‖` (to first order; hence the last factor).
fn undo_bound<const D: usize>(sequence: &Sequence<D>, point: [f64; D]) -> f64 {
    let mut along = vec![point];
    for lattice in sequence.lattices() {
        along.push(lattice.deform_point(along[along.len() - 1]));
    }
    let mut bound = 0.0;
    for (lattice, &x) in sequence.lattices().iter().zip(&along).rev() {
        let there = lattice.evaluate(x);
        // With the singular values of J: 1 over the smallest is the product of the others
        // over the determinant.
        let inverse = there.map_or(1.0, |there| {
            let squares = there.jacobian.as_flattened().iter().map(|x| x * x);
            squares
                .sum::<f64>()
                .sqrt()
                .powi(i32::try_from(D).unwrap() - 1)
                / there.determinant
        });
        let size = Inverse::new(lattice).size();
        bound = (bound + 64.0 * f64::EPSILON * size) * inverse.max(1.0);
    }
    1.01 * bound
}

/// Images of a dense grid of points are all different, turn nothing inside out, and come
/// back when the steps are undone.
fn check_composition<const D: usize>(
    sequence: &Sequence<D>,
    grid: &Grid<D>,
    each_side: usize,
) -> Result<(), TestCaseError> {
    let total = each_side.pow(u32::try_from(D).unwrap());
    let mut images = Vec::with_capacity(total);
    for number in 0..total {
        let mut rest = number;
        let fractions = std::array::from_fn(|_| {
            let i = rest % each_side;
            rest /= each_side;
            (i as f64 + 0.5) / each_side as f64
        });
        let point = at(grid, fractions);
        let there = sequence.evaluate(point).unwrap();
        prop_assert!(there.determinant > 0.0, "{point:?}: {}", there.determinant);
        let back = sequence.inverse_point(there.position);
        let back = back.map_err(|error| TestCaseError::fail(error.to_string()))?;
        let Preimage::One(back) = back else {
            return Err(TestCaseError::fail(format!("{point:?}: {back:?}")));
        };
        let bound = undo_bound(sequence, point);
        let missed = distance(back, point);
        prop_assert!(missed <= bound, "{point:?}: {missed:e} > {bound:e}");
        images.push(there.position);
    }
    for (i, a) in images.iter().enumerate() {
        for b in &images[..i] {
            prop_assert!(distance(*a, *b) > 0.0);
        }
    }
    Ok(())
}

/// Points as fractions of the domain, and how many cells they are to move.
type Pulls<const D: usize> = Vec<([f64; D], [f64; D])>;

fn pulls<const D: usize>(most: usize) -> impl Strategy<Value = (Pulls<D>, Degree)> {
    let one = (each::<D, _>(0.3..0.7_f64), each::<D, _>(-1.5..=1.5_f64));
    let degree = (2_usize..=3).prop_map(|n| Degree::new(n).unwrap());
    (proptest::collection::vec(one, 1..=most), degree)
}

fn check_random<const D: usize>(
    pulls: &[([f64; D], [f64; D])],
    degree: Degree,
    each_side: usize,
) -> Result<(), TestCaseError> {
    let frame = common::frame();
    let grid = Grid::new([degree; D], [3; D], frame).unwrap();
    let constraints: Vec<_> = pulls
        .iter()
        .map(|&(place, cells)| {
            let here = grid.frame().to_world([0.0; D]);
            let there = grid.frame().to_world(cells);
            Constraint::new(
                at(&grid, place),
                std::array::from_fn(|c| there[c] - here[c]),
            )
        })
        .collect();
    for policy in POLICIES {
        let options = InjectiveOptions {
            depth: 6,
            ..with(policy)
        };
        let pull = match grid.injective_pull(&constraints, &options) {
            Ok(pull) => pull,
            // Points so close that not even a lattice that folds parts them.
            Err(DirectError::Inconsistent { .. }) => continue,
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        check_promises(&grid, &constraints, &pull)?;
        if policy == StepPolicy::Paper && pull.stopped.is_some() {
            prop_assert!(pull.sequence.lattices().is_empty() && pull.achieved == 0.0);
        } else {
            check_composition(&pull.sequence, &grid, each_side)?;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn pulls_in_the_plane_keep_their_promises((pulls, degree) in pulls::<2>(4)) {
        check_random(&pulls, degree, 12)?;
    }

    #[test]
    fn pulls_in_space_keep_their_promises((pulls, degree) in pulls::<3>(3)) {
        check_random(&pulls, degree, 5)?;
    }
}

/// Steps that a pull takes on 8 × 8 × 8 unit cells.
fn steps(policy: StepPolicy, constraints: &[Constraint<3>]) -> usize {
    let grid = cubic(8);
    let pull = grid.injective_pull(constraints, &with(policy)).unwrap();
    assert_eq!(pull.achieved, 1.0, "{policy:?}: {:?}", pull.stopped);
    check_promises(&grid, constraints, &pull).unwrap();
    pull.sequence.lattices().len()
}

/// \[GD01\], Fig. 3: over-extended, and over-constrained.
#[test]
fn long_pulls_and_close_points_take_few_steps() {
    let one = [Constraint::new([2.5, 4.5, 4.5], [3.0, 0.0, 0.0])];
    let pair = [
        Constraint::new([3.9, 4.0, 4.0], [-0.5, 0.0, 0.0]),
        Constraint::new([4.1, 4.0, 4.0], [0.5, 0.0, 0.0]),
    ];
    for policy in &POLICIES[1..] {
        assert!(steps(*policy, &one) <= 3);
        assert!(steps(*policy, &pair) <= 3);
    }
    assert!(steps(StepPolicy::Paper, &one) >= 4);
    assert!(steps(StepPolicy::Paper, &pair) >= 4);
}

#[test]
fn a_pull_that_folds_nothing_is_one_step() {
    let constraint = [Constraint::new([2.0, 2.0], [0.1, 0.05])];
    for policy in POLICIES {
        let grid = cubic(4);
        let pull = grid.injective_pull(&constraint, &with(policy)).unwrap();
        assert_eq!(pull.fractions, [1.0]);
        let mut lattice =
            ffd_core::Lattice::at_rest(grid.with_border(Border::Identity).unwrap()).unwrap();
        lattice
            .pull(&constraint, &ffd_core::PullOptions::default())
            .unwrap();
        assert_eq!(pull.sequence.lattices(), [lattice]);
    }
}

#[test]
fn constraints_that_cross_end_with_an_answer() {
    // Each point is to go where the other one is, and beyond.
    let crossing = [
        Constraint::new([3.5, 4.0], [1.5, 0.0]),
        Constraint::new([4.5, 4.0], [-1.5, 0.0]),
    ];
    let grid = cubic(8);
    for policy in POLICIES {
        let pull = grid.injective_pull(&crossing, &with(policy)).unwrap();
        check_promises(&grid, &crossing, &pull).unwrap();
        assert!(matches!(pull.stopped, Some(Stopped::Folds { .. })));
        if policy == StepPolicy::Paper {
            assert_eq!((pull.achieved, pull.sequence.lattices().len()), (0.0, 0));
        } else {
            // They would meet at a third of the way.
            assert!(0.3 < pull.achieved && pull.achieved < 1.0 / 3.0);
            assert!(pull.sequence.lattices().len() < 40);
            assert!(pull.points[0][0] < pull.points[1][0]);
        }
    }
}

#[test]
fn without_halving_a_fold_is_refused() {
    let far = [Constraint::new([2.0, 2.0], [3.0, 0.0])];
    for policy in POLICIES {
        let options = InjectiveOptions {
            depth: 0,
            ..with(policy)
        };
        let pull = cubic(4).injective_pull(&far, &options).unwrap();
        assert_eq!((pull.achieved, pull.largest_residual()), (0.0, 3.0));
        let Some(Stopped::Folds { verdict }) = pull.stopped else {
            panic!("{:?}", pull.stopped);
        };
        let folds = matches!(verdict.outcome, Outcome::NotInjective(_));
        assert_eq!(folds, policy != StepPolicy::Paper);
    }
}

#[test]
fn points_do_not_leave_the_lattice() {
    // The domain ends 3 cells beyond the lattice's own: at 7.
    let far = [Constraint::new([2.0, 2.0], [20.0, 0.0])];
    let pull = cubic(4)
        .injective_pull(&far, &with(StepPolicy::Exact))
        .unwrap();
    assert!(pull.stopped.is_some() && 0.1 < pull.achieved && pull.achieved < 0.25);
    assert!(pull.points[0][0] < 7.0);
}

#[test]
fn nothing_to_do_is_nothing_done() {
    let stay = [Constraint::new([1.0, 1.0], [0.0, 0.0])];
    for constraints in [&stay[..], &[]] {
        for policy in POLICIES {
            let pull = cubic::<2>(2)
                .injective_pull(constraints, &with(policy))
                .unwrap();
            assert!(pull.sequence.lattices().is_empty() && pull.stopped.is_none());
            assert_eq!((pull.achieved, pull.scope()), (1.0, Scope::Space));
        }
    }
}

#[test]
fn free_borders_say_what_is_proven() {
    let grid = cubic::<2>(6);
    let free = InjectiveOptions {
        border: Border::Free,
        ..InjectiveOptions::default()
    };
    let small = [Constraint::new([3.0, 3.0], [0.2, 0.0])];
    let pull = grid.injective_pull(&small, &free).unwrap();
    assert_eq!(pull.sequence.lattices()[0].grid(), &grid);
    assert_eq!(pull.scope(), Scope::EachStep);
    assert!(pull.verdicts.iter().all(|verdict| verdict.is_regular()));
}

#[test]
fn bad_input_is_refused() {
    let pull = |grid: &Grid<2>, constraints: &[Constraint<2>]| {
        grid.injective_pull(constraints, &InjectiveOptions::default())
            .unwrap_err()
    };
    let grid = cubic(3);
    let outside = pull(&grid, &[Constraint::new([9.0, 1.0], [0.0, 0.0])]);
    assert!(matches!(
        outside,
        DirectError::PointOutside { constraint: 0, .. }
    ));
    let nan = pull(&grid, &[Constraint::new([1.0, 1.0], [f64::NAN, 0.0])]);
    assert!(matches!(
        nan,
        DirectError::NonFiniteDisplacement { constraint: 0, .. }
    ));
    let torn = pull(
        &grid,
        &[
            Constraint::new([1.0, 1.0], [1.0, 0.0]),
            Constraint::new([1.0, 1.0], [-1.0, 0.0]),
        ],
    );
    assert!(matches!(torn, DirectError::Inconsistent { .. }));
    let clamped = grid.with_knots([Knots::Clamped; 2]).unwrap();
    let clamped = pull(&clamped, &[Constraint::new([1.0, 1.0], [0.1, 0.0])]);
    assert_eq!(
        clamped,
        DirectError::Lattice(FfdError::ClampedBorder { axis: 0 })
    );
}

/// A step that is not decided is not taken.
#[test]
fn undecided_steps_are_not_taken() {
    let options = InjectiveOptions {
        budget: Budget {
            boxes: 0,
            exact_boxes: 0,
        },
        ..InjectiveOptions::default()
    };
    let grid = cubic::<2>(4);
    let far = [Constraint::new([2.0, 2.0], [2.0, 1.0])];
    let pull = grid.injective_pull(&far, &options).unwrap();
    check_promises(&grid, &far, &pull).unwrap();
}

#[cfg(feature = "serde")]
#[test]
fn sequences_survive_files_bit_for_bit() {
    let far = [Constraint::new([2.1, 1.9, 2.3], [2.0, 1.0, -0.7])];
    let pull = cubic(4)
        .injective_pull(&far, &InjectiveOptions::default())
        .unwrap();
    assert!(pull.sequence.lattices().len() > 1);
    let text = serde_json::to_string(&pull.sequence).unwrap();
    let read: Sequence<3> = serde_json::from_str(&text).unwrap();
    let bits = |s: &Sequence<3>| -> Vec<u64> {
        let all = s.lattices().iter().flat_map(|l| l.displacements());
        all.flatten().map(|x| x.to_bits()).collect()
    };
    assert_eq!(bits(&read), bits(&pull.sequence));
    assert_eq!(read, pull.sequence);
}
