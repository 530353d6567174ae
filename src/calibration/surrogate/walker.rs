//! The surrogate as an objective: what an optimiser walks on.
//!
//! ```text
//! K_r y_c = V^T f_c,     e = sqrt(sum_c w_c^2 (|y_c - V^T u_ref,c|^2 + rest_c^2))
//! ```
//!
//! costs m r^2 / 2 + r^3 / 6 multiplications and as many additions, whatever the mesh, and allocates nothing. The
//! Jacobian is dy/dphi_a = -K_r^-1 K_a,r y. A basis is good near where it was made only: beyond the [`Trust`] region the
//! error is infinite.

use crate::calibration::objective::{Counts, Objective};
use crate::dense::dot;
use crate::error::{Error, Result};
use crate::lanes::dispatch;

use super::certificate::{Bound, Certificate};
use super::galerkin::Galerkin;
use super::packed;

/// Stiffness below this fraction of the median of a centre counts as nearly nothing: the region is linear there.
const NEARLY_NOTHING: f64 = 0.05;

/// Where a surrogate is believed: |ln((phi_a + c) / (centre_a + c))| <= radius for every group.
#[derive(Debug, Clone, PartialEq)]
pub struct Trust {
    /// Middle of the region.
    pub centre: Vec<f64>,
    /// Its radius in the logarithm.
    pub radius: f64,
    floor: f64,
}

impl Trust {
    /// The region around a centre.
    pub fn new(centre: &[f64], radius: f64) -> Self {
        let mut sorted = centre.to_vec();
        sorted.sort_by(f64::total_cmp);
        Self { centre: centre.to_vec(), radius, floor: NEARLY_NOTHING * sorted[sorted.len() / 2] }
    }

    /// True inside.
    pub fn contains(&self, phi: &[f64]) -> bool {
        let (low, high) = ((-self.radius).exp(), self.radius.exp());
        phi.iter().zip(&self.centre).all(|(phi, centre)| {
            let (phi, centre) = (phi + self.floor, centre + self.floor);
            phi >= low * centre && phi <= high * centre
        })
    }
}

/// One worker on a surrogate.
pub struct Walker<'g> {
    basis: &'g Galerkin<'g>,
    trust: Option<&'g Trust>,
    phi: Vec<f64>,
    /// The Cholesky factor of K_r before it was scaled.
    factor: Vec<f64>,
    scale: f64,
    solution: Vec<f64>,
    product: Vec<f64>,
    rest: Vec<f64>,
    inside: bool,
    counts: Counts,
}

impl<'g> Walker<'g> {
    /// A worker with its own memory.
    pub fn new(basis: &'g Galerkin<'g>, trust: Option<&'g Trust>) -> Self {
        let (r, cases) = (basis.rank(), basis.target.weights.len());
        Self {
            basis,
            trust,
            phi: vec![0.0; basis.target.upper.len()],
            factor: vec![0.0; packed::len(r)],
            scale: 1.0,
            solution: vec![0.0; cases * r],
            product: vec![0.0; r],
            rest: (0..cases).map(|case| basis.rest(case)).collect(),
            inside: false,
            counts: Counts::default(),
        }
    }

    /// Coordinates y of all cases (cases x r) at the last phi, m.
    pub fn solution(&self) -> &[f64] {
        &self.solution
    }

    /// The displacements V y of all cases (cases x n), m.
    pub fn displacement(&self) -> Vec<f64> {
        let n = self.basis.unknowns();
        let mut displacement = vec![0.0; self.rest.len() * n];
        for (u, y) in displacement.chunks_exact_mut(n).zip(self.solution.chunks_exact(self.basis.rank())) {
            self.basis.combine(y, u);
        }
        displacement
    }

    /// What is certain about the error of the last state. `image` is workspace, see [`Walker::bound_workspace`].
    pub fn bound(&self, certificate: &Certificate, image: &mut [f64]) -> Bound {
        certificate.bound(&self.phi, &self.solution, image)
    }

    /// The energy norm of the surrogate displacements, sqrt(sum_c f_c . V y_c), in sqrt(N m).
    pub fn energy(&self) -> f64 {
        let cases = self.solution.chunks_exact(self.basis.rank()).zip(&self.basis.forces);
        cases.map(|(y, forces)| dot(y, forces)).sum::<f64>().sqrt()
    }

    /// Workspace of [`Walker::bound`].
    pub fn bound_workspace(certificate: &Certificate) -> Vec<f64> {
        vec![0.0; certificate.workspace()]
    }

    fn distance(&self) -> f64 {
        let r = self.basis.rank();
        let mut sum = 0.0;
        for (case, y) in self.solution.chunks_exact(r).enumerate() {
            let square: f64 = y.iter().zip(&self.basis.aims[case]).map(|(y, aim)| (y - aim).powi(2)).sum();
            sum += self.basis.target.weights[case].powi(2) * (square + self.rest[case].powi(2));
        }
        sum.sqrt()
    }
}

impl Objective for Walker<'_> {
    fn error(&mut self, phi: &[f64]) -> Result<f64> {
        let r = self.basis.rank();
        self.counts.evaluations += 1;
        self.counts.refactorisations += 1;
        self.phi.copy_from_slice(phi);
        self.scale = 1.0;
        self.inside = self.trust.is_none_or(|trust| trust.contains(phi));
        if !self.inside {
            return Ok(f64::INFINITY);
        }
        let solved = dispatch(
            #[inline(always)]
            || {
                packed::combine(phi, &self.basis.stiffness, &mut self.factor);
                packed::factor(&mut self.factor, r)?;
                for (y, forces) in self.solution.chunks_exact_mut(r).zip(&self.basis.forces) {
                    y.copy_from_slice(forces);
                    packed::solve(&self.factor, r, y);
                }
                Ok(())
            },
        );
        if let Err(dof) = solved {
            self.inside = false;
            return Err(Error::NotPositiveDefinite { dof });
        }
        Ok(self.distance())
    }

    fn fit_scale(&mut self, phi: &mut [f64]) -> f64 {
        if !self.inside {
            return f64::INFINITY;
        }
        let target = &self.basis.target;
        let (mut with_reference, mut with_itself) = (0.0, 0.0);
        for (case, y) in self.solution.chunks_exact(self.basis.rank()).enumerate() {
            let square = target.weights[case].powi(2);
            with_reference += square * dot(y, &self.basis.aims[case]);
            with_itself += square * dot(y, y);
        }
        let largest = self.phi.iter().zip(target.upper).fold(f64::INFINITY, |s, (p, u)| s.min(u / p));
        let best = if with_reference > 0.0 { (with_itself / with_reference).min(largest) } else { 1.0 };
        for (p, upper) in self.phi.iter_mut().zip(target.upper) {
            *p = (*p * best).min(*upper);
        }
        self.solution.iter_mut().for_each(|y| *y /= best);
        self.scale *= best;
        phi.copy_from_slice(&self.phi);
        self.inside = self.trust.is_none_or(|trust| trust.contains(phi));
        if self.inside { self.distance() } else { f64::INFINITY }
    }

    fn linearise(&mut self, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) -> Result<()> {
        let (r, target) = (self.basis.rank(), &self.basis.target);
        let rows = self.rest.len() * (r + 1);
        residual.clear();
        for (case, y) in self.solution.chunks_exact(r).enumerate() {
            let weight = target.weights[case];
            residual.extend(y.iter().zip(&self.basis.aims[case]).map(|(y, aim)| weight * (y - aim)));
            residual.push(weight * self.rest[case]);
        }
        jacobian.clear();
        jacobian.resize(rows * self.phi.len(), 0.0);
        let groups = jacobian.chunks_exact_mut(rows).zip(self.basis.stiffness.chunks_exact(packed::len(r)));
        for (column, stiffness) in groups {
            for (case, (into, y)) in column.chunks_exact_mut(r + 1).zip(self.solution.chunks_exact(r)).enumerate() {
                dispatch(
                    #[inline(always)]
                    || {
                        packed::multiply(stiffness, r, y, &mut self.product);
                        packed::solve(&self.factor, r, &mut self.product);
                    },
                );
                let factor = -target.weights[case] / self.scale;
                into.iter_mut().zip(&self.product).for_each(|(into, p)| *into = factor * p);
            }
        }
        Ok(())
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}
