//! The errors against a finer mesh: in the result and for a person.

use std::fmt::Write;

use serde::Serialize;

use crate::readable::significant;
use crate::study::Study;

/// The errors against a finer mesh, in percent of its largest displacement: see [`crate::study::converged`].
#[derive(Debug, Serialize)]
pub struct Converged<'a> {
    control_points: usize,
    free_dofs: usize,
    cases: Vec<Case<'a>>,
}

#[derive(Debug, Serialize)]
struct Case<'a> {
    load: &'a str,
    fit: bool,
    springs: f64,
    mesh: f64,
    total: f64,
    remaining: f64,
}

/// The part of the result; none when the scene does not ask for it.
pub fn document(study: &Study) -> Option<Converged<'_>> {
    let found = study.converged.as_ref()?;
    let cases = study.loads.iter().zip(&found.cases).map(|(load, split)| Case {
        load: &load.name,
        fit: load.fit,
        springs: split.springs,
        mesh: split.mesh,
        total: split.total,
        remaining: split.remaining,
    });
    Some(Converged { control_points: found.control_points, free_dofs: found.free_dofs, cases: cases.collect() })
}

/// The table for a person; none when the scene does not ask for it.
pub fn summary(study: &Study) -> Option<String> {
    let found = study.converged.as_ref()?;
    let mut text = format!(
        "\nerrors over the body against a finer mesh of {} free dofs, percent of its largest displacement\n\
         {:<24} {:>10} {:>10} {:>10} {:>16}\n",
        found.free_dofs, "load", "springs", "mesh", "total", "finer mesh +-"
    );
    for (load, split) in study.loads.iter().zip(&found.cases) {
        let [springs, mesh, total, remaining] =
            [split.springs, split.mesh, split.total, split.remaining].map(|error| significant(error, 5));
        let _ = writeln!(text, "{:<24} {springs:>10} {mesh:>10} {total:>10} {remaining:>16}", load.name);
    }
    Some(text)
}
