//! Laws of the deformation, through the public interface.

use ffd_core::{Degree, FfdError, Frame, Lattice};
use proptest::array::{uniform2, uniform3};
use proptest::collection::vec;
use proptest::prelude::*;

fn degree() -> impl Strategy<Value = Degree> {
    (1_usize..=5).prop_map(|n| Degree::new(n).unwrap())
}

/// A skewed and mirrored frame, to catch mixed-up rows, columns and signs.
/// Its axes are at least 0.5 long and its inverse has entries below 3.
fn frame_2d() -> Frame<2> {
    Frame::new([3.0, -1.0], [[0.5, 0.25], [0.5, -1.0]]).unwrap()
}

fn frame_3d() -> Frame<3> {
    let axes = [[0.5, 0.25, 0.0], [0.125, 1.0, -0.25], [0.0, 0.5, -1.5]];
    Frame::new([3.0, -1.0, 2.0], axes).unwrap()
}

/// A world point with lattice coordinates at the given fractions of the box.
fn point<const D: usize>(lattice: &Lattice<D>, fractions: [f64; D]) -> [f64; D] {
    let cells = lattice.cells();
    let u = std::array::from_fn(|i| fractions[i] * cells[i] as f64);
    lattice.frame().to_world(u)
}

fn lattice<const D: usize>(
    degree: [Degree; D],
    cells: [usize; D],
    frame: Frame<D>,
    displacement: impl Fn(usize, [f64; D]) -> [f64; D],
) -> Lattice<D> {
    let rest = Lattice::at_rest(degree, cells, frame).unwrap();
    let displacements = (0..rest.control_point_count())
        .map(|i| displacement(i, rest.rest_position(i)))
        .collect();
    Lattice::new(degree, cells, frame, displacements).unwrap()
}

/// Displacements `A x + b` at rest positions move every point by `A x + b`.
fn check_affine<const D: usize>(
    degree: [Degree; D],
    cells: [usize; D],
    frame: Frame<D>,
    matrix: [[f64; D]; D],
    offset: [f64; D],
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let affine = |x: [f64; D]| -> [f64; D] {
        std::array::from_fn(|r| offset[r] + (0..D).map(|c| matrix[r][c] * x[c]).sum::<f64>())
    };
    let lattice = lattice(degree, cells, frame, |_, x| affine(x));
    let x = point(&lattice, fractions);
    let image = lattice.deform_point(x).expect("inside");
    let jacobian = lattice.jacobian_at(x).expect("inside");
    // At most 4 cells, so 6.5 from the middle of the box in lattice coordinates
    // and |x| < 20 in the world; |A x + b| < 3 · 2 · 20 + 10 = 130. A weight is
    // a product of three basis values with 20 roundings each, sums of at most 6
    // terms follow along three axes, and locating x adds a few: 100 in all.
    let tolerance = 100.0 * f64::EPSILON * 130.0;
    let moved = affine(x);
    for r in 0..D {
        prop_assert!((image[r] - x[r] - moved[r]).abs() <= tolerance);
        for c in 0..D {
            // Three products with entries of the inverse frame, each below 3,
            // and derivative weights that add up to 2 in absolute value.
            let expected = f64::from(u8::from(r == c)) + matrix[r][c];
            prop_assert!((jacobian[r][c] - expected).abs() <= 18.0 * tolerance);
        }
    }
    Ok(())
}

/// The Jacobian agrees with central differences of the deformation.
fn check_jacobian<const D: usize>(
    degree: [Degree; D],
    frame: Frame<D>,
    displacements: &[[f64; D]],
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let lattice = lattice(degree, [2; D], frame, |i, _| displacements[i]);
    // The middle of a cell: no knot is within the reach of a difference.
    let x = point(
        &lattice,
        fractions.map(|f| 0.25 + 0.5 * f64::from(u8::from(f > 0.5)) + 0.1 * (f - 0.5)),
    );
    let jacobian = lattice.jacobian_at(x).expect("inside");
    let h = 1e-4;
    // With displacements up to 1 and basis derivatives of order k of at most 2ᵏ
    // in total, a third derivative in the world is at most 8 times the cube of
    // the largest row sum of the inverse frame, below 4: the formula is off by
    // h²/6 · 8 · 64. Rounding: images below 20, 100 roundings, over h.
    let tolerance = h * h / 6.0 * 512.0 + 100.0 * f64::EPSILON * 20.0 / h;
    for c in 0..D {
        let at = |step: f64| {
            let mut x = x;
            x[c] += step;
            lattice.deform_point(x).expect("inside")
        };
        let (low, high) = (at(-h), at(h));
        for r in 0..D {
            let slope = (high[r] - low[r]) / (2.0 * h);
            prop_assert!(
                (jacobian[r][c] - slope).abs() <= tolerance,
                "J[{r}][{c}]: {} and {slope}",
                jacobian[r][c]
            );
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// An affine field of displacements is reproduced in 2-D, for every degree …
    #[test]
    fn affine_displacements_are_reproduced_in_2d(
        degree in uniform2(degree()),
        cells in uniform2(1_usize..=4),
        matrix in uniform2(uniform2(-2.0..2.0_f64)),
        offset in uniform2(-10.0..10.0_f64),
        fractions in uniform2(0.01..0.99_f64),
    ) {
        check_affine(degree, cells, frame_2d(), matrix, offset, fractions)?;
    }

    /// … and in 3-D.
    #[test]
    fn affine_displacements_are_reproduced_in_3d(
        degree in uniform3(degree()),
        cells in uniform3(1_usize..=4),
        matrix in uniform3(uniform3(-2.0..2.0_f64)),
        offset in uniform3(-10.0..10.0_f64),
        fractions in uniform3(0.01..0.99_f64),
    ) {
        check_affine(degree, cells, frame_3d(), matrix, offset, fractions)?;
    }

    /// A lattice at rest moves nothing, not even by a rounding error.
    #[test]
    fn a_lattice_at_rest_is_the_identity_bit_by_bit(
        degree in uniform3(degree()),
        fractions in uniform3(0.01..0.99_f64),
    ) {
        let lattice = Lattice::at_rest(degree, [3, 1, 2], frame_3d()).unwrap();
        let x = point(&lattice, fractions);
        let image = lattice.deform_point(x).expect("inside");
        // Adding 0 makes +0 of −0 and changes nothing else.
        prop_assert_eq!(image.map(f64::to_bits), x.map(|c| (c + 0.0).to_bits()));
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        prop_assert_eq!(lattice.jacobian_at(x), Some(identity));
    }

    /// The Jacobian is the derivative, in 2-D …
    #[test]
    fn jacobian_is_the_limit_of_differences_in_2d(
        degree in uniform2(degree()),
        displacements in vec(uniform2(-1.0..1.0_f64), 49),
        fractions in uniform2(0.0..1.0_f64),
    ) {
        check_jacobian(degree, frame_2d(), &displacements, fractions)?;
    }

    /// … and in 3-D.
    #[test]
    fn jacobian_is_the_limit_of_differences_in_3d(
        degree in uniform3(degree()),
        displacements in vec(uniform3(-1.0..1.0_f64), 343),
        fractions in uniform3(0.0..1.0_f64),
    ) {
        check_jacobian(degree, frame_3d(), &displacements, fractions)?;
    }
}

#[test]
fn the_closed_box_is_the_domain() {
    let lattice = Lattice::at_rest([Degree::CUBIC; 2], [2, 3], Frame::unit()).unwrap();
    for inside in [[0.0, 0.0], [2.0, 3.0], [0.0, 3.0], [1.0, 2.0]] {
        assert_eq!(lattice.deform_point(inside), Some(inside));
        assert!(lattice.jacobian_at(inside).is_some());
    }
    let outside = [
        [-1e-300, 1.0],
        [2.0_f64.next_up(), 1.0],
        [1.0, 3.5],
        [f64::NAN, 1.0],
        [1.0, f64::INFINITY],
    ];
    for x in outside {
        assert_eq!(lattice.deform_point(x), None);
        assert_eq!(lattice.jacobian_at(x), None);
    }
}

#[test]
fn a_control_point_moves_what_is_near_by_its_basis_function() {
    // Bilinear, with only control point (1, 1) moved: a tent of height 1.
    let linear = [Degree::LINEAR; 2];
    let lattice = lattice(linear, [2, 2], Frame::unit(), |i, _| {
        [f64::from(u8::from(i == 4)), 0.0]
    });
    assert_eq!(lattice.deform_point([1.0, 1.0]), Some([2.0, 1.0]));
    assert_eq!(lattice.deform_point([0.5, 1.5]), Some([0.75, 1.5]));
    assert_eq!(lattice.deform_point([2.0, 1.0]), Some([2.0, 1.0]));
    // At the crease the cell above counts.
    assert_eq!(
        lattice.jacobian_at([1.0, 1.0]),
        Some([[0.0, -1.0], [0.0, 1.0]])
    );
}

#[test]
fn errors_name_index_and_value() {
    let mut displacements = vec![[0.0; 3]; 64];
    displacements[5][2] = f64::NEG_INFINITY;
    let error = Lattice::new([Degree::CUBIC; 3], [1; 3], Frame::unit(), displacements).unwrap_err();
    assert_eq!(
        error.to_string(),
        "component 2 of the displacement of control point 5 is -inf"
    );
    assert!(matches!(error, FfdError::NonFiniteDisplacement { .. }));
}
