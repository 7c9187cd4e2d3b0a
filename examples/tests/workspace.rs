//! The shape of the workspace.

use std::process::Command;

/// The libraries stand alone: none depends on another, in any role.
#[test]
fn no_library_depends_on_another() {
    const LIBRARIES: [&str; 4] = ["ffd-core", "fem-tet", "spheretree", "glove-io"];
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .output()
        .expect("cargo runs");
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("a list");
    let mut seen = 0;
    for package in packages {
        let name = package["name"].as_str().expect("a name");
        if !LIBRARIES.contains(&name) {
            continue;
        }
        seen += 1;
        for dependency in package["dependencies"].as_array().expect("a list") {
            let on = dependency["name"].as_str().expect("a name");
            // On itself, to test with its own features.
            let is_other = on != name && LIBRARIES.contains(&on);
            assert!(!is_other, "{name} depends on {on}");
        }
    }
    assert_eq!(
        seen,
        LIBRARIES.len(),
        "all four libraries are in the workspace"
    );
}
