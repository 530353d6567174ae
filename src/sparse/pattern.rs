//! The pattern of a symmetric matrix: which degrees of freedom couple.
//!
//! A finite element, a knot span or a spring couples all its free degrees of freedom with each other; such a set is a
//! *clique*. The pattern of K is the union of its cliques and the diagonal, stored as full CSR (both triangles, columns
//! ascending in each row). It is built once for a network or a body and shared by every matrix on it.

use nalgebra_sparse::CsrMatrix;
use nalgebra_sparse::pattern::SparsityPattern;
use rayon::prelude::*;

/// Degree of freedom number that stands for "held": skipped wherever it appears in a clique.
const HELD: u32 = u32::MAX;

/// The sparsity of a symmetric n x n matrix with a full diagonal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern(SparsityPattern);

impl Pattern {
    /// The pattern of `n` unknowns where the members of each clique couple with each other. Members equal to
    /// `u32::MAX` (held degrees of freedom) are skipped.
    ///
    /// # Panics
    /// When a member is not below `n`.
    pub fn from_cliques<'a>(n: usize, cliques: impl Iterator<Item = &'a [u32]> + Clone) -> Self {
        let (starts, members) = gather_cliques(cliques);
        let (touch_starts, touching) = cliques_of_unknowns(n, &starts, &members);
        let touching_of = |row: usize| &touching[touch_starts[row]..touch_starts[row + 1]];
        let build_row = |seen: &mut Vec<u32>, row: usize| -> Vec<usize> {
            let mut columns = vec![row];
            seen[row] = row as u32;
            for &clique in touching_of(row) {
                for &column in &members[starts[clique as usize]..starts[clique as usize + 1]] {
                    if seen[column as usize] != row as u32 {
                        seen[column as usize] = row as u32;
                        columns.push(column as usize);
                    }
                }
            }
            columns.sort_unstable();
            columns
        };
        let rows: Vec<Vec<usize>> =
            (0..n).into_par_iter().map_init(|| vec![HELD; n], |seen, row| build_row(seen, row)).collect();
        let mut offsets = Vec::with_capacity(n + 1);
        offsets.push(0);
        for row in &rows {
            offsets.push(offsets[offsets.len() - 1] + row.len());
        }
        let indices = rows.concat();
        let pattern = SparsityPattern::try_from_offsets_and_indices(n, n, offsets, indices);
        Self(pattern.expect("rows are sorted and without repetition by construction"))
    }

    /// The pattern of a matrix that is symmetric.
    ///
    /// # Panics
    /// When the matrix is not square or lacks an entry of its diagonal.
    pub fn of(matrix: &CsrMatrix<f64>) -> Self {
        assert_eq!(matrix.nrows(), matrix.ncols(), "a square matrix");
        let pattern = Self(matrix.pattern().clone());
        assert!((0..pattern.len()).all(|i| pattern.position(i, i).is_some()), "a full diagonal");
        pattern
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.0.major_dim()
    }

    /// True when there are no unknowns.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of stored entries, both triangles.
    pub fn entries(&self) -> usize {
        self.0.nnz()
    }

    /// Columns of a row, ascending.
    pub fn row(&self, row: usize) -> &[usize] {
        self.0.lane(row)
    }

    /// First position of each row in the value array; length n + 1.
    pub fn offsets(&self) -> &[usize] {
        self.0.major_offsets()
    }

    /// Where entry (row, column) is in the value array, if it is stored.
    pub fn position(&self, row: usize, column: usize) -> Option<usize> {
        let found = self.row(row).binary_search(&column).ok()?;
        Some(self.offsets()[row] + found)
    }

    /// The same pattern as nalgebra-sparse sees it.
    pub fn as_csr(&self) -> &SparsityPattern {
        &self.0
    }
}

/// The free members of all cliques in one array, with the start of each clique.
fn gather_cliques<'a>(cliques: impl Iterator<Item = &'a [u32]>) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0];
    let mut members = Vec::new();
    for clique in cliques {
        members.extend(clique.iter().copied().filter(|&dof| dof != HELD));
        starts.push(members.len());
    }
    (starts, members)
}

/// For every unknown the cliques it is in, by counting sort.
fn cliques_of_unknowns(n: usize, starts: &[usize], members: &[u32]) -> (Vec<usize>, Vec<u32>) {
    let mut touch_starts = vec![0usize; n + 1];
    for &dof in members {
        touch_starts[dof as usize + 1] += 1;
    }
    for i in 0..n {
        touch_starts[i + 1] += touch_starts[i];
    }
    let mut next = touch_starts.clone();
    let mut touching = vec![0u32; members.len()];
    for clique in 0..starts.len() - 1 {
        for &dof in &members[starts[clique]..starts[clique + 1]] {
            touching[next[dof as usize]] = clique as u32;
            next[dof as usize] += 1;
        }
    }
    (touch_starts, touching)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cliques_couple_their_free_members_and_nothing_else() {
        let cliques: Vec<Vec<u32>> = vec![vec![2, 0, HELD], vec![2, 3]];
        let pattern = Pattern::from_cliques(5, cliques.iter().map(Vec::as_slice));
        assert_eq!(pattern.row(0), [0, 2]);
        assert_eq!(pattern.row(1), [1]);
        assert_eq!(pattern.row(2), [0, 2, 3]);
        assert_eq!(pattern.row(4), [4]);
        assert_eq!(pattern.position(2, 3), Some(5));
        assert_eq!(pattern.position(0, 3), None);
        assert_eq!(pattern.entries(), 9);
    }
}
