//! What a person reads after `run` and `check`: a few lines and the table of the sweep.

use std::fmt::Write;

use crate::calibration::errors::Errors;
use crate::calibration::objectives::matrix::Reading;
use crate::memory;
use crate::readable::{numbered, significant};
use crate::report::{budget, converged, ladder, motion};
use crate::study::Study;
use crate::study::generalisation::{Case, Generalisation};
use crate::study::plan::{Plan, Sizes};

/// Fraction of an upper bound from which a stiffness is at it: the last bits of a fit are rounding.
const AT_BOUND: f64 = 1.0 - 1e-9;

/// Most characters of the name of a group, with its number; result.json and springs.json have it whole.
const NAME: usize = 36;

/// A paragraph, line by line.
type Line<'a> = dyn FnMut(String) + 'a;

/// The summary of a run.
pub fn run(study: &Study) -> String {
    let mut text = String::new();
    let mut line = |words: String| {
        let _ = writeln!(text, "{words}");
    };
    for part in [head, sweep, groups, errors, asked, work] {
        part(study, &mut line);
    }
    text
}

/// Sizes, mesh and reference.
fn head(study: &Study, line: &mut Line) {
    let found = &study.calibration;
    line(format!(
        "{}: {}",
        study.scene.name,
        sizes(&Sizes::of(&study.body, &study.lattice, found.grouping.groups.len()))
    ));
    if let Some(quality) = &study.mesh {
        line(quality.summary());
    }
    line(format!(
        "reference: {}, measure {}, u_max {} m, backward error {:.1e}, condition {:.0e}, {} s",
        study.body.method.name,
        significant(study.reference.measure, 7),
        significant(study.reference.cases.iter().fold(0.0, |a: f64, c| a.max(c.u_max)), 7),
        study.reference.accuracy.backward_error,
        study.reference.accuracy.condition,
        significant(study.reference.seconds, 3)
    ));
}

/// The table of the sweep, and the ladder.
fn sweep(study: &Study, line: &mut Line) {
    let found = &study.calibration;
    line(format!(
        "\n{:>8} {:>7} {:>10} {:>10} {:>16} {:>9}  stop",
        "gamma", "groups", "e_rms %", "e_max %", "refactorisations", "seconds"
    ));
    for (i, row) in found.sweep.iter().enumerate() {
        let mark = if i == found.best { " <- best" } else { "" };
        let gamma = row.gamma.map_or("-".to_owned(), |gamma| format!("{gamma}"));
        let work = match row.solved_by == i {
            true => {
                let seconds = significant(row.seconds, 3);
                format!("{:>16} {seconds:>9}  {}", row.outcome.counts.refactorisations, row.outcome.stop.name())
            }
            false => {
                format!("{:>16} {:>9}  same groups as {}", "", "", found.sweep[row.solved_by].gamma.unwrap_or(0.0))
            }
        };
        line(format!(
            "{gamma:>8} {:>7} {:>10} {:>10} {work}{mark}",
            row.groups,
            significant(row.errors.e_rms, 5),
            significant(row.errors.e_max, 5)
        ));
    }
    if !found.ladder.is_empty() {
        line(format!("\n{}", ladder::table(&found.ladder).trim_end()));
    }
}

/// Whether the stiffness was searched: it is not where a formula, the scene or a file gives it.
fn is_fitted(study: &Study) -> bool {
    study.scene.calibration.optimiser().is_some()
}

/// The groups that were found.
fn groups(study: &Study, line: &mut Line) {
    let found = &study.calibration;
    line(format!("\n{:<NAME$} {:>8} {:>10} {:>14} {:>14}", "group", "springs", "length m", "stiffness", "upper bound"));
    let shown = 32;
    for (number, group) in found.grouping.groups.iter().enumerate().take(shown) {
        let (phi, upper) = (&found.phi[number], &found.upper[number]);
        let at = match () {
            () if !is_fitted(study) => "",
            () if !found.determined[number] => "  not determined by the fit: stated",
            () if *phi == 0.0 => "  at its lower bound: these springs are not needed",
            () if *phi >= AT_BOUND * upper => "  at its upper bound",
            () => "",
        };
        line(format!(
            "{:<NAME$} {:>8} {:>10} {:>14} {:>14}{at}",
            numbered(number, &group.name, NAME),
            group.springs,
            significant(group.length, 4),
            significant(*phi, 7),
            significant(*upper, 7)
        ));
    }
    if found.grouping.groups.len() > shown {
        line(format!("... and {} more (result.json has all)", found.grouping.groups.len() - shown));
    }
}

/// The error of every load case, and how far the network can be trusted.
fn errors(study: &Study, line: &mut Line) {
    let found = &study.calibration;
    line(String::new());
    for (case, Errors { e_rms, e_max }) in study.loads.iter().zip(&found.errors) {
        let role = match is_fitted(study) {
            true if case.fit => "fitted",
            true => "held out",
            false => "not fitted",
        };
        let [e_rms, e_max] = [e_rms, e_max].map(|error| significant(*error, 5));
        line(format!("{role} {}: e_rms {e_rms} %, e_max {e_max} %", case.name));
    }
    if let Some(words) = objective(study) {
        line(words);
    }
    if let Some(sure) = &found.accuracy {
        line(format!(
            "springs: backward error {:.1e}, condition {:.0e}, displacements to {:.0e} or better",
            sure.backward_error, sure.condition, sure.forward_error
        ));
    }
    other_loads(study, line);
    let [continuum, springs] = found.largest_strain().map(|strain| significant(strain, 4));
    line(format!("global strain: continuum {continuum} %, springs {springs} %"));
}

/// What the network does under loads that are not in the scene.
fn other_loads(study: &Study, line: &mut Line) {
    let Generalisation::Measured(measured) = &study.generalisation else { return };
    let (soft, stiff) = (&measured.softest, &measured.stiffest);
    let [too_stiff, too_soft] = [stiff, soft].map(|end| significant(end.compliance_ratio, 3));
    line(format!(
        "smooth loads of degree 2: {too_stiff} (too stiff) to {too_soft} (too soft) times the work of the continuum; stiffest: {}; \
         softest: {}",
        stiff.load, soft.load
    ));
    if !measured.held_out.is_empty() {
        let of = |case: &Case| format!("{} {}", case.load, significant(case.e_rms, 3));
        let cases: Vec<String> = measured.held_out.iter().map(of).collect();
        line(format!("generated held-out loads, e_rms %: {}", cases.join(", ")));
    }
}

/// What the scene asked for beside the calibration.
fn asked(study: &Study, line: &mut Line) {
    if let Some(outcome) = &study.budget {
        line(format!("\n{}", budget::table(&outcome.front, Some(outcome.chosen))));
    }
    if let Some(table) = converged::summary(study) {
        line(table);
    }
    if let Some(dynamics) = &study.dynamics {
        line(motion::summary(dynamics).trim_end().to_owned());
    }
}

/// What it took.
fn work(study: &Study, line: &mut Line) {
    let total: f64 = study.seconds.iter().map(|(_, seconds)| seconds).sum();
    let counts = &study.calibration.counts;
    let choice = &study.lattice.choice;
    line(format!("solver: {}: {}", choice.path.name(), choice.reason));
    if counts.fallbacks > 0 {
        line(format!("single precision failed {} times, double precision took over", counts.fallbacks));
    }
    let memory =
        memory::peak_bytes().map_or(String::new(), |bytes| format!(", peak memory {:.0} MB", bytes as f64 / 1e6));
    line(format!(
        "{} s, {} refactorisations, {} solves, {} iterations{memory}",
        significant(total, 3),
        counts.refactorisations,
        counts.solves,
        counts.cg_iterations
    ));
}

/// The error that was made small, where it is not that of the displacements.
fn objective(study: &Study) -> Option<String> {
    let found = &study.calibration;
    let error = significant(found.sweep[found.best].outcome.error, 5);
    match study.scene.calibration.objective.as_str() {
        "matrix" => {
            let compared = match study.scene.calibration.matrix.clone().unwrap_or_default().reading {
                Reading::Full => "stiffness matrices",
                Reading::OffDiagonal => "stiffness matrices between different nodes",
            };
            let [outside, norm] =
                found.matrices.map_or([0.0; 2], |matrices| [matrices.outside_pattern, matrices.compared_frobenius]);
            Some(format!(
                "{compared}: {error} % apart where there are springs; {} % of the continuum's is elsewhere (of a Frobenius norm of \
                 {} N/m)",
                significant(outside, 5),
                significant(norm, 5)
            ))
        }
        "acceleration" => Some(format!("accelerations: {error} % apart")),
        _ => None,
    }
}

/// The summary of a plan.
pub fn check(plan: &Plan) -> String {
    let mut text = format!("{}: {}\n", plan.scene.name, sizes(&plan.sizes));
    for step in &plan.steps {
        let _ = writeln!(text, "  {step}");
    }
    let rows: Vec<String> = plan
        .sweep
        .iter()
        .map(|(gamma, groups)| gamma.map_or(format!("{groups} groups"), |gamma| format!("{gamma}: {groups}")))
        .collect();
    let _ = writeln!(text, "  groups by gamma: {}", rows.join(", "));
    if let Some(step) = plan.safe_step {
        let _ = writeln!(text, "  a step of {step:.4e} s is safe for small motion whatever the calibration finds");
    }
    let [reference, springs] = plan.factor_entries;
    let _ = writeln!(text, "  factor entries: reference {reference}, springs {springs}");
    let [memory, seconds] = [plan.memory_bytes as f64 / 1e6, plan.seconds].map(|estimate| significant(estimate, 3));
    let _ = writeln!(text, "  memory about {memory} MB, time about {seconds} s");
    text
}

fn sizes(sizes: &Sizes) -> String {
    let zero = match sizes.zero_length_springs {
        0 => String::new(),
        count => format!(" ({count} of zero length left out)"),
    };
    format!(
        "{} control points, {} free dofs, {} elements, {} springs{zero}, {} groups",
        sizes.control_points, sizes.free_dofs, sizes.elements, sizes.springs, sizes.groups
    )
}
