//! What is exported is what was calibrated: the e_rms of result.json from springs.json alone.
//!
//! A simulator that reads springs.json assembles K = sum_s k_s b_s b_s^T, b_s = (-d_s, d_s), over the components that
//! are not fixed, and loads every free node with the force of the scene. Here that is done densely, with another library than
//! springfit's; the displacements are compared with the reference in springs.vtu.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use nalgebra_sparse::na::{DMatrix, DVector};
use serde::Deserialize;
use serde_json::Value;

mod formats;
#[path = "../vtu/mod.rs"]
mod vtu;

#[derive(Deserialize)]
struct Springs {
    dimension: usize,
    nodes: Vec<usize>,
    positions: Vec<Vec<f64>>,
    fixed: Vec<Vec<bool>>,
    edges: Vec<[usize; 2]>,
    rest_lengths: Vec<f64>,
    k: Vec<f64>,
}

impl Springs {
    /// Displacement of every node (node by node, `dimension` numbers each) under a force on every free node.
    fn displacement(&self, force: &[f64]) -> Vec<f64> {
        let d = self.dimension;
        let n = self.nodes.len() * d;
        let mut stiffness = DMatrix::<f64>::zeros(n, n);
        for ((&[a, b], k), rest_length) in self.edges.iter().zip(&self.k).zip(&self.rest_lengths) {
            let along: Vec<f64> = (0..d).map(|c| self.positions[b][c] - self.positions[a][c]).collect();
            let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((length / rest_length - 1.0).abs() < 1e-13, "rest length {rest_length}, distance {length}");
            for (node, sign_node) in [(a, -1.0), (b, 1.0)] {
                for (other, sign_other) in [(a, -1.0), (b, 1.0)] {
                    for i in 0..d {
                        for j in 0..d {
                            stiffness[(node * d + i, other * d + j)] +=
                                sign_node * sign_other * k * along[i] * along[j] / (length * length);
                        }
                    }
                }
            }
        }
        let free: Vec<usize> = (0..n).filter(|i| !self.fixed[i / d][i % d]).collect();
        let loads = DVector::from_iterator(free.len(), free.iter().map(|i| force[i % d]));
        let stiffness = stiffness.select_rows(&free).select_columns(&free);
        let solved = stiffness.cholesky().expect("positive definite").solve(&loads);
        let mut displacement = vec![0.0; n];
        free.iter().zip(&solved).for_each(|(i, u)| displacement[*i] = *u);
        displacement
    }

    /// The nodes of a field on all control points, `dimension` numbers each.
    fn own(&self, field: &[f64]) -> Vec<f64> {
        self.nodes.iter().flat_map(|node| field[3 * node..3 * node + self.dimension].iter().copied()).collect()
    }

    /// e_rms and e_max of (5.7), (4.21), percent.
    fn errors(&self, reference: &[f64], displacement: &[f64]) -> [f64; 2] {
        let d = self.dimension;
        let square = |u: &[f64]| u.iter().map(|u| u * u).sum::<f64>();
        let wrong: Vec<f64> = reference
            .chunks(d)
            .zip(displacement.chunks(d))
            .map(|(u, v)| square(&u.iter().zip(v).map(|(u, v)| u - v).collect::<Vec<_>>()))
            .collect();
        let largest = reference.chunks(d).map(square).fold(0.0, f64::max).sqrt();
        let mean = wrong.iter().sum::<f64>() / wrong.len() as f64;
        [100.0 * mean.sqrt() / largest, 100.0 * wrong.iter().fold(0.0_f64, |a, b| a.max(*b)).sqrt() / largest]
    }
}

/// Runs a scene with one `force_per_node` and recomputes what it says.
fn compare(scene: &str, sets: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = Command::cargo_bin("springfit").expect("the binary is built");
    command.arg("run").arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes").join(scene));
    for set in sets {
        command.args(["--set", set]);
    }
    command.arg("--quiet").arg("--out").arg(folder.path()).assert().success();
    let file = |name: &str| fs::read_to_string(folder.path().join(name)).expect("written");
    let result: Value = serde_json::from_str(&file("result.json")).expect("JSON");
    let springs: Springs = serde_json::from_str(&file("springs.json")).expect("JSON");
    let fields = file("springs.vtu");
    let force = &result["scene"]["load"][0]["force_per_node"];
    let force: Vec<f64> = serde_json::from_value(force.clone()).expect("one force on every node");

    let displacement = springs.displacement(&force);
    let reference = springs.own(&vtu::floats(&fields, "displacement_reference"));
    let [e_rms, e_max] = springs.errors(&reference, &displacement);
    for (name, ours) in [("e_rms", e_rms), ("e_max", e_max)] {
        let theirs = result["calibration"][name].as_f64().expect("a number");
        println!("{scene} {sets:?} {name}: {theirs} in the result, {ours} from springs.json");
        assert!((ours / theirs - 1.0).abs() <= 1e-9, "{scene} {name}: {ours}, {theirs} in the result");
    }
    let exported = springs.own(&vtu::floats(&fields, "displacement_springs"));
    let largest = exported.iter().fold(0.0_f64, |a, u| a.max(u.abs()));
    let apart = exported.iter().zip(&displacement).fold(0.0_f64, |a, (u, v)| a.max((u - v).abs()));
    assert!(apart <= 1e-9 * largest, "{scene}: displacements are {apart} m apart of {largest} m");
}

#[test]
fn square_with_both_weightings_and_two_profiles() {
    compare("square.toml", &[]);
    compare("square.toml", &["springs.weighting=springs"]);
    compare("square.toml", &["springs.profile=axial_rigidity"]);
    compare("square.toml", &["springs.profile=axial_rigidity", "springs.weighting=springs", "calibration.gamma=0.5"]);
}

#[test]
fn bodies_with_many_groups_and_a_merged_seam() {
    for scene in ["circle.toml", "cube.toml", "torus.toml", "torus_merged.toml", "spheroid.toml"] {
        compare(scene, &[]);
    }
    compare("spheroid.toml", &["geometry.merge_seam=true", "calibration.gamma=0.3"]);
    compare("cube.toml", &["support.nodes=[5, 215]", "springs.grouping=kind"]);
}
