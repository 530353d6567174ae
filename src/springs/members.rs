//! The springs of a network, group by group, as products with K_a need them.
//!
//! ```text
//! K_a u = sum over the springs s of group a of w_s b_s (b_s . u),      b_s = (-d_s, d_s)
//! u^T K_a v = sum_s (sqrt(w_s) b_s . u) (sqrt(w_s) b_s . v)
//! ```
//!
//! over the free degrees of freedom, without a matrix. The numbers sqrt(w_s) b_s . u are the *elongations* of u: with those
//! of some vectors at hand, their products in every K_a are small matrix products. w_s: see [`super::weighting`]; u in m.

use std::ops::Range;

use rayon::prelude::*;

use crate::geometry::dofs::{DofMap, FIXED};

use super::grouping::Grouping;
use super::network::Network;

/// Springs that one task serves.
const PIECE: usize = 16_384;

/// All springs, sorted by group.
#[derive(Debug, Clone)]
pub struct Members {
    unknowns: usize,
    members: Vec<Member>,
    starts: Vec<usize>,
}

/// A spring as the products need it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Member {
    /// Unknowns of the two ends; [`FIXED`] where held, and beyond the dimension.
    ends: [[u32; 3]; 2],
    direction: [f64; 3],
    coefficient: f64,
}

/// Unknowns of the components of two nodes, padded with [`FIXED`].
pub(super) fn unknowns(nodes: [u32; 2], dofs: &DofMap) -> [[u32; 3]; 2] {
    nodes.map(|node| {
        let mut padded = [FIXED; 3];
        padded[..dofs.dimension()].copy_from_slice(dofs.free(node as usize));
        padded
    })
}

impl Members {
    /// Sorts the springs; `coefficients` is w_s of each.
    ///
    /// # Panics
    /// When there is not one group and one coefficient for every spring.
    pub fn new(network: &Network, grouping: &Grouping, coefficients: &[f64], dofs: &DofMap) -> Self {
        assert_eq!(network.springs.len(), grouping.group_of.len(), "one group for every spring");
        assert_eq!(network.springs.len(), coefficients.len(), "one coefficient for every spring");
        let member = |s: u32| Member {
            ends: unknowns(network.springs[s as usize].nodes, dofs),
            direction: network.springs[s as usize].direction,
            coefficient: coefficients[s as usize],
        };
        let mut by_group: Vec<u32> = (0..network.springs.len() as u32).collect();
        by_group.sort_by_key(|&s| grouping.group_of[s as usize]);
        let mut starts = vec![0];
        for group in &grouping.groups {
            starts.push(starts[starts.len() - 1] + group.springs);
        }
        Self { unknowns: dofs.len(), members: by_group.into_iter().map(member).collect(), starts }
    }

    /// Bytes of so many springs.
    pub fn bytes(springs: usize) -> usize {
        springs * std::mem::size_of::<Member>()
    }

    /// Number of free degrees of freedom.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of springs; those of a group stand together, see [`Members::group`].
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// True when there is no spring.
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// Where the springs of a group are in [`Members::elongations`].
    pub fn group(&self, group: usize) -> Range<usize> {
        self.starts[group]..self.starts[group + 1]
    }

    /// The springs of each group.
    pub(super) fn by_group(&self) -> impl Iterator<Item = &[Member]> {
        self.starts.windows(2).map(|ends| &self.members[ends[0]..ends[1]])
    }

    /// out = K_a u. Lengths [`Members::unknowns`].
    pub fn apply(&self, group: usize, u: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        self.members[self.group(group)].iter().for_each(|member| member.add_force(1.0, u, out));
    }

    /// out = K(phi) u. Lengths [`Members::unknowns`].
    pub fn apply_all(&self, phi: &[f64], u: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (members, &phi) in self.by_group().zip(phi) {
            members.iter().for_each(|member| member.add_force(phi, u, out));
        }
    }

    /// out_s = sqrt(w_s) b_s . u, so that u^T K_a v is the product of the elongations of u and v over the springs of
    /// group a. Length of `u` [`Members::unknowns`], of `out` [`Members::len`].
    pub fn elongations(&self, u: &[f64], out: &mut [f64]) {
        self.members.par_chunks(PIECE).zip(out.par_chunks_mut(PIECE)).for_each(|(members, out)| {
            for (member, out) in members.iter().zip(out) {
                *out = member.coefficient.sqrt() * member.elongation(u);
            }
        });
    }

    /// out = sum_s t_s sqrt(w_s) b_s over the members with these numbers: what the tensions t pull at the nodes, the
    /// transpose of [`Members::elongations`]; with t the elongations of u and the members of group a it is K_a u. Length of
    /// `tensions` [`Members::len`], of `out` [`Members::unknowns`].
    pub fn pull(&self, members: &[u32], tensions: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for &s in members {
            let member = &self.members[s as usize];
            member.add_tension(member.coefficient.sqrt() * tensions[s as usize], out);
        }
    }

    /// out = diagonal of K(phi). Length [`Members::unknowns`].
    pub fn diagonal(&self, phi: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (members, &phi) in self.by_group().zip(phi) {
            for member in members {
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
    /// Unknowns of the two ends, direction and w.
    pub(super) fn parts(&self) -> ([[u32; 3]; 2], [f64; 3], f64) {
        (self.ends, self.direction, self.coefficient)
    }

    /// out += phi w b (b . u).
    fn add_force(&self, phi: f64, u: &[f64], out: &mut [f64]) {
        self.add_tension(phi * self.coefficient * self.elongation(u), out);
    }

    /// out += t b.
    fn add_tension(&self, tension: f64, out: &mut [f64]) {
        let [a, b] = self.ends;
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
    pub(super) fn for_each_entry(&self, rank: &[u32], mut add: impl FnMut(u32, u32, f64)) {
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
