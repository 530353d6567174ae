//! The stiffness of one element, and of the body.
//!
//! With displacement u = sum_a N_a u_a the strain energy couples nodes a and b by a block of d x d numbers,
//! K_ab = sum_q v_q B_a^T D B_b (thesis 2.29). For an isotropic material (see [`super::material`]) B and D need not be
//! formed. With g_a = dN_a/dx and the outer products S_ab = sum_q v_q g_a g_b^T,
//!
//! ```text
//!     K_ab = lambda S_ab + mu S_ab^T + mu tr(S_ab) 1
//! ```
//!
//! Where the change of volume comes from mean gradients gbar ([`super::points`]), the volumetric part of the energy,
//! kappa/2 tr(e)^2 with kappa = lambda + 2 mu / 3, is that of the mean, which with V = sum_q v_q adds to the block
//!
//! ```text
//!     kappa (V gbar_a gbar_b^T - S_ab)
//! ```
//!
//! All S_ab of an element together are one symmetric matrix product S = G^T V G, where G holds a row of n d gradient
//! components for each point. It costs nearly all the time, so it is computed in 4 x 4 tiles that stay in registers,
//! upper triangle only. K is in N/m.

use nalgebra_sparse::CsrMatrix;

use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::reference::material::Lame;
use crate::reference::points::{ElementPoints, IntegrationPoints, displacement_gradient};
use crate::sparse::assemble::{ElementMatrix, assemble};
use crate::sparse::pattern::Pattern;

/// Rows and columns of a register tile.
const TILE: usize = 4;

/// What one worker needs to compute element matrices.
#[derive(Debug, Default)]
struct Workspace {
    points: ElementPoints,
    products: Products,
}

/// The matrix S of an element: upper triangle, rows padded to whole tiles.
#[derive(Debug, Default)]
pub(super) struct Products {
    /// Gradient components, one padded row of n d numbers for each point.
    rows: Vec<f64>,
    /// The same rows times the volume of the point.
    weighted: Vec<f64>,
    /// S, padded in both directions; tiles below the diagonal are not written.
    sums: Vec<f64>,
    /// Length of a padded row.
    width: usize,
}

impl Products {
    fn compute(&mut self, points: &ElementPoints, dimension: usize) {
        let size = points.gradients.len() / points.len().max(1) * dimension;
        self.width = size.next_multiple_of(TILE);
        self.gather(points, dimension);
        self.sums.resize(self.width * self.width, 0.0);
        for i in (0..self.width).step_by(TILE) {
            for j in (i..self.width).step_by(TILE) {
                let tile = self.tile(i, j);
                for (r, row) in tile.iter().enumerate() {
                    self.sums[(i + r) * self.width + j..][..TILE].copy_from_slice(row);
                }
            }
        }
    }

    /// Copies the gradients into padded rows of `dimension` components a node.
    fn gather(&mut self, points: &ElementPoints, dimension: usize) {
        self.rows.clear();
        self.rows.resize(self.width * points.len(), 0.0);
        self.weighted.clear();
        self.weighted.resize(self.width * points.len(), 0.0);
        let nodes = points.gradients.len() / points.len().max(1);
        for (q, gradients) in points.gradients.chunks_exact(nodes.max(1)).enumerate() {
            let row = &mut self.rows[q * self.width..][..self.width];
            for (to, from) in row.chunks_exact_mut(dimension).zip(gradients) {
                to.copy_from_slice(&from[..dimension]);
            }
            for (to, from) in self.weighted[q * self.width..][..self.width].iter_mut().zip(row) {
                *to = points.volumes[q] * *from;
            }
        }
    }

    /// The tile of S that starts at (i, j), summed over the points in their order.
    fn tile(&self, i: usize, j: usize) -> [[f64; TILE]; TILE] {
        let mut sums = [[0.0; TILE]; TILE];
        for (row, weighted) in self.rows.chunks_exact(self.width).zip(self.weighted.chunks_exact(self.width)) {
            let (left, right) = (&weighted[i..i + TILE], &row[j..j + TILE]);
            for r in 0..TILE {
                for c in 0..TILE {
                    sums[r][c] += left[r] * right[c];
                }
            }
        }
        sums
    }

    /// Entry (i, j) of S, for i in the same node as j or in an earlier one.
    fn at(&self, i: usize, j: usize) -> f64 {
        self.sums[i.min(j) * self.width + i.max(j)]
    }
}

/// Writes the stiffness of one element into `out`: row-major, n d squared, dof d a + i for component i of node a.
pub(super) fn element(points: &ElementPoints, dimension: usize, lame: Lame, s: &mut Products, out: &mut Vec<f64>) {
    let nodes = points.gradients.len() / points.len().max(1);
    let size = nodes * dimension;
    s.compute(points, dimension);
    out.resize(size * size, 0.0);
    for a in 0..nodes {
        for b in a..nodes {
            let (row, column) = (a * dimension, b * dimension);
            let trace: f64 = (0..dimension).map(|i| s.at(row + i, column + i)).sum();
            for i in 0..dimension {
                for j in 0..dimension {
                    let diagonal = if i == j { lame.mu * trace } else { 0.0 };
                    let k = lame.lambda * s.at(row + i, column + j) + lame.mu * s.at(row + j, column + i) + diagonal;
                    out[(row + i) * size + column + j] = k;
                    out[(column + j) * size + row + i] = k;
                }
            }
        }
    }
    if !points.mean_gradients.is_empty() {
        add_mean_dilatation(points, dimension, lame.volumetric(), s, out);
    }
}

/// Adds kappa (V gbar_a gbar_b^T - S_ab) to every block.
fn add_mean_dilatation(points: &ElementPoints, dimension: usize, kappa: f64, s: &Products, out: &mut [f64]) {
    let volume: f64 = points.volumes.iter().sum();
    let size = points.mean_gradients.len() * dimension;
    let mean = |row: usize| points.mean_gradients[row / dimension][row % dimension];
    for row in 0..size {
        for column in row..size {
            let change = kappa * (volume * mean(row) * mean(column) - s.at(row, column));
            out[row * size + column] += change;
            if column != row {
                out[column * size + row] += change;
            }
        }
    }
}

/// Dof numbers of the nodes that act in an element, FIXED where held; length n d.
pub(super) fn element_dofs(acting: &[u32], dofs: &DofMap, out: &mut Vec<u32>) {
    out.clear();
    out.extend(acting.iter().flat_map(|&node| dofs.free(node as usize)));
}

/// Which free degrees of freedom couple through an element.
pub fn pattern(points: &IntegrationPoints, dofs: &DofMap) -> Pattern {
    let cliques: Vec<Vec<u32>> = (0..points.elements())
        .map(|e| {
            let mut clique = Vec::new();
            element_dofs(points.acting(e), dofs, &mut clique);
            clique
        })
        .collect();
    Pattern::from_cliques(dofs.len(), cliques.iter().map(Vec::as_slice))
}

/// The stiffness matrix over the free degrees of freedom, in N/m; `pattern` as [`pattern`] makes it.
///
/// # Errors
/// Those of [`IntegrationPoints::fill`].
pub fn stiffness(points: &IntegrationPoints, lame: Lame, dofs: &DofMap, pattern: &Pattern) -> Result<CsrMatrix<f64>> {
    assemble(pattern, points.elements(), Workspace::default, |e, work: &mut Workspace, matrix: &mut ElementMatrix| {
        points.fill(e, &mut work.points)?;
        element_dofs(points.acting(e), dofs, &mut matrix.dofs);
        element(&work.points, points.dimension(), lame, &mut work.products, &mut matrix.values);
        Ok(())
    })
}

/// Nodal forces f_a = sum_b K_ab u_b of a displacement given at all nodes, fixed ones included; n x 3, in N.
///
/// These are the reactions of the supports where the body is held, and with a sign the right-hand side that a
/// prescribed displacement adds.
///
/// # Errors
/// Those of [`IntegrationPoints::fill`].
pub fn internal_forces(points: &IntegrationPoints, lame: Lame, displacement: &[[f64; 3]]) -> Result<Vec<[f64; 3]>> {
    let parts = points.map(|e, filled| {
        let acting = points.acting(e);
        let mut forces = vec![[0.0; 3]; acting.len()];
        let mean_trace = filled.mean_trace(acting, displacement);
        for (q, gradients) in filled.gradients.chunks_exact(acting.len().max(1)).enumerate() {
            let gradient = displacement_gradient(acting, gradients, displacement);
            let mut stress = lame.stress(&gradient);
            if let Some(mean) = mean_trace {
                // the volumetric stress acts through the mean gradients instead
                let trace = gradient[0][0] + gradient[1][1] + gradient[2][2];
                (0..3).for_each(|i| stress[i][i] -= lame.volumetric() * trace);
                for (force, gradient) in forces.iter_mut().zip(&filled.mean_gradients) {
                    (0..3).for_each(|i| force[i] += filled.volumes[q] * lame.volumetric() * mean * gradient[i]);
                }
            }
            for (force, gradient) in forces.iter_mut().zip(gradients) {
                for (f, row) in force.iter_mut().zip(&stress).take(points.dimension()) {
                    *f += filled.volumes[q] * (row[0] * gradient[0] + row[1] * gradient[1] + row[2] * gradient[2]);
                }
            }
        }
        forces
    })?;
    let mut sums = vec![[0.0; 3]; points.nodes()];
    for (e, forces) in parts.iter().enumerate() {
        for (&node, force) in points.acting(e).iter().zip(forces) {
            (0..3).for_each(|i| sums[node as usize][i] += force[i]);
        }
    }
    Ok(sums)
}
