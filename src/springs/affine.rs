//! The stiffness matrix of the springs as a function of the numbers of the groups.
//!
//! ```text
//! K(phi) = sum_a phi_a K_a,      K_a = sum over the springs s of group a of w_s b_s b_s^T,      b_s = (-d_s, d_s)
//! ```
//!
//! over the free degrees of freedom. K is linear in phi, and its pattern does not depend on phi, so that changing phi
//! is a gather: each entry of the permuted lower triangle that the factorisation reads is a short sum
//!
//! ```text
//! K_e(phi) = sum_t phi[group_t] c_t
//! ```
//!
//! whose terms (group, coefficient) are collected once: one term for a block between two nodes, one for each group
//! around a node on the diagonal. The order of every sum is fixed, so the bits are the same for ever. The products K_a u and
//! K(phi) u come from the springs themselves ([`AffineStiffness::members`]). phi in N/m (or N), K in N/m.

use crate::geometry::dofs::DofMap;
use crate::sparse::cholesky::Symbolic;
use crate::sparse::pattern::Pattern;

use super::grouping::Grouping;
use super::members::{Members, unknowns};
use super::network::Network;

/// K(phi) on one analysed pattern. Immutable: workers share it.
#[derive(Debug, Clone)]
pub struct AffineStiffness {
    terms: Terms,
    members: Members,
}

/// The terms of every entry of the permuted lower triangle, entry by entry.
#[derive(Debug, Clone)]
struct Terms {
    starts: Vec<u32>,
    groups: Vec<u32>,
    coefficients: Vec<f64>,
}

/// Which free degrees of freedom the springs couple.
pub fn pattern(network: &Network, dofs: &DofMap) -> Pattern {
    let cliques: Vec<[[u32; 3]; 2]> = network.springs.iter().map(|spring| unknowns(spring.nodes, dofs)).collect();
    Pattern::from_cliques(dofs.len(), cliques.iter().map(|ends| ends.as_flattened()))
}

impl AffineStiffness {
    /// Collects the terms.
    ///
    /// `coefficients` is w_s of every spring ([`super::weighting::coefficients`]); `symbolic` is the analysis of a
    /// pattern that contains [`pattern`]`(network, dofs)`.
    ///
    /// # Panics
    /// When there is not one group and one coefficient for every spring, or the pattern lacks an entry.
    pub fn new(
        network: &Network,
        grouping: &Grouping,
        coefficients: &[f64],
        dofs: &DofMap,
        symbolic: &Symbolic,
    ) -> Self {
        let members = Members::new(network, grouping, coefficients, dofs);
        Self { terms: Terms::collect(&members, symbolic), members }
    }

    /// The springs without the matrix.
    pub fn members(&self) -> &Members {
        &self.members
    }

    /// Number of free degrees of freedom.
    pub fn unknowns(&self) -> usize {
        self.members.unknowns()
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.members.groups()
    }

    /// Writes K(phi) into the permuted lower triangle (`sparse::cholesky::Factor::values_mut`).
    ///
    /// # Panics
    /// When `phi` has not one number for every group, or `values` another length than the triangle.
    pub fn assemble_into(&self, phi: &[f64], values: &mut [f64]) {
        assert_eq!(phi.len(), self.groups(), "one number for every group");
        assert_eq!(values.len() + 1, self.terms.starts.len(), "the values of the analysed triangle");
        for (value, ends) in values.iter_mut().zip(self.terms.starts.windows(2)) {
            let terms = ends[0] as usize..ends[1] as usize;
            let pairs = self.terms.groups[terms.clone()].iter().zip(&self.terms.coefficients[terms]);
            *value = pairs.fold(0.0, |sum, (&group, c)| sum + phi[group as usize] * c);
        }
    }

    /// out = K_a u: [`Members::apply`].
    pub fn apply(&self, group: usize, u: &[f64], out: &mut [f64]) {
        self.members.apply(group, u, out);
    }

    /// out = K(phi) u: [`Members::apply_all`].
    pub fn apply_all(&self, phi: &[f64], u: &[f64], out: &mut [f64]) {
        self.members.apply_all(phi, u, out);
    }

    /// out = diagonal of K(phi): [`Members::diagonal`].
    pub fn diagonal(&self, phi: &[f64], out: &mut [f64]) {
        self.members.diagonal(phi, out);
    }
}

impl Terms {
    /// Sorts the entries of all springs by their place in the triangle, then joins those of one group. The members come
    /// group by group, so the terms of one entry do too.
    fn collect(members: &Members, symbolic: &Symbolic) -> Self {
        let mut rank = vec![0; symbolic.len()];
        for (k, &unknown) in symbolic.order().iter().enumerate() {
            rank[unknown as usize] = k as u32;
        }
        let entries = symbolic.lower_rows().len();
        let mut next = vec![0_usize; entries + 1];
        for member in members.by_group().flatten() {
            member.for_each_entry(&rank, |row, column, _| next[place(symbolic, row, column) + 1] += 1);
        }
        for entry in 0..entries {
            next[entry + 1] += next[entry];
        }
        let bounds = next.clone();
        let mut all = vec![(0_u32, 0.0); bounds[entries]];
        for (group, members) in members.by_group().enumerate() {
            for member in members {
                member.for_each_entry(&rank, |row, column, value| {
                    let entry = place(symbolic, row, column);
                    all[next[entry]] = (group as u32, value);
                    next[entry] += 1;
                });
            }
        }
        Self::joined(&bounds, &all)
    }

    /// Adds up the neighbouring terms of one entry that belong to one group.
    fn joined(bounds: &[usize], all: &[(u32, f64)]) -> Self {
        let mut terms = Self { starts: vec![0], groups: Vec::new(), coefficients: Vec::new() };
        for ends in bounds.windows(2) {
            let first = terms.groups.len();
            for &(group, value) in &all[ends[0]..ends[1]] {
                if terms.groups.len() > first && terms.groups.last() == Some(&group) {
                    *terms.coefficients.last_mut().expect("as many coefficients as groups") += value;
                } else {
                    terms.groups.push(group);
                    terms.coefficients.push(value);
                }
            }
            terms.starts.push(terms.groups.len() as u32);
        }
        terms
    }
}

/// Where the entry (row, column), in elimination order, is in the permuted lower triangle.
fn place(symbolic: &Symbolic, row: u32, column: u32) -> usize {
    let starts = symbolic.lower_starts();
    let first = starts[column as usize] as usize;
    let rows = &symbolic.lower_rows()[first..starts[column as usize + 1] as usize];
    first + rows.binary_search(&row).expect("the analysed pattern contains the springs")
}
