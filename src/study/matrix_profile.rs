//! The stiffness that every spring would have by the matrix of the continuum, as a profile.
//!
//! The off-diagonal reading of the matrix objective (3.17) with one group a spring falls apart into one equation for each
//! spring, with the answer
//!
//! ```text
//! k_s = -d^T K_ij d,      K_ij the 3 x 3 block of K_ref between its ends, d its direction
//! ```
//!
//! K_ref is that of the body without supports, so that springs at held nodes have theirs too. Where the continuum pushes
//! between two nodes (k_s < 0: the blocks of smooth splines do so along some diagonals) a spring cannot follow; it gets a
//! small part of the mean, so that every factor is positive. The number that the calibration finds for a group multiplies
//! these: it is 1 where the matrix is right already.

use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::reference::stiffness;
use crate::springs::network::{Network, Spring};
use crate::springs::weighting::Weighting;

use super::body::Body;

/// The least factor, as a part of the mean of the positive ones.
const LEAST: f64 = 0.01;

/// k_s of every spring over the times c_s it counts, N/m, positive.
///
/// # Errors
/// Those of the integration of the reference.
pub fn factors(body: &Body, network: &Network, weighting: Weighting) -> Result<Vec<f64>> {
    let nodes = body.dofs.nodes();
    let master = (0..nodes).map(|node| body.dofs.master(node) as u32).collect();
    let free = DofMap::new(body.dofs.dimension(), master, &vec![[false; 3]; nodes]);
    let points = body.integration_points()?;
    let matrix = stiffness::stiffness(&points, body.lame, &free, &stiffness::pattern(&points, &free))?;
    let entry = |row: u32, column: u32| {
        let lane = matrix.row(row as usize);
        lane.col_indices().binary_search(&(column as usize)).map_or(0.0, |at| lane.values()[at])
    };
    let along = |spring: &Spring| {
        let [rows, columns] = spring.nodes.map(|node| free.free(node as usize));
        let terms = rows.iter().zip(spring.direction).flat_map(|(&row, p)| {
            columns.iter().zip(spring.direction).map(move |(&column, q)| -p * q * entry(row, column))
        });
        terms.sum::<f64>() / weighting.count(spring)
    };
    let found: Vec<f64> = network.springs.iter().map(along).collect();
    let (sum, count) = found.iter().filter(|k| **k > 0.0).fold((0.0, 0_usize), |(sum, n), k| (sum + k, n + 1));
    // a body in which no two nodes are drawn together leaves nothing to follow
    let least = if count > 0 { LEAST * sum / count as f64 } else { 1.0 };
    Ok(found.into_iter().map(|k| k.max(least)).collect())
}
