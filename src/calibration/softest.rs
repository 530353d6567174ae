//! The motion that a network resists least, beside the continuum: how near it is to a mechanism.
//!
//! A fit on few loads may take springs away that no fitted load needs, and open the network for others. Every load
//! case asks how far the network moves for how far the continuum moves; the worst answer over *all* loads is the largest
//! eigenvalue of
//!
//! ```text
//! K_ref x = mu K(phi) x,        mu = max over x of (x . K_ref x) / (x . K(phi) x)
//! ```
//!
//! the *compliance ratio*: under the forces K_ref x that move the continuum by x, the network moves by mu x. 1 for a
//! network that is right everywhere; infinite for a mechanism. 1 / mu is the smallest eigenvalue of K(phi) relative to that of
//! the reference on the same nodes.
//!
//! It is found by the power method on K(phi)^-1 K_ref from a fixed random start: one product with the continuum and one
//! solve with the springs a round. The quotient grows from round to round towards mu, so that what is reported is reached by
//! a motion that is at hand. Near a mechanism mu stands far above the rest, and a few rounds are enough.

use crate::error::Result;
use crate::rng::Stream;
use crate::sparse::vectors::{dot, norm, scale};
use crate::springs::solver::SpringSolver;

/// Most rounds, and the relative gain of a round below which the quotient has settled.
const ROUNDS: usize = 30;
const SETTLED: f64 = 1e-3;

/// Relative residual that a solve needs.
const TOLERANCE: f64 = 1e-6;

/// The motion that a network resists least.
#[derive(Debug, Clone, PartialEq)]
pub struct Softest {
    /// mu.
    pub ratio: f64,
    /// x over the free degrees of freedom, norm 1.
    pub motion: Vec<f64>,
    /// Solves that were needed.
    pub solves: usize,
}

/// Finds it. `solver` holds K(phi); `continuum` writes K_ref x into its second argument, both over the free degrees of
/// freedom, N/m.
///
/// # Errors
/// Where a solve is not accurate; those of `continuum`.
pub fn softest(solver: &mut SpringSolver, continuum: &dyn Fn(&[f64], &mut [f64]) -> Result<()>) -> Result<Softest> {
    let n = solver.unknowns();
    let mut stream = Stream::new(0, 0, 0);
    let mut motion: Vec<f64> = (0..n).map(|_| stream.normal()).collect();
    let (mut forces, mut next) = (vec![0.0; n], vec![0.0; n]);
    let (mut ratio, mut solves) = (0.0, 0);
    continuum(&motion, &mut forces)?;
    loop {
        next.fill(0.0);
        solver.solve(&forces, &mut next, TOLERANCE)?;
        solves += 1;
        // K next = forces: its resistance next . K next needs no product
        let (resistance, length) = (dot(&next, &forces), norm(&next));
        if resistance.is_nan() || resistance <= 0.0 {
            return Ok(Softest { ratio, motion, solves });
        }
        std::mem::swap(&mut motion, &mut next);
        scale(1.0 / length, &mut motion);
        continuum(&motion, &mut forces)?;
        let before = ratio;
        ratio = dot(&motion, &forces) * length * length / resistance;
        if ratio - before <= SETTLED * ratio || solves == ROUNDS {
            return Ok(Softest { ratio, motion, solves });
        }
    }
}
