//! `ffd step` as a user meets it.

use std::{
    fs,
    path::PathBuf,
    process::{Command, Output},
};

use ffd_core::{Border, Degree, Frame, Grid, Lattice, Sequence};
use serde_json::{Value, json};

/// A folder of this test's own, removed when the test ends.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ffd-step-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("writable");
        Self(path)
    }

    fn file(&self, name: &str, contents: impl serde::Serialize) -> String {
        let path = self.0.join(name);
        let json = serde_json::to_string(&contents).expect("JSON");
        fs::write(&path, json).expect("writable");
        path.display().to_string()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ignored = fs::remove_dir_all(&self.0);
    }
}

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ffd"))
        .arg("step")
        .args(arguments)
        .output()
        .expect("it starts")
}

/// A run that must answer: the line.
fn answered(arguments: &[&str]) -> Value {
    let output = run(arguments);
    let notes = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {notes}");
    assert_eq!(notes, "");
    let text = std::str::from_utf8(&output.stdout).expect("UTF-8");
    assert_eq!(text.lines().count(), 1, "{text}");
    serde_json::from_str(text).expect("JSON")
}

/// A run that must answer nothing: the only line on standard error.
fn refused(arguments: &[&str]) -> String {
    let output = run(arguments);
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty());
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

fn grid<const D: usize>(cells: usize) -> Grid<D> {
    Grid::new([Degree::CUBIC; D], [cells; D], Frame::unit()).expect("a grid")
}

/// The map x ↦ (1 − c) x along the first `axes` axes.
fn shrunk<const D: usize>(grid: Grid<D>, axes: usize, c: f64) -> Lattice<D> {
    let displacements = (0..grid.control_point_count()).map(|i| {
        let rest = grid.rest_position(i);
        std::array::from_fn(|a| if a < axes { -c * rest[a] } else { 0.0 })
    });
    let displacements = displacements.collect();
    Lattice::new(grid, displacements).expect("a lattice")
}

#[track_caller]
fn assert_encloses(answer: &Value, expected: f64, width: f64) {
    let [low, high] = [0, 1].map(|end| answer["t"][end].as_f64().expect("a number"));
    assert!(low < expected && expected <= high, "{answer}");
    assert!(high - low <= width * high, "{answer}");
}

#[test]
fn the_first_fold_is_enclosed() {
    let scratch = Scratch::new("first");
    let rest = scratch.file("rest.json", shrunk(grid::<3>(1), 0, 0.0));
    let folded = scratch.file("folded.json", shrunk(grid::<3>(1), 1, 4.0));
    assert_encloses(&answered(&[&rest, &folded]), 0.25, 1e-6);
    assert_encloses(
        &answered(&[&rest, &folded, "--width", "1e-10"]),
        0.25,
        1e-10,
    );

    // det J = (1 − 2t)² is zero for an instant.
    let plane = scratch.file("plane.json", shrunk(grid::<2>(2), 0, 0.0));
    let turned = scratch.file("turned.json", shrunk(grid::<2>(2), 2, 2.0));
    let answer = answered(&[&plane, &turned]);
    assert_encloses(&answer, 0.5, 1e-6);
    assert_eq!(answer["t"][1], 0.5);

    let nearer = scratch.file("nearer.json", shrunk(grid::<2>(2), 2, 0.75));
    assert_eq!(answered(&[&plane, &nearer]), json!({ "t": [1.0, null] }));
    assert_eq!(answered(&[&plane, &plane]), json!({ "t": [1.0, null] }));
    let mirror = scratch.file("mirror.json", shrunk(grid::<2>(2), 1, 2.0));
    assert_eq!(answered(&[&mirror, &plane]), json!({ "t": [0.0, 0.0] }));
}

#[test]
fn sequences_go_together() {
    let scratch = Scratch::new("sequences");
    let part = |c| shrunk(grid::<2>(1), 1, c);
    let rest = Sequence::new(vec![part(0.0), part(0.0)]);
    let rest = scratch.file("rest.json", rest);
    let to = scratch.file("to.json", Sequence::new(vec![part(2.0), part(4.0)]));
    assert_encloses(&answered(&[&rest, &to]), 0.25, 1e-6);
    let near = scratch.file("near.json", Sequence::new(vec![part(0.5), part(0.5)]));
    assert_eq!(answered(&[&rest, &near]), json!({ "t": [1.0, null] }));

    // A lattice is a sequence of one.
    let lone = scratch.file("lone.json", part(0.5));
    let one = scratch.file("one.json", Sequence::new(vec![part(0.0)]));
    assert_eq!(answered(&[&one, &lone]), json!({ "t": [1.0, null] }));
    let message = refused(&[&rest, &lone]);
    assert!(
        message.contains("sequences of 2 and 1 lattices"),
        "{message}"
    );
}

#[test]
fn bad_questions_are_refused() {
    let scratch = Scratch::new("refused");
    let file = |name: &str, grid: Grid<2>| scratch.file(name, shrunk(grid, 0, 0.0));
    let plane = file("plane.json", grid(2));
    let more = file("more.json", grid(3));
    let bordered = grid(2).with_border(Border::Identity).expect("uniform");
    let bordered = file("bordered.json", bordered);
    let space = scratch.file("space.json", shrunk(grid::<3>(1), 0, 0.0));
    let cases: [(&[&str], &str); 7] = [
        (&[&plane], "required"),
        (&[&plane, "none.json"], "none.json: No such file"),
        (
            &[&plane, &more],
            "different grids: their numbers of cells differ",
        ),
        (
            &[&plane, &bordered],
            "different grids: their borders differ",
        ),
        (
            &[&plane, &space],
            "one deforms the plane, and the other space",
        ),
        (&[&plane, &plane, "--width", "-1"], "not negative"),
        (&[&plane, &plane, "--width", "NaN"], "not negative"),
    ];
    for (arguments, expected) in cases {
        let message = refused(arguments);
        assert!(message.contains(expected), "{expected} is not in {message}");
    }
}
