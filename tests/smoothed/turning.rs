//! Scenes with a corotational continuum, through the whole study.

use springfit::clock::Progress;
use springfit::dynamics::energy::drift;
use springfit::error::{Error, Result};
use springfit::scene::{self, Source};
use springfit::study::{self, Study};

/// A beam of 5 x 2 x 2 cells; `rest` goes on from [reference].
fn text(young: f64, load: &str, rest: &str) -> String {
    format!(
        "[geometry]\nshape = \"beam\"\nsize = [1.0, 0.2, 0.2]\ncontrol_points = [6, 3, 3]\n\
         [material]\nyoung = {young:e}\npoisson = 0.3\ndensity = 1000.0\n[support]\nfaces = [\"x-\"]\n\
         [springs]\ngrouping = \"kind\"\n{load}\n[reference]\nmethod = \"smoothed_face\"\n{rest}\n"
    )
}

const WEIGHT: &str = "[[load]]\nname = \"weight\"\nbody_force = [0.0, 0.0, -9810.0]";

fn run_text(text: String) -> Result<Study> {
    let scene = scene::parse(&Source { name: "beam".into(), text }).expect("a scene");
    scene::check(&scene).expect("a sound scene");
    study::run(&scene, &Progress::default())
}

fn run(young: f64, load: &str, rest: &str) -> Study {
    run_text(text(young, load, &format!("kinematics = \"corotational\"\n{rest}"))).expect("a study")
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
}

/// A snapshot R (1 + E) - 1 with a turn about z and a stretch E.
fn turned(angle: f64, stretch: [f64; 3]) -> String {
    let (sine, cosine) = angle.sin_cos();
    let turn = [[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]];
    let entry = |i: usize, j: usize| turn[i][j] * (1.0 + stretch[j]) - f64::from(u8::from(i == j));
    let rows: Vec<String> =
        (0..3).map(|i| format!("[{:?}, {:?}, {:?}]", entry(i, 0), entry(i, 1), entry(i, 2))).collect();
    format!("{{ gradient = [{}] }}", rows.join(", "))
}

#[test]
fn a_state_that_is_turned_gives_the_same_springs_and_a_linear_continuum_others() {
    let stretches = [[0.1, 0.0, 0.0], [0.0, 0.15, 0.0], [0.0, -0.05, 0.1]];
    let springs = |kinematics: &str, angle: f64| {
        let states = stretches.map(|stretch| turned(angle, stretch)).join(", ");
        let rest = format!(
            "kinematics = \"{kinematics}\"\n[calibration]\nobjective = \"acceleration\"\n\
             [calibration.acceleration]\nsnapshots = [{states}]"
        );
        run_text(text(1e7, WEIGHT, &rest)).map(|study| study.calibration.phi)
    };
    let straight = springs("corotational", 0.0).expect("springs");
    let turned = springs("corotational", 1.1).expect("springs");
    assert!(straight.iter().any(|&phi| phi > 0.0));
    let difference = largest_difference(&straight, &turned);
    assert!(difference < 1e-9, "{straight:?} {turned:?}");
    // without a turn and with small strains both are one continuum
    let linear = springs("linear", 0.0).expect("springs");
    assert!(largest_difference(&straight, &linear) < 1e-9, "{straight:?} {linear:?}");
    // a linear continuum takes the turn for a strain: other springs, or none that hold
    match springs("linear", 1.1) {
        Ok(other) => assert!(largest_difference(&straight, &other) > 0.1, "{straight:?} {other:?}"),
        Err(error) => assert!(matches!(error, Error::Mechanism { .. }), "{error}"),
    }
}

#[test]
fn small_loads_give_the_linear_answers_and_the_difference_falls_with_the_load() {
    let differences = [1e-3, 1e-4].map(|scale| {
        let load = format!("[[load]]\nbody_force = [0.0, 0.0, {:?}]", -9810.0 * scale);
        let large = run(1e6, &load, "load_steps = 1");
        let linear = run_text(text(1e6, &load, "")).expect("a study");
        let of = |study: &Study| study.reference.cases[0].displacement.clone();
        let phi = largest_difference(&linear.calibration.phi, &large.calibration.phi);
        assert!(phi < 100.0 * scale, "{phi}");
        let pairs = [(linear.calibration.fitted.e_rms, large.calibration.fitted.e_rms)];
        assert!(pairs.iter().all(|(linear, large)| (linear / large - 1.0).abs() < 100.0 * scale), "{pairs:?}");
        largest_difference(&of(&linear), &of(&large))
    });
    assert!(differences[0] < 1e-2 && (differences[0] / differences[1]).log10() > 0.9, "{differences:?}");
}

#[test]
fn springs_are_fitted_to_a_bent_body_better_than_by_the_linear_fit() {
    let large = run(6e5, WEIGHT, "");
    let work = large.reference.large.as_ref().expect("large displacements");
    assert!(work.residual < 1e-10 && work.inversions[0].is_sound());
    let tip = large.reference.cases[0].u_max;
    assert!(tip > 0.2, "it bends far: {tip}");
    // the answer does not depend on the steps that led there
    let at_once = run(6e5, WEIGHT, "load_steps = 9");
    let of = |study: &Study| study.reference.cases[0].displacement.clone();
    assert!(largest_difference(&of(&large), &of(&at_once)) < 1e-7);
    // the stiffness that fits small displacements leaves a larger error where the body is bent
    let first = run_text(text(6e5, WEIGHT, "")).expect("a study").calibration;
    let given = study::fit::Given {
        scene: &large.scene,
        body: &large.body,
        loads: &large.loads,
        reference: &large.reference,
        lattice: &large.lattice,
    };
    let interrupt = springfit::clock::Interrupt::default();
    let moved = study::large::network(&given, &first.grouping, &first.phi, &[0], &interrupt).expect("it holds");
    let before = springfit::calibration::errors::errors(&large.body.dofs, &of(&large), &moved).e_rms;
    let after = large.calibration.fitted.e_rms;
    assert!(after < 0.999 * before, "{before} {after}");
}

#[test]
fn a_scene_in_motion_is_the_motion_of_the_body_and_both_solvers_agree() {
    let motion = |keys: &str| {
        let dynamics = format!("[dynamics]\nmodel = \"reference\"\nstep = 0.01\nduration = 0.3\n{keys}");
        let study = run(1e6, WEIGHT, &dynamics);
        let dynamics = study.dynamics.expect("it moves");
        assert_eq!(dynamics.motions[0].inverted.expect("looked at").records, 0);
        dynamics
    };
    let last = |dynamics: &study::motion::Dynamics| dynamics.motions[0].motion.frames.last().expect("a record").clone();
    let usual = motion("");
    assert_eq!(usual.integrator.name, "semi_implicit_euler");
    let iterated = motion("linear_solver = \"cg\"\nlinear_tolerance = 1e-12");
    assert!(iterated.motions[0].solves.linear_iterations > 0 && iterated.motions[0].solves.factorisations == 0);
    assert!(largest_difference(&last(&usual), &last(&iterated)) < 1e-8);
    for integrator in ["midpoint", "implicit_euler", "newmark"] {
        let [direct, iterated] =
            ["", "linear_solver = \"cg\"\n"].map(|solver| motion(&format!("{solver}integrator = \"{integrator}\"\n")));
        let difference = largest_difference(&last(&direct), &last(&iterated));
        assert!(difference < 1e-7, "{integrator}: {difference}");
        if integrator == "midpoint" {
            assert!(drift(&direct.motions[0].motion.energies) < 2e-2);
        }
    }
    let exact = last(&motion("integrator = \"implicit_euler\"\ntangent = \"exact\""));
    let positive = last(&motion("integrator = \"implicit_euler\""));
    assert!(largest_difference(&exact, &positive) < 1e-7, "the tangent does not change the answer");
    let damped = motion("integrator = \"midpoint\"\nrayleigh = [1.0, 1e-3]");
    assert!(damped.motions[0].motion.energies.last().expect("a record").dissipated > 0.0);
}

#[test]
fn a_free_body_keeps_its_momentum_and_turns_about_its_centre_of_mass() {
    let (velocity, spin) = ([1.0, -0.5, 2.0], [0.5, 6.0, 2.0]);
    let dynamics = format!(
        "[dynamics]\nmodel = \"reference\"\nintegrator = \"midpoint\"\nfree = true\nvelocity = {velocity:?}\n\
         angular_velocity = {spin:?}\nstep = 0.01\nsteps = 60\nframes = 60\ntolerance = 1e-13"
    );
    let study = run(1e6, WEIGHT, &dynamics);
    let dynamics = study.dynamics.as_ref().expect("it moves");
    let (masses, moved) = (&dynamics.masses, &dynamics.motions[0]);
    assert_eq!(dynamics.dofs.len(), 3 * masses.len());
    let total: f64 = masses.iter().sum();
    let centre = |frame: &Vec<f64>| -> [f64; 3] {
        let u = dynamics.dofs.expand(frame);
        [0, 1, 2].map(|a| masses.iter().zip(&u).map(|(m, u)| m / total * u[a]).sum())
    };
    for (time, frame) in moved.motion.times.iter().zip(&moved.motion.frames) {
        let at = centre(frame);
        (0..3).for_each(|a| assert!((at[a] - velocity[a] * time).abs() < 1e-10, "{time}: {at:?}"));
    }
    // kinetic energy at the start: of the flight and of the turn, and it stays but for what the strain takes
    let start = moved.motion.energies[0];
    let flight = 0.5 * total * velocity.iter().map(|v| v * v).sum::<f64>();
    assert!(start.elastic < 1e-20 * start.kinetic && start.kinetic > flight + 1.0);
    assert!(drift(&moved.motion.energies) < 1e-2 && moved.motion.energies[30].elastic > 0.0);
    // a node far from the axis has gone a good part of a turn
    let most = moved.motion.frames[40].iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    assert!(most > 0.8, "{most}");
}

/// Loads beyond reason: an answer whose inverted cells are told, or a stop that names the load; never NaN.
#[test]
fn a_box_pushed_through_itself_a_flattened_bar_and_a_crushed_one_are_told() {
    let loads = [
        ("through", "traction = { face = \"x+\", value = [-4e6, 0.0, 0.0] }"),
        ("flat", "traction = { face = \"z+\", value = [0.0, 0.0, -3e6] }"),
        ("heap", "random_smooth = { seed = 3, force = 4e4 }"),
    ];
    for (name, load) in loads {
        let load = format!("[[load]]\nname = \"{name}\"\n{load}");
        let rest =
            "kinematics = \"corotational\"\n[calibration]\nobjective = \"formula\"\nformula = \"van_gelder_volume\"";
        match run_text(text(1e6, &load, rest)) {
            Ok(study) => {
                let finite = |u: &[f64]| u.iter().all(|u| u.is_finite());
                assert!(finite(&study.reference.cases[0].displacement) && finite(&study.calibration.displacements[0]));
                let sound = study.reference.large.as_ref().expect("large").inversions[0].is_sound();
                let told = study.warnings.iter().any(|text| text.contains(name) && text.contains("turned inside out"));
                assert_eq!(told, !sound, "{:?}", study.warnings);
            }
            Err(Error::NoEquilibrium { what, reason, residual, .. }) => {
                assert!(what.ends_with(&format!("under the load {name}")) && !reason.is_empty(), "{what}");
                assert!(residual.is_finite());
            }
            Err(other) => panic!("{name}: {other}"),
        }
    }
}

/// A motion driven into itself: it goes on with finite numbers, or it stops with a named reason.
#[test]
fn a_motion_that_folds_the_body_is_told_and_never_nan() {
    for (integrator, step) in [("semi_implicit_euler", 0.01), ("implicit_euler", 0.01), ("midpoint", 0.002)] {
        let dynamics = format!(
            "[dynamics]\nmodel = \"reference\"\nintegrator = \"{integrator}\"\nstep = {step}\nduration = 0.1\n\
             velocity = [-60.0, 0.0, 5.0]"
        );
        let outcome = run_text(text(
            1e5,
            WEIGHT.replace("9810", "981").as_str(),
            &format!("kinematics = \"corotational\"\n{dynamics}"),
        ));
        match outcome {
            Ok(study) => {
                let moved = &study.dynamics.as_ref().expect("it moves").motions[0];
                assert!(moved.motion.frames.iter().flatten().all(|u| u.is_finite()), "{integrator}");
                let inverted = moved.inverted.expect("looked at");
                let told = study.warnings.iter().any(|text| text.contains("records of the motion"));
                assert!(inverted.records > 0 && told, "{integrator}: the body was folded: {inverted:?}");
            }
            Err(Error::NotConverged { step, residual, .. }) => assert!(step > 0 && residual.is_finite()),
            Err(Error::BlowUp { what, .. }) => assert!(!what.is_empty()),
            Err(other) => panic!("{integrator}: {other}"),
        }
    }
}
