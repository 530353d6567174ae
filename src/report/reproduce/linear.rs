//! Tables 4.2, 4.3, 4.4 and 5.6 and experiments 4.I and 4.IV: acceleration and matrix approach, theirs beside ours.

use std::fmt::Write;

use serde::Serialize;

use crate::clock::Progress;
use crate::error::{Error, Result};
use crate::readable::significant;
use crate::scene::{self, Source};
use crate::study;

use super::chapter4::{APPROACHES, Approach, BODIES, Body, Kind, MATERIALS, RELEASE, SPLINES};
use super::meshes;
use super::release::{self, TRUTH};
use super::words;

/// The tables and experiments of this file: number and title.
pub const TABLES: &[(&str, &str)] = &[
    ("4.I", "experiment I: springs (500, 400) found from their accelerations"),
    ("4.2", "stiffness by the acceleration approach, N/m"),
    ("4.3", "errors of matrix and acceleration approach"),
    ("4.4", "acceleration approach for other materials"),
    ("4.IV", "experiment IV: irregular membranes, groups by length"),
    ("5.6", "displacement against matrix approach under splines of degree two"),
];

/// Both ways to count springs that cells share.
const WEIGHTINGS: [&str; 2] = ["springs", "cells"];

/// One calibration beside what the thesis prints.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Number of the table.
    pub table: &'static str,
    /// The body.
    pub body: String,
    /// How it was calibrated.
    pub approach: String,
    /// e_rms and e_max that the thesis prints, percent.
    pub theirs: Option<[f64; 2]>,
    /// Stiffness that the thesis prints, N/m, in the order of our groups.
    pub their_stiffness: Vec<f64>,
    /// e_rms and e_max of our calibration; absent where it has no answer.
    pub ours: Option<[f64; 2]>,
    /// Name and stiffness of our groups, N/m.
    pub stiffness: Vec<(String, f64)>,
    /// Why they differ, or why there is no answer.
    pub note: String,
}

/// The rows of one table.
///
/// # Errors
/// Interruption, or a scene of ours that does not run.
pub fn run(table: &'static str, progress: &Progress) -> Result<Vec<Row>> {
    match table {
        "4.I" => experiment_i(),
        "4.4" => bodies(table, MATERIALS, |kind| kind == Kind::Acceleration, progress),
        "4.2" => bodies(table, BODIES, |kind| kind == Kind::Acceleration, progress),
        "4.3" => bodies(table, BODIES, |_| true, progress),
        "4.IV" => meshes::run(table, progress),
        _ => splines(table, progress),
    }
}

/// What a scene gave.
pub(super) struct Found {
    /// e_rms and e_max, percent.
    pub errors: [f64; 2],
    /// Name and stiffness of the groups, N/m.
    pub stiffness: Vec<(String, f64)>,
    /// Percent of K_ref where no spring is.
    outside: Option<f64>,
    /// Work of the load on the network over that on the body.
    compliance: f64,
}

/// Runs a scene.
pub(super) fn calibrate(name: &str, text: String, progress: &Progress) -> Result<Found> {
    let source = Source { name: name.to_owned(), text };
    let scene = scene::parse(&source).map_err(|located| located.error)?;
    let study = study::run(&scene, progress)?;
    let found = &study.calibration;
    let work = |u: &[f64]| study.loads[0].load.forces.iter().zip(u).map(|(f, u)| f * u).sum::<f64>();
    let names = found.grouping.groups.iter().map(|group| group.name.clone());
    Ok(Found {
        errors: [found.fitted.e_rms, found.fitted.e_max],
        stiffness: names.zip(found.phi.iter().copied()).collect(),
        outside: found.matrices.map(|matrices| matrices.outside_pattern),
        compliance: work(&found.displacements[0]) / work(&study.reference.cases[0].displacement),
    })
}

/// Experiment 4.I for both membranes, released from a stretch of 10 % along x.
fn experiment_i() -> Result<Vec<Row>> {
    let one = |n: usize| -> Result<Row> {
        let phi = release::recover(n, &|[i, ..]| i == 0, &|[x, _, _]| [0.1 * x, 0.0, 0.0])?;
        let wrong =
            |phi: &[f64]| phi.iter().zip(TRUTH).map(|(phi, truth)| (phi / truth - 1.0).abs()).fold(0.0, f64::max);
        Ok(Row {
            table: "4.I",
            body: format!("membrane {n}x{n} of springs"),
            approach: "acceleration, least squares".into(),
            theirs: Some(RELEASE.1),
            their_stiffness: RELEASE.0.to_vec(),
            // what is measured is the stiffness, in the note: no static load is given
            ours: None,
            note: words::recovery(wrong(&phi), wrong(&RELEASE.0)),
            stiffness: ["edge", "face_diagonal"].map(str::to_owned).into_iter().zip(phi).collect(),
        })
    };
    [9, 5].map(one).into_iter().collect()
}

fn bodies(
    table: &'static str,
    bodies: &[Body],
    wanted: impl Fn(Kind) -> bool,
    progress: &Progress,
) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for body in bodies {
        let mut of_body = Vec::new();
        for approach in APPROACHES.iter().filter(|approach| wanted(approach.kind)) {
            progress.check()?;
            of_body.push((approach.kind, row_of(table, body, approach, progress)?));
        }
        explain(&mut of_body);
        rows.extend(of_body.into_iter().map(|(_, row)| row));
    }
    Ok(rows)
}

/// One approach to a body; without an answer where its problem has none.
fn row_of(table: &'static str, body: &Body, approach: &Approach, progress: &Progress) -> Result<Row> {
    let (found, refusal) = answer(calibrate(body.name, body.scene(approach), progress))?;
    let (theirs, their_stiffness) = match approach.kind {
        Kind::Matrix => (body.matrix, vec![]),
        Kind::Acceleration => (body.acceleration, body.stiffness.to_vec()),
        Kind::Displacement => (None, vec![]),
    };
    Ok(Row {
        table,
        body: body.name.into(),
        approach: approach.name.into(),
        note: refusal,
        theirs,
        their_stiffness,
        ours: found.as_ref().map(|found| found.errors),
        stiffness: found.map_or(vec![], |found| found.stiffness),
    })
}

/// What was found, or the words of a problem that has no answer.
pub(super) fn answer(outcome: Result<Found>) -> Result<(Option<Found>, String)> {
    match outcome {
        Ok(found) => Ok((Some(found), String::new())),
        Err(Error::Interrupted) => Err(Error::Interrupted),
        Err(error) => Ok((None, format!("no answer: {error}"))),
    }
}

/// The rows' e_rms by their approach.
pub(super) fn named<'a>(rows: &[&'a Row]) -> Vec<words::Named<'a>> {
    rows.iter().filter_map(|row| Some((&row.approach[..], row.ours?[0]))).collect()
}

/// A word behind the last row of each kind that stands beside a printed error.
fn explain(rows: &mut [(Kind, Row)]) {
    for (kind, lost) in [(Kind::Matrix, "support and load"), (Kind::Acceleration, "support, load and initial state")] {
        let of_kind: Vec<&Row> = rows.iter().filter(|(k, _)| *k == kind).map(|(_, row)| row).collect();
        let Some(theirs) = of_kind.first().and_then(|row| row.theirs) else { continue };
        let words = words::linear(theirs[0], &named(&of_kind), lost);
        if let Some((_, last)) = rows.iter_mut().rev().find(|(k, row)| *k == kind && row.ours.is_some()) {
            last.note = words;
        }
    }
}

fn splines(table: &'static str, progress: &Progress) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for spline in SPLINES {
        let fitted = |objective: &str| {
            WEIGHTINGS.map(|weighting| calibrate(spline.shape, spline.scene(weighting, objective), progress))
        };
        let row = |objective: &str, theirs: [f64; 2], weighting: &str, found: &Found| Row {
            table,
            body: spline.shape.into(),
            approach: format!("{objective}, weighting {weighting}"),
            theirs: Some(theirs),
            their_stiffness: vec![],
            ours: Some(found.errors),
            stiffness: found.stiffness.clone(),
            note: String::new(),
        };
        let displacement: Vec<Found> = fitted("displacement").into_iter().collect::<Result<_>>()?;
        let matrix: Vec<Found> = fitted("matrix").into_iter().collect::<Result<_>>()?;
        let first = rows.len();
        let of = |found| WEIGHTINGS.iter().zip(found);
        rows.extend(
            of(&displacement).map(|(weighting, found)| row("displacement", spline.displacement, weighting, found)),
        );
        let theirs = [spline.displacement[0], spline.matrix[0]];
        let note = words::displacement(theirs[0], &named(&rows[first..].iter().collect::<Vec<_>>()), &[]);
        if let Some(last) = rows.last_mut() {
            last.note = note;
        }
        rows.extend(of(&matrix).zip(&displacement).map(|((weighting, found), other)| Row {
            note: words::splines(
                theirs,
                [other.errors[0], found.errors[0]],
                found.compliance,
                found.outside.unwrap_or_default(),
            ),
            ..row("matrix", spline.matrix, weighting, found)
        }));
    }
    Ok(rows)
}

/// The rows as a table for people.
pub fn text(rows: &[Row]) -> String {
    let mut text = String::new();
    let (mut table, mut body) = ("", "");
    for row in rows {
        if row.table != table {
            let title = TABLES.iter().find(|(id, _)| *id == row.table).map_or("", |(_, title)| title);
            let _ = writeln!(text, "\n{}: {title}", row.table);
            let _ = writeln!(text, "  {:<34} {:>17} {:>17}  stiffness N/m", "", "theirs rms/max %", "ours rms/max %");
            (table, body) = (row.table, "");
        }
        if row.body != body {
            let _ = writeln!(text, "{}", row.body);
            body = &row.body;
        }
        let printed = row.theirs.map_or("-".to_owned(), |[rms, max]| format!("{rms}/{max}"));
        let ours = row.ours.map(|errors| errors.map(|error| significant(error, 4)).join("/"));
        let _ = writeln!(
            text,
            "  {:<34} {:>17} {:>17}  {}",
            row.approach,
            printed,
            ours.as_deref().unwrap_or("-"),
            stiffness(row)
        );
        if !row.note.is_empty() {
            let _ = writeln!(text, "    {}", row.note);
        }
    }
    text
}

/// Our groups, with theirs in brackets; a range where there are many.
fn stiffness(row: &Row) -> String {
    const SHOWN: usize = 6;
    if row.stiffness.len() > SHOWN {
        let numbers = row.stiffness.iter().map(|(_, k)| *k);
        let (low, high) = (numbers.clone().fold(f64::INFINITY, f64::min), numbers.fold(0.0, f64::max));
        return format!("{} groups, {}..{}", row.stiffness.len(), significant(low, 4), significant(high, 4));
    }
    let group = |(i, (name, ours)): (usize, &(String, f64))| match row.their_stiffness.get(i) {
        Some(theirs) => format!("{name} {} ({theirs})", significant(*ours, 5)),
        None => format!("{name} {}", significant(*ours, 5)),
    };
    row.stiffness.iter().enumerate().map(group).collect::<Vec<_>>().join(", ")
}
