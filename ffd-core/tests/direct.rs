//! Laws of direct manipulation, through the public interface.

#![expect(clippy::float_cmp, reason = "what must be equal is compared")]

mod common;

use common::{at, each, frame, grid, lattice};
use ffd_core::{
    Border, Constraint, Degree, DirectError, DirectManipulation, Fit, Frame, Grid, Knots, Lattice,
    MAX_ORDER, Merged, PullOptions,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// The matrix of basis functions, a row for each point, a column for each control point;
/// columns of fixed ones are zero.
fn basis_matrix<const D: usize>(
    grid: &Grid<D>,
    points: &[[f64; D]],
    fixed: &[usize],
) -> DMatrix<f64> {
    #![expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        reason = "cells are few"
    )]
    let per_axis = grid.control_points_per_axis();
    let mut matrix = DMatrix::zeros(points.len(), grid.control_point_count());
    for (row, &point) in points.iter().enumerate() {
        let u = grid.frame().to_lattice(point);
        let along: [Vec<f64>; D] = std::array::from_fn(|axis| {
            let [low, high] = grid.domain()[axis];
            let cell = u[axis].floor().clamp(low, high - 1.0);
            let mut basis = [[0.0; MAX_ORDER]];
            // With an identity border knots are uniform, and cells are all alike.
            let own = (cell as usize).min(grid.cells()[axis] - 1);
            grid.axes()[axis].basis(own, u[axis] - cell, &mut basis);
            let mut weights = vec![0.0; per_axis[axis]];
            for (j, &weight) in basis[0].iter().enumerate() {
                let i = cell as isize + j as isize;
                if weight > 0.0 && i >= 0 && (i as usize) < per_axis[axis] {
                    weights[i as usize] = weight;
                }
            }
            weights
        });
        for column in 0..grid.control_point_count() {
            let indices = grid.control_point_indices(column);
            matrix[(row, column)] = (0..D).map(|axis| along[axis][indices[axis]]).product();
        }
    }
    for &column in fixed {
        matrix.fill_column(column, 0.0);
    }
    matrix
}

/// One vector per row.
fn dense<const D: usize>(vectors: &[[f64; D]]) -> DMatrix<f64> {
    DMatrix::from_fn(vectors.len(), D, |r, c| vectors[r][c])
}

fn longest<const D: usize>(vectors: &[[f64; D]]) -> f64 {
    let length = |v: &[f64; D]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    vectors.iter().map(length).fold(0.0, f64::max)
}

/// The pseudoinverse, and the ratio of the largest to the smallest singular value that
/// is not zero. By Householder reflections alone (a complete orthogonal decomposition):
/// its errors are a few times 1e-16 times that ratio, smaller than those of nalgebra's
/// singular vectors.
fn pseudoinverse(matrix: &DMatrix<f64>) -> (DMatrix<f64>, f64) {
    let outer = matrix.clone().col_piv_qr();
    let (q, r) = (outer.q(), outer.r());
    let rank = (0..r.nrows())
        .take_while(|&i| r[(i, i)].abs() > 1e-13 * r[(0, 0)].abs())
        .count();
    let inner = r.rows(0, rank).transpose().qr();
    let reduced = q.columns(0, rank).transpose();
    let reduced = inner
        .r()
        .transpose()
        .solve_lower_triangular(&reduced)
        .unwrap();
    let mut inverse = inner.q() * reduced;
    outer.p().inv_permute_rows(&mut inverse);
    let mut values = matrix.singular_values().as_slice().to_vec();
    values.sort_by(|a, b| b.total_cmp(a));
    (inverse, values[0] / values[rank.max(1) - 1])
}

fn solve<const D: usize>(
    grid: &Grid<D>,
    points: &[[f64; D]],
    displacements: &[[f64; D]],
    options: &PullOptions<'_>,
) -> Result<Vec<[f64; D]>, DirectError> {
    let mut manipulation = DirectManipulation::new(grid, points, options)?;
    let mut changes = vec![[f64::NAN; D]; grid.control_point_count()];
    manipulation.solve_into(displacements, &mut changes)?;
    Ok(changes)
}

fn constraints<const D: usize>(
    points: &[[f64; D]],
    displacements: &[[f64; D]],
) -> Vec<Constraint<D>> {
    std::iter::zip(points, displacements)
        .map(|(&point, &displacement)| Constraint::new(point, displacement))
        .collect()
}

/// Evenly distributed numbers from 0 to 1 without a random source.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Points within a part of the domain: `low` to `high` of its extent along each axis.
fn scattered<const D: usize>(grid: &Grid<D>, count: usize, low: f64, high: f64) -> Vec<[f64; D]> {
    let mut next = numbers();
    (0..count)
        .map(|_| at(grid, std::array::from_fn(|_| low + (high - low) * next())))
        .collect()
}

fn some_displacements<const D: usize>(count: usize) -> Vec<[f64; D]> {
    let mut next = numbers();
    (0..count + 1)
        .map(|_| std::array::from_fn(|_| 2.0 * next() - 1.0))
        .skip(1)
        .collect()
}

/// A grid of cubic cells without skew.
fn cubic<const D: usize>(cells: usize) -> Grid<D> {
    Grid::new([Degree::CUBIC; D], [cells; D], Frame::unit()).unwrap()
}

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

#[test]
fn duplicates_are_merged_or_named() {
    let grid = cubic::<3>(4);
    let mut lattice = Lattice::at_rest(grid).unwrap();
    let (a, b) = ([1.5, 2.0, 2.5], [3.0, 1.0, 1.0]);
    // The third point is the first, computed in another way.
    let near = [1.5 + f64::EPSILON, 2.0 - f64::EPSILON, 2.5];
    let up = [0.0, 0.25, 0.0];
    let mut list = constraints(&[a, b, near, a], &[up, [0.0; 3], up, up]);
    let pull = lattice.pull(&list, &PullOptions::default()).unwrap();
    let merged = [2, 3].map(|constraint| Merged {
        constraint,
        into: 0,
    });
    assert_eq!(pull.merged, merged);
    assert!(pull.largest_residual <= 1e-12 * 0.25);

    let before = lattice.clone();
    list[3].displacement[0] = 0.5;
    let error = lattice.pull(&list, &PullOptions::default()).unwrap_err();
    let expected = DirectError::Inconsistent {
        constraints: vec![0, 3],
        distance: 0.5,
    };
    assert_eq!(error, expected);
    assert_eq!(lattice, before);

    // The weighted mean of up, up, and up + 0.5 x with weights 1, 1 and 2.
    list[3].weight = 2.0;
    let options = PullOptions {
        fit: Fit::LeastSquares,
        ..PullOptions::default()
    };
    let pull = lattice.pull(&list, &options).unwrap();
    let expected = [
        [-0.25, 0.0, 0.0],
        [0.0; 3],
        [-0.25, 0.0, 0.0],
        [0.25, 0.0, 0.0],
    ];
    assert!((dense(&pull.residuals) - dense(&expected)).amax() < 1e-15);
    let moved = lattice.deform_point(a)[0] - before.deform_point(a)[0];
    assert!((moved - 0.25).abs() < 1e-15);
}

/// More points in a cell than control points act there, dense and sparse: an affine
/// motion of them is consistent, and one that does not follow it is found.
#[test]
fn many_points_in_a_cell_must_agree() {
    for (degree, cells, count) in [
        (Degree::CUBIC, 1, 65),
        (Degree::CUBIC, 1, 300),
        (Degree::QUADRATIC, 3, 30),
        (Degree::QUADRATIC, 3, 200),
        (Degree::LINEAR, 4, 2000),
    ] {
        let grid = Grid::new([degree; 3], [cells; 3], Frame::unit()).unwrap();
        let share = if cells == 3 { 1.0 / 3.0 } else { 1.0 };
        let mut points = scattered(&grid, count, 0.0, share);
        if cells == 3 {
            // And points elsewhere, fewer than control points there.
            points.extend(scattered(&grid, 20, 0.7, 1.0));
        }
        let affine = |x: [f64; 3]| [0.3 * x[0] - 0.1 * x[1], 0.2 + 0.1 * x[2], 0.4 * x[1]];
        let mut displacements: Vec<_> = points.iter().map(|&x| affine(x)).collect();
        let options = PullOptions::default();
        let changes = solve(&grid, &points, &displacements, &options).unwrap();
        let basis = basis_matrix(&grid, &points, &[]);
        let error = (&basis * dense(&changes) - dense(&displacements)).amax();
        assert!(error < 2e-12, "{error}");

        displacements[7][2] += 0.125;
        let error = solve(&grid, &points, &displacements, &options).unwrap_err();
        let DirectError::Inconsistent {
            constraints,
            distance,
        } = error
        else {
            panic!("{error}");
        };
        assert!(constraints.contains(&7), "{constraints:?}");
        assert!(constraints.iter().all(|&i| i < count), "{constraints:?}");
        assert!(distance > 1e-9 && distance < 0.13, "{distance}");
    }
}

/// Points close to each other can follow a rotation, but not go apart.
#[test]
fn neighbours_must_nearly_agree() {
    let grid = cubic::<3>(8);
    for (others, most) in [(6, 6), (400, 5)] {
        for exponent in 2..=9 {
            let near = 10_f64.powi(-exponent);
            let mut points = scattered(&grid, others, 0.0, 1.0);
            points.push([4.1, 3.9, 2.2]);
            points.push([4.1 + near, 3.9, 2.2]);
            let rotation = |x: [f64; 3]| [0.1 * x[1], -0.1 * x[0], 0.0];
            let mut displacements: Vec<_> = points.iter().map(|&x| rotation(x)).collect();
            let options = PullOptions::default();
            let result = solve(&grid, &points, &displacements, &options);
            let basis = basis_matrix(&grid, &points, &[]);
            match result {
                Ok(changes) => {
                    let error = (basis * dense(&changes) - dense(&displacements)).amax();
                    assert!(error < 2e-12, "{error}");
                }
                Err(error) => assert!(exponent > most, "{near}: {error}"),
            }

            displacements[others] = [0.0, 0.0, 1.0];
            displacements[others + 1] = [0.0, 0.0, -1.0];
            match solve(&grid, &points, &displacements, &options) {
                Ok(_) => assert!(exponent <= 4, "{near}"),
                Err(DirectError::Inconsistent { constraints, .. }) => {
                    assert!(exponent > 3, "{near}");
                    let both = [others, others + 1];
                    assert!(
                        both.iter().all(|i| constraints.contains(i)),
                        "{constraints:?}"
                    );
                }
                Err(error) => panic!("{error}"),
            }
        }
    }
}

#[test]
fn two_thousand_points_are_met() {
    let grid = cubic::<3>(16);
    let points = scattered(&grid, 2000, 0.0, 1.0);
    let displacements = some_displacements(2000);
    let changes = solve(&grid, &points, &displacements, &PullOptions::default()).unwrap();
    let lattice = Lattice::new(grid, changes).unwrap();
    // Displacements of control points are below 100 here; 130 roundings, and one of
    // the image.
    let tolerance = 2e-12 + 130.0 * f64::EPSILON * longest(lattice.displacements());
    for (&point, displacement) in points.iter().zip(&displacements) {
        let there = lattice.deform_point(point);
        for c in 0..3 {
            let error = there[c] - point[c] - displacement[c];
            assert!(error.abs() <= tolerance, "{error}");
        }
    }
}

/// More points than control points: the gradient of the sum of squares vanishes, and so
/// does nothing else.
#[test]
fn overdetermined_least_squares_is_stationary() {
    let grid = cubic::<2>(6);
    let points = scattered(&grid, 3000, 0.0, 1.0);
    let displacements = some_displacements(3000);
    let options = PullOptions {
        fit: Fit::LeastSquares,
        ..PullOptions::default()
    };
    let changes = solve(&grid, &points, &displacements, &options).unwrap();
    let basis = basis_matrix(&grid, &points, &[]);
    let residual = dense(&displacements) - &basis * dense(&changes);
    assert!(residual.norm() > 10.0);
    // 3000 products, each rounded, at most 1.
    assert!((basis.transpose() * residual).amax() < 3000.0 * f64::EPSILON);
}

#[test]
fn damping_tends_to_exact() {
    let grid = cubic::<3>(4);
    let points = scattered(&grid, 10, 0.0, 1.0);
    let displacements = some_displacements(10);
    let exact = solve(&grid, &points, &displacements, &PullOptions::default()).unwrap();
    let mut before = f64::INFINITY;
    for damping in [1.0, 1e-2, 1e-4, 1e-6, 1e-9, 1e-14, 1e-200] {
        let options = PullOptions {
            fit: Fit::Damped { damping },
            ..PullOptions::default()
        };
        let damped = solve(&grid, &points, &displacements, &options).unwrap();
        let distance = (dense(&damped) - dense(&exact)).amax();
        assert!(
            distance < before || distance < 1e-12,
            "{damping}: {distance}"
        );
        before = distance;
    }
    assert!(before < 1e-12);
}

#[test]
fn what_does_not_fit_is_named() {
    let grid = cubic::<2>(4);
    let options = PullOptions::default();
    let new = |points: &[[f64; 2]], options: &PullOptions<'_>| {
        DirectManipulation::new(&grid, points, options).err()
    };
    assert!(matches!(
        new(&[[1.0, 1.0], [1.0, f64::NAN]], &options),
        Some(DirectError::NonFinitePoint { constraint: 1, component: 1, value }) if value.is_nan()
    ));
    let expected = DirectError::PointOutside {
        constraint: 1,
        point: vec![1.0, 4.5],
    };
    assert_eq!(new(&[[1.0, 1.0], [1.0, 4.5]], &options), Some(expected));
    let expected = DirectError::FixedOutOfRange {
        control_point: 49,
        count: 49,
    };
    let fixed = PullOptions {
        fixed: &[3, 49],
        ..options
    };
    assert_eq!(new(&[], &fixed), Some(expected));
    for bad in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let fit = Fit::Damped { damping: bad };
        let error = new(&[[1.0, 1.0]], &PullOptions { fit, ..options });
        assert!(matches!(error, Some(DirectError::Damping { .. })), "{bad}");
        let error =
            DirectManipulation::with_weights(&grid, &[[1.0; 2]; 2], &[1.0, bad], &options).err();
        assert!(matches!(
            error,
            Some(DirectError::Weight { constraint: 1, .. })
        ));
    }
    let error = DirectManipulation::with_weights(&grid, &[[1.0; 2]], &[], &options).err();
    assert!(matches!(
        error,
        Some(DirectError::LengthMismatch {
            what: "weights",
            ..
        })
    ));

    let mut manipulation = DirectManipulation::new(&grid, &[[1.0; 2]], &options).unwrap();
    let mut changes = vec![[7.0; 2]; 49];
    let error = manipulation.solve_into(&[], &mut changes).unwrap_err();
    assert!(matches!(
        error,
        DirectError::LengthMismatch {
            what: "displacements",
            ..
        }
    ));
    let error = manipulation
        .solve_into(&[[0.0, f64::INFINITY]], &mut changes)
        .unwrap_err();
    assert!(matches!(
        error,
        DirectError::NonFiniteDisplacement {
            constraint: 0,
            component: 1,
            ..
        }
    ));
    assert_eq!(changes, [[7.0; 2]; 49]);
    let error = manipulation
        .solve_into(&[[0.0; 2]], &mut changes[1..])
        .unwrap_err();
    assert!(matches!(
        error,
        DirectError::LengthMismatch {
            what: "changes",
            ..
        }
    ));
}

#[test]
fn nothing_moves_without_constraints_or_displacements() {
    let grid = cubic::<2>(4);
    let options = PullOptions::default();
    let none = solve(&grid, &[], &[], &options).unwrap();
    assert_eq!(none, [[0.0; 2]; 49]);
    let still = solve(&grid, &[[1.0; 2], [2.0; 2]], &[[0.0; 2]; 2], &options).unwrap();
    assert_eq!(still, [[0.0; 2]; 49]);
}

/// Points that no free control point reaches may stay, but not move.
#[test]
fn points_out_of_reach_may_be_pinned() {
    let grid = cubic::<2>(4).with_border(Border::Identity).unwrap();
    // The corner of the border, and a point where (1e-3)³/6 is left along each axis.
    for corner in [[-3.0, -3.0], [-2.999, -2.999]] {
        let points = [[2.0, 2.0], corner];
        let up = [0.0, 0.5];
        let options = PullOptions::default();
        solve(&grid, &points, &[up, [0.0; 2]], &options).unwrap();
        let error = solve(&grid, &points, &[up, [1e-6, 0.0]], &options).unwrap_err();
        let named = matches!(
            error,
            DirectError::Unreachable { constraint: 1, factor } if factor > 1e12
        );
        assert!(named, "{error}");

        let fit = Fit::LeastSquares;
        let options = PullOptions { fit, ..options };
        let mut lattice = Lattice::at_rest(grid.clone()).unwrap();
        let pull = lattice
            .pull(&constraints(&points, &[up, up]), &options)
            .unwrap();
        assert_eq!(pull.residuals[1], up);
        assert!(longest(&pull.residuals[..1]) < 1e-15);
    }
    // All control points around are fixed.
    let fixed: Vec<usize> = (0..grid.control_point_count()).collect();
    let options = PullOptions {
        fixed: &fixed,
        ..PullOptions::default()
    };
    let error = solve(&grid, &[[2.0, 2.0]], &[[1.0, 0.0]], &options).unwrap_err();
    let expected = DirectError::Unreachable {
        constraint: 0,
        factor: f64::INFINITY,
    };
    assert_eq!(error, expected);
}

/// A point next to an identity border moves, though control points must move 1e8 times
/// as far; its row does not disturb that of another.
#[test]
fn weak_rows_are_scaled() {
    let grid = cubic::<2>(4).with_border(Border::Identity).unwrap();
    let points = [[-2.9, -2.9], [3.0, 3.0]];
    let displacements = [[0.1, 0.0], [0.0, 0.2]];
    let changes = solve(&grid, &points, &displacements, &PullOptions::default()).unwrap();
    assert!(longest(&changes) > 1e6);
    let basis = basis_matrix(&grid, &points, &[]);
    let error = (basis * dense(&changes) - dense(&displacements)).amax();
    assert!(error <= 1e-12 * 0.2, "{error}");
}

#[test]
fn sizes_of_displacements_and_weights_do_not_matter() {
    let grid = Grid::bezier([Degree::CUBIC; 2], Frame::unit()).unwrap();
    let points = [[0.25, 0.5], [0.75, 0.5]];
    let options = PullOptions::default();
    let displacements = [[1.0, 0.5], [0.25, -1.0]];
    let expected = solve(&grid, &points, &displacements, &options).unwrap();
    for exponent in [-990, 990] {
        let size = 2_f64.powi(exponent);
        let scaled = displacements.map(|d| d.map(|x| x * size));
        let found = solve(&grid, &points, &scaled, &options).unwrap();
        let rescaled: Vec<_> = found.iter().map(|d| d.map(|x| x / size)).collect();
        assert_eq!(rescaled, expected);
    }
    // Control points move farther than points, and farther than numbers reach.
    let (near, apart) = ([[0.45, 0.5], [0.55, 0.5]], [[1e308, 0.0], [-1e308, 0.0]]);
    let error = solve(&grid, &near, &apart, &options).unwrap_err();
    assert!(matches!(error, DirectError::Overflow { .. }), "{error}");

    for fit in [Fit::LeastSquares, Fit::Damped { damping: 1e-300 }] {
        let options = PullOptions { fit, ..options };
        for weight in [1e-300, 1e300] {
            let mut manipulation =
                DirectManipulation::with_weights(&grid, &points, &[weight; 2], &options).unwrap();
            let mut changes = vec![[f64::NAN; 2]; 16];
            manipulation
                .solve_into(&displacements, &mut changes)
                .unwrap();
            let found = dense(&changes);
            let half = if fit != Fit::LeastSquares && weight < 1.0 {
                1.0
            } else {
                0.0
            };
            // A damping as large as the weights holds control points back.
            let error = (found - dense(&expected)).amax();
            assert!((error < 1e-14) == (half < 0.5), "{error}");
        }
    }
}

/// The grids of other kinds of knots are covered by the laws above; here numbers that can
/// be checked by hand.
#[test]
fn a_corner_of_a_clamped_grid_is_a_control_point() {
    let grid = cubic::<2>(3).with_knots([Knots::Clamped; 2]).unwrap();
    let changes = solve(
        &grid,
        &[[0.0, 3.0]],
        &[[0.5, -0.25]],
        &PullOptions::default(),
    )
    .unwrap();
    for (i, change) in changes.iter().enumerate() {
        let expected = if i == 30 { [0.5, -0.25] } else { [0.0; 2] };
        assert_eq!(*change, expected);
    }
}
