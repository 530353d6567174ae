//! A network under its load cases, solved.

use crate::clock::Interrupt;
use crate::sparse::vectors::{dot, square_of_difference};
use crate::springs::solver::{Settings, SpringSolver};

use super::part::Part;
use super::worker::Ground;

/// Load cases with what the continuum does under them.
#[derive(Clone, Copy)]
pub struct Cases<'a> {
    /// Forces over the free dofs, one case after the other (cases x n), N.
    pub forces: &'a [f64],
    /// Displacements of the continuum, like the forces, m.
    pub reference: &'a [f64],
    /// Weight w_c of each case in percent per metre, see [`crate::calibration::objectives::displacement::weights`].
    pub weights: &'a [f64],
}

impl Cases<'_> {
    /// The error of displacements (cases x n, m), percent (5.7).
    pub fn error(&self, displacement: &[f64]) -> f64 {
        let n = displacement.len() / self.weights.len().max(1);
        let cases = displacement.chunks_exact(n.max(1)).zip(self.reference.chunks_exact(n.max(1)));
        let squares = cases.zip(self.weights).map(|((u, reference), w)| w * w * square_of_difference(u, reference));
        squares.sum::<f64>().sqrt()
    }
}

/// A network that has been solved.
pub struct State<'a> {
    /// With its factor.
    pub solver: SpringSolver<'a>,
    /// The numbers of its groups.
    pub phi: Vec<f64>,
    /// Displacements of all fitted cases (cases x n, m).
    pub displacement: Vec<f64>,
    /// The error over the fitted cases, percent.
    pub error: f64,
}

impl<'a> State<'a> {
    /// Nothing solved yet.
    pub fn new(ground: &Ground<'a>, settings: &Settings, interrupt: &Interrupt) -> Self {
        let mut solver = SpringSolver::new(ground.operator, settings);
        solver.watch(interrupt);
        let displacement = vec![0.0; ground.fitted.forces.len()];
        Self { solver, phi: vec![], displacement, error: f64::INFINITY }
    }

    /// phi times the common factor that makes the error smallest inside the bounds: K(s phi) = s K(phi).
    pub fn scaled(&self, cases: &Cases, parts: &[Part]) -> Vec<f64> {
        let n = self.solver.unknowns();
        let (mut with_reference, mut with_itself) = (0.0, 0.0);
        let pairs = self.displacement.chunks_exact(n).zip(cases.reference.chunks_exact(n));
        for ((u, reference), w) in pairs.zip(cases.weights) {
            with_reference += w * w * dot(u, reference);
            with_itself += w * w * dot(u, u);
        }
        let largest = self.phi.iter().zip(parts).fold(f64::INFINITY, |s, (phi, part)| s.min(part.upper / phi));
        // displacements that point away from the reference have no best positive factor: leave them
        let best = if with_reference > 0.0 { (with_itself / with_reference).min(largest) } else { 1.0 };
        self.phi.iter().zip(parts).map(|(phi, part)| (phi * best).min(part.upper)).collect()
    }
}
