//! The mass of the body, and Rayleigh damping.
//!
//! ```text
//! consistent        M_ab = rho int N_a N_b dV, times the identity of the d directions
//! lumped  (3.11)    m_a  = sum_b M_ab = rho int N_a dV              because the N_b add up to 1
//! element (3.12)    m_a  = sum over the elements e that node a acts in of rho V_e / n_e
//! Rayleigh          C    = alpha_R M + beta_R K
//! ```
//!
//! V_e is the integrated measure of element e, n_e how many nodes act in it. Elements are those that cover the body once
//! ([`IntegrationPoints::of_body`]), so that the mass is that of the body however its stiffness is integrated. All three masses add up to the mass of the
//! body. The consistent one lives on the pattern of the stiffness, so that M, C and K can be added entry by entry. Lumped
//! masses are positive where the shape functions are, which those of all our methods are. Nodes that are tied carry their
//! mass at their master. Masses in kg, rho in kg/m^3, alpha_R in 1/s, beta_R in s.

use nalgebra_sparse::CsrMatrix;

use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::reference::points::{ElementPoints, IntegrationPoints};
use crate::reference::stiffness::element_dofs;
use crate::sparse::assemble::{ElementMatrix, assemble};
use crate::sparse::pattern::Pattern;

/// The consistent mass matrix over the free degrees of freedom in kg; `pattern` as [`super::stiffness::pattern`] makes it.
///
/// # Errors
/// Those of [`IntegrationPoints::fill`].
pub fn consistent(
    points: &IntegrationPoints,
    density: f64,
    dofs: &DofMap,
    pattern: &Pattern,
) -> Result<CsrMatrix<f64>> {
    let points = points.of_body();
    let dimension = points.dimension();
    assemble(pattern, points.elements(), ElementPoints::default, |e, filled, matrix: &mut ElementMatrix| {
        points.fill_mass(e, filled)?;
        element_dofs(points.acting(e), dofs, &mut matrix.dofs);
        let (nodes, size) = (points.acting(e).len(), points.acting(e).len() * dimension);
        matrix.values.clear();
        matrix.values.resize(size * size, 0.0);
        for (q, values) in filled.values.chunks_exact(nodes.max(1)).enumerate() {
            let mass = density * filled.volumes[q];
            for (a, b) in (0..nodes).flat_map(|a| (0..nodes).map(move |b| (a, b))) {
                let product = mass * values[a] * values[b];
                (0..dimension).for_each(|i| matrix.values[(a * dimension + i) * size + b * dimension + i] += product);
            }
        }
        Ok(())
    })
}

/// Row sums of the consistent mass matrix (3.11), one mass for each node, kg.
///
/// # Errors
/// Those of [`IntegrationPoints::fill`].
pub fn lumped(points: &IntegrationPoints, density: f64, dofs: &DofMap) -> Result<Vec<f64>> {
    let points = points.of_body();
    let shares = points.map(|e, filled| {
        let nodes = points.acting(e).len();
        let mut shares = vec![0.0; nodes];
        for (q, values) in filled.values.chunks_exact(nodes.max(1)).enumerate() {
            shares.iter_mut().zip(values).for_each(|(share, value)| *share += density * filled.volumes[q] * value);
        }
        shares
    })?;
    Ok(collected(points, dofs, |e, a| shares[e][a]))
}

/// Equal shares of every element (3.12), one mass for each node, kg.
///
/// # Errors
/// Those of [`IntegrationPoints::fill`].
pub fn equal_shares(points: &IntegrationPoints, density: f64, dofs: &DofMap) -> Result<Vec<f64>> {
    let points = points.of_body();
    let volumes = points.map(|_, filled| filled.volumes.iter().sum::<f64>())?;
    Ok(collected(points, dofs, |e, _| density * volumes[e] / points.acting(e).len() as f64))
}

/// Adds up `share(e, a)` over all elements e and their acting nodes a, at the masters of the nodes.
fn collected(points: &IntegrationPoints, dofs: &DofMap, share: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let mut masses = vec![0.0; dofs.nodes()];
    for e in 0..points.elements() {
        for (a, &node) in points.acting(e).iter().enumerate() {
            masses[dofs.master(node as usize)] += share(e, a);
        }
    }
    masses
}

/// C = alpha_R M + beta_R K in N s/m, for M and K on one pattern.
///
/// # Panics
/// When the two matrices have different patterns.
pub fn rayleigh(mass: &CsrMatrix<f64>, stiffness: &CsrMatrix<f64>, alpha: f64, beta: f64) -> CsrMatrix<f64> {
    assert_eq!(mass.pattern(), stiffness.pattern(), "mass and stiffness on one pattern");
    let mut damping = mass.clone();
    damping.values_mut().iter_mut().zip(stiffness.values()).for_each(|(c, k)| *c = alpha * *c + beta * k);
    damping
}
