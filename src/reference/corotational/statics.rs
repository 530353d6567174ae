//! Equilibrium of a corotational body: the displacement u that makes the potential Pi(u) = E(u) - f.u smallest.
//!
//! Newton's method with a line search, the load applied in equal steps:
//!
//! ```text
//!     K(u) d = f - dE/du,     u += t d,     t = 1, 1/2, 1/4, ...
//! ```
//!
//! A step is taken when it halves the forces out of balance, or else when it lowers Pi by at least 1e-4 of what its slope
//! promises. K is the exact second derivative where that is positive definite; where the body buckles it is not, and the
//! positive part serves; a flattened body may need some of its diagonal added. The analysis of K is done once.
//!
//! Forces out of balance are measured against the largest force on a node, reactions of the supports included; without
//! any load, against what rounding leaves.

use std::sync::Arc;

use nalgebra_sparse::CsrMatrix;

use crate::dense::dot;
use crate::error::{Error, Result};
use crate::reference::corotational::Tangent;
use crate::reference::corotational::held::Held;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::ordering::minimum_degree;

/// A full step that leaves at most this part of the forces out of balance needs no energies.
const GOOD: f64 = 0.5;

/// Part of the slope of the potential that a step must gain.
const GAIN: f64 = 1e-4;

/// How often a step is halved.
const HALVINGS: i32 = 40;

/// Tangents in the order in which they are tried, and the part of the mean diagonal that is added to each.
const TANGENTS: [(Tangent, f64); 5] = [
    (Tangent::Exact, 0.0),
    (Tangent::Positive, 0.0),
    (Tangent::Positive, 1e-6),
    (Tangent::Positive, 1e-3),
    (Tangent::Positive, 1.0),
];

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

/// Finds the equilibrium under `forces` (N on each free degree of freedom), from the displacement `start` (m).
///
/// # Errors
/// [`Error::NoEquilibrium`] with the reason; those of [`Factor::solve`].
///
/// # Panics
/// When a slice has not one number for each free degree of freedom.
pub fn solve(body: &mut Held, forces: &[f64], start: &[f64], search: Search) -> Result<Equilibrium> {
    assert_eq!((forces.len(), start.len()), (body.dofs().len(), body.dofs().len()), "one number for each unknown");
    let mut newton = Newton::new(body, start)?;
    let steps = search.load_steps.max(1);
    let mut residual = 0.0;
    for step in 1..=steps {
        newton.share = step as f64 / steps as f64;
        newton.load.iter_mut().zip(forces).for_each(|(load, force)| *load = newton.share * force);
        residual = newton.run(search)?;
    }
    let energy = newton.body.energy();
    let Newton { u: displacement, iterations, factorisations, .. } = newton;
    Ok(Equilibrium { displacement, energy, iterations, factorisations, residual })
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

/// The iteration and its vectors.
struct Newton<'a> {
    body: &'a mut Held,
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
}

impl<'a> Newton<'a> {
    fn new(body: &'a mut Held, start: &[f64]) -> Result<Self> {
        let pattern = body.pattern();
        let symbolic: Arc<Symbolic> = Symbolic::analyse(pattern, minimum_degree(pattern)?)?;
        let values = vec![0.0; pattern.entries()];
        let matrix = CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), values);
        let diagonal = |i| pattern.position(i, i).expect("the diagonal is stored");
        let zeros = vec![0.0; start.len()];
        Ok(Self {
            factor: Factor::new(symbolic),
            matrix: matrix.expect("one value for each entry of the pattern"),
            diagonal: (0..pattern.len()).map(diagonal).collect(),
            u: start.to_vec(),
            trial: zeros.clone(),
            load: zeros.clone(),
            residual: zeros.clone(),
            direction: zeros,
            share: 0.0,
            iterations: 0,
            factorisations: 0,
            body,
        })
    }

    /// Iterates under the present load; the forces out of balance at the end, relative.
    fn run(&mut self, search: Search) -> Result<f64> {
        self.trial.copy_from_slice(&self.u);
        let mut balance = self.balance();
        for _ in 0..search.iterations {
            if self.accepts(balance, search) {
                return Ok(balance.relative());
            }
            if !balance.out.is_finite() {
                return Err(self.failed("a force is not finite", balance, search));
            }
            if !self.factor()? {
                return Err(self.failed("no tangent is positive definite", balance, search));
            }
            self.factor.solve(&self.residual, &mut self.direction)?;
            self.iterations += 1;
            match self.search(balance) {
                Some(found) => balance = found,
                None => {
                    return Err(self.failed(
                        "no step along the search direction lowers the potential",
                        balance,
                        search,
                    ));
                }
            }
        }
        match self.accepts(balance, search) {
            true => Ok(balance.relative()),
            false => Err(self.failed("the iterations are used up", balance, search)),
        }
    }

    /// Small beside the largest force, or rounding.
    fn accepts(&self, balance: Balance, search: Search) -> bool {
        balance.out <= search.tolerance * balance.largest + self.body.rounding()
    }

    fn failed(&self, reason: &'static str, balance: Balance, search: Search) -> Error {
        let (residual, load, tolerance, iterations) =
            (balance.relative(), self.share, search.tolerance, self.iterations);
        Error::NoEquilibrium { load, reason, residual, tolerance, iterations }
    }

    /// residual = f - dE/du at the trial displacement.
    fn balance(&mut self) -> Balance {
        self.body.place(&self.trial);
        self.body.internal_force(&mut self.residual);
        let mut balance = Balance { out: 0.0, largest: self.body.largest_force() };
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

    /// Factors the first tangent that is positive definite; false when none is.
    fn factor(&mut self) -> Result<bool> {
        for (tangent, shift) in TANGENTS {
            self.body.linearise(tangent);
            self.body.fill(self.matrix.values_mut());
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
    fn search(&mut self, before: Balance) -> Option<Balance> {
        let slope = dot(&self.residual, &self.direction);
        self.body.place(&self.u);
        let start = self.body.energy() - dot(&self.load, &self.u);
        for halving in 0..HALVINGS {
            let t = 0.5_f64.powi(halving);
            for ((trial, u), d) in self.trial.iter_mut().zip(&self.u).zip(&self.direction) {
                *trial = u + t * d;
            }
            let balance = self.balance();
            let potential = self.body.energy() - dot(&self.load, &self.trial);
            if balance.out <= GOOD * before.out || potential <= start - GAIN * t * slope {
                self.u.copy_from_slice(&self.trial);
                return Some(balance);
            }
        }
        None
    }
}
