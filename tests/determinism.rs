//! A run gives the same bytes for any number of threads, and the same twice.
//!
//! Left out of the comparison of results: seconds, peak memory and the number of threads. Everything else is compared
//! as text, so every bit of every number counts. The cube of 17^3 control points has 13,872 free dofs, beyond the size
//! where a parallel factorisation would change the order of its sums.

mod stripped;

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use stripped::strip;
use tempfile::TempDir;

/// What a run printed and wrote, without what may differ.
struct Outcome {
    result: String,
    files: Vec<(PathBuf, Vec<u8>)>,
}

/// Runs a scene of data/scenes.
fn run(scene: &str, threads: usize, sets: &[&str]) -> Outcome {
    let folder = TempDir::new().expect("a temporary folder");
    let mut command = Command::cargo_bin("springfit").expect("the binary is built");
    command.arg("run").arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes").join(scene));
    command.args(["--json", "--quiet", "--threads", &threads.to_string(), "--out"]).arg(folder.path());
    for set in sets {
        command.args(["--set", set]);
    }
    let output = command.assert().success().get_output().stdout.clone();
    let mut result: Value = serde_json::from_slice(&output).expect("stdout is JSON");
    assert_eq!(result["threads"], threads);
    strip(&mut result);
    let mut files: Vec<_> = fs::read_dir(folder.path())
        .expect("the folder was written")
        .map(|entry| PathBuf::from(entry.expect("readable").file_name()))
        .filter(|name| name != Path::new("result.json"))
        .map(|name| (name.clone(), fs::read(folder.path().join(name)).expect("readable")))
        .collect();
    files.sort();
    assert!(files.len() >= 3, "springs.json and the fields");
    Outcome { result: result.to_string(), files }
}

/// Runs with 1, 2 and 4 threads, and once more with 2; the result.
fn is_the_same_for_any_threads(scene: &str, sets: &[&str]) -> Value {
    let first = run(scene, 1, sets);
    for threads in [2, 4, 2] {
        let other = run(scene, threads, sets);
        assert_eq!(first.result, other.result, "{scene} with {threads} threads");
        assert_eq!(first.files.len(), other.files.len());
        for ((name, bytes), (other_name, other_bytes)) in first.files.iter().zip(&other.files) {
            assert_eq!(name, other_name);
            assert!(bytes == other_bytes, "{scene}: {} differs with {threads} threads", name.display());
        }
    }
    serde_json::from_str(&first.result).expect("it was printed from JSON")
}

#[test]
fn torus() {
    is_the_same_for_any_threads("torus.toml", &[]);
}

#[test]
fn cube_of_17_control_points() {
    let sets = [
        "geometry.control_points=[17,17,17]",
        // two problems side by side: 1 and 3 groups
        "calibration.gamma={ start = 0.5, step = 0.4 }",
        "calibration.starts=2",
        "calibration.gauss_newton={ refactorisations = 3, polish = 1 }",
    ];
    is_the_same_for_any_threads("cube.toml", &sets);
}

#[test]
fn annealing_and_hybrid() {
    for optimiser in ["annealing", "hybrid"] {
        let optimiser = format!("calibration.optimiser={optimiser}");
        let sets = [optimiser.as_str(), "calibration.gamma=0.1", "calibration.annealing.evaluations=400"];
        is_the_same_for_any_threads("circle.toml", &sets);
        is_the_same_for_any_threads("two_loads.toml", &[sets[0], sets[2]]);
    }
}

/// Every way to solve with factors, on a cube whose reference is iterated.
#[test]
fn paths_with_factors() {
    for path in ["direct", "single", "stale"] {
        let path_key = format!("solver.path={path}");
        let sets = [
            path_key.as_str(),
            "geometry.control_points=[12,12,12]",
            "calibration.gamma=0.1",
            "calibration.starts=2",
            "calibration.gauss_newton={ refactorisations = 3, polish = 1 }",
        ];
        let result = is_the_same_for_any_threads("cube.toml", &sets);
        assert_eq!(result["calibration"]["solver"]["path"], path);
        assert_eq!(result["reference"]["path"], "iterative");
    }
}

/// Vectors of more than one piece, so that sums are parallel.
#[test]
fn multigrid_and_the_iterated_reference() {
    let sets = ["geometry.control_points=[23,23,23]", "calibration.gamma=0.1", "solver.path=multigrid"];
    let result = is_the_same_for_any_threads("cube.toml", &sets);
    assert_eq!(result["calibration"]["solver"]["path"], "multigrid");
    assert_eq!(result["reference"]["path"], "iterative");
    assert!(result["sizes"]["free_dofs"].as_u64() > Some(32_768));
}
