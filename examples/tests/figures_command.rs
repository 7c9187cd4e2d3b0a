//! The `figures` program as a user meets it.

use std::{
    fs,
    path::PathBuf,
    process::{Command, Output},
};

use examples::raster::Image;
use serde_json::Value;

/// A folder of this test's own, removed when the test ends.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ignored = fs::remove_dir_all(&self.0);
    }
}

fn figures(folder: &Scratch, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_figures"))
        .arg("--out")
        .arg(&folder.0)
        .args(arguments)
        .output()
        .expect("it starts")
}

fn scratch(name: &str) -> Scratch {
    let name = format!("figures-{name}-{}", std::process::id());
    Scratch(std::env::temp_dir().join(name))
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("no number: {value}"))
}

/// Triangles that cross, from the mesh as it is to the last refinement that was tried.
fn crossings(pull: &Value, manner: &str, mesh: usize) -> Vec<u64> {
    let levels = pull["manners"][manner]["meshes"][mesh]["levels"].as_array();
    let levels = levels.unwrap_or_else(|| panic!("{manner}, mesh {mesh}: no levels"));
    let pairs = levels.iter().map(|level| level["crossing_pairs"].as_u64());
    pairs.map(|pairs| pairs.expect("a number")).collect()
}

#[test]
fn pulls_that_fold_cross_and_steps_do_not() {
    let folder = scratch("all");
    let output = figures(&folder, &["--quick"]);
    let notes = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{notes}");
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(summary["files"].as_array().map(Vec::len), Some(9));
    assert_eq!(fs::read_dir(&folder.0).expect("there").count(), 9);

    for figure in [1, 2, 3, 4, 5, 7, 8] {
        let bytes = fs::read(folder.0.join(format!("figure-{figure}.png"))).expect("there");
        let image = Image::read_png(&bytes).expect("a PNG");
        let paper = image.rgb[0];
        let drawn = image.rgb.iter().filter(|&&pixel| pixel != paper).count();
        assert!(
            drawn > image.rgb.len() / 40,
            "figure {figure} is nearly empty"
        );
    }

    let text = fs::read_to_string(folder.0.join("figures.json")).expect("there");
    let numbers: Value = serde_json::from_str(&text).expect("JSON");
    for figure in ["figure_1", "figure_2", "figure_5"] {
        assert_eq!(numbers[figure]["verdict"], "injective", "{figure}");
    }
    assert_eq!(numbers["figure_5"]["passes"], true);
    for fold in ["over_extension", "over_constraint"] {
        assert_eq!(numbers["figure_3"][fold]["verdict"], "not_injective");
        let seen = number(&numbers["figure_4"][fold]["sampled_det"][0]);
        let [low, high] = [0, 1].map(|end| number(&numbers["figure_4"][fold]["min_det"][end]));
        assert!(low <= high && high < 0.0 && seen >= low, "{fold}");
    }

    let rows = numbers["figure_6"]["rows"].as_array().expect("rows");
    let vertices: Vec<_> = rows.iter().map(|row| row["vertices"].as_u64()).collect();
    assert_eq!(vertices, [145, 545, 2113].map(Some));
    for row in rows {
        for (kind, timing) in row["kinds"].as_object().expect("kinds") {
            assert_eq!(timing["achieved"], 1.0, "{kind}");
        }
    }

    for (figure, pull) in [("figure_7", "1"), ("figure_7", "2"), ("figure_8", "3")] {
        let pull = &numbers[figure][pull];
        let at_rest = pull["at_rest"].as_array().expect("meshes");
        assert!(at_rest.iter().all(|mesh| mesh["crossing_pairs"] == 0));
        let one = &pull["manners"]["conventional"];
        assert_eq!(one["verdicts"][0], "not_injective", "{figure}");
        assert!(number(&one["least_det"]) < 0.0, "{figure}");
        let steps = &pull["manners"]["exact"];
        assert_eq!(steps["achieved"], 1.0, "{figure}");
        let verdicts = steps["verdicts"].as_array().expect("verdicts");
        assert!(verdicts.len() > 1 && verdicts.iter().all(|v| v == "injective"));
        // What is proven lies below all that is seen.
        let least = number(&steps["least_det"]);
        assert!(0.0 < least && least <= number(&steps["det_at_net"][0]));
        for mesh in 0..at_rest.len() {
            let [folded] = crossings(pull, "conventional", mesh)[..] else {
                panic!("refined")
            };
            assert!(folded > 0, "{figure}");
            assert_eq!(crossings(pull, "exact", mesh).last(), Some(&0), "{figure}");
            assert_eq!(steps["meshes"][mesh]["embedded"], true);
        }
    }
    // The coarse chain needs finer edges than it has.
    let chain = crossings(&numbers["figure_8"]["3"], "exact", 0);
    assert!(chain.len() > 1 && chain[0] > 0, "{chain:?}");

    let tables = fs::read_to_string(folder.0.join("tables.md")).expect("there");
    assert!(
        tables.contains("| 2113 | paper, 2001 | 62.3 ms |"),
        "{tables}"
    );
}

#[test]
fn files_are_replaced_only_when_told() {
    let folder = scratch("force");
    let first = figures(&folder, &["--quick", "--figure", "2"]);
    assert_eq!(first.status.code(), Some(0));
    let picture = folder.0.join("figure-2.png");
    let before = fs::read(&picture).expect("there");
    assert_eq!(fs::read_dir(&folder.0).expect("there").count(), 3);

    let second = figures(&folder, &["--quick", "--figure", "2"]);
    let message = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(2));
    assert!(message.contains("figure-2.png") && message.contains("--force"));
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(second.stdout.is_empty());

    let third = figures(&folder, &["--quick", "--figure", "2", "--force"]);
    assert_eq!(third.status.code(), Some(0));
    // Pictures are the same on every run.
    assert!(fs::read(&picture).expect("there") == before);

    let bad = figures(&folder, &["--figure", "9"]);
    assert_eq!(bad.status.code(), Some(2));
}
