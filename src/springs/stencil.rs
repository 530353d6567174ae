//! The springs of a structured grid as a product without a matrix.
//!
//! In the "grid" topology a node is joined to its 26 neighbours at most (8 in two dimensions), so that K(phi) u is a
//! stencil with its own numbers at every node (see [`crate::sparse::multigrid::bars`]). With D = x_b - x_a and l0 = |D|,
//!
//! ```text
//! K(phi) u = sum_s c_s b_s b_s^T u,     b_s = (-D, D),     c_s = phi_group(s) w_s / l0_s^2
//! ```
//!
//! Stored are the positions and c, phi-free part and group of the 13 springs that a node owns. No pattern, no analysis.
//! Held components are rows of zeros: vectors are zero there, and stay so. Vectors live on the padded grid, three
//! components each; [`Stencil::spread`] and [`Stencil::collect`] go between them and the free degrees of freedom.
//!
//! Ties (a merged seam) are refused: a tied node has more neighbours than the stencil.

use rayon::prelude::*;

use crate::geometry::dofs::{DofMap, FIXED};
use crate::geometry::grid::Grid;
use crate::sparse::multigrid::TOGETHER;
use crate::sparse::multigrid::bars::Bars;
use crate::sparse::multigrid::level::STRIP_OF_BARS;
use crate::sparse::multigrid::padded::{Held, Padded, Piece, columns, components, for_each_strip};

use super::grouping::Grouping;
use super::network::Network;

/// Places that one task of an update serves.
const PIECE: usize = 2048;

/// Why springs cannot be a stencil.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Nodes are tied.
    Tied,
    /// A spring does not join neighbours of the grid.
    NotNeighbours,
    /// The grid is too small to be halved.
    Small,
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Tied => "nodes are tied by a merged seam",
            Self::NotNeighbours => "a spring joins nodes that are no neighbours in the grid",
            Self::Small => "the grid is too small to be halved",
        })
    }
}

/// K(phi) of springs on a grid.
#[derive(Debug, Clone)]
pub struct Stencil {
    padded: Padded,
    /// Positions in m; c of the last phi.
    bars: Bars<f64>,
    /// w_s / l0_s^2, one component for each forward offset.
    unit: Vec<f64>,
    /// Group of every spring, like `unit`.
    groups: Vec<u32>,
    /// Springs as places in `unit`, group by group.
    members: Vec<u32>,
    member_starts: Vec<usize>,
    /// Place of every free degree of freedom in a vector, and back ([`FIXED`] where held).
    places: Vec<u32>,
    numbers: Vec<u32>,
    free: Vec<u8>,
    held: Held,
}

impl Stencil {
    /// The springs of a network on its grid; `coefficients` is w_s of every spring.
    ///
    /// # Errors
    /// [`Refusal::Tied`] and [`Refusal::NotNeighbours`].
    ///
    /// # Panics
    /// When there is not one group and one coefficient for every spring.
    pub fn new(
        network: &Network,
        grid: &Grid,
        dofs: &DofMap,
        grouping: &Grouping,
        coefficients: &[f64],
    ) -> Result<Self, Refusal> {
        assert_eq!(network.springs.len(), grouping.group_of.len(), "one group for every spring");
        assert_eq!(network.springs.len(), coefficients.len(), "one coefficient for every spring");
        if (0..grid.len()).any(|node| dofs.master(node) != node) {
            return Err(Refusal::Tied);
        }
        let padded = Padded::new(in_space(grid, grid.extents()));
        let place = |node: usize| padded.at(in_space(grid, grid.index(node)));
        let len = padded.len();
        let mut positions = vec![0.0; 3 * len];
        let (mut numbers, mut free) = (vec![FIXED; 3 * len], vec![0; len]);
        let mut places = vec![0; dofs.len()];
        for (node, x) in network.positions.iter().enumerate() {
            let p = place(node);
            (0..3).for_each(|c| positions[c * len + p] = x[c]);
            for (c, &dof) in dofs.free(node).iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
                free[p] |= 1 << c;
                numbers[c * len + p] = dof;
                places[dof as usize] = (c * len + p) as u32;
            }
        }
        let slots = slots(network, grid, &padded)?;
        let count = padded.forward().len() * len;
        let (mut unit, mut groups) = (vec![0.0; count], vec![0; count]);
        for (s, &slot) in slots.iter().enumerate() {
            unit[slot as usize] = coefficients[s] / network.springs[s].length.powi(2);
            groups[slot as usize] = grouping.group_of[s];
        }
        let (members, member_starts) = by_group(&slots, grouping);
        let bars = Bars { positions, coefficients: vec![0.0; count] };
        let held = Held::new(&padded, &free);
        Ok(Self { padded, bars, unit, groups, members, member_starts, places, numbers, free, held })
    }

    /// Number of free degrees of freedom.
    pub fn unknowns(&self) -> usize {
        self.places.len()
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.member_starts.len() - 1
    }

    /// Layout of the vectors.
    pub fn padded(&self) -> &Padded {
        &self.padded
    }

    /// Bits of the free components of every place.
    pub fn free(&self) -> &[u8] {
        &self.free
    }

    /// Positions (m, three components) and c (N/m / m^2) of the springs at the last phi.
    pub fn bars(&self) -> &Bars<f64> {
        &self.bars
    }

    /// Takes the numbers of the groups.
    ///
    /// # Panics
    /// When `phi` has not one number for every group.
    pub fn set(&mut self, phi: &[f64]) {
        assert_eq!(phi.len(), self.groups(), "one number for every group");
        let pairs = self.unit.par_chunks(PIECE).zip(self.groups.par_chunks(PIECE));
        self.bars.coefficients.par_chunks_mut(PIECE).zip(pairs).for_each(|(c, (unit, groups))| {
            for (c, (unit, &group)) in c.iter_mut().zip(unit.iter().zip(groups)) {
                *c = phi[group as usize] * unit;
            }
        });
    }

    /// An upper bound of the eigenvalues of K(phi), N/m: twice the largest sum of the stiffness around a node, since a
    /// spring joins two.
    pub fn stiffest(&self) -> f64 {
        let (len, x) = (self.padded.len(), components(&self.bars.positions));
        let steps: Vec<usize> = self.padded.forward().iter().map(|&offset| self.padded.step(offset)).collect();
        let around = |p: usize| {
            let stiffness = |o: usize, a: usize| {
                let square: f64 = x.iter().map(|x| (x[a + steps[o]] - x[a]).powi(2)).sum();
                self.bars.coefficients[o * len + a] * square
            };
            (0..steps.len()).map(|o| stiffness(o, p) + stiffness(o, p - steps[o])).sum::<f64>()
        };
        2.0 * self.padded.body().into_par_iter().with_min_len(PIECE).map(around).reduce(|| 0.0, f64::max)
    }

    /// out = K(phi) u for whole columns on the padded grid, up to [`TOGETHER`] of them in step; `u` zero at held components
    /// and in the margin. The bits of a column do not depend on the others.
    pub fn product(&self, u: &[f64], out: &mut [f64]) {
        let n = 3 * self.padded.len();
        for (u, out) in u.chunks(TOGETHER * n).zip(out.chunks_mut(TOGETHER * n)) {
            match u.len() / n {
                1 => self.product_of::<1>(u, out),
                2 => self.product_of::<2>(u, out),
                3 => self.product_of::<3>(u, out),
                _ => self.product_of::<TOGETHER>(u, out),
            }
        }
    }

    fn product_of<const COLUMNS: usize>(&self, u: &[f64], out: &mut [f64]) {
        let u: [&[f64]; COLUMNS] = columns(u, 3 * self.padded.len());
        for_each_strip(&self.padded, [out], STRIP_OF_BARS, |start, [mut out]: [Piece<f64, COLUMNS>; 1]| {
            for (u, out) in u.iter().zip(&mut out) {
                self.bars.product(&self.padded, u, start, out);
                self.held.clear(start, out);
            }
        });
    }

    /// out = K_a u over the free degrees of freedom.
    pub fn apply_group(&self, group: usize, u: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        let len = self.padded.len();
        let x = components(&self.bars.positions);
        let steps: Vec<usize> = self.padded.forward().iter().map(|&offset| self.padded.step(offset)).collect();
        for &slot in &self.members[self.member_starts[group]..self.member_starts[group + 1]] {
            let (o, p) = (slot as usize / len, slot as usize % len);
            let q = p + steps[o];
            let direction = x.map(|x| x[q] - x[p]);
            let ends = [p, q].map(|p| [0, 1, 2].map(|c| self.numbers[c * len + p]));
            let at = |dof: u32| if dof == FIXED { 0.0 } else { u[dof as usize] };
            let elongation: f64 = (0..3).map(|c| direction[c] * (at(ends[1][c]) - at(ends[0][c]))).sum();
            let pull = self.unit[slot as usize] * elongation;
            for c in 0..3 {
                if ends[0][c] != FIXED {
                    out[ends[0][c] as usize] -= pull * direction[c];
                }
                if ends[1][c] != FIXED {
                    out[ends[1][c] as usize] += pull * direction[c];
                }
            }
        }
    }

    /// Writes a vector over the free degrees of freedom into one on the padded grid that is zero elsewhere.
    pub fn spread(&self, from: &[f64], to: &mut [f64]) {
        for (&place, value) in self.places.iter().zip(from) {
            to[place as usize] = *value;
        }
    }

    /// The way back.
    pub fn collect(&self, from: &[f64], to: &mut [f64]) {
        for (&place, value) in self.places.iter().zip(to) {
            *value = from[place as usize];
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let f64s = self.bars.positions.len() + self.bars.coefficients.len() + self.unit.len();
        let u32s = self.groups.len() + self.members.len() + self.places.len() + self.numbers.len();
        8 * f64s + 4 * u32s + self.free.len() + self.held.bytes()
    }
}

/// A triple of the grid's directions in the order of the padded grid, where two directions are the last two.
fn in_space<T: Copy>(grid: &Grid, triple: [T; 3]) -> [T; 3] {
    let [a, b, c] = triple;
    if grid.dimension() == 2 { [c, a, b] } else { triple }
}

/// Place of every spring among the forward offsets: number of the offset times the places of a component, plus the place
/// of its first end.
fn slots(network: &Network, grid: &Grid, padded: &Padded) -> Result<Vec<u32>, Refusal> {
    let place = |node: u32| padded.at(in_space(grid, grid.index(node as usize)));
    let slot = |spring: &super::network::Spring| {
        let offset = in_space(grid, spring.offset);
        let o = padded.forward().iter().position(|&forward| forward == offset)?;
        let [a, b] = spring.nodes.map(place);
        (a + padded.step(offset) == b).then_some((o * padded.len() + a) as u32)
    };
    network.springs.iter().map(|spring| slot(spring).ok_or(Refusal::NotNeighbours)).collect()
}

/// The slots sorted by group, in the order of the springs within each, and where each group starts.
fn by_group(slots: &[u32], grouping: &Grouping) -> (Vec<u32>, Vec<usize>) {
    let mut starts = vec![0];
    for group in &grouping.groups {
        starts.push(starts[starts.len() - 1] + group.springs);
    }
    let (mut next, mut members) = (starts.clone(), vec![0; slots.len()]);
    for (&slot, &group) in slots.iter().zip(&grouping.group_of) {
        members[next[group as usize]] = slot;
        next[group as usize] += 1;
    }
    (members, starts)
}
