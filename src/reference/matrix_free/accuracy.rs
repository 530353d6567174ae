//! How sure the displacements are that conjugate gradients found.
//!
//! The residual r = f - K u is one product; |K| |u| and |K|_1 come from `sizes`, and with them the componentwise
//! backward error of [`crate::sparse::backward_error`], the measure of every path. Conjugate gradients end at a
//! residual that is small as a whole, |r| <= 1e-12 |f|; where little moves, its part may be large. So they are refined
//! like the solves of a factor: K d = r is solved to as many digits as are missing, and u + d taken while that is
//! better. |K| |u| stays that of the first u, which differs by less than an error has digits.
//!
//! The residual is that of the product. An assembled K is rounded in another way, by some 1e-15 of its entries and up to
//! 1e-14 where the map is nearly singular; the errors are as far apart.
//!
//! The condition and the forward error are those of [`crate::sparse::condition`], whose solves are conjugate gradients
//! with the same preconditioner to one digit. Together they take about as long as one load case. All load cases share
//! one bound: with
//!
//! ```text
//! g_i = max over the cases of (|r| + m u (|K| |u| + |f|))_i / |u|_inf
//! ```
//!
//! |K^-1 diag(g)|_inf is at least the bound of each.

use super::operator::{self, Operator};
use super::separable::{self, Preconditioner};
use super::sizes::Sizes;
use super::solve::Iterated;
use crate::error::{Error, Result};
use crate::sparse::backward_error::worst_ratio;
use crate::sparse::cg;
use crate::sparse::cholesky::REFINE_ABOVE;
use crate::sparse::condition::{Accuracy, Inverse, Solved};
use crate::sparse::vectors::{add, norm};

/// Residual |b - K x| / |b| to which an estimate is solved: its norm is then right to a tenth, seldom to a third.
const ROUGHLY: f64 = 1e-1;

/// Refinements at most.
const REFINEMENTS: usize = 3;

/// Residual to which a refinement is solved, at least and at most.
const REFINED: [f64; 2] = [1e-4, 1e-2];

/// A body that is solved by conjugate gradients.
pub(super) struct System<'a> {
    pub operator: &'a Operator<'a>,
    pub preconditioner: &'a Preconditioner,
    pub space: &'a mut operator::Workspace,
    pub inner: &'a mut separable::Workspace,
    pub iteration: &'a mut cg::Workspace,
    /// Iterations after which a solve is given up.
    pub limit: usize,
}

impl System<'_> {
    /// Refines the answers to `loads` and says how sure they are, the worst of all. Takes a short solve for each, and about
    /// five for the estimates, however many there are.
    ///
    /// # Errors
    /// [`Error::Interrupted`] when the user stops the run.
    pub fn finish(&mut self, loads: &[&[f64]], sizes: &mut Sizes, found: &mut Iterated) -> Result<()> {
        let n = self.operator.dofs.len();
        let (mut backward_error, mut errors) = (0.0_f64, vec![0.0; n]);
        found.residual = 0.0;
        for ((&f, u), scale) in loads.iter().zip(&mut found.displacements).zip(&mut sizes.products) {
            scale.iter_mut().zip(f).for_each(|(scale, f)| *scale += f.abs());
            let (error, residual) = self.refine(f, u, scale)?;
            backward_error = backward_error.max(error);
            if norm(f) > 0.0 {
                found.residual = found.residual.max(norm(&residual) / norm(f));
            }
            let Sizes { norm, longest_row, .. } = *sizes;
            Solved { norm, longest_row, backward_error: error, residual: &residual, scale, solution: u }
                .raise(&mut errors);
        }
        let mut inverse = Inverse::default();
        let mut solve = |b: &[f64], x: &mut [f64]| self.solve(b, x, ROUGHLY);
        let estimates = inverse
            .norm(n, &mut solve)
            .and_then(|size| Ok((sizes.norm * size, inverse.weighted(&errors, &mut solve)?)));
        found.accuracy = match estimates {
            Ok((condition, forward_error)) => Accuracy { backward_error, condition, forward_error },
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            // a system that cannot be solved to one digit has no condition number to speak of
            Err(_) => Accuracy { backward_error, condition: f64::INFINITY, forward_error: f64::INFINITY },
        };
        Ok(())
    }

    /// Refines one answer; its componentwise backward error and its residual.
    fn refine(&mut self, f: &[f64], u: &mut Vec<f64>, scale: &[f64]) -> Result<(f64, Vec<f64>)> {
        let mut residual = self.residual(f, u);
        let mut error = worst_ratio(&residual, scale);
        for _ in 0..REFINEMENTS {
            if error <= REFINE_ABOVE {
                break;
            }
            let mut refined = vec![0.0; u.len()];
            match self.solve(&residual, &mut refined, (0.5 * REFINE_ABOVE / error).clamp(REFINED[0], REFINED[1])) {
                Ok(()) => add(1.0, u, &mut refined),
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                Err(_) => break,
            }
            let rest = self.residual(f, &refined);
            let better = worst_ratio(&rest, scale);
            if better >= error {
                break;
            }
            (*u, residual, error) = (refined, rest, better);
        }
        Ok((error, residual))
    }

    /// f - K u.
    fn residual(&mut self, f: &[f64], u: &[f64]) -> Vec<f64> {
        let (mut residual, mut product) = (f.to_vec(), vec![0.0; f.len()]);
        self.operator.apply(u, &mut product, self.space);
        add(-1.0, &product, &mut residual);
        residual
    }

    /// Writes K^-1 b in place of zeros.
    fn solve(&mut self, b: &[f64], x: &mut [f64], tolerance: f64) -> Result<()> {
        let outcome = cg::solve(
            &mut |x, y| self.operator.apply(x, y, self.space),
            &mut |r, z| self.preconditioner.apply(r, z, self.inner),
            b,
            x,
            tolerance,
            self.limit,
            self.iteration,
        );
        self.iteration.check()?;
        match outcome.reached(tolerance) {
            true => Ok(()),
            false => Err(Error::Inaccurate { backward_error: outcome.residual, limit: tolerance }),
        }
    }
}
