//! A ladder of groups that adapt: fitted and held-out error against the number of groups, and what every rung cost.

use std::fmt::Write;

use serde::Serialize;

use crate::calibration::adaptive::Rung;
use crate::export::plot::{self, Curve, Labels};
use crate::readable::{shortened, significant};

/// One rung in result.json; errors in percent, work and seconds of the whole ladder so far.
#[derive(Debug, Serialize)]
pub struct Row<'a> {
    groups: usize,
    e_rms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out_e_rms: Option<f64>,
    refactorisations: u64,
    solves: u64,
    seconds: f64,
    splits: &'a [String],
}

/// The rungs for result.json.
pub fn rows(rungs: &[Rung]) -> Vec<Row<'_>> {
    rungs
        .iter()
        .map(|rung| Row {
            groups: rung.groups,
            e_rms: rung.error,
            held_out_e_rms: rung.held_out,
            refactorisations: rung.counts.refactorisations,
            solves: rung.counts.solves,
            seconds: rung.seconds,
            splits: &rung.splits,
        })
        .collect()
}

/// Most characters of a split in the table; result.json has the whole words.
const SPLIT: usize = 60;

/// The rungs as a table for people.
pub fn table(rungs: &[Rung]) -> String {
    let mut text = format!(
        "{:>6} {:>10} {:>12} {:>16} {:>8} {:>9}  split\n",
        "groups", "e_rms %", "held out %", "refactorisations", "solves", "seconds"
    );
    for rung in rungs {
        let held_out = rung.held_out.map_or("-".to_owned(), |error| significant(error, 4));
        let split = match &rung.splits[..] {
            [] => "the kinds".to_owned(),
            [one] => shortened(one, SPLIT),
            [one, more @ ..] => format!("{} and {} more", shortened(one, SPLIT), more.len()),
        };
        let _ = writeln!(
            text,
            "{:>6} {:>10} {held_out:>12} {:>16} {:>8} {:>9}  {split}",
            rung.groups,
            significant(rung.error, 4),
            rung.counts.refactorisations,
            rung.counts.solves,
            significant(rung.seconds, 3)
        );
    }
    text
}

/// The rungs as an SVG: both errors against the number of groups.
pub fn plot(rungs: &[Rung]) -> String {
    let groups = |rung: &Rung| rung.groups as f64;
    let fitted = rungs.iter().map(|rung| (groups(rung), rung.error)).collect();
    let held_out: Vec<(f64, f64)> = rungs.iter().filter_map(|rung| Some((groups(rung), rung.held_out?))).collect();
    let mut curves = vec![Curve { name: "fitted loads".into(), points: fitted }];
    if !held_out.is_empty() {
        curves.push(Curve { name: "held-out loads".into(), points: held_out });
    }
    let labels = Labels { title: "error against the number of groups", time: "groups", value: "e_rms, percent" };
    plot::svg(&labels, &curves)
}
