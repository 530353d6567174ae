//! Equilibrium of a corotational body ([`crate::sparse::equilibrium`]), and its answers to load cases.
//!
//! The positive second derivative is that without the negative part of the twist ([`Tangent::Positive`]).

use crate::clock::Interrupt;
use crate::error::Result;
use crate::reference::Case;
use crate::reference::corotational::Tangent;
use crate::reference::corotational::held::Held;
use crate::reference::corotational::inversion::Inversion;
use crate::reference::loads::Load;
use crate::sparse::equilibrium::{Curvature, Newton, Potential};
use crate::sparse::pattern::Pattern;

pub use crate::sparse::equilibrium::{Equilibrium, Search};

impl Potential for Held {
    fn name(&self) -> &'static str {
        "body"
    }

    fn pattern(&self) -> &Pattern {
        Held::pattern(self)
    }

    fn place(&mut self, u: &[f64]) {
        Held::place(self, u);
    }

    fn energy(&self) -> f64 {
        Held::energy(self)
    }

    fn internal_force(&mut self, out: &mut [f64]) {
        Held::internal_force(self, out);
    }

    fn largest_force(&self) -> f64 {
        Held::largest_force(self)
    }

    fn rounding(&self) -> f64 {
        Held::rounding(self)
    }

    fn tangent(&mut self, curvature: Curvature, values: &mut [f64]) {
        self.linearise(match curvature {
            Curvature::Exact => Tangent::Exact,
            Curvature::Positive => Tangent::Positive,
        });
        self.fill(values);
    }
}

/// Finds the equilibrium under `forces` (N on each free degree of freedom), from the displacement `start` (m).
///
/// # Errors
/// Those of [`Newton::solve`].
///
/// # Panics
/// When a slice has not one number for each free degree of freedom.
pub fn solve(body: &mut Held, forces: &[f64], start: &[f64], search: Search) -> Result<Equilibrium> {
    Newton::new(body.pattern(), None)?.solve(body, forces, start, search)
}

/// The work of the static answers under large displacements, and what became of the cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Large {
    /// Newton iterations of all load cases.
    pub iterations: usize,
    /// Factorisations of all load cases.
    pub factorisations: usize,
    /// The largest force out of balance of a case, relative to its largest force.
    pub residual: f64,
    /// What is turned inside out, for each load case.
    pub inversions: Vec<Inversion>,
    /// The answers of the body linearised at rest.
    pub linear: Vec<Case>,
}

/// The equilibrium under every load (name and forces), each from rest; `linear` is left to the caller.
///
/// # Errors
/// Those of [`Newton::solve`].
pub fn answers(
    body: &mut Held,
    loads: &[(&str, &Load)],
    search: Search,
    interrupt: &Interrupt,
) -> Result<(Vec<Case>, Large)> {
    let mut newton = Newton::new(body.pattern(), None)?.watching(interrupt);
    let rest = vec![0.0; body.dofs().len()];
    let mut work =
        Large { iterations: 0, factorisations: 0, residual: 0.0, inversions: Vec::new(), linear: Vec::new() };
    let mut one = |(name, load): &(&str, &Load)| -> Result<Case> {
        let found = newton.solve(body, &load.forces, &rest, search).map_err(|error| error.under(name))?;
        work.iterations += found.iterations;
        work.factorisations += found.factorisations;
        work.residual = work.residual.max(found.residual);
        work.inversions.push(body.inversion(&found.displacement));
        Ok(Case::new(body.dofs(), &load.forces, found.displacement))
    };
    let cases = loads.iter().map(&mut one).collect::<Result<_>>()?;
    Ok((cases, work))
}
