//! Laws of lattices applied one after another.
#![expect(clippy::float_cmp, reason = "the same operations give the same bits")]

mod common;

use common::{at, displaced, each, grid, lattice};
use ffd_core::{Degree, FfdError, Frame, Grid, Lattice, Outside, Sequence};
use proptest::prelude::*;

/// A sequence does what its lattices do one by one, and its Jacobian is the product of
/// theirs.
fn check_composition<const D: usize>(
    a: &Lattice<D>,
    b: &Lattice<D>,
    fractions: [f64; D],
) -> Result<(), TestCaseError> {
    let mut sequence = Sequence::from(a.clone());
    sequence.push(b.clone());
    let x = at(a.grid(), fractions);
    let middle = a.deform_point(x);
    prop_assert_eq!(sequence.deform_point(x), b.deform_point(middle));
    prop_assert_eq!(
        sequence.deform_point_with(x, Outside::Clamp),
        a.deform_point_with(x, Outside::Clamp)
            .and_then(|y| b.deform_point_with(y, Outside::Clamp))
    );
    let there = sequence.evaluate(x).expect("finite");
    prop_assert_eq!(there.position, sequence.deform_point(x));
    let identity = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
    let [ja, jb]: [[[f64; D]; D]; 2] =
        [(a, x), (b, middle)].map(|(l, x)| l.evaluate(x).map_or(identity, |e| e.jacobian));
    // Entries of a Jacobian are at most 1 + 2 · 5 · 1 · 4 = 41: a sum of three products.
    let tolerance = 4.0 * f64::EPSILON * 3.0 * 41.0 * 41.0;
    for r in 0..D {
        for c in 0..D {
            let sum: f64 = (0..D).map(|k| jb[r][k] * ja[k][c]).sum();
            prop_assert!((there.jacobian[r][c] - sum).abs() <= tolerance);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn lattices_are_applied_in_order_in_2d(
        a in lattice::<2>(3, 1.0),
        b in lattice::<2>(3, 1.0),
        x in each(-0.1..=1.1_f64),
    ) {
        check_composition(&a, &b, x)?;
    }

    #[test]
    fn lattices_are_applied_in_order_in_3d(
        a in lattice::<3>(2, 1.0),
        b in lattice::<3>(2, 1.0),
        x in each(-0.1..=1.1_f64),
    ) {
        check_composition(&a, &b, x)?;
    }

    #[test]
    fn without_lattices_nothing_moves(grid in grid::<2>(3), x in each(-1.0..2.0_f64)) {
        let x = at(&grid, x);
        let nothing = Sequence::default();
        prop_assert_eq!(nothing.deform_point(x), x);
        prop_assert_eq!(nothing.deform_point_with(x, Outside::Error), Ok(x));
        let there = nothing.evaluate(x).unwrap();
        prop_assert_eq!((there.position, there.jacobian), (x, [[1.0, 0.0], [0.0, 1.0]]));
    }
}

#[test]
fn a_point_that_leaves_a_lattice_is_named_as_that_lattice_sees_it() {
    let grid = Grid::new([Degree::CUBIC; 2], [2, 2], Frame::unit()).unwrap();
    let shift = displaced(grid, |_| [1.5, 0.0]);
    let sequence = Sequence::new(vec![shift.clone(), shift]);
    assert_eq!(
        sequence.deform_point_with([1.0, 1.0], Outside::Error),
        Err(FfdError::PointOutside {
            index: 0,
            point: vec![2.5, 1.0]
        })
    );
    assert_eq!(sequence.deform_point([1.0, 1.0]), [2.5, 1.0]);
    for point in [[f64::NAN, 0.0], [f64::INFINITY, 0.0]] {
        assert!(sequence.evaluate(point).is_none());
        assert!(matches!(
            sequence.deform_point_with(point, Outside::Keep),
            Err(FfdError::NonFinitePoint {
                index: 0,
                component: 0,
                ..
            })
        ));
        let nothing = Sequence::<2>::default();
        assert!(nothing.deform_point_with(point, Outside::Keep).is_err());
    }
}
