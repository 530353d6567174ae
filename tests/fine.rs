//! Calibration on fine meshes, on bodies small enough to compare with the direct path; and how a run is stopped there.

use springfit::calibration::optimiser::Stop;
use springfit::clock::Progress;
use springfit::error::Error;
use springfit::scene::{self, Gamma, Scene, Source};
use springfit::springs::solver::Path;
use springfit::study::{self, Study, body, loads};

fn scene(shape: &str, control_points: [usize; 3], gamma: f64, path: Path) -> Scene {
    let source = Source { name: shape.into(), text: scene::template(shape).expect("a shape") };
    let mut scene = scene::parse(&source).expect("a template is valid");
    scene.geometry.control_points = Some(control_points.to_vec());
    scene.calibration.gamma = Gamma::Fixed(gamma);
    scene.solver.path = path;
    scene
}

fn run(scene: &Scene) -> Study {
    study::run(scene, &Progress::default()).expect("a body that can be calibrated")
}

/// The reduced model ends where Gauss-Newton on the direct path does, or lower, and what it says is confirmed.
#[test]
fn the_reduced_model_finds_the_error_of_the_direct_path() {
    for (shape, control_points, gamma) in
        [("cube", [9, 9, 9], 0.1), ("torus", [17, 9, 9], 0.5), ("spheroid", [17, 16, 5], 0.5)]
    {
        let fine = run(&scene(shape, control_points, gamma, Path::Multigrid)).calibration;
        let direct = run(&scene(shape, control_points, gamma, Path::Direct)).calibration;
        let (found, best) = (fine.fitted.e_rms, direct.fitted.e_rms);
        println!("{shape}: {found} % against {best} %, {} solves", fine.counts.solves);
        assert!(found <= 1.001 * best, "{shape}: {found} % against {best} %");
        let row = &fine.sweep[fine.best];
        assert_eq!(row.outcome.stop, Stop::NoPromise, "{shape}");
        assert!(row.error_difference.is_some_and(|d| d < 1e-8), "{shape}: {:?}", row.error_difference);
        assert!(fine.counts.solves < 80, "{shape}: {} solves", fine.counts.solves);
    }
}

/// Several load cases share one basis.
#[test]
fn two_load_cases_on_the_reduced_model() {
    let mut two = scene("cube", [8, 8, 8], 0.1, Path::Multigrid);
    two.load.push(scene::Load::force_per_node(vec![-30.0, 50.0, 10.0]));
    let fine = run(&two).calibration;
    two.solver.path = Path::Direct;
    let direct = run(&two).calibration;
    assert!(fine.fitted.e_rms <= 1.001 * direct.fitted.e_rms);
    assert!(fine.sweep[fine.best].error_difference.is_some_and(|d| d < 1e-8));
}

#[test]
fn a_run_that_was_stopped_ends_in_the_iteration_of_the_reference_and_of_the_springs() {
    let scene = scene("cube", [14, 14, 14], 0.1, Path::Multigrid);
    let stopped = Progress::default();
    stopped.cancel();
    let body = body::build(&scene).expect("a body");
    let cases = loads::build(&body.resolved, &body).expect("loads");
    assert_eq!(study::solve_reference(&body, &cases, &stopped).err(), Some(Error::Interrupted));
    assert_eq!(study::run(&scene, &stopped).err(), Some(Error::Interrupted));
}
