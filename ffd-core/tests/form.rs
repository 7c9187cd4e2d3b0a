//! Lattices and sequences as JSON: what is written is read back, and every fault is named.
#![cfg(feature = "serde")]
#![expect(clippy::float_cmp, reason = "numbers keep every bit")]

mod common;

use common::lattice;
use ffd_core::{Border, Degree, Frame, Grid, Knots, Lattice, Sequence};
use proptest::prelude::*;
use serde_json::{Value, json};

/// Writing and reading gives the same lattice, bit for bit.
fn check_round_trip<const D: usize>(lattice: &Lattice<D>) -> Result<(), TestCaseError> {
    let text = serde_json::to_string(lattice).unwrap();
    let back: Lattice<D> = serde_json::from_str(&text).unwrap();
    prop_assert_eq!(back.grid(), lattice.grid());
    let bits = |l: &Lattice<D>| -> Vec<[u64; D]> {
        let displacements = l.displacements().iter();
        displacements.map(|d| d.map(f64::to_bits)).collect()
    };
    prop_assert_eq!(bits(&back), bits(lattice));
    prop_assert_eq!(serde_json::to_string(&back).unwrap(), text.clone());

    // Through a tree of values, in which fields come in another order.
    let value: Value = serde_json::from_str(&text).unwrap();
    let back: Lattice<D> = serde_json::from_value(value).unwrap();
    prop_assert_eq!(&back, lattice);

    let sequence = Sequence::new(vec![lattice.clone(), back]);
    let text = serde_json::to_string(&sequence).unwrap();
    let back: Sequence<D> = serde_json::from_str(&text).unwrap();
    prop_assert_eq!(back, sequence);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn lattices_survive_the_round_trip_in_2d(lattice in lattice::<2>(3, 1e3)) {
        check_round_trip(&lattice)?;
    }

    #[test]
    fn lattices_survive_the_round_trip_in_3d(lattice in lattice::<3>(2, 1e-3)) {
        check_round_trip(&lattice)?;
    }

    /// Any numbers at all.
    #[test]
    fn numbers_keep_every_bit(numbers in proptest::collection::vec(
        proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL | proptest::num::f64::ZERO,
        8,
    )) {
        let grid = Grid::new([Degree::LINEAR; 2], [1, 1], Frame::unit()).unwrap();
        let displacements = numbers.chunks(2).map(|d| [d[0], d[1]]).collect();
        check_round_trip(&Lattice::new(grid, displacements).unwrap())?;
    }

    /// Damaged text is read or refused, without panic.
    #[test]
    fn damaged_text_does_no_harm(at in 0_usize..200, byte in 32_u8..127) {
        let grid = Grid::new([Degree::LINEAR; 2], [1, 1], Frame::unit()).unwrap();
        let mut text = serde_json::to_vec(&Lattice::at_rest(grid).unwrap()).unwrap();
        let at = at % text.len();
        text[at] = byte;
        if let Ok(lattice) = serde_json::from_slice::<Lattice<2>>(&text) {
            prop_assert_eq!(lattice.displacements().len(), lattice.grid().control_point_count());
        }
    }
}

/// A lattice written by hand.
fn sound() -> Value {
    json!({
        "degree": [1, 2],
        "cells": [1, 1],
        "origin": [10, 0],
        "axes": [[2, 0], [0, 3.5]],
        "displacements": [[0, 0], [0, 0], [0, 0], [1, 0.25], [0, 0], [0, 0]],
    })
}

#[test]
fn the_form_is_the_documented_one() {
    let lattice: Lattice<2> = serde_json::from_value(sound()).unwrap();
    let grid = lattice.grid();
    assert_eq!(grid.degree().map(Degree::get), [1, 2]);
    assert_eq!(grid.cells(), [1, 1]);
    assert_eq!(grid.knots(), [Knots::Uniform; 2]);
    assert_eq!(grid.border(), Border::Free);
    assert_eq!(grid.rest_position(1), [12.0, -1.75]);
    assert_eq!(lattice.displacements()[3], [1.0, 0.25]);
    assert_eq!(
        serde_json::to_string(&lattice).unwrap(),
        r#"{"degree":[1,2],"cells":[1,1],"knots":["uniform","uniform"],"origin":[10.0,0.0],"#
            .to_owned()
            + r#""axes":[[2.0,0.0],[0.0,3.5]],"border":"free","#
            + r#""displacements":[[0.0,0.0],[0.0,0.0],[0.0,0.0],[1.0,0.25],[0.0,0.0],[0.0,0.0]]}"#
    );

    let mut other = sound();
    other["knots"] = json!(["uniform", "clamped"]);
    let lattice: Lattice<2> = serde_json::from_value(other).unwrap();
    assert_eq!(lattice.grid().knots(), [Knots::Uniform, Knots::Clamped]);
    let mut other = sound();
    other["border"] = json!("identity");
    let lattice: Lattice<2> = serde_json::from_value(other).unwrap();
    assert_eq!(lattice.grid().domain(), [[-1.0, 2.0], [-2.0, 3.0]]);
}

#[test]
fn a_sequence_is_read_from_a_list_or_from_a_lattice() {
    let read = |value: Value| serde_json::from_value::<Sequence<2>>(value);
    let one = read(sound()).unwrap();
    assert_eq!(one.lattices().len(), 1);
    assert_eq!(read(json!({ "sequence": [sound()] })).unwrap(), one);
    assert_eq!(
        serde_json::to_value(&one).unwrap(),
        json!({ "sequence": [one.lattices()[0]] })
    );
    let empty = read(json!({ "sequence": [] })).unwrap();
    assert_eq!(empty, Sequence::default());

    let mut both = sound();
    both["sequence"] = json!([]);
    for (value, message) in [
        (
            json!({}),
            "neither a `sequence` nor the fields of a lattice",
        ),
        (
            both,
            "`axes` belongs to a lattice and cannot stand beside `sequence`",
        ),
        (
            json!([sound()]),
            "invalid type: sequence, expected a sequence of 2-dimensional lattices, or one lattice",
        ),
        (
            json!({ "sequence": sound() }),
            "invalid type: map, expected `sequence` to be a list",
        ),
        (
            json!({ "sequence": [{ "sequence": [] }] }),
            "unknown field `sequence`, expected one of `degree`, `cells`, `knots`, `origin`, \
             `axes`, `border`, `displacements`",
        ),
        (json!({ "degree": [1, 1] }), "missing field `cells`"),
    ] {
        assert_eq!(read(value).unwrap_err().to_string(), message);
    }
}

#[test]
fn faults_are_named() {
    for (field, value, message) in [
        (
            "degree",
            json!([1, 9]),
            "degree 9 is not supported: it must be between 1 and 5",
        ),
        (
            "degree",
            json!([1]),
            "invalid length 1, expected `degree` to be a list of 2",
        ),
        (
            "cells",
            json!([1, 1, 1, 1]),
            "invalid length 4, expected `cells` to be a list of 2",
        ),
        (
            "cells",
            json!([1, 0]),
            "the lattice has no cells along axis 1",
        ),
        (
            "cells",
            json!([1_u64 << 40, 1_u64 << 40]),
            "a lattice of [1099511627776, 1099511627776] cells has more control points than fit \
             into memory",
        ),
        (
            "cells",
            json!([1_000_000, 1_000_000]),
            "the lattice has 1000003000002 control points, but 6 displacements were given",
        ),
        (
            "knots",
            json!(["uniform", "closed"]),
            "unknown variant `closed`, expected `uniform` or `clamped`",
        ),
        (
            "knots",
            json!("uniform"),
            "invalid type: string \"uniform\", expected `knots` to be a list of 2",
        ),
        (
            "border",
            json!("open"),
            "unknown variant `open`, expected `free` or `identity`",
        ),
        (
            "axes",
            json!([[1, 0], [0, 1, 0]]),
            "invalid length 3, expected each entry of `axes` to be a list of 2",
        ),
        (
            "axes",
            json!([[1, 0], [2, 0]]),
            "the axes of the frame are linearly dependent: scaled to length 1 they span a volume \
             of 0",
        ),
        (
            "displacements",
            json!([[0, 0]]),
            "the lattice has 6 control points, but 1 displacements were given",
        ),
        (
            "displacements",
            json!([[0, 0], [0]]),
            "invalid length 1, expected each entry of `displacements` to be a list of 2",
        ),
        (
            "displacements",
            json!([[0, null]]),
            "invalid type: null, expected f64",
        ),
        (
            "scale",
            json!(1),
            "unknown field `scale`, expected one of `degree`, `cells`, `knots`, `origin`, \
             `axes`, `border`, `displacements`",
        ),
    ] {
        let mut lattice = sound();
        lattice[field] = value;
        let error = serde_json::from_value::<Lattice<2>>(lattice).unwrap_err();
        assert_eq!(error.to_string(), message);
    }
    for field in ["degree", "cells", "origin", "axes", "displacements"] {
        let mut lattice = sound();
        lattice.as_object_mut().unwrap().remove(field);
        let error = serde_json::from_value::<Lattice<2>>(lattice).unwrap_err();
        assert_eq!(error.to_string(), format!("missing field `{field}`"));
    }
    let mut clamped = sound();
    clamped["knots"] = json!(["uniform", "clamped"]);
    clamped["border"] = json!("identity");
    let error = serde_json::from_value::<Lattice<2>>(clamped).unwrap_err();
    assert_eq!(
        error.to_string(),
        "axis 1 has clamped knots: an identity border needs uniform ones"
    );
    let twice = r#"{"degree": [1, 1], "degree": [1, 1]}"#;
    let error = serde_json::from_str::<Lattice<2>>(twice).unwrap_err();
    assert!(error.to_string().starts_with("duplicate field `degree`"));
    let error = serde_json::from_str::<Lattice<3>>("7").unwrap_err();
    assert!(
        error
            .to_string()
            .contains("expected a 3-dimensional lattice")
    );
    // A number beyond the range of f64.
    let text = sound().to_string().replace("3.5", "1e999");
    assert!(serde_json::from_str::<Lattice<2>>(&text).is_err());
}
