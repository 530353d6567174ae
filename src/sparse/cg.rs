//! Conjugate gradients with a preconditioner: A x = b for a symmetric positive definite A that is only applied.
//!
//! With r = b - A x, z = M r for a preconditioner M ~ A^-1, and a search direction p, one iteration is
//!
//! ```text
//! q = A p,   alpha = r.z / p.q,   x += alpha p,   r -= alpha q,   z' = M r',   beta = -z'.q / p.q,   p = z' + beta p
//! ```
//!
//! (M. R. Hestenes and E. Stiefel, J. Res. Natl. Bur. Stand. 49, 1952). In exact arithmetic this beta is the usual
//! r'.z' / r.z, since r' - r = -alpha q and p.q = r.z / alpha; written so it keeps the directions conjugate to each other when M is not
//! quite symmetric or linear, as one computed in single precision is (Y. Notay, SIAM J. Sci. Comput. 22, 2000). The
//! error in the energy norm after k iterations is at most 2 ((sqrt c - 1) / (sqrt c + 1))^k of the first, where c is
//! the condition number of M A.
//!
//! The r of the recursion drifts from b - A x by rounding. When the recursion says it is done, b - A x is computed; if
//! that is above the tolerance, the iteration starts anew from it, until it gains nothing more. The residual that is
//! handed back is always computed, never the one of the recursion.
//!
//! Several right-hand sides travel together ([`solve_columns`]): each has its own alpha and beta, and stops when it is
//! done, but A and M are applied to all that are left at once. A factor, or the numbers of a product, are read from memory
//! once for all of them.
//!
//! All vectors are columns of n f64. Nothing of their length is allocated after the [`Workspace`] has grown to the number of
//! columns, and every sum has one fixed order ([`super::vectors`]): the same calls give the same bits on any number of threads.
//! Before every iteration the user may have stopped the run ([`Workspace::watch`]).

use crate::clock::Interrupt;

use super::vectors::{add, dot, norm, scale, turn as turned};

/// A computed residual above the tolerance starts the iteration anew only while it falls by this factor from one such
/// start to the next.
const RESTART_GAIN: f64 = 0.5;

/// The vectors of an iteration; serves systems of one size.
pub struct Workspace {
    unknowns: usize,
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
    running: Vec<Running>,
    known: Vec<Known>,
    interrupt: Interrupt,
}

/// A right-hand side that is iterated on; the i-th of them owns the i-th column of every vector of the workspace.
#[derive(Debug, Clone, Copy)]
struct Running {
    /// Its place in b and x.
    place: usize,
    /// Norm of the residual that ends it.
    target: f64,
    /// r.z
    decrease: f64,
    /// p.q
    curvature: f64,
}

/// What is known of a right-hand side.
#[derive(Debug, Clone, Copy)]
struct Known {
    /// |b|
    norm: f64,
    /// |b - A x| / |b|, as last computed.
    residual: f64,
    /// Whether x has moved since.
    moved: bool,
}

impl Workspace {
    /// Vectors for n unknowns.
    pub fn new(n: usize) -> Self {
        let vector = || vec![0.0; n];
        Self {
            unknowns: n,
            residual: vector(),
            preconditioned: vector(),
            direction: vector(),
            product: vector(),
            running: Vec::with_capacity(1),
            known: Vec::with_capacity(1),
            interrupt: Interrupt::default(),
        }
    }

    /// Ends all iterations to come when the user stops the run.
    pub fn watch(&mut self, interrupt: &Interrupt) {
        self.interrupt = interrupt.clone();
    }

    /// # Errors
    /// [`crate::error::Error::Interrupted`] when the user has stopped the run, and with it the last iteration.
    pub fn check(&self) -> crate::error::Result<()> {
        self.interrupt.check()
    }

    /// |b - A x| / |b| of every column of the last solve, as in [`Outcome::residual`].
    pub fn residuals(&self) -> impl Iterator<Item = f64> {
        self.known.iter().map(|known| if known.residual.is_nan() { f64::INFINITY } else { known.residual })
    }

    /// Bytes of the vectors.
    pub fn bytes(&self) -> usize {
        8 * (self.residual.len() + self.preconditioned.len() + self.direction.len() + self.product.len())
    }

    /// Makes room for more columns.
    fn grow(&mut self, columns: usize) {
        let length = self.unknowns * columns;
        for vectors in [&mut self.residual, &mut self.preconditioned, &mut self.direction, &mut self.product] {
            if vectors.len() < length {
                vectors.resize(length, 0.0);
            }
        }
    }

    /// Takes the i-th running column out; the last one moves to its place.
    fn remove(&mut self, i: usize) {
        let (n, last) = (self.unknowns, self.running.len() - 1);
        for vectors in [&mut self.residual, &mut self.direction, &mut self.product] {
            vectors.copy_within(last * n..(last + 1) * n, i * n);
        }
        self.running.swap_remove(i);
    }
}

/// How an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Iterations, each one product and one preconditioning; of all columns together.
    pub iterations: usize,
    /// |b - A x| / |b| of the x that was written, computed in f64, of the worst column; 0 when b = 0, infinite when A or
    /// M gave what is no number.
    pub residual: f64,
}

impl Outcome {
    /// True when the computed residual is at most `tolerance`.
    pub fn reached(&self, tolerance: f64) -> bool {
        self.residual <= tolerance
    }
}

/// Solves A x = b from the initial guess in `x` until |b - A x| <= tolerance |b|.
///
/// `apply(p, q)` writes q = A p; `precondition(r, z)` writes z = M r. A guess that is not yet the answer is first multiplied
/// by the factor that makes its error smallest in the energy norm (0 when it is of no use). Stops earlier after `limit`
/// iterations, where A or M shows not to be positive definite, where rounding allows no smaller residual, and when the
/// user stops the run: [`Outcome::reached`] tells. An initial guess of zeros costs no product.
///
/// # Panics
/// When `b`, `x` and the workspace have different lengths.
pub fn solve(
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    precondition: &mut dyn FnMut(&[f64], &mut [f64]),
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    limit: usize,
    work: &mut Workspace,
) -> Outcome {
    assert_eq!(b.len(), work.unknowns, "one right-hand side of the length of the workspace");
    solve_columns(apply, precondition, b, x, tolerance, limit, work)
}

/// Solves A X = B for `b.len() / n` columns, one after another in memory, as [`solve`] does for one; `limit` iterations for each.
/// `apply` and `precondition` are given any number of whole columns.
///
/// # Panics
/// When `b` is not a whole number of columns of the workspace, or `x` has another length.
pub fn solve_columns(
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    precondition: &mut dyn FnMut(&[f64], &mut [f64]),
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    limit: usize,
    work: &mut Workspace,
) -> Outcome {
    let n = work.unknowns.max(1);
    assert!(b.len() == x.len() && b.len().is_multiple_of(n), "whole columns of the length of the workspace");
    work.grow(b.len() / n);
    work.known.clear();
    work.known.extend(b.chunks_exact(n).map(|b| Known { norm: norm(b), residual: f64::INFINITY, moved: true }));
    let (mut iterations, mut left, mut first) = (0, limit, true);
    loop {
        work.running.clear();
        multiply_moved(apply, b.len() / n, x, first, work);
        for (place, (b, x)) in b.chunks_exact(n).zip(x.chunks_exact_mut(n)).enumerate() {
            start(b, x, place, tolerance, first, work);
        }
        if work.running.is_empty() || left == 0 || work.check().is_err() {
            break;
        }
        let (longest, all) = descend(apply, precondition, x, left, work);
        (iterations, left, first) = (iterations + all, left - longest, false);
    }
    Outcome { iterations, residual: work.residuals().fold(0.0, f64::max) }
}

/// Writes A x of every column whose x has moved to its place in the products: neighbours at once. A right-hand side of zeros
/// needs none, nor does a guess of zeros.
fn multiply_moved(
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    columns: usize,
    x: &[f64],
    first: bool,
    work: &mut Workspace,
) {
    let n = work.unknowns;
    let Workspace { known, product, .. } = work;
    let needed = |column: usize| {
        let Known { norm, moved, .. } = known[column];
        moved && norm != 0.0 && !(first && is_zero(&x[column * n..(column + 1) * n]))
    };
    let mut begin = 0;
    while begin < columns {
        let end = (begin..columns).find(|&column| !needed(column)).unwrap_or(columns);
        if end > begin {
            apply(&x[begin * n..end * n], &mut product[begin * n..end * n]);
        }
        begin = end + 1;
    }
}

fn is_zero(x: &[f64]) -> bool {
    x.iter().all(|x| *x == 0.0)
}

/// Computes the residual of a column whose x has moved, and lets it run if it is not done and has gained since the last
/// start. At the first start its guess is scaled.
fn start(b: &[f64], x: &mut [f64], place: usize, tolerance: f64, first: bool, work: &mut Workspace) {
    let Known { norm, residual: before, moved } = work.known[place];
    if !moved {
        return;
    }
    work.known[place].moved = false;
    if norm == 0.0 {
        x.fill(0.0);
        work.known[place].residual = 0.0;
        return;
    }
    let n = b.len();
    let slot = work.running.len() * n..(work.running.len() + 1) * n;
    let (r, q) = (&mut work.residual[slot], &work.product[place * n..(place + 1) * n]);
    if first {
        scale_guess(b, x, tolerance * norm, r, q);
    } else {
        r.copy_from_slice(b);
        add(-1.0, q, r);
    }
    let residual = self::norm(r) / norm;
    work.known[place].residual = residual;
    // written so that a residual that is not a number ends it
    if residual > tolerance && residual <= RESTART_GAIN * before {
        work.running.push(Running { place, target: tolerance * norm, decrease: 0.0, curvature: 0.0 });
    }
}

/// Multiplies the guess by x.b / x.Ax unless its residual is at most `target` in norm; leaves b - A x in `r`. `q` is A x of
/// the guess, and not looked at when that is zero.
fn scale_guess(b: &[f64], x: &mut [f64], target: f64, r: &mut [f64], q: &[f64]) {
    r.copy_from_slice(b);
    if is_zero(x) {
        return;
    }
    add(-1.0, q, r);
    if norm(r) <= target {
        return;
    }
    r.copy_from_slice(b);
    let factor = dot(x, b) / dot(x, q);
    if factor.is_finite() && factor > 0.0 {
        scale(factor, x);
        add(-factor, q, r);
    } else {
        x.fill(0.0);
    }
}

/// Iterates all running columns until the last of them is done; returns the iterations of the longest and of all.
fn descend(
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    precondition: &mut dyn FnMut(&[f64], &mut [f64]),
    x: &mut [f64],
    limit: usize,
    work: &mut Workspace,
) -> (usize, usize) {
    let n = work.unknowns;
    let length = work.running.len() * n;
    precondition(&work.residual[..length], &mut work.preconditioned[..length]);
    work.direction[..length].copy_from_slice(&work.preconditioned[..length]);
    for (i, column) in work.running.iter_mut().enumerate() {
        let slot = i * n..(i + 1) * n;
        column.decrease = dot(&work.residual[slot.clone()], &work.preconditioned[slot]);
        work.known[column.place].moved = true;
    }
    let mut all = 0;
    for iteration in 1..=limit {
        if work.check().is_err() {
            return (iteration, all);
        }
        all += work.running.len();
        let length = work.running.len() * n;
        apply(&work.direction[..length], &mut work.product[..length]);
        // backwards, so that the column that moves to the place of one that is done had its turn
        for i in (0..work.running.len()).rev() {
            let place = work.running[i].place;
            if !advance(i, &mut x[place * n..(place + 1) * n], work) {
                work.remove(i);
            }
        }
        if work.running.is_empty() {
            return (iteration, all);
        }
        let length = work.running.len() * n;
        precondition(&work.residual[..length], &mut work.preconditioned[..length]);
        for i in 0..work.running.len() {
            turn(i, work);
        }
    }
    (limit, all)
}

/// One step of the i-th running column along its direction; false when that was its last.
fn advance(i: usize, x: &mut [f64], work: &mut Workspace) -> bool {
    let Running { target, decrease, .. } = work.running[i];
    let slot = i * x.len()..(i + 1) * x.len();
    let p = &work.direction[slot.clone()];
    let (r, q) = (&mut work.residual[slot.clone()], &work.product[slot]);
    let curvature = dot(p, q);
    if !(decrease > 0.0 && curvature > 0.0 && decrease.is_finite() && curvature.is_finite()) {
        return false;
    }
    let alpha = decrease / curvature;
    add(alpha, p, x);
    add(-alpha, q, r);
    work.running[i].curvature = curvature;
    norm(r) > target
}

/// The next direction of the i-th running column.
fn turn(i: usize, work: &mut Workspace) {
    let slot = i * work.unknowns..(i + 1) * work.unknowns;
    let (r, z, q) = (&work.residual[slot.clone()], &work.preconditioned[slot.clone()], &work.product[slot.clone()]);
    let p = &mut work.direction[slot];
    let column = &mut work.running[i];
    let beta = -dot(z, q) / column.curvature;
    column.decrease = dot(r, z);
    turned(z, beta, p);
}

#[cfg(test)]
mod tests;
