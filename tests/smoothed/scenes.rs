//! Bodies that are meshes, from the text of a scene: the cantilever of the reference numbers, on a good and on a bad mesh,
//! planes of symmetry, and loads on the named sides of round bodies.

use std::path::Path;

use crate::bodies::{SIZE, reference_numbers};
use springfit::clock::Progress;
use springfit::geometry::dofs::FIXED;
use springfit::reference::Reference;
use springfit::scene::{self, Scene};
use springfit::study;
use springfit::study::body::{self, Body};
use springfit::study::loads::{self, LoadCase};
use springfit::study::mesh_quality;

fn scene(name: &str, sets: &[&str]) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes");
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    scene::read(&folder.join(name), &sets).expect("a sound scene").scene
}

fn solved(name: &str, sets: &[&str]) -> (Body, Vec<LoadCase>, Reference) {
    let scene = scene(name, sets);
    let body = body::build(&scene).expect("a body");
    let loads = loads::build(&scene, &body).expect("loads");
    let reference = study::solve_reference(&body, &loads, &Progress::default()).expect("a reference");
    (body, loads, reference)
}

/// Mean of -u_z at the corners of the free end, m.
fn tip(body: &Body, displacement: &[f64]) -> f64 {
    let is_corner = |x: [f64; 3]| (0..3).all(|i| (x[i] - SIZE[i]).abs() < 1e-12 || (i > 0 && x[i] == 0.0));
    let moved = body.dofs.expand(displacement);
    let corners: Vec<usize> = (0..moved.len()).filter(|&node| is_corner(body.positions()[node])).collect();
    assert_eq!(corners.len(), 4);
    corners.iter().map(|&node| -moved[node][2]).sum::<f64>() / 4.0
}

/// Tip and energy of every method, on the regular mesh and on two distorted ones: to 1e-8 those of the reference file, which
/// another program made from the same recipe.
#[test]
fn smoothed_fem_json_section_2_the_meshes_of_the_scenes() {
    let numbers = reference_numbers();
    let cases = numbers["cantilever"].as_array().expect("cases").iter();
    let mut compared = 0;
    for case in cases.filter(|case| case["n"] == serde_json::json!([10, 2, 2])) {
        let (alpha, seed) = (case["alpha"].as_f64().expect("alpha"), case["seed"].as_u64().expect("seed"));
        let kind = case["kind"].as_str().expect("a kind");
        let names = [("fem", "t4"), ("fs", "smoothed_face"), ("es", "smoothed_edge"), ("ns", "smoothed_node")];
        let method = names.iter().find(|name| name.0 == kind).expect("a method").1;
        let (method, seed) = (format!("reference.method={method}"), format!("geometry.distortion.seed={seed}"));
        let (name, sets) = match alpha {
            0.0 => ("beam_regular.toml", vec![method.as_str()]),
            0.45 => ("beam_distorted.toml", vec![method.as_str(), seed.as_str()]),
            _ => continue,
        };
        let (body, _, reference) = solved(name, &sets);
        let weight = &reference.cases[0];
        for (ours, key) in [(tip(&body, &weight.displacement), "tip"), (weight.compliance / 2.0, "energy")] {
            let theirs = case[key].as_f64().expect(key);
            assert!((ours / theirs - 1.0).abs() < 1e-8, "{kind} {alpha} {seed} {key}: {ours} but {theirs}");
        }
        compared += 1;
    }
    assert_eq!(compared, 12, "four methods on three meshes");
}

/// The springs of the bad mesh follow their continuum no worse than twice as badly as those of the good one, on every load;
/// and the bad mesh is stiffer, as the continuum on it is.
#[test]
fn springs_on_a_bad_mesh_follow_its_continuum() {
    let run = |name: &str| study::run(&scene(name, &[]), &Progress::default()).expect("a study");
    let (good, bad) = (run("beam_regular.toml"), run("beam_distorted.toml"));
    let errors = |study: &study::Study| study.calibration.errors.iter().map(|e| e.e_rms).collect::<Vec<_>>();
    println!("regular {:?}, distorted {:?}", errors(&good), errors(&bad));
    assert_eq!(good.lattice.network.springs.len(), bad.lattice.network.springs.len());
    for (good, bad) in errors(&good).into_iter().zip(errors(&bad)) {
        assert!(bad < 2.0 * good, "{bad} % beside {good} %");
    }
    let tips = |study: &study::Study| {
        [&study.reference.cases[0].displacement, &study.calibration.displacements[0]].map(|u| tip(&study.body, u))
    };
    let (good, bad) = (tips(&good), tips(&bad));
    assert!(bad[0] < good[0] && bad[1] < good[1], "{bad:?} beside {good:?}");
}

/// Three planes of symmetry leave the block free to stretch: u = sigma / E (-nu x, -nu y, z).
#[test]
fn planes_of_symmetry_hold_one_component_each() {
    let (body, _, reference) = solved("symmetry.toml", &[]);
    let (young, poisson, stress) = (1e6, 0.3, 1e4);
    let largest = stress / young * 0.2;
    for (x, u) in body.positions().iter().zip(body.dofs.expand(&reference.cases[0].displacement)) {
        let exact = [-poisson * x[0], -poisson * x[1], x[2]].map(|x| stress / young * x);
        assert!((0..3).all(|i| (u[i] - exact[i]).abs() < 1e-12 * largest), "{x:?}: {u:?} not {exact:?}");
    }
    let held = |fixed: [bool; 3]| (0..body.positions().len()).filter(|&n| fixed == held_at(&body, n)).count();
    assert_eq!(held([true; 3]), 1, "the corner lies in all three planes");
    assert_eq!((held([true, true, false]), held([true, false, false])), (6, 3 * 6), "an edge, a face");
}

fn held_at(body: &Body, node: usize) -> [bool; 3] {
    std::array::from_fn(|i| body.dofs.free(node)[i] == FIXED)
}

/// The mantle of the cylinder is a prism of 16 flat strips; half of the lowest layer's part goes into the support.
#[test]
fn a_traction_on_the_mantle_of_a_cylinder_is_its_area() {
    let (body, loads, _) = solved("cylinder.toml", &[]);
    let (radius, height, segments, layers) = (0.05, 0.3, 16.0, 6.0);
    let area = segments * 2.0 * radius * (std::f64::consts::PI / segments).sin() * height;
    let free = area * (1.0 - 0.5 / layers);
    let total = loads[0].load.total;
    assert!((total[0] - 300.0 * free).abs() < 1e-12 * 300.0 * free, "{total:?} beside {free}");
    assert!(total[1].abs() < 1e-12 && (total[0] + total[2]).abs() < 1e-12);
    assert_eq!(body.method.name, "smoothed_face");
    assert_eq!(body.continuum.elements(), 6 * 6 * (16 + 16), "six tetrahedra for each hexahedron");
}

/// A traction on the parts of a ball's surface: those across from each other are equal, and together they are the surface
/// (the lowest part is held).
#[test]
fn the_parts_of_a_ball_make_its_surface() {
    let on = |part: &str| {
        let set = format!("load[0].traction={{ set = \"{part}\", value = [1.0, 0.0, 0.0] }}");
        solved("ball.toml", &[&set]).1[0].load.total[0]
    };
    let parts = ["x-", "x+", "y-", "y+", "z+"].map(on);
    assert!(parts[..4].iter().all(|part| (part / parts[0] - 1.0).abs() < 1e-12), "{parts:?}");
    assert!(parts[4] > parts[0], "its edges are free, theirs partly held: {parts:?}");
    let surface = on("surface");
    assert!((parts.iter().sum::<f64>() / surface - 1.0).abs() < 1e-12, "{parts:?} {surface}");
}

#[test]
fn the_quality_of_a_mesh_is_told_and_falls_with_its_distortion() {
    let of = |name: &str| {
        mesh_quality::of(&body::build(&scene(name, &[])).expect("a body")).expect("sound").expect("a mesh")
    };
    let (regular, distorted) = (of("beam_regular.toml"), of("beam_distorted.toml"));
    // all tetrahedra of a regular box are alike, and a face of the boundary has a quarter of one, others two quarters
    assert!((regular.least_measure_ratio.0 - 1.0).abs() < 1e-12, "{regular:?}");
    let expected = 0.25 * regular.domains as f64 / regular.cells as f64;
    assert!((regular.least_domain_ratio - expected).abs() < 1e-12, "{regular:?}, {expected}");
    assert!(distorted.least_measure_ratio.0 < 0.8 && distorted.least_angle < regular.least_angle, "{distorted:?}");
    assert!(distorted.least_domain_ratio < regular.least_domain_ratio, "{distorted:?}");
}
