//! The object file: what is written is read back, and every fault is named.

#![expect(clippy::float_cmp, reason = "exact values are meant")]

mod common;

use common::kuhn_box;
use fem_tet::io::ObjectFile;
use proptest::prelude::*;

const GOOD: &str = "# a corner\nvertices 4\n0 0 0\n0.1 0 0\n\n0 0.1 0 # y\n0 0 0.1\nelements 1\n0 1 2 3\ndisplay 1\n0 2 1\n";

#[test]
fn a_hand_written_file_is_read() {
    let object = ObjectFile::parse(GOOD).expect("sound");
    assert_eq!(object.mesh.positions()[2], [0.0, 0.1, 0.0]);
    assert_eq!(object.mesh.tets(), [[0, 1, 2, 3]]);
    assert_eq!(object.display, [[0, 2, 1]]);
    let crlf = GOOD.replace('\n', "\r\n");
    assert_eq!(ObjectFile::parse(&crlf).expect("sound"), object);
}

#[test]
fn faults_name_line_and_cause() {
    let message = |from: &str, to: &str| {
        assert!(GOOD.contains(from), "{from}");
        ObjectFile::parse(&GOOD.replacen(from, to, 1))
            .expect_err(to)
            .to_string()
    };
    assert_eq!(
        message("0 1 2 3", "0 2 1 3"),
        "line 9: tetrahedron 0 is inverted: its volume is -1.667e-4 m³; swap two of its vertices"
    );
    assert_eq!(
        message("0 1 2 3", "0 1 2 4"),
        "line 9: tetrahedron 0 refers to vertex 4, but there are only 4"
    );
    assert_eq!(
        message("0.1 0 0", "0.1 nan 0"),
        "line 4: value 2 is not a finite number: \"nan\""
    );
    assert_eq!(
        message("0 2 1", "0 2 9"),
        "line 11: display triangle 0 refers to vertex 9, but there are only 4"
    );
    assert_eq!(
        message("0.1 0 0", "0.1 0"),
        "line 4: a line of `vertices` has 3 values, this one 2"
    );
    assert_eq!(
        message("elements 1", "elements one"),
        "line 8: expected `elements COUNT`, found \"elements one\""
    );
    assert_eq!(
        message("display 1", "display 3"),
        "line 11: the file ends after 1 of 3 display"
    );
    // An absurd count must not allocate.
    assert!(message("vertices 4", "vertices 18446744073709551615").contains("has 3 values"));
    assert!(
        ObjectFile::parse("")
            .expect_err("empty")
            .to_string()
            .contains("after 0 of 3 sections")
    );
    assert!(ObjectFile::parse(&format!("{GOOD}1 2 3\n")).is_err());
}

proptest! {
    /// parse ∘ to_text = identity, to the bit.
    #[test]
    fn round_trip(offset in prop::array::uniform3(-1e3..1e3_f64), spacing in 1e-6..1e3_f64) {
        let (mut positions, tets) = kuhn_box([2, 1, 1], spacing).into_parts();
        for p in &mut positions {
            for c in 0..3 {
                p[c] += offset[c] * spacing;
            }
        }
        let object = ObjectFile::from_mesh(fem_tet::TetMesh::new(positions, tets).expect("sound"));
        prop_assert_eq!(ObjectFile::parse(&object.to_text()).expect("own text"), object);
    }

    /// Any text is answered, never a panic.
    #[test]
    fn any_text_is_answered(text in "(vertices|elements|display|[0-9 .\n-]){0,60}") {
        let _answer = ObjectFile::parse(&text);
    }
}
