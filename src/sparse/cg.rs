//! Conjugate gradients with a preconditioner: A x = b for a symmetric positive definite A that is only applied.
//!
//! With r = b - A x, z = M r for a preconditioner M ~ A^-1, and a search direction p, one iteration is
//!
//! ```text
//! q = A p,   alpha = r.z / p.q,   x += alpha p,   r -= alpha q,   z' = M r',   beta = -alpha z'.q / r.z,   p = z' + beta p
//! ```
//!
//! (M. R. Hestenes and E. Stiefel, J. Res. Natl. Bur. Stand. 49, 1952). In exact arithmetic this beta is the usual
//! r'.z' / r.z, since r' - r = -alpha q; written so it keeps the directions conjugate to each other when M is not
//! quite symmetric or linear, as one computed in single precision is (Y. Notay, SIAM J. Sci. Comput. 22, 2000). The
//! error in the energy norm after k iterations is at most 2 ((sqrt c - 1) / (sqrt c + 1))^k of the first, where c is
//! the condition number of M A.
//!
//! The r of the recursion drifts from b - A x by rounding. When the recursion says it is done, b - A x is computed; if
//! that is above the tolerance, the iteration starts anew from it, until it gains nothing more. The residual that is
//! handed back is always computed, never the one of the recursion.
//!
//! All vectors have length n and are f64. Nothing is allocated after the [`Workspace`], and every sum has one fixed
//! order: the same calls give the same bits.

/// Lanes of a sum of products: enough for the widest registers, fixed so that the order of the sum is.
const LANES: usize = 16;

/// A computed residual above the tolerance starts the iteration anew only while it falls by this factor from one such
/// start to the next.
const RESTART_GAIN: f64 = 0.5;

/// The vectors of an iteration; serves systems of one size.
pub struct Workspace {
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
}

impl Workspace {
    /// Vectors for n unknowns.
    pub fn new(n: usize) -> Self {
        Self { residual: vec![0.0; n], preconditioned: vec![0.0; n], direction: vec![0.0; n], product: vec![0.0; n] }
    }
}

/// How an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Iterations, each one product and one preconditioning.
    pub iterations: usize,
    /// |b - A x| / |b| of the x that was written, computed in f64; 0 when b = 0, not a number or infinite when A or M
    /// gave such numbers.
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
/// by the factor that makes its error smallest in the energy norm (0 when it is of no use). Stops earlier after `limit` iterations, where A or
/// M shows not to be positive definite, and where rounding allows no smaller residual: [`Outcome::reached`] tells. An
/// initial guess of zeros costs no product.
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
    assert!(b.len() == x.len() && b.len() == work.residual.len(), "vectors of one length");
    let norm = dot(b, b).sqrt();
    if norm == 0.0 {
        x.fill(0.0);
        return Outcome { iterations: 0, residual: 0.0 };
    }
    scale_guess(apply, b, x, tolerance * norm, work);
    let mut residual = dot(&work.residual, &work.residual).sqrt() / norm;
    let mut iterations = 0;
    // written so that a residual that is not a number ends it
    while residual > tolerance && iterations < limit {
        let spent = descend(apply, precondition, x, tolerance * norm, limit - iterations, work);
        iterations += spent;
        let before = residual;
        true_residual(apply, b, x, &mut work.residual);
        residual = dot(&work.residual, &work.residual).sqrt() / norm;
        if spent == 0 || residual > RESTART_GAIN * before {
            break;
        }
    }
    Outcome { iterations, residual }
}

/// Multiplies the guess by x.b / x.Ax unless its residual is at most `target` in norm; leaves b - A x in
/// `work.residual`.
fn scale_guess(apply: &mut dyn FnMut(&[f64], &mut [f64]), b: &[f64], x: &mut [f64], target: f64, work: &mut Workspace) {
    work.residual.copy_from_slice(b);
    if x.iter().all(|x| *x == 0.0) {
        return;
    }
    apply(x, &mut work.product);
    subtract(&mut work.residual, 1.0, &work.product);
    if dot(&work.residual, &work.residual).sqrt() <= target {
        return;
    }
    work.residual.copy_from_slice(b);
    let factor = dot(x, b) / dot(x, &work.product);
    if factor.is_finite() && factor > 0.0 {
        x.iter_mut().for_each(|x| *x *= factor);
        subtract(&mut work.residual, factor, &work.product);
    } else {
        x.fill(0.0);
    }
}

/// y -= factor x.
fn subtract(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y -= factor * x;
    }
}

/// Iterates from `work.residual` = b - A x until its recursion is at most `target` in norm; returns the iterations.
fn descend(
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    precondition: &mut dyn FnMut(&[f64], &mut [f64]),
    x: &mut [f64],
    target: f64,
    limit: usize,
    work: &mut Workspace,
) -> usize {
    let Workspace { residual, preconditioned, direction, product } = work;
    precondition(residual, preconditioned);
    direction.copy_from_slice(preconditioned);
    let mut decrease = dot(residual, preconditioned);
    for iteration in 0..limit {
        apply(direction, product);
        let curvature = dot(direction, product);
        if !(decrease > 0.0 && curvature > 0.0 && decrease.is_finite() && curvature.is_finite()) {
            return iteration;
        }
        let alpha = decrease / curvature;
        for (x, p) in x.iter_mut().zip(direction.iter()) {
            *x += alpha * p;
        }
        subtract(residual, alpha, product);
        if dot(residual, residual).sqrt() <= target {
            return iteration + 1;
        }
        precondition(residual, preconditioned);
        let beta = -alpha * dot(preconditioned, product) / decrease;
        decrease = dot(residual, preconditioned);
        for (p, z) in direction.iter_mut().zip(preconditioned.iter()) {
            *p = z + beta * *p;
        }
    }
    limit
}

/// r = b - A x.
fn true_residual(apply: &mut dyn FnMut(&[f64], &mut [f64]), b: &[f64], x: &[f64], residual: &mut [f64]) {
    apply(x, residual);
    for (r, b) in residual.iter_mut().zip(b) {
        *r = b - *r;
    }
}

/// Sum of products in a fixed order that registers can hold side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let (a_blocks, b_blocks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a_blocks.remainder().iter().zip(b_blocks.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_blocks.zip(b_blocks) {
        for i in 0..LANES {
            lanes[i] += a[i] * b[i];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of springs 1, 1/2, 1/3, ..., held at both ends.
    fn chain(p: &[f64], q: &mut [f64]) {
        let n = p.len();
        for i in 0..n {
            let (left, right) = (1.0 / (i + 1) as f64, 1.0 / (i + 2) as f64);
            let before = if i > 0 { p[i - 1] } else { 0.0 };
            let after = if i + 1 < n { p[i + 1] } else { 0.0 };
            q[i] = left * (p[i] - before) + right * (p[i] - after);
        }
    }

    fn jacobi(r: &[f64], z: &mut [f64]) {
        for (i, (z, r)) in z.iter_mut().zip(r).enumerate() {
            *z = r / (1.0 / (i + 1) as f64 + 1.0 / (i + 2) as f64);
        }
    }

    #[test]
    fn hestenes_stiefel_ends_after_n_iterations_and_says_the_true_residual() {
        let n = 60;
        let b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut x = vec![0.0; n];
        let mut work = Workspace::new(n);
        let outcome = solve(&mut chain, &mut jacobi, &b, &mut x, 1e-12, 200, &mut work);
        assert!(outcome.reached(1e-12) && outcome.iterations <= n + 5, "{outcome:?}");
        let mut product = vec![0.0; n];
        chain(&x, &mut product);
        let squares = |v: &mut dyn Iterator<Item = f64>| v.map(|v| v * v).sum::<f64>();
        let r = squares(&mut product.iter().zip(&b).map(|(q, b)| q - b)) / squares(&mut b.iter().copied());
        assert!((r.sqrt() - outcome.residual).abs() <= 1e-3 * outcome.residual);
    }

    #[test]
    fn the_solution_as_guess_costs_nothing_and_zero_forces_give_zero() {
        let n = 10;
        let exact: Vec<f64> = (0..n).map(|i| i as f64 - 3.0).collect();
        let mut b = vec![0.0; n];
        chain(&exact, &mut b);
        let mut x = exact.clone();
        let mut work = Workspace::new(n);
        let outcome = solve(&mut chain, &mut jacobi, &b, &mut x, 1e-10, 50, &mut work);
        assert_eq!((outcome.iterations, x.as_slice()), (0, exact.as_slice()));
        x.iter_mut().for_each(|x| *x *= -7.0);
        let outcome = solve(&mut chain, &mut jacobi, &b, &mut x, 1e-10, 50, &mut work);
        assert!(outcome.reached(1e-10), "{outcome:?}");
        exact.iter().zip(&mut x).for_each(|(e, x)| *x = 7.0 * e);
        let outcome = solve(&mut chain, &mut jacobi, &b, &mut x, 1e-10, 50, &mut work);
        assert!(outcome.reached(1e-10) && outcome.iterations <= 1, "{outcome:?}");
        x[3] = f64::NAN;
        let outcome = solve(&mut chain, &mut jacobi, &b, &mut x, 1e-10, 50, &mut work);
        assert!(outcome.reached(1e-10), "{outcome:?}");
        let outcome = solve(&mut chain, &mut jacobi, &vec![0.0; n], &mut x, 1e-10, 50, &mut work);
        assert_eq!(outcome, Outcome { iterations: 0, residual: 0.0 });
        assert_eq!(x, vec![0.0; n]);
    }

    #[test]
    fn what_is_not_positive_definite_or_not_a_number_ends_and_is_not_called_done() {
        let b = [1.0, 1.0, 1.0];
        let mut work = Workspace::new(3);
        let mut same = |r: &[f64], z: &mut [f64]| z.copy_from_slice(r);
        for factor in [-1.0, f64::NAN, f64::INFINITY, 0.0] {
            let mut apply = |p: &[f64], q: &mut [f64]| q.iter_mut().zip(p).for_each(|(q, p)| *q = factor * p);
            let outcome = solve(&mut apply, &mut same, &b, &mut [0.0; 3], 1e-10, 50, &mut work);
            assert!(!outcome.reached(1e-10), "{factor}: {outcome:?}");
            let outcome = solve(&mut same.clone(), &mut apply, &b, &mut [0.0; 3], 1e-10, 50, &mut work);
            assert!(!outcome.reached(1e-10), "preconditioner {factor}: {outcome:?}");
        }
    }

    #[test]
    fn a_tolerance_below_rounding_ends_at_rounding() {
        let n = 60;
        let b: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
        let mut x = vec![0.0; n];
        let mut work = Workspace::new(n);
        let outcome = solve(&mut chain, &mut jacobi, &b, &mut x, 0.0, 100_000, &mut work);
        assert!(outcome.iterations < 100_000 && outcome.residual < 1e-12, "{outcome:?}");
    }
}
