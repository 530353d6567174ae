//! `bench hard`: every path of solution on every hard problem, speed against error where it hurts.
//!
//! Each row has the componentwise backward error of what a path answered, its forward error (the largest difference of a
//! displacement from the answer with twice the digits, over the largest displacement), what the path promised and whether it
//! kept it, and its time. The promises:
//!
//! | path | promise |
//! |---|---|
//! | direct, continuum | backward error at most 1e-15 after at most one refinement, or an error that says so |
//! | single, stale, multigrid | residual over force at most the tolerance, or a backward error at the limit of rounding |
//! | fast diagonalisation | residual over force at most 1e-12 or backward error at most 1e-15, or the continuum is factored |
//! | surrogate | its energy error is below its certificate, up to the rounding of a solve |
//!
//! A refusal in words is a promise kept: the number that comes out wrong is the only failure.
//!
//! | file | idea |
//! |---|---|
//! | [`problems`] | the hard problems |
//! | [`paths`] | one row for each path |
//! | [`double`] | twice the digits |

pub mod double;
pub mod paths;
pub mod problems;

use std::fmt::Write;

use serde::Serialize;

use crate::clock::Progress;
use crate::error::Result;

use super::chart::{self, Labels, Series};

/// A path on a problem.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Name of the problem.
    pub case: String,
    /// Name of the path.
    pub path: &'static str,
    /// Free degrees of freedom.
    pub unknowns: usize,
    /// What came out; absent when the path refused.
    pub answer: Option<Answer>,
    /// What the path says: its promise and how it kept it, or its refusal.
    pub words: String,
    /// False only when a number was handed out that is not as promised.
    pub kept: bool,
    /// Seconds on the clock.
    pub seconds: f64,
}

/// The errors of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Answer {
    /// Componentwise backward error.
    pub backward_error: f64,
    /// Relative forward error against twice the digits; absent where those did not suffice either.
    pub forward_error: Option<f64>,
    /// What the program estimates as a bound of it; absent on paths without an estimate.
    pub estimated: Option<f64>,
    /// Estimated condition number.
    pub condition: Option<f64>,
}

/// All paths on all problems whose name contains `wanted`.
///
/// # Errors
/// [`crate::error::Error::Interrupted`]; a refusal of a body or of a path is a row.
pub fn run(wanted: &str, progress: &Progress) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for hard in problems::all().iter().filter(|hard| hard.name.contains(wanted)) {
        progress.check()?;
        progress.enter(&hard.name, 0);
        match hard.problem() {
            Err(error) => rows.push(paths::refused(hard, "all paths", 0, error.to_string(), 0.0)),
            Ok(problem) => {
                rows.extend(paths::springs(hard, &problem)?);
                if hard.continuum {
                    rows.extend(paths::continuum(hard, &problem)?);
                }
            }
        }
    }
    Ok(rows)
}

/// The rows for a person.
pub fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<22} {:<20} {:>5} {:>9} {:>9} {:>9} {:>9} {:>9} {:>4}  words\n",
        "case", "path", "dofs", "backward", "forward", "estimate", "condition", "seconds", "kept"
    );
    let number = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.1e}"));
    for row in rows {
        let answer = row.answer;
        let _ = writeln!(
            text,
            "{:<22} {:<20} {:>5} {:>9} {:>9} {:>9} {:>9} {:>9.1e} {:>4}  {}",
            row.case,
            row.path,
            row.unknowns,
            number(answer.map(|a| a.backward_error)),
            number(answer.and_then(|a| a.forward_error)),
            number(answer.and_then(|a| a.estimated)),
            number(answer.and_then(|a| a.condition)),
            row.seconds,
            if row.kept { "yes" } else { "NO" },
            row.words
        );
    }
    let broken = rows.iter().filter(|row| !row.kept).count();
    let _ = writeln!(text, "\n{} rows, {broken} broken promises", rows.len());
    text
}

/// Time against forward error, a curve for each path.
pub fn svg(rows: &[Row]) -> String {
    let mut names: Vec<&str> = Vec::new();
    rows.iter().for_each(|row| {
        if !names.contains(&row.path) {
            names.push(row.path);
        }
    });
    let of = |name: &str| {
        let points = rows
            .iter()
            .filter(|row| row.path == name)
            .filter_map(|row| Some((row.seconds, row.answer?.forward_error?.max(f64::EPSILON / 16.0), String::new())));
        Series { name: name.to_owned(), points: points.collect() }
    };
    let series: Vec<Series> = names.iter().map(|name| of(name)).collect();
    let labels = Labels { title: "hard problems", time: "seconds", error: "forward error of the displacements" };
    chart::points(&labels, &series)
}
