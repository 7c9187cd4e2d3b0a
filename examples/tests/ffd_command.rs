//! The `ffd` program as a user meets it.

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use examples::mesh_file::{MeshFile, MeshFormat};
use ffd_core::{Border, Degree, Frame, Grid, Lattice, Sequence, transform_normal};
use serde_json::{Value, json};

/// A folder of this test's own, removed when the test ends.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ffd-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("writable");
        Self(path)
    }

    fn file(&self, name: &str, contents: impl AsRef<[u8]>) -> String {
        let path = self.0.join(name);
        fs::write(&path, contents).expect("writable");
        path.display().to_string()
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }

    fn count(&self) -> usize {
        fs::read_dir(&self.0).expect("there").count()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ignored = fs::remove_dir_all(&self.0);
    }
}

fn ffd(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ffd"))
        .args(arguments)
        .output()
        .expect("it starts")
}

/// A run that must succeed: what it prints to standard output, and its notes.
fn answered(arguments: &[&str]) -> (Value, String) {
    let output = ffd(arguments);
    let notes = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {notes}");
    let answer = serde_json::from_slice(&output.stdout).expect("JSON on standard output");
    (answer, notes)
}

/// A run that must fail: exit code 2, nothing on standard output, and one line on
/// standard error, which is returned.
fn refused(arguments: &[&str]) -> String {
    let output = ffd(arguments);
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty());
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

fn mesh(path: impl AsRef<Path>) -> MeshFile {
    let path = path.as_ref();
    let format = MeshFormat::from_path(path).expect("a known ending");
    MeshFile::parse(&fs::read(path).expect("written"), format).expect("a mesh")
}

/// The largest difference of a coordinate.
fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.fold(0.0, |most, (a, b)| f64::max(most, (a - b).abs()))
}

fn normals(mesh: &MeshFile) -> Vec<[f64; 3]> {
    mesh.normals().iter().map(|n| n.normal).collect()
}

/// A ball of radius 1 around the origin, as an OBJ with normals.
fn ball() -> String {
    let (rings, around) = (12, 16);
    let mut text = String::from("# a ball\no ball\n");
    for ring in 0..=rings {
        for step in 0..around {
            let (polar, turn) = (
                std::f64::consts::PI * f64::from(ring) / f64::from(rings),
                std::f64::consts::TAU * f64::from(step) / f64::from(around),
            );
            let [x, y, z] = [
                polar.sin() * turn.cos(),
                polar.cos(),
                polar.sin() * turn.sin(),
            ];
            writeln!(text, "v {x} {y} {z}\nvn {x} {y} {z}").expect("memory");
        }
    }
    for ring in 0..rings {
        for step in 0..around {
            let next = (step + 1) % around;
            let corner = |ring: i32, step: i32| {
                let vertex = ring * around + step + 1;
                format!("{vertex}//{vertex}")
            };
            let corners = [
                corner(ring, step),
                corner(ring, next),
                corner(ring + 1, next),
                corner(ring + 1, step),
            ];
            writeln!(text, "f {}", corners.join(" ")).expect("memory");
        }
    }
    text
}

/// A lattice around the ball that bends it without folding: neighbouring control points
/// differ by less than half a cell.
fn bend(border: Border) -> Lattice<3> {
    let frame = Frame::new(
        [-1.1; 3],
        [[0.55, 0.0, 0.0], [0.0, 0.55, 0.0], [0.0, 0.0, 0.55]],
    );
    let grid = Grid::new([Degree::CUBIC; 3], [4; 3], frame.expect("a box"))
        .and_then(|grid| grid.with_border(border))
        .expect("a grid");
    let displacements = (0..grid.control_point_count()).map(|i| {
        let [x, y, z] = grid.rest_position(i);
        [
            0.1 * y * y - 0.05 * z,
            0.08 * (2.0 * x).sin(),
            0.1 * x * y + 0.05,
        ]
    });
    let displacements = displacements.collect();
    Lattice::new(grid, displacements).expect("a lattice")
}

fn text(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("JSON")
}

#[test]
fn a_deformation_is_undone() {
    let scratch = Scratch::new("undo");
    let ball = scratch.file("ball.obj", ball());
    let one = bend(Border::Identity);
    let sequence = Sequence::new(vec![one.clone(), one.clone()]);
    for (name, lattice) in [("one", text(&one)), ("two", text(&sequence))] {
        let lattice = scratch.file(&format!("{name}.json"), lattice);
        let (bent, back) = (
            scratch.path(&format!("{name}-bent.obj")),
            scratch.path(&format!("{name}-back.obj")),
        );
        let (summary, notes) = answered(&["deform", &ball, "--lattice", &lattice, "-o", &bent]);
        assert_eq!(summary["vertices"], 13 * 16);
        assert!(notes.contains("0 of 208 points lie outside"), "{notes}");
        let (summary, notes) = answered(&["undo", &bent, "--lattice", &lattice, "-o", &back]);
        assert_eq!(
            summary,
            json!({"vertices": 208, "two_preimages": 0, "not_in_image": 0, "unresolved": 0})
        );
        assert_eq!(notes, "");

        let [ball, bent, back] = [&ball, &bent, &back].map(mesh);
        assert!(distance(ball.positions(), bent.positions()) > 0.1);
        assert!(distance(&normals(&ball), &normals(&bent)) > 0.1);
        assert!(distance(ball.positions(), back.positions()) <= 1e-12);
        assert!(distance(&normals(&ball), &normals(&back)) <= 1e-12);
    }
    // Once by the library.
    let [ball, bent] = ["ball.obj", "one-bent.obj"].map(|name| mesh(scratch.path(name)));
    for ((&x, y), (n, m)) in ball
        .positions()
        .iter()
        .zip(bent.positions())
        .zip(ball.normals().iter().zip(bent.normals()))
    {
        let there = one.evaluate(x).expect("inside");
        assert_eq!(there.position.map(f64::to_bits), y.map(f64::to_bits));
        let normal = transform_normal(&there.jacobian, n.normal);
        assert!(distance(&[normal], &[m.normal]) <= 1e-15);
    }
}

#[test]
fn points_outside_are_kept_clamped_or_refused() {
    let scratch = Scratch::new("outside");
    let points = "v 1 1 1\nv 5 1 1\nv 1 -3 1\nv 0.30 0.30 2\nvn 0 0 0.5\nf 1//1 2//1 3//1 4//1\n";
    let points = scratch.file("points.obj", points);
    let grid = Grid::new([Degree::CUBIC; 3], [2; 3], Frame::unit()).expect("a grid");
    let lift = Lattice::new(grid.clone(), vec![[0.0, 0.0, 0.5]; 125]).expect("a lattice");
    let lattice = scratch.file("lift.json", text(&lift));
    let run = |outside: &str| {
        let out = scratch.path(&format!("{outside}.obj"));
        let command = [
            "deform",
            &points,
            "--lattice",
            &lattice,
            "--outside",
            outside,
            "-o",
            &out,
        ];
        let (summary, notes) = answered(&command);
        assert_eq!(summary, json!({"vertices": 4, "outside": [2]}));
        assert!(
            notes.starts_with("note: 2 of 4 points lie outside the lattice"),
            "{notes}"
        );
        let heights: Vec<f64> = mesh(&out).positions().iter().map(|p| p[2]).collect();
        (heights, fs::read_to_string(out).expect("written"))
    };
    let (heights, kept) = run("keep");
    assert!(
        heights
            .iter()
            .zip([1.5, 1.0, 1.0, 2.5])
            .all(|(a, b)| (a - b).abs() < 1e-14)
    );
    // Numbers that do not change keep their digits.
    assert!(
        kept.contains("v 5 1 1\n") && kept.contains("v 0.30 0.30 2."),
        "{kept}"
    );
    let (heights, _) = run("clamp");
    assert!(
        heights
            .iter()
            .zip([1.5, 1.5, 1.5, 2.5])
            .all(|(a, b)| (a - b).abs() < 1e-14)
    );

    let out = scratch.path("none.obj");
    let message = refused(&[
        "deform",
        &points,
        "--lattice",
        &lattice,
        "--outside",
        "error",
        "-o",
        &out,
    ]);
    assert!(
        message.contains("points.obj: point 1, [5.0, 1.0, 1.0], lies outside"),
        "{message}"
    );
    let two = scratch.file("two.json", text(&Sequence::new(vec![lift.clone(), lift])));
    let message = refused(&[
        "deform",
        &points,
        "--lattice",
        &two,
        "--outside",
        "error",
        "-o",
        &out,
    ]);
    assert!(
        message.contains("points.obj: lattice 1 of 2: point 1"),
        "{message}"
    );
    assert!(!Path::new(&out).exists());

    // A box that was lifted covers what lies above it, and leaves a gap below.
    let up = "v 1 1 2.25\nv 1 1 0.25\nv 1 1 1\n";
    let up = scratch.file("up.obj", up);
    let down = scratch.path("down.ply");
    let (summary, notes) = answered(&["undo", &up, "--lattice", &lattice, "-o", &down]);
    assert_eq!(
        summary,
        json!({"vertices": 3, "two_preimages": 1, "not_in_image": 1, "unresolved": 0})
    );
    assert!(
        notes.contains("1 of 3 points may also have been outside"),
        "{notes}"
    );
    assert!(
        notes.contains("1 of 3 points are not in the image"),
        "{notes}"
    );
    let heights: Vec<f64> = mesh(&down).positions().iter().map(|p| p[2]).collect();
    assert!(
        heights
            .iter()
            .zip([1.75, 0.25, 0.5])
            .all(|(a, b)| (a - b).abs() < 1e-14)
    );
}

#[test]
fn formats_are_converted_with_a_note() {
    let scratch = Scratch::new("formats");
    let ball = scratch.file("ball.obj", ball());
    let lattice = scratch.file("bend.json", text(&bend(Border::Free)));
    let [ply, stl, obj] = ["bent.ply", "bent.STL", "again.obj"].map(|name| scratch.path(name));
    let (_, notes) = answered(&["deform", &ball, "--lattice", &lattice, "-o", &ply]);
    assert!(notes.contains("bent.ply: not written to PLY"), "{notes}");
    let (_, notes) = answered(&["deform", &ply, "--lattice", &lattice, "-o", &stl]);
    assert!(
        notes.contains("bent.STL: polygons are cut into triangles"),
        "{notes}"
    );
    assert!(notes.contains("normals of vertices"), "{notes}");
    let (_, notes) = answered(&["undo", &stl, "--lattice", &lattice, "-o", &obj]);
    assert!(!notes.contains("again.obj"), "{notes}");
    // Corners of an STL come in the order of triangles, and in single precision.
    let [ply, obj] = [mesh(&ply), mesh(&obj)];
    for corner in obj.positions() {
        let near = ply
            .positions()
            .iter()
            .any(|p| distance(&[*p], &[*corner]) < 1e-6);
        assert!(near, "{corner:?}");
    }
}

#[test]
fn points_are_evaluated() {
    let scratch = Scratch::new("eval");
    let one = bend(Border::Free);
    let points = [[0.1, -0.2, 0.3], [-1.0, 1.0, 0.5], [7.0, 0.0, 0.0]];
    let file = scratch.file("points.json", text(&points));
    let lattice = scratch.file("bend.json", text(&one));
    let (answer, notes) = answered(&["eval", &lattice, &file]);
    assert_eq!(
        notes,
        "note: 1 of 3 points lie outside: they stay where they are\n"
    );
    let there = points.map(|x| one.evaluate(x));
    let identity = json!([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    for i in 0..2 {
        let there = there[i].expect("inside");
        assert_eq!(answer["points"][i], json!(there.position));
        assert_eq!(answer["jacobians"][i], json!(there.jacobian.as_flattened()));
        assert_eq!(answer["det"][i], json!(there.determinant));
    }
    assert_eq!(answer["points"][2], json!(points[2]));
    assert_eq!(answer["jacobians"][2], identity);
    assert_eq!(answer["det"][2], json!(1.0));

    let sequence = Sequence::new(vec![one.clone(), one]);
    let two = scratch.file("two.json", text(&sequence));
    let (answer, _) = answered(&["eval", &two, &file]);
    let there = sequence.evaluate(points[0]).expect("finite");
    assert_eq!(answer["points"][0], json!(there.position));
    assert_eq!(answer["jacobians"][0], json!(there.jacobian.as_flattened()));

    let none = scratch.file("none.json", "\u{FEFF}{\"sequence\": []}");
    let (answer, _) = answered(&["eval", &none, &file]);
    assert_eq!(answer["points"], json!(points));

    // In the plane: a shear by half.
    let grid = Grid::new([Degree::QUADRATIC; 2], [2; 2], Frame::unit()).expect("a grid");
    let shear = (0..grid.control_point_count()).map(|i| [0.5 * grid.rest_position(i)[1], 0.0]);
    let plane = Lattice::new(grid.clone(), shear.collect()).expect("a lattice");
    let plane = scratch.file("plane.json", text(&plane));
    let flat = scratch.file("flat.json", "[[0.5, 1.0]]");
    let (answer, _) = answered(&["eval", &plane, &flat]);
    assert_eq!(answer["points"], json!([[1.0, 1.0]]));
    assert_eq!(answer["jacobians"], json!([[1.0, 0.5, 0.0, 1.0]]));
    assert_eq!(answer["det"], json!([1.0]));
    assert!(refused(&["eval", &plane, &file]).contains("points.json: point 0: 2 coordinates"));
    let ball = scratch.file("ball.obj", ball());
    let out = scratch.path("out.obj");
    let message = refused(&["deform", &ball, "--lattice", &plane, "-o", &out]);
    assert!(
        message.contains("plane.json: it deforms the plane"),
        "{message}"
    );
}

#[test]
fn a_pull_moves_the_vertex_picked() {
    let scratch = Scratch::new("pull");
    let ball = scratch.file("ball.obj", ball());
    let (pear, lattice) = (scratch.path("pear.obj"), scratch.path("pear.json"));
    let (summary, _) = answered(&[
        "pull",
        &ball,
        "--at",
        "0,1,0",
        "--by",
        "-0.1,0.2,0",
        "--at",
        "0, -1, 0",
        "--by",
        "0,0,0",
        "-o",
        &pear,
        "--save-lattice",
        &lattice,
    ]);
    assert_eq!(summary["vertices"], 208);
    assert_eq!(summary["constraints"], 2);
    assert!(summary["least_det"].as_f64().expect("a number") > 0.0);
    let (before, after) = (mesh(&ball), mesh(&pear));
    let moved = |x: [f64; 3]| {
        let index = before
            .positions()
            .iter()
            .position(|p| distance(&[*p], &[x]) < 1e-15);
        after.positions()[index.expect("a vertex")]
    };
    assert!(distance(&[moved([0.0, 1.0, 0.0])], &[[-0.1, 1.2, 0.0]]) < 1e-12);
    assert!(distance(&[moved([0.0, -1.0, 0.0])], &[[0.0, -1.0, 0.0]]) < 1e-12);

    // The lattice is as promised, and does the same again and back.
    let text = fs::read_to_string(&lattice).expect("written");
    let saved: Lattice<3> = serde_json::from_str(&text).expect("a lattice");
    assert_eq!(saved.grid().cells(), [4; 3]);
    assert_eq!(saved.grid().border(), Border::Identity);
    let corners = [[0.0; 3], [4.0; 3]].map(|u| saved.grid().frame().to_world(u));
    assert!(distance(&corners, &[[-1.1; 3], [1.1; 3]]) < 1e-14);
    let (again, back) = (scratch.path("again.obj"), scratch.path("back.obj"));
    answered(&["deform", &ball, "--lattice", &lattice, "-o", &again]);
    assert_eq!(
        fs::read(&pear).expect("written"),
        fs::read(&again).expect("written")
    );
    answered(&["undo", &again, "--lattice", &lattice, "-o", &back]);
    assert!(distance(mesh(&back).positions(), before.positions()) < 1e-12);

    // A flat sheet, with few cells across.
    let sheet = "v 0 0 5\nv 1 0 5\nv 1 1 5\nv 0 1 5\nf 1 2 3 4\n";
    let sheet = scratch.file("sheet.obj", sheet);
    let dent = scratch.path("dent.ply");
    let pull = [
        "pull", &sheet, "--at", "1,1,5", "--by", "0,0,-.5", "--cells", "2,2,1", "-o", &dent,
    ];
    answered(&pull);
    assert!(distance(&mesh(&dent).positions()[2..3], &[[1.0, 1.0, 4.5]]) < 1e-12);

    // A pull that goes too far says so.
    let far = scratch.path("far.obj");
    let (summary, notes) =
        answered(&["pull", &ball, "--at", "0,1,0", "--by", "0,-3,0", "-o", &far]);
    assert!(summary["least_det"].as_f64().expect("a number") < 0.0);
    assert!(notes.contains("inside out"), "{notes}");
}

/// A pull so far that one lattice folds is done in steps, which other commands take.
#[test]
fn a_far_pull_in_steps_does_not_fold() {
    let scratch = Scratch::new("steps");
    let ball = scratch.file("ball.obj", ball());
    let (club, steps) = (scratch.path("club.obj"), scratch.path("club.json"));
    let pull = ["pull", &ball, "--at", "0,1,0", "--by", "1.8,0,0", "--force"];
    let pull = [&pull[..], &["-o", &club, "--save-lattice", &steps]].concat();
    let (summary, notes) = answered(&pull);
    assert!(summary["least_det"].as_f64().expect("a number") < 0.0);
    assert!(notes.contains("--injective"), "{notes}");

    for policy in [
        &["--injective"][..],
        &["--injective", "paper"],
        &["--injective=greedy"],
    ] {
        let (summary, _) = answered(&[&pull[..], policy].concat());
        assert!(summary["least_det"].as_f64().expect("a number") > 0.0);
        assert_eq!(summary["achieved"], 1.0);
        let text = fs::read_to_string(&steps).expect("written");
        let saved: Sequence<3> = serde_json::from_str(&text).expect("a sequence");
        assert!(saved.lattices().len() > 1);
        assert_eq!(summary["steps"], saved.lattices().len());
        let top = saved.deform_point([0.0, 1.0, 0.0]);
        assert!(distance(&[top], &[[1.8, 1.0, 0.0]]) < 1e-9);

        let again = scratch.path("again.obj");
        answered(&[
            "deform",
            &ball,
            "--lattice",
            &steps,
            "-o",
            &again,
            "--force",
        ]);
        assert_eq!(mesh(&again).positions(), mesh(&club).positions());
        let back = scratch.path("back.obj");
        answered(&["undo", &club, "--lattice", &steps, "-o", &back, "--force"]);
        assert!(distance(mesh(&back).positions(), mesh(&ball).positions()) < 1e-12);
        let points = scratch.file("points.json", "[[0,1,0]]");
        let (evaluated, _) = answered(&["eval", &steps, &points]);
        assert!(evaluated["det"][0].as_f64().expect("a number") > 0.0);
        let checked = ffd(&["check", &steps]);
        let checked = String::from_utf8(checked.stdout).expect("UTF-8");
        assert_eq!(checked.lines().count(), saved.lattices().len());
        for line in checked.lines() {
            let line: Value = serde_json::from_str(line).expect("JSON");
            assert_eq!(line["theorem"], "identity_border");
        }
    }
}

/// Points that are to pass through each other go as far as they can; with the policy of
/// the paper nothing is done.
#[test]
fn a_pull_that_cannot_be_done_says_so() {
    let scratch = Scratch::new("crossing");
    let ball = scratch.file("ball.obj", ball());
    let (out, steps) = (scratch.path("out.obj"), scratch.path("out.json"));
    let pull = [
        "pull",
        &ball,
        "--at",
        "-0.5,0,0",
        "--by",
        "1.5,0,0",
        "--at",
        "0.5,0,0",
        "--by",
        "-1.5,0,0",
        "-o",
        &out,
        "--save-lattice",
        &steps,
        "--force",
        "--injective",
    ];
    let refused = ffd(&[&pull[..], &["paper"]].concat());
    assert_eq!(refused.status.code(), Some(1));
    assert!(refused.stdout.is_empty() && !Path::new(&out).exists());
    let message = String::from_utf8(refused.stderr).expect("UTF-8");
    assert!(message.contains("noninjective"), "{message}");
    for policy in ["exact", "greedy"] {
        let output = ffd(&[&pull[..], &[policy]].concat());
        assert_eq!(output.status.code(), Some(1));
        let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let achieved = summary["achieved"].as_f64().expect("a number");
        assert!(0.2 < achieved && achieved < 1.0 / 3.0, "{achieved}");
        assert!(summary["least_det"].as_f64().expect("a number") > 0.0);
        let message = String::from_utf8(output.stderr).expect("UTF-8");
        assert!(message.contains("of their ways"), "{message}");
        assert_eq!(mesh(&out).positions().len(), 208);
    }
}

#[test]
fn bad_input_is_named_and_leaves_nothing() {
    let scratch = Scratch::new("refused");
    let ball = scratch.file("ball.obj", ball());
    let good = scratch.file("good.json", text(&bend(Border::Free)));
    let points = scratch.file("points.json", "[[0,0,0]]");
    let (out, other) = (scratch.path("out.obj"), scratch.path("other.json"));
    let deform =
        |mesh: &str, lattice: &str| refused(&["deform", mesh, "--lattice", lattice, "-o", &out]);
    let lattice = |contents: &str| scratch.file("bad.json", contents);
    let contains = |message: String, expected: &[&str]| {
        for part in expected {
            assert!(message.contains(part), "{part} is not in {message}");
        }
    };

    contains(deform("none.obj", &good), &["none.obj: No such file"]);
    let folder = scratch.0.display().to_string();
    contains(deform(&folder, &good), &["the name ends in \"\""]);
    contains(deform(&ball, &folder), &["Is a directory"]);
    let bad_mesh = scratch.file("bad.obj", "v 0 0 0\nv 1 x 0\n");
    contains(
        deform(&bad_mesh, &good),
        &["bad.obj: line 2", "\"x\" is not a number"],
    );
    let empty = scratch.file("empty.ply", "");
    contains(deform(&empty, &good), &["empty.ply: "]);

    contains(deform(&ball, "none.json"), &["none.json: No such file"]);
    contains(
        deform(&ball, &lattice("{")),
        &["bad.json: ", "line 1 column 1"],
    );
    contains(
        deform(&ball, &lattice("{\n \"degree\": [3,3,7]}")),
        &["bad.json: missing field"],
    );
    contains(
        deform(&ball, &lattice("{\"de\\ngree\": 1}")),
        &["bad.json: unknown field `de\\ngree`", "line 1"],
    );
    let seven = text(&bend(Border::Free)).replacen("[3,3,3]", "[3,3,7]", 1);
    contains(
        deform(&ball, &lattice(&seven)),
        &["bad.json: degree 7", "line 1 column"],
    );
    let infinite = "{\"sequence\": [\n{\"degree\": [1,1,1], \"origin\": [0,0,1e999]}]}";
    contains(
        deform(&ball, &lattice(infinite)),
        &["number out of range", "line 2 column"],
    );
    // Lists without end.
    contains(
        deform(&ball, &lattice(&"[".repeat(100_000))),
        &["bad.json: "],
    );
    contains(
        refused(&["eval", &good, &lattice("[[0,0,0],\n[0,0,\"x\"]]")]),
        &["line 2 column"],
    );
    contains(
        refused(&["eval", &good, &lattice("[[0,0,0],[0,0]]")]),
        &["bad.json: point 1: 3"],
    );
    contains(
        refused(&["eval", &good, &lattice("{}")]),
        &["bad.json: ", "line 1 column"],
    );

    let mut huge = bend(Border::Free);
    for i in 0..huge.displacements().len() {
        huge.set_displacement(i, [f64::MAX; 3]).expect("finite");
    }
    let huge = text(&Sequence::new(vec![huge.clone(), huge]));
    let message = deform(&ball, &lattice(&huge));
    contains(message, &["ball.obj: lattice 2 of 2: ", "is inf"]);

    let pull = |extra: &[&str]| refused(&[&["pull", &ball, "-o", &out], extra].concat());
    let at = ["--at", "0,1,0", "--by", "0,0.1,0"];
    contains(pull(&at[..2]), &["required", "--by"]);
    contains(
        pull(&[&at[..], &["--at", "1,0,0"]].concat()),
        &["2 of the first and 1"],
    );
    contains(
        pull(&["--at", "0,9,0", "--by", "0,0,0"]),
        &["--at 0,9,0: ", "outside the box"],
    );
    contains(
        pull(&["--at", "0,1", "--by", "0,0,0"]),
        &["'0,1'", "three finite numbers"],
    );
    contains(
        pull(&["--at", "0,1,nan", "--by", "0,0,0"]),
        &["three finite numbers"],
    );
    contains(
        pull(&[&at[..], &["--cells", "0,1,1"]].concat()),
        &["from 1 to 128"],
    );
    let both = [&at[..], &["--at", "0,1,0", "--by", "0,0.2,0"]].concat();
    contains(pull(&both), &["--at numbers 1, 2 contradict each other"]);
    contains(
        pull(&[&at[..], &["--save-lattice", &out]].concat()),
        &["out.obj: two outputs"],
    );
    contains(
        pull(&[&at[..], &["--save-lattice", &scratch.path("no/l.json")]].concat()),
        &["no/l.json: No such file"],
    );
    contains(refused(&[]), &["subcommand"]);
    contains(refused(&["deform", &ball, "-o", &out]), &["--lattice"]);

    // Formats, and names that are taken.
    let message = refused(&[
        "deform",
        &ball,
        "--lattice",
        &good,
        "-o",
        &scratch.path("out.glb"),
    ]);
    contains(message, &["out.glb: ", "\"glb\"", ".stl are known"]);
    for force in [&[][..], &["--force"]] {
        let itself = [&["deform", &ball, "--lattice", &good, "-o", &ball], force].concat();
        contains(refused(&itself), &["ball.obj: this is what is read"]);
    }
    let before = fs::read(&ball).expect("there");
    assert!(!Path::new(&out).exists());

    fs::write(&out, "precious").expect("writable");
    contains(
        deform(&ball, &good),
        &["out.obj: there is such a file already", "--force"],
    );
    contains(
        pull(&[&at[..], &["--save-lattice", &other]].concat()),
        &["out.obj: there"],
    );
    assert!(!Path::new(&other).exists(), "both or none");
    fs::rename(&out, &other).expect("ours");
    contains(
        pull(&[&at[..], &["--save-lattice", &other]].concat()),
        &["other.json: there"],
    );
    assert!(!Path::new(&out).exists(), "both or none");
    assert_eq!(fs::read(&other).expect("there"), b"precious");
    let forced = [
        "pull",
        &ball,
        "-o",
        &out,
        "--save-lattice",
        &other,
        "--force",
    ];
    answered(&[&forced[..], &at].concat());
    assert!(
        fs::read_to_string(&other)
            .expect("there")
            .starts_with("{\"degree\"")
    );

    answered(&["eval", &good, &points]);
    assert_eq!(fs::read(&ball).expect("there"), before);
    // ball, good, points, bad.json, bad.obj, empty.ply, and the two outputs.
    assert_eq!(scratch.count(), 8);
}

#[test]
fn help_has_examples() {
    for command in [
        &["--help"][..],
        &["deform", "--help"],
        &["undo", "--help"],
        &["pull", "--help"],
        &["eval", "--help"],
        &["check", "--help"],
        &["verify", "--help"],
    ] {
        let output = ffd(command);
        assert_eq!(output.status.code(), Some(0));
        let help = String::from_utf8(output.stdout).expect("UTF-8");
        assert!(help.contains("Examples:\n  ffd "), "{help}");
    }
}
