//! Equilibrium of what has an energy E(u): the displacement u that makes the potential Pi(u) = E(u) - f.u smallest.
//!
//! Newton's method with a line search, the load applied in equal steps:
//!
//! ```text
//!     K(u) d = f - dE/du,     u += t d,     t = 1, 1/2, 1/4, ...
//! ```
//!
//! A step is taken when it halves the forces out of balance, or else when it lowers Pi by at least 1e-4 of what its slope
//! promises. K is the exact second derivative where that is positive definite; where the body buckles it is not, and a
//! positive part of it serves; a flattened body may need some of its diagonal added. The analysis of K is done once.
//!
//! Forces out of balance are measured against the largest force on a node, reactions of the supports included; without
//! any load, against what rounding leaves.
//!
//! What has the energy is a [`Potential`]: a corotational body, or a network of springs.

use std::sync::Arc;

use nalgebra_sparse::CsrMatrix;

use super::cholesky::{Factor, Symbolic};
use super::ordering::minimum_degree;
use super::pattern::Pattern;
use crate::clock::Interrupt;
use crate::dense::dot;
use crate::error::{Error, Result};

/// A full step that leaves at most this part of the forces out of balance needs no energies.
const GOOD: f64 = 0.5;

/// Part of the slope of the potential that a step must gain.
const GAIN: f64 = 1e-4;

/// How often a step is halved.
const HALVINGS: i32 = 40;

/// Second derivatives in the order in which they are tried, and the part of the mean diagonal that is added to each.
const ATTEMPTS: [(Curvature, f64); 5] = [
    (Curvature::Exact, 0.0),
    (Curvature::Positive, 0.0),
    (Curvature::Positive, 1e-6),
    (Curvature::Positive, 1e-3),
    (Curvature::Positive, 1.0),
];

/// Which second derivative of the energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curvature {
    /// The second derivative.
    Exact,
    /// One without negative eigenvalues that agrees with it where there are none.
    Positive,
}

/// Something with an elastic energy over n free degrees of freedom, placed at one displacement at a time.
pub trait Potential {
    /// What it is, for messages: a word or two that "the" goes with.
    fn name(&self) -> &'static str;

    /// The entries that a second derivative can have, both triangles.
    fn pattern(&self) -> &Pattern;

    /// Goes to the displacement u (m).
    fn place(&mut self, u: &[f64]);

    /// Elastic energy in J where it was placed.
    fn energy(&self) -> f64;

    /// Writes dE/du in N where it was placed.
    fn internal_force(&mut self, out: &mut [f64]);

    /// The largest force on a node in N, reactions of the supports included, as the last call of
    /// [`Potential::internal_force`] found it.
    fn largest_force(&self) -> f64;

    /// Force in N that rounding leaves at rest.
    fn rounding(&self) -> f64;

    /// Writes d2E/du2 on the pattern, in N/m, where it was placed.
    fn tangent(&mut self, curvature: Curvature, values: &mut [f64]);
}

/// How equilibrium is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Steps of the load, at least 1.
    pub load_steps: usize,
    /// Largest force out of balance that is accepted, relative to the largest force.
    pub tolerance: f64,
    /// Newton iterations of a load step at most.
    pub iterations: usize,
}

impl Default for Search {
    fn default() -> Self {
        Self { load_steps: 1, tolerance: 1e-10, iterations: 200 }
    }
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Displacement of each free degree of freedom in m.
    pub displacement: Vec<f64>,
    /// Elastic energy in J.
    pub energy: f64,
    /// Newton iterations of all load steps.
    pub iterations: usize,
    /// Factorisations, those that failed included.
    pub factorisations: usize,
    /// Largest force out of balance, relative to the largest force.
    pub residual: f64,
}

/// The largest force out of balance, and the largest force there is, in N.
#[derive(Debug, Clone, Copy)]
struct Balance {
    out: f64,
    largest: f64,
}

impl Balance {
    fn relative(self) -> f64 {
        if self.out == 0.0 { 0.0 } else { self.out / self.largest }
    }
}

/// The iteration and its vectors; serves all that has one pattern.
pub struct Newton {
    factor: Factor,
    matrix: CsrMatrix<f64>,
    diagonal: Vec<usize>,
    u: Vec<f64>,
    trial: Vec<f64>,
    load: Vec<f64>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    share: f64,
    iterations: usize,
    factorisations: usize,
    interrupt: Interrupt,
}

impl Newton {
    /// Makes room for a pattern; `symbolic` is an analysis of it, if there is one.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn new(pattern: &Pattern, symbolic: Option<&Arc<Symbolic>>) -> Result<Self> {
        match symbolic {
            Some(symbolic) => Ok(Self::with(pattern, symbolic)),
            None => Ok(Self::with(pattern, &Symbolic::analyse(pattern, minimum_degree(pattern)?)?)),
        }
    }

    /// Makes room for a pattern that was analysed.
    pub fn with(pattern: &Pattern, symbolic: &Arc<Symbolic>) -> Self {
        let values = vec![0.0; pattern.entries()];
        let matrix = CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), values);
        let diagonal = |i| pattern.position(i, i).expect("the diagonal is stored");
        let zeros = vec![0.0; pattern.len()];
        Self {
            factor: Factor::new(Arc::clone(symbolic)),
            matrix: matrix.expect("one value for each entry of the pattern"),
            diagonal: (0..pattern.len()).map(diagonal).collect(),
            u: zeros.clone(),
            trial: zeros.clone(),
            load: zeros.clone(),
            residual: zeros.clone(),
            direction: zeros,
            share: 0.0,
            iterations: 0,
            factorisations: 0,
            interrupt: Interrupt::default(),
        }
    }

    /// Ends searches when the user stops the run.
    pub fn watching(mut self, interrupt: &Interrupt) -> Self {
        self.interrupt = interrupt.clone();
        self
    }

    /// Finds the equilibrium under `forces` (N on each free degree of freedom), from the displacement `start` (m).
    ///
    /// # Errors
    /// [`Error::NoEquilibrium`] with the reason; [`Error::Interrupted`]; those of [`Factor::solve`].
    ///
    /// # Panics
    /// When a slice has not one number for each free degree of freedom.
    pub fn solve(
        &mut self,
        body: &mut dyn Potential,
        forces: &[f64],
        start: &[f64],
        search: Search,
    ) -> Result<Equilibrium> {
        assert_eq!([forces.len(), start.len()], [self.u.len(); 2], "one number for each unknown");
        self.u.copy_from_slice(start);
        (self.iterations, self.factorisations) = (0, 0);
        let steps = search.load_steps.max(1);
        let mut residual = 0.0;
        for step in 1..=steps {
            self.share = step as f64 / steps as f64;
            self.load.iter_mut().zip(forces).for_each(|(load, force)| *load = self.share * force);
            residual = self.run(body, search)?;
        }
        let (displacement, energy) = (self.u.clone(), body.energy());
        let (iterations, factorisations) = (self.iterations, self.factorisations);
        Ok(Equilibrium { displacement, energy, iterations, factorisations, residual })
    }

    /// Iterates under the present load; the forces out of balance at the end, relative.
    fn run(&mut self, body: &mut dyn Potential, search: Search) -> Result<f64> {
        self.trial.copy_from_slice(&self.u);
        let rounding = body.rounding();
        // small beside the largest force, or rounding
        let accepts = |balance: Balance| balance.out <= search.tolerance * balance.largest + rounding;
        let mut balance = self.balance(body);
        for _ in 0..search.iterations {
            if accepts(balance) {
                return Ok(balance.relative());
            }
            self.interrupt.check()?;
            if !balance.out.is_finite() {
                return Err(self.failed(body, "a force is not finite", balance, search));
            }
            if !self.factor(body)? {
                return Err(self.failed(body, "no tangent is positive definite", balance, search));
            }
            self.factor.solve(&self.residual, &mut self.direction)?;
            self.iterations += 1;
            match self.search(body, balance) {
                Some(found) => balance = found,
                None => {
                    let reason = "no step along the search direction lowers the potential";
                    return Err(self.failed(body, reason, balance, search));
                }
            }
        }
        match accepts(balance) {
            true => Ok(balance.relative()),
            false => Err(self.failed(body, "the iterations are used up", balance, search)),
        }
    }

    fn failed(&self, body: &dyn Potential, reason: &'static str, balance: Balance, search: Search) -> Error {
        let (residual, load, tolerance, iterations) =
            (balance.relative(), self.share, search.tolerance, self.iterations);
        Error::NoEquilibrium { what: body.name().into(), load, reason, residual, tolerance, iterations }
    }

    /// residual = f - dE/du at the trial displacement.
    fn balance(&mut self, body: &mut dyn Potential) -> Balance {
        body.place(&self.trial);
        body.internal_force(&mut self.residual);
        let mut balance = Balance { out: 0.0, largest: body.largest_force() };
        for (residual, load) in self.residual.iter_mut().zip(&self.load) {
            *residual = load - *residual;
            balance.largest = balance.largest.max(load.abs());
            // a force that is not finite must not pass for a small one
            balance.out = if residual.is_finite() { balance.out.max(residual.abs()) } else { f64::INFINITY };
            if balance.out == f64::INFINITY {
                break;
            }
        }
        balance
    }

    /// Factors the first second derivative that is positive definite; false when none is.
    fn factor(&mut self, body: &mut dyn Potential) -> Result<bool> {
        for (curvature, shift) in ATTEMPTS {
            body.tangent(curvature, self.matrix.values_mut());
            let values = self.matrix.values_mut();
            let mean = self.diagonal.iter().map(|&i| values[i]).sum::<f64>() / self.diagonal.len().max(1) as f64;
            self.diagonal.iter().for_each(|&i| values[i] += shift * mean);
            self.factor.load(&self.matrix);
            self.factorisations += 1;
            match self.factor.refactor() {
                Err(Error::NotPositiveDefinite { .. }) => {}
                outcome => return outcome.map(|()| true),
            }
        }
        Ok(false)
    }

    /// The line search along `direction` from u; the forces out of balance at its end, `None` when no step is good.
    fn search(&mut self, body: &mut dyn Potential, before: Balance) -> Option<Balance> {
        let slope = dot(&self.residual, &self.direction);
        body.place(&self.u);
        let start = body.energy() - dot(&self.load, &self.u);
        for halving in 0..HALVINGS {
            let t = 0.5_f64.powi(halving);
            for ((trial, u), d) in self.trial.iter_mut().zip(&self.u).zip(&self.direction) {
                *trial = u + t * d;
            }
            let balance = self.balance(body);
            let potential = body.energy() - dot(&self.load, &self.trial);
            if balance.out <= GOOD * before.out || potential <= start - GAIN * t * slope {
                self.u.copy_from_slice(&self.trial);
                return Some(balance);
            }
        }
        None
    }

    /// Solves K X = B for whole columns at the displacement where `body` was placed last, with the second derivative
    /// that a step from there would take: the exact one where the equilibrium is stable.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] where none is; those of [`Factor::solve`].
    pub fn respond(&mut self, body: &mut dyn Potential, right: &[f64], out: &mut [f64]) -> Result<()> {
        if !self.factor(body)? {
            return Err(Error::NotPositiveDefinite { dof: 0 });
        }
        self.factor.solve(right, out).map(|_| ())
    }
}
