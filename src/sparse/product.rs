//! y = A x with the permuted lower triangle that a factorisation reads.
//!
//! Only the lower triangle of the symmetric A is stored, so an entry a_ij works twice:
//!
//! ```text
//! y_i += a_ij x_j,      y_j += a_ij x_i       (i > j),      y_j += a_jj x_j
//! ```
//!
//! The unknowns of one node (the components of its displacement) stand side by side in an elimination order by nodes and
//! couple to the same others. Their columns are taken together: each row index is read once for up to `WIDEST`
//! columns, and the vectors are touched once. All vectors are in elimination order. The order of every sum is fixed.

use std::sync::Arc;

use crate::sparse::cholesky::Symbolic;

/// Most columns that are taken together.
const WIDEST: usize = 3;

/// The product with matrices on one analysed pattern.
pub struct SymmetricProduct {
    symbolic: Arc<Symbolic>,
    /// First column of each bundle of columns with the same rows below it, and n at the end.
    bundles: Vec<u32>,
}

impl SymmetricProduct {
    /// Finds the columns that can be taken together.
    pub fn new(symbolic: Arc<Symbolic>) -> Self {
        let (starts, rows) = (symbolic.lower_starts(), symbolic.lower_rows());
        let column = |j: usize| &rows[starts[j] as usize..starts[j + 1] as usize];
        let n = symbolic.len();
        let mut bundles = vec![0_u32];
        for j in 1..n {
            let first = bundles[bundles.len() - 1] as usize;
            let same = column(j - 1)[1..] == *column(j);
            if !same || j - first == WIDEST {
                bundles.push(j as u32);
            }
        }
        if n > 0 {
            bundles.push(n as u32);
        }
        Self { symbolic, bundles }
    }

    /// y = A x; `values` as in [`Symbolic::lower_rows`], `x` and `y` in elimination order.
    ///
    /// # Panics
    /// When a slice is shorter than the pattern asks for.
    pub fn apply(&self, values: &[f64], x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for ends in self.bundles.windows(2) {
            let j = ends[0] as usize;
            match ends[1] - ends[0] {
                3 => self.bundle::<3>(values, j, x, y),
                2 => self.bundle::<2>(values, j, x, y),
                _ => self.bundle::<1>(values, j, x, y),
            }
        }
    }

    /// The columns j .. j + WIDTH: their triangle on the diagonal, then the rows below that they share.
    fn bundle<const WIDTH: usize>(&self, values: &[f64], j: usize, x: &[f64], y: &mut [f64]) {
        let starts = self.symbolic.lower_starts();
        let here: [f64; WIDTH] = std::array::from_fn(|c| x[j + c]);
        let mut sums = [0.0; WIDTH];
        for c in 0..WIDTH {
            let triangle = &values[starts[j + c] as usize..][..WIDTH - c];
            sums[c] += triangle[0] * here[c];
            for r in c + 1..WIDTH {
                sums[r] += triangle[r - c] * here[c];
                sums[c] += triangle[r - c] * here[r];
            }
        }
        let below = |c: usize| starts[j + c] as usize + WIDTH - c..starts[j + c + 1] as usize;
        let rows = &self.symbolic.lower_rows()[below(0)];
        let columns: [&[f64]; WIDTH] = std::array::from_fn(|c| &values[below(c)][..rows.len()]);
        for (t, &i) in rows.iter().enumerate() {
            let (x_i, mut sum) = (x[i as usize], 0.0);
            for c in 0..WIDTH {
                let a = columns[c][t];
                sum += a * here[c];
                sums[c] += a * x_i;
            }
            y[i as usize] += sum;
        }
        for c in 0..WIDTH {
            y[j + c] += sums[c];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::pattern::Pattern;

    #[test]
    fn the_product_is_that_of_the_whole_matrix_for_bundles_of_any_width() {
        // nodes of 3, 1, 2, 4 and 3 unknowns, all neighbours coupled; eliminated in a mixed order of nodes
        let nodes: [&[u32]; 5] = [&[0, 1, 2], &[3], &[4, 5], &[6, 7, 8, 9], &[10, 11, 12]];
        let cliques: Vec<Vec<u32>> = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (0, 2)]
            .iter()
            .map(|&(a, b): &(usize, usize)| [nodes[a], nodes[b]].concat())
            .collect();
        let pattern = Pattern::from_cliques(13, cliques.iter().map(Vec::as_slice));
        let order: Vec<u32> = [3, 0, 4, 1, 2].iter().flat_map(|&node: &usize| nodes[node].iter().copied()).collect();
        let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
        let product = SymmetricProduct::new(Arc::clone(&symbolic));
        assert!(product.bundles.len() < 13, "{:?}", product.bundles);
        let values: Vec<f64> = (0..symbolic.lower_rows().len()).map(|e| (e as f64 * 0.7).sin()).collect();
        let x: Vec<f64> = (0..13).map(|i| (i as f64 * 1.3).cos()).collect();
        let mut expected = [0.0; 13];
        let (starts, rows) = (symbolic.lower_starts(), symbolic.lower_rows());
        for j in 0..13 {
            let column = starts[j] as usize..starts[j + 1] as usize;
            for (&i, a) in rows[column.clone()].iter().zip(&values[column]) {
                let i = i as usize;
                expected[i] += a * x[j];
                if i != j {
                    expected[j] += a * x[i];
                }
            }
        }
        let mut y = [f64::NAN; 13];
        product.apply(&values, &x, &mut y);
        assert!(y.iter().zip(&expected).all(|(y, e)| (y - e).abs() < 1e-14), "{y:?} {expected:?}");
    }
}
