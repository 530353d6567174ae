//! L L^T X = B: down L, then up L^T, branches of the tree side by side.
//!
//! A solve reads every number of L twice and computes two operations with each for every right-hand side: for a few it
//! is as fast as L comes from memory. One right-hand side goes through loops of its own ([`supernode`]), several
//! go through dense kernels ([`columns`]), where the numbers of L are used again and again.
//!
//! The tasks of the factorisation (`multifrontal`) are those of a sweep too. Down, a task keeps what unknowns of tasks above
//! lose in rows of its own, its *carry*; the task above adds the carries of those below it in their order. Up, the carry
//! holds the solution at the same unknowns. So the bits do not depend on the number of threads.

mod columns;
mod supernode;

use super::multifrontal::{Plan, Supernodes, Task, both};
use columns::{Blocks, gather};
pub use supernode::Entry;
use supernode::Supernode;

/// Right-hand sides that one sweep over L serves; fixed, so that bits do not depend on how many there are.
pub const COLUMNS_AT_ONCE: usize = 16;

/// Workspace of sweeps.
pub struct Sweep<T> {
    /// X, the right-hand sides of an unknown together.
    rows: Vec<T>,
    tasks: Vec<Work<T>>,
}

/// Workspace of a task.
struct Work<T> {
    /// Rows of the unknowns of tasks above; the others are not used. Empty where there are none.
    carry: Vec<T>,
    /// The unknowns of the supernode at work, and those further on.
    own: Vec<T>,
    below: Vec<T>,
}

/// What all tasks read.
struct Job<'a, T> {
    plan: &'a Plan,
    supernodes: &'a Supernodes,
    factor: &'a [T],
    /// Right-hand sides.
    k: usize,
}

/// Numbers of a workspace: rows, and own, below and carry of a task.
fn sizes(plan: &Plan, n: usize) -> (usize, [usize; 2], impl Fn(&Task) -> usize) {
    let widest = plan.fronts.iter().map(|front| front.width).max().unwrap_or(0);
    let longest = plan.fronts.iter().map(|front| front.rows).max().unwrap_or(0);
    let carry = move |task: &Task| if task.outside.is_empty() { 0 } else { n * COLUMNS_AT_ONCE };
    (n * COLUMNS_AT_ONCE, [widest * COLUMNS_AT_ONCE, longest * COLUMNS_AT_ONCE], carry)
}

impl<T: Entry> Sweep<T> {
    /// Allocates what sweeps over a factor of n unknowns need.
    pub fn new(plan: &Plan, n: usize) -> Self {
        let (rows, [own, below], carry) = sizes(plan, n);
        let numbers = |count: usize| vec![T::default(); count];
        let work = |task| Work { carry: numbers(carry(task)), own: numbers(own), below: numbers(below) };
        Self { rows: numbers(rows), tasks: plan.tasks.iter().map(work).collect() }
    }

    /// Bytes of this workspace.
    pub fn bytes(plan: &Plan, n: usize) -> usize {
        let (rows, [own, below], carry) = sizes(plan, n);
        let tasks: usize = plan.tasks.iter().map(|task| carry(task) + own + below).sum();
        (rows + tasks) * size_of::<T>()
    }

    /// Solves L L^T X = B in place for at most [`COLUMNS_AT_ONCE`] whole columns in elimination order.
    ///
    /// # Panics
    /// When there are more columns, or `factor` is not a factor of these supernodes.
    pub fn solve(&mut self, plan: &Plan, supernodes: &Supernodes, factor: &[T], columns: &mut [T]) {
        self.ways(plan, supernodes, factor, columns, true);
    }

    /// Solves L X = B likewise.
    ///
    /// # Panics
    /// As [`Sweep::solve`].
    pub fn half_solve(&mut self, plan: &Plan, supernodes: &Supernodes, factor: &[T], columns: &mut [T]) {
        self.ways(plan, supernodes, factor, columns, false);
    }

    /// Down, and up again when `back`.
    fn ways(&mut self, plan: &Plan, supernodes: &Supernodes, factor: &[T], columns: &mut [T], back: bool) {
        let n = supernodes.nrows().max(1);
        let (k, root) = (columns.len() / n, plan.tasks.len() - 1);
        let job = Job { plan, supernodes, factor, k };
        let tasks = &mut self.tasks;
        let mut go = |rows: &mut [T]| {
            job.down(root, rows, tasks);
            if back {
                job.up(root, rows, tasks);
            }
        };
        if k == 1 {
            return go(columns);
        }
        let rows = &mut self.rows[..n * k];
        for (c, column) in columns.chunks_exact(n).enumerate() {
            rows.chunks_exact_mut(k).zip(column).for_each(|(row, value)| row[c] = *value);
        }
        go(rows);
        for (c, column) in columns.chunks_exact_mut(n).enumerate() {
            rows.chunks_exact(k).zip(column).for_each(|(row, value)| *value = row[c]);
        }
    }
}

impl<T: Entry> Job<'_, T> {
    /// Down a task, after all tasks below it. `x`: the unknowns of the subtree; `works`: its tasks.
    fn down(&self, task: usize, x: &mut [T], works: &mut [Work<T>]) {
        let (node, k) = (&self.plan.tasks[task], self.k);
        let (works_below, own) = works.split_at_mut(task - node.first_task);
        self.side_by_side(&node.children, x, works_below, Self::down);
        let (base, end) = self.plan.columns_of(task);
        let Work { carry, own, below } = &mut own[0];
        node.outside.iter().for_each(|&row| carry[place(row, 0, k)].fill(T::default()));
        for &child in &node.children {
            let from = &works_below[child - node.first_task].carry;
            let (inside, outside) = cut(&self.plan.tasks[child].outside, end);
            inside.iter().for_each(|&row| add(&mut x[place(row, base, k)], &from[place(row, 0, k)]));
            outside.iter().for_each(|&row| add(&mut carry[place(row, 0, k)], &from[place(row, 0, k)]));
        }
        for s in node.fronts.clone() {
            let front = &self.plan.fronts[s];
            let supernode = Supernode::new(self.supernodes, front, self.factor, s);
            let below = &mut below[..front.rows * k];
            let mine = &mut x[(front.first - base) * k..][..front.width * k];
            let (inside, outside) = cut(supernode.pattern, end);
            if k == 1 {
                supernode.down(mine, below);
                let (to_inside, to_outside) = below.split_at(inside.len());
                inside.iter().zip(to_inside).for_each(|(&row, value)| x[row as usize - base] += *value);
                outside.iter().zip(to_outside).for_each(|(&row, value)| carry[row as usize] += *value);
                continue;
            }
            let own = &mut own[..mine.len()];
            gather(own, front.width, k, |i| &mine[i * k..]);
            columns::down(&supernode, k, Blocks { own, below });
            put_back(own, mine, k);
            for (i, &row) in supernode.pattern.iter().enumerate() {
                let to = if i < inside.len() { &mut x[place(row, base, k)] } else { &mut carry[place(row, 0, k)] };
                to.iter_mut().zip(below[i..].iter().step_by(front.rows)).for_each(|(to, value)| *to += *value);
            }
        }
    }

    /// Up a task, before all tasks below it; its carry holds the unknowns of tasks above.
    fn up(&self, task: usize, x: &mut [T], works: &mut [Work<T>]) {
        let (node, k) = (&self.plan.tasks[task], self.k);
        let (base, end) = self.plan.columns_of(task);
        let (works_below, own) = works.split_at_mut(task - node.first_task);
        let Work { carry, own, below } = &mut own[0];
        for s in node.fronts.clone().rev() {
            let front = &self.plan.fronts[s];
            let supernode = Supernode::new(self.supernodes, front, self.factor, s);
            let below = &mut below[..front.rows * k];
            if k == 1 {
                let (inside, outside) = cut(supernode.pattern, end);
                let (from_inside, from_outside) = below.split_at_mut(inside.len());
                inside.iter().zip(from_inside).for_each(|(&row, value)| *value = x[row as usize - base]);
                outside.iter().zip(from_outside).for_each(|(&row, value)| *value = carry[row as usize]);
                let mine = &mut x[front.first - base..][..front.width];
                supernode.up(mine, below);
                continue;
            }
            let at = |i: usize| {
                let row = supernode.pattern[i];
                if (row as usize) < end { &x[place(row, base, k)] } else { &carry[place(row, 0, k)] }
            };
            gather(below, front.rows, k, at);
            let mine = &mut x[(front.first - base) * k..][..front.width * k];
            let own = &mut own[..mine.len()];
            gather(own, front.width, k, |i| &mine[i * k..]);
            columns::up(&supernode, k, Blocks { own, below });
            put_back(own, mine, k);
        }
        for &child in &node.children {
            let to = &mut works_below[child - node.first_task].carry;
            let (inside, outside) = cut(&self.plan.tasks[child].outside, end);
            inside.iter().for_each(|&row| to[place(row, 0, k)].copy_from_slice(&x[place(row, base, k)]));
            outside.iter().for_each(|&row| to[place(row, 0, k)].copy_from_slice(&carry[place(row, 0, k)]));
        }
        self.side_by_side(&node.children, x, works_below, Self::up);
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
                let (x, x_after) = x.split_at_mut((middle - start) * self.k);
                let (works, works_after) = works.split_at_mut(middle_task - start_task);
                both(|| self.side_by_side(left, x, works, way), || self.side_by_side(right, x_after, works_after, way));
            }
        }
    }
}

/// Where the k numbers of an unknown are in rows that begin with unknown `base`.
fn place(row: u32, base: usize, k: usize) -> std::ops::Range<usize> {
    let start = (row as usize - base) * k;
    start..start + k
}

fn add<T: Entry>(to: &mut [T], from: &[T]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += *from);
}

/// Copies columns back into rows of k numbers.
fn put_back<T: Entry>(block: &[T], rows: &mut [T], k: usize) {
    let height = block.len() / k;
    for (i, row) in rows.chunks_exact_mut(k).enumerate() {
        row.iter_mut().zip(block[i..].iter().step_by(height)).for_each(|(to, value)| *to = *value);
    }
}

/// Rows before and from `end` on.
fn cut(rows: &[u32], end: usize) -> (&[u32], &[u32]) {
    rows.split_at(rows.partition_point(|&row| (row as usize) < end))
}
