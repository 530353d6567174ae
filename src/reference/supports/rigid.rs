//! The rigid motions of a body, and which of them its supports leave free.
//!
//! A body in one piece moves without resistance only as a whole: u(x) = t + r x (x - c), translations t and infinitesimal
//! rotations r about the centre c, 3 numbers in the plane and 6 in space. With the length R of the body as unit of
//! rotation all of them are of one size. A held component i of a node at x asks that row(x, i) . m = 0 of the numbers m of
//! a motion; the free motions are the null space of H = sum over held components of row^T row.
//!
//! To name them, their basis is brought to reduced echelon form with the rotations first: what is left are turns about
//! single axes where there are some, and slides.

use nalgebra_sparse::na::{DMatrix, SymmetricEigen};

use crate::error::direction_name;
use crate::geometry::dofs::{DofMap, FIXED};
use crate::readable::short;

/// A motion whose held components stay below this share of its size (squared) counts as free.
const FREE: f64 = 1e-14;

/// Nodes of one piece of a body, each with its place.
pub(super) type Nodes = [(usize, [f64; 3])];

/// Translations and rotations of a piece, scaled so that all are of the same size.
pub(super) struct RigidMotions {
    count: usize,
    dimension: usize,
    centre: [f64; 3],
    radius: f64,
}

impl RigidMotions {
    pub(super) fn of(nodes: &Nodes, dimension: usize) -> Self {
        let n = nodes.len().max(1) as f64;
        let centre = [0, 1, 2].map(|a| nodes.iter().map(|(_, p)| p[a]).sum::<f64>() / n);
        let radius = nodes
            .iter()
            .flat_map(|(_, p)| (0..3).map(move |a| (p[a] - centre[a]).abs()))
            .fold(f64::MIN_POSITIVE, f64::max);
        Self { count: if dimension == 2 { 3 } else { 6 }, dimension, centre, radius }
    }

    /// Component i of every motion at a place: translations first, then rotations about z (2D) or about x, y, z.
    pub(super) fn component(&self, position: [f64; 3], i: usize) -> [f64; 6] {
        let x = [0, 1, 2].map(|a| (position[a] - self.centre[a]) / self.radius);
        let mut motions = [0.0; 6];
        motions[i] = 1.0;
        // (e_axis x x)_i is x_(i-axis step) with the sign of the cyclic order
        for axis in 0..3 {
            let turned = if i == (axis + 1) % 3 {
                -x[(axis + 2) % 3]
            } else if i == (axis + 2) % 3 {
                x[(axis + 1) % 3]
            } else {
                0.0
            };
            if self.dimension == 3 {
                motions[3 + axis] = turned;
            } else if axis == 2 {
                motions[2] = turned;
            }
        }
        motions
    }

    /// H of the held components of the nodes.
    pub(super) fn held(&self, nodes: &Nodes, dofs: &DofMap) -> DMatrix<f64> {
        let mut held = DMatrix::zeros(self.count, self.count);
        for &(node, position) in nodes {
            for i in (0..self.dimension).filter(|&i| dofs.free(node)[i] == FIXED) {
                self.hold(&mut held, position, i);
            }
        }
        held
    }

    /// Adds a held component to H.
    pub(super) fn hold(&self, held: &mut DMatrix<f64>, position: [f64; 3], i: usize) {
        let row = self.component(position, i);
        for a in 0..self.count {
            for b in 0..self.count {
                held[(a, b)] += row[a] * row[b];
            }
        }
    }

    /// Orthonormal motions that H leaves free, one a column.
    pub(super) fn free(&self, held: &DMatrix<f64>) -> DMatrix<f64> {
        let modes = SymmetricEigen::new(held.clone());
        let limit = FREE * modes.eigenvalues.max();
        let loose: Vec<usize> = (0..self.count).filter(|&m| modes.eigenvalues[m] <= limit).collect();
        modes.eigenvectors.select_columns(&loose)
    }

    /// The free motions in words, one each.
    pub(super) fn names(&self, free: &DMatrix<f64>) -> Vec<String> {
        let first_rotation = self.dimension;
        let order: Vec<usize> = (first_rotation..self.count).chain(0..first_rotation).collect();
        let mut rows = DMatrix::from_fn(free.ncols(), self.count, |m, a| free[(order[a], m)]);
        reduce(&mut rows);
        let at = |m: usize, motion: usize| rows[(m, order.iter().position(|&o| o == motion).expect("every motion"))];
        (0..rows.nrows()).map(|m| self.name(&|motion| at(m, motion))).collect()
    }

    fn name(&self, motion: &dyn Fn(usize) -> f64) -> String {
        let slide: [f64; 3] = std::array::from_fn(|a| if a < self.dimension { motion(a) } else { 0.0 });
        let turn = match self.dimension {
            2 => [0.0, 0.0, motion(2)],
            _ => [motion(3), motion(4), motion(5)],
        };
        let size = turn.iter().map(|r| r * r).sum::<f64>();
        if size < 1e-16 {
            return format!("it can slide along {}", direction_name(slide));
        }
        // the axis is where r x (x - c) / R + t has no part across r: c + R (r x t) / |r|^2
        let through: [f64; 3] = std::array::from_fn(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            let offset = self.radius * (turn[b] * slide[c] - turn[c] * slide[b]) / size;
            let place = self.centre[a] + offset;
            // what is rounding of the extent is zero
            if place.abs() < 1e-9 * self.radius { 0.0 } else { place }
        });
        let places: Vec<String> = through[..self.dimension].iter().map(|x| short(*x)).collect();
        format!("it can turn about {} through ({}) m", direction_name(turn), places.join(", "))
    }
}

/// Brings rows to reduced echelon form with pivots of 1, the largest entry of a column first.
fn reduce(rows: &mut DMatrix<f64>) {
    let mut rank = 0;
    for column in 0..rows.ncols() {
        let Some(pivot) =
            (rank..rows.nrows()).max_by(|&a, &b| rows[(a, column)].abs().total_cmp(&rows[(b, column)].abs()))
        else {
            return;
        };
        if rows[(pivot, column)].abs() < 1e-9 {
            continue;
        }
        rows.swap_rows(rank, pivot);
        let size = rows[(rank, column)];
        rows.row_mut(rank).iter_mut().for_each(|x| *x /= size);
        for other in (0..rows.nrows()).filter(|&other| other != rank) {
            let factor = rows[(other, column)];
            for c in 0..rows.ncols() {
                rows[(other, c)] -= factor * rows[(rank, c)];
            }
        }
        rank += 1;
    }
}
