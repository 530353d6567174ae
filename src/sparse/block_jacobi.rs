//! Block Jacobi: the preconditioner that knows every node by itself.
//!
//! M = diag(A_11, ..., A_nn)^-1 with the d x d block A_aa of each node, d <= 3. It makes conjugate gradients indifferent to
//! how stiff, how heavy and how turned single nodes are, and to nothing else: good for time steps, where the mass keeps
//! nodes apart, poor for statics of large bodies.

use nalgebra_sparse::na::{Matrix3, Vector3};

use crate::sparse::pattern::Pattern;

/// A place of a block that is not stored.
const NOWHERE: usize = usize::MAX;

/// The inverses of the diagonal blocks of a matrix.
#[derive(Debug, Clone)]
pub struct BlockJacobi {
    /// First unknown of each block, and the number of unknowns.
    starts: Vec<usize>,
    /// Where the entries of each block stand in the values, row-major.
    places: Vec<[usize; 9]>,
    inverses: Vec<Matrix3<f64>>,
}

impl BlockJacobi {
    /// Finds the blocks; `owner(i)` is the node of unknown i. The unknowns of a node follow each other, three at most.
    ///
    /// # Panics
    /// When a node has more than three unknowns.
    pub fn new(pattern: &Pattern, owner: impl Fn(usize) -> usize) -> Self {
        let n = pattern.len();
        let mut starts: Vec<usize> = (0..n).filter(|&i| i == 0 || owner(i) != owner(i - 1)).collect();
        starts.push(n);
        let entries = |block: &[usize]| -> [usize; 9] {
            assert!(block[1] - block[0] <= 3, "a node has three unknowns at most");
            std::array::from_fn(|k| {
                let (row, column) = (block[0] + k / 3, block[0] + k % 3);
                let inside = row < block[1] && column < block[1];
                inside.then(|| pattern.position(row, column)).flatten().unwrap_or(NOWHERE)
            })
        };
        let places: Vec<[usize; 9]> = starts.windows(2).map(entries).collect();
        Self { inverses: vec![Matrix3::identity(); places.len()], starts, places }
    }

    /// Takes the values of a matrix on the pattern. A singular block leaves its unknowns as they are. Allocates nothing.
    ///
    /// # Panics
    /// When there are fewer values than the pattern has entries.
    pub fn load(&mut self, values: &[f64]) {
        for (inverse, places) in self.inverses.iter_mut().zip(&self.places) {
            let block = Matrix3::from_fn(|i, j| match places[3 * i + j] {
                // what a node of fewer unknowns leaves of the block
                NOWHERE => f64::from(i == j),
                place => values[place],
            });
            *inverse = block.try_inverse().unwrap_or_else(Matrix3::identity);
        }
    }

    /// z = M r
    ///
    /// # Panics
    /// When a slice is shorter than the unknowns.
    pub fn apply(&self, r: &[f64], z: &mut [f64]) {
        for (ends, inverse) in self.starts.windows(2).zip(&self.inverses) {
            let (from, to) = (&r[ends[0]..ends[1]], &mut z[ends[0]..ends[1]]);
            let product = inverse * Vector3::from_fn(|i, _| from.get(i).copied().unwrap_or(0.0));
            to.iter_mut().zip(product.iter()).for_each(|(z, p)| *z = *p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_two_nodes_are_inverted_and_nothing_else() {
        // node 0 has three unknowns, node 7 two
        let pattern = Pattern::from_cliques(5, [[0u32, 1, 2, 3, 4]].iter().map(|clique| clique.as_slice()));
        let mut jacobi = BlockJacobi::new(&pattern, |i| if i < 3 { 0 } else { 7 });
        let mut values = vec![9.0; 25];
        let mut set = |i: usize, j: usize, value: f64| values[5 * i + j] = value;
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            set(i, j, if i == j { 2.0 } else { 0.0 });
        }
        [(3, 3, 2.0), (3, 4, 1.0), (4, 3, 1.0), (4, 4, 1.0)].iter().for_each(|&(i, j, value)| set(i, j, value));
        jacobi.load(&values);
        let mut z = [0.0; 5];
        jacobi.apply(&[2.0, 4.0, 6.0, 3.0, 2.0], &mut z);
        assert_eq!(z, [1.0, 2.0, 3.0, 1.0, 1.0]);
    }
}
