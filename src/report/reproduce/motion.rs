//! Experiments 4.II and 5.V of the thesis: networks that swing with several dampings, theirs beside ours.
//!
//! For every alpha the limit of leapfrog is found and proven, and then tried: the network, linear about its rest, is pushed and
//! released with 0.999 and 1.001 of the limit and must swing on at the one and grow at the other. Springs with their
//! forces at any stretch and turn move with the step of the thesis.
//!
//! The figures with the forces of experiment II are lost: ours is told in the row. Its thresholds do not follow from (4.18)
//! with the left edge held (alpha 5 is stable where 40 is printed).

use std::fmt::Write;

use nalgebra_sparse::CsrMatrix;
use serde::Serialize;

use crate::calibration::errors::global_strain;
use crate::clock::Progress;
use crate::dynamics::external::{External, History, Part};
use crate::dynamics::integrator::{self, Integrator};
use crate::dynamics::model::Model;
use crate::dynamics::motion::{self, Motion, Schedule};
use crate::dynamics::springs::{Coefficients, SpringModel};
use crate::dynamics::stability::{self, Limit, Linearised};
use crate::dynamics::stepper::{Settings, Stepper};
use crate::error::{Error, Result};
use crate::export::motion::{Recorded, strains};
use crate::geometry::dofs::DofMap;
use crate::geometry::grid::Grid;
use crate::geometry::selection::face_nodes;
use crate::readable::significant;
use crate::scene::{self, Source};
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::ordering::minimum_degree;
use crate::springs::network::{Kind, Network};
use crate::springs::{damping, topology};
use crate::study;

use super::words;

/// Steps that a network is given to grow, and by how much it must, to be called unstable.
const STEPS: u64 = 40_000;
const GROWN: f64 = 1e3;

/// Time that is shown, s, and its records.
const SHOWN: f64 = 4.0;
const RECORDS: u64 = 200;

/// What the thesis prints for a body.
struct Experiment {
    id: &'static str,
    body: &'static str,
    step: f64,
    alphas: [f64; 4],
    unstable_below: f64,
    load_until: f64,
    subject: fn(&Progress) -> Result<Subject>,
}

const EXPERIMENTS: &[Experiment] = &[
    Experiment {
        id: "4.II",
        body: "square membrane 5x5",
        step: 1.0 / 60.0,
        alphas: [40.0, 60.0, 80.0, 100.0],
        unstable_below: 40.0,
        load_until: 1.0 / 30.0,
        subject: |_| membrane(),
    },
    Experiment {
        id: "5.V",
        body: "circle",
        step: 1.0 / 240.0,
        alphas: [200.0, 800.0, 1600.0, 3200.0],
        unstable_below: 200.0,
        load_until: 1.0 / 30.0,
        subject: |progress| calibrated("circle", "y-", "[600.0, 100.0]", 0.01, progress),
    },
    Experiment {
        id: "5.V",
        body: "spheroid",
        step: 1.0 / 120.0,
        alphas: [50.0, 100.0, 200.0, 800.0],
        unstable_below: 50.0,
        load_until: 1.0 / 30.0,
        subject: |progress| calibrated("spheroid", "z-", "[100.0, -50.0, 50.0]", 0.6, progress),
    },
];

/// A network ready to move.
struct Subject {
    network: Network,
    dofs: DofMap,
    masses: Vec<f64>,
    stiffness: Vec<f64>,
    forces: Vec<f64>,
}

/// One alpha of one body: theirs beside ours. Times in s, alpha in s, strain in percent.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// The experiment.
    pub table: &'static str,
    /// The body.
    pub body: &'static str,
    /// alpha of (4.18).
    pub alpha: f64,
    /// The step of the thesis, and the alpha below which it calls it unstable.
    pub step: f64,
    /// Their threshold at that step.
    pub their_smallest_alpha: f64,
    /// Ours.
    pub smallest_alpha: Option<f64>,
    /// The limit of leapfrog with this alpha.
    pub limit: f64,
    /// The relative margin within which it is proven.
    pub proven_within: Option<f64>,
    /// Largest displacement with 0.999 and 1.001 of the limit, relative to the push; none when it grew without bound.
    pub growth: [Option<f64>; 2],
    /// Largest and last global strain (4.17) with their step; none when our limit refuses it.
    pub strain: Option<[f64; 2]>,
    /// Global strain of the linear springs under the force of the push at rest.
    pub strain_at_rest: f64,
    /// The motion with their step; its course is in the plots.
    #[serde(skip)]
    pub motion: Option<Motion>,
}

/// The experiments that can be reproduced.
pub fn known() -> Vec<&'static str> {
    let mut ids: Vec<&str> = EXPERIMENTS.iter().map(|experiment| experiment.id).collect();
    ids.dedup();
    ids
}

/// Reproduces the experiments with these numbers.
///
/// # Errors
/// Whatever a calibration or a motion can fail with.
pub fn run(ids: &[String], progress: &Progress) -> Result<Vec<Comparison>> {
    let mut rows = Vec::new();
    for experiment in EXPERIMENTS.iter().filter(|experiment| ids.iter().any(|id| id == experiment.id)) {
        let subject = (experiment.subject)(progress)?;
        let strain_at_rest = subject.strain_at_rest()?;
        for alpha in experiment.alphas {
            progress.check()?;
            rows.push(Comparison { strain_at_rest, ..compare(experiment, &subject, alpha, progress)? });
        }
    }
    Ok(rows)
}

/// Experiment II: nodes of 2 kg on [0, 2]^2, 500 N/m along edges and 400 N/m across, the left edge held; the force is ours.
fn membrane() -> Result<Subject> {
    let grid = Grid::new(&[5, 5]);
    let place = |node: usize| grid.index(node).map(|i| 0.5 * i as f64);
    let positions: Vec<[f64; 3]> = (0..grid.len()).map(place).collect();
    let mut fixed = vec![[false; 3]; grid.len()];
    face_nodes(&grid, "x-")?.into_iter().for_each(|node| fixed[node as usize] = [true; 3]);
    let dofs = DofMap::untied(2, &fixed);
    let network = (topology::find("grid").expect("the table has it").connect)(&grid, &positions, &dofs);
    let stiffness = network.springs.iter().map(|s| if s.kind == Kind::Edge { 500.0 } else { 400.0 }).collect();
    let forces = (0..dofs.len()).map(|dof| [10.0, -10.0][dofs.owner(dof).1]).collect();
    Ok(Subject { network, dofs, masses: vec![2.0; grid.len()], stiffness, forces })
}

/// A body of chapter 5, calibrated under its load, with the step force of its load.
fn calibrated(body: &str, face: &str, force: &str, gamma: f64, progress: &Progress) -> Result<Subject> {
    let text = format!(
        "[geometry]\nshape = \"{body}\"\n[material]\nyoung = 15e3\npoisson = 0.3333333333333333\ndensity = 1143.0\n\
         [support]\nfaces = [\"{face}\"]\n[[load]]\nforce_per_node = {force}\n[springs]\nweighting = \"springs\"\n\
         [calibration]\ngamma = {gamma:?}\n[dynamics]\n"
    );
    let source = Source { name: format!("{body} in motion"), text };
    let scene = scene::parse(&source).map_err(|located| located.error)?;
    let study = study::run(&scene, progress)?;
    let masses = study::motion::masses(&study.scene, &study.body)?;
    let forces = study.loads[0].load.forces.clone();
    let (network, dofs) = (study.lattice.network, study.body.dofs);
    Ok(Subject { network, dofs, masses, stiffness: study.calibration.stiffness, forces })
}

impl Subject {
    /// The springs with this alpha.
    fn springs(&self, alpha: f64) -> SpringModel<'_> {
        let damping = damping::coefficients(&self.network, &self.stiffness, &self.masses, alpha);
        let of = Coefficients { stiffness: &self.stiffness, damping: Some(&damping) };
        SpringModel::new(&self.network, &self.dofs, of, &self.masses)
    }

    /// Global strain of the linear springs under the step force at rest, percent.
    fn strain_at_rest(&self) -> Result<f64> {
        let rest = vec![0.0; self.dofs.len()];
        let Linearised { pattern, stiffness, .. } = Linearised::at(&mut self.springs(1.0), &rest, None);
        let matrix = CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), stiffness);
        let mut factor = Factor::new(Symbolic::analyse(&pattern, minimum_degree(&pattern)?)?);
        factor.load(&matrix.expect("one value for each entry of the pattern"));
        factor.refactor()?;
        let mut u = rest;
        factor.solve(&self.forces, &mut u)?;
        Ok(global_strain(&self.network, &self.dofs.expand(&u)))
    }

    /// The step force.
    fn push(&self, until: f64) -> External {
        External { parts: vec![Part { forces: self.forces.clone(), history: History::Until(until) }] }
    }
}

fn leapfrog() -> &'static Integrator {
    integrator::find("leapfrog").expect("the table has it")
}

fn compare(experiment: &Experiment, subject: &Subject, alpha: f64, progress: &Progress) -> Result<Comparison> {
    let rest = vec![0.0; subject.dofs.len()];
    let at_one = Linearised::at(&mut subject.springs(1.0), &rest, None);
    let limit = stability::limit(&at_one.with_damping_over(Some(alpha)))?;
    let growth = [0.999, 1.001].map(|part| growth(subject, alpha, part * limit.damped));
    let [below, above] = growth;
    let refused = experiment.step > limit.safe(limit.damped);
    let motion = if refused { None } else { Some(course(experiment, subject, alpha, progress)?) };
    let strain = motion.as_ref().map(|motion| {
        let largest = motion.strain.iter().copied().fold(0.0, f64::max);
        [largest, motion.strain.last().copied().unwrap_or_default()]
    });
    let Limit { damped, proven, .. } = limit;
    Ok(Comparison {
        table: experiment.id,
        body: experiment.body,
        alpha,
        step: experiment.step,
        their_smallest_alpha: experiment.unstable_below,
        smallest_alpha: stability::smallest_alpha(&at_one, &limit, experiment.step),
        limit: damped,
        proven_within: proven,
        growth: [below?, above?],
        strain,
        strain_at_rest: 0.0,
        motion,
    })
}

/// The springs with the step of the thesis.
fn course(experiment: &Experiment, subject: &Subject, alpha: f64, progress: &Progress) -> Result<Motion> {
    let (mut model, external) = (subject.springs(alpha), subject.push(experiment.load_until));
    let rest = vec![0.0; subject.dofs.len()];
    let settings = Settings::with_step(experiment.step);
    let mut stepper = Stepper::new(&mut model, &external, leapfrog(), settings, [&rest, &rest])?;
    let steps = (SHOWN / experiment.step).round() as u64;
    let schedule = Schedule { steps, every: (steps / RECORDS).max(1) };
    let strain = |u: &[f64]| global_strain(&subject.network, &subject.dofs.expand(u));
    motion::run(&mut stepper, schedule, &strain, progress)
}

/// The largest displacement of the linear network pushed for a few steps, relative to that after the push; none when it
/// grew without bound.
fn growth(subject: &Subject, alpha: f64, step: f64) -> Result<Option<f64>> {
    let mut model = subject.springs(alpha).linear();
    let external = subject.push(8.0 * step);
    let rest = vec![0.0; model.unknowns()];
    let settings = Settings::with_step(step);
    let mut stepper = Stepper::new(&mut model, &external, leapfrog(), settings, [&rest, &rest])?;
    let largest = |stepper: &Stepper| stepper.state().displacement.iter().fold(0.0_f64, |a, u| a.max(u.abs()));
    // undamped slow swings take as long as they take: what a push gives in time is 1/omega, not the growth of one mode
    let mut swing = 0.0_f64;
    for number in 0..STEPS {
        match stepper.advance() {
            Err(Error::BlowUp { .. }) => return Ok(None),
            outcome => outcome?,
        }
        let now = largest(&stepper);
        if number < STEPS / 8 {
            swing = swing.max(now);
        } else if now > GROWN * swing {
            return Ok(None);
        }
    }
    Ok(Some(largest(&stepper) / swing))
}

/// The plots of the global strain over time, one for each body with a curve for each alpha (figures 4.3, 4.5 and 5.7): file
/// names and texts.
pub fn plots(rows: &[Comparison]) -> Vec<(String, String)> {
    let bodies = rows.chunk_by(|a, b| (a.table, a.body) == (b.table, b.body));
    let plot = |rows: &[Comparison]| {
        let recorded = rows.iter().filter_map(|row| {
            Some(Recorded { alpha: Some(row.alpha), motion: row.motion.as_ref()?, dofs: None, of_body: false })
        });
        let recorded: Vec<Recorded> = recorded.collect();
        let name = format!("experiment {}, {}", rows[0].table, rows[0].body);
        (format!("{}.svg", name.replace([' ', ','], "_").replace("__", "_")), strains(&name, &recorded))
    };
    bodies.map(plot).collect()
}

/// The comparisons as a table for people.
pub fn table(rows: &[Comparison]) -> String {
    let mut text = String::new();
    let mut last = ("", "");
    for row in rows {
        if (row.table, row.body) != last {
            last = (row.table, row.body);
            let _ = writeln!(
                text,
                "\nExperiment {}: {}, step {} s: {}",
                row.table,
                row.body,
                significant(row.step, 4),
                words::threshold(row.their_smallest_alpha, row.smallest_alpha)
            );
            let of_body = |other: &&Comparison| (other.table, other.body) == last;
            let pushed: Vec<f64> = rows.iter().filter(of_body).filter_map(|row| Some(row.strain?[0])).collect();
            let _ = writeln!(text, "{}", words::push(&pushed, row.strain_at_rest));
            let _ = writeln!(
                text,
                "{:>8} {:>13} {:>9} {:>15} {:>15} {:>28}",
                "alpha", "our limit s", "proven", "at 0.999", "at 1.001", "global strain %, last"
            );
        }
        let swung = |growth: Option<f64>| growth.map_or("grows".into(), |g| format!("swings {}", significant(g, 2)));
        let _ = writeln!(
            text,
            "{:>8} {:>13.6e} {:>9} {:>15} {:>15} {:>28}",
            row.alpha,
            row.limit,
            row.proven_within.map_or("no".into(), |margin| format!("{margin:.0e}")),
            swung(row.growth[0]),
            swung(row.growth[1]),
            row.strain.map_or("step refused".into(), |strains| strains.map(|strain| significant(strain, 3)).join(", ")),
        );
    }
    text
}
