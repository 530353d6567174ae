//! What a fit leaves open, and what holds it together: near-mechanisms, priors, profiles and rings of springs, on loads
//! that the fit did not see.

use springfit::clock::Progress;
use springfit::scene::{self, Source};
use springfit::study::generalisation::{Generalisation, Measured};
use springfit::study::{self, Study};

const FITTED: [&str; 4] = ["source", "uniform_z", "torsion", "random_smooth"];
const HELD_OUT: [&str; 4] = ["uniform_x", "uniform_y", "bending", "point"];

/// A body with its support and the load of the source.
struct Body {
    shape: &'static str,
    geometry: &'static str,
    face: &'static str,
    /// max |u_ref| under the load of the source, m: every case is scaled to it.
    largest: f64,
}

/// Fits a body on some of its load cases; the others of both lists are held out.
fn fit(body: &Body, fitted: &[&str], rest: &str) -> Study {
    let Body { shape, geometry, face, largest } = body;
    let mut text = format!(
        "[geometry]\nshape = \"{shape}\"\n{geometry}\n[material]\nyoung = 15e3\npoisson = 0.3333333333333333\n\
         [support]\nfaces = [\"{face}\"]\n"
    );
    for case in FITTED.iter().chain(&HELD_OUT) {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/data/loads/six_bodies.json");
        let fit = fitted.contains(case);
        text += &format!(
            "[[load]]\nname = \"{case}\"\nfit = {fit}\nfile = \"{file}\"\nbody = \"{shape}\"\ncase = \"{case}\"\n\
             max_displacement = {largest:?}\n"
        );
    }
    text += rest;
    let scene = scene::parse(&Source { name: (*shape).into(), text }).expect("a legal scene");
    study::run(&scene, &Progress::default()).expect("a body that can be calibrated")
}

/// The root mean square of e_rms over the held-out cases of [`HELD_OUT`], percent.
fn held_out(study: &Study) -> f64 {
    let cases = study.loads.iter().zip(&study.calibration.errors).filter(|(case, _)| HELD_OUT.contains(&&*case.name));
    let squares: Vec<f64> = cases.map(|(_, errors)| errors.e_rms.powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn measured(study: &Study) -> &Measured {
    match &study.generalisation {
        Generalisation::Measured(measured) => measured,
        other => panic!("{other:?}"),
    }
}

const MERGED_TORUS: Body =
    Body { shape: "torus", geometry: "merge_seam = true", face: "y-", largest: 0.8522684171333419 };
const TORUS: Body = Body { shape: "torus", geometry: "", face: "y-", largest: 1.0669296341524375 };
const SPHEROID: Body = Body { shape: "spheroid", geometry: "", face: "z-", largest: 0.3908935479431298 };
const CUBE: Body = Body { shape: "cube", geometry: "", face: "z-", largest: 2.2152105221284275 };

#[test]
fn a_fit_on_one_load_opens_the_merged_torus_and_says_so() {
    let springs = "[springs]\ngrouping = \"each\"\n";
    let says = |study: &Study| study.warnings.iter().any(|warning| warning.contains("nearly a mechanism"));
    let open = fit(&MERGED_TORUS, &["source"], springs);
    let found = measured(&open);
    println!("source alone: held out {:.1} %, {:.2}, {:?}", held_out(&open), found.softest_linear, found.moving);
    assert!(held_out(&open) > 50.0);
    assert!(says(&open) && found.near_mechanism && found.softest_linear > 3.0);
    let moving = &found.moving;
    assert!(moving.nodes > 0 && (0..3).all(|a| moving.region[0][a] <= moving.region[1][a]));
    let sound = fit(&MERGED_TORUS, &FITTED, springs);
    let found = measured(&sound);
    println!("four loads: held out {:.1} %, {:.2}, {:?}", held_out(&sound), found.softest_linear, found.moving);
    assert!(held_out(&sound) < 15.0);
    assert!(!says(&sound) && !found.near_mechanism && found.softest_linear < 1.6);
}

#[test]
fn one_group_a_spring_with_a_prior_holds_on_other_loads() {
    let spread = |study: &Study| {
        let logs: Vec<f64> = study.calibration.phi.iter().map(|phi| phi.ln()).collect();
        let mean = logs.iter().sum::<f64>() / logs.len() as f64;
        (logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / logs.len() as f64).sqrt()
    };
    // the prototype with 32 adaptive groups reaches 1.79 and 12.0 % on these loads
    for (body, springs, limits) in [(&CUBE, 1940, [0.70, 1.90]), (&TORUS, 2000, [4.5, 11.8])] {
        let run = |strength: f64| {
            let text = format!("[springs]\ngrouping = \"each\"\n[calibration]\nregularisation = {strength:?}\n");
            fit(body, &FITTED, &text)
        };
        let study = run(1.0);
        let found = &study.calibration;
        let (e_rms, held_out) = (found.fitted.e_rms, held_out(&study));
        println!(
            "{}: {e_rms:.3} % fitted, {held_out:.2} % held out, {:?}, spread {:.2}",
            body.shape,
            found.counts,
            spread(&study)
        );
        assert_eq!(found.grouping.groups.len(), springs);
        assert!(e_rms <= limits[0] && held_out <= limits[1], "{}: {e_rms} {held_out}", body.shape);
        assert!(found.counts.refactorisations <= 101);
        let stiff = run(10.0);
        assert!(spread(&stiff) < 0.7 * spread(&study), "a stronger prior draws springs together");
        assert!(stiff.calibration.fitted.e_rms > e_rms, "and costs fit");
    }
}

#[test]
fn a_profile_from_the_matrix_of_the_continuum_makes_kinds_better_on_curved_bodies() {
    for body in [&TORUS, &SPHEROID] {
        let run = |profile: &str| {
            let study = fit(body, &FITTED, &format!("[springs]\ngrouping = \"kind\"\nprofile = \"{profile}\"\n"));
            println!(
                "{} {profile}: {:.2} %, {:.2} % held out",
                body.shape,
                study.calibration.fitted.e_rms,
                held_out(&study)
            );
            [study.calibration.fitted.e_rms, held_out(&study)]
        };
        let (constant, matrix) = (run("constant"), run("matrix_fit"));
        assert!((0..2).all(|i| matrix[i] < 0.75 * constant[i]), "{}: {matrix:?}, {constant:?}", body.shape);
    }
}

#[test]
fn a_second_ring_of_springs_comes_nearer_to_the_torus() {
    let run = |topology: &str| {
        let springs = format!("topology = \"{topology}\"\ngrouping = \"kind\"\nprofile = \"inverse_square\"\n");
        let study = fit(&TORUS, &FITTED, &format!("[springs]\n{springs}"));
        println!("{topology}: {:.2} %, {:.2} % held out", study.calibration.fitted.e_rms, held_out(&study));
        [study.calibration.fitted.e_rms, held_out(&study)]
    };
    let (one, two) = (run("grid"), run("second_ring"));
    assert!((0..2).all(|i| two[i] < 0.95 * one[i]), "{two:?}, {one:?}");
}

/// With 48 groups in space some steps loosen an outer node of the spheroid so far that K bears its load and no other force.
#[test]
fn a_fit_goes_back_from_a_network_whose_derivatives_cannot_be_solved_for() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenes/spheroid.toml");
    let with = |groups: usize| {
        let sets = ["springs.grouping=\"k_means\"".to_owned(), format!("springs.groups={groups}")];
        let scene = scene::read(path.as_ref(), &sets).expect("a good scene").scene;
        study::run(&scene, &Progress::default()).expect("a network that holds together").calibration
    };
    let (some, many) = (with(40), with(48));
    println!("40 groups {:.3} %, 48 groups {:.3} %, {:?}", some.fitted.e_rms, many.fitted.e_rms, many.accuracy);
    assert!(many.fitted.e_rms < some.fitted.e_rms);
    assert!(many.accuracy.expect("a linear network").forward_error < 1e-6);
}
