//! Conjugate gradients on K(phi) with a factor that may be rough or old.
//!
//! One factor is kept with the phi it belongs to: in f32, or in f64 where f32 failed. [`prediction`] says whether it
//! is good enough for the next systems. If it is not, or did not do what was foretold, a new one is made:
//!
//! ```text
//! kept factor --too many iterations--> new one in f32 --fails--> new one in f64, and its checked solve
//! ```
//!
//! f32 fails by a pivot that is not positive or by no convergence: a condition number above about 1e7 after scaling.

use std::sync::Arc;

use crate::clock::Interrupt;
use crate::error::Result;
use crate::sparse::cg;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::product::SymmetricProduct;
use crate::sparse::single::SingleFactor;

use super::affine::AffineStiffness;
use super::prediction;
use super::solver::Work;

/// Iterations that a factor in f32 of this very K is expected to take, and those it may take.
const FRESH: (f64, usize) = (3.0, 25);

/// Columns that are iterated on together.
const TOGETHER: usize = 16;

/// Failures of f32 from which on it is left, when they are at least a quarter of its factorisations.
const MANY_FAILURES: u64 = 4;

/// The factor that is kept.
struct Kept {
    double: bool,
    phi: Vec<f64>,
}

/// One worker's matrix, factors and vectors.
pub(super) struct Iterative {
    symbolic: Arc<Symbolic>,
    /// Whether an old factor may serve.
    reuse: bool,
    phi: Vec<f64>,
    /// The permuted lower triangle of K(phi).
    values: Vec<f64>,
    product: SymmetricProduct,
    single: SingleFactor,
    double: Option<Factor>,
    kept: Option<Kept>,
    /// The phi of the last answers.
    answered: Option<Vec<f64>>,
    vectors: cg::Workspace,
    /// Right-hand sides and their answers in elimination order.
    right: Vec<f64>,
    answer: Vec<f64>,
    pub(super) work: Work,
}

impl Iterative {
    /// `reuse`: whether an old factor may serve.
    pub(super) fn new(symbolic: &Arc<Symbolic>, reuse: bool) -> Self {
        let n = symbolic.len();
        Self {
            reuse,
            phi: Vec::new(),
            values: vec![0.0; symbolic.lower_rows().len()],
            product: SymmetricProduct::new(Arc::clone(symbolic)),
            single: SingleFactor::new(Arc::clone(symbolic)),
            double: None,
            kept: None,
            answered: None,
            vectors: cg::Workspace::new(n),
            right: vec![0.0; n],
            answer: vec![0.0; n],
            work: Work::default(),
            symbolic: Arc::clone(symbolic),
        }
    }

    /// Ends iterations when the user stops the run.
    pub(super) fn watch(&mut self, interrupt: &Interrupt) {
        self.vectors.watch(interrupt);
    }

    /// Takes phi and assembles K(phi).
    pub(super) fn set(&mut self, stiffness: &AffineStiffness, phi: &[f64]) {
        self.phi.clear();
        self.phi.extend_from_slice(phi);
        stiffness.assemble_into(phi, &mut self.values);
    }

    /// Solves for whole columns; `answers` holds guesses. See [`super::solver::SpringSolver::solve`].
    pub(super) fn solve(&mut self, forces: &[f64], answers: &mut [f64], tolerance: f64) -> Result<()> {
        let outcome = self.attempt(forces, answers, tolerance);
        match outcome {
            Ok(()) => self.answered = Some(self.phi.clone()),
            // what is left is no guess
            Err(_) => answers.fill(0.0),
        }
        outcome
    }

    fn attempt(&mut self, forces: &[f64], answers: &mut [f64], tolerance: f64) -> Result<()> {
        if let Some(limit) = self.limit_with_kept(forces, answers, tolerance) {
            self.work.stale_solves += if self.is_fresh() { 0 } else { self.columns(forces) as u64 };
            if self.descend(forces, answers, tolerance, limit)? {
                return Ok(());
            }
        }
        if !self.is_fresh() {
            self.renew()?;
            if self.descend(forces, answers, tolerance, FRESH.1)? {
                return Ok(());
            }
        }
        self.work.fallbacks += 1;
        self.renew_double()?;
        self.exact(forces, answers)
    }

    fn columns(&self, forces: &[f64]) -> usize {
        forces.len() / self.symbolic.len().max(1)
    }

    /// True when the kept factor is that of this very K.
    fn is_fresh(&self) -> bool {
        self.kept.as_ref().is_some_and(|kept| kept.phi == self.phi)
    }

    /// Iterations that the kept factor is allowed; `None` when a new one is expected to be cheaper.
    fn limit_with_kept(&self, forces: &[f64], guesses: &[f64], tolerance: f64) -> Option<usize> {
        let kept = self.kept.as_ref()?;
        if self.is_fresh() {
            return Some(FRESH.1);
        }
        let guess = match &self.answered {
            Some(phi) if guesses.iter().any(|u| *u != 0.0) => {
                prediction::guess_error(prediction::spread(&self.phi, phi))
            }
            _ => 1.0,
        };
        let c = prediction::spread(&self.phi, &kept.phi);
        let predicted = prediction::iterations(c, guess, tolerance);
        let columns = prediction::columns_in_iterations(self.columns(forces));
        let renewal = prediction::refactorisation_in_iterations(&self.symbolic) + FRESH.0 * columns;
        let worth = self.reuse && predicted * columns <= renewal;
        // a guess may be worse than it should be, and is then no reason for a new factor
        worth.then(|| 2 * prediction::iterations(c, 1.0, tolerance).min(renewal) as usize + 2)
    }

    /// Makes the factor of this K: in f32, or in f64 where f32 fails.
    fn renew(&mut self) -> Result<()> {
        let Work { single_refactorisations: tried, fallbacks: failed, .. } = self.work;
        if failed >= MANY_FAILURES && 4 * failed >= tried {
            return self.renew_double();
        }
        self.kept = None;
        self.work.refactorisations += 1;
        self.work.single_refactorisations += 1;
        match self.single.refactor(&self.values) {
            Ok(()) => self.kept = Some(Kept { double: false, phi: self.phi.clone() }),
            Err(_) => {
                self.work.fallbacks += 1;
                self.renew_double()?;
            }
        }
        Ok(())
    }

    /// Makes the factor of this K in f64.
    fn renew_double(&mut self) -> Result<()> {
        self.kept = None;
        self.work.refactorisations += 1;
        let double = self.double.get_or_insert_with(|| Factor::new(Arc::clone(&self.symbolic)));
        double.values_mut().copy_from_slice(&self.values);
        double.refactor()?;
        self.kept = Some(Kept { double: true, phi: self.phi.clone() });
        Ok(())
    }

    /// The checked solve with the factor of this K in f64.
    fn exact(&mut self, forces: &[f64], answers: &mut [f64]) -> Result<()> {
        let double = self.double.as_mut().expect("the factor was made before");
        double.solve(forces, answers).map(|_| ())
    }

    /// Conjugate gradients with the kept factor, or its checked solve when it is exact; false when a column does not reach
    /// the tolerance, and then `answers` holds guesses still.
    fn descend(&mut self, forces: &[f64], answers: &mut [f64], tolerance: f64, limit: usize) -> Result<bool> {
        let double = self.kept.as_ref().is_some_and(|kept| kept.double);
        if double && self.is_fresh() {
            return self.exact(forces, answers).map(|()| true);
        }
        let n = self.symbolic.len();
        for (forces, answers) in forces.chunks(n * TOGETHER).zip(answers.chunks_mut(n * TOGETHER)) {
            if !self.together(double, forces, answers, tolerance, limit)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Conjugate gradients for up to [`TOGETHER`] columns; false when one does not reach the tolerance.
    fn together(
        &mut self,
        double: bool,
        forces: &[f64],
        answers: &mut [f64],
        tolerance: f64,
        limit: usize,
    ) -> Result<bool> {
        let n = self.symbolic.len();
        self.right.resize(forces.len(), 0.0);
        self.answer.resize(forces.len(), 0.0);
        self.permute(forces, answers);
        let Self { values, product, single, double: factor, right, answer, vectors, .. } = self;
        let mut apply = |x: &[f64], y: &mut [f64]| {
            x.chunks_exact(n).zip(y.chunks_exact_mut(n)).for_each(|(x, y)| product.apply(values, x, y));
        };
        let mut precondition = |r: &[f64], z: &mut [f64]| match factor {
            Some(factor) if double => factor.precondition(r, z),
            _ => single.precondition(r, z),
        };
        let outcome = cg::solve_columns(&mut apply, &mut precondition, right, answer, tolerance, limit, vectors);
        self.work.iterations += outcome.iterations as u64;
        self.vectors.check()?;
        if !outcome.reached(tolerance) {
            return Ok(false);
        }
        for (answer, found) in answers.chunks_exact_mut(n).zip(self.answer.chunks_exact(n)) {
            for (&unknown, found) in self.symbolic.order().iter().zip(found) {
                answer[unknown as usize] = *found;
            }
        }
        Ok(true)
    }

    /// Brings forces and guesses to elimination order.
    fn permute(&mut self, forces: &[f64], guesses: &[f64]) {
        let n = self.symbolic.len();
        for (from, to) in [(forces, &mut self.right), (guesses, &mut self.answer)] {
            for (from, to) in from.chunks_exact(n).zip(to.chunks_exact_mut(n)) {
                for (to, &unknown) in to.iter_mut().zip(self.symbolic.order()) {
                    *to = from[unknown as usize];
                }
            }
        }
    }
}
