//! What became of a budget: in the result, as a table, as a plot; and the front of `bench tradeoff`, which has none.

use std::fmt::Write;

use serde::Serialize;

use crate::readable::significant;
use crate::study::budget::{Front, Outcome, Point};

use super::bench::chart::{self, Labels, Series};

/// The budget in result.json: errors in percent, times in seconds.
#[derive(Debug, Serialize)]
pub struct Budget<'a> {
    met: bool,
    chosen: usize,
    #[serde(flatten)]
    front: Tried<'a>,
}

/// All networks that were tried.
#[derive(Debug, Serialize)]
pub struct Tried<'a> {
    points: Vec<Row<'a>>,
    skipped: Vec<Skipped<'a>>,
}

#[derive(Debug, Serialize)]
struct Row<'a> {
    control_points: &'a [usize],
    groups: usize,
    springs: usize,
    fitted: f64,
    error: f64,
    step_seconds: f64,
    calibration_seconds: f64,
    pareto: bool,
}

#[derive(Debug, Serialize)]
struct Skipped<'a> {
    control_points: &'a [usize],
    reason: &'a str,
}

/// The part of the result.
pub fn document(outcome: &Outcome) -> Budget<'_> {
    Budget { met: outcome.met, chosen: outcome.chosen, front: tried(&outcome.front) }
}

/// A front as it is in a document.
pub fn tried(front: &Front) -> Tried<'_> {
    let points = front.points.iter().zip(front.pareto()).map(|(point, pareto)| Row {
        control_points: &point.control_points,
        groups: point.groups,
        springs: point.springs,
        fitted: point.fitted,
        error: point.error,
        step_seconds: point.step_seconds,
        calibration_seconds: point.calibration_seconds,
        pareto,
    });
    let skipped = front.skipped.iter().map(|(control_points, reason)| Skipped { control_points, reason });
    Tried { points: points.collect(), skipped: skipped.collect() }
}

/// The front as a table; `chosen` is marked.
pub fn table(front: &Front, chosen: Option<usize>) -> String {
    let mut text = format!(
        "{:<16} {:>7} {:>9} {:>10} {:>10} {:>12} {:>14}\n",
        "control points", "groups", "springs", "fitted %", "error %", "step s", "calibration s"
    );
    for (i, (point, pareto)) in front.points.iter().zip(front.pareto()).enumerate() {
        let mark = match () {
            () if chosen == Some(i) => "  <- taken",
            () if pareto => "  *",
            () => "",
        };
        let _ = writeln!(
            text,
            "{:<16} {:>7} {:>9} {:>10} {:>10} {:>12.3e} {:>14}{mark}",
            grid(&point.control_points),
            point.groups,
            point.springs,
            significant(point.fitted, 5),
            significant(point.error, 5),
            point.step_seconds,
            significant(point.calibration_seconds, 3)
        );
    }
    text.push_str("* on the Pareto front of error, step and groups\n");
    for (control_points, reason) in &front.skipped {
        let _ = writeln!(text, "left out {}: {reason}", grid(control_points));
    }
    text
}

/// Numbers of groups are written beside points this many times apart, so that they can be read.
const APART: f64 = 1.8;

/// Error against the time of a step and against that of the calibration, each resolution a curve over its groups, and the
/// Pareto front of error and step.
pub fn svg(front: &Front) -> String {
    let mut resolutions: Vec<&[usize]> = front.points.iter().map(|point| point.control_points.as_slice()).collect();
    resolutions.dedup();
    let curve = |of: &[usize], what: &str, time: fn(&Point) -> f64| {
        let mut next = 0.0;
        let points = front.points.iter().filter(|point| point.control_points == of).map(|point| {
            let groups = point.groups as f64;
            let shown = groups >= next;
            next = if shown { APART * groups } else { next };
            (time(point), point.error, if shown { point.groups.to_string() } else { String::new() })
        });
        Series { name: format!("{}, {what}", grid(of)), points: points.collect() }
    };
    let mut best: Vec<(f64, f64)> = resolutions.iter().map(|of| least(front, of)).collect();
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lowest = f64::INFINITY;
    best.retain(|&(_, error)| {
        let lower = error < lowest;
        lowest = lowest.min(error);
        lower
    });
    let best = Series {
        name: "Pareto front of error and step".to_owned(),
        points: best.into_iter().map(|(time, error)| (time, error, String::new())).collect(),
    };
    let steps = resolutions.iter().map(|of| curve(of, "a step", |point| point.step_seconds));
    let fits = resolutions.iter().map(|of| curve(of, "calibration", |point| point.calibration_seconds));
    let labels = Labels {
        title: "error against time; numbers are groups",
        time: "seconds of a step, seconds of the calibration",
        error: "e_rms %",
    };
    chart::svg(&labels, &steps.chain(fits).chain([best]).collect::<Vec<_>>())
}

/// Time of a step and smallest error of a resolution.
fn least(front: &Front, of: &[usize]) -> (f64, f64) {
    let points = front.points.iter().filter(|point| point.control_points == of);
    points.fold((0.0, f64::INFINITY), |least, point| (point.step_seconds, least.1.min(point.error)))
}

/// A grid as people write it.
fn grid(control_points: &[usize]) -> String {
    control_points.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ")
}
