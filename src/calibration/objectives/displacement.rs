//! The displacement objective (5.7): the network shall move as the continuum does under the same forces.
//!
//! u(phi) = K(phi)^-1 f; for load case c with reference displacement u_ref
//!
//! e_c = 100 sqrt(mean_i |u_ref,i - u_i|^2) / max_i |u_ref,i|      over all n_p control points, fixed ones included,
//!
//! and e = sqrt(mean_c e_c^2). As a residual vector: r = w_c (u_c - u_ref,c) with w_c = 100 / (max |u_ref,c| sqrt(n_p
//! n_c)), so e = |r|.
//!
//! Its Jacobian is exact: K is linear in phi, K = sum_a phi_a K_a, hence du/dphi_a = -K^-1 K_a u, with the factor that
//! gave u. And sum_a phi_a du/dphi_a = -u: one column follows from the others and costs no solve.
//!
//! Scaling: K(s phi) = s K(phi), so u(s phi) = u(phi) / s. The best common factor of all stiffnesses is therefore known
//! from inner products alone: 1/s = sum_c w_c^2 u_c.u_ref,c / sum_c w_c^2 |u_c|^2.

use crate::calibration::objective::{Counts, Objective};
use crate::clock::Interrupt;
use crate::error::{Error, Result};
use crate::sparse::vectors::{add, dot, norm, scale, square_of_difference};
use crate::springs::members::Members;
use crate::springs::solver::{Settings, SpringOperator, SpringSolver};

/// Relative residual that is enough for a column of the Jacobian: steps are inexact anyway.
const COLUMN_TOLERANCE: f64 = 1e-6;

/// The fixed part of a displacement problem, shared by its workers.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The springs with their groups.
    pub operator: &'a SpringOperator<'a>,
    /// Upper bounds of phi, length m.
    pub upper: &'a [f64],
    /// Forces of all load cases over the free dofs, one after the other (cases x n), in N.
    pub forces: &'a [f64],
    /// Reference displacements, like the forces, in m.
    pub reference: &'a [f64],
    /// Weight w_c of each case, in percent per metre; see [`weights`].
    pub weights: &'a [f64],
}

/// The weights w_c that turn displacement differences into percent (5.7).
///
/// `largest[c]`: max_i |u_ref,i| of case c in m; `nodes`: the number n_p of control points.
pub fn weights(largest: &[f64], nodes: usize) -> Vec<f64> {
    let count = (nodes * largest.len()) as f64;
    largest.iter().map(|u| 100.0 / (u * count.sqrt())).collect()
}

/// One worker of a displacement problem.
pub struct Displacement<'a> {
    target: Target<'a>,
    solver: SpringSolver<'a>,
    tolerance: f64,
    phi: Vec<f64>,
    /// K(phi) is this times the matrix that `solver` holds.
    scale: f64,
    displacement: Vec<f64>,
    right: Vec<f64>,
    solved: Vec<f64>,
    found: Vec<f64>,
    counts: Counts,
}

impl<'a> Displacement<'a> {
    /// A worker that factors K(phi) in double precision for every phi: the exact path.
    pub fn new(target: Target<'a>) -> Self {
        Self::with_solver(target, &Settings::DIRECT)
    }

    /// A worker that solves as the settings say.
    pub fn with_solver(target: Target<'a>, settings: &Settings) -> Self {
        Self {
            solver: SpringSolver::new(target.operator, settings),
            tolerance: settings.tolerance,
            phi: vec![0.0; target.upper.len()],
            scale: 1.0,
            displacement: vec![0.0; target.forces.len()],
            right: Vec::new(),
            solved: Vec::new(),
            found: Vec::new(),
            counts: Counts::default(),
            target,
        }
    }

    /// Ends solves that iterate when the user stops the run.
    pub fn watching(mut self, interrupt: &Interrupt) -> Self {
        self.solver.watch(interrupt);
        self
    }

    /// Displacements of all cases at the last phi, like the forces (cases x n), in m.
    pub fn displacement(&self) -> &[f64] {
        &self.displacement
    }

    /// The problem it works on.
    pub fn target(&self) -> Target<'a> {
        self.target
    }

    fn unknowns(&self) -> usize {
        self.solver.unknowns()
    }

    /// The error of the displacements.
    fn distance(&self) -> f64 {
        let n = self.unknowns();
        let cases = self.displacement.chunks_exact(n).zip(self.target.reference.chunks_exact(n));
        let squares =
            cases.zip(self.target.weights).map(|((u, reference), w)| w * w * square_of_difference(u, reference));
        squares.sum::<f64>().sqrt()
    }

    /// The column of the Jacobian that costs no solve: the group that carries the most.
    fn free_column(&self, applied: &[f64]) -> Option<usize> {
        let share = |a: usize| self.phi[a] * applied[a];
        (0..self.phi.len()).filter(|&a| share(a) > 0.0).max_by(|&a, &b| share(a).total_cmp(&share(b)))
    }

    /// K^-1 K_a u = -du/dphi_a of one case at the last phi for every group but the free one, which is returned. `found`
    /// (groups x n) holds guesses and takes the answers; the place of the free group is left as it is.
    fn differentiate(&mut self, case: usize, found: &mut [f64], tolerance: f64) -> Result<Option<usize>> {
        let (n, m) = (self.unknowns(), self.phi.len());
        let u = &self.displacement[case * n..(case + 1) * n];
        self.right.resize(n * m, 0.0);
        self.solved.resize(n * m, 0.0);
        let mut applied = vec![0.0; m];
        for (a, column) in self.right.chunks_exact_mut(n).enumerate() {
            self.solver.apply(a, u, column);
            applied[a] = norm(column);
        }
        let free = self.free_column(&applied);
        if let Some(free) = free {
            self.right.copy_within((free + 1) * n.., free * n);
        }
        let columns: Vec<usize> = (0..m).filter(|&a| Some(a) != free).collect();
        for (&a, guess) in columns.iter().zip(self.solved.chunks_exact_mut(n)) {
            guess.copy_from_slice(&found[a * n..(a + 1) * n]);
            scale(self.scale, guess);
        }
        let count = columns.len() * n;
        self.solver.solve(&self.right[..count], &mut self.solved[..count], tolerance.max(self.tolerance))?;
        self.counts.solves += columns.len() as u64;
        for (&a, solved) in columns.iter().zip(self.solved.chunks_exact(n)) {
            let found = &mut found[a * n..(a + 1) * n];
            found.copy_from_slice(solved);
            scale(1.0 / self.scale, found);
        }
        Ok(free)
    }

    /// The derivatives K^-1 K_a u of all cases at the last phi (cases x groups x n), to a residual of `tolerance`; `found`
    /// holds guesses or zeros. Where a group is free, its derivative follows from the others and zeros stand there.
    ///
    /// # Errors
    /// Where a solve is not accurate.
    pub fn derivatives(&mut self, found: &mut [f64], tolerance: f64) -> Result<()> {
        let n = self.unknowns();
        let of_case = n * self.phi.len();
        for (case, found) in found.chunks_exact_mut(of_case).enumerate() {
            if let Some(free) = self.differentiate(case, found, tolerance)? {
                found[free * n..(free + 1) * n].fill(0.0);
            }
        }
        Ok(())
    }

    /// Columns w_c du_c/dphi_a of one case, written with stride into the Jacobian.
    fn fill_columns(&mut self, case: usize, rows: usize, jacobian: &mut [f64]) -> Result<()> {
        let n = self.unknowns();
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        found.resize(n * self.phi.len(), 0.0);
        let free = self.differentiate(case, &mut found, COLUMN_TOLERANCE)?;
        let weight = self.target.weights[case];
        let mut rest: Vec<f64> = self.displacement[case * n..(case + 1) * n].iter().map(|u| -u * weight).collect();
        for (a, found) in found.chunks_exact(n).enumerate().filter(|(a, _)| Some(*a) != free) {
            let column = &mut jacobian[a * rows + case * n..a * rows + (case + 1) * n];
            column.iter_mut().zip(found).for_each(|(entry, found)| *entry = -weight * found);
            add(-self.phi[a], column, &mut rest);
        }
        if let Some(free) = free {
            for (entry, rest) in jacobian[free * rows + case * n..].iter_mut().zip(&rest) {
                *entry = rest / self.phi[free];
            }
        }
        self.found = found;
        Ok(())
    }

    /// The residual w_c (u_c - u_ref,c) at the last phi (cases x n), percent.
    pub fn residual(&self) -> Vec<f64> {
        let n = self.unknowns();
        let cases =
            self.displacement.chunks_exact(n).zip(self.target.reference.chunks_exact(n)).zip(self.target.weights);
        cases.flat_map(|((u, reference), w)| u.iter().zip(reference).map(move |(u, r)| w * (u - r))).collect()
    }

    /// The change of the residual to first order when phi changes by `change`: one solve for each case.
    ///
    /// # Errors
    /// Where a solve is not accurate.
    pub fn along(&mut self, members: &Members, change: &[f64]) -> Result<Vec<f64>> {
        let n = self.unknowns();
        let mut right = vec![0.0; self.displacement.len()];
        for (u, out) in self.displacement.chunks_exact(n).zip(right.chunks_exact_mut(n)) {
            members.apply_all(change, u, out);
        }
        let mut found = self.solve_again(&right)?;
        for (found, w) in found.chunks_exact_mut(n).zip(self.target.weights) {
            scale(-w / self.scale, found);
        }
        Ok(found)
    }

    /// v^T dr/dphi_a for every group: the adjoint, one solve for each case. `v` like the residual.
    ///
    /// # Errors
    /// Where a solve is not accurate.
    pub fn adjoint(&mut self, members: &Members, v: &[f64]) -> Result<Vec<f64>> {
        let n = self.unknowns();
        let adjoint = self.solve_again(v)?;
        let mut elongations = [vec![0.0; members.len()], vec![0.0; members.len()]];
        let mut slopes = vec![0.0; members.groups()];
        let cases = self.displacement.chunks_exact(n).zip(adjoint.chunks_exact(n)).zip(self.target.weights);
        for ((u, z), w) in cases {
            members.elongations(u, &mut elongations[0]);
            members.elongations(z, &mut elongations[1]);
            for (a, slope) in slopes.iter_mut().enumerate() {
                let group = members.group(a);
                *slope -= w / self.scale * dot(&elongations[0][group.clone()], &elongations[1][group]);
            }
        }
        Ok(slopes)
    }

    /// Solves for other right-hand sides with the matrix at hand, loosely.
    fn solve_again(&mut self, right: &[f64]) -> Result<Vec<f64>> {
        let mut found = vec![0.0; right.len()];
        self.solver.solve(right, &mut found, COLUMN_TOLERANCE.max(self.tolerance))?;
        self.counts.solves += self.target.weights.len() as u64;
        Ok(found)
    }

    /// What the next solve begins with (cases x n, in m): by itself the displacements at the phi before.
    pub fn begin_with(&mut self) -> &mut [f64] {
        &mut self.displacement
    }

    /// [`Objective::error`] with displacements whose residual |f - K u| / |f| is at most `tolerance` (on a path that iterates).
    ///
    /// # Errors
    /// As [`Objective::error`].
    pub fn error_within(&mut self, phi: &[f64], tolerance: f64) -> Result<f64> {
        self.counts.evaluations += 1;
        self.phi.copy_from_slice(phi);
        self.scale = 1.0;
        let tolerance = tolerance.max(self.tolerance);
        let set = self.solver.set(phi);
        let outcome = set.and_then(|()| self.solver.solve(self.target.forces, &mut self.displacement, tolerance));
        if let Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) = outcome {
            self.counts.rejected += 1;
        }
        outcome?;
        self.counts.solves += self.target.weights.len() as u64;
        Ok(self.distance())
    }
}

impl Objective for Displacement<'_> {
    fn error(&mut self, phi: &[f64]) -> Result<f64> {
        self.error_within(phi, self.tolerance)
    }

    fn fit_scale(&mut self, phi: &mut [f64]) -> f64 {
        let n = self.unknowns();
        let (mut with_reference, mut with_itself) = (0.0, 0.0);
        let cases = self.displacement.chunks_exact(n).zip(self.target.reference.chunks_exact(n));
        for ((u, reference), w) in cases.zip(self.target.weights) {
            with_reference += w * w * dot(u, reference);
            with_itself += w * w * dot(u, u);
        }
        let largest = self.phi.iter().zip(self.target.upper).fold(f64::INFINITY, |s, (p, u)| s.min(u / p));
        // displacements that point away from the reference have no best positive factor: leave them
        let best = if with_reference > 0.0 { (with_itself / with_reference).min(largest) } else { 1.0 };
        for (p, upper) in self.phi.iter_mut().zip(self.target.upper) {
            *p = (*p * best).min(*upper);
        }
        scale(1.0 / best, &mut self.displacement);
        self.scale *= best;
        phi.copy_from_slice(&self.phi);
        self.distance()
    }

    fn linearise(&mut self, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) -> Result<()> {
        let n = self.unknowns();
        let rows = self.displacement.len();
        residual.clear();
        for (case, w) in self.target.weights.iter().enumerate() {
            let range = case * n..(case + 1) * n;
            let pairs = self.displacement[range.clone()].iter().zip(&self.target.reference[range]);
            residual.extend(pairs.map(|(u, reference)| w * (u - reference)));
        }
        jacobian.clear();
        jacobian.resize(rows * self.phi.len(), 0.0);
        (0..self.target.weights.len()).try_for_each(|case| self.fill_columns(case, rows, jacobian))
    }

    fn counts(&self) -> Counts {
        self.counts.with(self.solver.work())
    }
}
