//! The error bound: how far V y can be from u, without solving for u.
//!
//! The residual r = f - K(phi) V y is affine in the products phi_a y_j. With a centre phi0, K0 = K(phi0) and
//! theta = min_a phi_a / phi0_a > 0,
//!
//! ```text
//! K(phi) >= theta K0        (every K_a is positive semidefinite)
//! |u - V y|_K(phi) = |r|_K^-1  <=  |r|_K0^-1 / sqrt(theta)
//! |u - V y|_2                  <=  |r|_K0^-1 / (theta sqrt(lambda)),        lambda <= lambda_min(K0)
//! | e(u) - e(V y) |            <=  sqrt(sum_c w_c^2 |r_c|^2_K0^-1) / (theta sqrt(lambda))
//! ```
//!
//! the last by the triangle inequality, for the error e in percent of [`Target`]. The bounds do not change when phi0 is
//! scaled. Offline, with K0 = L L^T, the columns L^-1 f_c and L^-1 K_a v_j are collected in M and M = Q R; online
//! |r|_K0^-1 = |R c| with c = (1, -phi_a y_j). It is the length of a vector, not a difference of squares: it is accurate
//! down to rounding, about 1e-15 |f|, where a Gram matrix would end at 1e-8 |f|.
//!
//! lambda: inverse iteration estimates lambda_min from above; a Cholesky factorisation of K0 - lambda I with a lambda
//! slightly below the estimate succeeds only if lambda < lambda_min, which proves it (Sylvester's law of inertia).

use std::sync::Arc;

use crate::calibration::objectives::displacement::Target;
use crate::dense::{dot, triangle_of};
use crate::error::{Error, Result};
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::springs::affine::AffineStiffness;

use super::galerkin::Galerkin;
use super::packed;

/// Steps of inverse iteration.
const ITERATIONS: usize = 30;

/// Share of the estimate that is tried first as a lower bound, and by which it is lowered while the proof fails.
const BELOW: f64 = 0.95;

/// Bounds are raised by this fraction, more than the rounding of their evaluation.
const ROUNDING: f64 = 1e-9;

/// What bounds the error of a basis.
pub struct Certificate<'a> {
    target: Target<'a>,
    springs: &'a AffineStiffness,
    centre: Vec<f64>,
    factor: Factor,
    /// A lower bound of the smallest eigenvalue of K0, N/m; 0 until it is asked for.
    smallest: f64,
    /// M: L^-1 f_c, then L^-1 K_a v_j with a fastest.
    columns: Vec<f64>,
    /// Basis vectors in M.
    rank: usize,
    triangle: Vec<f64>,
}

/// What is known of the error of a surrogate state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// At least sqrt(sum_c |u_c - V y_c|^2_K(phi)), in sqrt(N m).
    pub energy: f64,
    /// At least the difference between the errors of u and V y, percent; infinite without
    /// [`Certificate::bound_eigenvalue`].
    pub error: f64,
}

impl<'a> Certificate<'a> {
    /// Factors K0: enough for the bound of the energy.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] at the centre; [`Error::Input`] when the springs are not assembled.
    pub fn new(target: Target<'a>, centre: &[f64]) -> Result<Self> {
        let (springs, symbolic) = assembled(&target)?;
        let mut factor = Factor::new(Arc::clone(symbolic));
        springs.assemble_into(centre, factor.values_mut());
        factor.refactor()?;
        let mut columns = vec![0.0; target.forces.len()];
        factor.half_solve(target.forces, &mut columns);
        let centre = centre.to_vec();
        Ok(Self { target, springs, centre, factor, smallest: 0.0, columns, rank: 0, triangle: Vec::new() })
    }

    /// Bounds the smallest eigenvalue of K0 too, so that [`Bound::error`] is finite. Some thirty solves and a few
    /// factorisations.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] or [`Error::Inaccurate`] at the centre.
    pub fn bound_eigenvalue(&mut self) -> Result<()> {
        self.smallest = smallest_eigenvalue(self.springs, &self.centre, &mut self.factor)?;
        Ok(())
    }

    /// Takes in the columns that the basis got since the last call.
    pub fn extend(&mut self, basis: &Galerkin) {
        let (n, m) = (basis.unknowns(), self.target.upper.len());
        if self.rank == basis.rank() && !self.triangle.is_empty() {
            return;
        }
        let mut products = vec![0.0; n * m];
        for j in self.rank..basis.rank() {
            for (a, product) in products.chunks_exact_mut(n).enumerate() {
                self.springs.apply(a, basis.vector(j), product);
            }
            let first = self.columns.len();
            self.columns.resize(first + n * m, 0.0);
            self.factor.half_solve(&products, &mut self.columns[first..]);
        }
        self.rank = basis.rank();
        self.triangle = triangle_of(&self.columns, n);
    }

    /// Numbers that [`Certificate::bound`] needs as workspace.
    pub(super) fn workspace(&self) -> usize {
        let n = self.springs.unknowns();
        n.min(self.columns.len() / n)
    }

    /// The bounds of a state: its phi and coordinates y (cases x r). Allocates nothing.
    pub(super) fn bound(&self, phi: &[f64], solution: &[f64], image: &mut [f64]) -> Bound {
        let ratios = phi.iter().zip(&self.centre).filter(|(_, centre)| **centre > 0.0);
        let theta = ratios.map(|(phi, centre)| phi / centre).fold(f64::INFINITY, f64::min);
        let (mut squares, mut weighted) = (0.0, 0.0);
        for (case, (y, w)) in solution.chunks_exact(self.rank).zip(self.target.weights).enumerate() {
            let square = self.residual(case, phi, y, image);
            squares += square;
            weighted += w * w * square;
        }
        let raise = 1.0 + ROUNDING;
        Bound { energy: raise * (squares / theta).sqrt(), error: raise * (weighted / self.smallest).sqrt() / theta }
    }

    /// |f_c - K(phi) V y|^2 in the norm of K0^-1.
    fn residual(&self, case: usize, phi: &[f64], y: &[f64], image: &mut [f64]) -> f64 {
        let (n, cases) = (self.springs.unknowns(), self.target.weights.len());
        image.fill(0.0);
        let mut from = 0;
        let mut add = |column: usize, coefficient: f64| {
            let length = n.min(column + 1);
            if coefficient != 0.0 {
                packed::add(coefficient, &self.triangle[from..from + length], image);
            }
            from += length;
        };
        (0..cases).for_each(|c| add(c, if c == case { 1.0 } else { 0.0 }));
        let mut column = cases;
        for y in y {
            for phi in phi {
                add(column, -phi * y);
                column += 1;
            }
        }
        dot(image, image)
    }
}

/// The assembled springs of a problem.
///
/// # Errors
/// [`Error::Input`] when there are none.
pub fn assembled<'a>(target: &Target<'a>) -> Result<(&'a AffineStiffness, &'a Arc<Symbolic>)> {
    target.operator.assembled().ok_or_else(|| {
        let help = "use solver.path = \"stale\" or \"direct\", or another optimiser";
        Error::input(
            "calibration.optimiser",
            "the surrogate needs factors, and this network is solved by multigrid",
            help,
        )
    })
}

/// A proven lower bound of the smallest eigenvalue of K0; leaves K0 factored.
fn smallest_eigenvalue(springs: &AffineStiffness, centre: &[f64], factor: &mut Factor) -> Result<f64> {
    let n = springs.unknowns();
    let load = |factor: &mut Factor, shift: f64| {
        springs.assemble_into(centre, factor.values_mut());
        let symbolic = Arc::clone(factor.symbolic());
        for &diagonal in &symbolic.lower_starts()[..n] {
            factor.values_mut()[diagonal as usize] -= shift;
        }
        factor.refactor()
    };
    load(factor, 0.0)?;
    let mut vector: Vec<f64> = (0..n).map(|i| 1.0 + 0.5 * (i as f64 * 0.7).sin()).collect();
    let mut solved = vec![0.0; n];
    let mut estimate = 0.0;
    for _ in 0..ITERATIONS {
        factor.solve(&vector, &mut solved)?;
        let length = dot(&solved, &solved).sqrt();
        estimate = dot(&vector, &vector).sqrt() / length;
        vector.iter_mut().zip(&solved).for_each(|(v, s)| *v = s / length);
    }
    let mut shift = BELOW * estimate;
    loop {
        match load(factor, shift) {
            Ok(()) => break,
            Err(Error::NotPositiveDefinite { .. }) if shift > 1e-6 * estimate => shift *= BELOW * BELOW,
            Err(other) => return Err(other),
        }
    }
    load(factor, 0.0)?;
    Ok(shift)
}
