//! The load that a network resists least, beside the continuum: how near it is to a mechanism.
//!
//! A fit on few loads may take springs away that no fitted load needs, and open the network for others. A load f moves
//! the continuum by K_ref^-1 f and the network by K(phi)^-1 f; the *compliance ratio* compares the work it does,
//!
//! ```text
//! mu = max over f of (f . K(phi)^-1 f) / (f . K_ref^-1 f)
//! ```
//!
//! 1 for a network that is right for every load; infinite for a mechanism. 1 / mu is the smallest eigenvalue of K(phi)
//! relative to K_ref.
//!
//! Over all loads that is no use: springs cannot follow waves as short as a cell, and sound networks of the torus
//! have mu from 10 to 50 there (measured), as do those that are open. So f runs over the loads that are linear in
//! the place x: pulls, torsions, bendings and stretches in all directions, 12 in space and 6 in the plane, a few solves. On the
//! merged torus mu is then 2.4 to 3.7 for fits on the load of the source alone, whose errors on other loads are 20 to
//! 78 %, and 1.0 to 1.4 for fits on four loads, with 14 to 20 %; with one group a spring and a prior, 3.7 (77.5 %) and 1.4
//! (13.9 %).
//!
//! With F made orthonormal in the energy of the continuum, F^T K_ref^-1 F = 1, mu is the largest eigenvalue of
//! F^T K(phi)^-1 F.

use crate::error::Result;
use crate::geometry::dofs::{DofMap, FIXED};
use crate::sparse::vectors::{add, dot, norm, scale};
use crate::springs::solver::SpringSolver;

/// A load whose part of its own is less than this fraction of its energy follows from the others.
const DEPENDENT: f64 = 1e-10;

/// Rounds of the power method on a matrix of at most 12 rows; it need not separate equal eigenvalues.
const ROUNDS: usize = 300;

/// Largest relative residual of a solve.
const TOLERANCE: f64 = 1e-6;

/// The motion under the load that a network resists least.
#[derive(Debug, Clone, PartialEq)]
pub struct Softest {
    /// mu.
    pub ratio: f64,
    /// K(phi)^-1 f over the free degrees of freedom, norm 1.
    pub motion: Vec<f64>,
    /// Loads that were tried.
    pub loads: usize,
}

/// The forces on the free degrees of freedom that are linear in the place of their node, one after the other; `positions` in m.
pub fn linear_loads(positions: &[[f64; 3]], dofs: &DofMap) -> Vec<f64> {
    let (n, dimension) = (dofs.len(), dofs.dimension());
    let mean = |a: usize| positions.iter().map(|x| x[a]).sum::<f64>() / positions.len().max(1) as f64;
    let centre = [mean(0), mean(1), mean(2)];
    let mut loads = vec![0.0; n * dimension * (dimension + 1)];
    for (i, load) in loads.chunks_exact_mut(n.max(1)).enumerate() {
        let (component, along) = (i / (dimension + 1), i % (dimension + 1));
        for node in dofs.masters() {
            let dof = dofs.free(node)[component];
            if dof != FIXED {
                load[dof as usize] = if along == dimension { 1.0 } else { positions[node][along] - centre[along] };
            }
        }
    }
    loads
}

/// Finds it among the loads `forces` (N) under which the continuum moves by `answers` (m), both loads x n. `solver` holds
/// K(phi).
///
/// # Errors
/// Where a solve is not accurate.
pub fn softest(solver: &mut SpringSolver, forces: Vec<f64>, answers: Vec<f64>) -> Result<Softest> {
    let n = solver.unknowns();
    let forces = orthonormal(n, forces, answers);
    let loads = forces.len() / n.max(1);
    let mut moved = vec![0.0; forces.len()];
    solver.solve(&forces, &mut moved, TOLERANCE)?;
    let work = |i: usize, j: usize| dot(&forces[i * n..(i + 1) * n], &moved[j * n..(j + 1) * n]);
    let matrix: Vec<f64> = (0..loads * loads).map(|at| work(at / loads, at % loads)).collect();
    let (ratio, worst) = largest(&matrix, loads);
    let mut motion = vec![0.0; n];
    worst.iter().zip(moved.chunks_exact(n)).for_each(|(part, moved)| add(*part, moved, &mut motion));
    let length = norm(&motion);
    if length > 0.0 {
        scale(1.0 / length, &mut motion);
    }
    Ok(Softest { ratio, motion, loads })
}

/// Loads with f_i . u_j = 1 for i = j and 0 otherwise, u_j the answer of the continuum to f_j; without those that follow
/// from others.
fn orthonormal(n: usize, forces: Vec<f64>, answers: Vec<f64>) -> Vec<f64> {
    let (mut kept, mut kept_answers): (Vec<f64>, Vec<f64>) = (vec![], vec![]);
    for (f, u) in forces.chunks_exact(n).zip(answers.chunks_exact(n)) {
        let (mut f, mut u) = (f.to_vec(), u.to_vec());
        let before = dot(&f, &u);
        // twice, so that rounding does not stay
        for _ in 0..2 {
            for (other, answer) in kept.chunks_exact(n).zip(kept_answers.chunks_exact(n)) {
                let shared = dot(other, &u);
                add(-shared, other, &mut f);
                add(-shared, answer, &mut u);
            }
        }
        let own = dot(&f, &u);
        if own > DEPENDENT * before {
            scale(1.0 / own.sqrt(), &mut f);
            scale(1.0 / own.sqrt(), &mut u);
            kept.extend(f);
            kept_answers.extend(u);
        }
    }
    kept
}

/// The largest eigenvalue of a symmetric positive matrix and its vector, norm 1.
fn largest(matrix: &[f64], size: usize) -> (f64, Vec<f64>) {
    let mut vector = vec![1.0 / (size.max(1) as f64).sqrt(); size];
    let mut value = 0.0;
    for _ in 0..ROUNDS {
        let next: Vec<f64> = matrix.chunks_exact(size.max(1)).map(|row| dot(row, &vector)).collect();
        value = dot(&vector, &next);
        let length = norm(&next);
        if length.is_nan() || length <= 0.0 {
            break;
        }
        vector = next.iter().map(|x| x / length).collect();
    }
    (value, vector)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_eigenvalue_and_its_vector() {
        let (value, vector) = largest(&[2.0, 1.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0], 3);
        assert!((value - 3.0).abs() < 1e-14, "{value}");
        assert!((vector[0] - vector[1]).abs() < 1e-12 && vector[2].abs() < 1e-12, "{vector:?}");
    }

    #[test]
    fn loads_are_made_orthonormal_in_energy_and_dependent_ones_left_out() {
        // K_ref = diag(1, 4): u = (f_x, f_y / 4)
        let forces = vec![1.0, 0.0, 2.0, 2.0, 3.0, 2.0];
        let answers = forces.chunks(2).flat_map(|f| [f[0], f[1] / 4.0]).collect();
        let found = orthonormal(2, forces, answers);
        assert_eq!(found.len(), 4);
        assert!((found[0] - 1.0).abs() < 1e-15 && found[1].abs() < 1e-15);
        assert!(found[2].abs() < 1e-15 && (found[3] - 2.0).abs() < 1e-15, "{found:?}");
    }
}
