//! result.json: one object that holds all numbers of a run (schema "springfit-result/1").
//!
//! Everything but seconds (on the wall and of the processor), peak memory and the number of threads is the same for every run of the same scene, seed and
//! binary. Displacements and springs are not in it: they are in the VTU files and in springs.json.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::calibration::errors::Errors;
use crate::clock;
use crate::memory;
use crate::reference::Path;
use crate::report::budget::{self, Budget};
use crate::report::converged::{self, Converged};
use crate::report::ladder;
use crate::report::motion::Dynamics;
use crate::scene::Scene;
use crate::study::generalisation::Generalisation;
use crate::study::mesh_quality::MeshQuality;
use crate::study::plan::Sizes;
use crate::study::{Study, fit};

/// The document. Stiffness of groups in the unit of the profile (N/m for "constant"), lengths in m, errors in percent.
#[derive(Debug, Serialize)]
pub struct Document<'a> {
    schema: &'static str,
    version: &'static str,
    seed: u64,
    threads: usize,
    scene: &'a Scene,
    sizes: Sizes,
    /// How good the mesh is; absent for a patch.
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<&'a MeshQuality>,
    loads: Vec<LoadCase<'a>>,
    reference: Reference<'a>,
    calibration: Calibration<'a>,
    #[serde(skip_serializing_if = "Option::is_none")]
    converged: Option<Converged<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<Budget<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dynamics: Option<Dynamics>,
    warnings: &'a [String],
    seconds: BTreeMap<&'static str, f64>,
    processor_seconds: Option<f64>,
    peak_memory_bytes: Option<u64>,
}

#[derive(Debug, Serialize)]
struct Reference<'a> {
    method: &'static str,
    path: &'static str,
    iterations: u64,
    /// The largest of all load cases.
    compliance: f64,
    /// The largest of all load cases.
    u_max: f64,
    /// The largest of all load cases.
    u_norm2: f64,
    cases: Vec<Answer<'a>>,
    stiffness_frobenius: f64,
    measure: f64,
    backward_error: f64,
    /// Estimates: kappa_1 of K, and a bound of the relative error of the displacements.
    condition: f64,
    forward_error: f64,
    /// Equilibrium under large displacements: Newton's iterations, factorisations, forces out of balance.
    #[serde(skip_serializing_if = "Option::is_none")]
    large: Option<Large>,
    seconds: f64,
}

/// The answer of the continuum to one load case: f.u in J, max |u_i| and sqrt(sum |u_i|^2) over the nodes in m.
#[derive(Debug, Serialize)]
struct Answer<'a> {
    load: &'a str,
    compliance: f64,
    u_max: f64,
    u_norm2: f64,
}

/// A load case: its force on the free nodes, what the supports take at once, and all they hold, N.
#[derive(Debug, Serialize)]
struct LoadCase<'a> {
    name: &'a str,
    fit: bool,
    force: [f64; 3],
    held_force: [f64; 3],
    reaction: [f64; 3],
}

/// How sure the displacements of the calibrated network are: componentwise backward error, kappa_1 of K(phi), and a bound
/// of the relative error of the displacements, the last two estimated.
#[derive(Debug, Serialize)]
struct Accuracy {
    backward_error: f64,
    condition: f64,
    forward_error: f64,
}

#[derive(Debug, Serialize)]
struct Large {
    load_steps: usize,
    newton_iterations: usize,
    factorisations: usize,
    residual: f64,
    /// Smallest det F of a cell, for each load case.
    smallest_determinant: Vec<f64>,
}

#[derive(Debug, Serialize)]
struct Calibration<'a> {
    objective: &'a str,
    /// The optimiser, or the formula; "none" for a stiffness that is known.
    optimiser: &'a str,
    gamma: Option<f64>,
    e_rms: f64,
    e_max: f64,
    /// What the optimiser made small, percent: e_rms again for the objective displacement; none where nothing is fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    objective_error: Option<f64>,
    /// Frobenius norm of the blocks of K_ref that the reading compares, N/m; only for the objective matrix, of which
    /// `objective_error` and `outside_pattern` are percentages then.
    #[serde(skip_serializing_if = "Option::is_none")]
    compared_frobenius: Option<f64>,
    /// The part of these blocks that no spring answers for, percent; only for the objective matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    outside_pattern: Option<f64>,
    /// The largest of all load cases.
    global_strain: GlobalStrain,
    generalisation: &'a Generalisation,
    stop: &'static str,
    groups: Vec<Group<'a>>,
    fitted: Vec<Case<'a>>,
    held_out: Vec<Case<'a>>,
    sweep: Vec<Row<'a>>,
    counts: Counts,
    solver: Solver<'a>,
    /// Absent under large displacements.
    #[serde(skip_serializing_if = "Option::is_none")]
    accuracy: Option<Accuracy>,
    trace: Vec<(f64, u64, f64)>,
    /// The networks on the way, where the groups adapt.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    ladder: Vec<ladder::Row<'a>>,
}

/// Of the continuum and of the springs, percent.
#[derive(Debug, Serialize)]
struct GlobalStrain {
    reference: f64,
    springs: f64,
}

impl GlobalStrain {
    fn of([reference, springs]: [f64; 2]) -> Self {
        Self { reference, springs }
    }
}

#[derive(Debug, Serialize)]
struct Group<'a> {
    name: &'a str,
    springs: usize,
    length: f64,
    stiffness: f64,
    lower: f64,
    upper: f64,
    /// False for a group that nothing in the fit depends on: its stiffness is stated, not fitted.
    determined: bool,
}

#[derive(Debug, Serialize)]
struct Case<'a> {
    load: &'a str,
    e_rms: f64,
    e_max: f64,
    global_strain: GlobalStrain,
}

#[derive(Debug, Serialize)]
struct Row<'a> {
    gamma: Option<f64>,
    groups: usize,
    e_rms: f64,
    e_max: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    objective_error: Option<f64>,
    evaluations: u64,
    refactorisations: u64,
    solves: u64,
    solver: Solver<'a>,
    seconds: f64,
    stop: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    same_groups_as: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Counts {
    evaluations: u64,
    refactorisations: u64,
    solves: u64,
    surrogate_evaluations: u64,
    rejected: u64,
}

/// How the springs of a row were solved during its search: the path, why, and how often which.
#[derive(Debug, Serialize)]
struct Solver<'a> {
    path: &'static str,
    reason: &'a str,
    tolerance: f64,
    refactorisations: u64,
    single_refactorisations: u64,
    stale_solves: u64,
    cg_iterations: u64,
    fallbacks: u64,
    /// Relative difference of the optimiser's error and the error that the direct solve confirms; none where the optimiser
    /// made another error small.
    #[serde(skip_serializing_if = "Option::is_none")]
    e_rms_difference: Option<f64>,
}

impl<'a> Document<'a> {
    /// The document of a study.
    pub fn of(study: &'a Study) -> Self {
        let found = &study.calibration;
        Self {
            schema: "springfit-result/1",
            version: env!("CARGO_PKG_VERSION"),
            seed: study.scene.calibration.seed,
            threads: rayon::current_num_threads(),
            scene: &study.scene,
            sizes: Sizes::of(&study.body, &study.lattice, found.grouping.groups.len()),
            mesh: study.mesh.as_ref(),
            loads: loads(study),
            reference: reference(study),
            calibration: calibration(study),
            converged: converged::document(study),
            budget: study.budget.as_ref().map(budget::document),
            dynamics: dynamics(study),
            warnings: &study.warnings,
            seconds: study.seconds.iter().copied().collect(),
            processor_seconds: clock::processor_seconds(),
            peak_memory_bytes: memory::peak_bytes(),
        }
    }

    /// The document as indented JSON with a newline at its end.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }
}

fn loads(study: &Study) -> Vec<LoadCase<'_>> {
    let loads = study.loads.iter().map(|case| LoadCase {
        name: &case.name,
        fit: case.fit,
        force: case.load.total,
        held_force: case.load.held,
        reaction: case.load.reaction(),
    });
    loads.collect()
}

fn reference(study: &Study) -> Reference<'_> {
    let answers = study.loads.iter().zip(&study.reference.cases).map(|(load, case)| Answer {
        load: &load.name,
        compliance: case.compliance,
        u_max: case.u_max,
        u_norm2: case.u_norm2,
    });
    let cases: Vec<Answer> = answers.collect();
    let largest = |value: fn(&Answer) -> f64| cases.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
    let (path, iterations) = match &study.reference.path {
        Path::Direct { .. } => ("direct", 0),
        Path::Iterative { iterations, .. } => ("iterative", iterations.iter().map(|&count| count as u64).sum()),
    };
    Reference {
        method: study.body.method.name,
        path,
        iterations,
        compliance: largest(|case| case.compliance),
        u_max: largest(|case| case.u_max),
        u_norm2: largest(|case| case.u_norm2),
        cases,
        stiffness_frobenius: study.reference.stiffness_frobenius(),
        measure: study.reference.measure,
        backward_error: study.reference.accuracy.backward_error,
        condition: study.reference.accuracy.condition,
        forward_error: study.reference.accuracy.forward_error,
        large: study.reference.large.as_ref().map(|large| Large {
            load_steps: study.scene.reference.load_steps,
            newton_iterations: large.iterations,
            factorisations: large.factorisations,
            residual: large.residual,
            smallest_determinant: large.inversions.iter().map(|inversion| inversion.least_cell).collect(),
        }),
        seconds: study.reference.seconds,
    }
}

fn calibration(study: &Study) -> Calibration<'_> {
    let found = &study.calibration;
    let best = &found.sweep[found.best];
    let given = &study.scene.calibration;
    let groups = found.grouping.groups.iter().enumerate().map(|(a, group)| Group {
        name: &group.name,
        springs: group.springs,
        length: group.length,
        stiffness: found.phi[a],
        lower: 0.0,
        upper: found.upper[a],
        determined: found.determined[a],
    });
    let cases = |fit: bool| -> Vec<Case> {
        let chosen = (0..study.loads.len()).filter(|&c| study.loads[c].fit == fit);
        let case = |c: usize| {
            let Errors { e_rms, e_max } = found.errors[c];
            Case { load: &study.loads[c].name, e_rms, e_max, global_strain: GlobalStrain::of(found.global_strain[c]) }
        };
        chosen.map(case).collect()
    };
    Calibration {
        objective: &given.objective,
        optimiser: given.source(),
        gamma: best.gamma,
        e_rms: found.fitted.e_rms,
        e_max: found.fitted.e_max,
        objective_error: objective_error(best),
        compared_frobenius: found.matrices.map(|matrices| matrices.compared_frobenius),
        outside_pattern: found.matrices.map(|matrices| matrices.outside_pattern),
        global_strain: GlobalStrain::of(found.largest_strain()),
        generalisation: &study.generalisation,
        stop: best.outcome.stop.name(),
        groups: groups.collect(),
        fitted: cases(true),
        held_out: cases(false),
        sweep: rows(study),
        counts: Counts {
            evaluations: found.counts.evaluations,
            refactorisations: found.counts.refactorisations,
            solves: found.counts.solves,
            surrogate_evaluations: found.counts.surrogate_evaluations,
            rejected: found.counts.rejected,
        },
        solver: solver(study, best),
        accuracy: found.accuracy.map(|sure| Accuracy {
            backward_error: sure.backward_error,
            condition: sure.condition,
            forward_error: sure.forward_error,
        }),
        trace: best.outcome.trace.iter().map(|p| (p.seconds, p.refactorisations, p.error)).collect(),
        ladder: ladder::rows(&found.ladder),
    }
}

/// The error that the optimiser made small; none where there was none.
fn objective_error(row: &fit::Row) -> Option<f64> {
    Some(row.outcome.error).filter(|error| error.is_finite())
}

fn solver<'a>(study: &'a Study, row: &fit::Row) -> Solver<'a> {
    let counts = &row.outcome.counts;
    Solver {
        path: study.lattice.choice.path.name(),
        reason: &study.lattice.choice.reason,
        tolerance: study.scene.solver.tolerance,
        refactorisations: counts.refactorisations,
        single_refactorisations: counts.single_refactorisations,
        stale_solves: counts.stale_solves,
        cg_iterations: counts.cg_iterations,
        fallbacks: counts.fallbacks,
        e_rms_difference: row.error_difference,
    }
}

fn rows(study: &Study) -> Vec<Row<'_>> {
    let sweep = &study.calibration.sweep;
    let row = |i: usize| {
        let row = &sweep[i];
        Row {
            gamma: row.gamma,
            groups: row.groups,
            e_rms: row.errors.e_rms,
            e_max: row.errors.e_max,
            objective_error: objective_error(row),
            evaluations: row.outcome.counts.evaluations,
            refactorisations: row.outcome.counts.refactorisations,
            solves: row.outcome.counts.solves,
            solver: solver(study, row),
            seconds: row.seconds,
            stop: row.outcome.stop.name(),
            same_groups_as: if row.solved_by == i { None } else { sweep[row.solved_by].gamma },
        }
    };
    (0..sweep.len()).map(row).collect()
}

fn dynamics(study: &Study) -> Option<Dynamics> {
    Some(Dynamics::of(study.dynamics.as_ref()?, study.scene.dynamics.as_ref()?))
}
