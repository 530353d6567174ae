//! The matrix objective (3.17): the stiffness matrix of the springs shall be that of the continuum.
//!
//! ```text
//! e = 100 |K_ref - K(phi)|_F / |K_ref|_F,      K(phi) = sum_a phi_a K_a
//! ```
//!
//! over the free degrees of freedom, in percent; both norms run over the same blocks, those that the reading compares. A
//! spring s between the nodes i and j with direction d puts
//!
//! ```text
//! -k_s d d^T into the blocks ij and ji,      k_s d d^T into the blocks ii and jj,       k_s = phi_a w_s
//! ```
//!
//! Two readings of the distance exist, and both are offered: *full* compares all blocks, *off_diagonal* only those
//! with i != j. A rigid motion stresses neither body, so the diagonal blocks repeat what the others say; a network that
//! cannot meet all of them finds another compromise with them than without. On one square bilinear element at nu = 1/3
//! the off-diagonal reading gives 5/16 and 7/16 E t, which is (3.13), and the full one 17/56 and 23/56. A spring that ends at a
//! held node has no block with i != j over the free degrees of freedom: the off-diagonal reading does not see it.
//!
//! Where a reference couples nodes that no spring joins (a spline of degree two couples nodes two steps apart), no phi can
//! help: that part of the distance is reported by itself, as [`Target::outside`], and left out of e. Both are fractions of
//! the same norm, [`Target::norm`]: that of K_ref in the full reading, that of its blocks with i != j in the other, whose diagonal
//! blocks are the larger part of |K_ref|_F. The distance of all blocks compared is the root of the sum of their squares.
//!
//! As a least-squares problem: an off-diagonal block belongs to one spring, hence to one group, so these equations fall
//! apart into one for each group; only the diagonal blocks couple groups.

use nalgebra_sparse::CsrMatrix;

use crate::calibration::linear::{Reduced, Rows};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::springs::grouping::Grouping;
use crate::springs::network::{Network, Spring};

/// Which blocks are compared.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reading {
    /// All blocks.
    #[default]
    Full,
    /// Blocks between different nodes only; this reading gives (3.13).
    OffDiagonal,
}

/// The fixed part of a matrix problem.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The springs.
    pub network: &'a Network,
    /// w_s of every spring, 1 or 1/m.
    pub coefficients: &'a [f64],
    /// The degrees of freedom.
    pub dofs: &'a DofMap,
    /// K_ref over the free degrees of freedom, both triangles, N/m.
    pub stiffness: &'a CsrMatrix<f64>,
    /// Which blocks are compared.
    pub reading: Reading,
}

impl Target<'_> {
    /// The least-squares problem of a grouping, distances in percent of [`Target::norm`].
    pub fn reduce(&self, grouping: &Grouping) -> Reduced {
        let mut rows = Rows::new(grouping.groups.len());
        self.push_off_diagonal(grouping, &mut rows);
        if self.reading == Reading::Full {
            self.push_diagonal(grouping, &mut rows);
        }
        rows.reduced(100.0 / self.norm(), &self.terms(grouping))
    }

    /// Norm of what the entries of K_a would be if every component of every node were free and nothing cancelled, for each
    /// group: sqrt(4 sum_s w_s^2), N/m at phi = 1.
    fn terms(&self, grouping: &Grouping) -> Vec<f64> {
        let mut squares = vec![0.0; grouping.groups.len()];
        for (&group, coefficient) in grouping.group_of.iter().zip(self.coefficients) {
            squares[group as usize] += 4.0 * coefficient * coefficient;
        }
        squares.into_iter().map(f64::sqrt).collect()
    }

    /// |K_ref|_F over the blocks that are compared, N/m: what distances are percent of.
    pub fn norm(&self) -> f64 {
        self.squares().0.sqrt()
    }

    /// The part of the compared blocks of K_ref between nodes that no spring joins, in percent of [`Target::norm`].
    pub fn outside(&self) -> f64 {
        let (all, outside) = self.squares();
        100.0 * (outside / all).sqrt()
    }

    /// Sums of the squares of K_ref: all blocks of the reading, and those among them that no spring joins.
    fn squares(&self) -> (f64, f64) {
        let touching = self.touching();
        let (mut all, mut outside) = (0.0, 0.0);
        let mut joined = vec![usize::MAX; self.dofs.nodes()];
        for (row, lane) in self.stiffness.row_iter().enumerate() {
            let node = self.dofs.owner(row).0;
            for &s in &touching[node] {
                self.network.springs[s].nodes.iter().for_each(|&end| joined[end as usize] = node);
            }
            for (&column, value) in lane.col_indices().iter().zip(lane.values()) {
                let other = self.dofs.owner(column).0;
                let compared = other != node || self.reading == Reading::Full;
                all += if compared { value * value } else { 0.0 };
                outside += if other != node && joined[other] != node { value * value } else { 0.0 };
            }
        }
        (all, outside)
    }

    /// The springs at every node.
    fn touching(&self) -> Vec<Vec<usize>> {
        let mut touching = vec![Vec::new(); self.dofs.nodes()];
        for (s, spring) in self.network.springs.iter().enumerate() {
            spring.nodes.iter().for_each(|&node| touching[node as usize].push(s));
        }
        touching
    }

    /// K_ref between two components, 0 where it is not stored.
    fn entry(&self, row: u32, column: u32) -> f64 {
        let lane = self.stiffness.row(row as usize);
        lane.col_indices().binary_search(&(column as usize)).map_or(0.0, |at| lane.values()[at])
    }

    /// Calls `each` with K_ref and -w d d^T in every free entry of the block between the ends of a spring.
    fn for_each_coupling(&self, s: usize, mut each: impl FnMut(f64, f64)) {
        let Spring { nodes, direction, .. } = &self.network.springs[s];
        let [ends_a, ends_b] = nodes.map(|node| self.dofs.free(node as usize));
        for (p, &row) in ends_a.iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
            for (q, &column) in ends_b.iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
                each(self.entry(row, column), -self.coefficients[s] * direction[p] * direction[q]);
            }
        }
    }

    /// One equation for each group, and what no stiffness can change. Every block counts twice: ij and ji.
    fn push_off_diagonal(&self, grouping: &Grouping, rows: &mut Rows) {
        let groups = grouping.groups.len();
        let (mut with_springs, mut of_springs) = (vec![0.0; groups], vec![0.0; groups]);
        for (s, &group) in grouping.group_of.iter().enumerate() {
            self.for_each_coupling(s, |continuum, spring| {
                with_springs[group as usize] += 2.0 * continuum * spring;
                of_springs[group as usize] += 2.0 * spring * spring;
            });
        }
        let best = |group: usize| if of_springs[group] > 0.0 { with_springs[group] / of_springs[group] } else { 0.0 };
        let mut rest = 0.0;
        for (s, &group) in grouping.group_of.iter().enumerate() {
            let k = best(group as usize);
            self.for_each_coupling(s, |continuum, spring| rest += 2.0 * (continuum - k * spring).powi(2));
        }
        let mut row = vec![0.0; groups + 1];
        row[groups] = f64::sqrt(rest);
        rows.push(&row);
        for (group, square) in of_springs.iter().enumerate() {
            row.fill(0.0);
            row[group] = square.sqrt();
            row[groups] = square.sqrt() * best(group);
            rows.push(&row);
        }
    }

    /// The equations of the diagonal blocks; an entry beside the diagonal stands for its mirror image too.
    fn push_diagonal(&self, grouping: &Grouping, rows: &mut Rows) {
        let groups = grouping.groups.len();
        let touching = self.touching();
        let mut row = vec![0.0; groups + 1];
        for node in self.dofs.masters() {
            let free = self.dofs.free(node);
            for (p, &first) in free.iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
                for (q, &second) in free.iter().enumerate().skip(p).filter(|(_, dof)| **dof != FIXED) {
                    let count = if p == q { 1.0 } else { f64::sqrt(2.0) };
                    row.fill(0.0);
                    for &s in &touching[node] {
                        let direction = self.network.springs[s].direction;
                        let group = grouping.group_of[s] as usize;
                        row[group] += count * self.coefficients[s] * direction[p] * direction[q];
                    }
                    row[groups] = count * self.entry(first, second);
                    rows.push(&row);
                }
            }
        }
    }
}
