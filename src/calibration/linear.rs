//! Objectives that are linear in the stiffnesses, reduced to a triangle.
//!
//! The matrix objective (3.17) and the acceleration objective (4.5) are distances |A phi - b|: one row an equation, one
//! column a group, far more rows than columns. All that such a problem needs to know of its rows is the triangle R of
//!
//! ```text
//! (A  b) = Q R,      |A phi - b| = |R (phi, -1)|       for every phi
//! ```
//!
//! with m + 1 rows. Rows are taken one after the other and folded into the triangle by reflections, so that memory is a
//! few triangles whatever the mesh, and no digits are lost to a product A^T A. After that an evaluation costs m^2 / 2
//! products. The distance is scaled to percent: 0 where network and continuum agree, 100 for phi = 0.
//!
//! Two kinds of groups have no answer in such a problem.
//!
//! - *Empty columns.* Nothing that is compared depends on the group: its springs lie between held nodes, or no state
//!   stretches them. The other groups have the same answer whatever it is, so they are fitted and the group is left out. It
//!   gets a stated stiffness ([`Reduced::completed`]): the part of its bound that the others have of theirs in the mean.
//!   A column counts as empty when it is at most [`ROUNDING`] of the terms that were summed into it.
//! - *Dependent columns.* The groups of a set that act as each other do have no number of their own: whatever is taken
//!   from one can be given to others. [`Reduced::dependent`] finds these sets by QR with column pivoting of R
//!   ([`crate::dense::rank`]), whose columns are those of A to rounding. A column counts as dependent when no more than [`OWN`] of
//!   its length is its own.

use crate::dense::{dot, rank, triangle_of};

/// A column of at most this part of the terms that were summed into it is the rounding of their sum.
pub const ROUNDING: f64 = 1e-13;

/// A column of which no more than this part is its own follows from others. Below it the bounded least squares cannot tell the
/// groups apart either: they correct what a product R^T R loses, which needs a condition under 1 / sqrt(1e-16).
pub const OWN: f64 = 1e-7;

/// Rows that wait to be folded, for each column.
const PENDING: usize = 4;

/// Takes the rows (A b) of a linear least-squares problem.
pub struct Rows {
    /// Groups + 1.
    width: usize,
    /// Row after row.
    pending: Vec<f64>,
    /// Column-major, width x width; zero below the diagonal.
    triangle: Vec<f64>,
}

impl Rows {
    /// No rows of a problem with so many groups.
    pub fn new(groups: usize) -> Self {
        let width = groups + 1;
        Self { width, pending: Vec::new(), triangle: vec![0.0; width * width] }
    }

    /// Takes one row: a coefficient for each group, and the right-hand side behind them.
    ///
    /// # Panics
    /// When the row has another length than groups + 1.
    pub fn push(&mut self, row: &[f64]) {
        assert_eq!(row.len(), self.width, "one coefficient a group and the right-hand side");
        self.pending.extend_from_slice(row);
        if self.pending.len() >= PENDING * self.width * self.width {
            self.fold();
        }
    }

    /// Makes triangle and pending rows one triangle.
    fn fold(&mut self) {
        let width = self.width;
        let waiting = self.pending.len() / width;
        let rows = width + waiting;
        let mut stacked = vec![0.0; rows * width];
        for (j, column) in stacked.chunks_exact_mut(rows).enumerate() {
            column[..width].copy_from_slice(&self.triangle[j * width..(j + 1) * width]);
            for (entry, row) in column[width..].iter_mut().zip(self.pending.chunks_exact(width)) {
                *entry = row[j];
            }
        }
        let packed = triangle_of(&stacked, rows);
        for (j, column) in self.triangle.chunks_exact_mut(width).enumerate() {
            column[..=j].copy_from_slice(&packed[j * (j + 1) / 2..][..=j]);
        }
        self.pending.clear();
    }

    /// The triangle, with the distance |A phi - b| multiplied by `scale`. `terms` is for every group the norm that its column
    /// would have if none of the terms in it cancelled (zeros where columns are exact): what is rounding beside it becomes zero.
    ///
    /// # Panics
    /// When there is not one number for every group.
    pub fn reduced(mut self, scale: f64, terms: &[f64]) -> Reduced {
        assert_eq!(terms.len() + 1, self.width, "one number for every group");
        self.fold();
        for (column, terms) in self.triangle.chunks_exact_mut(self.width).zip(terms) {
            if dot(column, column).sqrt() <= ROUNDING * terms {
                column.fill(0.0);
            }
        }
        self.triangle.iter_mut().for_each(|entry| *entry *= scale);
        Reduced { groups: self.width - 1, triangle: self.triangle }
    }
}

/// A linear least-squares problem in m unknowns, m + 1 rows; distances in percent.
#[derive(Debug, Clone)]
pub struct Reduced {
    groups: usize,
    /// R, column-major, (m + 1) x (m + 1); the last column is the right-hand side.
    triangle: Vec<f64>,
}

impl Reduced {
    /// Number of unknowns m.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// Number of rows, m + 1.
    pub fn rows(&self) -> usize {
        self.groups + 1
    }

    /// The first m columns of R, column-major, (m + 1) x m; percent per N/m.
    pub fn matrix(&self) -> &[f64] {
        &self.triangle[..self.groups * self.rows()]
    }

    /// The last column of R: the right-hand side, length m + 1, percent.
    pub fn right(&self) -> &[f64] {
        &self.triangle[self.groups * self.rows()..]
    }

    /// out = R phi, without the right-hand side.
    pub fn apply(&self, phi: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (j, (column, phi)) in self.matrix().chunks_exact(self.rows()).zip(phi).enumerate() {
            out[..=j].iter_mut().zip(column).for_each(|(out, entry)| *out += entry * phi);
        }
    }

    /// |A phi - b| in percent.
    pub fn distance(&self, phi: &[f64]) -> f64 {
        let mut rows = vec![0.0; self.rows()];
        self.apply(phi, &mut rows);
        rows.iter().zip(self.right()).map(|(image, right)| (image - right).powi(2)).sum::<f64>().sqrt()
    }

    /// The Euclidean norm of every column of A.
    pub fn column_norms(&self) -> Vec<f64> {
        self.matrix().chunks_exact(self.rows()).map(|column| dot(column, column).sqrt()).collect()
    }

    /// For every group whether anything that is compared depends on it.
    pub fn seen(&self) -> Vec<bool> {
        self.column_norms().iter().map(|norm| *norm > 0.0).collect()
    }

    /// The sets of groups that the equations do not tell apart: the members of a set depend on each other, groups in none of
    /// them are determined. Groups ascending.
    pub fn dependent(&self) -> Vec<Vec<usize>> {
        rank::united(&rank::combinations(self.matrix(), self.rows(), OWN))
    }

    /// An answer with the stated stiffness of the groups that nothing depends on; `upper` holds the bounds of phi, length m.
    pub fn completed(&self, mut phi: Vec<f64>, upper: &[f64]) -> Vec<f64> {
        complete(&mut phi, upper, &self.seen());
        phi
    }
}

/// Gives every group that is not `determined` the part of its upper bound that the others have of theirs in the mean: bounds
/// (5.8) grow as stiffnesses do with modulus, thickness and the inverse length. Slices of length m.
pub fn complete(phi: &mut [f64], upper: &[f64], determined: &[bool]) {
    let parts: Vec<f64> = (0..phi.len()).filter(|&a| determined[a]).map(|a| phi[a] / upper[a]).collect();
    let mean = parts.iter().sum::<f64>() / parts.len().max(1) as f64;
    (0..phi.len()).filter(|&a| !determined[a]).for_each(|a| phi[a] = (mean * upper[a]).min(upper[a]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    #[test]
    fn the_triangle_measures_as_all_rows_do() {
        let (groups, rows) = (3, 200);
        let mut stream = Stream::new(7, 0, 0);
        let all: Vec<Vec<f64>> = (0..rows).map(|_| (0..=groups).map(|_| stream.normal()).collect()).collect();
        let mut taken = Rows::new(groups);
        all.iter().for_each(|row| taken.push(row));
        let reduced = taken.reduced(2.0, &[0.0; 3]);
        for phi in [[0.0, 0.0, 0.0], [1.0, -2.0, 0.5]] {
            let residual = |row: &Vec<f64>| dot(&row[..groups], &phi) - row[groups];
            let direct = 2.0 * all.iter().map(|row| residual(row).powi(2)).sum::<f64>().sqrt();
            assert!((reduced.distance(&phi) / direct - 1.0).abs() < 1e-14);
        }
    }

    /// A column of zeros before others took a diagonal entry of R from one of them: an innocent group was accused.
    #[test]
    fn an_empty_column_accuses_nobody_and_gets_the_mean_part_of_its_bound() {
        let mut rows = Rows::new(3);
        rows.push(&[0.0, 2.0, 0.0, 1.0]);
        rows.push(&[0.0, 0.0, 3.0, 3.0]);
        let reduced = rows.reduced(1.0, &[1.0; 3]);
        assert_eq!(reduced.dependent(), Vec::<Vec<usize>>::new());
        assert_eq!(reduced.seen(), [false, true, true]);
        assert_eq!(reduced.completed(vec![9.0, 0.5, 1.0], &[8.0, 1.0, 4.0]), [3.0, 0.5, 1.0]);
    }

    #[test]
    fn a_column_of_rounding_is_empty() {
        let column = |size: f64| {
            let mut rows = Rows::new(2);
            rows.push(&[1.0, 0.0, 1.0]);
            rows.push(&[0.0, size, 1.0]);
            rows.reduced(1.0, &[1.0, 100.0]).seen()
        };
        assert_eq!([column(9e-12), column(11e-12)], [[true, false], [true, true]]);
    }

    #[test]
    fn exactly_the_groups_of_a_dependence_are_named() {
        let mut stream = Stream::new(8, 0, 0);
        let mut rows = Rows::new(6);
        for _ in 0..30 {
            let [a, b, c] = [(); 3].map(|()| stream.normal());
            rows.push(&[0.0, a, c, b, 1e3 * a - 3e3 * b, 0.0, stream.normal()]);
        }
        let reduced = rows.reduced(1.0, &[0.0; 6]);
        assert_eq!(reduced.dependent(), [vec![1, 3, 4]]);
        assert_eq!(reduced.seen(), [false, true, true, true, true, false]);
    }
}
