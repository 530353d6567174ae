//! Dense kernels of a large front, cut into tiles that several threads can take.
//!
//! How a product is halved, and halved again, depends on its size alone, and one thread does each tile. So the bits are
//! the same for any number of threads; one thread does the same tiles one after the other.
//!
//! ```text
//! [ A11  .  ]   A11 = L11 L11^T by halves of its columns, down to a panel of PANEL columns:
//! [ A21 A22 ]   left half of all rows first, then A22 -= L21 L21^T, then the right half
//! ```

use std::ops::Range;

use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::llt::factor::{LltError, cholesky_in_place};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par, Spec};

use super::{Number, both};

/// Columns that one Cholesky kernel takes.
const PANEL: usize = 96;

/// Rows and columns of the largest tile: it stays in the second cache.
const LARGEST_SIDE: usize = 512;

/// Rows and columns of a tile that is never cut: its operands are copied once for every tile.
const SMALLEST_SIDE: usize = 128;

/// Columns of A that one product takes: a longer one leaves the caches.
const DEPTH: usize = 192;

/// Rows of L21 that one triangular solve takes.
const STRIP: usize = 192;

/// L11 and L21 of a front of `columns`, on one thread.
///
/// # Errors
/// The first column of the front whose pivot is not positive.
pub fn eliminate<T: Number>(columns: MatMut<T>, stack: &mut MemStack) -> Result<(), usize> {
    let w = columns.ncols();
    let (mut top, bottom) = columns.split_at_row_mut(w);
    match cholesky_in_place(top.rb_mut(), Default::default(), Par::Seq, stack, Spec::default()) {
        Err(LltError::NonPositivePivot { index }) => return Err(index),
        Ok(_) => strips(top.rb(), bottom, false),
    }
    Ok(())
}

/// The same in tiles.
///
/// # Errors
/// As [`eliminate`].
pub fn eliminate_in_tiles<T: Number>(mut columns: MatMut<T>, side: usize, stack: &mut MemStack) -> Result<(), usize> {
    let w = columns.ncols();
    if w <= PANEL {
        let (mut top, bottom) = columns.split_at_row_mut(w);
        match cholesky_in_place(top.rb_mut(), Default::default(), Par::Seq, stack, Spec::default()) {
            Err(LltError::NonPositivePivot { index }) => return Err(index),
            Ok(_) => strips(top.rb(), bottom, true),
        }
        return Ok(());
    }
    let half = half(w);
    eliminate_in_tiles(columns.rb_mut().split_at_col_mut(half).0, side, stack)?;
    let (left, right) = columns.split_at_col_mut(half);
    let (top, bottom) = left.rb().split_at_row(half).1.split_at_row(w - half);
    let mut right = right.split_at_row_mut(half).1;
    let (square, below) = right.rb_mut().split_at_row_mut(w - half);
    both(|| subtract_square(square, Accum::Add, top, side), || subtract_product(below, Accum::Add, bottom, top, side));
    eliminate_in_tiles(right, side, stack).map_err(|column| half + column)
}

/// X L^T = B in place, by strips of rows of B.
fn strips<T: Number>(triangle: MatRef<T>, rows: MatMut<T>, side_by_side: bool) {
    if rows.nrows() <= STRIP {
        return solve_lower_triangular_in_place(triangle, rows.transpose_mut(), Par::Seq);
    }
    let (upper, lower) = {
        let at = half(rows.nrows());
        rows.split_at_row_mut(at)
    };
    let (first, second) = (|| strips(triangle, upper, side_by_side), || strips(triangle, lower, side_by_side));
    match side_by_side {
        true => both(first, second),
        false => (first(), second()),
    };
}

/// Lower triangle of C - A A^T, or of -A A^T with [`Accum::Replace`].
pub fn subtract_square<T: Number>(c: MatMut<T>, accum: Accum, a: MatRef<T>, side: usize) {
    let n = c.nrows();
    if n <= side {
        return square(c, accum, a);
    }
    let half = half(n);
    let (upper, _, corner, lower) = c.split_at_mut(half, half);
    let (first, second) = a.split_at_row(half);
    both(
        || both(|| subtract_square(upper, accum, first, side), || subtract_square(lower, accum, second, side)),
        || subtract_product(corner, accum, second, first, side),
    );
}

/// Lower triangle of C - A A^T, or of -A A^T with [`Accum::Replace`], on one thread.
pub fn square<T: Number>(mut c: MatMut<T>, mut accum: Accum, a: MatRef<T>) {
    let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    for columns in slices(a.ncols()) {
        let a = a.subcols(columns.start, columns.len());
        triangular::matmul(c.rb_mut(), lower, accum, a, full, a.transpose(), full, -T::one_impl(), Par::Seq);
        accum = Accum::Add;
    }
}

/// C - A B^T, or -A B^T with [`Accum::Replace`].
fn subtract_product<T: Number>(c: MatMut<T>, accum: Accum, a: MatRef<T>, b: MatRef<T>, side: usize) {
    let (m, n) = (c.nrows(), c.ncols());
    if m.max(n) <= side {
        return product(c, accum, a, b);
    }
    if m >= n {
        let half = half(m);
        let ((upper, lower), (first, second)) = (c.split_at_row_mut(half), a.split_at_row(half));
        both(|| subtract_product(upper, accum, first, b, side), || subtract_product(lower, accum, second, b, side));
    } else {
        let half = half(n);
        let ((left, right), (first, second)) = (c.split_at_col_mut(half), b.split_at_row(half));
        both(|| subtract_product(left, accum, a, first, side), || subtract_product(right, accum, a, second, side));
    }
}

/// C - A B^T, or -A B^T with [`Accum::Replace`], on one thread.
fn product<T: Number>(mut c: MatMut<T>, mut accum: Accum, a: MatRef<T>, b: MatRef<T>) {
    for columns in slices(a.ncols()) {
        let (a, b) = (a.subcols(columns.start, columns.len()), b.subcols(columns.start, columns.len()));
        matmul(c.rb_mut(), accum, a, b.transpose(), -T::one_impl(), Par::Seq);
        accum = Accum::Add;
    }
}

/// The columns 0..n in slices of nearly the same width, at most [`DEPTH`] each.
fn slices(n: usize) -> impl Iterator<Item = Range<usize>> {
    let count = n.div_ceil(DEPTH);
    (0..count).map(move |slice| slice * n / count..(slice + 1) * n / count)
}

/// Rows and columns of the tiles of a front of this height: enough tiles for several threads.
pub fn side(height: usize) -> usize {
    (height / 4).clamp(SMALLEST_SIDE, LARGEST_SIDE)
}

/// About half of n, a whole number of registers.
fn half(n: usize) -> usize {
    (n / 2).next_multiple_of(48).min(n)
}
