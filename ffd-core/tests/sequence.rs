//! Laws of lattices applied one after another.
#![expect(clippy::float_cmp, reason = "the same operations give the same bits")]

mod common;

use common::{at, displaced, each, grid, lattice};
use ffd_core::{
    Border, Degree, FfdError, Frame, Grid, InverseError, Lattice, Outside, Preimage, Sequence,
};
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
    for (row, jb) in there.jacobian.iter().zip(jb) {
        for (c, entry) in row.iter().enumerate() {
            let sum: f64 = jb.iter().zip(ja).map(|(b, a)| b * a[c]).sum();
            prop_assert!((entry - sum).abs() <= tolerance);
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

/// Undoing a sequence of injective lattices with identity borders gives the points back.
fn check_undone<const D: usize>(
    sequence: &Sequence<D>,
    points: &[[f64; D]],
) -> Result<(), TestCaseError> {
    let mut moved: Vec<_> = points.iter().map(|&x| sequence.deform_point(x)).collect();
    let report = sequence.undo_points(&mut moved).unwrap();
    prop_assert!(report.is_unique(), "{report:?}");
    // Derivatives along three axes with displacements up to 0.1: J − 1 is at most 0.6
    // and J⁻¹ at most 2.5 in each of three lattices (in the norm of row sums, √3 times
    // that in the Euclidean one); an error of one is multiplied by the others. Sizes are
    // below 12.
    let tolerance = 3.0 * 64.0 * f64::EPSILON * 12.0 * (3.0_f64.sqrt() * 2.5).powi(3);
    for (x, y) in points.iter().zip(moved) {
        for c in 0..D {
            prop_assert!((x[c] - y[c]).abs() <= tolerance, "{x:?} {y:?}");
        }
        prop_assert!(
            matches!(sequence.inverse_point(sequence.deform_point(*x)), Ok(Preimage::One(z)) if z == y)
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn sequences_are_undone(
        displacements in each::<3, _>(
            proptest::collection::vec(each::<3, _>(-0.1..=0.1_f64), 5 * 5 * 5)
        ),
        degrees in each::<3, _>(1_usize..=3),
        points in proptest::collection::vec(each::<3, _>(-4.0..6.0_f64), 8),
    ) {
        let lattices = degrees.into_iter().zip(displacements).enumerate();
        let lattices = lattices.map(|(i, (degree, displacements))| {
            // Boxes that overlap in part.
            let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            axes.rotate_left(i);
            let frame = Frame::new([0.5 * i as f64; 3], axes).unwrap();
            let degree = Degree::new(degree).unwrap();
            let grid = Grid::new([degree; 3], [5 - degree.get(); 3], frame).unwrap();
            let grid = grid.with_border(Border::Identity).unwrap();
            Lattice::new(grid, displacements).unwrap()
        });
        check_undone(&Sequence::new(lattices.collect()), &points)?;
    }
}

#[test]
fn all_ways_back_are_followed() {
    // The box [0, 2] is moved to the right by 1.
    let grid = Grid::new([Degree::LINEAR; 2], [2, 2], Frame::unit()).unwrap();
    let shift = displaced(grid, |_| [1.0, 0.0]);
    let twice = Sequence::new(vec![shift.clone(), shift]);
    for (q, expected) in [
        // Nothing is moved as far as that.
        (3.5, vec![3.5]),
        // From 0.5 to 1.5 to 2.5. From 1.5 to 2.5, where it stays. And 2.5 stays.
        (2.5, vec![0.5, 1.5]),
        // The second moves it from 0.5, where the first has left nothing.
        (1.5, vec![]),
        (0.5, vec![]),
    ] {
        let found = match twice.inverse_point([q, 1.0]).unwrap() {
            Preimage::None => vec![],
            Preimage::One(x) => vec![x],
            Preimage::Two(both) => both.to_vec(),
        };
        let found: Vec<f64> = found.into_iter().map(|x| x[0]).collect();
        assert_eq!(found, expected, "{q}");
    }
    // Where the way through the inside ends, the other one is taken.
    let grid = Grid::new([Degree::LINEAR; 2], [1, 2], Frame::unit()).unwrap();
    let away = displaced(grid, |_| [0.0, 5.0]);
    let grid = Grid::new([Degree::LINEAR; 2], [1, 2], Frame::unit()).unwrap();
    let right = displaced(grid, |_| [1.0, 0.0]);
    let sequence = Sequence::new(vec![away, right]);
    assert_eq!(
        sequence.inverse_point([1.5, 1.0]),
        Ok(Preimage::One([1.5, 1.0]))
    );
    let nothing = Sequence::<2>::default();
    assert_eq!(
        nothing.inverse_point([1.5, 1.0]),
        Ok(Preimage::One([1.5, 1.0]))
    );
    let error = nothing.inverse_point([f64::NAN, 1.0]).unwrap_err();
    assert!(matches!(
        error,
        InverseError::NonFinitePoint { index: 0, .. }
    ));
}

/// Undoing takes two ways at each lattice that pushes points out; not all of them are
/// followed if there are too many. The file of such a sequence is small.
#[test]
fn a_sequence_with_exponentially_many_ways_back_is_given_up() {
    let linear = |a: f64, b: f64, shift: f64| {
        let frame = Frame::of_box([a, 0.0], [b, 1.0], [1, 1]).unwrap();
        let grid = Grid::new([Degree::LINEAR; 2], [1, 1], frame).unwrap();
        Lattice::new(grid, vec![[shift, 0.0]; 4]).unwrap()
    };
    let (mut width, mut lattices) = (4.0, Vec::new());
    for _ in 0..40 {
        lattices.push(linear(2.0 * width, 3.0 * width, -2.0 * width));
        width *= 3.0;
    }
    lattices.push(linear(-10.0, 2.0 * width, 10.0 * width));
    lattices.reverse();
    let sequence = Sequence::new(lattices);
    let error = sequence.inverse_point([1.5, 0.5]).unwrap_err();
    assert!(matches!(error, InverseError::TooManyWays { .. }), "{error}");
    let report = sequence.undo_points(&mut [[1.5, 0.5]]).unwrap();
    assert_eq!(report.unresolved, [0]);
}

#[test]
fn points_go_through_a_sequence_together() {
    let grid = Grid::new([Degree::LINEAR; 2], [2, 2], Frame::unit()).unwrap();
    let shift = Lattice::new(grid, vec![[0.5, 0.0]; 9]).unwrap();
    let sequence = Sequence::new(vec![shift.clone(), shift]);
    let mut points = [[0.25, 1.0], [1.75, 1.0], [9.0, 9.0]];
    let expected = points.map(|x| sequence.deform_point(x));
    assert_eq!(sequence.deform_points(&mut points), Ok(vec![1, 2]));
    assert_eq!(points, expected);
}

#[test]
fn a_point_moved_out_of_the_range_of_numbers_has_no_image() {
    let frame = Frame::new([1e308, 0.0], [[1.0, 0.0], [0.0, 1.0]]).unwrap();
    let grid = Grid::new([Degree::LINEAR; 2], [1, 1], frame).unwrap();
    let away = Lattice::new(grid, vec![[f64::MAX, 0.0]; 4]).unwrap();
    let sequence = Sequence::new(vec![away]);
    assert_eq!(sequence.evaluate([1e308, 0.5]), None);
    let near = sequence
        .evaluate([1.0, 0.5])
        .expect("outside, where nothing moves");
    assert_eq!(near.position, [1.0, 0.5]);
}
