//! `springfit export`: what other programs read from a finished run is the run's own, and a folder that holds none says so.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use nalgebra_sparse::io::load_coo_from_matrix_market_str;
use nalgebra_sparse::na::{DMatrix, DVector};
use serde_json::Value;
use tempfile::TempDir;

use crate::vtu;

/// A finished run of a scene of data/scenes.
fn finished(scene: &str, sets: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes").join(scene);
    let mut command = Command::cargo_bin("springfit").expect("the binary is built");
    command.arg("run").arg(scene).arg("--quiet").arg("--out").arg(folder.path());
    for set in sets {
        command.args(["--set", set]);
    }
    command.assert().success();
    folder
}

/// Status, stdout and stderr of an export.
fn export(folder: &Path, format: &str) -> (i32, String, String) {
    let mut command = Command::cargo_bin("springfit").expect("the binary is built");
    let output = command.arg("export").arg(folder).args(["--to", format]).output().expect("it runs");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code().expect("a status"), text(output.stdout), text(output.stderr))
}

/// Exports, and reads the files that it prints.
fn exported(folder: &Path, format: &str) -> Vec<(String, String)> {
    let (status, files, message) = export(folder, format);
    assert_eq!((status, message.as_str()), (0, ""));
    let read = |path: &str| {
        let name = Path::new(path).file_name().expect("a name").to_string_lossy().into_owned();
        (name, fs::read_to_string(path).expect("written"))
    };
    files.lines().map(read).collect()
}

fn file<'a>(files: &'a [(String, String)], name: &str) -> &'a str {
    &files.iter().find(|file| file.0 == name).unwrap_or_else(|| panic!("no {name}")).1
}

fn springs(folder: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("springs.json")).expect("written")).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("a number")).collect()
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().expect("rows").iter().map(numbers).collect()
}

fn matrix(text: &str) -> DMatrix<f64> {
    DMatrix::from(&load_coo_from_matrix_market_str::<f64>(text).expect("Matrix Market"))
}

/// K u = f from the files alone gives the displacement of springs.vtu, of every load case; masses and damping are those of
/// springs.json.
#[test]
fn matrix_market_files_solve_to_the_displacements_of_the_run() {
    let folder = finished("two_loads.toml", &["material.density=1000", "dynamics.alpha=200"]);
    let files = exported(folder.path(), "matrix-market");
    let stiffness = matrix(file(&files, "stiffness.mtx"));
    let n = stiffness.nrows();
    let mut forces = file(&files, "forces.mtx").lines().skip(1);
    let cases = springs(folder.path())["loads"].as_array().expect("loads").len();
    assert_eq!(forces.next().expect("sizes"), format!("{n} {cases}"));
    let forces: Vec<f64> = forces.map(|line| line.parse().expect("a number")).collect();
    let fields = fs::read_to_string(folder.path().join("springs.vtu")).expect("written");
    let unknowns: Vec<(usize, usize)> = (file(&files, "unknowns.csv").lines().skip(1))
        .map(|line| {
            let words: Vec<&str> = line.split(',').collect();
            (words[2].parse().expect("a control point"), "xyz".find(words[3]).expect("an axis"))
        })
        .collect();
    let factor = stiffness.clone().cholesky().expect("positive definite");
    for (case, force) in forces.chunks(n).enumerate() {
        let u = factor.solve(&DVector::from_column_slice(force));
        let name = springs(folder.path())["loads"][case]["name"].as_str().expect("a name").to_owned();
        let theirs = vtu::floats(&fields, &format!("displacement_springs_{name}"));
        let apart = unknowns.iter().zip(&u).map(|(&(point, axis), u)| (theirs[3 * point + axis] - u).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-9 * u.amax(), "{name}");
    }
    let own = springs(folder.path());
    let masses = matrix(file(&files, "mass.mtx"));
    let total: f64 = (numbers(&own["masses"]).iter().zip(own["fixed"].as_array().expect("a list")))
        .map(|(mass, held)| {
            mass * held.as_array().expect("a list").iter().filter(|held| **held == false).count() as f64
        })
        .sum();
    assert!((masses.trace() / total - 1.0).abs() < 1e-12);
    let damping = matrix(file(&files, "damping.mtx"));
    let (places, edges, c) = (rows(&own["positions"]), rows(&own["edges"]), numbers(&own["c"]));
    // every spring adds c n_i^2 at each end that is free along i
    let share = |(edge, c): (&Vec<f64>, &f64)| {
        let [a, b] = [edge[0] as usize, edge[1] as usize];
        let step: Vec<f64> = places[b].iter().zip(&places[a]).map(|(b, a)| b - a).collect();
        let square = step.iter().map(|x| x * x).sum::<f64>();
        let free = |node: usize, axis: usize| own["fixed"][node][axis] == false;
        let at = |node: usize| (0..3).filter(|&i| free(node, i)).map(|i| step[i] * step[i]).sum::<f64>();
        c * (at(a) + at(b)) / square
    };
    let trace: f64 = edges.iter().zip(&c).map(share).sum();
    assert!((damping.trace() / trace - 1.0).abs() < 1e-12 && (&damping - damping.transpose()).amax() == 0.0);
}

#[test]
fn tables_and_lines_hold_the_springs() {
    let folder = finished("dynamics.toml", &[]);
    let own = springs(folder.path());
    let tables = exported(folder.path(), "csv");
    let column = |name: &str, column: &str| -> Vec<f64> {
        let mut lines = file(&tables, name).lines();
        let place = lines.next().expect("a head").split(',').position(|word| word == column).expect(column);
        lines.map(|line| line.split(',').nth(place).expect("a value").parse().expect("a number")).collect()
    };
    assert_eq!(column("springs.csv", "k"), numbers(&own["k"]));
    assert_eq!(column("springs.csv", "c"), numbers(&own["c"]));
    assert_eq!(column("springs.csv", "length"), numbers(&own["rest_lengths"]));
    assert_eq!(column("nodes.csv", "mass"), numbers(&own["masses"]));
    let sum: f64 = column("nodes.csv", "force_load 1_x").iter().sum();
    assert!((sum / (200.0 * 72.0) - 1.0).abs() < 1e-14, "a force on each of the 72 free nodes: {sum}");
    assert_eq!(column("groups.csv", "springs").iter().sum::<f64>() as usize, numbers(&own["k"]).len());
    let lines = exported(folder.path(), "vtu");
    let network = file(&lines, "network.vtu");
    assert_eq!(vtu::floats(network, "k"), numbers(&own["k"]));
    assert_eq!(vtu::floats(network, "mass"), numbers(&own["masses"]));
    assert_eq!(vtu::floats(network, "held").iter().sum::<f64>(), 2.0 * 9.0, "the components of the lower edge");
}

/// The scene of SOFA is XML; its attributes hold the numbers of springs.json in the order that SOFA reads them.
#[test]
fn the_sofa_scene_holds_the_springs() {
    for (scene, moves) in [("dynamics.toml", true), ("symmetry.toml", false)] {
        let folder = finished(scene, &[]);
        let own = springs(folder.path());
        let text = exported(folder.path(), "sofa").remove(0).1;
        let value = |tag: &str, name: &str| -> Vec<f64> {
            let start = text.find(&format!("<{tag}")).unwrap_or_else(|| panic!("no {tag}"));
            let element = &text[start..start + text[start..].find("/>").expect("it ends")];
            let at = element.find(&format!(" {name}=\"")).unwrap_or_else(|| panic!("no {name}")) + name.len() + 3;
            let list = &element[at..at + element[at..].find('"').expect("it ends")];
            list.split_whitespace().map(|word| word.parse().expect("a number")).collect()
        };
        let bars = value("SpringForceField", "spring");
        let column = |i: usize| bars.iter().skip(i).step_by(5).copied().collect::<Vec<f64>>();
        assert_eq!(column(2), numbers(&own["k"]));
        assert_eq!(column(4), numbers(&own["rest_lengths"]));
        let ends: Vec<f64> = rows(&own["edges"]).concat();
        assert_eq!(bars.chunks(5).flat_map(|bar| [bar[0], bar[1]]).collect::<Vec<_>>(), ends);
        let places = value("MechanicalObject", "position");
        let d = own["dimension"].as_u64().expect("2 or 3") as usize;
        let flat: Vec<f64> = rows(&own["positions"]).concat();
        assert_eq!(places.chunks(3).flat_map(|x| x[..d].to_vec()).collect::<Vec<_>>(), flat);
        assert_eq!(text.contains("<DiagonalMass"), moves);
        assert_eq!(text.contains("<StaticSolver"), !moves);
        let supports: Vec<&str> = text.split("<PartialFixedProjectiveConstraint").skip(1).collect();
        assert_eq!(supports.len(), if moves { 2 } else { 7 }, "combinations of held components");
        let loaded = value("ConstantForceField", "forces");
        let forces: Vec<f64> = rows(&own["loads"][0]["forces"]).concat();
        let sum = |list: &[f64]| list.iter().sum::<f64>();
        assert!((sum(&loaded) - sum(&forces)).abs() <= 1e-12 * sum(&forces).abs().max(1.0), "{scene}");
    }
}

#[test]
fn a_folder_without_a_sound_result_is_named() {
    let folder = finished("square.toml", &["calibration.gamma=0.5"]);
    let refused = |message: &str| {
        let (status, text, error) = export(folder.path(), "csv");
        assert_eq!((status, text.as_str()), (2, ""), "{error}");
        assert!(error.contains(message), "no {message:?} in {error}");
        assert!(!folder.path().join("nodes.csv").exists());
    };
    let (status, _, message) = export(folder.path(), "obj");
    assert_eq!(status, 2);
    assert!(message.contains("--to: there is no format \"obj\"") && message.contains("vtu, csv, sofa, matrix-market"));
    let (status, _, message) = export(&folder.path().join("nothing"), "csv");
    assert_eq!(status, 2);
    assert!(
        message.contains("nothing: there is no such folder") && message.contains("run SCENE --out DIR"),
        "{message}"
    );

    let path = folder.path().join("springs.json");
    let sound = springs(folder.path());
    let changed = |key: &str, value: Value| {
        let mut springs = sound.clone();
        springs[key] = value;
        fs::write(&path, springs.to_string()).expect("written");
    };
    changed("schema", "springfit-springs/9".into());
    refused("its schema is \"springfit-springs/9\", not \"springfit-springs/1\"");
    changed("k", vec![1.0].into());
    refused(&format!("k: 1 entries instead of {}", sound["edges"].as_array().expect("a list").len()));
    changed("dimension", 3.into());
    refused("positions: node 0 has not 3 components");
    let mut edges = sound["edges"].clone();
    edges[3][1] = 4_000_000.into();
    changed("edges", edges);
    refused("edges: spring 3 has no node 4000000");
    let mut lengths = sound["rest_lengths"].clone();
    lengths[2] = 17.0.into();
    changed("rest_lengths", lengths);
    refused("rest_lengths: spring 2 is 17 m long, its nodes are");
    let mut groups = sound["group"].clone();
    groups[0] = 99.into();
    changed("group", groups);
    refused("group: spring 0 is in group 99, which is not there");
    fs::write(&path, &sound.to_string()[..1000]).expect("written");
    refused("springs.json: EOF while parsing");
    fs::remove_file(&path).expect("removed");
    refused("holds no springs.json: no run has finished here");
    fs::remove_file(folder.path().join("result.json")).expect("removed");
    refused("holds no result.json: no run has finished here");
}
