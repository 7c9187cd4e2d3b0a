//! The `warp` program as a user meets it.

use std::{
    fs,
    process::{Command, Output},
};

use examples::raster::Image;
use serde_json::Value;

fn warp(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_warp"))
        .args(arguments)
        .output()
        .expect("it starts")
}

fn answered(arguments: &[&str]) -> Value {
    let output = warp(arguments);
    let notes = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {notes}");
    serde_json::from_slice(&output.stdout).expect("JSON on standard output")
}

fn refused(arguments: &[&str]) -> String {
    let output = warp(arguments);
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty());
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

/// The least value that was seen is not below the interval, which is narrow.
fn assert_least_is_enclosed(summary: &Value) {
    let number = |value: &Value| value.as_f64().expect("a number");
    let [low, high] = [0, 1].map(|end| number(&summary["min_det"][end]));
    assert!(low <= high && high - low <= 1e-3, "{summary}");
    let seen = number(&summary["det"]["min"]);
    assert!(seen >= low - 1e-12 && seen <= high + 0.1, "{summary}");
}

#[test]
fn a_picture_is_warped() {
    let folder = std::env::temp_dir().join(format!("warp-command-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("writable");
    let path = |name: &str| folder.join(name).display().to_string();
    let (face, again, fold) = (path("face.png"), path("again.png"), path("fold.png"));

    let summary = answered(&["-o", &face]);
    let det = |summary: &Value, end: &str| summary["det"][end].as_f64().expect("a number");
    assert!(det(&summary, "min") > 0.0 && det(&summary, "max") > 1.0);
    assert_eq!(summary["folded"], 0.0);
    assert_eq!(summary["verdict"], "injective");
    assert_eq!(summary["theorem"], "identity_border");
    assert_eq!(summary["witness"], Value::Null);
    assert_eq!(summary["live"]["steps"], 25);
    assert_eq!(summary["live"]["irregular_from"], Value::Null);
    assert_least_is_enclosed(&summary);
    answered(&["-o", &again]);
    let bytes = fs::read(&face).expect("written");
    assert_eq!(bytes, fs::read(&again).expect("written"), "deterministic");
    let image = Image::read_png(&bytes).expect("a PNG");
    assert!(image.width > 3 * 460 && image.height > 460);

    let message = refused(&["-o", &face]);
    assert!(
        message.contains("face.png: there is such a file already"),
        "{message}"
    );
    let drag = ["--drag", "480,180:-300,-20", "--steps", "10"];
    let summary = answered(&[&["-o", &face, "--force"], &drag[..]].concat());
    assert!(det(&summary, "min") < 0.0);
    assert!(summary["folded"].as_f64().expect("a number") > 0.0);
    assert_eq!(summary["verdict"], "not_injective");
    assert_eq!(summary["theorem"], Value::Null);
    assert_eq!(summary["witness"].as_array().map(Vec::len), Some(2));
    assert!(
        summary["irregular_cells"]
            .as_array()
            .is_some_and(|cells| !cells.is_empty())
    );
    let live = &summary["live"];
    assert_eq!(live["steps"], 10);
    let from = live["irregular_from"].as_f64().expect("a number");
    assert!(from > 0.0 && from < 1.0);
    assert!(live["worst_micros"].as_f64() >= live["median_micros"].as_f64());
    assert_least_is_enclosed(&summary);

    // Its own output is a picture, too: wider than high, with other cells.
    let summary = answered(&[
        "--image",
        &again,
        "--drag",
        "750,300:40,0",
        "--cells",
        "20",
        "-o",
        &fold,
    ]);
    assert_eq!(summary["picture"][0].as_u64(), Some(image.width as u64));
    assert_eq!(summary["cells"][0], 14);
    assert!(det(&summary, "min") > 0.0);

    let broken = path("broken.png");
    fs::write(&broken, &bytes[..1000]).expect("writable");
    let out = path("out.png");
    let cases: [(&[&str], &str); 9] = [
        (
            &["--image", "none.png", "--drag", "1,1:0,0"],
            "none.png: No such file",
        ),
        (&["--image", &broken, "--drag", "1,1:0,0"], "broken.png: "),
        (&["--image", &broken], "--drag"),
        (&["--drag", "1,1,0,0"], "four finite numbers"),
        (
            &["--drag", "-1,1:0,0"],
            "--drag -1,1: the picture has 960 by 960",
        ),
        (
            &["--drag", "0,9:5,0"],
            "--drag 0,9: this is too near to the edge",
        ),
        (
            &["--drag", "400,400:5,0", "--drag", "400,400:0,5"],
            "contradict each other",
        ),
        (&["--cells", "6"], "from 7 to 200"),
        (&["--steps", "0"], "1..=10000"),
    ];
    for (arguments, expected) in cases {
        let message = refused(&[&["-o", &out], arguments].concat());
        assert!(message.contains(expected), "{expected} is not in {message}");
    }
    assert!(!folder.join("out.png").exists());
    let message = refused(&[
        "--image", &again, "--drag", "1,1:0,0", "-o", &again, "--force",
    ]);
    assert!(
        message.contains("again.png: this is what is read"),
        "{message}"
    );
    fs::remove_dir_all(folder).expect("ours");
}
