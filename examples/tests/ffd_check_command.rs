//! `ffd check` as a user meets it.

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
        let path = std::env::temp_dir().join(format!("ffd-check-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("writable");
        Self(path)
    }

    fn file(&self, name: &str, contents: impl AsRef<[u8]>) -> String {
        let path = self.0.join(name);
        fs::write(&path, contents).expect("writable");
        path.display().to_string()
    }

    fn lattice<const D: usize>(&self, name: &str, lattice: &Lattice<D>) -> String {
        self.file(name, serde_json::to_string(lattice).expect("JSON"))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ignored = fs::remove_dir_all(&self.0);
    }
}

fn check(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ffd"))
        .arg("check")
        .args(arguments)
        .output()
        .expect("it starts")
}

fn lines(output: &Output) -> Vec<Value> {
    let text = std::str::from_utf8(&output.stdout).expect("UTF-8");
    let parse = |line| serde_json::from_str(line).expect("JSON on each line");
    text.lines().map(parse).collect()
}

/// A run that must answer for all files: the lines.
fn answered(arguments: &[&str]) -> Vec<Value> {
    let output = check(arguments);
    let notes = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {notes}");
    assert_eq!(notes, "");
    lines(&output)
}

/// A run about one lattice.
fn judged(arguments: &[&str]) -> Value {
    let [line] = answered(arguments).try_into().expect("one line");
    line
}

/// A run that must answer nothing: the only line on standard error.
fn refused(arguments: &[&str]) -> String {
    let output = check(arguments);
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty());
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

/// A cubic lattice that takes control points from where they rest to where `place` says.
fn lattice<const D: usize>(
    cells: [usize; D],
    border: Border,
    place: impl Fn([f64; D]) -> [f64; D],
) -> Lattice<D> {
    let grid = Grid::new([Degree::CUBIC; D], cells, Frame::unit())
        .and_then(|grid| grid.with_border(border))
        .expect("a grid");
    let displacements = (0..grid.control_point_count()).map(|i| {
        let rest = grid.rest_position(i);
        let place = place(rest);
        std::array::from_fn(|c| place[c] - rest[c])
    });
    let displacements = displacements.collect();
    Lattice::new(grid, displacements).expect("a lattice")
}

/// A strip of some cells around a centre, of which 16 go round once.
fn winding_strip(cells: usize) -> Lattice<2> {
    lattice([cells, 1], Border::Free, |[u, v]| {
        let turn = std::f64::consts::TAU * u.rem_euclid(16.0) / 16.0;
        // Binary fractions, so that nothing rounds from here on.
        [turn.cos(), turn.sin()].map(|c| ((6.0 - v) * c * 1024.0).round() / 1024.0)
    })
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn points<const D: usize>(line: &Value) -> Vec<[f64; D]> {
    let points = line["witness"].as_array().expect("a list");
    let point = |p: &Value| std::array::from_fn(|c| number(&p[c]));
    points.iter().map(point).collect()
}

/// The place that evidence names is the world point of the witness; the frame is that of
/// the lattice coordinates, without a border.
fn assert_same_place<const D: usize>(place: &Value, point: [f64; D]) {
    for c in 0..D {
        let coordinate = number(&place["cell"][c]) + number(&place["t"][c]);
        assert!((coordinate - point[c]).abs() < 1e-12, "{place} {point:?}");
    }
}

#[test]
fn a_deformation_that_does_not_fold() {
    let scratch = Scratch::new("injective");
    let wave = |[x, y]: [f64; 2]| [x + 0.1 * y.sin(), y + 0.1 * x.sin()];
    let bordered = lattice([3, 2], Border::Identity, wave);
    let file = scratch.lattice("bordered.json", &bordered);
    let output = check(&[&file]);
    let text = String::from_utf8_lossy(&output.stdout);
    let first = format!(
        "{{\"file\":{},\"verdict\":\"injective\",\"theorem\":\"identity_border\",\"min_det\":[",
        json!(file)
    );
    assert!(text.starts_with(&first), "{text}");
    let line = judged(&[&file]);
    assert_eq!(line["witness"], Value::Null);
    assert_eq!(line["evidence"], Value::Null);
    assert_eq!(line["conic"], true);
    assert_eq!(line["index"], 0);
    assert_eq!(line["method"], "exact");
    assert!(number(&line["micros"]) > 0.0);
    assert!(number(&line["min_det"][0]) >= 0.0);
    assert!(line.get("irregular_cells").is_none());

    // Without a border a theorem is needed that holds on a box.
    let file = scratch.lattice("free.json", &lattice([3, 2], Border::Free, wave));
    let line = judged(&[&file, "--all-cells"]);
    assert_eq!(line["verdict"], "injective");
    assert!(line["theorem"].is_string(), "{line}");
    assert_eq!(line["irregular_cells"], json!([]));

    // In space, and in a frame of another size.
    let frame = Frame::of_box([-1.0; 3], [1.0; 3], [2; 3]).expect("a box");
    let grid = Grid::new([Degree::CUBIC; 3], [2; 3], frame).expect("a grid");
    let mut solid = Lattice::at_rest(grid).expect("small");
    solid.set_displacement(62, [0.2, 0.1, 0.0]).expect("finite");
    let line = judged(&[&scratch.lattice("solid.json", &solid)]);
    assert_eq!(line["verdict"], "injective");
}

#[test]
fn a_strip_that_comes_back_to_itself() {
    let scratch = Scratch::new("strip");
    // All the way round: the ends lie on each other, which no theorem allows and no
    // enclosure proves.
    let line = judged(&[&scratch.lattice("ring.json", &winding_strip(16))]);
    assert_eq!(line["verdict"], "locally_injective");
    assert_eq!(line["theorem"], Value::Null);
    assert_eq!(line["witness"], Value::Null);
    assert!(number(&line["min_det"][0]) >= 0.0);

    // Farther: no point has a Jacobian that tells.
    let strip = winding_strip(20);
    let line = judged(&[&scratch.lattice("strip.json", &strip)]);
    match line["verdict"].as_str().expect("a word") {
        "locally_injective" => assert_eq!(line["evidence"], Value::Null),
        "not_injective" => {
            assert_eq!(line["evidence"]["kind"], "overlap");
            let [p, q] = points::<2>(&line).try_into().expect("two points");
            assert!((p[0] - q[0]).hypot(p[1] - q[1]) > 1.0);
            let [p, q] = [p, q].map(|p| strip.deform_point(p));
            assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-6, "{p:?} {q:?}");
        }
        verdict => panic!("{verdict}"),
    }
}

#[test]
fn a_fold_has_two_witnesses() {
    let scratch = Scratch::new("fold");
    let mut fold = lattice([3, 2], Border::Free, |rest| rest);
    let middle = fold.grid().control_point([2, 2]);
    fold.set_displacement(middle, [2.5, 0.0]).expect("finite");
    let file = scratch.lattice("fold.json", &fold);
    let line = judged(&[&file, "--all-cells"]);
    assert_eq!(line["verdict"], "not_injective");
    assert_eq!(line["theorem"], Value::Null);
    assert_eq!(line["conic"], false);
    let [positive, negative] = points::<2>(&line).try_into().expect("two points");
    let det = |p| fold.evaluate(p).expect("inside").determinant;
    assert!(det(positive) > 0.0 && det(negative) < 0.0, "{line}");
    assert!(number(&line["min_det"][1]) < 0.0);
    assert_eq!(line["evidence"]["kind"], "both_signs");
    assert_same_place(&line["evidence"]["positive"], positive);
    assert_same_place(&line["evidence"]["negative"], negative);
    let cells = line["irregular_cells"].as_array().expect("a list");
    assert!(!cells.is_empty() && cells.len() <= 6);
    assert!(cells.contains(&line["evidence"]["negative"]["cell"]));

    // A sufficient test proves no fold, and never takes one for none.
    for method in [
        "phi",
        "conic",
        "conic-lattice",
        "conic-off-axis",
        "conic-subdivided",
        "choi-lee",
    ] {
        let line = judged(&[&file, "--method", method]);
        assert_eq!(line["method"], method);
        let verdict = line["verdict"].as_str().expect("a word");
        assert!(
            ["undecided", "not_injective"].contains(&verdict),
            "{method}: {verdict}"
        );
    }
    let line = judged(&[&file, "--method", "paper"]);
    assert_eq!(line["verdict"], "not_injective");
}

#[test]
fn flat_and_mirrored() {
    let scratch = Scratch::new("flat");
    let flat = lattice([1, 1, 1], Border::Free, |[x, y, _]| [x, y, 0.5]);
    let line = judged(&[&scratch.lattice("flat.json", &flat)]);
    assert_eq!(line["verdict"], "degenerate");
    assert_eq!(line["min_det"], json!([0.0, 0.0]));
    assert_eq!(line["evidence"]["kind"], "zero");
    assert_eq!(line["evidence"]["reversed"], false);
    let [zero] = points::<3>(&line).try_into().expect("one point");
    assert_same_place(&line["evidence"]["zero"], zero);

    let mirror = lattice([2, 1], Border::Free, |[x, y]| [-x, y]);
    let line = judged(&[&scratch.lattice("mirror.json", &mirror)]);
    assert_eq!(line["verdict"], "reversed");
    assert_eq!(line["witness"], Value::Null);
    assert!(number(&line["min_det"][1]) < 0.0 || line["min_det"][1].is_null());
}

#[test]
fn the_least_determinant_is_enclosed() {
    let scratch = Scratch::new("enclose");
    // Constant, and 1.5² · 0.5 up to rounding.
    let grown = |[x, y, z]: [f64; 3]| [1.5 * x, 1.5 * y, 0.5 * z];
    let file = scratch.lattice("grown.json", &lattice([2; 3], Border::Free, grown));
    let line = judged(&[&file, "--enclose", "1e-9"]);
    let [low, high] = [0, 1].map(|end| number(&line["min_det"][end]));
    assert!(low <= 1.125 && 1.125 <= high && high - low <= 1e-9);

    // Of a fold, too.
    let mut fold = lattice([2, 2], Border::Free, |rest| rest);
    let middle = fold.grid().control_point([2, 2]);
    fold.set_displacement(middle, [0.0, -2.5]).expect("finite");
    let line = judged(&[&scratch.lattice("fold.json", &fold), "--enclose", "1e-3"]);
    assert_eq!(line["verdict"], "not_injective");
    let [low, high] = [0, 1].map(|end| number(&line["min_det"][end]));
    assert!(low <= high && high - low <= 1e-3 && high < 0.0, "{line}");
    let step = |i: i32| f64::from(i) / 64.0;
    let sampled = (0..=128 * 129).map(|i| [step(i % 129), step(i / 129)]);
    let sampled = sampled.filter_map(|p| fold.evaluate(p).map(|there| there.determinant));
    let least = sampled.fold(f64::INFINITY, f64::min);
    assert!(low <= least && least <= high + 0.1, "{least}: {line}");
}

#[test]
fn many_files_and_sequences() {
    let scratch = Scratch::new("many");
    let rest = lattice([1, 1], Border::Identity, |rest| rest);
    let mirror = lattice([2, 1], Border::Free, |[x, y]| [-x, y]);
    let one = scratch.lattice("one.json", &rest);
    let two = Sequence::new(vec![rest, mirror]);
    let two = scratch.file("two.json", serde_json::to_string(&two).expect("JSON"));
    let found: Vec<_> = answered(&[&one, &two, &one])
        .iter()
        .map(|line| [&line["file"], &line["index"], &line["verdict"]].map(Value::clone))
        .collect();
    let expected = [
        (&one, 0, "injective"),
        (&two, 0, "injective"),
        (&two, 1, "reversed"),
        (&one, 0, "injective"),
    ];
    let expected =
        expected.map(|(file, index, verdict)| [json!(file), json!(index), json!(verdict)]);
    assert_eq!(found, expected);

    // Files that cannot be read do not keep the others from being judged.
    let bad = scratch.file("bad.json", "{\"degree\": [3,3]}");
    let output = check(&[&one, "none.json", &bad, &two]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(lines(&output).len(), 3);
    let messages = String::from_utf8(output.stderr).expect("UTF-8");
    let [none, bad] = messages.lines().collect::<Vec<_>>()[..] else {
        panic!("{messages}");
    };
    assert!(none.starts_with("error: none.json: No such file"), "{none}");
    assert!(bad.contains("bad.json: missing field"), "{bad}");
}

#[test]
fn bad_questions_are_refused() {
    let scratch = Scratch::new("refused");
    let good = lattice([1, 1], Border::Free, |rest| rest);
    let good = scratch.lattice("good.json", &good);
    let cases: [(&[&str], &str); 9] = [
        (&[], "required"),
        (&["none.json"], "none.json: No such file"),
        (&[&good, "--enclose", "-1e-3"], "not negative"),
        (&[&good, "--enclose", "NaN"], "not negative"),
        (&[&good, "--enclose", "inf"], "not negative"),
        (&[&good, "--enclose", "wide"], "not negative"),
        (&[&good, "--method", "magic"], "'magic'"),
        (
            &[&good, "--method", "phi", "--enclose", "1"],
            "--enclose: only the exact method",
        ),
        (
            &[&good, "--method", "conic", "--all-cells"],
            "--all-cells: only the exact method",
        ),
    ];
    for (arguments, expected) in cases {
        let message = refused(arguments);
        assert!(message.contains(expected), "{expected} is not in {message}");
    }
}

fn verify(lattice: &str, certificate: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ffd"))
        .args(["verify", lattice, certificate])
        .output()
        .expect("it starts")
}

/// A cubic lattice in the plane with one control point moved.
fn moved(by: f64) -> Lattice<2> {
    let grid = Grid::new([Degree::CUBIC; 2], [3, 3], Frame::unit()).expect("small");
    let mut lattice = Lattice::at_rest(grid).expect("small");
    lattice.set_displacement(14, [by, 0.1]).expect("finite");
    lattice
}

#[test]
fn certificates_are_written_and_verified() {
    let scratch = Scratch::new("certificate");
    let good = scratch.lattice("good.json", &moved(0.3));
    let folded = scratch.lattice("folded.json", &moved(3.0));
    let proof = scratch.0.join("proof.json").display().to_string();
    let lines_of_check = answered(&[&good, "--certificate", &proof]);
    assert_eq!(lines_of_check[0]["verdict"], "injective");

    let output = verify(&good, &proof);
    assert_eq!(output.status.code(), Some(0));
    let line = lines(&output).remove(0);
    assert_eq!(line["valid"], true);
    assert_eq!(line["claim"], "injective");
    assert_eq!(line["theorem"], "p_matrix");
    assert!(line["min_det"].as_f64().expect("a bound") > 0.5);
    assert!(line["reason"].is_null());

    // Nothing is proven of another lattice.
    let output = verify(&folded, &proof);
    assert_eq!(output.status.code(), Some(1));
    let line = lines(&output).remove(0);
    assert_eq!(line["valid"], false);
    assert!(line["min_det"].is_null() && line["theorem"].is_null());
    assert!(
        line["reason"].as_str().expect("a reason").contains("cell"),
        "{line}"
    );

    // A file that is there stays, unless told otherwise.
    let output = check(&[&folded, "--certificate", &proof]);
    assert_eq!(output.status.code(), Some(2));
    answered(&[&folded, "--certificate", &proof, "--force"]);
    let output = verify(&folded, &proof);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(lines(&output)[0]["claim"], "not_injective");
}

#[test]
fn sequences_have_a_list_of_certificates() {
    let scratch = Scratch::new("certificates");
    let sequence = Sequence::new(vec![moved(0.3), moved(3.0)]);
    let sequence = scratch.file("two.json", serde_json::to_string(&sequence).expect("JSON"));
    let proof = scratch.0.join("proof.json").display().to_string();
    answered(&[&sequence, "--certificate", &proof]);
    let output = verify(&sequence, &proof);
    assert_eq!(output.status.code(), Some(0));
    let claims: Vec<_> = lines(&output).iter().map(|l| l["claim"].clone()).collect();
    assert_eq!(claims, ["injective", "not_injective"]);

    let one = scratch.lattice("one.json", &moved(0.3));
    let text = fs::read_to_string(&proof).expect("there");
    for (name, text) in [
        ("wrong.json", "{}".to_owned()),
        ("cut.json", text[..text.len() / 2].to_owned()),
        ("empty.json", String::new()),
        ("none.json", "{\"certificates\":[]}".to_owned()),
        ("two-proofs.json", text),
    ] {
        let proof = scratch.file(name, text);
        let output = verify(&one, &proof);
        assert_eq!(output.status.code(), Some(2), "{name}");
        assert!(output.stdout.is_empty());
    }
    let output = check(&[&one, &sequence, "--certificate", &proof, "--force"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn what_is_undecided_gets_no_certificate() {
    let scratch = Scratch::new("uncertified");
    let lattice = scratch.lattice("folded.json", &moved(3.0));
    let proof = scratch.0.join("proof.json");
    let name = proof.display().to_string();
    let output = check(&[&lattice, "--method", "phi", "--certificate", &name]);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(lines(&output)[0]["verdict"], "undecided");
    let notes = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(
        notes.starts_with("note: no certificate is written"),
        "{notes}"
    );
    assert!(!proof.exists());
}
