//! Small displacements: tips, energies and frequencies of the reference file.

use crate::bodies::*;
use springfit::reference::methods::smoothed::{self, Smoothing};

fn close(name: &str, ours: f64, theirs: f64, tolerance: f64) {
    assert!((ours / theirs - 1.0).abs() < tolerance, "{name}: {ours} but {theirs}, off by {:e}", ours / theirs - 1.0);
}

#[test]
fn smoothed_fem_json_cantilever_tips_energies_and_frequencies() {
    let numbers = reference_numbers();
    let cases = numbers["cantilever"].as_array().expect("cases");
    assert!(cases.len() > 15);
    for case in cases {
        let cells: [usize; 3] = std::array::from_fn(|i| case["n"][i].as_u64().expect("cells") as usize);
        let (alpha, seed) = (case["alpha"].as_f64().expect("alpha"), case["seed"].as_u64().expect("seed"));
        let kind = case["kind"].as_str().expect("kind");
        let smoothing = METHODS.iter().find(|m| m.0 == kind).expect("a method of the file").1;
        let mesh = beam(cells, alpha, seed);
        let domains = smoothed_domains(&mesh, smoothing);
        assert_eq!(domains.len() as u64, case["domains"].as_u64().expect("domains"));
        let answer = solve_smoothed(&mesh, domains, 0.3);
        let name = format!("{kind} {cells:?} {alpha} {seed}");
        close(&name, answer.tip, case["tip"].as_f64().expect("tip"), 1e-8);
        close(&name, answer.energy, case["energy"].as_f64().expect("energy"), 1e-8);
        for i in 0..4 {
            close(&name, answer.frequencies[i], case["freq"][i].as_f64().expect("frequency"), 1e-8);
        }
    }
}

#[test]
fn smoothed_fem_json_quadratic_tetrahedra() {
    let numbers = reference_numbers();
    for cells in [[10, 2, 2], [16, 4, 4]] {
        let case = &numbers["t10_ref"][format!("({}, {}, {})", cells[0], cells[1], cells[2])];
        let answer = solve_quadratic(&beam(cells, 0.0, 1), 0.3);
        close("T10 tip", answer.tip, case["tip"].as_f64().expect("tip"), 1e-8);
        close("T10 energy", answer.energy, case["energy"].as_f64().expect("energy"), 1e-8);
        for i in 0..4 {
            close("T10", answer.frequencies[i], case["freq"][i].as_f64().expect("frequency"), 1e-8);
        }
    }
}

#[test]
fn smoothed_fem_json_poisson_sweep_and_locking() {
    let numbers = reference_numbers();
    for case in numbers["nu_sweep_tip"].as_array().expect("cases") {
        let poisson = case["nu"].as_f64().expect("nu");
        let mesh = beam([10, 2, 2], 0.0, 1);
        for (kind, smoothing) in METHODS {
            let answer = solve_smoothed(&mesh, smoothed_domains(&mesh, smoothing), poisson);
            close(kind, answer.tip, case[kind].as_f64().expect("tip"), 1e-8);
        }
        let selective = smoothed::selective(&mesh, Smoothing::Face, Smoothing::Node, 1.0).expect("tetrahedra");
        let selective = solve_smoothed(&mesh, selective, poisson).tip;
        close("selective", selective, case["fs_mu_ns_lambda"].as_f64().expect("tip"), 1e-8);
        let quadratic = solve_quadratic(&beam([12, 3, 3], 0.0, 1), poisson).tip;
        close("T10", quadratic, case["t10_12x3x3"].as_f64().expect("tip"), 1e-8);
        if poisson == 0.499 {
            let face = solve_smoothed(&mesh, smoothed_domains(&mesh, Smoothing::Face), poisson).tip;
            assert!(face < 0.1 * quadratic, "plain face smoothing locks: {face} against {quadratic}");
            assert!(selective > 0.5 * quadratic, "selective smoothing does not: {selective} against {quadratic}");
        }
    }
}

/// On random meshes face smoothing loses about as much as plain elements do, against its own regular mesh; but the worst
/// of them is nearer to the truth than plain elements are on the regular one.
#[test]
fn acceptance_face_smoothing_on_bad_meshes_is_nearer_than_fem_on_the_regular_one() {
    let truth = solve_quadratic(&beam([16, 4, 4], 0.0, 1), 0.3);
    for cells in [[10, 2, 2], [20, 4, 4]] {
        let of = |smoothing, alpha, seed| {
            let mesh = beam(cells, alpha, seed);
            solve_smoothed(&mesh, smoothed_domains(&mesh, smoothing), 0.3)
        };
        let plain = of(Smoothing::Element, 0.0, 1);
        for seed in 1..=5 {
            let face = of(Smoothing::Face, 0.45, seed);
            assert!(plain.tip < face.tip && face.tip < truth.tip, "{cells:?} {seed}: {} {}", plain.tip, face.tip);
            let [f_plain, f_face, f_truth] = [&plain, &face, &truth].map(|answer| answer.frequencies[0]);
            assert!(f_truth < f_face && f_face < f_plain, "{cells:?} {seed}: {f_plain} {f_face} {f_truth}");
        }
    }
}
