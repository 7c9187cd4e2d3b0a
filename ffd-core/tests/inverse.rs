//! Laws of the inverse, through the public interface.
#![expect(clippy::float_cmp, reason = "points that stay keep every bit")]

mod common;

use common::{at, displaced, each, grid, lattice};
use ffd_core::{Border, Degree, Frame, Grid, Inverse, InverseError, Knots, Lattice, Preimage};
use proptest::prelude::*;

fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// The largest absolute row sum of the inverse matrix, by elimination with row pivots,
/// divided by √D so that it is not above the spectral norm.
fn norm_of_inverse<const D: usize>(matrix: &[[f64; D]; D]) -> f64 {
    let mut left = *matrix;
    let mut right = [[0.0; D]; D];
    for (r, row) in right.iter_mut().enumerate() {
        row[r] = 1.0;
    }
    for k in 0..D {
        let pivot = (k..D)
            .max_by(|&a, &b| left[a][k].abs().total_cmp(&left[b][k].abs()))
            .unwrap();
        left.swap(k, pivot);
        right.swap(k, pivot);
        for r in (0..D).filter(|&r| r != k) {
            let factor = left[r][k] / left[k][k];
            for c in 0..D {
                left[r][c] -= factor * left[k][c];
                right[r][c] -= factor * right[k][c];
            }
        }
    }
    let rows = (0..D).map(|k| right[k].iter().map(|x| (x / left[k][k]).abs()).sum::<f64>());
    rows.fold(0.0, f64::max) / (D as f64).sqrt()
}

/// Both bounds that are promised, for the image of the point at the given fractions of
/// the domain.
fn check_way_back<const D: usize>(
    lattice: &Lattice<D>,
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let x = at(lattice.grid(), fractions);
    let q = lattice.deform_point(x);
    let inverse = Inverse::new(lattice);
    let unit = f64::EPSILON * inverse.size();
    let preimage = inverse.point(q).unwrap();
    let outside = !lattice.grid().contains(q);
    let y = match preimage {
        Preimage::None => return Err(TestCaseError::fail(format!("{x:?} not found"))),
        Preimage::One(y) => y,
        Preimage::Two([y, other]) => {
            prop_assert!(outside);
            prop_assert_eq!(other, q);
            y
        }
    };
    let residual = distance(lattice.deform_point(y), q);
    prop_assert!(residual <= 16.0 * unit, "residual {}", residual / unit);
    // Rounding may have placed x outside: then it is the preimage that stays, beside
    // the one that was checked.
    let Some(there) = lattice.evaluate(x) else {
        prop_assert!(outside);
        return Ok(());
    };
    let steepness = norm_of_inverse(&there.jacobian);
    let error = distance(y, x);
    prop_assert!(
        error <= 64.0 * unit * steepness.max(1.0),
        "error {} with {steepness}",
        error / unit
    );
    Ok(())
}

/// Lattices that are injective: with displacements of at most δ in lattice coordinates,
/// derivatives are at most 2 δ along a uniform axis, whose basis functions have
/// derivatives that add up to at most 2 in absolute value, and 2 n δ along a clamped
/// one. The sum over all axes stays below 0.9: x ↦ F(x) − x is a contraction.
fn injective<const D: usize>(most_cells: usize) -> impl Strategy<Value = Lattice<D>> {
    grid::<D>(most_cells).prop_flat_map(|grid| {
        let most: f64 = grid
            .axes()
            .iter()
            .map(|axis| match axis.knots() {
                Knots::Uniform => 2.0,
                Knots::Clamped => 2.0 * axis.degree().get() as f64,
            })
            .sum();
        let displacement = each::<D, _>(-0.9 / most..=0.9 / most);
        proptest::collection::vec(displacement, grid.control_point_count()).prop_map(
            move |displacements| {
                let axes = grid.frame().axes();
                let to_world = |d: [f64; D]| -> [f64; D] {
                    std::array::from_fn(|c| (0..D).map(|i| d[i] * axes[i][c]).sum())
                };
                let displacements = displacements.into_iter().map(to_world).collect();
                Lattice::new(grid.clone(), displacements).unwrap()
            },
        )
    })
}

/// The affine map with the given matrix and offset, in coordinates relative to the
/// middle of the box.
fn affine<const D: usize>(grid: Grid<D>, matrix: [[f64; D]; D], offset: [f64; D]) -> Lattice<D> {
    let middle = at(&grid, [0.5; D]);
    displaced(grid, |x| {
        std::array::from_fn(|r| {
            let image: f64 = (0..D).map(|c| matrix[r][c] * (x[c] - middle[c])).sum();
            image + middle[r] + offset[r] - x[r]
        })
    })
}

/// The image of a box under an affine map is a parallelepiped: points of it are found,
/// others are not.
fn check_affine<const D: usize>(
    grid: Grid<D>,
    matrix: [[f64; D]; D],
    offset: [f64; D],
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let grid = grid.with_border(Border::Free).unwrap();
    let middle = at(&grid, [0.5; D]);
    let lattice = affine(grid, matrix, offset);
    let x = at(lattice.grid(), fractions);
    let q = std::array::from_fn(|r| {
        let image: f64 = (0..D).map(|c| matrix[r][c] * (x[c] - middle[c])).sum();
        image + middle[r] + offset[r]
    });
    let inside = fractions.iter().all(|f| (0.0..=1.0).contains(f));
    let inverse = Inverse::new(&lattice);
    let preimage = inverse.point(q).unwrap();
    let stays = !lattice.grid().contains(q);
    // The promised bounds. The affine map computed here and the lattice differ by up to
    // 130 roundings (see `check_affine` of the deformation) of numbers up to the size.
    let unit = f64::EPSILON * inverse.size();
    let near = |y| distance(lattice.deform_point(y), q) <= 16.0 * unit;
    let found = |y| distance(y, x) <= (64.0 + 130.0) * unit * norm_of_inverse(&matrix).max(1.0);
    match preimage {
        _ if inside == stays && inside => {
            let Preimage::Two([y, other]) = preimage else {
                return Err(TestCaseError::fail(format!("{preimage:?}")));
            };
            prop_assert_eq!(other, q);
            prop_assert!(near(y) && found(y), "{:?} for {:?}", y, x);
        }
        Preimage::One(y) => {
            prop_assert!(inside || stays);
            if stays {
                prop_assert_eq!(y, q);
            } else {
                prop_assert!(near(y) && found(y), "{:?} for {:?}", y, x);
            }
        }
        Preimage::None => prop_assert!(!inside && !stays),
        Preimage::Two(_) => prop_assert!(false, "{:?}", preimage),
    }
    Ok(())
}

/// A matrix close enough to a rotation for its inverse to be below 10, any angle.
fn turn(angle: f64, shear: f64, stretch: f64) -> [[f64; 3]; 3] {
    let (s, c) = angle.sin_cos();
    [
        [c, -s, 0.0],
        [s * stretch, c * stretch, shear],
        [shear, 0.0, 1.0],
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn injective_lattices_are_inverted_in_2d(
        lattice in injective::<2>(4),
        fractions in proptest::collection::vec(each(0.0..=1.0_f64), 8),
    ) {
        for fractions in fractions {
            check_way_back(&lattice, fractions)?;
        }
    }

    #[test]
    fn injective_lattices_are_inverted_in_3d(
        lattice in injective::<3>(3),
        fractions in proptest::collection::vec(each(0.0..=1.0_f64), 8),
    ) {
        for fractions in fractions {
            check_way_back(&lattice, fractions)?;
        }
    }

    /// On the border of the domain.
    #[test]
    fn borders_are_found_again(
        lattice in injective::<3>(3),
        fractions in each(0.0..=1.0_f64),
        face in 0_usize..3,
        ends in each(prop_oneof![Just(0.0), Just(1.0)]),
    ) {
        let mut on_face = fractions;
        on_face[face] = ends[face];
        check_way_back(&lattice, on_face)?;
        check_way_back(&lattice, ends)?;
    }

    /// Cubic and uniform, up to the bound of Choi and Lee: 0.4 cells in 3-D.
    #[test]
    fn the_cubic_bound_is_reached(
        displacements in proptest::collection::vec(each(-0.4..=0.4_f64), 6 * 6 * 6),
        fractions in proptest::collection::vec(each(0.0..=1.0_f64), 8),
    ) {
        let grid = Grid::new([Degree::CUBIC; 3], [3; 3], Frame::unit()).unwrap();
        let lattice = Lattice::new(grid, displacements).unwrap();
        for fractions in fractions {
            check_way_back(&lattice, fractions)?;
        }
    }

    /// Points that are not images are told from those that are.
    #[test]
    fn the_image_of_a_box_is_a_parallelepiped_in_2d(
        grid in grid::<2>(4),
        angle in -4.0..4.0_f64,
        stretch in 0.3..4.0_f64,
        offset in each(-1.0..1.0_f64),
        fractions in each(-0.3..1.3_f64),
    ) {
        let (s, c) = angle.sin_cos();
        let matrix = [[c, -s * stretch], [s, c * stretch]];
        check_affine(grid, matrix, offset, fractions)?;
    }

    #[test]
    fn the_image_of_a_box_is_a_parallelepiped_in_3d(
        grid in grid::<3>(3),
        angle in -4.0..4.0_f64,
        shear in -0.3..0.3_f64,
        stretch in 0.3..4.0_f64,
        offset in each(-1.0..1.0_f64),
        fractions in each(-0.3..1.3_f64),
    ) {
        check_affine(grid, turn(angle, shear, stretch), offset, fractions)?;
    }

    /// Whatever the displacements, an image is never said not to be one.
    #[test]
    fn images_of_folding_lattices_are_never_denied_in_2d(
        lattice in lattice::<2>(4, 3.0),
        fractions in proptest::collection::vec(each(0.0..=1.0_f64), 4),
    ) {
        for fractions in fractions {
            check_not_denied(&lattice, fractions)?;
        }
    }

    #[test]
    fn images_of_folding_lattices_are_never_denied_in_3d(
        lattice in lattice::<3>(3, 3.0),
        fractions in proptest::collection::vec(each(0.0..=1.0_f64), 4),
    ) {
        for fractions in fractions {
            check_not_denied(&lattice, fractions)?;
        }
    }

    /// Any point at all is answered.
    #[test]
    fn every_point_is_answered(lattice in lattice::<3>(2, 2.0), q in each(-20.0..20.0_f64)) {
        match lattice.inverse_point(q) {
            Ok(Preimage::None) => prop_assert!(lattice.grid().contains(q)),
            Ok(Preimage::One(y) | Preimage::Two([y, _])) => {
                let size = Inverse::new(&lattice).size();
                prop_assert!(distance(lattice.deform_point(y), q) <= 400.0 * f64::EPSILON * size);
            }
            Err(error) => prop_assert!(false, "{error}"),
        }
    }

    /// Space squeezed nearly or entirely flat.
    #[test]
    fn flat_images_are_found(
        flatness in prop_oneof![Just(0.0), Just(1e-15), Just(1e-12), Just(1e-8)],
        angle in -4.0..4.0_f64,
        grid in grid::<3>(3),
        fractions in each(0.0..=1.0_f64),
        above in 0.01..0.5_f64,
    ) {
        let grid = grid.with_border(Border::Free).unwrap();
        let (s, c) = angle.sin_cos();
        let matrix = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, flatness]];
        let lattice = affine(grid, matrix, [0.0; 3]);
        check_not_denied(&lattice, fractions)?;
        let mut q = lattice.deform_point(at(lattice.grid(), fractions));
        q[2] += above;
        let expected = if lattice.grid().contains(q) { Preimage::None } else { Preimage::One(q) };
        prop_assert_eq!(lattice.inverse_point(q), Ok(expected));
    }

    /// The same at any scale and far from the origin.
    #[test]
    fn scale_does_not_matter(
        exponents in each(-12_i32..=12),
        displacements in proptest::collection::vec(each::<3, _>(-0.15..=0.15_f64), 5 * 5 * 5),
        far in prop_oneof![Just(0.0), Just(1e3), Just(-1e6)],
        fractions in each(0.0..=1.0_f64),
    ) {
        let scales = exponents.map(|e| 10_f64.powi(e));
        for scales in [scales, [scales[0]; 3]] {
            let axes = std::array::from_fn(|i| {
                let mut axis = [0.0; 3];
                axis[i] = scales[i];
                axis
            });
            let frame = Frame::new(scales.map(|s| s * far), axes).unwrap();
            let grid = Grid::new([Degree::CUBIC; 3], [2; 3], frame).unwrap();
            let displacements = displacements.iter();
            let displacements =
                displacements.map(|d| std::array::from_fn(|c| d[c] * scales[c])).collect();
            check_way_back(&Lattice::new(grid, displacements).unwrap(), fractions)?;
        }
    }
}

/// A preimage is found that is one, or the search says that it gave up.
fn check_not_denied<const D: usize>(
    lattice: &Lattice<D>,
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let x = at(lattice.grid(), fractions);
    let q = lattice.deform_point(x);
    let inverse = Inverse::new(lattice);
    match inverse.point(q) {
        Ok(preimage) => {
            let y = preimage.point();
            prop_assert!(y.is_some(), "{x:?} is a preimage of {q:?}");
            let residual = distance(lattice.deform_point(y.unwrap()), q);
            // Displacements up to 3 over half a cell make Jacobians of up to 100.
            let unit = f64::EPSILON * inverse.size();
            prop_assert!(residual <= 400.0 * unit, "{}", residual / unit);
        }
        Err(error) => {
            prop_assert!(false, "{error}");
        }
    }
    Ok(())
}

/// A bar of length 12 along x, bent in its plane by the given part of a full turn: its
/// middle line becomes an arc.
fn bent(turns: f64) -> Lattice<3> {
    let cells = [12, 2, 2];
    let frame = Frame::of_box([0.0, -1.0, -1.0], [12.0, 1.0, 1.0], cells).unwrap();
    let grid = Grid::new([Degree::CUBIC; 3], cells, frame).unwrap();
    let radius = 12.0 / (turns * std::f64::consts::TAU);
    displaced(grid, |x| {
        let (s, c) = (x[0] / radius).sin_cos();
        let from_centre = radius - x[1];
        [from_centre * s - x[0], radius - from_centre * c - x[1], 0.0]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Bent so far that ends nearly meet, a bar is still found from any point.
    #[test]
    fn bent_bars_are_straightened(
        turns in 0.01..0.8_f64,
        fractions in each(0.0..=1.0_f64),
    ) {
        check_way_back(&bent(turns), fractions)?;
    }
}

#[test]
fn what_a_bent_bar_has_left_is_not_in_the_image() {
    // Half a turn around a centre above the left end of the bar.
    let lattice = bent(0.5);
    let radius = 12.0 / std::f64::consts::PI;
    // In the box of the bar, but farther than radius + 1 from the centre.
    assert_eq!(lattice.inverse_point([6.0, 0.5, 0.0]), Ok(Preimage::None));
    // The centre, which is outside the box.
    let centre = [0.0, radius, 0.0];
    assert_eq!(lattice.inverse_point(centre), Ok(Preimage::One(centre)));
}

#[test]
fn a_moved_box_covers_points_that_stay() {
    // A box of length 4 moved by half of it.
    let grid = Grid::new([Degree::CUBIC; 3], [4, 3, 2], Frame::unit()).unwrap();
    let lattice = displaced(grid, |_| [2.0, 0.0, 0.0]);
    for (q, expected) in [
        ([3.0, 1.5, 1.0], Preimage::One([1.0, 1.5, 1.0])),
        (
            [5.0, 1.5, 1.0],
            Preimage::Two([[3.0, 1.5, 1.0], [5.0, 1.5, 1.0]]),
        ),
        ([7.0, 1.5, 1.0], Preimage::One([7.0, 1.5, 1.0])),
        ([1.0, 1.5, 1.0], Preimage::None),
        ([3.0, 1.5, 2.5], Preimage::One([3.0, 1.5, 2.5])),
    ] {
        let found = lattice.inverse_point(q).unwrap();
        let points = |p: Preimage<3>| match p {
            Preimage::None => vec![],
            Preimage::One(y) => vec![y],
            Preimage::Two(both) => both.to_vec(),
        };
        let (found, expected) = (points(found), points(expected));
        assert_eq!(found.len(), expected.len(), "{q:?}: {found:?}");
        for (a, b) in found.into_iter().zip(expected) {
            // Coordinates up to 7, displacement 2, Jacobian 1.
            assert!(distance(a, b) <= 64.0 * f64::EPSILON * 9.0, "{q:?}: {a:?}");
        }
    }
}

#[test]
fn a_lattice_at_rest_has_one_preimage_everywhere() {
    let axes = [[0.3, 0.1, 0.0], [0.0, 0.7, 0.1], [0.2, 0.0, 1.1]];
    let frame = Frame::new([0.1, 0.7, -0.3], axes).unwrap();
    for border in [Border::Free, Border::Identity] {
        let grid = Grid::new([Degree::CUBIC; 3], [3; 3], frame).unwrap();
        let lattice = Lattice::at_rest(grid.with_border(border).unwrap()).unwrap();
        // Along the border, where rounding decides what is inside, and next to it.
        for i in 0..3_000_u32 {
            let f = |k: u32| f64::from(i.wrapping_mul(k) % 97) / 96.0;
            let mut fractions = [f(1), f(31), f(57)];
            fractions[i as usize % 3] = f64::from(i % 2) + f64::from(i % 11) * 2e-16;
            let q = at(lattice.grid(), fractions);
            let Ok(Preimage::One(y)) = lattice.inverse_point(q) else {
                panic!("{q:?}: {:?}", lattice.inverse_point(q));
            };
            assert!(distance(y, q) <= 64.0 * f64::EPSILON * lattice.grid().size());
        }
    }
}

#[test]
fn creases_and_folds_of_a_linear_lattice_are_told_apart() {
    // Along x, 0 1 2 3 are moved to 0 2 1 3: three preimages between 1 and 2.
    let grid = Grid::new([Degree::LINEAR; 2], [3, 1], Frame::unit()).unwrap();
    let lattice = displaced(grid, |x| match x[0] {
        1.0 => [1.0, 0.0],
        2.0 => [-1.0, 0.0],
        _ => [0.0, 0.0],
    });
    for i in 0..=300 {
        let q = [f64::from(i) / 100.0, 0.5];
        let y = lattice
            .inverse_point(q)
            .unwrap()
            .point()
            .expect("all are covered");
        assert!(distance(lattice.deform_point(y), q) <= 16.0 * f64::EPSILON * 4.0);
    }
}

#[test]
fn a_dense_fold_is_decided() {
    // All control points in one place: everything is moved there, and nothing elsewhere.
    let grid = Grid::new([Degree::new(5).unwrap(); 3], [3; 3], Frame::unit()).unwrap();
    let lattice = displaced(grid, |x| x.map(|c| 1.0 - c));
    let Ok(Preimage::One(y)) = lattice.inverse_point([1.0; 3]) else {
        panic!("the point is hit by all");
    };
    assert!(lattice.grid().contains(y));
    for off in [1e-12, 1e-6, 0.5] {
        let q = [1.0 + off, 1.0, 1.0];
        assert_eq!(lattice.inverse_point(q), Ok(Preimage::None));
    }
}

#[test]
fn bad_points_and_sizes_are_refused() {
    let grid = Grid::new([Degree::CUBIC; 2], [2, 2], Frame::unit()).unwrap();
    let mut lattice = Lattice::at_rest(grid).unwrap();
    let error = lattice.inverse_point([0.5, f64::NEG_INFINITY]).unwrap_err();
    assert_eq!(error.to_string(), "component 1 of point 0 is -inf");
    let mut points = [[0.5, 0.5], [0.5, f64::NAN]];
    let error = lattice.undo_points(&mut points).unwrap_err();
    assert!(matches!(
        error,
        InverseError::NonFinitePoint {
            index: 1,
            component: 1,
            ..
        }
    ));
    // Numbers at the end of the range, but finite.
    assert_eq!(
        lattice.inverse_point([f64::MAX, -f64::MAX]),
        Ok(Preimage::One([f64::MAX, -f64::MAX]))
    );
    lattice.set_displacement(12, [f64::MAX, 0.0]).unwrap();
    let error = lattice.inverse_point([0.5, 0.5]).unwrap_err();
    assert!(matches!(error, InverseError::TooLarge { .. }));
    assert!(lattice.undo_points(&mut points[..1]).is_err());
}

#[test]
fn without_a_budget_nothing_is_claimed() {
    let lattice = bent(0.8);
    let q = [6.0, 0.5, 0.0];
    assert_eq!(lattice.inverse_point(q), Ok(Preimage::None));
    let InverseError::Unresolved {
        nearest,
        residual,
        outside,
        ..
    } = Inverse::new(&lattice).with_budget(0).point(q).unwrap_err()
    else {
        panic!("another error");
    };
    assert!(!outside);
    let nearest: [f64; 3] = nearest.try_into().unwrap();
    let found = distance(lattice.deform_point(nearest), q);
    assert!(found > 0.1 && (found - residual).abs() <= 1e-12);
}

#[test]
fn many_points_are_undone_in_the_type_of_the_caller() {
    let grid = Grid::new([Degree::CUBIC; 3], [4, 3, 2], Frame::unit()).unwrap();
    let lattice = displaced(grid, |_| [2.0, 0.0, 0.0]);
    let mut points = [
        glam::DVec3::new(3.0, 1.5, 1.0),
        glam::DVec3::new(5.0, 1.5, 1.0),
        glam::DVec3::new(1.0, 1.5, 1.0),
        glam::DVec3::new(7.0, 1.5, 1.0),
    ];
    let report = lattice.undo_points(&mut points).unwrap();
    assert_eq!(report.two_preimages, [1]);
    assert_eq!(report.not_in_image, [2]);
    assert!(report.unresolved.is_empty() && !report.is_unique());
    let expected = [1.0, 3.0, 1.0, 7.0];
    for (point, x) in points.into_iter().zip(expected) {
        assert!(point.distance(glam::DVec3::new(x, 1.5, 1.0)) <= 64.0 * f64::EPSILON * 9.0);
    }
}

proptest! {
    /// In a frame whose axes are nearly parallel, both bounds hold with its condition
    /// number, and nothing is wrongly denied.
    #[test]
    fn nearly_parallel_axes_cost_no_more_than_their_condition(
        angle in 0.0..6.0_f64,
        along in 0.5..2.0_f64,
        across in prop_oneof![1e-4..1e-2_f64, -0.1..-1e-3_f64],
        degree in each(2_usize..=4),
        // Half a cell along each axis in all: a contraction, and more so in the middle.
        displacements in proptest::collection::vec(each::<2, _>(-0.2..0.2_f64), 49),
        fractions in each(0.01..0.99_f64),
    ) {
        let (s, c) = angle.sin_cos();
        let axes = [[c, s], [along * c - across * s, along * s + across * c]];
        let frame = Frame::new([0.5, -0.25], axes).unwrap();
        let grid = Grid::new(degree.map(|n| Degree::new(n).unwrap()), [3, 3], frame).unwrap();
        let to_world = |d: [f64; 2]| [0, 1].map(|c| d[0] * axes[0][c] + d[1] * axes[1][c]);
        let count = grid.control_point_count();
        let displacements = displacements[..count].iter().map(|&d| to_world(d)).collect();
        let lattice = Lattice::new(grid, displacements).unwrap();

        // Row sums of |A⁻¹| |A|.
        let inverse = lattice.grid().frame().inverse();
        let condition = [0, 1].map(|r| -> f64 {
            let entry = |c: usize| -> f64 {
                (0..2).map(|k| (inverse[r][k] * axes[c][k]).abs()).sum()
            };
            entry(0) + entry(1)
        });
        let condition = condition[0].max(condition[1]);

        let x = at(lattice.grid(), fractions);
        let q = lattice.deform_point(x);
        let inverse = Inverse::new(&lattice);
        let unit = f64::EPSILON * inverse.size();
        match inverse.point(q) {
            Ok(preimage) => {
                let y = preimage.point().expect("it has one");
                let residual = distance(lattice.deform_point(y), q);
                prop_assert!(residual <= 16.0 * condition * unit, "{residual} {condition}");
                let there = lattice.evaluate(x).expect("inside");
                let steepness = norm_of_inverse(&there.jacobian).max(1.0);
                let error = distance(y, x);
                prop_assert!(error <= 64.0 * condition * unit * steepness, "{error} {condition}");
            }
            Err(InverseError::Unresolved { nearest, .. }) => {
                // Rounding hides the answer, but not where it is.
                let nearest = [nearest[0], nearest[1]];
                let residual = distance(lattice.deform_point(nearest), q);
                prop_assert!(residual <= 64.0 * condition * unit, "{residual} {condition}");
            }
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        }
    }
}
