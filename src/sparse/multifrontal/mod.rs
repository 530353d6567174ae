//! The numbers of a sparse Cholesky factorisation, front by front, branches of the tree side by side.
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
//! touched.
//!
//! Independent subtrees (`tasks`) are worked on side by side, and large fronts in tiles (`kernels`, `assembly`). Tasks
//! and tiles, where every update lies, and the order of every sum are decided by the pattern ([`Plan`]), so the bits do
//! not depend on the number of threads. All workspace belongs to the factorisation: a thread that waits for another may
//! begin with work from elsewhere and does no harm. Nothing is allocated, small queues of the thread pool aside.

mod assembly;
mod gaps;
mod kernels;
mod plan;
mod tasks;

use std::ops::AddAssign;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::cholesky_in_place_scratch;
use faer::traits::{RealField, pulp};
use faer::{Accum, MatMut, MatRef, Par, Spec};

pub use plan::{Front, Plan, Supernodes};
pub use tasks::{Division, Task};

/// f64 or f32.
pub trait Number: RealField + Copy + Default + AddAssign + Send + Sync {}

impl Number for f64 {}
impl Number for f32 {}

/// From this work on (multiplications and additions) a front is cut into tiles: half a millisecond.
const TILED_FROM: f64 = 3e7;

/// Workspace of one factorisation, in f64 or f32.
pub struct Workspace<T> {
    updates: Vec<T>,
    /// Of the dense kernels, one a task.
    buffers: Vec<MemBuffer>,
    /// The widest registers of this machine; sums of entries are the same in all.
    simd: pulp::Arch,
}

impl<T: Number> Workspace<T> {
    /// Allocates what factorisations with this plan need.
    pub fn new(plan: &Plan) -> Self {
        let scratch = cholesky_in_place_scratch::<T>(plan.widest, Par::Seq, Spec::default());
        Self {
            updates: vec![T::default(); plan.length],
            buffers: plan.tasks.iter().map(|_| MemBuffer::new(scratch)).collect(),
            simd: pulp::Arch::new(),
        }
    }

    /// Bytes of a workspace for this plan.
    pub fn bytes(plan: &Plan) -> usize {
        let scratch = cholesky_in_place_scratch::<T>(plan.widest, Par::Seq, Spec::default());
        plan.length * size_of::<T>() + plan.tasks.len() * scratch.unaligned_bytes_required()
    }
}

/// Does two pieces of work that do not touch each other, side by side where there is more than one thread.
pub fn both<A: Send, B: Send>(first: impl FnOnce() -> A + Send, second: impl FnOnce() -> B + Send) -> (A, B) {
    match rayon::current_num_threads() {
        1 => (first(), second()),
        _ => rayon::join(first, second),
    }
}

/// Factors the permuted lower triangle with these values into `factor` (the layout of the supernodes).
///
/// # Errors
/// The first column whose pivot is not positive.
pub fn factorise<T: Number>(
    plan: &Plan,
    values: &[T],
    lower_starts: &[u32],
    factor: &mut [T],
    work: &mut Workspace<T>,
) -> Result<(), usize> {
    let job = Job { plan, values, lower_starts, simd: work.simd };
    let share = Share { factor, updates: &mut work.updates, buffers: &mut work.buffers, values: 0, update: 0, task: 0 };
    job.subtree(plan.tasks.len() - 1, share)
}

/// What all tasks read.
struct Job<'a, T> {
    plan: &'a Plan,
    values: &'a [T],
    lower_starts: &'a [u32],
    simd: pulp::Arch,
}

/// What the tasks of a subtree write: their numbers of L, their updates, their workspaces, and where these begin.
struct Share<'a, T> {
    factor: &'a mut [T],
    updates: &'a mut [T],
    buffers: &'a mut [MemBuffer],
    values: usize,
    update: usize,
    task: usize,
}

impl<T> Share<'_, T> {
    fn reborrow(&mut self) -> Share<'_, T> {
        Share { factor: self.factor, updates: self.updates, buffers: self.buffers, ..*self }
    }

    /// Before and from a task on.
    fn split(self, plan: &Plan, task: usize) -> (Self, Self) {
        let Task { first_task, first_front, ref updates, .. } = plan.tasks[task];
        let values = plan.fronts[first_front].values;
        let (factor, factor_after) = self.factor.split_at_mut(values - self.values);
        let (before, updates_after) = self.updates.split_at_mut(updates.start - self.update);
        let (buffers, buffers_after) = self.buffers.split_at_mut(first_task - self.task);
        (
            Share { factor, updates: before, buffers, ..self },
            Share {
                factor: factor_after,
                updates: updates_after,
                buffers: buffers_after,
                values,
                update: updates.start,
                task: first_task,
            },
        )
    }
}

impl<T: Number> Job<'_, T> {
    /// A task after all tasks below it.
    fn subtree(&self, task: usize, mut share: Share<T>) -> Result<(), usize> {
        let Task { children, fronts, .. } = &self.plan.tasks[task];
        self.side_by_side(children, share.reborrow())?;
        let stack = MemStack::new(&mut share.buffers[task - share.task]);
        for front in &self.plan.fronts[fronts.clone()] {
            let columns = &mut share.factor[front.values - share.values..][..front.entries()];
            self.front(front, columns, share.updates, share.update, stack)?;
        }
        Ok(())
    }

    /// Tasks that do not need each other; of two failures the one with the first column counts.
    fn side_by_side(&self, tasks: &[usize], share: Share<T>) -> Result<(), usize> {
        match *tasks {
            [] => Ok(()),
            [task] => self.subtree(task, share),
            _ => {
                let (left, right) = tasks.split_at(tasks.len() / 2);
                let (before, after) = share.split(self.plan, right[0]);
                let (left, right) = both(|| self.side_by_side(left, before), || self.side_by_side(right, after));
                left.and(right)
            }
        }
    }

    /// Builds a front, eliminates its columns and leaves its update; `updates` begins at place `shift` of the workspace.
    fn front(
        &self,
        front: &Front,
        columns: &mut [T],
        updates: &mut [T],
        shift: usize,
        stack: &mut MemStack,
    ) -> Result<(), usize> {
        let (w, r, h) = (front.width, front.rows, front.height());
        let tiled = front.flops() >= TILED_FROM;
        self.columns(front, columns, updates, shift, tiled);
        let matrix = MatMut::from_column_major_slice_mut(columns, h, w);
        match tiled {
            true => kernels::eliminate_in_tiles(matrix, kernels::side(h), stack),
            false => kernels::eliminate(matrix, stack),
        }
        .map_err(|column| front.first + column)?;
        if r == 0 {
            return Ok(());
        }
        let bottom = MatRef::from_column_major_slice(columns, h, w).split_at_row(w).1;
        let own = &mut updates[front.update - shift..][..r * r];
        let update = MatMut::from_column_major_slice_mut(own, r, r);
        match tiled {
            true => kernels::subtract_square(update, Accum::Replace, bottom, kernels::side(h)),
            false => kernels::square(update, Accum::Replace, bottom),
        }
        self.rest_of_children(front, updates, shift, tiled);
        Ok(())
    }
}
