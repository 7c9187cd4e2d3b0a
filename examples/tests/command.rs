//! The program as a user meets it.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// A folder of this test's own, removed when the test ends.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("glove-loop-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("writable");
        Self(path)
    }

    fn file(&self, name: &str, contents: &str) -> String {
        let path = self.0.join(name);
        fs::write(&path, contents).expect("writable");
        path.display().to_string()
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ignored = fs::remove_dir_all(&self.0);
    }
}

fn glove_loop(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_glove-loop"))
        .args(arguments)
        .output()
        .expect("it starts")
}

/// A run that must fail: exit code 2, nothing on standard output, and one line on
/// standard error, which is returned.
fn refused(arguments: &[&str]) -> String {
    let output = glove_loop(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    assert!(output.stdout.is_empty());
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

#[test]
fn bad_input_is_named_and_spoils_nothing() {
    let scratch = Scratch::new("refused");
    let out = scratch.path("out");
    fs::create_dir(&out).expect("writable");
    fs::write(Path::new(&out).join("report.json"), "precious").expect("writable");
    let refused_with = |option: &str, value: &str| {
        refused(&[
            "--resolution",
            "3",
            "--frames",
            "20",
            "--out",
            &out,
            option,
            value,
        ])
    };

    let angles = vec!["0,1"; 22].join(" : ");
    let joints = |text: &str| scratch.file("joints.txt", text);
    let missing = scratch.path("missing.txt");
    assert!(refused_with("--joints", &missing).contains("missing.txt: No such file"));
    let nan = format!("{angles}\n{}", angles.replacen("0,1", "NaN", 3));
    let message = refused_with("--joints", &joints(&nan));
    assert!(message.contains("joints.txt: line 2, value 1"), "{message}");
    assert!(message.contains("not finite"), "{message}");
    let message = refused_with("--joints", &joints("0,1 : 0,2"));
    assert!(message.contains("line 1 has 2 values"), "{message}");
    assert!(refused_with("--joints", &joints("")).contains("empty"));

    let pose = scratch.file("pose.traj", "1 0 0 0\n0 1 0 0\n0 0 1 0\n");
    let message = refused_with("--pose", &pose);
    assert!(
        message.contains("pose.traj: ") && message.contains("line "),
        "{message}"
    );

    let far = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n\n1 0 0 50\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let message = refused_with("--pose", &scratch.file("far.traj", far));
    assert!(
        message.contains("far.traj: matrix 1: ") && message.contains("3.05 m"),
        "{message}"
    );
    let garbage = scratch.0.join("garbage.txt");
    fs::write(&garbage, b"0,1 : 0,2\n\xFF\xFE").expect("writable");
    let message = refused_with("--joints", &garbage.display().to_string());
    assert!(
        message.contains("garbage.txt: line 2: this is not text"),
        "{message}"
    );

    let inverted = "vertices 4\n0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\nelements 1\n0 2 1 3\ndisplay 0\n";
    let message = refused_with("--object", &scratch.file("inverted.txt", inverted));
    assert!(
        message.contains("inverted.txt: line 7: tetrahedron 0 is inverted"),
        "{message}"
    );
    assert!(refused_with("--object", "banana").contains("banana: No such file"));

    assert!(refused(&["--out", &out, "--frames", "0"]).contains("from 1 to"));
    assert!(refused(&["--out", &out, "--resolution", "99"]).contains("from 3 to 16"));
    assert!(refused(&["--out", &out, "--fingers", "2"]).contains("from 3 to 5"));
    assert!(refused(&["--out", &out, "--fault", "glove"]).contains("glove:drop:120"));
    assert!(refused_with("--fault", "glove:drop:20").contains("no frame 20"));
    // The line dies in the middle of a run, or in its last frame.
    let message = refused(&["--frames", "1", "--out", &out, "--fault", "glove:cut:0"]);
    assert!(message.contains("no complete record at all"), "{message}");
    let message = refused_with("--fault", "glove:cut:19");
    assert!(
        message.contains("glove: the byte stream is truncated"),
        "{message}"
    );
    let cut = [
        "--resolution",
        "3",
        "--frames",
        "100",
        "--out",
        &out,
        "--fault",
        "tracker:cut:9",
    ];
    let message = refused(&cut);
    assert!(
        message.contains("tracker: the byte stream is truncated"),
        "{message}"
    );

    let report = Path::new(&out).join("report.json");
    assert_eq!(fs::read_to_string(report).expect("there"), "precious");
    assert_eq!(fs::read_dir(&out).expect("there").count(), 1);
}

#[test]
fn a_run_leaves_report_picture_and_object() {
    let scratch = Scratch::new("run");
    let report = |out: &str, extra: &[&str]| -> serde_json::Value {
        let out = scratch.path(out);
        let arguments = [
            "--resolution",
            "3",
            "--frames",
            "450",
            "--json",
            "--out",
            &out,
        ];
        let output = glove_loop(&[&arguments, extra].concat());
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let printed = serde_json::from_slice(&output.stdout).expect("JSON on standard output");
        let written = fs::read(Path::new(&out).join("report.json")).expect("written");
        assert_eq!(output.stdout, written);
        printed
    };
    // The number of threads does not matter, the seed does.
    let one = report("one", &["--threads", "1", "--vtu"]);
    let two = report("two", &["--threads", "2"]);
    let other = report("other", &["--seed", "2"]);
    assert_eq!(one["position_hash"], two["position_hash"]);
    assert_ne!(one["position_hash"], other["position_hash"]);
    assert_eq!(one["contacts"], two["contacts"]);

    for file in ["contact-sheet.png", "object.txt"] {
        let bytes =
            |out: &str| fs::read(Path::new(&scratch.path(out)).join(file)).expect("written");
        assert_eq!(bytes("one"), bytes("two"), "{file}");
    }
    let series = fs::read_to_string(scratch.0.join("one/series.pvd")).expect("written");
    assert_eq!(series.matches("<DataSet").count(), 45);
    assert!(scratch.0.join("one/frames/frame-000440.vtu").exists());

    // The object left behind can be squeezed again.
    let object = scratch.path("one/object.txt");
    let again = report("again", &["--object", &object]);
    let volume = |report: &serde_json::Value, key: &str| report["object"][key].as_f64();
    let (before, after) = (
        volume(&one, "final_volume_m3").expect("a number"),
        volume(&again, "initial_volume_m3").expect("a number"),
    );
    assert!((after / before - 1.0).abs() < 1e-12);
}
