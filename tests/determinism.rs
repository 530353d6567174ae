//! A run gives the same bytes for any number of threads, and the same twice.
//!
//! Every case runs with 1, 2, 4 and 8 threads, and once more with 8. Left out of the comparison of results: seconds, peak
//! memory and the number of threads. Everything else is compared as text, so every bit of every number counts, and every
//! file byte for byte. All bodies have more than 7,000 free dofs, where a parallel factorisation would change the order of
//! its sums.

mod stripped;

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use stripped::strip;
use tempfile::TempDir;

/// Free dofs from which sums in another order would show.
const LARGE: u64 = 7_000;

/// A cube of 7,644 free dofs, whose reference is iterated.
const CUBE: &str = "geometry.control_points=[14,14,14]";

/// A few steps of Gauss-Newton from two starts.
const SHORT: [&str; 2] = ["calibration.starts=2", "calibration.gauss_newton={ refactorisations = 2, polish = 1 }"];

/// What a run printed and wrote, without what may differ.
struct Outcome {
    result: String,
    files: Vec<(PathBuf, Vec<u8>)>,
}

/// All files below a folder with their contents.
fn files_below(folder: &Path, found: &mut Vec<(PathBuf, Vec<u8>)>) {
    for entry in fs::read_dir(folder).expect("the folder was written") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            files_below(&path, found);
        } else {
            let bytes = fs::read(&path).expect("readable");
            found.push((path, bytes));
        }
    }
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
    let mut files = Vec::new();
    files_below(folder.path(), &mut files);
    files.retain(|(path, _)| !path.ends_with("result.json"));
    files.iter_mut().for_each(|(path, _)| *path = path.strip_prefix(folder.path()).expect("below it").to_owned());
    files.sort();
    assert!(files.len() >= 3, "springs.json and the fields");
    Outcome { result: result.to_string(), files }
}

/// Runs with 1, 2, 4 and 8 threads, and once more with 8; the result.
fn is_the_same_for_any_threads(scene: &str, sets: &[&[&str]]) -> Value {
    let sets = sets.concat();
    let first = run(scene, 1, &sets);
    for threads in [2, 4, 8, 8] {
        let other = run(scene, threads, &sets);
        assert_eq!(first.result, other.result, "{scene} with {threads} threads");
        assert_eq!(first.files.len(), other.files.len());
        for ((name, bytes), (other_name, other_bytes)) in first.files.iter().zip(&other.files) {
            assert_eq!(name, other_name);
            assert!(bytes == other_bytes, "{scene}: {} differs with {threads} threads", name.display());
        }
    }
    let result: Value = serde_json::from_str(&first.result).expect("it was printed from JSON");
    assert!(result["sizes"]["free_dofs"].as_u64() > Some(LARGE));
    result
}

#[test]
fn torus() {
    let sets = ["geometry.control_points=[28,10,10]", "calibration.gamma=0.3"];
    is_the_same_for_any_threads("torus.toml", &[&sets, &SHORT]);
}

/// Two problems side by side: 1 and 3 groups, two starts each.
#[test]
fn sweep() {
    let sets = [CUBE, "calibration.gamma={ start = 0.5, step = 0.4 }"];
    let result = is_the_same_for_any_threads("cube.toml", &[&sets, &SHORT]);
    assert_eq!(result["calibration"]["sweep"].as_array().expect("rows").len(), 2);
}

/// Every way to solve with factors.
#[test]
fn paths_with_factors() {
    for path in ["direct", "single", "stale"] {
        let path_key = format!("solver.path={path}");
        let result = is_the_same_for_any_threads("cube.toml", &[&[&path_key, CUBE, "calibration.gamma=0.1"], &SHORT]);
        assert_eq!(result["calibration"]["solver"]["path"], path);
        assert_eq!(result["reference"]["path"], "iterative");
    }
}

/// Every optimiser that draws random numbers, with several load cases.
#[test]
fn annealing_hybrid_and_surrogate() {
    for optimiser in ["annealing", "hybrid", "surrogate"] {
        let optimiser_key = format!("calibration.optimiser={optimiser}");
        let sets = [optimiser_key.as_str(), CUBE, "calibration.gamma=0.1"];
        let few = ["calibration.annealing={ evaluations = 12, chains = 3 }"];
        let result = is_the_same_for_any_threads("two_loads.toml", &[&sets, &few, &SHORT]);
        assert_eq!(result["calibration"]["optimiser"], optimiser);
        let of_surrogate = result["calibration"]["counts"]["surrogate_evaluations"].as_u64();
        assert_eq!(of_surrogate > Some(0), optimiser == "surrogate");
    }
}

/// Springs at any stretch, linear springs and the continuum, by explicit and implicit steps, and all their files.
#[test]
fn motions() {
    for (model, integrator) in [("springs", "leapfrog"), ("springs_linear", "implicit_euler"), ("reference", "newmark")]
    {
        let dynamics = format!(
            "dynamics={{ model = \"{model}\", integrator = \"{integrator}\", step = 1e-5, steps = 4, frames = 2 }}"
        );
        let body = ["geometry.control_points=[62,62]", "calibration.gamma=0.5", "material.density=1143.0"];
        let result = is_the_same_for_any_threads("circle.toml", &[&body, &[&dynamics], &SHORT]);
        assert_eq!(result["dynamics"]["motions"][0]["steps"], 4);
    }
}

/// Vectors of more than one piece, so that sums are parallel.
#[test]
fn multigrid_and_the_iterated_reference() {
    let sets = ["geometry.control_points=[23,23,23]", "calibration.gamma=0.1", "solver.path=multigrid"];
    let result = is_the_same_for_any_threads("cube.toml", &[&sets]);
    assert_eq!(result["calibration"]["solver"]["path"], "multigrid");
    assert_eq!(result["reference"]["path"], "iterative");
    assert!(result["sizes"]["free_dofs"].as_u64() > Some(32_768));
}
