//! Groups that adapt: the adjoint gradient, the ladder, its names, its bits also after a break, and the figures of
//! tests/reference/frontier.json.

use std::sync::Arc;

use serde_json::Value;
use springfit::calibration::adaptive::features::{self, Site};
use springfit::calibration::adaptive::part::Part;
use springfit::calibration::adaptive::places;
use springfit::calibration::adaptive::state::Cases;
use springfit::calibration::adaptive::worker::{Ground, Worker};
use springfit::calibration::adaptive::{Ladder, Standing};
use springfit::calibration::objectives::displacement::weights;
use springfit::clock::Progress;
use springfit::report::reproduce::{frontier, steady};
use springfit::scene::{self, Scene, Source};
use springfit::springs::affine::AffineStiffness;
use springfit::springs::grouping::{self, Request};
use springfit::springs::solver::{Path, Settings, SpringOperator};
use springfit::study::fit::Given;
use springfit::study::{self, Study, adaptive, body, loads, network};

/// Two fitted loads and one that is held out, on a body with `points` control points in each direction.
fn scene(shape: &str, points: &[usize], springs: &str) -> Scene {
    let plane = points.len() == 2;
    let (face, force, more) = match plane {
        true => ("y-", "[600.0, 100.0]", ""),
        false => ("z-", "[80.0, -40.0, 40.0]", ", 0.0"),
    };
    let text = format!(
        "[geometry]\nshape = \"{shape}\"\ncontrol_points = {points:?}\n[material]\nyoung = 15e3\npoisson = 0.3\n\
         [support]\nfaces = [\"{face}\"]\n[springs]\ngrouping = \"adaptive\"\nprofile = \"inverse_square\"\n{springs}\n\
         [[load]]\nforce_per_node = {force}\nmax_displacement = 1.0\n\
         [[load]]\nrandom_smooth = {{ seed = 3 }}\nmax_displacement = 1.0\n\
         [[load]]\nforce_per_node = [1.0, 1.0{more}]\nmax_displacement = 1.0\nfit = false\n"
    );
    let scene = scene::parse(&Source { name: shape.into(), text }).expect("a legal scene");
    scene::check(&scene).expect("a scene that can be run");
    scene
}

fn run(scene: &Scene) -> Study {
    study::run(scene, &Progress::default()).expect("a body that can be calibrated")
}

/// The derivative of the squared error by the stiffness of every single spring: adjoint against central differences.
#[test]
fn the_adjoint_gradient_is_the_limit_of_differences() {
    let progress = Progress::default();
    let scene = scene("circle", &[5, 5], "");
    let body = body::build(&scene).expect("a circle");
    let mut cases = loads::build(&body.resolved, &body).expect("loads");
    let mut reference = study::solve_reference(&body, &cases, &progress).expect("a solved continuum");
    loads::scale(&body.resolved, &mut cases, &mut reference);
    let lattice = network::build(&body.resolved, &body).expect("a network");
    let springs = lattice.network.springs.len();
    let each = grouping::find("each").expect("the table has it");
    let each = (each.group)(&lattice.network, &Request::default()).expect("a grouping");
    let symbolic = lattice.symbolic.clone().expect("a small body is factored");
    let stiffness = AffineStiffness::new(&lattice.network, &each, &lattice.coefficients, &body.dofs, &symbolic);
    let operator = SpringOperator::Assembled { stiffness, symbolic: Arc::clone(&symbolic) };
    let forces: Vec<f64> = cases.iter().flat_map(|case| case.load.forces.iter().copied()).collect();
    let answers: Vec<f64> = reference.cases.iter().flat_map(|case| case.displacement.iter().copied()).collect();
    let largest: Vec<f64> = reference.cases.iter().map(|case| case.u_max).collect();
    let weights = weights(&largest, body.positions().len());
    let bounds = vec![1e9; springs];
    let site = Site { network: &lattice.network, grid: body.grid(), boundary: &[0], held: &[0] };
    let (features, resolutions) = (features::table(&site), features::resolutions(&site));
    let places = places::places(body.positions(), &body.dofs);
    let ground = Ground {
        operator: &operator,
        fitted: Cases { forces: &forces, reference: &answers, weights: &weights },
        held_out: Cases { forces: &[], reference: &[], weights: &[] },
        bounds: &bounds,
        features: &features,
        resolutions: &resolutions,
        places: &places,
    };
    let single: Vec<Part> = (0..springs as u32).map(|s| Part::whole("spring", vec![s], &bounds)).collect();
    let mut worker = Worker::new(ground, &Settings::DIRECT, single, &progress.interrupt());
    let uneven: Vec<f64> = (0..springs).map(|s| 600.0 + 200.0 * (s as f64).sin()).collect();
    worker.attempt(&uneven).expect("a stiff network");
    worker.accept();
    let (residual, jacobian) = worker.linearise().expect("solved");
    let gradient: Vec<f64> = worker.transposed(&residual).expect("solved").iter().map(|half| 2.0 * half).collect();
    let phi = worker.phi().to_vec();
    let size = gradient.iter().fold(0.0_f64, |size, g| size.max(g.abs()));
    for s in 0..springs {
        // by its column
        let column = &jacobian[s * residual.len()..(s + 1) * residual.len()];
        let product: f64 = 2.0 * column.iter().zip(&residual).map(|(c, r)| c * r).sum::<f64>();
        assert!((product - gradient[s]).abs() < 1e-10 * size, "spring {s}: {product} {}", gradient[s]);
        let step = 1e-4 * phi[s];
        let mut at = |sign: f64| {
            let mut moved = phi.clone();
            moved[s] += sign * step;
            worker.attempt(&moved).expect("a stiff network").powi(2)
        };
        let difference = (at(1.0) - at(-1.0)) / (2.0 * step);
        assert!((difference - gradient[s]).abs() < 1e-6 * size, "spring {s}: {difference} {}", gradient[s]);
    }
}

#[test]
fn a_ladder_falls_and_its_groups_part_the_springs() {
    let study = run(&scene("circle", &[6, 6], "groups = 12"));
    let found = &study.calibration;
    let groups: Vec<usize> = found.ladder.iter().map(|rung| rung.groups).collect();
    assert_eq!(groups, (2..=12).collect::<Vec<_>>());
    assert!(found.ladder.windows(2).all(|pair| pair[1].error < pair[0].error));
    assert!(found.ladder.windows(2).all(|pair| pair[1].counts.refactorisations > pair[0].counts.refactorisations));
    assert_eq!(found.grouping.groups.iter().map(|group| group.springs).sum::<usize>(), 110);
    for (a, group) in found.grouping.groups.iter().enumerate() {
        assert_eq!(found.grouping.group_of.iter().filter(|&&of| of as usize == a).count(), group.springs);
        assert!(group.name.starts_with("edge") || group.name.starts_with("face_diagonal"), "{}", group.name);
    }
    assert!(found.phi.iter().zip(&found.upper).all(|(phi, upper)| (0.0..=*upper).contains(phi)));
    let last = &found.ladder[10];
    assert!((last.error / found.fitted.e_rms - 1.0).abs() < 1e-9, "{} {:?}", last.error, found.fitted);
    assert!((last.held_out.expect("one is held out") / found.errors[2].e_rms - 1.0).abs() < 1e-9);
    assert_eq!(found.sweep[0].outcome.stop.name(), "group_limit");
}

/// Hands out a scene, solved as far as a ladder needs it.
fn with_given<R>(scene: &Scene, f: impl FnOnce(&Given) -> R) -> R {
    let body = body::build(scene).expect("a body");
    let scene = &body.resolved;
    let mut cases = loads::build(scene, &body).expect("loads");
    let mut reference = study::solve_reference(&body, &cases, &Progress::default()).expect("a solved continuum");
    loads::scale(scene, &mut cases, &mut reference);
    let lattice = network::build(scene, &body).expect("a network");
    f(&Given { scene, body: &body, loads: &cases, reference: &reference, lattice: &lattice })
}

/// A ladder, and all rungs on its way.
fn climb(given: &Given, kept: Option<Standing>) -> (Ladder, Vec<Standing>) {
    let mut heard = Vec::new();
    let mut hear = |standing: &Standing| {
        heard.push(standing.clone());
        Ok(())
    };
    let ladder = adaptive::climb_scene(given, kept, &Progress::default(), &mut hear).expect("a ladder");
    (ladder, heard)
}

/// On every rung each spring has one group, and a piece of a group is all that its words say of the group of the start.
#[test]
fn groups_that_were_split_and_united_have_true_names() {
    let (features, heard) = with_given(&scene("circle", &[6, 6], "groups = 20"), |given| {
        (adaptive::features(given).expect("features"), climb(given, None).1)
    });
    let kinds = &heard[0].last.parts;
    let united = heard.iter().flat_map(|standing| &standing.last.parts).filter(|part| part.pieces.len() > 1);
    assert!(united.count() > 20, "hardly a union");
    for Standing { last, .. } in &heard {
        let mut springs: Vec<u32> = last.parts.iter().flat_map(|part| part.springs.iter().copied()).collect();
        springs.sort_unstable();
        assert_eq!(springs, (0..110).collect::<Vec<_>>());
        for part in &last.parts {
            let mut of_pieces: Vec<u32> = part.pieces.iter().flat_map(|piece| piece.springs.iter().copied()).collect();
            of_pieces.sort_unstable();
            assert_eq!(part.springs, of_pieces);
            for piece in &part.pieces {
                let kind = kinds.iter().find(|kind| kind.name() == piece.start).expect("a kind");
                let holds = |s: &u32| {
                    piece.conditions.iter().all(|c| (features[c.feature][*s as usize] < c.threshold) == c.below)
                };
                let meant: Vec<u32> = kind.springs.iter().copied().filter(holds).collect();
                assert_eq!(piece.springs, meant, "{}", part.name());
            }
        }
    }
    assert!(heard.windows(2).all(|pair| pair[1].rungs.last().unwrap().error < pair[0].rungs.last().unwrap().error));
}

/// What a ladder is, without its seconds: groups, numbers and errors to the bit, and the work.
fn bits(ladder: &Ladder) -> impl PartialEq + std::fmt::Debug + use<> {
    let rungs: Vec<_> = ladder
        .rungs
        .iter()
        .map(|rung| (rung.error.to_bits(), rung.held_out.map(f64::to_bits), rung.splits.clone(), rung.counts))
        .collect();
    let phi: Vec<u64> = ladder.phi.iter().map(|phi| phi.to_bits()).collect();
    (rungs, phi, ladder.parts.clone(), ladder.taken, ladder.stop)
}

/// Kept as text and read again, on paths that remember nothing and on paths that keep a factor or iterate from a guess.
#[test]
fn a_ladder_that_was_left_on_any_rung_goes_on_with_the_same_bits() {
    for (shape, points, springs, path) in [
        ("circle", &[6, 6][..], "groups = 20\npatience = 3", Path::Direct),
        ("cube", &[4, 4, 4], "groups = 8", Path::Single),
        ("cube", &[5, 5, 5], "groups = 20", Path::Stale),
        ("cube", &[5, 5, 5], "groups = 5", Path::Multigrid),
    ] {
        let mut scene = scene(shape, points, springs);
        scene.solver.path = path;
        with_given(&scene, |given| {
            let (whole, heard) = climb(given, None);
            assert!(heard.len() > 2);
            for (at, standing) in heard.iter().enumerate() {
                let text = serde_json::to_string(standing).expect("JSON");
                let kept: Standing = serde_json::from_str(&text).expect("a standing");
                assert_eq!(&kept, standing);
                let (continued, new) = climb(given, Some(kept));
                assert_eq!(bits(&continued), bits(&whole), "{path:?}, rung {at}");
                assert_eq!(new.len(), heard.len() - at - 1);
            }
        });
    }
}

#[test]
fn a_ladder_ends_where_the_scene_says() {
    let whole = run(&scene("circle", &[6, 6], "groups = 24"));
    let held_out: Vec<f64> =
        whole.calibration.ladder.iter().map(|rung| rung.held_out.expect("one is held out")).collect();
    let enough = held_out.iter().copied().fold(f64::INFINITY, f64::min) * 1.0001;
    let first = held_out.iter().position(|&error| error <= enough).expect("the lowest one");
    let study = run(&scene("circle", &[6, 6], &format!("groups = 24\nmax_error = {enough:?}")));
    assert_eq!(study.calibration.ladder.len(), first + 1);
    assert_eq!(study.calibration.sweep[0].outcome.stop.name(), "error_reached");
    let rises = held_out.windows(2).position(|pair| pair[1] >= pair[0]).expect("a held-out error that never rises");
    let study = run(&scene("circle", &[6, 6], "groups = 24\npatience = 1"));
    assert_eq!(study.calibration.ladder.len(), rises + 2);
    assert_eq!(study.calibration.grouping.groups.len(), study.calibration.ladder[rises].groups);
    assert_eq!(study.calibration.sweep[0].outcome.stop.name(), "held_out_rises");
}

/// A circle of 5 x 5 control points has 40 displacements under one load, and 72 springs.
#[test]
fn more_groups_than_displacements_can_tell_apart_end_the_ladder_and_keep_its_network() {
    let mut scene = scene("circle", &[5, 5], "groups = 1000");
    scene.load.truncate(1);
    let found = run(&scene).calibration;
    let last = found.ladder.last().expect("a rung");
    assert!(last.groups <= 72 && last.error < found.ladder[0].error, "{last:?}");
    assert!(found.phi.iter().all(|phi| phi.is_finite()) && found.fitted.e_rms.is_finite());
}

/// Several groups split at once from 16 on, and the adjoint blocks of a solid are large enough to be divided.
#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let scene = scene("cube", &[5, 5, 5], "groups = 20");
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let found = pool.install(|| run(&scene)).calibration;
        let errors =
            found.ladder.iter().map(|rung| (rung.groups, rung.error.to_bits(), rung.held_out.map(f64::to_bits)));
        let phi: Vec<u64> = found.phi.iter().map(|phi| phi.to_bits()).collect();
        (errors.collect::<Vec<_>>(), phi, found.grouping.group_of)
    };
    let one = with(1);
    assert_eq!(one.0.last().expect("a rung").0, 20);
    assert_eq!(one, with(2));
    assert_eq!(one, with(4));
}

/// The short form of `springfit reproduce steady`: units, threads, seeds and node numbers leave groups and errors alone.
#[test]
fn a_ladder_does_not_turn_on_units_threads_seeds_or_node_numbers() {
    let rows = steady::run(Some(&["square", "circle", "ellipse"]), Some(16), &Progress::default()).expect("rows");
    assert_eq!(rows.len(), 3 * 2 * 15);
    for row in rows {
        assert!(row.same_groups && row.error < 1e-6 && row.held_out < 1e-6, "{row:?}");
    }
}

/// Where more groups fit the four loads better and the other four worse: 32 groups on the 30 free nodes of the square, 2.66 % for 2.30.
const SQUARE_WITH_32: f64 = 1.16;

/// `springfit reproduce frontier` but for the cube: within a tenth of the prototype, or below it. Fits that go to the bottom cost a
/// third more factorisations than the four of a fit that does not.
#[test]
fn the_bodies_come_as_far_as_the_prototype() {
    let known: Value = serde_json::from_str(include_str!("reference/frontier.json")).expect("JSON");
    let rows =
        frontier::run(Some(&["square", "circle", "ellipse", "torus", "spheroid"]), &Progress::default()).expect("rows");
    let mut faults = Vec::new();
    for row in &rows {
        for (i, (groups, cost)) in [(16, 180), (32, 280)].into_iter().enumerate() {
            let (alone, on_all) = (&row.alone[i], &row.on_all[i]);
            if [alone.groups, on_all.groups] != [groups; 2] {
                faults.push(format!("{} {groups}: {} and {} groups", row.body, alone.groups, on_all.groups));
            }
            if alone.refactorisations.max(on_all.refactorisations) > cost {
                let factorisations = [alone.refactorisations, on_all.refactorisations];
                faults.push(format!("{} {groups}: {factorisations:?} factorisations", row.body));
            }
            let body = &known["bodies"][row.body];
            let (on_c0, on_h) =
                (body["alone"][i].as_f64().expect("a number"), body["held_out"][i].as_f64().expect("a number"));
            let room = if (row.body, groups) == ("square", 32) { SQUARE_WITH_32 } else { 1.1 };
            if (row.topology, row.more_loads) == ("grid", 0)
                && (alone.fitted > 1.1 * on_c0 || on_all.held_out > room * on_h)
            {
                faults.push(format!(
                    "{} {groups}: {} for {on_c0}, {} for {on_h}",
                    row.body, alone.fitted, on_all.held_out
                ));
            }
        }
        // issue 7: twelve more random smooth loads in the fit, and the second ring
        let most = if row.body == "circle" { 4.5 } else { 9.5 };
        if row.more_loads == 12 && row.on_all[1].held_out > most {
            faults.push(format!("{} with more loads: {} on H", row.body, row.on_all[1].held_out));
        }
        if row.topology == "second_ring" && (row.on_all[1].fitted > 5.0 || row.on_all[1].held_out > 11.5) {
            faults.push(format!("{} with the second ring: {:?}", row.body, row.on_all[1]));
        }
    }
    assert_eq!(rows.len(), 8);
    assert!(faults.is_empty(), "{faults:#?}\n{}", frontier::table(&rows));
}
