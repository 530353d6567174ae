//! L L^T x = b: down L, then up L^T, branches of the tree side by side.
//!
//! A solve reads every number of L twice and computes two operations with each: it is as fast as L comes from memory.
//! faer's sweeps are made for many columns at once, where the numbers of L are used again and again; for one column its
//! calls cost more than the work. So one column goes through [`supernode`], and several columns through faer.
//!
//! The tasks of the factorisation (`multifrontal`) are those of a sweep too. Down, a task keeps what unknowns of tasks above lose in
//! a vector of its own, its *carry*; the task above adds the carries of those below it in their order. Up, the carry
//! holds the solution at the same unknowns. So the bits do not depend on the number of threads.

mod supernode;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::{Conj, MatMut, Par};

use super::multifrontal::{Plan, Supernodes, both};
pub use supernode::Entry;
use supernode::Supernode;

/// Right-hand sides that one sweep over L serves; fixed, so that bits do not depend on how many there are.
pub const COLUMNS_AT_ONCE: usize = 16;

/// Workspace of sweeps.
pub struct Sweep<T> {
    tasks: Vec<Work<T>>,
    /// Of faer's sweeps.
    buffer: MemBuffer,
}

/// Workspace of a task.
struct Work<T> {
    /// By unknown; only those of tasks above are used. Empty where there are none.
    carry: Vec<T>,
    /// The unknowns further on of the supernode at work.
    below: Vec<T>,
}

/// What all tasks read.
struct Job<'a, T> {
    plan: &'a Plan,
    supernodes: &'a Supernodes,
    factor: &'a [T],
}

impl<T: Entry> Sweep<T> {
    /// Allocates what sweeps over a factor with these supernodes need.
    pub fn new(plan: &Plan, supernodes: &Supernodes) -> Self {
        let longest = plan.fronts.iter().map(|front| front.rows).max().unwrap_or(0);
        let carry = |outside: &[u32]| if outside.is_empty() { 0 } else { supernodes.nrows() };
        let work =
            |outside: &[u32]| Work { carry: vec![T::default(); carry(outside)], below: vec![T::default(); longest] };
        Self {
            tasks: plan.tasks.iter().map(|task| work(&task.outside)).collect(),
            buffer: MemBuffer::new(supernodes.solve_in_place_scratch::<T>(COLUMNS_AT_ONCE, Par::Seq)),
        }
    }

    /// Bytes of this workspace.
    pub fn bytes(plan: &Plan, supernodes: &Supernodes) -> usize {
        let longest = plan.fronts.iter().map(|front| front.rows).max().unwrap_or(0);
        let carries = plan.tasks.iter().filter(|task| !task.outside.is_empty()).count();
        let numbers = carries * supernodes.nrows() + plan.tasks.len() * longest;
        let buffer = supernodes.solve_in_place_scratch::<T>(COLUMNS_AT_ONCE, Par::Seq);
        numbers * size_of::<T>() + buffer.unaligned_bytes_required()
    }

    /// Solves L L^T X = B in place for at most [`COLUMNS_AT_ONCE`] whole columns in elimination order.
    ///
    /// # Panics
    /// When there are more columns, or `factor` is not a factor of these supernodes.
    pub fn solve(&mut self, plan: &Plan, supernodes: &Supernodes, factor: &[T], columns: &mut [T]) {
        let n = supernodes.nrows();
        if columns.len() == n {
            let job = Job { plan, supernodes, factor };
            let root = plan.tasks.len() - 1;
            job.down(root, columns, &mut self.tasks);
            return job.up(root, columns, &mut self.tasks);
        }
        SupernodalLltRef::new(supernodes, factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(columns, n, columns.len() / n.max(1)),
            Par::Seq,
            MemStack::new(&mut self.buffer),
        );
    }

    /// Solves L X = B likewise.
    ///
    /// # Panics
    /// As [`Sweep::solve`].
    pub fn half_solve(&mut self, supernodes: &Supernodes, factor: &[T], columns: &mut [T]) {
        let n = supernodes.nrows();
        SupernodalLltRef::new(supernodes, factor).l_solve_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(columns, n, columns.len() / n.max(1)),
            Par::Seq,
            MemStack::new(&mut self.buffer),
        );
    }
}

impl<T: Entry> Job<'_, T> {
    /// Down a task, after all tasks below it. `x`: the unknowns of the subtree; `works`: its tasks.
    fn down(&self, task: usize, x: &mut [T], works: &mut [Work<T>]) {
        let node = &self.plan.tasks[task];
        self.side_by_side(&node.children, x, &mut works[..task - node.first_task], Self::down);
        let (base, end) = self.plan.columns_of(task);
        let (below_here, own) = works.split_at_mut(task - node.first_task);
        let Work { carry, below } = &mut own[0];
        node.outside.iter().for_each(|&row| carry[row as usize] = T::default());
        for &child in &node.children {
            let from = &below_here[child - node.first_task].carry;
            let (inside, outside) = cut(&self.plan.tasks[child].outside, end);
            inside.iter().for_each(|&row| x[row as usize - base] += from[row as usize]);
            outside.iter().for_each(|&row| carry[row as usize] += from[row as usize]);
        }
        for s in node.fronts.clone() {
            let front = &self.plan.fronts[s];
            let supernode = Supernode::new(self.supernodes, front, self.factor, s);
            let below = &mut below[..front.rows];
            supernode.down(&mut x[front.first - base..][..front.width], below);
            let (inside, outside) = cut(supernode.pattern, end);
            let (to_inside, to_outside) = below.split_at(inside.len());
            inside.iter().zip(to_inside).for_each(|(&row, value)| x[row as usize - base] += *value);
            outside.iter().zip(to_outside).for_each(|(&row, value)| carry[row as usize] += *value);
        }
    }

    /// Up a task, before all tasks below it; its carry holds the unknowns of tasks above.
    fn up(&self, task: usize, x: &mut [T], works: &mut [Work<T>]) {
        let node = &self.plan.tasks[task];
        let (base, end) = self.plan.columns_of(task);
        let (below_here, own) = works.split_at_mut(task - node.first_task);
        let Work { carry, below } = &mut own[0];
        for s in node.fronts.clone().rev() {
            let front = &self.plan.fronts[s];
            let supernode = Supernode::new(self.supernodes, front, self.factor, s);
            let below = &mut below[..front.rows];
            let (inside, outside) = cut(supernode.pattern, end);
            let (from_inside, from_outside) = below.split_at_mut(inside.len());
            inside.iter().zip(from_inside).for_each(|(&row, value)| *value = x[row as usize - base]);
            outside.iter().zip(from_outside).for_each(|(&row, value)| *value = carry[row as usize]);
            supernode.up(&mut x[front.first - base..][..front.width], below);
        }
        for &child in &node.children {
            let to = &mut below_here[child - node.first_task].carry;
            let (inside, outside) = cut(&self.plan.tasks[child].outside, end);
            inside.iter().for_each(|&row| to[row as usize] = x[row as usize - base]);
            outside.iter().for_each(|&row| to[row as usize] = carry[row as usize]);
        }
        self.side_by_side(&node.children, x, below_here, Self::up);
    }

    /// Goes `way` through tasks that do not need each other. `x` and `works` begin with the first of them.
    fn side_by_side(
        &self,
        tasks: &[usize],
        x: &mut [T],
        works: &mut [Work<T>],
        way: fn(&Self, usize, &mut [T], &mut [Work<T>]),
    ) {
        match *tasks {
            [] => {}
            [task] => way(self, task, x, works),
            _ => {
                let (left, right) = tasks.split_at(tasks.len() / 2);
                let first = |task: usize| (self.plan.columns_of(task).0, self.plan.tasks[task].first_task);
                let ((start, start_task), (middle, middle_task)) = (first(left[0]), first(right[0]));
                let (x, x_after) = x.split_at_mut(middle - start);
                let (works, works_after) = works.split_at_mut(middle_task - start_task);
                both(|| self.side_by_side(left, x, works, way), || self.side_by_side(right, x_after, works_after, way));
            }
        }
    }
}

/// Rows before and from `end` on.
fn cut(rows: &[u32], end: usize) -> (&[u32], &[u32]) {
    rows.split_at(rows.partition_point(|&row| (row as usize) < end))
}
