//! K u = f on a fine mesh: conjugate gradients, nothing stored.

use super::geometry::Body;
use super::operator::Operator;
use super::separable::{self, Preconditioner};
use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::geometry::patch::Patch;
use crate::reference::material::Lame;
use crate::sparse::cg;

/// Displacements found by iteration.
#[derive(Debug, Clone, PartialEq)]
pub struct Iterated {
    /// Displacement of each free degree of freedom in m, one vector a load case.
    pub displacements: Vec<Vec<f64>>,
    /// Iterations of each load case.
    pub iterations: Vec<usize>,
    /// Largest |f - K u| / |f|, computed.
    pub residual: f64,
    /// Volume of the body in m^3 (with the thickness in two dimensions).
    pub volume: f64,
}

/// Solves for each of `loads`; `None` when an iteration does not come to `tolerance` within `limit` steps.
///
/// # Errors
/// [`crate::error::Error::FoldedElement`].
pub fn solve(
    (patch, extra, thickness): (&Patch, usize, f64),
    lame: Lame,
    dofs: &DofMap,
    loads: &[&[f64]],
    tolerance: f64,
    limit: usize,
) -> Result<Option<Iterated>> {
    let watch = crate::clock::Stopwatch::start();
    let body = Body::new(patch, extra, thickness)?;
    eprintln!("body {:.3}", watch.seconds());
    let Some(preconditioner) = Preconditioner::new(&body, dofs, lame) else { return Ok(None) };
    eprintln!("preconditioner {:.3}", watch.seconds());
    let operator = Operator::new(&body, dofs, lame);
    let (mut space, mut inner) = (operator.workspace(), separable::Workspace::default());
    let mut found = Iterated { displacements: vec![], iterations: vec![], residual: 0.0, volume: body.volume };
    let mut work = cg::Workspace::new(dofs.len());
    for load in loads {
        let mut u = vec![0.0; dofs.len()];
        let (mut ta, mut tp) = (0.0, 0.0);
        let outcome = cg::solve(
            &mut |x, y| {
                let w = crate::clock::Stopwatch::start();
                operator.apply(x, y, &mut space);
                ta += w.seconds();
            },
            &mut |r, z| {
                let w = crate::clock::Stopwatch::start();
                preconditioner.apply(r, z, &mut inner);
                tp += w.seconds();
            },
            load,
            &mut u,
            tolerance,
            limit,
            &mut work,
        );
        eprintln!("{outcome:?} apply {ta:.3} precondition {tp:.3} all {:.3}", watch.seconds());
        found.displacements.push(u);
        found.iterations.push(outcome.iterations);
        found.residual = found.residual.max(outcome.residual);
    }
    Ok(Some(found))
}
