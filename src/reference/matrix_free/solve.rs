//! K u = f on a fine mesh: conjugate gradients, nothing stored but the map of the body.
//!
//! The product is `operator`, the preconditioner `separable`, the iteration
//! [`crate::sparse::cg`]. Time grows like n^4 for n^3 control points (the dense contractions of the preconditioner; the
//! product, which grows like n^3, takes most of it up to n = 100), memory like n^3.
//!
//! Rounding alone leaves a residual of about e |K| |u| with e = 1e-16. On fine meshes that can be more than what is
//! asked of |f|; the iteration then is as good as a direct solution and counts as done. What is found is refined, and its
//! errors are estimated, in `accuracy`.

use super::accuracy::System;
use super::geometry::Body;
use super::operator::Operator;
use super::separable::{self, Preconditioner};
use super::sizes::{self, sizes};
use crate::clock::Interrupt;
use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::geometry::patch::Patch;
use crate::reference::material::Lame;
use crate::reference::points::IntegrationPoints;
use crate::sparse::cg;
use crate::sparse::condition::Accuracy;

/// A residual of this share of |K| |u| + |f| is rounding.
const ROUNDING: f64 = 1e-14;

/// Displacements found by iteration.
#[derive(Debug, Clone, PartialEq)]
pub struct Iterated {
    /// Displacement of each free degree of freedom in m, one vector a load case.
    pub displacements: Vec<Vec<f64>>,
    /// Iterations of each load case, without those of its refinement.
    pub iterations: Vec<usize>,
    /// Largest |f - K u| / |f|, computed.
    pub residual: f64,
    /// How sure they are, the worst of all load cases.
    pub accuracy: Accuracy,
    /// sqrt(sum of K_ij^2) in N/m.
    pub frobenius: f64,
    /// Volume of the body in m^3 (with the thickness in two dimensions).
    pub volume: f64,
}

/// When an iteration is done, and when it is given up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest |f - K u| / |f|.
    pub tolerance: f64,
    /// Iterations a load case.
    pub iterations: usize,
}

/// Solves for each of `loads` (N over the free degrees of freedom); `None` when an iteration does not come to the
/// tolerance within the limit, or the body has no separable preconditioner.
///
/// # Errors
/// [`crate::error::Error::FoldedElement`]; [`crate::error::Error::Interrupted`] when the user stops the run.
pub fn solve(
    points: &IntegrationPoints,
    lame: Lame,
    dofs: &DofMap,
    loads: &[&[f64]],
    limits: Limits,
    interrupt: &Interrupt,
) -> Result<Option<Iterated>> {
    let Some((patch, extra_points)) = points.splines() else { return Ok(None) };
    let body = Body::new(patch, extra_points, points.thickness())?;
    let Some(preconditioner) = Preconditioner::new(&body, dofs, lame) else { return Ok(None) };
    let operator = Operator::new(&body, dofs, lame);
    let (mut space, mut inner) = (operator.workspace(), separable::Workspace::default());
    let mut work = cg::Workspace::new(dofs.len());
    work.watch(interrupt);
    let mut found = Iterated {
        displacements: vec![],
        iterations: vec![],
        residual: 0.0,
        accuracy: Accuracy { backward_error: 0.0, condition: 0.0, forward_error: 0.0 },
        frobenius: 0.0,
        volume: body.volume,
    };
    for load in loads {
        let mut u = vec![0.0; dofs.len()];
        let outcome = cg::solve(
            &mut |x, y| operator.apply(x, y, &mut space),
            &mut |r, z| preconditioner.apply(r, z, &mut inner),
            load,
            &mut u,
            limits.tolerance,
            limits.iterations,
            &mut work,
        );
        work.check()?;
        // the norm that rounding sees is the largest eigenvalue, between the largest diagonal entry and a few times it
        let (force, moved) = (length(load), length(&u));
        let rounding = ROUNDING * (preconditioner.largest_diagonal * moved + force);
        if !(outcome.reached(limits.tolerance) || outcome.residual * force <= rounding) {
            return Ok(None);
        }
        found.residual = found.residual.max(outcome.residual);
        found.displacements.push(u);
        found.iterations.push(outcome.iterations);
    }
    let answers: Vec<&[f64]> = found.displacements.iter().map(Vec::as_slice).collect();
    let mut size = sizes(&body, dofs, lame, &answers);
    found.frobenius = size.frobenius;
    let mut system = System {
        operator: &operator,
        preconditioner: &preconditioner,
        space: &mut space,
        inner: &mut inner,
        iteration: &mut work,
        limit: limits.iterations,
    };
    system.finish(loads, &mut size, &mut found)?;
    Ok(Some(found))
}

/// Bytes that [`solve`] takes at most beside its result, for `cases` load cases and with `threads` threads.
pub fn memory_bytes(patch: &Patch, extra_points: usize, dofs: usize, cases: usize, threads: usize) -> usize {
    let nodes = patch.points().len() * patch.dimension();
    let map = Body::bytes(patch, extra_points);
    // fields of the map; those of the product with its slabs (1.5 of the nodes) and of the preconditioner; of the iteration
    let mapping = 8 * 4 * patch.points().len();
    let product = 8 * nodes * 7 / 2;
    let preconditioner = nodes * (4 + 8 + 8 + 8 + 8) + dofs * (8 + 16);
    let iteration = 8 * dofs * 5;
    // at the end |K| |u|, then nine vectors for the refinement and the estimates
    let accuracy = sizes::bytes(patch, dofs, cases, threads).max(8 * dofs * (cases + 9));
    map + mapping.max(preconditioner + product + iteration + accuracy)
}

fn length(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}
