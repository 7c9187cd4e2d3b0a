//! Points that depend on each other, many points, and what is wrong with points.

use super::*;

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
