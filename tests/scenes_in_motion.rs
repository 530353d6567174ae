//! Scenes with `[dynamics]` that move, through the whole study.

use springfit::clock::Progress;
use springfit::dynamics::energy::drift;
use springfit::error::{Error, Result};
use springfit::report::result::Document;
use springfit::scene::{self, Source};
use springfit::study::motion::Moved;
use springfit::study::{self, Study, plan};

const SQUARE: &str = "[geometry]\nshape = \"square\"\n[material]\nyoung = 15e3\npoisson = 0.3333333333333333\ndensity = 1143.0\n\
                      [support]\nfaces = [\"y-\"]\n[[load]]\nforce_per_node = [2.0, -2.0]\n[calibration]\ngamma = 0.1\n[dynamics]\n";

fn parsed(dynamics: &str) -> scene::Scene {
    let source = Source { name: "square".into(), text: format!("{SQUARE}{dynamics}") };
    let scene = scene::parse(&source).expect("a scene");
    scene::check(&scene).expect("a sound scene");
    scene
}

fn run(dynamics: &str) -> Result<Study> {
    study::run(&parsed(dynamics), &Progress::default())
}

fn motions(dynamics: &str) -> Vec<Moved> {
    run(dynamics).expect("a motion").dynamics.expect("[dynamics] is there").motions
}

fn last(moved: &Moved) -> &[f64] {
    moved.motion.frames.last().expect("a record")
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
}

#[test]
fn without_a_duration_nothing_moves_but_the_safe_step_and_the_damping_range_are_told() {
    let study = run("alpha = 100.0\n").expect("a study");
    let dynamics = study.dynamics.as_ref().expect("[dynamics] is there");
    assert!(dynamics.motions.is_empty());
    let limits = &dynamics.limits[0];
    let (rest, any) = (limits.at_rest.expect("a limit"), limits.any_motion.expect("a limit"));
    assert_eq!(rest.proven, Some(1e-9));
    assert!(any.damped < rest.damped && rest.damped < rest.undamped);
    assert_eq!(dynamics.damping_range.len(), 4);
    assert!(dynamics.damping_range.windows(2).all(|pair| pair[0][0] > pair[1][0] && pair[0][1] > pair[1][1]));
    let result: serde_json::Value = serde_json::from_str(&Document::of(&study).to_json()).expect("JSON");
    assert_eq!(result["dynamics"]["safe_step"], any.safe(any.damped));
    // what check promises before the calibration holds after it
    let promised = plan::plan(&parsed("alpha = 100.0\n")).expect("a plan").safe_step.expect("a step");
    assert!(promised < rest.damped && promised > 0.01 * rest.damped, "{promised} {rest:?}");
}

#[test]
fn the_four_models_of_a_scene_agree_for_small_motion() {
    let common = "step = 1e-3\nduration = 0.2\nload_until = 0.05\n";
    let springs = motions(&format!("{common}alpha = 400.0\n"));
    let linear = motions(&format!("{common}alpha = 400.0\nmodel = \"springs_linear\"\n"));
    let difference = largest_difference(last(&springs[0]), last(&linear[0]));
    assert!(difference > 1e-9 && difference < 0.02, "{difference}");
    // the continuum is what the springs were fitted to: under a load that grows slowly they differ by the error of the fit
    let slowly = "integrator = \"newmark\"\nstep = 0.05\nduration = 20.0\nload_factors = [[0.0, 0.0], [20.0, 1.0]]\n";
    let fitted = motions(&format!("{slowly}model = \"springs_linear\"\n"));
    let continuum = motions(&format!("{slowly}model = \"reference\"\n"));
    let difference = largest_difference(last(&continuum[0]), last(&fitted[0]));
    assert!(difference > 1e-3 && difference < 0.04, "{difference}");
    assert_eq!(springs[0].motion.times.len(), 201);
    assert!((springs[0].motion.times[200] - 0.2).abs() < 1e-12);
    assert!(springs[0].motion.strain.iter().all(|strain| strain.is_finite()) && springs[0].motion.strain[0] == 0.0);
}

#[test]
fn a_damped_motion_under_a_lasting_load_comes_to_rest_in_the_static_state() {
    let study =
        run("model = \"springs_linear\"\nintegrator = \"implicit_euler\"\nstep = 0.5\nsteps = 400\nalpha = 5.0\n")
            .expect("a study");
    let moved = &study.dynamics.as_ref().expect("[dynamics] is there").motions[0];
    let difference = largest_difference(&study.calibration.displacements[0], last(moved));
    assert!(difference < 1e-6, "{difference}");
    let continuum =
        run("model = \"reference\"\nintegrator = \"implicit_euler\"\nstep = 0.5\nsteps = 400\n").expect("a study");
    let moved = &continuum.dynamics.as_ref().expect("[dynamics] is there").motions[0];
    let difference = largest_difference(&continuum.reference.cases[0].displacement, last(moved));
    assert!(difference < 1e-6, "{difference}");
}

#[test]
fn a_released_body_starts_in_the_static_state_and_keeps_its_energy() {
    for model in ["springs_linear", "reference"] {
        let text = format!(
            "model = \"{model}\"\ninitial = \"released\"\nintegrator = \"newmark\"\nstep = 0.01\nsteps = 10000\n"
        );
        let study = run(&text).expect("a study");
        let moved = &study.dynamics.as_ref().expect("[dynamics] is there").motions[0];
        let start = match model {
            "reference" => &study.reference.cases[0].displacement,
            _ => &study.calibration.displacements[0],
        };
        assert_eq!(&moved.motion.frames[0], start);
        assert!(moved.motion.energies[0].elastic > 0.0 && moved.motion.energies[200].work == 0.0);
        assert!(drift(&moved.motion.energies) < 1e-10, "{model}: {:e}", drift(&moved.motion.energies));
    }
}

#[test]
fn weight_alone_swings_a_body_about_its_sag() {
    let text = "model = \"springs_linear\"\ngravity = [0.0, -1.0]\nload_factors = [[0.0, 0.0]]\nduration = 1.0\n";
    let study = run(text).expect("a study");
    let dynamics = study.dynamics.as_ref().expect("[dynamics] is there");
    let (moved, total) = (&dynamics.motions[0], dynamics.masses.iter().sum::<f64>());
    let energies = moved.motion.energies.last().expect("a record");
    // the held nodes do not fall: the work is the weight of the others times their fall, which is less than that of all
    assert!(energies.work > 0.0 && energies.work < total * 1.0, "{energies:?}");
    assert!(drift(&moved.motion.energies) < 0.05, "{:e}", drift(&moved.motion.energies));
}

#[test]
fn several_alpha_move_side_by_side_and_two_thread_counts_give_the_same_bits() {
    let text = "alphas = [50.0, 100.0, 400.0]\nduration = 0.5\nload_until = 0.03333333333333333\n";
    let bits = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let moved = pool.install(|| motions(text));
        assert_eq!(moved.iter().map(|m| m.alpha).collect::<Vec<_>>(), [Some(50.0), Some(100.0), Some(400.0)]);
        // "auto" gives every alpha its own step, the larger the less damping there is
        assert!(moved[0].step < moved[1].step && moved[1].step < moved[2].step);
        let numbers = moved.iter().flat_map(|m| m.motion.frames.iter().flatten().chain(&m.motion.strain));
        numbers.map(|x| x.to_bits()).collect::<Vec<_>>()
    });
    assert_eq!(bits[0], bits[1]);
}

#[test]
fn an_unstable_step_is_refused_with_an_alpha_that_is_stable() {
    let refused = run("alpha = 1.0\nstep = 0.01\nduration = 0.5\n").err().expect("refused");
    let Error::UnstableStep { step: 0.01, help, .. } = &refused else { panic!("{refused:?}") };
    assert_eq!(refused.exit_status(), 3);
    let alpha: f64 = help.split(['=', ' ']).find_map(|word| word.parse().ok()).expect("an alpha in the help");
    assert!(run(&format!("alpha = {alpha}\nstep = 0.01\nduration = 0.5\n")).is_ok(), "{help}");
    assert!(run(&format!("alpha = {}\nstep = 0.01\nduration = 0.5\n", 0.99 * alpha)).is_err(), "{help}");
}
