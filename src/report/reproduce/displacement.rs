//! Tables of chapter 5 that a displacement calibration answers.
//!
//! Every row is a scene as a user could write it: a body of chapter 5 under its load, springs
//! grouped by length with the gamma of the row. It is calibrated with both weightings, by Gauss-Newton (best of its
//! starts) and by annealing alone (Algorithm 3.1 with 5,000 evaluations, or as many as fit 60 s). Where group counts differ,
//! the sweep of (4.11-4.13) as the method states it gives ours.

use std::fmt::Write;

use serde::Serialize;

use crate::calibration::errors::Errors;
use crate::clock::{Progress, Stopwatch};
use crate::error::Result;
use crate::readable::significant;
use crate::report::reproduce::words;
use crate::report::thesis::{Experiment, TABLES};
use crate::scene::{self, Source};
use crate::study;

/// Evaluations that annealing is given.
const EVALUATIONS: usize = 5000;

/// Seconds that annealing may take in a row; fewer evaluations where 5,000 would take longer.
const SECONDS: f64 = 60.0;

/// What one calibration of a row gave.
#[derive(Debug, Clone, Serialize)]
pub struct Ours {
    /// "springs" or "cells".
    pub weighting: &'static str,
    /// Groups that gamma gives.
    pub groups: usize,
    /// Smallest and largest stiffness of a group, N/m.
    pub stiffness_range: [f64; 2],
    /// Error of Gauss-Newton, percent (rms, largest).
    pub gauss_newton: [f64; 2],
    /// Factorisations of all its starts.
    pub refactorisations: u64,
    /// Seconds of Gauss-Newton.
    pub gauss_newton_seconds: f64,
    /// Error of annealing alone, percent (rms, largest).
    pub annealing: [f64; 2],
    /// Evaluations that annealing had.
    pub evaluations: u64,
    /// Seconds of annealing.
    pub annealing_seconds: f64,
}

/// One row: theirs beside ours.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Number of the table, such as "5.3".
    pub table: &'static str,
    /// The row.
    pub experiment: Experiment,
    /// Our results, one a weighting.
    pub ours: Vec<Ours>,
    /// Why they differ, where we know.
    pub note: String,
}

/// The rows of the tables that are wanted.
///
/// # Errors
/// Whatever a run can fail with.
pub fn run(wanted: &dyn Fn(&str) -> bool, progress: &Progress) -> Result<Vec<Comparison>> {
    let chosen = TABLES.iter().filter(|table| wanted(table.id));
    let mut solved: Vec<(Experiment, Vec<Ours>)> = Vec::new();
    let mut rows = Vec::new();
    for table in chosen {
        for experiment in table.rows {
            progress.check()?;
            // the same body and gamma stands in several tables
            let known = solved.iter().find(|(other, _)| other.same_problem(experiment)).map(|(_, ours)| ours.clone());
            let ours = match known {
                Some(ours) => ours,
                None => ["springs", "cells"]
                    .map(|w| calibrate(experiment, w, progress))
                    .into_iter()
                    .collect::<Result<_>>()?,
            };
            solved.push((*experiment, ours.clone()));
            rows.push(Comparison { table: table.id, experiment: *experiment, note: note(experiment, &ours), ours });
        }
    }
    Ok(rows)
}

/// Both calibrations of one row.
fn calibrate(experiment: &Experiment, weighting: &'static str, progress: &Progress) -> Result<Ours> {
    let run = |optimiser: &str, evaluations: usize| -> Result<(study::Study, f64)> {
        let text = experiment.scene(weighting, optimiser, evaluations);
        let source = Source { name: format!("{} ({weighting})", experiment.body), text };
        let scene = scene::parse(&source).map_err(|located| located.error)?;
        let watch = Stopwatch::start();
        let study = study::run(&scene, progress)?;
        Ok((study, watch.seconds()))
    };
    let (newton, gauss_newton_seconds) = run("gauss_newton", EVALUATIONS)?;
    let (trial, trial_seconds) = run("annealing", 50)?;
    let each = trial_seconds / trial.calibration.counts.evaluations as f64;
    let evaluations = EVALUATIONS.min((SECONDS / each) as usize).max(50);
    let (annealed, annealing_seconds) = run("annealing", evaluations)?;
    let pair = |Errors { e_rms, e_max }: Errors| [e_rms, e_max];
    let found = &newton.calibration;
    Ok(Ours {
        weighting,
        groups: found.grouping.groups.len(),
        stiffness_range: [
            found.phi.iter().copied().fold(f64::INFINITY, f64::min),
            found.phi.iter().copied().fold(0.0, f64::max),
        ],
        gauss_newton: pair(found.fitted),
        refactorisations: found.counts.refactorisations,
        gauss_newton_seconds,
        annealing: pair(annealed.calibration.fitted),
        evaluations: annealed.calibration.counts.evaluations,
        annealing_seconds,
    })
}

fn note(experiment: &Experiment, ours: &[Ours]) -> String {
    let mut notes = Vec::new();
    let groups = ours.first().map_or(0, |o| o.groups);
    if let Some(theirs) = experiment.groups.filter(|theirs| *theirs != groups) {
        notes.push(format!("gamma {} gives {groups} groups by (4.11-4.13), {theirs} printed", experiment.gamma));
    }
    let names: Vec<String> = ours.iter().map(|o| format!("weighting {}", o.weighting)).collect();
    let of = |error: fn(&Ours) -> f64| -> Vec<words::Named> {
        names.iter().zip(ours).map(|(name, o)| (&name[..], error(o))).collect()
    };
    notes.push(words::displacement(experiment.errors[0], &of(|o| o.gauss_newton[0]), &of(|o| o.annealing[0])));
    notes.join("; ")
}

/// The comparisons as a table for people.
pub fn text(rows: &[Comparison]) -> String {
    let mut text = String::new();
    let mut last = "";
    for row in rows {
        if row.table != last {
            let title = TABLES.iter().find(|table| table.id == row.table).map_or("", |table| table.title);
            let _ = writeln!(text, "\nTable {}: {title}", row.table);
            let _ = writeln!(
                text,
                "{:<22} {:>6} | {:>6} {:>15} {:>20} | {:<8} {:>6} {:>17} {:>5} {:>17} {:>6} {:>23}",
                "body",
                "gamma",
                "theirs",
                "e_rms/e_max %",
                "k range N/m",
                "ours",
                "groups",
                "Gauss-Newton %",
                "fact.",
                "annealing %",
                "eval.",
                "k range N/m"
            );
            last = row.table;
        }
        for (i, ours) in row.ours.iter().enumerate() {
            let _ = writeln!(text, "{} {}", theirs(&row.experiment, i == 0), our_cells(ours));
        }
        if !row.note.is_empty() {
            let _ = writeln!(text, "    {}", row.note);
        }
    }
    text
}

fn theirs(experiment: &Experiment, shown: bool) -> String {
    if !shown {
        return format!("{:<22} {:>6} | {:>6} {:>15} {:>20} |", "", "", "", "", "");
    }
    let points: Vec<String> = experiment.control_points.iter().map(usize::to_string).collect();
    let degree = if experiment.linear { " p=1" } else { "" };
    let groups = experiment.groups.map_or("-".into(), |groups| groups.to_string());
    let range = experiment.stiffness_range.map_or("-".into(), |[low, high]| format!("{low}..{high}"));
    let [rms, max] = experiment.errors;
    let name = format!("{} {}{degree}", experiment.body, points.join("x"));
    format!("{name:<22} {:>6} | {groups:>6} {:>15} {range:>20} |", experiment.gamma, format!("{rms}/{max}"))
}

fn our_cells(ours: &Ours) -> String {
    let pair = |errors: [f64; 2]| errors.map(|error| significant(error, 4)).join("/");
    let [low, high] = ours.stiffness_range;
    format!(
        "{:<8} {:>6} {:>17} {:>5} {:>17} {:>6} {:>23}",
        ours.weighting,
        ours.groups,
        pair(ours.gauss_newton),
        ours.refactorisations,
        pair(ours.annealing),
        ours.evaluations,
        format!("{}..{}", significant(low, 5), significant(high, 5))
    )
}
