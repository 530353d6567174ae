//! How many ways there are to move without resistance, and which: the null space of a stiffness matrix K.
//!
//! With S = diag(K_ii^-1/2) the matrix A = S K S has a unit diagonal (a row without stiffness stays zero) and its
//! eigenvalues do not depend on units nor much on a spread of stiffness. A sparse factorisation of a shifted matrix
//!
//! ```text
//! A - tau 1 = L D L^T,     tau = 1e-13
//! ```
//!
//! has as many negative pivots D_jj as A has eigenvalues below tau (Sylvester's law of inertia; J. R. Bunch, L. Kaufman,
//! B. N. Parlett, Numer. Math. 27, 1976): the zero modes, counted exactly, however many there are. The matrix is
//! indefinite and is not pivoted; that is harmless, because where a pivot is negative the rest of its row belongs to
//! zero modes too and is as small, so that L does not grow. Rounding moves an eigenvalue by about 1e-16 of the largest,
//! so that a mode that resists with less than tau of the stiffness around it counts as a zero mode: no factorisation in
//! f64 could tell it from one.
//!
//! Each negative pivot j also gives a mode: the solution of L^T v = e_j has v^T (A - tau) v = D_jj < 0, and these vectors
//! are independent. The displacement is S v.
//!
//! This factorisation goes column by column (T. A. Davis, ACM Trans. Math. Softw. 31, 2005), slower than the fronts
//! of [`super::cholesky`]; it serves where those found a pivot too small to be trusted, and to count.

use super::cholesky::Symbolic;

/// Eigenvalues of the scaled matrix below this are zero.
pub const SHIFT: f64 = 1e-13;

/// Modes whose vectors are computed.
pub const MOST_VECTORS: usize = 16;

/// The null space of a symmetric matrix without negative eigenvalues.
#[derive(Debug, Clone, PartialEq)]
pub struct ZeroModes {
    /// Its dimension.
    pub count: usize,
    /// Independent vectors of it over the unknowns, the largest entry 1; the first [`MOST_VECTORS`] of them.
    pub vectors: Vec<Vec<f64>>,
}

impl ZeroModes {
    /// An unknown that the first of them moves most; 0 when there is none.
    pub fn loosest(&self) -> usize {
        self.vectors.first().and_then(|mode| mode.iter().position(|u| u.abs() == 1.0)).unwrap_or(0)
    }
}

/// The zero modes of the matrix with these values of the permuted lower triangle (in the order of
/// [`Symbolic::lower_rows`]).
///
/// # Panics
/// When `values` has another length than the triangle.
pub fn zero_modes(symbolic: &Symbolic, values: &[f64]) -> ZeroModes {
    assert_eq!(values.len(), symbolic.lower_rows().len(), "the values of the analysed triangle");
    let rows = Rows::scaled(symbolic, values);
    let factor = factorise(&rows);
    let negative: Vec<usize> = (0..factor.pivots.len()).filter(|&j| factor.pivots[j] < 0.0).collect();
    let vectors = negative.iter().take(MOST_VECTORS).map(|&j| {
        let scaled = factor.mode(j);
        let mut mode = vec![0.0; scaled.len()];
        for (k, &unknown) in symbolic.order().iter().enumerate() {
            mode[unknown as usize] = rows.scaling[k] * scaled[k];
        }
        let largest = mode.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        mode.iter_mut().for_each(|u| *u /= largest);
        mode
    });
    ZeroModes { count: negative.len(), vectors: vectors.collect() }
}

/// The scaled and shifted lower triangle by rows, in elimination order; the diagonal apart.
struct Rows {
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
    diagonal: Vec<f64>,
    /// S_jj.
    scaling: Vec<f64>,
}

impl Rows {
    fn scaled(symbolic: &Symbolic, lower: &[f64]) -> Self {
        let (starts, rows) = (symbolic.lower_starts(), symbolic.lower_rows());
        let n = symbolic.len();
        let size = |j: usize| lower[starts[j] as usize];
        let scaling: Vec<f64> = (0..n).map(|j| if size(j) > 0.0 { size(j).sqrt().recip() } else { 1.0 }).collect();
        let below = |j: usize| starts[j] as usize + 1..starts[j + 1] as usize;
        let mut row_starts = vec![0_usize; n + 1];
        (0..n).flat_map(below).for_each(|entry| row_starts[rows[entry] as usize + 1] += 1);
        (0..n).for_each(|i| row_starts[i + 1] += row_starts[i]);
        let mut next = row_starts.clone();
        let (mut columns, mut values) = (vec![0_u32; row_starts[n]], vec![0.0; row_starts[n]]);
        for j in 0..n {
            for entry in below(j) {
                let i = rows[entry] as usize;
                columns[next[i]] = j as u32;
                values[next[i]] = scaling[i] * lower[entry] * scaling[j];
                next[i] += 1;
            }
        }
        let diagonal = (0..n).map(|j| if size(j) > 0.0 { 1.0 - SHIFT } else { -SHIFT }).collect();
        Self { starts: row_starts, columns, values, diagonal, scaling }
    }

    /// Column and value of the entries of a row left of the diagonal.
    fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        self.columns[range.clone()].iter().map(|&j| j as usize).zip(self.values[range].iter().copied())
    }
}

/// L by columns (without its unit diagonal) and D.
struct Factor {
    columns: Vec<Vec<(u32, f64)>>,
    pivots: Vec<f64>,
}

/// No column of the elimination tree.
const NONE: usize = usize::MAX;

/// L D L^T row by row: row k of L solves L_{<k} D y = a_k, over the columns that the elimination tree reaches.
fn factorise(rows: &Rows) -> Factor {
    let n = rows.diagonal.len();
    let mut parent = vec![NONE; n];
    let mut seen = vec![NONE; n];
    let mut y = vec![0.0; n];
    let mut factor = Factor { columns: vec![Vec::new(); n], pivots: vec![0.0; n] };
    let (mut path, mut reached) = (Vec::new(), Vec::new());
    for k in 0..n {
        seen[k] = k;
        reached.clear();
        for (column, value) in rows.row(k) {
            y[column] = value;
            let mut at = column;
            while seen[at] != k {
                path.push(at);
                seen[at] = k;
                if parent[at] == NONE {
                    parent[at] = k;
                }
                at = parent[at];
            }
            reached.append(&mut path);
        }
        // a column comes after those below it in the tree, which have smaller numbers
        reached.sort_unstable();
        let mut pivot = rows.diagonal[k];
        for &j in &reached {
            let value = std::mem::take(&mut y[j]);
            factor.columns[j].iter().for_each(|&(i, l)| y[i as usize] -= l * value);
            let l = value / factor.pivots[j];
            pivot -= l * value;
            factor.columns[j].push((k as u32, l));
        }
        factor.pivots[k] = if pivot == 0.0 || pivot.is_nan() { -SHIFT } else { pivot };
    }
    factor
}

impl Factor {
    /// The solution of L^T v = e_j.
    fn mode(&self, j: usize) -> Vec<f64> {
        let mut v = vec![0.0; self.pivots.len()];
        v[j] = 1.0;
        for i in (0..j).rev() {
            v[i] = -self.columns[i].iter().map(|&(row, l)| l * v[row as usize]).sum::<f64>();
        }
        v
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::pattern::Pattern;

    /// Chains of unit springs along a line, one for each length; the first node of a chain may be held by another.
    fn chains(lengths: &[usize], stiffness: f64, held: bool) -> (std::sync::Arc<Symbolic>, Vec<f64>) {
        let n: usize = lengths.iter().sum();
        let mut pairs = Vec::new();
        let mut first = 0;
        for &length in lengths {
            pairs.extend((first..first + length - 1).map(|i| [i as u32, i as u32 + 1]));
            first += length;
        }
        let pattern = Pattern::from_cliques(n, pairs.iter().map(|pair| pair.as_slice()));
        let symbolic = Symbolic::analyse(&pattern, (0..n as u32).rev().collect()).unwrap();
        let mut rank = vec![0_usize; n];
        symbolic.order().iter().enumerate().for_each(|(k, &i)| rank[i as usize] = k);
        let mut values = vec![0.0; symbolic.lower_rows().len()];
        let mut add = |i: usize, j: usize, value: f64| {
            let (row, column) = (rank[i].max(rank[j]), rank[i].min(rank[j]));
            let first = symbolic.lower_starts()[column] as usize;
            let place = symbolic.lower_rows()[first..].iter().position(|&r| r as usize == row).unwrap();
            values[first + place] += value;
        };
        for &[a, b] in &pairs {
            let (a, b) = (a as usize, b as usize);
            [(a, a, stiffness), (b, b, stiffness), (a, b, -stiffness)].into_iter().for_each(|(i, j, k)| add(i, j, k));
        }
        if held {
            add(0, 0, stiffness);
        }
        (symbolic, values)
    }

    #[test]
    fn every_loose_chain_is_a_zero_mode_and_a_held_one_is_not() {
        for stiffness in [1e-9, 1.0, 1e15] {
            for (lengths, held, count) in [
                (&[50][..], false, 1),
                (&[50], true, 0),
                (&[3, 400, 7, 1], false, 4),
                (&[3, 400, 7, 1], true, 3),
                (&[1; 40], false, 40),
            ] {
                let (symbolic, values) = chains(lengths, stiffness, held);
                let found = zero_modes(&symbolic, &values);
                assert_eq!(found.count, count, "{lengths:?} {held}");
                assert_eq!(found.vectors.len(), count.min(MOST_VECTORS));
                // each moves the nodes of a chain alike, but for the shift over the lowest eigenvalue (1e-13 / 6e-5), and 400 nodes
                for mode in &found.vectors {
                    let mut first = 0;
                    for &length in lengths {
                        let chain = &mode[first..first + length];
                        assert!(chain.iter().all(|u| (u - chain[0]).abs() < 1e-5), "{lengths:?} {mode:?}");
                        first += length;
                    }
                }
            }
        }
    }
}
