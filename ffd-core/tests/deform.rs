//! Laws of the deformation of a point, through the public interface.
#![allow(
    clippy::float_cmp,
    clippy::needless_range_loop,
    reason = "some results are equal to the last bit; indices as in the formulas"
)]

mod common;

use common::{at, displaced, each, grid, lattice, slow_sum};
use ffd_core::{Border, Degree, FfdError, Frame, Grid, Knots, Lattice, Outside};
use proptest::prelude::*;

/// Displacements `A x + b` at rest positions move every point by `A x + b`, and the
/// Jacobian is `1 + A`.
fn check_affine<const D: usize>(
    grid: Grid<D>,
    matrix: [[f64; D]; D],
    offset: [f64; D],
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let grid = grid.with_border(Border::Free).unwrap();
    let affine = |x: [f64; D]| -> [f64; D] {
        std::array::from_fn(|r| offset[r] + (0..D).map(|c| matrix[r][c] * x[c]).sum::<f64>())
    };
    let lattice = displaced(grid, affine);
    let x = at(lattice.grid(), fractions);
    let there = lattice.evaluate(x).expect("inside");
    prop_assert_eq!(there.position, lattice.deform_point(x));
    // At most 4 cells, so 6.5 from the middle of the box in lattice coordinates
    // and |x| < 20 in the world; |A x + b| < 3 · 2 · 20 + 10 = 130. A weight is
    // a product of three basis values with 30 roundings each, sums of at most 6
    // terms follow along three axes, and locating x adds a few: 130 in all.
    let tolerance = 130.0 * f64::EPSILON * 130.0;
    let moved = affine(x);
    for r in 0..D {
        prop_assert!((there.position[r] - x[r] - moved[r]).abs() <= tolerance);
        for c in 0..D {
            // Three products with entries of the inverse frame, each below 3,
            // and derivative weights that add up to at most 2 n = 10 in absolute value.
            let expected = f64::from(u8::from(r == c)) + matrix[r][c];
            prop_assert!((there.jacobian[r][c] - expected).abs() <= 90.0 * tolerance);
        }
    }
    Ok(())
}

/// Value, first and second derivatives are those of the sum over all control points,
/// straight from the definition.
fn check_slow<const D: usize>(
    lattice: &Lattice<D>,
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let grid = lattice.grid();
    let x = at(grid, fractions);
    // The slow formulation decides by rounding, as the fast one does, in which cell a
    // point lies.
    let u = grid.frame().to_lattice(x);
    let Some(there) = lattice.evaluate(x) else {
        // On the border of the domain, where `to_world` rounded outside.
        return Ok(());
    };
    // Displacements are at most 1. A weight has at most 3 · 30 roundings in either
    // formulation; the sums have at most 6³ terms that add up to 1. Derivatives weigh
    // 2 n = 10 times more for each order, and each is multiplied by an inverse frame
    // whose rows add up to less than 4.
    let tolerance = 2.0 * (90.0 + 216.0) * f64::EPSILON;
    let moved = slow_sum(lattice, u, [0; D]);
    let inverse = grid.frame().inverse();
    let second = lattice.second_derivatives(x).expect("inside");
    for r in 0..D {
        // The image is x + moved, |x| < 40: one more rounding.
        let error = (there.position[r] - (x[r] + moved[r])).abs();
        prop_assert!(error <= tolerance + 40.0 * f64::EPSILON);
        for c in 0..D {
            let mut slope = f64::from(u8::from(r == c));
            for a in 0..D {
                let mut order = [0; D];
                order[a] += 1;
                slope += slow_sum(lattice, u, order)[r] * inverse[a][c];
            }
            prop_assert!((there.jacobian[r][c] - slope).abs() <= 40.0 * tolerance);
            for d in 0..D {
                let mut expected = 0.0;
                for a in 0..D {
                    for b in 0..D {
                        let mut order = [0; D];
                        order[a] += 1;
                        order[b] += 1;
                        expected += slow_sum(lattice, u, order)[r] * inverse[a][c] * inverse[b][d];
                    }
                }
                let error = (second[r][c][d] - expected).abs();
                prop_assert!(error <= 1600.0 * tolerance, "{error} {expected}");
            }
        }
    }
    Ok(())
}

/// The Jacobian agrees with central differences of the deformation.
fn check_jacobian<const D: usize>(
    lattice: &Lattice<D>,
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    // The middle of a cell: no knot is within the reach of a difference.
    let domain = lattice.grid().domain();
    let u = std::array::from_fn(|i| {
        let [low, high] = domain[i];
        (low + (high - low) * fractions[i]).floor().min(high - 1.0) + 0.5
    });
    let x = lattice.grid().frame().to_world(u);
    let there = lattice.evaluate(x).expect("inside");
    let h = 1e-4;
    // With displacements up to 1 and basis derivatives of order k of at most 10ᵏ in
    // total, a third derivative in the world is at most 1000 times the cube of the
    // largest row sum of the inverse frame, below 4: the formula is off by
    // h²/6 · 1000 · 64. Rounding: images below 40, 130 roundings, over h.
    let tolerance = h * h / 6.0 * 64_000.0 + 130.0 * f64::EPSILON * 40.0 / h;
    for c in 0..D {
        let at = |step: f64| {
            let mut x = x;
            x[c] += step;
            lattice.deform_point(x)
        };
        let (low, high) = (at(-h), at(h));
        for r in 0..D {
            let slope = (high[r] - low[r]) / (2.0 * h);
            prop_assert!((there.jacobian[r][c] - slope).abs() <= tolerance);
        }
    }
    Ok(())
}

/// A lattice at rest moves nothing, not even by a rounding error.
fn check_rest<const D: usize>(grid: Grid<D>, fractions: [f64; D]) -> Result<(), TestCaseError> {
    let lattice = Lattice::at_rest(grid).unwrap();
    let x = at(lattice.grid(), fractions);
    prop_assert_eq!(lattice.deform_point(x), x);
    prop_assert_eq!(lattice.deform_point_with(x, Outside::Clamp).unwrap(), x);
    if let Some(there) = lattice.evaluate(x) {
        let identity =
            std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
        prop_assert_eq!(there.jacobian, identity);
        prop_assert_eq!(there.determinant.to_bits(), 1.0_f64.to_bits());
    }
    Ok(())
}

/// Cutting cells changes nothing.
fn check_refinement<const D: usize>(
    lattice: &Lattice<D>,
    factors: [usize; D],
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let fine = lattice.refine(factors).unwrap();
    let (old, new) = (lattice.grid(), fine.grid());
    let x = at(old, fractions);
    let u = old.frame().to_lattice(x);
    // The border of the domain is rounded in both; elsewhere they agree.
    let [low, high] = [0, 1].map(|end| old.domain().map(|d| d[end]));
    if (0..D).any(|i| (u[i] - low[i]).min(high[i] - u[i]) < 1e-12) {
        return Ok(());
    }
    for corner in [[0.0; D], [1.0; D]] {
        let (a, b) = (at(old, corner), at(new, corner));
        for c in 0..D {
            prop_assert!((a[c] - b[c]).abs() <= 64.0 * 40.0 * f64::EPSILON);
        }
    }
    // Displacements up to 1: an image has an error of (90 + 216) ε in either lattice,
    // a new control point one of 30 + 6 roundings an axis; the position within the
    // frame is rounded at magnitude 40, amplified by its inverse, and weighs as much as
    // slopes do: 4 · 10 · 64 · 40.
    let tolerance = (2.0 * 306.0 + 3.0 * 36.0 + 10.0 * 4.0 * 64.0 * 40.0) * f64::EPSILON;
    let (a, b) = (lattice.deform_point(x), fine.deform_point(x));
    for c in 0..D {
        prop_assert!((a[c] - b[c]).abs() <= tolerance, "{a:?} {b:?}");
    }
    Ok(())
}

/// With an identity border, the deformation joins the identity at the border of its
/// domain: displacements vanish there, and so do derivatives if the degree is above 1.
fn check_border<const D: usize>(
    lattice: &Lattice<D>,
    axis: usize,
    upper: bool,
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let grid = lattice
        .grid()
        .clone()
        .with_knots([Knots::Uniform; D])
        .unwrap();
    let grid = grid.with_border(Border::Identity).unwrap();
    let lattice = Lattice::new(grid, lattice.displacements().to_vec()).unwrap();
    let grid = lattice.grid();
    let mut fractions = fractions;
    fractions[axis] = f64::from(u8::from(upper));
    let x = at(grid, fractions);
    // Rounding places x within 64 · 40 ε of the border, in lattice coordinates four
    // times that, where displacements grow no faster than 2 per cell.
    let tolerance = 2.0 * 4.0 * 64.0 * 40.0 * f64::EPSILON;
    let image = lattice.deform_point_with(x, Outside::Clamp).unwrap();
    for c in 0..D {
        prop_assert!((image[c] - x[c]).abs() <= tolerance);
    }
    if let Some(there) = lattice.evaluate(x)
        && grid.degree().iter().all(|n| n.get() > 1)
    {
        for r in 0..D {
            for c in 0..D {
                let identity = f64::from(u8::from(r == c));
                prop_assert!((there.jacobian[r][c] - identity).abs() <= 40.0 * tolerance);
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn affine_displacements_are_reproduced_in_2d(
        grid in grid::<2>(4),
        matrix in each(each(-2.0..2.0_f64)),
        offset in each(-10.0..10.0_f64),
        fractions in each(0.01..0.99_f64),
    ) {
        check_affine(grid, matrix, offset, fractions)?;
    }

    #[test]
    fn affine_displacements_are_reproduced_in_3d(
        grid in grid::<3>(4),
        matrix in each(each(-2.0..2.0_f64)),
        offset in each(-10.0..10.0_f64),
        fractions in each(0.01..0.99_f64),
    ) {
        check_affine(grid, matrix, offset, fractions)?;
    }

    #[test]
    fn a_lattice_at_rest_is_the_identity_in_2d(grid in grid::<2>(4), x in each(-0.2..=1.2_f64)) {
        check_rest(grid, x)?;
    }

    #[test]
    fn a_lattice_at_rest_is_the_identity_in_3d(grid in grid::<3>(4), x in each(-0.2..=1.2_f64)) {
        check_rest(grid, x)?;
    }

    #[test]
    fn values_and_derivatives_are_those_of_the_definition_in_2d(
        lattice in lattice::<2>(4, 1.0),
        fractions in each(0.0..=1.0_f64),
    ) {
        check_slow(&lattice, fractions)?;
    }

    #[test]
    fn jacobian_is_the_limit_of_differences_in_2d(
        lattice in lattice::<2>(3, 1.0),
        fractions in each(0.0..1.0_f64),
    ) {
        check_jacobian(&lattice, fractions)?;
    }

    #[test]
    fn jacobian_is_the_limit_of_differences_in_3d(
        lattice in lattice::<3>(2, 1.0),
        fractions in each(0.0..1.0_f64),
    ) {
        check_jacobian(&lattice, fractions)?;
    }

    #[test]
    fn refinement_keeps_the_deformation_in_2d(
        lattice in lattice::<2>(4, 1.0),
        factors in each(1_usize..=4),
        fractions in each(0.0..=1.0_f64),
    ) {
        check_refinement(&lattice, factors, fractions)?;
    }

    #[test]
    fn an_identity_border_joins_the_identity_in_2d(
        lattice in lattice::<2>(3, 1.0),
        axis in 0_usize..2,
        upper in any::<bool>(),
        fractions in each(0.0..=1.0_f64),
    ) {
        check_border(&lattice, axis, upper, fractions)?;
    }

    #[test]
    fn an_identity_border_joins_the_identity_in_3d(
        lattice in lattice::<3>(2, 1.0),
        axis in 0_usize..3,
        upper in any::<bool>(),
        fractions in each(0.0..=1.0_f64),
    ) {
        check_border(&lattice, axis, upper, fractions)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn values_and_derivatives_are_those_of_the_definition_in_3d(
        lattice in lattice::<3>(2, 1.0),
        fractions in each(0.0..=1.0_f64),
    ) {
        check_slow(&lattice, fractions)?;
    }

    #[test]
    fn refinement_keeps_the_deformation_in_3d(
        lattice in lattice::<3>(3, 1.0),
        factors in each(1_usize..=3),
        fractions in each(0.0..=1.0_f64),
    ) {
        check_refinement(&lattice, factors, fractions)?;
    }
}

const CUBIC: [Degree; 2] = [Degree::CUBIC; 2];

#[test]
fn the_closed_box_is_the_domain() {
    let grid = Grid::new(CUBIC, [2, 3], Frame::unit()).unwrap();
    let lattice = displaced(grid, |_| [1.0, 0.0]);
    for inside in [[0.0, 0.0], [2.0, 3.0], [0.0, 3.0], [1.0, 2.0]] {
        assert!(lattice.grid().contains(inside));
        assert!((lattice.deform_point(inside)[0] - inside[0] - 1.0).abs() < 1e-15);
        assert!(lattice.evaluate(inside).is_some());
    }
    for outside in [[-1e-300, 1.0], [2.0_f64.next_up(), 1.0], [1.0, 3.5]] {
        assert_eq!(lattice.deform_point(outside), outside);
        assert_eq!(lattice.evaluate(outside), None);
        assert_eq!(
            lattice.deform_point_with(outside, Outside::Error),
            Err(FfdError::PointOutside {
                index: 0,
                point: outside.to_vec()
            })
        );
        let clamped = lattice.deform_point_with(outside, Outside::Clamp).unwrap();
        assert!((clamped[0] - outside[0] - 1.0).abs() < 1e-15, "{clamped:?}");
    }
    for value in [f64::NAN, f64::INFINITY] {
        assert!(!lattice.grid().contains([value, 1.0]));
        assert_eq!(lattice.evaluate([1.0, value]), None);
        let error = lattice
            .deform_point_with([1.0, value], Outside::Keep)
            .unwrap_err();
        assert!(matches!(
            error,
            FfdError::NonFinitePoint {
                index: 0,
                component: 1,
                ..
            }
        ));
    }
}

#[test]
fn a_control_point_moves_what_is_near_by_its_basis_function() {
    // Bilinear, with only control point (1, 1) moved: a tent of height 1.
    let grid = Grid::new([Degree::LINEAR; 2], [2, 2], Frame::unit()).unwrap();
    let mut lattice = Lattice::at_rest(grid).unwrap();
    lattice.set_displacement(4, [1.0, 0.0]).unwrap();
    assert_eq!(lattice.deform_point([1.0, 1.0]), [2.0, 1.0]);
    assert_eq!(lattice.deform_point([0.5, 1.5]), [0.75, 1.5]);
    assert_eq!(lattice.deform_point([2.0, 1.0]), [2.0, 1.0]);
    // At the crease the cell above counts.
    let crease = lattice.evaluate([1.0, 1.0]).unwrap();
    assert_eq!(crease.jacobian, [[0.0, -1.0], [0.0, 1.0]]);
    assert_eq!(crease.determinant.to_bits(), 0.0_f64.to_bits());
}

#[test]
fn a_bezier_lattice_is_one_of_bernstein_polynomials() {
    // Corner control points are the corners of the box: moving one moves that corner.
    let frame = Frame::of_box([0.0; 2], [2.0, 4.0], [1, 1]).unwrap();
    let grid = Grid::bezier(CUBIC, frame).unwrap();
    assert_eq!(grid.control_points_per_axis(), [4, 4]);
    assert_eq!(grid.rest_position(15), [2.0, 4.0]);
    let mut lattice = Lattice::at_rest(grid).unwrap();
    lattice.set_displacement(15, [1.0, 1.0]).unwrap();
    assert_eq!(lattice.deform_point([2.0, 4.0]), [3.0, 5.0]);
    // (1/2)³ of it along each axis in the middle.
    assert_eq!(
        lattice.deform_point([1.0, 2.0]),
        [1.0 + 1.0 / 64.0, 2.0 + 1.0 / 64.0]
    );
}

#[test]
fn control_points_are_counted_and_placed_in_linear_order() {
    let frame = Frame::new([100.0, 0.0], [[10.0, 0.0], [0.0, 1.0]]).unwrap();
    let grid = Grid::new([Degree::LINEAR, Degree::CUBIC], [2, 1], frame).unwrap();
    assert_eq!(grid.control_points_per_axis(), [3, 4]);
    assert_eq!(grid.control_point_count(), 12);
    for (index, position) in [
        (0, [100.0, -1.0]),
        (2, [120.0, -1.0]),
        (3, [100.0, 0.0]),
        (11, [120.0, 2.0]),
    ] {
        assert_eq!(grid.rest_position(index), position);
        assert_eq!(grid.control_point(grid.control_point_indices(index)), index);
    }
}

#[test]
fn bad_input_is_named() {
    let grid = Grid::new(CUBIC, [1, 0], Frame::unit()).unwrap_err();
    assert_eq!(grid, FfdError::NoCells { axis: 1 });
    for cells in [usize::MAX, usize::MAX - 3, 1 << 40] {
        let error = Grid::new(CUBIC, [cells, cells], Frame::unit()).unwrap_err();
        assert_eq!(
            error,
            FfdError::TooManyControlPoints {
                cells: vec![cells; 2]
            }
        );
    }
    let grid = Grid::new(CUBIC, [1, 1], Frame::unit()).unwrap();
    assert_eq!(
        Lattice::new(grid.clone(), vec![[0.0; 2]; 15]),
        Err(FfdError::DisplacementCount {
            expected: 16,
            found: 15
        })
    );
    let mut displacements = vec![[0.0; 2]; 16];
    displacements[7][1] = f64::NEG_INFINITY;
    let error = Lattice::new(grid.clone(), displacements.clone()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "component 1 of the displacement of control point 7 is -inf"
    );
    let mut lattice = Lattice::at_rest(grid.clone()).unwrap();
    let before = lattice.clone();
    assert_eq!(
        lattice.set_displacements(&displacements),
        Err(error.clone())
    );
    assert_eq!(
        lattice.add_displacements(&displacements),
        Err(error.clone())
    );
    assert_eq!(lattice.set_displacement(7, displacements[7]), Err(error));
    assert_eq!(lattice, before);
    let huge = vec![[f64::MAX; 2]; 16];
    lattice.set_displacements(&huge).unwrap();
    assert!(
        lattice.add_displacements(&huge).is_err(),
        "the sum overflows"
    );
    assert_eq!(lattice.refine([2, 0]), Err(FfdError::NoCells { axis: 1 }));
    assert!(matches!(
        before.refine([usize::MAX, 2]),
        Err(FfdError::TooManyControlPoints { .. })
    ));
    let clamped = grid.with_knots([Knots::Uniform, Knots::Clamped]).unwrap();
    assert_eq!(
        clamped.with_border(Border::Identity),
        Err(FfdError::ClampedBorder { axis: 1 })
    );
}

/// However they depend on each other.
#[test]
fn flat_frames_are_refused() {
    let x = [1.0, 0.0, 0.0];
    let y = [0.0, 1.0, 0.0];
    for axes in [
        [x, x, y],
        [x, y, x],
        [y, x, x],
        [x, x, x],
        [x, y, [3.0, -2.0, 0.0]],
    ] {
        let scaled = [axes[0], axes[1].map(|c| 2.0 * c), axes[2].map(|c| -0.5 * c)];
        let error = Frame::new([0.0; 3], scaled).unwrap_err();
        assert!(
            matches!(error, FfdError::SingularFrame { volume } if volume < 1e-10),
            "{error}"
        );
    }
    let error = Frame::of_box([0.0; 2], [1.0; 2], [1, 0]).unwrap_err();
    assert_eq!(error, FfdError::NoCells { axis: 1 });
}

/// A refined lattice that does not fit into memory is refused, before anything is.
#[test]
fn refinement_beyond_memory_is_refused() {
    let grid = Grid::new([Degree::CUBIC; 3], [2, 1, 1], Frame::unit()).unwrap();
    let lattice = Lattice::at_rest(grid).unwrap();
    assert!(matches!(
        lattice.refine([1 << 50, 1, 1]),
        Err(FfdError::TooManyControlPoints { .. })
    ));
    // The grid alone takes no memory.
    let huge = Grid::new([Degree::CUBIC; 3], [1 << 50, 1, 1], Frame::unit()).unwrap();
    assert!(matches!(
        Lattice::at_rest(huge),
        Err(FfdError::TooManyControlPoints { .. })
    ));
    let axis = ffd_core::Axis::new(Degree::CUBIC, usize::MAX, Knots::Clamped);
    assert!(matches!(axis, Err(FfdError::TooManyControlPoints { .. })));
}
