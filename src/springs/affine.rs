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
//! around a node on the diagonal. The order of every sum is fixed, so the bits are the same for ever. Beside it stand
//! the products K_a u and K(phi) u from the springs themselves, without a matrix. phi in N/m (or N), K in N/m.

use std::ops::Range;

use crate::geometry::dofs::{DofMap, FIXED};
use crate::sparse::cholesky::Symbolic;
use crate::sparse::pattern::Pattern;

use super::grouping::Grouping;
use super::network::Network;

/// K(phi) on one analysed pattern. Immutable: workers share it.
#[derive(Debug, Clone)]
pub struct AffineStiffness {
    unknowns: usize,
    groups: usize,
    terms: Terms,
    members: Vec<Member>,
    member_starts: Vec<usize>,
}

/// The terms of every entry of the permuted lower triangle, entry by entry.
#[derive(Debug, Clone)]
struct Terms {
    starts: Vec<u32>,
    groups: Vec<u32>,
    coefficients: Vec<f64>,
}

/// A spring as the products need it.
#[derive(Debug, Clone, Copy)]
struct Member {
    /// Unknowns of the two ends; [`FIXED`] where held, and beyond the dimension.
    ends: [[u32; 3]; 2],
    direction: [f64; 3],
    coefficient: f64,
}

/// Which free degrees of freedom the springs couple.
pub fn pattern(network: &Network, dofs: &DofMap) -> Pattern {
    let cliques: Vec<[[u32; 3]; 2]> = network.springs.iter().map(|spring| unknowns(spring.nodes, dofs)).collect();
    Pattern::from_cliques(dofs.len(), cliques.iter().map(|ends| ends.as_flattened()))
}

/// Unknowns of the components of two nodes, padded with [`FIXED`].
fn unknowns(nodes: [u32; 2], dofs: &DofMap) -> [[u32; 3]; 2] {
    nodes.map(|node| {
        let mut padded = [FIXED; 3];
        padded[..dofs.dimension()].copy_from_slice(dofs.free(node as usize));
        padded
    })
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
        assert_eq!(network.springs.len(), grouping.group_of.len(), "one group for every spring");
        assert_eq!(network.springs.len(), coefficients.len(), "one coefficient for every spring");
        let member = |s: usize| Member {
            ends: unknowns(network.springs[s].nodes, dofs),
            direction: network.springs[s].direction,
            coefficient: coefficients[s],
        };
        let mut by_group: Vec<usize> = (0..network.springs.len()).collect();
        by_group.sort_by_key(|&s| grouping.group_of[s]);
        let members: Vec<Member> = by_group.into_iter().map(member).collect();
        let mut member_starts = vec![0];
        for group in &grouping.groups {
            member_starts.push(member_starts[member_starts.len() - 1] + group.springs);
        }
        let terms = Terms::collect(&members, &member_starts, symbolic);
        Self { unknowns: dofs.len(), groups: grouping.groups.len(), terms, members, member_starts }
    }

    /// Number of free degrees of freedom.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// Writes K(phi) into the permuted lower triangle (`sparse::cholesky::Factor::values_mut`).
    ///
    /// # Panics
    /// When `phi` has not one number for every group, or `values` another length than the triangle.
    pub fn assemble_into(&self, phi: &[f64], values: &mut [f64]) {
        assert_eq!(phi.len(), self.groups, "one number for every group");
        assert_eq!(values.len() + 1, self.terms.starts.len(), "the values of the analysed triangle");
        for (value, ends) in values.iter_mut().zip(self.terms.starts.windows(2)) {
            let terms = ends[0] as usize..ends[1] as usize;
            let pairs = self.terms.groups[terms.clone()].iter().zip(&self.terms.coefficients[terms]);
            *value = pairs.fold(0.0, |sum, (&group, c)| sum + phi[group as usize] * c);
        }
    }

    /// out = K_a u. Lengths [`AffineStiffness::unknowns`].
    pub fn apply(&self, group: usize, u: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for member in &self.members[self.member_starts[group]..self.member_starts[group + 1]] {
            member.add_force(1.0, u, out);
        }
    }

    /// out = K(phi) u. Lengths [`AffineStiffness::unknowns`].
    pub fn apply_all(&self, phi: &[f64], u: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (ends, &phi) in self.member_starts.windows(2).zip(phi) {
            for member in &self.members[ends[0]..ends[1]] {
                member.add_force(phi, u, out);
            }
        }
    }

    /// Number of springs; those of a group stand together, see [`AffineStiffness::group_springs`].
    pub fn springs(&self) -> usize {
        self.members.len()
    }

    /// Where the springs of a group are in [`AffineStiffness::elongations`].
    pub fn group_springs(&self, group: usize) -> Range<usize> {
        self.member_starts[group]..self.member_starts[group + 1]
    }

    /// out_s = sqrt(w_s) b_s . u, so that u^T K_a v is the product of the elongations of u and v over the springs of
    /// group a. Length of `u` [`AffineStiffness::unknowns`], of `out` [`AffineStiffness::springs`].
    pub fn elongations(&self, u: &[f64], out: &mut [f64]) {
        for (member, out) in self.members.iter().zip(out) {
            *out = member.coefficient.sqrt() * member.elongation(u);
        }
    }

    /// out = diagonal of K(phi). Length [`AffineStiffness::unknowns`].
    pub fn diagonal(&self, phi: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (ends, &phi) in self.member_starts.windows(2).zip(phi) {
            for member in &self.members[ends[0]..ends[1]] {
                for (&unknown, d) in member.ends.iter().flat_map(|end| end.iter().zip(&member.direction)) {
                    if unknown != FIXED {
                        out[unknown as usize] += phi * member.coefficient * d * d;
                    }
                }
            }
        }
    }
}

impl Member {
    /// out += phi w b (b . u).
    fn add_force(&self, phi: f64, u: &[f64], out: &mut [f64]) {
        let [a, b] = self.ends;
        let tension = phi * self.coefficient * self.elongation(u);
        for c in 0..3 {
            if a[c] != FIXED {
                out[a[c] as usize] -= tension * self.direction[c];
            }
            if b[c] != FIXED {
                out[b[c] as usize] += tension * self.direction[c];
            }
        }
    }

    /// b . u.
    fn elongation(&self, u: &[f64]) -> f64 {
        let [a, b] = self.ends;
        let at = |unknown: u32| if unknown == FIXED { 0.0 } else { u[unknown as usize] };
        (0..3).map(|c| self.direction[c] * (at(b[c]) - at(a[c]))).sum()
    }

    /// Calls `add` with rank, rank and value of every non-zero of w b b^T in the lower triangle in elimination order.
    fn for_each_entry(&self, rank: &[u32], mut add: impl FnMut(u32, u32, f64)) {
        let b: [(u32, f64); 6] = std::array::from_fn(|p| {
            let sign = if p < 3 { -1.0 } else { 1.0 };
            (self.ends[p / 3][p % 3], sign * self.direction[p % 3])
        });
        for p in 0..6 {
            for q in 0..=p {
                let value = self.coefficient * b[p].1 * b[q].1;
                if b[p].0 != FIXED && b[q].0 != FIXED && value != 0.0 {
                    let (r, s) = (rank[b[p].0 as usize], rank[b[q].0 as usize]);
                    add(r.max(s), r.min(s), value);
                }
            }
        }
    }
}

impl Terms {
    /// Sorts the entries of all springs by their place in the triangle, then joins those of one group. The members come
    /// group by group, so the terms of one entry do too.
    fn collect(members: &[Member], member_starts: &[usize], symbolic: &Symbolic) -> Self {
        let mut rank = vec![0; symbolic.len()];
        for (k, &unknown) in symbolic.order().iter().enumerate() {
            rank[unknown as usize] = k as u32;
        }
        let entries = symbolic.lower_rows().len();
        let mut next = vec![0_usize; entries + 1];
        for member in members {
            member.for_each_entry(&rank, |row, column, _| next[place(symbolic, row, column) + 1] += 1);
        }
        for entry in 0..entries {
            next[entry + 1] += next[entry];
        }
        let bounds = next.clone();
        let mut all = vec![(0_u32, 0.0); bounds[entries]];
        for (group, ends) in member_starts.windows(2).enumerate() {
            for member in &members[ends[0]..ends[1]] {
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
