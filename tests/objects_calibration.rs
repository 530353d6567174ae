//! tests/reference/objects.json: the calibrated error of square, circle, cube and torus for every gamma and both
//! weightings, by Gauss-Newton from several starts and by annealing alone.
//!
//! The table is printed with `cargo test --test objects_calibration -- --nocapture`.

use serde_json::Value;
use springfit::calibration::optimiser::{Stop, TracePoint};
use springfit::clock::{Progress, Stopwatch};
use springfit::scene::{self, Source};
use springfit::study::{self, fit::Calibration};

/// Factorisations in which a start shall come within 1 % of the best known error.
const FACTORISATIONS: u64 = 20;

/// Body, control points, degree, held face, force on every free control point in N (method.md, section 8).
const BODIES: [(&str, &str, &str, &str, &str); 4] = [
    ("square", "[6, 6]", "[2, 2]", "y-", "[200.0, -200.0]"),
    ("circle", "[6, 6]", "[2, 2]", "y-", "[600.0, 100.0]"),
    ("cube", "[6, 6, 6]", "[2, 2, 2]", "z-", "[80.0, -40.0, 40.0]"),
    ("torus", "[9, 5, 5]", "[2, 2, 2]", "y-", "[60.0, -30.0, 30.0]"),
];

/// One row of objects.json.
struct Known {
    weighting: &'static str,
    gamma: f64,
    groups: usize,
    best: f64,
}

fn known_rows(body: &str) -> Vec<Known> {
    let text = include_str!("reference/objects.json");
    let file: Value = serde_json::from_str(text).expect("objects.json is JSON");
    let mut rows = Vec::new();
    for (weighting, list) in [("springs", "by_gamma"), ("cells", "weighting_cells")] {
        for row in file["objects"][body][list].as_array().expect("a list of rows") {
            rows.push(Known {
                weighting,
                gamma: row["gamma"].as_f64().expect("gamma"),
                groups: row["m"].as_u64().expect("m") as usize,
                best: row["best_e_rms"].as_f64().expect("best_e_rms"),
            });
        }
    }
    rows
}

fn calibrate(body: &(&str, &str, &str, &str, &str), row: &Known, calibration: &str) -> Calibration {
    let (shape, points, degree, face, force) = body;
    let Known { weighting, gamma, .. } = row;
    let text = format!(
        "[geometry]\nshape = \"{shape}\"\ncontrol_points = {points}\ndegree = {degree}\n\
         [material]\nyoung = 15e3\npoisson = {poisson:?}\n[support]\nfaces = [\"{face}\"]\n\
         [[load]]\nforce_per_node = {force}\n[springs]\nweighting = \"{weighting}\"\n\
         [calibration]\ngamma = {gamma:?}\n{calibration}\n",
        poisson = 1.0 / 3.0
    );
    let scene = scene::parse(&Source { name: (*shape).into(), text }).expect("a legal scene");
    study::run(&scene, &Progress::default()).expect("a body that can be calibrated").calibration
}

/// Factorisations after which a start was within 1 % of `best`.
fn factorisations_until(trace: &[TracePoint], best: f64) -> Option<u64> {
    trace.iter().find(|point| point.error <= 1.01 * best).map(|point| point.refactorisations)
}

/// What is wrong with a calibration whatever optimiser found it.
fn faults(found: &Calibration, row: &Known) -> Vec<String> {
    let mut faults = Vec::new();
    if found.grouping.groups.len() != row.groups {
        faults.push(format!("{} groups", found.grouping.groups.len()));
    }
    if !found.phi.iter().zip(&found.upper).all(|(phi, upper)| (0.0..=*upper).contains(phi)) {
        faults.push(format!("phi {:?} outside the bounds {:?}", found.phi, found.upper));
    }
    if !found.fitted.e_rms.is_finite() || found.fitted.e_max < found.fitted.e_rms {
        faults.push(format!("errors {:?}", found.fitted));
    }
    faults
}

#[test]
fn objects_json_calibrated_errors_of_every_row() {
    println!(
        "{:<7} {:<8} {:>5} {:>6} {:>12} {:>13} {:>11} {:>9} {:>15} {:>11} {:>14}",
        "body",
        "weighting",
        "gamma",
        "groups",
        "best known %",
        "Gauss-Newton %",
        "shortfall %",
        "until 1 %",
        "annealing 5000 %",
        "shortfall %",
        "seconds GN, SA"
    );
    let mut wrong = Vec::new();
    for body in &BODIES {
        for row in known_rows(body.0) {
            let watch = Stopwatch::start();
            let starts = calibrate(body, &row, "gauss_newton = { polish = 0 }");
            let polished = calibrate(body, &row, "");
            let seconds = watch.seconds();
            let annealed = calibrate(body, &row, "optimiser = \"annealing\"\nannealing = { evaluations = 5000 }");
            let annealing_seconds = watch.seconds() - seconds;

            let trace = &starts.sweep[0].outcome.trace;
            let until = factorisations_until(trace, row.best);
            let shortfall = |e_rms: f64| 100.0 * (e_rms / row.best - 1.0);
            let (newton, annealing) = (shortfall(polished.fitted.e_rms), shortfall(annealed.fitted.e_rms));
            println!(
                "{:<7} {:<9} {:>5} {:>6} {:>12.6} {:>14.6} {newton:>11.4} {:>9} {:>16.6} {annealing:>11.4} {seconds:>8.2} {annealing_seconds:>5.2}",
                body.0,
                row.weighting,
                row.gamma,
                polished.grouping.groups.len(),
                row.best,
                polished.fitted.e_rms,
                until.map_or("never".into(), |n| n.to_string()),
                annealed.fitted.e_rms,
            );
            let mut faults: Vec<String> =
                [&starts, &polished, &annealed].iter().flat_map(|c| faults(c, &row)).collect();
            if newton < -0.01 {
                println!("a find: Gauss-Newton is {:.3} % below the best known error", -newton);
            }
            if newton > 0.01 {
                faults.push(format!("Gauss-Newton is {newton:.3} % above the best known error"));
            }
            if until.is_none_or(|n| n > FACTORISATIONS) {
                faults.push(format!("no start within 1 % after {FACTORISATIONS} factorisations: {until:?}"));
            }
            if starts.sweep[0].outcome.trace.iter().any(|point| point.refactorisations > FACTORISATIONS) {
                faults.push(format!("a start spent more than {FACTORISATIONS} factorisations"));
            }
            if annealing < newton.min(0.0) - 0.1 {
                faults.push(format!("annealing is {annealing:.3} % from the best known, Gauss-Newton {newton:.3} %"));
            }
            let history = &annealed.sweep[0].outcome.trace;
            if annealed.fitted.e_rms >= history[0].error {
                faults.push("annealing did not leave its starting point".to_owned());
            }
            if annealed.counts.evaluations != 5000 {
                faults.push(format!("annealing spent {} evaluations", annealed.counts.evaluations));
            }
            wrong.extend(
                faults.iter().map(|fault| format!("{} {} gamma {}: {fault}", body.0, row.weighting, row.gamma)),
            );
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Issue 16: on the ellipse, weighting "springs", starts disagree; the best known errors are 5.9005 % (22 groups) and 5.3972 %
/// (28). The defaults find them with any seed, and say what the starts found.
#[test]
fn the_ellipse_has_local_minima_and_the_defaults_find_the_lowest_known() {
    let ellipse = ("ellipse", "[6, 6]", "[2, 2]", "y-", "[1600.0, 200.0]");
    for (gamma, groups, best) in [(0.01, 22, 5.9005), (0.001, 28, 5.3972)] {
        for seed in 1..=3 {
            let row = Known { weighting: "springs", gamma, groups, best };
            let found = calibrate(&ellipse, &row, &format!("seed = {seed}"));
            assert!(faults(&found, &row).is_empty(), "{:?}", faults(&found, &row));
            let outcome = &found.sweep[0].outcome;
            let of = outcome.agreement.expect("several starts");
            assert!(found.fitted.e_rms < 1.0001 * best, "{groups} groups, seed {seed}: {} {of:?}", found.fitted.e_rms);
            assert!(of.starts >= 8 && of.worst > 1.0 && of.hops >= 16, "{of:?}");
            assert_eq!(found.disagreement().is_some(), outcome.stop == Stop::StartsDisagree);
        }
    }
}

/// One start has nobody to agree with; two that end apart do not converge.
#[test]
fn starts_that_end_apart_are_not_told_as_converged() {
    let ellipse = ("ellipse", "[6, 6]", "[2, 2]", "y-", "[1600.0, 200.0]");
    let row = Known { weighting: "springs", gamma: 0.001, groups: 28, best: 5.3972 };
    let found = calibrate(&ellipse, &row, "starts = 4");
    let (outcome, of) = (&found.sweep[0].outcome, found.sweep[0].outcome.agreement.expect("four starts"));
    assert_eq!((of.starts, of.agreeing, of.hops), (4, 1, 0));
    assert_eq!(outcome.stop, Stop::StartsDisagree);
    assert!(found.disagreement().is_some_and(|words| words.starts_with("1 of 4 starts")), "{:?}", found.disagreement());
    let square = ("square", "[6, 6]", "[2, 2]", "y-", "[200.0, -200.0]");
    let row = Known { weighting: "cells", gamma: 0.1, groups: 2, best: 1.1275983099890676 };
    let found = calibrate(&square, &row, "");
    assert_eq!(
        found.sweep[0].outcome.agreement.expect("starts").agreeing,
        found.sweep[0].outcome.agreement.expect("starts").starts
    );
    assert!(found.disagreement().is_none());
}
