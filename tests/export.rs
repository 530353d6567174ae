//! The files of the export room, read back.

use std::path::Path;

use serde_json::Value;
use springfit::export::{self, Body, Calibrated, Case};
use springfit::geometry::dofs::{DofMap, tie_coincident};
use springfit::geometry::knots::KnotVector;
use springfit::geometry::patch::Patch;
use springfit::geometry::refine::insert_knots;
use springfit::springs::grouping::{self, Grouping, Request};
use springfit::springs::network::Network;
use springfit::springs::topology;
use vtu::{bytes, floats};

mod vtu;

/// The disc of method section 8: radius 1, 6 x 6 control points, degree (2, 2).
fn disc() -> Patch {
    let s = 0.5_f64.sqrt();
    let points = [
        [-s, -s],
        [-2.0 * s, 0.0],
        [-s, s],
        [0.0, -2.0 * s],
        [0.0, 0.0],
        [0.0, 2.0 * s],
        [s, -s],
        [2.0 * s, 0.0],
        [s, s],
    ];
    let knots = || KnotVector::open_uniform(2, 3).expect("good knots");
    let weights = vec![1.0, s, 1.0, s, 1.0, s, 1.0, s, 1.0];
    let patch = Patch::new(vec![knots(), knots()], points.map(|[x, y]| [x, y, 0.0]).to_vec(), weights).expect("a disc");
    let finer = insert_knots(&patch, 0, &[0.25, 0.5, 0.75]).expect("knots inside");
    insert_knots(&finer, 1, &[0.25, 0.5, 0.75]).expect("knots inside")
}

/// A tube between the radii 1 and 2 around z: the 9-point circle, quadratic along z, linear through the wall.
fn tube() -> Patch {
    let s = 0.5_f64.sqrt();
    let around = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (i, (x, y)) in around.into_iter().enumerate() {
        for j in 0..4 {
            for radius in [1.0, 1.5, 2.0] {
                points.push([radius * f64::from(x), radius * f64::from(y), f64::from(j)]);
                weights.push(if i % 2 == 0 { 1.0 } else { s });
            }
        }
    }
    let circle =
        KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0]).expect("good knots");
    let axis = KnotVector::open_uniform(2, 4).expect("good knots");
    let wall = KnotVector::open_uniform(1, 3).expect("good knots");
    Patch::new(vec![circle, axis, wall], points, weights).expect("a tube")
}

/// A patch with springs, some numbers on them, and an affine displacement.
struct Model {
    patch: Patch,
    dofs: DofMap,
    network: Network,
    grouping: Grouping,
    stiffness: Vec<f64>,
    reference: Vec<[f64; 3]>,
    springs: Vec<[f64; 3]>,
}

fn affine_field(x: [f64; 3]) -> [f64; 3] {
    [0.1 * x[0] - 0.2 * x[1] + 0.5, 0.3 * x[1], 0.0]
}

fn model(patch: Patch, merge: bool) -> Model {
    let points = patch.points();
    let master = if merge { tie_coincident(points, 1e-12) } else { (0..points.len() as u32).collect() };
    let fixed: Vec<[bool; 3]> = (0..points.len()).map(|node| [node == 1, node < 2, node < 2]).collect();
    let dofs = DofMap::new(patch.dimension(), master, &fixed);
    let network = (topology::find("grid").expect("in the table").connect)(&patch.grid(), points, &dofs);
    let grouping =
        (grouping::find("kind").expect("in the table").group)(&network, &Request::default()).expect("no gamma needed");
    let stiffness = (0..network.springs.len()).map(|s| 10.0 + s as f64).collect();
    let reference: Vec<[f64; 3]> = points.iter().map(|&x| affine_field(x)).collect();
    let springs = reference.iter().map(|u| u.map(|u| 1.25 * u)).collect();
    Model { dofs, network, grouping, stiffness, reference, springs, patch }
}

impl Model {
    fn export(&self, exporter: &str, folder: &Path, names: &[&'static str], dynamics: Option<(&[f64], &[f64])>) {
        let (reference, springs) = (&self.reference, &self.springs);
        let case = |name: &&'static str| Case { name, fit: true, forces: reference, reference, springs };
        let cases: Vec<Case> = names.iter().map(case).collect();
        let results = Calibrated {
            name: "test",
            body: Body::Patch(&self.patch),
            network: &self.network,
            dofs: &self.dofs,
            grouping: &self.grouping,
            stiffness: &self.stiffness,
            masses: dynamics.map(|(masses, _)| masses),
            damping: dynamics.map(|(_, damping)| damping),
            cases: &cases,
            motions: &[],
        };
        let files = (export::find(exporter).expect("in the table").write)(&results, folder).expect("writable");
        assert!(files.iter().all(|file| file.is_file()));
    }
}

fn integers(file: &str, name: &str) -> Vec<usize> {
    let number = |eight: &[u8]| i64::from_le_bytes(eight.try_into().expect("8 bytes"));
    bytes(file, name).chunks_exact(8).map(|eight| number(eight) as usize).collect()
}

/// Evaluates a vector field of all cells in their middle, `share` being the Bernstein values of the points of a cell.
fn middles(file: &str, field: &str, share: &[f64]) -> Vec<[f64; 3]> {
    let (values, weights) = (floats(file, field), floats(file, "RationalWeights"));
    let cells = integers(file, "connectivity");
    let middle = |cell: &[usize]| {
        let mut sum = [0.0; 4];
        for (&point, share) in cell.iter().zip(share) {
            for a in 0..3 {
                sum[a] += share * weights[point] * values[3 * point + a];
            }
            sum[3] += share * weights[point];
        }
        [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]]
    };
    cells.chunks_exact(share.len()).map(middle).collect()
}

fn assert_same(found: [f64; 3], expected: [f64; 3]) {
    assert!((0..3).all(|a| (found[a] - expected[a]).abs() < 1e-14), "{found:?} instead of {expected:?}");
}

#[test]
fn body_vtu_has_the_shape_and_the_displacement_of_the_patch_in_every_cell() {
    let plane = [vec![1.0 / 16.0; 4], vec![1.0 / 8.0; 4], vec![1.0 / 4.0]].concat();
    let solid = [vec![1.0 / 32.0; 8], vec![1.0 / 16.0; 8], vec![1.0 / 8.0; 2]].concat();
    for (patch, share, degrees, kind) in [(disc(), plane, [2.0, 2.0, 0.0], 77), (tube(), solid, [2.0, 2.0, 1.0], 79)] {
        let folder = tempfile::tempdir().expect("a folder");
        let model = model(patch, false);
        model.export("vtu", folder.path(), &["only"], None);
        let file = std::fs::read_to_string(folder.path().join("body.vtu")).expect("readable");
        let spans = model.patch.elements();
        assert_eq!(floats(&file, "HigherOrderDegrees"), degrees.repeat(spans.len()));
        assert_eq!(bytes(&file, "types"), vec![kind; spans.len()]);
        let points = middles(&file, "Points", &share);
        let moves = middles(&file, "displacement_reference", &share);
        assert_eq!(points.len(), spans.len());
        for ((span, point), displacement) in spans.into_iter().zip(points).zip(moves) {
            let (start, end) = model.patch.element_bounds(span);
            let expected = model.patch.evaluate([0, 1, 2].map(|a| (start[a] + end[a]) / 2.0));
            assert_same(point, expected);
            assert_same(displacement, affine_field(expected));
        }
    }
}

/// meshio 5.3 reads versions 0.1 and 1.0 of the format and no other; the long headers of the arrays need 1.0.
#[test]
fn every_vtu_has_the_version_that_meshio_and_paraview_read() {
    let folder = tempfile::tempdir().expect("a folder");
    model(tube(), false).export("vtu", folder.path(), &["only"], None);
    for name in ["body.vtu", "springs.vtu"] {
        let file = std::fs::read_to_string(folder.path().join(name)).expect("readable");
        let head =
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">";
        assert_eq!(file.lines().nth(1), Some(head), "{name}");
        let arrays = file.matches("<DataArray ").count();
        assert!(arrays > 4 && arrays == file.matches("format=\"binary\"").count(), "{name}");
    }
}

#[test]
fn springs_vtu_has_a_line_a_spring_and_an_array_a_case() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = model(disc(), false);
    model.export("vtu", folder.path(), &["pull", "a<b"], None);
    let file = std::fs::read_to_string(folder.path().join("springs.vtu")).expect("readable");
    let ends: Vec<usize> = model.network.springs.iter().flat_map(|s| s.nodes.map(|node| node as usize)).collect();
    assert_eq!(integers(&file, "connectivity"), ends);
    assert_eq!(floats(&file, "stiffness"), model.stiffness);
    assert_eq!(floats(&file, "displacement_springs_pull"), model.springs.as_flattened());
    let error = floats(&file, "error_a&lt;b");
    assert!(error.iter().zip(model.reference.as_flattened()).all(|(e, u)| (e - 0.25 * u).abs() < 1e-15));
    let groups: Vec<usize> = model.grouping.group_of.iter().map(|&group| group as usize).collect();
    assert_eq!(integers(&file, "group"), groups);
    assert_eq!(floats(&file, "length").len(), 110);
}

#[test]
fn springs_json_describes_the_network_and_leaves_out_tied_nodes() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = model(tube(), true);
    let (masses, damping) = (vec![2.0; 108], vec![0.5; model.network.springs.len()]);
    model.export("springs", folder.path(), &["only"], Some((&masses, &damping)));
    let text = std::fs::read_to_string(folder.path().join("springs.json")).expect("readable");
    let json: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(json["schema"], "springfit-springs/1");
    assert_eq!(json["dimension"], 3);
    let length = |key: &str| json[key].as_array().expect("a list").len();
    assert!(["nodes", "positions", "fixed", "masses"].iter().all(|key| length(key) == 96), "12 nodes are tied");
    let springs = model.network.springs.len();
    assert!(["edges", "rest_lengths", "group", "k", "c"].iter().all(|key| length(key) == springs));
    assert_eq!(json["fixed"][0], serde_json::json!([false, true, true]));
    assert_eq!(json["groups"], serde_json::json!(["edge", "face_diagonal", "body_diagonal"]));
    let position = |node: &Value, a: usize| {
        json["positions"][node.as_u64().expect("a number") as usize][a].as_f64().expect("a number")
    };
    for (edge, rest) in
        json["edges"].as_array().expect("a list").iter().zip(json["rest_lengths"].as_array().expect("a list"))
    {
        let square: f64 = (0..3).map(|a| (position(&edge[0], a) - position(&edge[1], a)).powi(2)).sum();
        assert!((square.sqrt() - rest.as_f64().expect("a number")).abs() < 1e-15);
    }
}

#[test]
fn springs_json_of_a_scene_without_dynamics_has_neither_masses_nor_damping() {
    let folder = tempfile::tempdir().expect("a folder");
    model(disc(), false).export("springs", folder.path(), &["only"], None);
    let text = std::fs::read_to_string(folder.path().join("springs.json")).expect("readable");
    let json: Value = serde_json::from_str(&text).expect("JSON");
    assert!(json.get("masses").is_none() && json.get("c").is_none());
    assert_eq!(json["positions"][0].as_array().expect("a list").len(), 2);
}
