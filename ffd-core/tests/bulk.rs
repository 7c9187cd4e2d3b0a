//! Many points at once give what one point at a time gives.
#![allow(
    clippy::float_cmp,
    clippy::cast_possible_truncation,
    clippy::needless_range_loop,
    reason = "some results are equal to the last bit; indices as in the formulas"
)]

mod common;

use common::{at, each, frame, lattice};
use ffd_core::{
    Border, Degree, Embedding, FfdError, Frame, Grid, Knots, Lattice, Outside, transform_normal,
    transform_tangent,
};
use glam::{DVec2, DVec3, Vec3};
use proptest::collection::vec;
use proptest::prelude::*;

/// Bulk evaluation, bound or not, equals that of each point, for points in and around
/// the domain and each choice of what happens outside.
fn check_values<const D: usize>(
    lattice: &Lattice<D>,
    fractions: &[[f64; D]],
) -> Result<(), TestCaseError> {
    let grid = lattice.grid();
    let points: Vec<[f64; D]> = fractions.iter().map(|&f| at(grid, f)).collect();
    for outside in [Outside::Keep, Outside::Clamp] {
        let expected: Vec<[f64; D]> = points
            .iter()
            .map(|&x| lattice.deform_point_with(x, outside).unwrap())
            .collect();
        let bound = Embedding::<f64, D>::new(grid, &points, outside).unwrap();
        let mut images = vec![[f64::NAN; D]; points.len()];
        bound.deform_into(lattice, &mut images).unwrap();
        prop_assert_eq!(&images, &expected);

        let mut images = points.clone();
        let beyond = lattice.deform_points(&mut images, outside).unwrap();
        prop_assert_eq!(&images, &expected);
        let out: Vec<usize> = (0..points.len())
            .filter(|&i| !grid.contains(points[i]))
            .collect();
        prop_assert_eq!(beyond, out.len());
        prop_assert_eq!(bound.outside().collect::<Vec<_>>(), out);

        let mut jacobians = vec![[[f64::NAN; D]; D]; points.len()];
        let mut images = vec![[f64::NAN; D]; points.len()];
        bound
            .deform_with_jacobians_into(lattice, &mut images, &mut jacobians)
            .unwrap();
        prop_assert_eq!(&images, &expected);
        for (&x, jacobian) in points.iter().zip(&jacobians) {
            if let Some(there) = lattice.evaluate(x) {
                prop_assert_eq!(*jacobian, there.jacobian);
            } else if outside == Outside::Keep {
                let identity =
                    std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
                prop_assert_eq!(*jacobian, identity);
            }
        }

        let normals: Vec<[f64; D]> = fractions.to_vec();
        let (mut images, mut out_normals) = (images.clone(), images);
        bound
            .deform_with_normals_into(lattice, &normals, &mut images, &mut out_normals)
            .unwrap();
        prop_assert_eq!(&images, &expected);
        for i in 0..points.len() {
            prop_assert_eq!(out_normals[i], transform_normal(&jacobians[i], normals[i]));
        }
    }
    Ok(())
}

/// In single precision the error stays within the documented bound.
fn check_single<const D: usize>(
    lattice: &Lattice<D>,
    fractions: &[[f64; D]],
) -> Result<(), TestCaseError> {
    let grid = lattice.grid();
    let points: Vec<[f32; D]> = fractions
        .iter()
        .map(|&f| at(grid, f).map(|c| c as f32))
        .collect();
    let bound = Embedding::<f32, D>::new(grid, &points, Outside::Keep).unwrap();
    let mut images = vec![[f32::NAN; D]; points.len()];
    bound.deform_into(lattice, &mut images).unwrap();
    let largest = lattice
        .displacements()
        .as_flattened()
        .iter()
        .fold(0.0_f64, |m, c| m.max(c.abs()));
    let n = grid.degree().iter().map(|n| n.get()).max().unwrap() as f64;
    let mut again = vec![[f32::NAN; D]; points.len()];
    let mut jacobians = vec![[[f32::NAN; D]; D]; points.len()];
    bound
        .deform_with_jacobians_into(lattice, &mut again, &mut jacobians)
        .unwrap();
    prop_assert_eq!(&again, &images);
    for (jacobian, point) in jacobians.iter().zip(&points) {
        let Some(exact) = lattice.evaluate(point.map(f64::from)) else {
            continue;
        };
        // Slopes add up to 2 n, change by 4 n² where the position is rounded, and are
        // multiplied by rows of the inverse frame that add up to less than 4; a few more
        // roundings than for an image.
        let bound = 2.0_f64.powi(-24) * (1.0 + 4.0 * 2.0 * n * (24.0 * n + 10.0) * largest);
        for (a, b) in jacobian
            .as_flattened()
            .iter()
            .zip(exact.jacobian.as_flattened())
        {
            prop_assert!((f64::from(*a) - b).abs() <= bound);
        }
    }
    for (image, point) in images.iter().zip(&points) {
        let exact = lattice.deform_point(point.map(f64::from));
        for c in 0..D {
            let bound = 2.0_f64.powi(-24) * (exact[c].abs() + (22.0 * n + 5.0) * largest);
            let error = (f64::from(image[c]) - exact[c]).abs();
            prop_assert!(error <= bound, "{error} {bound}");
        }
    }
    Ok(())
}

/// The change of `n` control points reaches `out` by an update as by doing all again.
fn check_update<const D: usize>(
    lattice: &Lattice<D>,
    fractions: &[[f64; D]],
    moved: &[prop::sample::Index],
) -> Result<(), TestCaseError> {
    let grid = lattice.grid();
    let points: Vec<[f64; D]> = fractions.iter().map(|&f| at(grid, f)).collect();
    let moved: Vec<usize> = moved
        .iter()
        .map(|i| i.index(grid.control_point_count()))
        .collect();
    for outside in [Outside::Keep, Outside::Clamp] {
        let mut bound = Embedding::<f64, D>::new(grid, &points, outside).unwrap();
        let mut images = points.clone();
        bound.deform_into(lattice, &mut images).unwrap();
        let before = images.clone();
        let mut changed = lattice.clone();
        for &index in &moved {
            changed.set_displacement(index, [1.5; D]).unwrap();
        }
        let updated = bound.update_into(&changed, &moved, &mut images).unwrap();
        let mut expected = points.clone();
        bound.deform_into(&changed, &mut expected).unwrap();
        prop_assert_eq!(&images, &expected);
        let different = images.iter().zip(&before).filter(|(a, b)| a != b).count();
        prop_assert!(different <= updated && updated <= points.len());
    }
    Ok(())
}

fn fractions<const D: usize>(most: usize) -> impl Strategy<Value = Vec<[f64; D]>> {
    vec(each(-0.1..=1.1_f64), 0..most)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn bulk_equals_single_in_2d(lattice in lattice::<2>(4, 1.0), x in fractions(90)) {
        check_values(&lattice, &x)?;
    }

    #[test]
    fn bulk_equals_single_in_3d(lattice in lattice::<3>(3, 1.0), x in fractions(90)) {
        check_values(&lattice, &x)?;
    }

    #[test]
    fn single_precision_is_within_its_bound_in_2d(
        lattice in lattice::<2>(4, 1.0),
        x in vec(each(0.0..=1.0_f64), 0..40),
    ) {
        check_single(&lattice, &x)?;
    }

    #[test]
    fn single_precision_is_within_its_bound_in_3d(
        lattice in lattice::<3>(3, 1.0),
        x in vec(each(0.0..=1.0_f64), 0..40),
    ) {
        check_single(&lattice, &x)?;
    }

    #[test]
    fn an_update_is_as_good_as_doing_all_again_in_2d(
        lattice in lattice::<2>(6, 1.0),
        x in fractions(60),
        moved in vec(any::<prop::sample::Index>(), 0..4),
    ) {
        check_update(&lattice, &x, &moved)?;
    }

    #[test]
    fn an_update_is_as_good_as_doing_all_again_in_3d(
        lattice in lattice::<3>(4, 1.0),
        x in fractions(60),
        moved in vec(any::<prop::sample::Index>(), 0..4),
    ) {
        check_update(&lattice, &x, &moved)?;
    }

    /// The order of points does not matter.
    #[test]
    fn a_permutation_of_the_points_permutes_the_images(
        lattice in lattice::<3>(3, 1.0),
        x in fractions::<3>(60).prop_shuffle(),
        shift in 0_usize..60,
    ) {
        let points: Vec<[f64; 3]> = x.iter().map(|&f| at(lattice.grid(), f)).collect();
        let mut rotated = points.clone();
        let by = if points.is_empty() { 0 } else { shift % points.len() };
        rotated.rotate_left(by);
        let deform = |points: &[[f64; 3]]| {
            let bound = Embedding::<f64, 3>::new(lattice.grid(), points, Outside::Keep).unwrap();
            let mut images = points.to_vec();
            bound.deform_into(&lattice, &mut images).unwrap();
            images
        };
        let mut images = deform(&points);
        images.rotate_left(by);
        prop_assert_eq!(images, deform(&rotated));
    }

    /// Images of normals are perpendicular to images of tangents.
    #[test]
    fn normals_stay_normal(
        jacobian in each::<3, _>(each::<3, _>(-1.0..1.0_f64)),
        a in each::<3, _>(-1.0..1.0_f64),
        b in each::<3, _>(-1.0..1.0_f64),
    ) {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [0, 1, 2].map(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                a[j] * b[k] - a[k] * b[j]
            })
        };
        let (ja, jb) = (transform_tangent(&jacobian, a), transform_tangent(&jacobian, b));
        let expected = cross(ja, jb);
        let normal = transform_normal(&jacobian, cross(a, b));
        let length = dot(expected, expected).sqrt();
        // The normal is that of the images, to rounding: products of three factors up to
        // 3, twenty roundings, relative to a length that is not tiny.
        prop_assume!(length > 1e-3);
        for c in 0..3 {
            prop_assert!((normal[c] - expected[c] / length).abs() <= 20.0 * 27.0 * f64::EPSILON / 1e-3);
        }
    }
}

/// A lattice and a cloud of points large enough for several blocks of points and tasks.
fn cloud() -> (Lattice<3>, Vec<DVec3>) {
    let grid = Grid::new([Degree::CUBIC; 3], [5, 4, 3], frame()).unwrap();
    let wave = |i: usize, s: f64| ((i as f64) * s).sin();
    let displacements = (0..grid.control_point_count())
        .map(|i| [wave(i, 1.1), wave(i, 2.3), wave(i, 3.7)])
        .collect();
    let points = (0..70_000)
        .map(|i| {
            let f = [0.71, 0.37, 0.93].map(|s| 1.2 * (i as f64 * s).fract() - 0.1);
            DVec3::from(at(&grid, f))
        })
        .collect();
    (Lattice::new(grid, displacements).unwrap(), points)
}

#[test]
fn many_points_equal_single_ones_whatever_the_number_of_threads() {
    let (lattice, points) = cloud();
    let expected: Vec<DVec3> = points
        .iter()
        .map(|&x| DVec3::from(lattice.deform_point(x.into())))
        .collect();
    let bound = Embedding::<f64, 3>::new(lattice.grid(), &points, Outside::Keep).unwrap();
    let mut images = vec![DVec3::NAN; points.len()];
    bound.deform_into(&lattice, &mut images).unwrap();
    assert!(images == expected);
    let mut in_place = points.clone();
    lattice.deform_points(&mut in_place, Outside::Keep).unwrap();
    assert!(in_place == expected);
    #[cfg(feature = "rayon")]
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        images.fill(DVec3::NAN);
        in_place.clone_from(&points);
        pool.install(|| {
            bound.par_deform_into(&lattice, &mut images).unwrap();
            let outside = lattice
                .par_deform_points(&mut in_place, Outside::Keep)
                .unwrap();
            assert_eq!(outside, bound.outside().len());
        });
        assert!(images == expected && in_place == expected);

        // Jacobians and normals too.
        let normals = points.clone();
        let mut jacobians = [[[f64::NAN; 3]; 3]; 2].map(|j| vec![j; points.len()]);
        let mut out_normals = [DVec3::NAN; 2].map(|n| vec![n; points.len()]);
        let [one, many] = &mut jacobians;
        let [one_normal, many_normals] = &mut out_normals;
        bound
            .deform_with_jacobians_into(&lattice, &mut images, one)
            .unwrap();
        bound
            .deform_with_normals_into(&lattice, &normals, &mut images, one_normal)
            .unwrap();
        images.fill(DVec3::NAN);
        pool.install(|| {
            bound
                .par_deform_with_jacobians_into(&lattice, &mut images, many)
                .unwrap();
            assert!(images == expected);
            bound
                .par_deform_with_normals_into(&lattice, &normals, &mut images, many_normals)
                .unwrap();
        });
        assert!(images == expected);
        assert!(one == many && one_normal == many_normals);
    }
}

#[test]
fn vectors_of_the_caller_are_accepted() {
    let grid = Grid::new([Degree::CUBIC; 3], [2; 3], Frame::unit()).unwrap();
    let lattice = Lattice::new(grid.clone(), vec![[0.0, 0.5, 0.0]; 125]).unwrap();
    let mut single = [Vec3::ONE];
    lattice.deform_points(&mut single, Outside::Keep).unwrap();
    assert_eq!(single, [Vec3::new(1.0, 1.5, 1.0)]);
    let mut arrays = [[1.0_f32; 3]];
    lattice.deform_points(&mut arrays, Outside::Keep).unwrap();
    assert_eq!(arrays, [[1.0, 1.5, 1.0]]);
    let mut nalgebra = [nalgebra::Point3::new(1.0, 1.0, 1.0)];
    lattice.deform_points(&mut nalgebra, Outside::Keep).unwrap();
    assert_eq!(nalgebra, [nalgebra::Point3::new(1.0, 1.5, 1.0)]);
    let mut mint = [mint::Vector3::from([1.0_f64; 3])];
    let bound = Embedding::<f64, 3>::new(&grid, &mint, Outside::Error).unwrap();
    bound.deform_into(&lattice, &mut mint).unwrap();
    assert_eq!(mint, [mint::Vector3::from([1.0, 1.5, 1.0])]);

    let grid = Grid::new([Degree::CUBIC; 2], [2; 2], Frame::unit()).unwrap();
    let lattice = Lattice::new(grid, vec![[0.5, 0.0]; 25]).unwrap();
    let mut plane = [DVec2::ONE];
    lattice.deform_points(&mut plane, Outside::Keep).unwrap();
    assert_eq!(plane, [DVec2::new(1.5, 1.0)]);
}

/// The Jacobian of clamped points is that of the clamped map, by differences.
#[test]
fn clamped_points_have_the_jacobian_of_the_clamped_map() {
    let grid = Grid::new([Degree::CUBIC; 2], [2; 2], frame()).unwrap();
    let displacements = (0..25).map(|i| [0.1 * f64::from(i), -0.05 * f64::from(i * i % 7)]);
    let lattice = Lattice::new(grid.clone(), displacements.collect()).unwrap();
    for fractions in [[1.4, 0.3], [0.3, -0.2], [1.3, 1.2]] {
        let x = at(&grid, fractions);
        let bound = Embedding::<f64, 2>::new(&grid, &[x], Outside::Clamp).unwrap();
        let (mut image, mut jacobian) = ([[0.0; 2]], [[[0.0; 2]; 2]]);
        bound
            .deform_with_jacobians_into(&lattice, &mut image, &mut jacobian)
            .unwrap();
        let h = 1e-5;
        for c in 0..2 {
            let step = |h: f64| {
                let mut x = x;
                x[c] += h;
                lattice.deform_point_with(x, Outside::Clamp).unwrap()
            };
            for r in 0..2 {
                let slope = (step(h)[r] - step(-h)[r]) / (2.0 * h);
                // Third derivatives below 100; images below 20.
                let tolerance = h * h * 100.0 + 200.0 * f64::EPSILON * 20.0 / h;
                assert!((slope - jacobian[0][r][c]).abs() <= tolerance);
            }
        }
    }
}

#[test]
fn nothing_is_deformed_if_something_is_wrong() {
    let grid = Grid::new([Degree::CUBIC; 3], [2; 3], Frame::unit()).unwrap();
    let lattice = Lattice::new(grid.clone(), vec![[0.5; 3]; 125]).unwrap();
    let good = [[1.0; 3], [0.5; 3], [9.0; 3]];
    let mut points = good;
    points[1][2] = f64::NAN;
    let bad = points;
    for outside in [Outside::Keep, Outside::Clamp, Outside::Error] {
        let error = lattice.deform_points(&mut points, outside).unwrap_err();
        assert!(matches!(
            error,
            FfdError::NonFinitePoint {
                index: 1,
                component: 2,
                ..
            }
        ));
        assert_eq!(points[0], bad[0]);
        assert!(Embedding::<f64, 3>::new(&grid, &points, outside).is_err());
    }
    let outside = FfdError::PointOutside {
        index: 2,
        point: vec![9.0; 3],
    };
    let mut points = good;
    assert_eq!(
        lattice.deform_points(&mut points, Outside::Error),
        Err(outside.clone())
    );
    assert_eq!(points, good);
    let error = Embedding::<f64, 3>::new(&grid, &points, Outside::Error).unwrap_err();
    assert_eq!(error, outside);
    assert_eq!(
        error.to_string(),
        "point 2, [9.0, 9.0, 9.0], lies outside the lattice"
    );
    #[cfg(feature = "rayon")]
    assert_eq!(
        lattice.par_deform_points(&mut points, Outside::Error),
        Err(outside)
    );

    let bound = Embedding::<f64, 3>::new(&grid, &points, Outside::Keep).unwrap();
    assert_eq!((bound.len(), bound.is_empty()), (3, false));
    let error = bound.deform_into(&lattice, &mut points[..2]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "images: 3 entries are needed, 2 were given"
    );
    let other = grid.with_border(Border::Identity).unwrap();
    let other = Lattice::at_rest(other).unwrap();
    assert_eq!(
        bound.deform_into(&other, &mut points),
        Err(FfdError::GridMismatch)
    );
    let mut jacobians = [[[0.0; 3]; 3]; 2];
    assert!(
        bound
            .deform_with_jacobians_into(&lattice, &mut points, &mut jacobians)
            .is_err()
    );
    assert_eq!(points, good);
}

#[test]
fn no_points_are_no_trouble() {
    let grid = Grid::new([Degree::LINEAR; 2], [1; 2], frame()).unwrap();
    let grid = grid.with_knots([Knots::Clamped; 2]).unwrap();
    let lattice = Lattice::at_rest(grid.clone()).unwrap();
    let none: [[f64; 2]; 0] = [];
    let bound = Embedding::<f64, 2>::new(&grid, &none, Outside::Error).unwrap();
    assert!(bound.is_empty());
    bound
        .deform_into(&lattice, &mut [] as &mut [[f64; 2]])
        .unwrap();
}

/// With one bilinear control point moved, four cells are touched, and no others.
#[test]
fn an_update_evaluates_what_is_touched_and_nothing_else() {
    let grid = Grid::new([Degree::LINEAR; 2], [8; 2], Frame::unit()).unwrap();
    let mut points: Vec<[f64; 2]> = (0..64)
        .map(|i| [f64::from(i % 8) + 0.5, f64::from(i / 8) + 0.5])
        .collect();
    // Outside, nearest to a cell that is touched and to one that is not.
    points.extend([[-1.0, 3.5], [-1.0, 6.5]]);
    let mut lattice = Lattice::at_rest(grid.clone()).unwrap();
    for (moved, outside, expected) in [
        (grid.control_point([4, 4]), Outside::Keep, 4),
        (grid.control_point([4, 4]), Outside::Clamp, 4),
        (grid.control_point([0, 4]), Outside::Keep, 2),
        (grid.control_point([0, 4]), Outside::Clamp, 3),
        (grid.control_point([8, 8]), Outside::Clamp, 1),
    ] {
        let mut bound = Embedding::<f64, 2>::new(&grid, &points, outside).unwrap();
        let mut images = points.clone();
        lattice.set_displacement(moved, [0.25; 2]).unwrap();
        bound.deform_into(&lattice, &mut images).unwrap();
        lattice.set_displacement(moved, [0.5; 2]).unwrap();
        assert_eq!(
            bound.update_into(&lattice, &[moved], &mut images),
            Ok(expected)
        );
        assert_eq!(
            bound.update_into(&lattice, &[moved; 3], &mut images),
            Ok(expected)
        );
        assert_eq!(bound.update_into(&lattice, &[], &mut images), Ok(0));
        let mut all = points.clone();
        bound.deform_into(&lattice, &mut all).unwrap();
        assert_eq!(images, all);
    }
}

#[test]
fn single_precision_clamps_too() {
    let grid = Grid::new([Degree::CUBIC; 2], [2; 2], Frame::unit()).unwrap();
    let displacements = (0..25).map(|i| [0.01 * f64::from(i), -0.5]).collect();
    let lattice = Lattice::new(grid.clone(), displacements).unwrap();
    let points = [[3.0_f32, 0.5], [-1.0, -2.0]];
    let bound = Embedding::<f32, 2>::new(&grid, &points, Outside::Clamp).unwrap();
    let mut images = points;
    bound.deform_into(&lattice, &mut images).unwrap();
    for (image, point) in images.iter().zip(points) {
        let exact = lattice
            .deform_point_with(point.map(f64::from), Outside::Clamp)
            .unwrap();
        assert_eq!(*image, exact.map(|c| c as f32));
    }
}

#[test]
fn a_bound_mesh_takes_lattices_on_its_own_grid_only() {
    let frame = Frame::of_box([0.0; 2], [2.0; 2], [2; 2]).unwrap();
    let grid = Grid::new([Degree::CUBIC; 2], [2; 2], frame).unwrap();
    let points = [[1.0, 1.0]];
    let bound = Embedding::<f64, 2>::new(&grid, &points, Outside::Keep).unwrap();
    let others = [
        Grid::new([Degree::CUBIC, Degree::LINEAR], [2; 2], frame).unwrap(),
        Grid::new([Degree::CUBIC; 2], [2, 3], frame).unwrap(),
        Grid::new(
            [Degree::CUBIC; 2],
            [2; 2],
            Frame::of_box([0.0; 2], [2.0, 3.0], [2; 2]).unwrap(),
        )
        .unwrap(),
        grid.clone()
            .with_knots([Knots::Uniform, Knots::Clamped])
            .unwrap(),
        grid.with_border(Border::Identity).unwrap(),
    ];
    for other in others {
        let lattice = Lattice::at_rest(other).unwrap();
        let mut images = points;
        assert_eq!(
            bound.deform_into(&lattice, &mut images),
            Err(FfdError::GridMismatch)
        );
    }
}

#[test]
fn every_list_has_its_length_checked() {
    let grid = Grid::new([Degree::CUBIC; 2], [2; 2], Frame::unit()).unwrap();
    let lattice = Lattice::at_rest(grid.clone()).unwrap();
    let bound = Embedding::<f64, 2>::new(&grid, &[[1.0; 2]; 3], Outside::Keep).unwrap();
    let lists = |n| vec![[0.5; 2]; n];
    for (a, b, c) in [(2, 3, 3), (3, 2, 3), (3, 3, 4)] {
        let (mut out, mut out_normals) = (lists(b), lists(c));
        let error = bound
            .deform_with_normals_into(&lattice, &lists(a), &mut out, &mut out_normals)
            .unwrap_err();
        assert!(matches!(
            error,
            FfdError::LengthMismatch { expected: 3, .. }
        ));
        assert_eq!((out, out_normals), (lists(b), lists(c)));
    }
}

/// Points of a fine grid share cells with few others: batches grow, results stay.
#[test]
fn fine_grids_are_bound_in_larger_batches() {
    let grid = Grid::new([Degree::QUADRATIC; 2], [300; 2], Frame::unit()).unwrap();
    let displacements = (0..grid.control_point_count())
        .map(|i| [(i as f64).sin(), (i as f64).cos()])
        .collect();
    let lattice = Lattice::new(grid.clone(), displacements).unwrap();
    let points: Vec<[f64; 2]> = (0..120_000)
        .map(|i| [0.71, 0.37].map(|s| 310.0 * (f64::from(i) * s).fract() - 5.0))
        .collect();
    let bound = Embedding::<f64, 2>::new(&grid, &points, Outside::Keep).unwrap();
    let mut images = points.clone();
    bound.deform_into(&lattice, &mut images).unwrap();
    let mut expected = points;
    lattice.deform_points(&mut expected, Outside::Keep).unwrap();
    assert!(images == expected);
}

/// Far away, lattice coordinates overflow: that is an error, not a point left behind.
#[test]
fn points_too_far_to_be_clamped_are_named() {
    let frame = Frame::new([-1e308, 0.0], [[1.0, 0.0], [0.0, 1.0]]).unwrap();
    let grid = Grid::new([Degree::LINEAR; 2], [2; 2], frame).unwrap();
    let lattice = Lattice::new(grid.clone(), vec![[0.0, 1.0]; 9]).unwrap();
    let far = [1e308, 1.0];
    let error = FfdError::PointOutside {
        index: 0,
        point: far.to_vec(),
    };
    assert_eq!(
        lattice.deform_point_with(far, Outside::Clamp),
        Err(error.clone())
    );
    assert_eq!(
        lattice.deform_points(&mut [far], Outside::Clamp),
        Err(error.clone())
    );
    assert_eq!(
        Embedding::<f64, 2>::new(&grid, &[far], Outside::Clamp).unwrap_err(),
        error
    );
}

/// Only directions count: no size of the Jacobian spoils a normal.
#[test]
fn normals_survive_any_scale() {
    for scale in [1e-300, 1e-170, 1.0, 1e160, 1e300] {
        let jacobian = [[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale]];
        assert_eq!(
            transform_normal(&jacobian, [0.0, 0.0, scale]),
            [0.0, 0.0, 1.0]
        );
    }
    assert_eq!(transform_normal(&[[0.0; 2]; 2], [1.0, 0.0]), [0.0; 2]);
}
