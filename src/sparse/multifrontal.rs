//! The numbers of a sparse Cholesky factorisation, front by front.
//!
//! A supernode s is a run of w columns of L with the same rows below them, r of them. Its *front* is what those rows
//! and columns of the matrix have become when all columns that come before and touch them are eliminated:
//!
//! ```text
//! F = [ A11  .  ]   w rows       A11 = L11 L11^T,     L21 = A21 L11^-T,     U = F22 - L21 L21^T
//!     [ A21 F22 ]   r rows
//! ```
//!
//! L11 and L21 are final. U, the *update*, waits until the parent of s (the supernode that holds the first of the r
//! rows) builds its front: the entries of A in its columns plus the updates of its children, each added where its rows are
//! (I. S. Duff and J. K. Reid, ACM Trans. Math. Softw. 9, 1983). So every product is one dense L21 L21^T of all r rows,
//! and each of its entries is moved once for each generation, not once for each ancestor it changes.
//!
//! F22 is never stored apart: U = -L21 L21^T is written first, then the children are added to it. Only lower triangles are
//! touched. Where every update lies in the workspace is decided once ([`Plan`]), and the order of every sum is fixed.

use std::ops::{AddAssign, Range};

use faer::dyn_stack::{MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{LltError, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::sparse::SparseColMatRef;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::traits::{RealField, pulp};
use faer::{Accum, MatMut, MatRef, Par, Spec};

/// f64 or f32.
pub trait Number: RealField + Copy + Default + AddAssign {}

impl Number for f64 {}
impl Number for f32 {}

/// The supernodes of a pattern.
type Supernodes = SymbolicSupernodalCholesky<u32>;

/// What depends on the pattern only: who is whose child, and where each update lies.
#[derive(Debug)]
pub struct Plan {
    /// Children of supernode s: `children[starts[s]..starts[s + 1]]`.
    starts: Vec<u32>,
    children: Vec<u32>,
    /// First entry of the update of each supernode in the workspace.
    offsets: Vec<usize>,
    length: usize,
    widest: usize,
}

/// Workspace of one factorisation, in f64 or f32.
pub struct Workspace<T> {
    updates: Vec<T>,
    /// Place of each unknown in the front at work; only rows of that front are valid.
    places: Vec<u32>,
    runs: Vec<Run>,
    /// The widest registers of this machine; sums of entries are the same in all.
    simd: pulp::Arch,
}

/// Neighbouring rows of a child that are neighbours in the front too.
#[derive(Clone, Copy)]
struct Run {
    from: usize,
    to: usize,
    length: usize,
}

impl Plan {
    /// Decides where every update lies: at its birth the first gap that is large enough, until its parent has taken it.
    pub fn new(supernodes: &Supernodes) -> Self {
        let count = supernodes.n_supernodes();
        let parents = parents(supernodes);
        let mut starts = vec![0_u32; count + 1];
        parents.iter().flatten().for_each(|&parent| starts[parent + 1] += 1);
        (0..count).for_each(|s| starts[s + 1] += starts[s]);
        let (mut next, mut children) = (starts.clone(), vec![0; starts[count] as usize]);
        for (s, parent) in parents.iter().enumerate() {
            if let Some(parent) = *parent {
                children[next[parent] as usize] = s as u32;
                next[parent] += 1;
            }
        }
        let mut gaps = Gaps::default();
        let mut offsets = vec![0; count];
        let size = |s: usize| supernodes.supernode(s).pattern().len().pow(2);
        for s in 0..count {
            offsets[s] = gaps.take(size(s));
            for &child in &children[starts[s] as usize..starts[s + 1] as usize] {
                gaps.give(offsets[child as usize], size(child as usize));
            }
        }
        let widest = (0..count).map(|s| width(supernodes, s)).max().unwrap_or(0);
        Self { starts, children, offsets, length: gaps.end, widest }
    }

    /// Numbers that the waiting updates take.
    pub fn update_entries(&self) -> usize {
        self.length
    }

    /// Workspace of the dense kernels.
    pub fn scratch<T: Number>(&self) -> StackReq {
        cholesky_in_place_scratch::<T>(self.widest, Par::Seq, Spec::default())
    }

    fn children(&self, s: usize) -> &[u32] {
        &self.children[self.starts[s] as usize..self.starts[s + 1] as usize]
    }
}

impl<T: Number> Workspace<T> {
    /// Allocates what factorisations with this plan need.
    pub fn new(plan: &Plan, supernodes: &Supernodes) -> Self {
        let longest = (0..supernodes.n_supernodes()).map(|s| supernodes.supernode(s).pattern().len()).max();
        Self {
            updates: vec![T::default(); plan.length],
            simd: pulp::Arch::new(),
            places: vec![0; supernodes.nrows()],
            runs: Vec::with_capacity(longest.unwrap_or(0)),
        }
    }
}

/// Free stretches of the workspace, by their start.
#[derive(Default)]
struct Gaps {
    free: Vec<(usize, usize)>,
    end: usize,
}

impl Gaps {
    /// The start of a stretch of `size` that is not used.
    fn take(&mut self, size: usize) -> usize {
        if size == 0 {
            return 0;
        }
        match self.free.iter().position(|gap| gap.1 >= size) {
            Some(index) => {
                let (start, room) = self.free[index];
                if room == size {
                    self.free.remove(index);
                } else {
                    self.free[index] = (start + size, room - size);
                }
                start
            }
            None => {
                // a gap at the end grows
                let start = match self.free.last() {
                    Some(&(start, room)) if start + room == self.end => {
                        self.free.pop();
                        start
                    }
                    _ => self.end,
                };
                self.end = start + size;
                start
            }
        }
    }

    /// Gives a stretch back and joins it with its neighbours.
    fn give(&mut self, start: usize, size: usize) {
        if size == 0 {
            return;
        }
        let at = self.free.partition_point(|gap| gap.0 < start);
        self.free.insert(at, (start, size));
        if at + 1 < self.free.len() && start + size == self.free[at + 1].0 {
            self.free[at].1 += self.free.remove(at + 1).1;
        }
        if at > 0 && self.free[at - 1].0 + self.free[at - 1].1 == start {
            self.free[at - 1].1 += self.free.remove(at).1;
        }
    }
}

fn width(supernodes: &Supernodes, s: usize) -> usize {
    (supernodes.supernode_end()[s] - supernodes.supernode_begin()[s]) as usize
}

/// The supernode that takes the update of each supernode.
fn parents(supernodes: &Supernodes) -> Vec<Option<usize>> {
    let ends = supernodes.supernode_end();
    let holder = |row: u32| ends.partition_point(|&end| end <= row);
    (0..supernodes.n_supernodes()).map(|s| supernodes.supernode(s).pattern().first().map(|&row| holder(row))).collect()
}

/// Factors the permuted lower triangle `lower` into `factor` (the layout of the supernodes).
///
/// # Errors
/// The column whose pivot is not positive.
pub fn factorise<T: Number>(
    plan: &Plan,
    supernodes: &Supernodes,
    lower: SparseColMatRef<u32, T>,
    factor: &mut [T],
    work: &mut Workspace<T>,
    stack: &mut MemStack,
) -> Result<(), usize> {
    let values = supernodes.col_ptr_for_val();
    for s in 0..supernodes.n_supernodes() {
        let first = supernodes.supernode_begin()[s] as usize;
        let (w, rows) = (width(supernodes, s), supernodes.supernode(s).pattern());
        let height = w + rows.len();
        for (place, row) in (first as u32..(first + w) as u32).chain(rows.iter().copied()).enumerate() {
            work.places[row as usize] = place as u32;
        }
        let columns = &mut factor[values[s] as usize..values[s + 1] as usize];
        columns.fill(T::default());
        for (column, j) in columns.chunks_exact_mut(height).zip(first..) {
            for (&row, value) in lower.row_idx_of_col_raw(j).iter().zip(lower.val_of_col(j)) {
                column[work.places[row as usize] as usize] += *value;
            }
        }
        for &child in plan.children(s) {
            let child_rows = supernodes.supernode(child as usize).pattern();
            find_runs(child_rows, &work.places, &mut work.runs);
            let inside = child_rows.partition_point(|&row| (row as usize) < first + w);
            let update = &work.updates[plan.offsets[child as usize]..][..child_rows.len().pow(2)];
            let places = |j: usize| work.places[child_rows[j] as usize] as usize * height;
            work.simd.dispatch(|| add_columns(&work.runs, 0..inside, update, child_rows.len(), columns, places, 0));
        }
        eliminate(columns, height, w, stack).map_err(|index| first + index)?;
        take_update(plan, supernodes, s, columns, work);
    }
    Ok(())
}

/// L11 and L21 of a front.
fn eliminate<T: Number>(columns: &mut [T], height: usize, w: usize, stack: &mut MemStack) -> Result<(), usize> {
    let (mut top, bottom) = MatMut::from_column_major_slice_mut(columns, height, w).split_at_row_mut(w);
    match cholesky_in_place(top.rb_mut(), Default::default(), Par::Seq, stack, Spec::default()) {
        Err(LltError::NonPositivePivot { index }) => return Err(index),
        Ok(_) => solve_lower_triangular_in_place(top.rb(), bottom.transpose_mut(), Par::Seq),
    }
    Ok(())
}

/// U of a front, and the rest of its children in it.
fn take_update<T: Number>(plan: &Plan, supernodes: &Supernodes, s: usize, columns: &[T], work: &mut Workspace<T>) {
    let (w, r) = (width(supernodes, s), supernodes.supernode(s).pattern().len());
    if r == 0 {
        return;
    }
    let bottom = MatRef::from_column_major_slice(columns, w + r, w).split_at_row(w).1;
    let at = plan.offsets[s];
    triangular::matmul(
        MatMut::from_column_major_slice_mut(&mut work.updates[at..at + r * r], r, r),
        BlockStructure::TriangularLower,
        Accum::Replace,
        bottom,
        BlockStructure::Rectangular,
        bottom.transpose(),
        BlockStructure::Rectangular,
        -T::one_impl(),
        Par::Seq,
    );
    let end = supernodes.supernode_end()[s];
    for &child in plan.children(s) {
        let rows = supernodes.supernode(child as usize).pattern();
        let inside = rows.partition_point(|&row| row < end);
        find_runs(rows, &work.places, &mut work.runs);
        let from = plan.offsets[child as usize];
        let (child_update, update) = two(&mut work.updates, from, rows.len().pow(2), at, r * r);
        let places = |j: usize| (work.places[rows[j] as usize] as usize - w) * r;
        work.simd.dispatch(|| add_columns(&work.runs, inside..rows.len(), child_update, rows.len(), update, places, w));
    }
}

/// Two stretches that do not overlap: the first to read, the second to write.
fn two<T>(all: &mut [T], from: usize, from_len: usize, to: usize, to_len: usize) -> (&[T], &mut [T]) {
    if from < to {
        let (head, tail) = all.split_at_mut(to);
        (&head[from..from + from_len], &mut tail[..to_len])
    } else {
        let (head, tail) = all.split_at_mut(from);
        (&tail[..from_len], &mut head[to..to + to_len])
    }
}

/// Cuts the rows of a child into runs.
fn find_runs(rows: &[u32], places: &[u32], runs: &mut Vec<Run>) {
    runs.clear();
    for (from, &row) in rows.iter().enumerate() {
        let to = places[row as usize] as usize;
        match runs.last_mut() {
            Some(run) if run.to + run.length == to => run.length += 1,
            _ => runs.push(Run { from, to, length: 1 }),
        }
    }
}

/// Adds columns of a child's update (column-major, `height` rows, lower triangle) to the columns of a front that begin
/// at `starts`; the first row there is at place `shift`.
#[inline(always)]
fn add_columns<T: Number>(
    runs: &[Run],
    columns: Range<usize>,
    child: &[T],
    height: usize,
    front: &mut [T],
    starts: impl Fn(usize) -> usize,
    shift: usize,
) {
    let mut first = 0;
    for j in columns {
        while runs[first].from + runs[first].length <= j {
            first += 1;
        }
        let (child, front) = (&child[j * height..(j + 1) * height], &mut front[starts(j)..]);
        for run in &runs[first..] {
            let skip = j.saturating_sub(run.from);
            let (from, to, length) = (run.from + skip, run.to + skip - shift, run.length - skip);
            for (target, value) in front[to..to + length].iter_mut().zip(&child[from..from + length]) {
                *target += *value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_of_the_workspace_never_overlap_and_gaps_are_used_again() {
        let mut gaps = Gaps::default();
        let (a, b, c) = (gaps.take(4), gaps.take(6), gaps.take(2));
        assert_eq!((a, b, c, gaps.end), (0, 4, 10, 12));
        gaps.give(a, 4);
        gaps.give(b, 6);
        assert_eq!((gaps.take(7), gaps.take(3), gaps.end), (0, 7, 12));
        gaps.give(c, 2);
        assert_eq!((gaps.take(5), gaps.end), (10, 15));
        assert_eq!((gaps.take(0), gaps.end), (0, 15));
    }
}
