//! Laws for any lattice and any points.

use super::*;

/// A grid, fractions of its domain where points are, and a displacement for each.
type Pulled<const D: usize> = (Lattice<D>, Vec<([f64; D], [f64; D])>);

fn pulled<const D: usize>(most_cells: usize, most: usize) -> impl Strategy<Value = Pulled<D>> {
    let one = (each::<D, _>(0.02..0.98_f64), each::<D, _>(-1.0..=1.0_f64));
    (
        lattice(most_cells, 1.0),
        proptest::collection::vec(one, 1..=most),
    )
}

/// The image of each point moves by its displacement from where it was, and the change
/// is the smallest one that does it.
fn check_exact<const D: usize>((lattice, pulls): Pulled<D>) -> Result<(), TestCaseError> {
    let grid = lattice.grid();
    let points: Vec<_> = pulls.iter().map(|p| at(grid, p.0)).collect();
    let displacements: Vec<_> = pulls.iter().map(|p| p.1).collect();
    let largest = longest(&displacements);
    prop_assume!(largest > 0.1);

    let mut after = lattice.clone();
    let constraints = constraints(&points, &displacements);
    let result = after.pull(&constraints, &PullOptions::default());

    let mut scaled = basis_matrix(grid, &points, &[]);
    let mut scaled_displacements = dense(&displacements);
    for row in 0..points.len() {
        let norm = scaled.row(row).norm();
        if norm < 1e-12 {
            let refused = matches!(result, Err(DirectError::Unreachable { .. }));
            prop_assert!(refused, "{result:?}");
            return Ok(());
        }
        scaled.row_mut(row).scale_mut(1.0 / norm);
        scaled_displacements.row_mut(row).scale_mut(1.0 / norm);
    }
    let (inverse, condition) = pseudoinverse(&scaled);
    let expected = &inverse * &scaled_displacements;
    // Control points that move 300 times as far as points cost 300 ε of the largest
    // displacement, a few times: below 1e-12. Each of 30 rows of norm 1 may depend on
    // the others; with a condition below 1e4, rounding of their products is repaired.
    let easy = points.len() <= scaled.ncols() && condition < 1e4 && expected.amax() < 300.0;
    let met = (&scaled * &expected - &scaled_displacements).amax() < 1e-9;
    let pull = match result {
        Ok(pull) => pull,
        Err(error) => {
            let named = matches!(error, DirectError::Inconsistent { .. });
            prop_assert!(named && !(easy && met), "{error} {condition}");
            prop_assert_eq!(after, lattice);
            return Ok(());
        }
    };
    prop_assert!(pull.largest_residual <= 1e-12 * largest);
    prop_assert!(pull.merged.is_empty());

    let change = |i: usize| -> [f64; D] {
        let (a, b) = (after.displacements()[i], lattice.displacements()[i]);
        std::array::from_fn(|c| a[c] - b[c])
    };
    let changes: Vec<_> = (0..grid.control_point_count()).map(change).collect();
    // Residuals count displacements alone. Images are below 40 and rounded; in their
    // displacements each of two sums has 130 roundings at the size of control points'
    // displacements, which are rounded as well when they are added.
    let size = 40.0 + 300.0 * (1.0 + longest(&changes));
    let tolerance = 1e-12 * largest + size * f64::EPSILON;
    for (&point, displacement) in points.iter().zip(&displacements) {
        let (there, before) = (after.deform_point(point), lattice.deform_point(point));
        for c in 0..D {
            let error = there[c] - before[c] - displacement[c];
            prop_assert!(error.abs() <= tolerance, "{error}");
        }
    }

    // `changes` is a difference of displacements up to 1, which rounds; and errors of
    // 1e-14 (1e-12 at worst) in a combination of rows are enlarged by the condition.
    if condition < 1e4 {
        let changes = dense(&changes);
        let size = expected.norm() + 1.0;
        let tolerance = 1e-12 * condition * size;
        let error = (&changes - &expected).norm();
        prop_assert!(
            error <= tolerance,
            "{error} of {size}, condition {condition}"
        );
        // Orthogonal to all that moves no point, so that adding it can only lengthen.
        let mut next = numbers();
        let other = DMatrix::from_fn(changes.nrows(), D, |_, _| next() - 0.5);
        let unseen = &other - &inverse * (&scaled * &other);
        let product = changes.dot(&unseen).abs();
        prop_assert!(product <= tolerance * other.norm(), "{product} of {size}");
    }
    Ok(())
}

/// Least squares gives the weighted pseudoinverse solution, damping the closed form.
fn check_soft<const D: usize>(
    grid: Grid<D>,
    pulls: &[([f64; D], [f64; D], f64)],
    damping: Option<f64>,
) -> Result<(), TestCaseError> {
    let points: Vec<_> = pulls.iter().map(|p| at(&grid, p.0)).collect();
    let displacements: Vec<_> = pulls.iter().map(|p| p.1).collect();
    let weights: Vec<_> = pulls.iter().map(|p| p.2).collect();
    let fit = damping.map_or(Fit::LeastSquares, |damping| Fit::Damped { damping });
    let options = PullOptions { fit, fixed: &[0] };
    let mut manipulation =
        DirectManipulation::with_weights(&grid, &points, &weights, &options).unwrap();
    let mut changes = vec![[f64::NAN; D]; grid.control_point_count()];
    let left = manipulation
        .solve_into(&displacements, &mut changes)
        .unwrap();

    let roots = DVector::from_iterator(weights.len(), weights.iter().map(|w| w.sqrt()));
    let basis = basis_matrix(&grid, &points, &[0]);
    let weighted = DMatrix::from_diagonal(&roots) * &basis;
    let target = DMatrix::from_diagonal(&roots) * dense(&displacements);
    let changes = dense(&changes);
    let residuals = dense(&displacements) - &basis * &changes;
    let found = dense(manipulation.residuals());
    prop_assert!((&residuals - found).amax() <= 1e-12 * (1.0 + changes.norm()));
    prop_assert!((longest(manipulation.residuals()) - left).abs() <= 1e-12 * left);
    prop_assert!(changes.row(0).iter().all(|&c| c.to_bits() == 0));

    // The gradient of what is made small vanishes, up to rounding of its terms and to
    // what would need control points to move 1e10 times as far as points.
    let gradient =
        weighted.transpose() * (&target - &weighted * &changes) - damping.unwrap_or(0.0) * &changes;
    let norm = weighted.norm();
    let tolerance = norm * (1e-12 * norm * changes.norm() + 1e-10 * target.norm());
    prop_assert!(gradient.norm() <= tolerance, "{}", gradient.norm());

    let (inverse, condition) = pseudoinverse(&weighted);
    if condition.is_nan() || condition > 1e4 {
        // Least squares may leave combinations over, and errors of products show: the
        // square of the condition times 1e-16.
        return Ok(());
    }
    let largest = weighted.singular_values().max();
    let expected = match damping {
        None => inverse * &target,
        Some(damping) => {
            // The least squares solution with equations √damping · x = 0 added.
            let (rows, columns) = weighted.shape();
            let mut stacked = weighted.clone().resize(rows + columns, columns, 0.0);
            for i in 0..columns {
                stacked[(rows + i, i)] = damping.sqrt();
            }
            pseudoinverse(&stacked).0.columns(0, rows) * &target
        }
    };
    // What cannot be met is enlarged by the inverse of the damping: see `Fit::Damped`.
    let enlarged = damping.map_or(0.0, |damping| (largest * largest / damping).min(1e10));
    let accuracy = (1e-13 * condition * condition)
        .max(1e-14 * enlarged)
        .max(1e-11);
    let size = expected.norm() + target.norm() * condition / largest;
    let error = (&changes - &expected).norm();
    prop_assert!(
        error <= accuracy * size,
        "{error} of {size}, condition {condition}"
    );
    Ok(())
}

fn soft<const D: usize>() -> impl Strategy<Value = Vec<([f64; D], [f64; D], f64)>> {
    let one = (
        each::<D, _>(0.02..0.98_f64),
        each::<D, _>(-1.0..=1.0_f64),
        0.1..10.0_f64,
    );
    proptest::collection::vec(one, 1..40)
}

proptest! {
    #[test]
    fn constraints_are_met_by_the_smallest_change_2d(pulled in pulled::<2>(4, 12)) {
        check_exact(pulled)?;
    }

    #[test]
    fn constraints_are_met_by_the_smallest_change_3d(pulled in pulled::<3>(3, 30)) {
        check_exact(pulled)?;
    }

    #[test]
    fn least_squares_is_the_weighted_pseudoinverse_2d(grid in grid::<2>(3), pulls in soft()) {
        check_soft(grid, &pulls, None)?;
    }

    #[test]
    fn least_squares_is_the_weighted_pseudoinverse_3d(grid in grid::<3>(2), pulls in soft()) {
        check_soft(grid, &pulls, None)?;
    }

    #[test]
    fn damping_has_a_closed_form(
        grid in grid::<2>(3),
        pulls in soft(),
        exponent in -8.0..2.0_f64,
    ) {
        check_soft(grid, &pulls, Some(10_f64.powf(exponent)))?;
    }

    /// One constraint spreads over control points in proportion to their basis
    /// functions: ΔPᵢ = Bᵢ ΔF / Σ B².
    #[test]
    fn one_constraint_has_a_closed_form(
        grid in grid::<3>(4),
        fractions in each::<3, _>(0.1..0.9_f64),
        displacement in each::<3, _>(-1.0..=1.0_f64),
    ) {
        let point = at(&grid, fractions);
        let changes = solve(&grid, &[point], &[displacement], &PullOptions::default()).unwrap();
        let basis = basis_matrix(&grid, &[point], &[]);
        let squares = basis.norm_squared();
        for (change, &weight) in changes.iter().zip(&basis) {
            for c in 0..3 {
                let expected = weight * displacement[c] / squares;
                // A weight has 90 roundings, as does the sum of squares at worst. They
                // are relative: all terms are positive.
                let tolerance = 300.0 * f64::EPSILON * expected.abs();
                prop_assert!((change[c] - expected).abs() <= tolerance);
            }
        }
    }

    /// Fixed control points stay, and constraints hold without them.
    #[test]
    fn fixed_control_points_do_not_move(
        grid in grid::<2>(4),
        fractions in proptest::collection::vec(each::<2, _>(0.2..0.8_f64), 1..4),
        fixed in proptest::collection::vec(any::<prop::sample::Index>(), 0..6),
    ) {
        let points: Vec<_> = fractions.iter().map(|&f| at(&grid, f)).collect();
        let displacements = some_displacements(points.len());
        let count = grid.control_point_count();
        let fixed: Vec<_> = fixed.iter().map(|i| i.index(count)).collect();
        let options = PullOptions { fixed: &fixed, ..PullOptions::default() };
        let basis = basis_matrix(&grid, &points, &fixed);
        let changes = match solve(&grid, &points, &displacements, &options) {
            Ok(changes) => changes,
            Err(DirectError::Unreachable { constraint, factor }) => {
                prop_assert!((basis.row(constraint).norm() * factor - 1.0).abs() < 1e-9
                    || factor.is_infinite());
                return Ok(());
            }
            Err(error) => {
                let inconsistent = matches!(error, DirectError::Inconsistent { .. });
                prop_assert!(inconsistent, "{error}");
                // Few control points left, or points close to each other.
                let mut scaled = basis.clone();
                for mut row in scaled.row_iter_mut() {
                    let norm = row.norm();
                    row /= norm;
                }
                prop_assert!(scaled.singular_values().min() < 0.02 || basis.row_iter().any(|r| r.norm() < 0.02));
                return Ok(());
            }
        };
        for &i in &fixed {
            prop_assert_eq!(changes[i], [0.0; 2]);
        }
        let error = (basis * dense(&changes) - dense(&displacements)).amax();
        let tolerance = 2e-12 + 300.0 * f64::EPSILON * longest(&changes);
        prop_assert!(error <= tolerance, "{error}");
    }

    /// The order of constraints makes a difference of rounding only.
    #[test]
    fn order_does_not_matter(count in prop_oneof![2..20_usize, 129..200_usize], turn in 1..100_usize) {
        let grid = cubic::<3>(6);
        let mut points = scattered(&grid, count, 0.0, 1.0);
        let mut displacements = some_displacements(count);
        let options = PullOptions::default();
        let expected = solve(&grid, &points, &displacements, &options).unwrap();
        points.rotate_left(turn % count);
        displacements.rotate_left(turn % count);
        let found = solve(&grid, &points, &displacements, &options).unwrap();
        // Both are refined to 1e-14 of the displacements, enlarged by a condition
        // that is far below 1000 for such points.
        let error = (dense(&found) - dense(&expected)).amax();
        prop_assert!(error <= 1e-11, "{error}");
    }

    /// Points on one edge of a cell of degree 1 depend on the outer two of them.
    #[test]
    fn collinear_points_must_agree(
        fractions in proptest::collection::vec(0.01..0.99_f64, 1..10),
        changed in any::<prop::sample::Index>(),
        by in prop_oneof![Just(1e-9), Just(1e-3), Just(1.0)],
    ) {
        let grid = Grid::new([Degree::LINEAR; 3], [3; 3], frame()).unwrap();
        let along = |t: f64| grid.frame().to_world([1.0 + t, 2.0, 1.0]);
        let mut points = vec![along(0.0), along(1.0)];
        points.extend(fractions.iter().map(|&t| along(t)));
        // Elsewhere, so that there are more control points than points; no part in it.
        points.extend(scattered(&grid, 2, 0.0, 0.3));
        let affine = |x: [f64; 3]| [0.3 * x[0] - 0.1 * x[1], 0.2 + 0.1 * x[2], 0.4 * x[1]];
        let mut displacements: Vec<_> = points.iter().map(|&x| affine(x)).collect();
        let options = PullOptions::default();
        solve(&grid, &points, &displacements, &options).unwrap();

        let changed = 2 + changed.index(fractions.len());
        displacements[changed][1] += by;
        let error = solve(&grid, &points, &displacements, &options).unwrap_err();
        let DirectError::Inconsistent { constraints, distance } = error else {
            panic!("{error}");
        };
        prop_assert!(constraints.contains(&changed), "{constraints:?}");
        prop_assert!(constraints.iter().all(|&i| i < 2 + fractions.len()), "{constraints:?}");
        // A compromise leaves less than the change.
        prop_assert!(distance > 0.0 && distance <= by * (1.0 + 1e-3), "{distance}");
    }
}
