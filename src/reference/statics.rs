//! Static equilibrium K u = f for several load cases.
//!
//! K is factored once; every solution is checked by its componentwise backward error (see
//! [`crate::sparse::backward_error`]). Displacements that are given where the body is held move to the right-hand side:
//! with u = u_free + u_given, K u_free = f - K u_given ([`prescribe`]).

use std::sync::Arc;

use nalgebra_sparse::CsrMatrix;

use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::reference::material::Lame;
use crate::reference::points::IntegrationPoints;
use crate::reference::stiffness::internal_forces;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::condition::Accuracy;

/// Displacements of all load cases.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Displacement of each free degree of freedom in m, one vector a load case.
    pub displacements: Vec<Vec<f64>>,
    /// How sure they are, the worst of all load cases.
    pub accuracy: Accuracy,
}

/// Solves K u = f for each of `loads` (N, one number for each free degree of freedom).
///
/// # Errors
/// [`crate::error::Error::NotPositiveDefinite`] with a loose unknown when the body can move freely;
/// [`crate::error::Error::Inaccurate`] when a solution stays inaccurate after refinement.
pub fn solve(stiffness: &CsrMatrix<f64>, symbolic: &Arc<Symbolic>, loads: &[&[f64]]) -> Result<Equilibrium> {
    Ok(solve_probing(stiffness, symbolic, loads, &[])?.0)
}

/// [`solve`], and the displacements (m, one after the other) under `probes` (N, one after the other) by the same factor: they
/// are checked like the others, and their accuracy is not told.
///
/// # Errors
/// Those of [`solve`].
pub fn solve_probing(
    stiffness: &CsrMatrix<f64>,
    symbolic: &Arc<Symbolic>,
    loads: &[&[f64]],
    probes: &[f64],
) -> Result<(Equilibrium, Vec<f64>)> {
    let mut factor = Factor::new(Arc::clone(symbolic));
    factor.load(stiffness);
    if let Some(modes) = factor.refactor_or_count()? {
        return Err(Error::NotPositiveDefinite { dof: modes.loosest() });
    }
    let right = loads.concat();
    let mut solved = vec![0.0; right.len()];
    factor.solve(&right, &mut solved)?;
    let accuracy = factor.accuracy(&right, &solved);
    let mut probed = vec![0.0; probes.len()];
    factor.solve(probes, &mut probed)?;
    let size = symbolic.len().max(1);
    let displacements = solved.chunks(size).map(<[f64]>::to_vec).collect();
    Ok((Equilibrium { displacements, accuracy }, probed))
}

/// Subtracts from `forces` (free degrees of freedom, N) what it takes to hold the body in the shape `given` (m, n x 3).
///
/// `given` is read at held components; put zero at the others. Solve with the result, and add `given` to the
/// expanded solution.
///
/// # Errors
/// Those of [`IntegrationPoints::fill`].
pub fn prescribe(
    points: &IntegrationPoints,
    lame: Lame,
    dofs: &DofMap,
    given: &[[f64; 3]],
    forces: &mut [f64],
) -> Result<()> {
    let reactions = internal_forces(points, lame, given)?;
    for (node, reaction) in reactions.iter().enumerate() {
        for (&dof, force) in dofs.free(node).iter().zip(reaction) {
            if dof != FIXED {
                forces[dof as usize] -= force;
            }
        }
    }
    Ok(())
}
