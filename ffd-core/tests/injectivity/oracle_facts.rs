//! What the oracle says, against closed forms and against evaluation in doubles.

use crate::claims::Judge;
use crate::common::{displaced, lattice};
use crate::families::{Ring, square, with_determinant};
use crate::oracle::{Oracle, det_above, exact};
use dashu_ratio::RBig;
use ffd_core::{Degree, Evidence, Frame, Grid, Lattice, Outcome, Place, Theorem};
use proptest::prelude::*;

/// The oracle agrees with itself (the Bernstein form at its corners, and values from
/// the recursion) and with the crate's evaluation up to rounding.
fn check_evaluation<const D: usize>(
    lattice: &Lattice<D>,
    fractions: [f64; D],
    corner: [bool; D],
) -> Result<(), TestCaseError> {
    let oracle = Oracle::new(lattice);
    let grid = lattice.grid();
    // A cell and a position in it.
    let scaled: [f64; D] = std::array::from_fn(|i| fractions[i] * oracle.cells[i] as f64);
    let cell = std::array::from_fn(|i| (scaled[i] as usize).min(oracle.cells[i] - 1));
    let t: [f64; D] = std::array::from_fn(|i| scaled[i] - cell[i] as f64);

    let (det, one) = oracle.det(cell);
    let index: [usize; D] = std::array::from_fn(|i| usize::from(corner[i]) * det.degree[i]);
    let count = det.degree.map(|n| n + 1);
    let place = (0..D)
        .rev()
        .fold(0, |sum, axis| sum * count[axis] + index[axis]);
    let corner_value = RBig::from(det.coefficients[place].clone()) / RBig::from(one);
    let corner = corner.map(|high| f64::from(u8::from(high)));
    prop_assert_eq!(corner_value, oracle.det_at(cell, corner));

    let world = grid.frame().to_world(std::array::from_fn(|i| {
        grid.domain()[i][0] + cell[i] as f64 + t[i]
    }));
    let Some(evaluation) = lattice.evaluate(world) else {
        return Ok(());
    };
    // World positions are below 30 and 4 ε away from the exact ones; lattice coordinates
    // then are 16 ε · 30 away, where displacements change by at most 10 per cell and axis
    // (slopes of basis functions add up to at most 2n) …
    let image = oracle.image(cell, t).map(|x| x.to_f64_fast());
    for c in 0..D {
        let error = (image[c] - evaluation.position[c]).abs();
        prop_assert!(error <= 5e4 * f64::EPSILON, "{error}");
    }
    // … and the Jacobian, of entries up to 120, by ten times that: a product of three
    // entries is off by less than 1e6 · 120² · ε · 6. At a knot of degree 1 it jumps.
    let smooth = (0..D).all(|i| grid.degree()[i].get() > 1 || (0.001..0.999).contains(&t[i]));
    if smooth {
        let det = oracle.det_at(cell, t).to_f64_fast();
        let matrix = evaluation.jacobian;
        let exact_matrix = matrix.map(|row| row.map(exact));
        let found = crate::oracle::determinant(&exact_matrix).to_f64_fast();
        prop_assert!((found - det).abs() <= 1e-5, "{found} for {det}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn oracle_evaluates_2d(
        lattice in lattice::<2>(3, 1.0),
        fractions in crate::common::each::<2, _>(0.0..=1.0_f64),
        corner in crate::common::each::<2, _>(any::<bool>()),
    ) {
        check_evaluation(&lattice, fractions, corner)?;
    }

    #[test]
    fn oracle_evaluates_3d(
        lattice in lattice::<3>(2, 1.0),
        fractions in crate::common::each::<3, _>(0.0..=1.0_f64),
        corner in crate::common::each::<3, _>(any::<bool>()),
    ) {
        check_evaluation(&lattice, fractions, corner)?;
    }
}

/// An affine map of the plane: det J is the same number everywhere.
#[test]
fn affine_maps_have_a_constant_determinant() {
    let grid = Grid::new(
        [Degree::CUBIC, Degree::new(5).unwrap()],
        [2, 3],
        Frame::unit(),
    )
    .unwrap();
    // J = [[1.5, 0.25], [-0.5, 1]], det J = 1.625.
    let lattice = displaced(grid, |[x, y]| [0.5 * x + 0.25 * y, -0.5 * x]);
    let oracle = Oracle::new(&lattice);
    for cell in oracle.all_cells() {
        let (det, one) = oracle.det(cell);
        for c in det.coefficients {
            assert_eq!(RBig::from(c) / RBig::from(one.clone()), exact(1.625));
        }
    }
    assert!(oracle.signs(0).only_positive());
}

/// Touching zero at a corner of a part is seen; elsewhere the oracle gives up, and says so.
#[test]
fn zeros_are_found_where_halving_meets_them() {
    let cubic = || Grid::new([Degree::CUBIC; 2], [2, 1], Frame::unit()).unwrap();
    let thirds = |n: i64| RBig::from(n) / RBig::from(3);
    let touching = |offset: RBig, factor: i64| {
        let square = square([1, 0], offset, RBig::from(factor));
        let (lattice, unrounded) = with_determinant(cubic(), &square);
        assert!(unrounded);
        lattice
    };
    // 3 (x − 1/2)²
    let signs = Oracle::new(&touching(RBig::ONE / RBig::from(2), 12)).signs(10);
    assert!(signs.positive && signs.zero && !signs.negative && !signs.open);
    // 9 (x − 1/3)²
    let signs = Oracle::new(&touching(thirds(1), 9)).signs(50);
    assert!(signs.positive && !signs.zero && !signs.negative && signs.open);
    // 9 (x − 1/3)² − 1/16 and + 1/16, by comparison.
    let lattice = touching(thirds(1), 9);
    let oracle = Oracle::new(&lattice);
    let above = |level: f64| det_above(&oracle.det([0, 0]), level).signs(50);
    assert!(above(0.0625).both());
    assert!(above(-0.0625).only_positive());
    // The determinant is what was asked for.
    assert_eq!(
        oracle.det_at([1, 0], [0.5, 0.25]),
        exact(9.0) * thirds(7).sqr() / exact(4.0)
    );
}

/// A ring that closes exactly: points at its ends coincide, and that is proven of points
/// near them, not of others.
#[test]
fn overlaps_are_proven_where_they_are() {
    let lattice = Ring::new(3, 13, 12).lattice(Frame::unit(), |_, _| [0.0; 2]);
    let oracle = Oracle::new(&lattice);
    assert!(oracle.signs(0).only_positive());
    let (a, b) = ([0.25, 0.5], [0.25, 0.5]);
    assert_eq!(oracle.image([0, 0], a), oracle.image([12, 0], b));

    let place = |(cell, t): ([usize; 2], [f64; 2])| Place {
        cell,
        t,
        world: [cell[0] as f64 + t[0], t[1]],
    };
    let prove = |first, second, radius| oracle.prove_overlap(&place(first), &place(second), radius);
    let near = [0.25 + 1e-9, 0.5 - 1e-9];
    assert_eq!(prove(([0, 0], a), ([12, 0], near), 1e-8), Ok(()));
    assert_eq!(prove(([12, 0], a), ([0, 0], near), 1e-8), Ok(()));
    // Not in the box; the same point; not in the domain.
    assert!(prove(([0, 0], a), ([12, 0], near), 1e-10).is_err());
    assert!(prove(([0, 0], a), ([0, 0], near), 1e-8).is_err());
    assert!(prove(([0, 0], a), ([13, 0], near), 1e-8).is_err());
    assert!(prove(([1, 0], a), ([12, 0], near), 1e-2).is_err());

    // In space, around another axis.
    let ring = Ring {
        along: 2,
        ..Ring::new(2, 14, 12)
    };
    let lattice = ring.lattice::<3>(Frame::unit(), |_, _| [0.0; 3]);
    let oracle = Oracle::new(&lattice);
    let place = |cell, t| Place {
        cell: [0, 0, cell],
        t,
        world: [t[0], t[1], cell as f64 + t[2]],
    };
    let (point, other) = (place(1, [0.5; 3]), place(13, [0.5, 0.5 - 1e-9, 0.5 + 1e-9]));
    assert_eq!(oracle.prove_overlap(&point, &other, 1e-8), Ok(()));
    assert!(oracle.prove_overlap(&point, &other, 1e-10).is_err());
}

/// What is wrong with a claim is found, whatever the claim.
#[test]
fn false_claims_are_refuted() {
    let grid = || Grid::new([Degree::QUADRATIC; 2], [2, 1], Frame::unit()).unwrap();
    let place = |cell: [usize; 2], t: [f64; 2]| Place {
        cell,
        t,
        world: [cell[0] as f64 + t[0], cell[1] as f64 + t[1]],
    };
    let (a, b) = (place([0, 0], [0.0, 0.0]), place([1, 0], [1.0, 0.5]));
    let both =
        |positive, negative| Outcome::NotInjective(Evidence::BothSigns { positive, negative });
    let p_matrix = |after| Outcome::Injective(Theorem::PMatrix { after });
    let monotone = |after| Outcome::Injective(Theorem::Monotone { after });
    let zero = |zero, reversed| Outcome::Degenerate { zero, reversed };
    let (one, minus_one) = ([[1.0, 0.0], [0.0, 1.0]], [[-1.0, 0.0], [0.0, 1.0]]);
    let overlap = Outcome::NotInjective(Evidence::Overlap {
        point: a,
        other: b,
        radius: 0.25,
    });
    let all = [
        Outcome::LocallyInjective,
        Outcome::Reversed,
        Outcome::Injective(Theorem::IdentityBorder),
        Outcome::Injective(Theorem::DisplacementBound),
        both(a, b),
        both(b, a),
        both(a, a),
        zero(a, false),
        zero(b, true),
        p_matrix(one),
        p_matrix(minus_one),
        monotone(one),
        monotone(minus_one),
        overlap,
    ];
    let right = |lattice: Lattice<2>| -> Vec<usize> {
        let judge = Judge::new(&lattice, 20);
        let right = |i: &usize| judge.check_outcome(&all[*i]).is_ok();
        (0..all.len()).filter(right).collect()
    };
    // det J = 1, 1.5, −1, 0, and 1 − x/2 · 2 from 1 to −1.
    assert_eq!(right(Lattice::at_rest(grid()).unwrap()), [0, 3, 9, 11]);
    assert_eq!(
        right(displaced(grid(), |[x, _]| [0.5 * x, 0.0])),
        [0, 3, 9, 11]
    );
    assert_eq!(right(displaced(grid(), |[x, _]| [-2.0 * x, 0.0])), [1]);
    assert_eq!(right(displaced(grid(), |[x, _]| [-x, 0.0])), [7, 8]);
    let folded = with_determinant(grid(), &vec![([0, 0], RBig::ONE), ([1, 0], RBig::from(-1))]);
    assert_eq!(right(folded.0), [4]);
    // A place must be where it is said to be, and in the domain.
    let mut elsewhere = a;
    elsewhere.world[0] = 0.125;
    let judged = displaced(grid(), |[x, _]| [-x, 0.0]);
    let judge = Judge::new(&judged, 20);
    assert!(judge.check_outcome(&zero(elsewhere, false)).is_err());
    assert!(
        judge
            .check_outcome(&zero(place([2, 0], [0.0; 2]), false))
            .is_err()
    );
}
