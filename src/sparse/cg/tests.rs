//! Conjugate gradients on a chain of springs.

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

/// [`chain`] for whole columns.
fn chains(n: usize) -> impl FnMut(&[f64], &mut [f64]) {
    move |p, q| p.chunks_exact(n).zip(q.chunks_exact_mut(n)).for_each(|(p, q)| chain(p, q))
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
fn columns_travel_together_and_each_stops_when_it_is_done() {
    let n = 60;
    // a smooth and a rough force, none, the image of the guess, one already solved by its guess
    let mut b = vec![0.0; 5 * n];
    let mut x = vec![0.0; 5 * n];
    for i in 0..n {
        b[i] = 1.0;
        b[n + i] = (7.0 * i as f64).sin();
        x[2 * n + i] = 4.0;
        x[3 * n + i] = (i as f64).cos();
        x[4 * n + i] = 0.5 - i as f64;
    }
    for c in [3, 4] {
        let (x, b) = (&x[c * n..(c + 1) * n], &mut b[c * n..(c + 1) * n]);
        chain(x, b);
    }
    x[3 * n..4 * n].iter_mut().for_each(|x| *x *= 2.0);
    let mut alone = x.clone();
    let mut work = Workspace::new(n);
    let mut each = |r: &[f64], z: &mut [f64]| {
        r.chunks_exact(n).zip(z.chunks_exact_mut(n)).for_each(|(r, z)| jacobi(r, z));
    };
    let (mut calls, mut all) = (0, chains(n));
    let mut apply = |p: &[f64], q: &mut [f64]| {
        calls += 1;
        all(p, q);
    };
    let together = solve_columns(&mut apply, &mut each, &b, &mut x, 1e-12, 200, &mut work);
    assert!(together.reached(1e-12), "{together:?}");
    let (mut iterations, mut most) = (0, 0);
    for (b, x) in b.chunks_exact(n).zip(alone.chunks_exact_mut(n)) {
        let taken = solve(&mut chain, &mut each, b, x, 1e-12, 200, &mut work).iterations;
        (iterations, most) = (iterations + taken, most.max(taken));
    }
    assert_eq!((x, together.iterations), (alone, iterations));
    // one call an iteration of the longest, and a few for residuals
    assert!(most < calls && calls <= most + 6, "{calls} calls for {most} iterations");
    assert_eq!(solve_columns(&mut chains(n), &mut each, &[], &mut [], 1e-12, 9, &mut work).residual, 0.0);
}

#[test]
fn an_interruption_ends_the_iteration_within_one_step() {
    let n = 60;
    let b: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
    let progress = crate::clock::Progress::default();
    let mut work = Workspace::new(n);
    work.watch(&progress.interrupt());
    let mut products = 0;
    let mut apply = |p: &[f64], q: &mut [f64]| {
        products += 1;
        if products == 3 {
            progress.cancel();
        }
        chain(p, q);
    };
    let outcome = solve(&mut apply, &mut jacobi, &b, &mut vec![0.0; n], 1e-12, 200, &mut work);
    // the third product is the last of an iteration; one more computes the residual
    assert!(!outcome.reached(1e-12) && outcome.iterations == 3, "{outcome:?}");
    assert_eq!(products, 4);
    assert_eq!(work.check(), Err(crate::error::Error::Interrupted));
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
