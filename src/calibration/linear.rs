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

use crate::dense::{dot, triangle_of};

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

    /// The triangle, with the distance |A phi - b| multiplied by `scale`.
    pub fn reduced(mut self, scale: f64) -> Reduced {
        self.fold();
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

    /// The groups whose columns follow from those before them, as far as rounding can tell. A column of zeros is not
    /// among them.
    pub fn dependent(&self) -> Vec<usize> {
        let norms = self.column_norms();
        let rounding = 1e-13 * self.rows() as f64;
        let rest = |a: usize| self.triangle[a * self.rows() + a].abs();
        (0..self.groups).filter(|&a| norms[a] > 0.0 && rest(a) <= rounding * norms[a]).collect()
    }
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
        let reduced = taken.reduced(2.0);
        for phi in [[0.0, 0.0, 0.0], [1.0, -2.0, 0.5]] {
            let residual = |row: &Vec<f64>| dot(&row[..groups], &phi) - row[groups];
            let direct = 2.0 * all.iter().map(|row| residual(row).powi(2)).sum::<f64>().sqrt();
            assert!((reduced.distance(&phi) / direct - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn a_column_that_follows_from_others_is_found() {
        let mut stream = Stream::new(8, 0, 0);
        let mut rows = Rows::new(4);
        for _ in 0..30 {
            let [a, b] = [stream.normal(), stream.normal()];
            rows.push(&[a, b, 3.0 * a - b, 0.0, stream.normal()]);
        }
        let reduced = rows.reduced(1.0);
        assert_eq!(reduced.dependent(), [2]);
        assert_eq!(reduced.column_norms()[3], 0.0);
    }
}
