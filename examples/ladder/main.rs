#![allow(dead_code, missing_docs)]
use springfit::{calibration, clock, dense, error, geometry, rng, sparse, springs};
#[path = "../../src/calibration/adaptive/mod.rs"]
mod adaptive;

use std::sync::Arc;
use adaptive::{features, ladder, rank::Tuning, worker::Ground};
use springfit::calibration::errors;
use springfit::calibration::objectives::displacement::weights;
use springfit::clock::Progress;
use springfit::scene::{self, Source};
use springfit::springs::affine::AffineStiffness;
use springfit::springs::solver::{Settings, SpringOperator};
use springfit::springs::grouping;
use springfit::study::{self, body, loads, network};

const BODIES: [(&str, &str, bool); 6] = [("square", "y-", false), ("circle", "y-", false), ("ellipse", "y-", false), ("cube", "z-", true), ("torus", "y-", true), ("spheroid", "z-", true)];

fn env<T: std::str::FromStr>(key: &str, default: T) -> T {
    std::env::var(key).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let detail = env("DETAIL", 0) > 0;
    let most = env("MOST", 32usize);
    for (name, face, solid) in BODIES {
        if !args.is_empty() && !args.iter().any(|a| a == name) { continue; }
        let last = if solid { "uniform_z" } else { "radial" };
        let cases = ["source", last, "torsion", "random_smooth", "uniform_x", "uniform_y", "bending", "point"];
        let mut text = format!("name = \"{name}\"\n[geometry]\nshape = \"{name}\"\n[material]\nyoung = 15e3\npoisson = 0.3333333333333333\n[support]\nfaces = [\"{face}\"]\n");
        for case in cases {
            text += &format!("[[load]]\nname = \"{case}\"\nfile = \"data/loads/six_bodies.json\"\nbody = \"{name}\"\ncase = \"{case}\"\nmax_displacement = 1.0\n");
        }
        let more = env("MORE", 0usize);
        for seed in 0..more {
            text += &format!("[[load]]\nname = \"r{seed}\"\nrandom_smooth = {{ seed = {} }}\nmax_displacement = 1.0\n", seed + 1);
        }
        let scene = scene::parse(&Source { name: name.into(), text }).map_err(|e| e.error).unwrap();
        let progress = Progress::default();
        let body = body::build(&scene).unwrap();
        let scene = body.resolved.clone();
        let mut loads = loads::build(&scene, &body).unwrap();
        let mut reference = study::solve_reference(&body, &loads, &progress).unwrap();
        loads::scale(&scene, &mut loads, &mut reference);
        let lattice = network::build(&scene, &body).unwrap();
        let net = &lattice.network;
        let factor: Vec<f64> = net.springs.iter().map(|s| 1.0 / s.length.powi(2)).collect();
        let coefficients: Vec<f64> = lattice.coefficients.iter().zip(&factor).map(|(c, f)| c * f).collect();
        let upper: Vec<f64> = lattice.spring_bounds.iter().zip(&factor).map(|(b, f)| b / f).collect();
        let each = (grouping::find("each").unwrap().group)(net, 0.0).unwrap();
        let kinds = (grouping::find("kind").unwrap().group)(net, 0.0).unwrap();
        let mut start = vec![vec![]; kinds.groups.len()];
        for (s, &g) in kinds.group_of.iter().enumerate() { start[g as usize].push(s as u32); }
        let symbolic = lattice.symbolic.clone().unwrap();
        let operator = SpringOperator::Assembled { stiffness: AffineStiffness::new(net, &each, &coefficients, &body.dofs, &symbolic), symbolic: Arc::clone(&symbolic) };
        let grid = body.grid();
        let g = grid.unwrap();
        let boundary: Vec<u32> = (0..g.len()).filter(|&n| { let i = g.index(n); (0..g.dimension()).any(|a| i[a] == 0 || i[a] + 1 == g.shape()[a]) }).map(|n| n as u32).collect();
        let held: Vec<u32> = (0..body.dofs.nodes()).filter(|&n| body.dofs.free(n).iter().any(|&d| d == geometry::dofs::FIXED)).map(|n| n as u32).collect();
        let site = features::Site { network: net, grid: Some(g), boundary: &boundary, held: &held };
        let table = features::table(&site);
        let all: Vec<usize> = (0..loads.len()).collect();
        let n = body.dofs.len();
        for (mode, fit) in [("c0", vec![0]), ("F", { let mut f = vec![0, 1, 2, 3]; f.extend(8..8 + more); f })] {
            if env("MODE", String::new()) != "" && env("MODE", String::new()) != mode { continue; }
            let forces: Vec<f64> = fit.iter().flat_map(|&c| loads[c].load.forces.iter().copied()).collect();
            let target: Vec<f64> = fit.iter().flat_map(|&c| reference.cases[c].displacement.iter().copied()).collect();
            let largest: Vec<f64> = fit.iter().map(|&c| reference.cases[c].u_max).collect();
            let w = weights(&largest, body.dofs.masters().count());
            let ground = Ground { operator: &operator, forces: &forces, reference: &target, weights: &w, upper: &upper, features: &table };
            let off = env("OFF", String::new());
            let off: Vec<&str> = off.split(',').collect();
            let tuning = Tuning { probes: env("PROBES", 32), shortlist: env("SHORT", 96), trials: env("TRIALS", 2), budget: env("BUDGET", 3), tries: env("TRIES", 3), reach: env("REACH", 1.0), together: env("TOGETHER", 16), fraction: env("FRACTION", 0.125), trials_many: env("TRIALS_MANY", 2), thresholds: env("THRESH", 32), smallest: env("SMALL", 1), damping: env("DAMP", 1e-2), features: features::FEATURES.iter().map(|f| !off.contains(&f.name)).collect(), per_feature: env("PERF", 1) > 0, tolerance: env("TOL", 1e-3), starts: env("STARTS", 3), swaps: 0 };
            let steps = ladder::climb(ground, &Settings::DIRECT, start.clone(), most, &tuning, &progress).unwrap();
            let all_forces: Vec<f64> = all.iter().flat_map(|&c| loads[c].load.forces.iter().copied()).collect();
            for step in &steps {
                let shown = detail || [8, 16, 32, 64].contains(&step.groups) || step.groups == steps.last().unwrap().groups;
                if !shown { continue; }
                let mut values = vec![0.0; net.springs.len()];
                for (g, p) in step.members.iter().zip(&step.phi) { g.iter().for_each(|&s| values[s as usize] = *p); }
                let mut solver = springfit::springs::solver::SpringSolver::new(&operator, &Settings::DIRECT);
                solver.set(&values).unwrap();
                let mut u = vec![0.0; all_forces.len()];
                solver.solve(&all_forces, &mut u, 1e-10).unwrap();
                let es: Vec<f64> = (0..8).map(|c| errors::errors(&body.dofs, &reference.cases[c].displacement, &u[c * n..(c + 1) * n]).e_rms).collect();
                let h = (es[4..8].iter().map(|e| e * e).sum::<f64>() / 4.0).sqrt();
                let zeros = step.phi.iter().filter(|p| **p == 0.0).count();
                let tops = step.members.iter().zip(&step.phi).filter(|(g, p)| **p >= (1.0 - 1e-9) * g.iter().fold(0.0, |a: f64, &s| a.max(upper[s as usize]))).count();
                println!("{name:9} {mode:3} {:3} groups fit {:8.4} H {:8.4}  [{}] refac {:4} solves {:6} cpu {:.2} zero {zeros} top {tops} {}", step.groups, step.error, h, es[4..8].iter().map(|e| format!("{e:.2}")).collect::<Vec<_>>().join(" "), step.counts.refactorisations, step.counts.solves, step.seconds, step.words);
            }
        }
    }
}
