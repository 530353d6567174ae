//! Both sides of the error on loads that no fit saw: the extremal compliance ratios, the loads they are found under, and the
//! generated held-out loads. The numbers are checked by running the loads that were named as load cases of their own.

use std::path::Path;

use springfit::clock::Progress;
use springfit::report::summary;
use springfit::scene::{self, Source};
use springfit::study::generalisation::{Generalisation, Measured, Side};
use springfit::study::{self, Study};

/// A body of the thesis with one load.
struct Body {
    shape: &'static str,
    face: &'static str,
    load: &'static str,
}

const ELLIPSE: Body = Body { shape: "ellipse", face: "y-", load: "[1600.0, 200.0]" };
const SPHEROID: Body = Body { shape: "spheroid", face: "z-", load: "[100.0, -50.0, 50.0]" };
const CUBE: Body = Body { shape: "cube", face: "z-", load: "[80.0, -40.0, 40.0]" };

fn run(body: &Body, young: f64, rest: &str) -> Study {
    let Body { shape, face, load } = body;
    let text = format!(
        "[geometry]\nshape = \"{shape}\"\n[material]\nyoung = {young:?}\npoisson = 0.3333333333333333\n[support]\n\
         faces = [\"{face}\"]\n[[load]]\nforce_per_node = {load}\n{rest}\n[calibration]\ngamma = 0.5\nstarts = 2\n"
    );
    let scene = scene::parse(&Source { name: (*shape).into(), text }).expect("a legal scene");
    study::run(&scene, &Progress::default()).expect("a body that can be calibrated")
}

fn measured(study: &Study) -> &Measured {
    match &study.generalisation {
        Generalisation::Measured(measured) => measured,
        other => panic!("{other:?}"),
    }
}

/// Held-out cases are no part of a fit; solved beside others, a load has the same answer but for the last bits, and flat
/// valleys take phi further than those.
fn same_network(a: &Study, b: &Study) {
    let (a, b) = (&a.calibration, &b.calibration);
    assert!((a.fitted.e_rms / b.fitted.e_rms - 1.0).abs() < 1e-9, "{:?} {:?}", a.fitted, b.fitted);
    a.phi.iter().zip(&b.phi).for_each(|(a, b)| assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}"));
}

/// The force of a field of the page of `reference::polynomial_loads` at r, written once more.
fn force(name: &str, r: [f64; 3]) -> [f64; 3] {
    let words: Vec<&str> = name.split(' ').collect();
    let axes = |word: &str| -> Vec<usize> { word.chars().filter_map(|letter| "xyz".find(letter)).collect() };
    let along = axes(words[words.len() - 1]);
    let unit = |a: usize| -> [f64; 3] { std::array::from_fn(|i| f64::from(i == a)) };
    match words[0] {
        "pull" => unit(along[0]),
        "twist" => {
            let e = unit(along[0]);
            [e[1] * r[2] - e[2] * r[1], e[2] * r[0] - e[0] * r[2], e[0] * r[1] - e[1] * r[0]]
        }
        "stretch" => unit(along[0]).map(|e| e * r[along[0]]),
        "shear" => std::array::from_fn(|i| unit(along[0])[i] * r[along[1]] + unit(along[1])[i] * r[along[0]]),
        growing => unit(axes(&growing[..1])[0]).map(|e| e * r[along[0]] * r[along[along.len() - 1]]),
    }
}

/// A load file with the forces of some sides.
fn write_loads(path: &Path, study: &Study, sides: &[(&str, &Side)]) {
    let positions = study.body.positions();
    let dimension = study.body.dofs.dimension();
    let end = |a: usize, pick: fn(f64, f64) -> f64| positions.iter().map(|x| x[a]).reduce(pick).unwrap();
    let box_of = |a: usize| [end(a, f64::min), end(a, f64::max)];
    let extent = (0..3).map(|a| box_of(a)[1] - box_of(a)[0]).fold(0.0, f64::max);
    let cases = sides.iter().map(|(name, side)| {
        let on = |x: &[f64; 3]| {
            let r = std::array::from_fn(|a| (x[a] - 0.5 * (box_of(a)[0] + box_of(a)[1])) / extent);
            let mut sum = [0.0; 3];
            for term in &side.terms {
                let field = force(&term.field, r);
                (0..3).for_each(|i| sum[i] += term.coefficient * field[i]);
            }
            sum[..dimension].to_vec()
        };
        let rows: Vec<Vec<f64>> = positions.iter().map(on).collect();
        ((*name).to_owned(), serde_json::json!(rows))
    });
    let cases: serde_json::Map<String, serde_json::Value> = cases.collect();
    std::fs::write(path, serde_json::json!({ "cases": cases }).to_string()).expect("written");
}

#[test]
fn the_loads_of_both_sides_have_the_ratios_that_are_told_when_they_are_run() {
    for body in [&ELLIPSE, &SPHEROID, &CUBE] {
        let study = run(body, 15e3, "");
        let found = measured(&study);
        println!(
            "{}: {} fields, stiffest {:.4} under {}, softest {:.4} under {}",
            body.shape,
            found.fields,
            found.stiffest.compliance_ratio,
            found.stiffest.load,
            found.softest.compliance_ratio,
            found.softest.load
        );
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("loads.json");
        write_loads(&path, &study, &[("soft", &found.softest), ("stiff", &found.stiffest)]);
        let case =
            |name: &str| format!("[[load]]\nname = \"{name}\"\nfit = false\nfile = {path:?}\ncase = \"{name}\"\n");
        let again = run(body, 15e3, &(case("soft") + &case("stiff")));
        same_network(&again, &study);
        for (c, side) in [(1, &found.softest), (2, &found.stiffest)] {
            let work = |u: &[f64]| -> f64 { again.loads[c].load.forces.iter().zip(u).map(|(f, u)| f * u).sum() };
            let ratio = work(&again.calibration.displacements[c]) / work(&again.reference.cases[c].displacement);
            assert!((ratio / side.compliance_ratio - 1.0).abs() < 1e-5, "{ratio} {}", side.compliance_ratio);
            let forces = &again.loads[c].load.forces;
            let rms = (forces.iter().map(|f| f * f).sum::<f64>() / forces.len() as f64).sqrt();
            assert!((rms - 1.0).abs() < 1e-9, "{rms}");
            let whole: f64 = side.terms.iter().map(|term| term.share).sum();
            assert!((whole - 1.0).abs() < 1e-12, "{whole}");
        }
        // the load cases of the scene are none of the space, but generated linear ones are
        assert!(found.stiffest.compliance_ratio < 1.0 && found.softest.compliance_ratio > 1.0);
        assert!(measured(&again).held_out.is_empty(), "the scene holds cases out itself");
    }
}

#[test]
fn no_smooth_load_has_a_ratio_outside_both_sides() {
    // generated loads of degree 1, run as load cases
    let text = "[[load]]\nfit = false\ntorsion = { axis = \"z\" }\n[[load]]\nfit = false\nbending = { along = \"x\", direction = \"z\" }\n\
                [[load]]\nfit = false\nradial = 3.0\n[[load]]\nfit = false\nforce_per_node = [0.0, 1.0, 0.0]\n";
    for body in [&SPHEROID, &CUBE] {
        let study = run(body, 15e3, text);
        let found = measured(&study);
        let (stiff, soft) = (found.stiffest.compliance_ratio, found.softest.compliance_ratio);
        for (c, case) in study.loads.iter().enumerate() {
            let work = |u: &[f64]| -> f64 { case.load.forces.iter().zip(u).map(|(f, u)| f * u).sum() };
            let ratio = work(&study.calibration.displacements[c]) / work(&study.reference.cases[c].displacement);
            println!("{}, {}: {stiff:.4} <= {ratio:.4} <= {soft:.4}", body.shape, case.name);
            assert!((stiff..=soft).contains(&ratio));
        }
    }
}

#[test]
fn both_sides_are_told_in_the_summary_and_the_spheroid_is_far_too_stiff_for_some_load() {
    let study = run(&SPHEROID, 15e3, "");
    let found = measured(&study);
    assert!(found.stiffest.compliance_ratio < 0.5, "{:?}", found.stiffest);
    let text = summary::run(&study);
    let line = text.lines().find(|line| line.starts_with("smooth loads of degree 2")).expect("a line");
    assert!(line.contains("too stiff") && line.contains("too soft"), "{line}");
    assert!(line.contains(&found.stiffest.load) && line.contains(&found.softest.load), "{line}");
}

#[test]
fn the_sides_and_their_words_are_those_of_the_body_in_other_units_too() {
    for body in [&ELLIPSE, &CUBE] {
        let (pascal, kilo) = (run(body, 15e3, ""), run(body, 15e6, ""));
        let (a, b) = (measured(&pascal), measured(&kilo));
        for (a, b) in [(&a.softest, &b.softest), (&a.stiffest, &b.stiffest)] {
            assert!((a.compliance_ratio / b.compliance_ratio - 1.0).abs() < 1e-4, "{a:?} {b:?}");
            assert_eq!(a.load, b.load);
        }
    }
}

#[test]
fn a_scene_without_held_out_loads_gets_generated_ones_that_change_no_bit_of_the_fit() {
    let with = run(&CUBE, 15e3, "");
    let names: Vec<&str> = measured(&with).held_out.iter().map(|case| case.load.as_str()).collect();
    assert_eq!(names, ["uniform_x", "uniform_y", "uniform_z", "torsion", "bending", "radial", "random_smooth"]);
    // as load cases of the scene they have the same errors
    let held = "[[load]]\nfit = false\nforce_per_node = [0.0, 1.0, 0.0]\n[[load]]\nfit = false\ntorsion = { axis = \"z\" }\n\
                [[load]]\nfit = false\nbending = { along = \"z\", direction = \"x\" }\n[[load]]\nfit = false\nrandom_smooth = { seed = 1 }\n";
    let without = run(&CUBE, 15e3, held);
    same_network(&with, &without);
    for (c, name) in [(1, "uniform_y"), (2, "torsion"), (3, "bending"), (4, "random_smooth")] {
        let generated = measured(&with).held_out.iter().find(|case| case.load == name).expect("it is there");
        let own = without.calibration.errors[c];
        assert!((generated.e_rms - own.e_rms).abs() < 1e-6 && (generated.e_max - own.e_max).abs() < 1e-6, "{name}");
    }
    let mut scene = with.scene.clone();
    scene.calibration.generalisation = Some(false);
    let off = study::run(&scene, &Progress::default()).expect("a body that can be calibrated");
    assert_eq!((&off.calibration.phi, &off.calibration.errors), (&with.calibration.phi, &with.calibration.errors));
    assert_eq!((&off.reference.cases, off.reference.accuracy), (&with.reference.cases, with.reference.accuracy));
    assert!(matches!(off.generalisation, Generalisation::NotLookedFor { .. }));
}
