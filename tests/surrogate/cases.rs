//! The bodies that the surrogate is tested and measured on; shared by the tests and by benches/surrogate.rs.

use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;
use springfit::calibration::objective::{Objective, Problem};
use springfit::calibration::objectives::displacement::{Displacement, Target, weights};
use springfit::calibration::optimiser::{Outcome, Settings, find};
use springfit::calibration::pieces::NOTHING;
use springfit::calibration::surrogate::certificate::Certificate;
use springfit::calibration::surrogate::galerkin::Galerkin;
use springfit::calibration::surrogate::walker::Walker;
use springfit::clock::Progress;
use springfit::geometry::dofs::DofMap;
use springfit::reference::Reference;
use springfit::rng::Stream;
use springfit::scene::{self, Scene, Source};
use springfit::springs::affine::AffineStiffness;
use springfit::springs::bounds;
use springfit::springs::grouping::{self, Group, Grouping, Request};
use springfit::springs::solver::{Path, SpringOperator};
use springfit::springs::weighting::Weighting;
use springfit::study::loads::LoadCase;
use springfit::study::network::Lattice;
use springfit::study::{body, loads, network};

/// A body of method section 8 with its springs in length groups.
pub struct Case {
    pub operator: SpringOperator<'static>,
    pub loads: Vec<LoadCase>,
    pub reference: Vec<f64>,
    pub weights: Vec<f64>,
    pub upper: Vec<f64>,
}

pub fn case(shape: &str, gamma: f64) -> Case {
    weighted_case(shape, gamma, Weighting::Springs)
}

pub fn weighted_case(shape: &str, gamma: f64, weighting: Weighting) -> Case {
    let text = scene::template(shape).expect("a shape");
    let source = Source { name: shape.into(), text };
    let mut scene: Scene = scene::parse(&source).expect("a template is valid");
    scene.springs.weighting = weighting;
    let body = body::build(&scene).expect("a body");
    let loads = loads::build(&scene, &body).expect("loads");
    let lattice = network::build(&scene, &body).expect("a network");
    let points = body.integration_points().expect("points");
    let order = body.reference_order(&points).expect("an order");
    let forces = vec![loads[0].load.clone()];
    let reference = Reference::solve(&points, body.lame, &body.dofs, order, &forces).expect("solvable");
    let groups = (grouping::find("length").expect("known").group)(&lattice.network, &Request::with_gamma(gamma))
        .expect("legal gamma");
    let operator = operator(&lattice, &groups, &body.dofs);
    let upper = bounds::upper_bounds(&groups, &lattice.spring_bounds, &lattice.factors);
    let weights = weights(&[reference.cases[0].u_max], body.dofs.masters().count());
    Case { operator, loads, reference: reference.cases[0].displacement.clone(), weights, upper }
}

pub fn operator(lattice: &Lattice, groups: &Grouping, dofs: &DofMap) -> SpringOperator<'static> {
    let symbolic = Arc::clone(lattice.symbolic.as_ref().expect("a path with factors"));
    let stiffness = AffineStiffness::new(&lattice.network, groups, &lattice.coefficients, dofs, &symbolic);
    SpringOperator::Assembled { stiffness, symbolic }
}

impl Case {
    pub fn springs(&self) -> &AffineStiffness {
        self.operator.assembled().expect("a path with factors").0
    }

    pub fn target(&self) -> Target<'_> {
        Target {
            operator: &self.operator,
            upper: &self.upper,
            forces: &self.loads[0].load.forces,
            reference: &self.reference,
            weights: &self.weights,
        }
    }

    pub fn centre(&self) -> Vec<f64> {
        self.upper.iter().map(|upper| 0.1 * upper).collect()
    }

    /// A basis of the solution and derivatives at the centre and of solutions at `snapshots` random states.
    pub fn basis(&self, snapshots: usize, decades: f64) -> (Galerkin<'_>, Vec<Vec<f64>>) {
        let mut exact = Displacement::new(self.target());
        let mut basis = Galerkin::new(self.target());
        let mut states = vec![self.centre()];
        let mut stream = Stream::new(5, 0, 0);
        states.extend((0..snapshots).map(|_| near(&self.centre(), decades, &mut stream)));
        for (i, phi) in states.iter().enumerate() {
            exact.error(phi).expect("positive definite");
            basis.enrich(exact.displacement());
            if i == 0 {
                let (mut residual, mut jacobian) = (vec![], vec![]);
                exact.linearise(&mut residual, &mut jacobian).expect("solvable");
                basis.enrich(&jacobian);
            }
        }
        (basis, states)
    }

    pub fn run(&self, optimiser: &str, seed: u64, settings: &Settings) -> Outcome {
        let worker = || Displacement::new(self.target());
        let make = || -> Box<dyn Objective + '_> { Box::new(worker()) };
        let progress = Progress::default();
        let problem = Problem {
            make: &make,
            displacement: Some(&worker),
            linear: None,
            prior: None,
            upper: &self.upper,
            seed,
            index: 0,
            side_by_side: true,
            progress: &progress,
            kept: &NOTHING,
        };
        (find(optimiser).expect("in the table").run)(&problem, settings).expect("a well-posed problem")
    }
}

/// Each phi moved by up to half the decades up or down.
pub fn near(centre: &[f64], decades: f64, stream: &mut Stream) -> Vec<f64> {
    centre.iter().map(|phi| phi * 10f64.powf(decades * (stream.uniform() - 0.5))).collect()
}

/// The smallest e_rms known of a body and gamma.
pub fn best_known(shape: &str, gamma: f64, table: &str) -> f64 {
    let all: Value = serde_json::from_str(include_str!("../reference/objects.json")).expect("JSON");
    let rows = all["objects"][shape][table].as_array().expect("rows").clone();
    let row = rows.iter().find(|row| row["gamma"].as_f64() == Some(gamma)).expect("a row of this gamma").clone();
    row["best_e_rms"].as_f64().expect("a number")
}

/// The rows of the table: 16 groups on the circle, 4 and 15 on the torus, with both weightings.
pub fn rows() -> impl Iterator<Item = (&'static str, f64, usize, &'static str, Weighting)> {
    let bodies = [("circle", 0.01, 16), ("torus", 0.5, 4), ("torus", 0.1, 15)];
    let tables = [("by_gamma", Weighting::Springs), ("weighting_cells", Weighting::Cells)];
    bodies.into_iter().flat_map(move |(shape, gamma, groups)| {
        tables.map(move |(table, weighting)| (shape, gamma, groups, table, weighting))
    })
}

/// Fastest of some runs, seconds a call.
pub fn fastest(calls: usize, call: &mut dyn FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..7 {
        let start = Instant::now();
        (0..calls).for_each(|_| call());
        best = best.min(start.elapsed().as_secs_f64() / calls as f64);
    }
    best
}

/// Seconds of a surrogate evaluation, of its bound, and of an exact one, on a cube of n^3 with the length groups, each
/// split into `parts`, and a basis of r columns. The cost does not depend on what the columns hold.
pub fn online_cost(n: usize, parts: usize, r: usize) -> (f64, f64, f64) {
    let template = scene::template("cube").expect("a shape");
    let mut scene: Scene = scene::parse(&Source { name: "cube".into(), text: template }).expect("valid");
    scene.geometry.control_points = Some(vec![n; 3]);
    scene.solver.path = Path::Direct;
    let body = body::build(&scene).expect("a body");
    let loads = loads::build(&scene, &body).expect("loads");
    let lattice = network::build(&scene, &body).expect("a network");
    let length = (grouping::find("length").expect("known").group)(&lattice.network, &Request::with_gamma(0.1))
        .expect("legal gamma");
    let group_of: Vec<u32> =
        length.group_of.iter().enumerate().map(|(s, &g)| g * parts as u32 + (s % parts) as u32).collect();
    let count = |a: usize| group_of.iter().filter(|&&g| g as usize == a).count();
    let group = |a: usize| Group { name: a.to_string(), springs: count(a), length: 1.0 };
    let groups = Grouping { groups: (0..length.groups.len() * parts).map(group).collect(), group_of };
    let operator = operator(&lattice, &groups, &body.dofs);
    let upper = bounds::upper_bounds(&groups, &lattice.spring_bounds, &lattice.factors);
    let forces = &loads[0].load.forces;
    let target = Target { operator: &operator, upper: &upper, forces, reference: forces, weights: &[1.0] };
    let phi: Vec<f64> = upper.iter().map(|upper| 0.1 * upper).collect();
    let mut stream = Stream::new(1, 0, 0);
    let mut basis = Galerkin::new(target);
    (0..r).for_each(|_| {
        let column: Vec<f64> = forces.iter().map(|_| stream.normal()).collect();
        basis.enrich(&column);
    });
    let mut certificate = Certificate::new(target, &phi).expect("definite");
    certificate.extend(&basis);
    let mut image = Walker::bound_workspace(&certificate);
    let mut walker = Walker::new(&basis, None);
    let mut exact = Displacement::new(target);
    let evaluation = fastest(2000, &mut || {
        walker.error(&phi).expect("definite");
    });
    let bound = fastest(2000, &mut || {
        std::hint::black_box(walker.bound(&certificate, &mut image));
    });
    let refactor = fastest(1, &mut || {
        exact.error(&phi).expect("definite");
    });
    (evaluation, bound, refactor)
}
