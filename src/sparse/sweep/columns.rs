//! Down and up one supernode for several right-hand sides, with dense kernels.
//!
//! The right-hand sides of an unknown stand together (row by row), so that a subtree has a stretch of its own. The kernels
//! want them column by column: the rows that a supernode touches are copied into small blocks and back.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par};

use super::supernode::{Entry, Supernode};

/// Rows of the unknowns of a supernode and of those further on, column by column, w x k and r x k.
pub struct Blocks<'a, T> {
    /// The supernode's own.
    pub own: &'a mut [T],
    /// Those further on.
    pub below: &'a mut [T],
}

/// Copies rows of k numbers (row `at(i)` of the outer world is row i here) into columns.
pub fn gather<'a, T: Entry + 'a>(block: &mut [T], rows: usize, k: usize, at: impl Fn(usize) -> &'a [T]) {
    for i in 0..rows {
        for (column, value) in at(i)[..k].iter().enumerate() {
            block[column * rows + i] = *value;
        }
    }
}

/// Solves for its own unknowns; `below` becomes what those further on lose, negative.
pub fn down<T: Entry>(node: &Supernode<T>, k: usize, blocks: Blocks<T>) {
    let (top, bottom) = parts(node);
    let mut own = MatMut::from_column_major_slice_mut(blocks.own, node.width(), k);
    solve_lower_triangular_in_place(top, own.as_mut(), Par::Seq);
    let below = MatMut::from_column_major_slice_mut(blocks.below, node.pattern.len(), k);
    matmul(below, Accum::Replace, bottom, own.as_ref(), -T::one_impl(), Par::Seq);
}

/// Solves for its own unknowns with those further on in `below`.
pub fn up<T: Entry>(node: &Supernode<T>, k: usize, blocks: Blocks<T>) {
    let (top, bottom) = parts(node);
    let mut own = MatMut::from_column_major_slice_mut(blocks.own, node.width(), k);
    let below = MatRef::from_column_major_slice(&*blocks.below, node.pattern.len(), k);
    matmul(own.as_mut(), Accum::Add, bottom.transpose(), below, -T::one_impl(), Par::Seq);
    solve_upper_triangular_in_place(top.transpose(), own, Par::Seq);
}

/// T and R.
fn parts<'a, T: Entry>(node: &Supernode<'a, T>) -> (MatRef<'a, T>, MatRef<'a, T>) {
    let width = node.width();
    MatRef::from_column_major_slice(node.block(), width + node.pattern.len(), width).split_at_row(width)
}
