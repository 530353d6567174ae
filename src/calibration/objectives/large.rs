//! The displacement objective (5.7) under large displacements: the network shall move as far as a body that turns.
//!
//! The displacements u_c(phi) are those of the full spring forces in equilibrium with the load ([`crate::springs::statics`]);
//! residual and weights are those of [`super::displacement`]. The internal force g(phi, u) = sum_a phi_a g_a(u) is linear in
//! phi, so differentiating g(phi, u(phi)) = f gives the Jacobian with one factorisation a load case,
//!
//! ```text
//! K_t du/dphi_a = - g_a(u),     K_t = dg/du at the equilibrium
//! ```
//!
//! Every answer is sought from rest by the same steps of the load, so that u(phi) is one function of phi also where a network
//! has several equilibria.
//!
//! Scaling all stiffnesses does not scale u any more, so no common factor is known from inner products, and a network that
//! is far too soft may find no equilibrium at all. The search therefore begins at the answer of the linear problem, K(phi) u = f
//! against the body linearised at rest: the stiffness of a network hardly depends on how far it is bent. Where that answer has
//! groups of hardly any stiffness its network may fold under the full load, so a second search begins with one stiffness for
//! all groups.

use std::sync::Arc;

use crate::calibration::objective::{Counts, Objective};
use crate::clock::Interrupt;
use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::sparse::cholesky::Symbolic;
use crate::sparse::equilibrium::{Newton, Potential, Search};
use crate::springs::grouping::Grouping;
use crate::springs::network::Network;
use crate::springs::statics::LargeSprings;

/// The fixed part of the problem of a grouping.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The springs.
    pub network: &'a Network,
    /// Their groups.
    pub grouping: &'a Grouping,
    /// w_s of every spring, 1 or 1/m.
    pub coefficients: &'a [f64],
    /// The degrees of freedom.
    pub dofs: &'a DofMap,
    /// The analysis of the pattern of the network.
    pub symbolic: &'a Arc<Symbolic>,
    /// How equilibrium is sought from rest.
    pub search: Search,
    /// Displacements of the body linearised at rest under the fitted cases (cases x n), m.
    pub linear: &'a [f64],
}

/// Forces, reference displacements (cases x n) and weights of the cases, as in [`super::displacement::Target`].
#[derive(Clone, Copy)]
pub struct Cases<'a> {
    /// N.
    pub forces: &'a [f64],
    /// m.
    pub reference: &'a [f64],
    /// Percent per metre.
    pub weights: &'a [f64],
}

impl<'a> Target<'a> {
    fn springs(&self) -> LargeSprings<'a> {
        LargeSprings::new(self.network, self.grouping, self.coefficients, self.dofs)
    }
}

/// One worker of the problem.
pub struct LargeDisplacement<'a> {
    target: Target<'a>,
    cases: Cases<'a>,
    springs: LargeSprings<'a>,
    newton: Newton,
    phi: Vec<f64>,
    /// Displacements at the last phi that had an equilibrium (cases x n), m.
    displacement: Vec<f64>,
    counts: Counts,
}

impl<'a> LargeDisplacement<'a> {
    /// A worker.
    pub fn new(target: Target<'a>, cases: Cases<'a>, interrupt: &Interrupt) -> Self {
        let springs = target.springs();
        Self {
            newton: Newton::with(springs.pattern(), target.symbolic).watching(interrupt),
            phi: vec![0.0; target.grouping.groups.len()],
            displacement: vec![0.0; cases.forces.len()],
            counts: Counts::default(),
            springs,
            target,
            cases,
        }
    }

    /// The equilibrium of every case.
    fn solve(&mut self) -> Result<Vec<f64>> {
        let n = self.target.dofs.len();
        let rest = vec![0.0; n];
        let mut found = Vec::with_capacity(self.displacement.len());
        for forces in self.cases.forces.chunks_exact(n) {
            let answer = self.newton.solve(&mut self.springs, forces, &rest, self.target.search)?;
            self.counts.refactorisations += answer.factorisations as u64;
            self.counts.solves += answer.iterations as u64;
            found.extend(answer.displacement);
        }
        Ok(found)
    }

    /// w_c (u_c - u_ref,c), case after case.
    fn residual(&self) -> impl Iterator<Item = f64> + '_ {
        let n = self.target.dofs.len();
        let pairs = self.displacement.iter().zip(self.cases.reference).enumerate();
        pairs.map(move |(i, (u, reference))| self.cases.weights[i / n] * (u - reference))
    }

    fn distance(&self) -> f64 {
        self.residual().map(|r| r * r).sum::<f64>().sqrt()
    }
}

impl Objective for LargeDisplacement<'_> {
    fn error(&mut self, phi: &[f64]) -> Result<f64> {
        self.counts.evaluations += 1;
        self.springs.set(phi);
        let found = self.solve();
        if matches!(found, Err(Error::NoEquilibrium { .. })) {
            self.counts.rejected += 1;
        }
        self.displacement = found?;
        self.phi.copy_from_slice(phi);
        Ok(self.distance())
    }

    fn fit_scale(&mut self, phi: &mut [f64]) -> f64 {
        phi.copy_from_slice(&self.phi);
        self.distance()
    }

    fn linearise(&mut self, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) -> Result<()> {
        let (n, m, rows) = (self.target.dofs.len(), self.phi.len(), self.displacement.len());
        residual.clear();
        residual.extend(self.residual());
        jacobian.clear();
        jacobian.resize(rows * m, 0.0);
        self.springs.set(&self.phi);
        let (mut forces, mut columns) = (vec![0.0; n * m], vec![0.0; n * m]);
        for (case, u) in self.displacement.chunks_exact(n).enumerate() {
            self.springs.place(u);
            forces.chunks_exact_mut(n).enumerate().for_each(|(a, column)| self.springs.force_of(a, column));
            self.newton.respond(&mut self.springs, &forces, &mut columns)?;
            self.counts.refactorisations += 1;
            self.counts.solves += m as u64;
            for (a, column) in columns.chunks_exact(n).enumerate() {
                let entries = &mut jacobian[a * rows + case * n..][..n];
                entries.iter_mut().zip(column).for_each(|(entry, u)| *entry = -self.cases.weights[case] * u);
            }
        }
        Ok(())
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}
