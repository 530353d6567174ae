//! What a fit leaves open, and what holds it together: near-mechanisms, priors, profiles and rings of springs, on loads
//! that the fit did not see.

use springfit::clock::Progress;
use springfit::scene::{self, Source};
use springfit::study::near_mechanism::{Weakest, Weakness};
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

fn weakest(study: &Study) -> &Weakest {
    match &study.calibration.weakness {
        Weakness::Found(weakest) => weakest,
        Weakness::NotLookedFor { not_looked_for } => panic!("{not_looked_for}"),
    }
}
