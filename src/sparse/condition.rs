//! How much a solve amplifies errors: estimates of |A^-1| from a few solves.
//!
//! For a symmetric A and weights g >= 0 the norm
//!
//! ```text
//! | A^-1 diag(g) |_inf = | diag(g) A^-1 |_1 = max over x with |x|_1 = 1 of | g * (A^-1 x) |_1
//! ```
//!
//! is a convex function on the vectors of length 1, so its maximum is at a unit vector. W. W. Hager (SIAM J. Sci. Stat.
//! Comput. 5, 1984) climbs from one to the next along the gradient A^-1 (g * s), s the signs of A^-1 x; its largest
//! entry is a lower bound too, and says which unit vector is next. The climb begins with the signs of a unit vector
//! that an earlier one for the same A ended at, or with + everywhere, and ends when a step promises, or brings, less
//! than half as much again. N. J. Higham (ACM Trans. Math. Softw. 14, 1988) adds a vector of alternating signs that
//! unfortunate matrices do not deceive. A^-1 of it and of the last unit vector are kept for the next g ([`Inverse`]):
//! three or four solves for the first, one or two for every further one. The estimate is a lower bound, mostly within a
//! factor of three, seldom of ten. With it
//!
//! ```text
//! kappa = |A|_1 |A^-1|_1                                                        (g = 1)
//! |x - x_exact|_inf / |x|_inf  <=  | A^-1 diag(g) |_inf / |x|_inf,      g = |r| + m u (|A| |x| + |b|)
//! ```
//!
//! where r = b - A x as computed, u = 2^-53 and m the longest row of A plus one, so that g also covers the rounding of r
//! (E. Anderson et al., LAPACK Users' Guide, section 4.4). The second bound does not depend on how rows are scaled and may
//! be small where kappa is huge.

use crate::error::Result;

/// Half the distance from 1 to the next number.
pub const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Steps from one unit vector to the next.
const STEPS: usize = 5;

/// A step that promises or brings less than this factor is the last.
const GAIN: f64 = 1.5;

/// A relative forward error above this is more than the digits of a result promise.
pub const STATED: f64 = 1e-6;

/// How sure a solution is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Componentwise backward error, see [`super::backward_error`].
    pub backward_error: f64,
    /// Estimate of kappa = |A|_1 |A^-1|_1.
    pub condition: f64,
    /// Estimated bound of |x - x_exact|_inf / |x|_inf.
    pub forward_error: f64,
}

impl Accuracy {
    /// The larger of each; what is not a number counts as the largest.
    pub fn worse(self, other: Self) -> Self {
        let larger = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::INFINITY } else { a.max(b) };
        Self {
            backward_error: larger(self.backward_error, other.backward_error),
            condition: larger(self.condition, other.condition),
            forward_error: larger(self.forward_error, other.forward_error),
        }
    }

    /// A word where the forward error may be larger than the digits promise; `what` names the solve.
    pub fn warning(&self, what: &str) -> Option<String> {
        // written so that a bound that is not a number warns
        if self.forward_error <= STATED {
            return None;
        }
        let Self { condition, forward_error, backward_error } = self;
        Some(format!(
            "{what}: displacements may be off by {forward_error:.0e} of the largest (condition number about \
             {condition:.0e}, backward error {backward_error:.0e}): more than the {STATED:.0e} that results promise"
        ))
    }
}

/// Writes A^-1 b into its second argument.
pub type Solve<'a> = dyn FnMut(&[f64], &mut [f64]) -> Result<()> + 'a;

/// What the bounds need to know about a matrix, a right-hand side and its solution.
pub struct Solved<'a> {
    /// |A|_1, the largest sum of the sizes in a column.
    pub norm: f64,
    /// Entries of the longest row.
    pub longest_row: usize,
    /// Componentwise backward error.
    pub backward_error: f64,
    /// b - A x.
    pub residual: &'a [f64],
    /// |A| |x| + |b|.
    pub scale: &'a [f64],
    /// x.
    pub solution: &'a [f64],
}

impl Solved<'_> {
    /// g, the error of every equation.
    fn errors(&self) -> impl Iterator<Item = f64> {
        let rounding = (self.longest_row + 1) as f64 * UNIT_ROUNDOFF;
        self.residual.iter().zip(self.scale).map(move |(r, s)| r.abs() + rounding * s)
    }

    /// |x|_inf
    fn largest(&self) -> f64 {
        self.solution.iter().fold(0.0_f64, |most, x| most.max(x.abs()))
    }

    /// Raises `errors` to g / |x|_inf where that is more: with the largest of several right-hand sides, one norm bounds the
    /// forward errors of all.
    pub fn raise(&self, errors: &mut [f64]) {
        let largest = self.largest();
        if largest > 0.0 {
            errors.iter_mut().zip(self.errors()).for_each(|(most, g)| *most = most.max(g / largest));
        }
    }
}

/// Estimates both bounds; `solve(b, x)` writes A^-1 b, to one digit at least. `inverse` serves all right-hand sides of one A.
///
/// # Errors
/// Those of `solve`.
pub fn accuracy(solved: &Solved, inverse: &mut Inverse, solve: &mut Solve) -> Result<Accuracy> {
    let condition = solved.norm * inverse.norm(solved.solution.len(), solve)?;
    let largest = solved.largest();
    let weights: Vec<f64> = solved.errors().collect();
    let forward_error = if largest > 0.0 { inverse.weighted(&weights, solve)? / largest } else { 0.0 };
    Ok(Accuracy { backward_error: solved.backward_error, condition, forward_error })
}

/// Estimates of |A^-1 diag(g)|_inf for a symmetric A and one g after another.
#[derive(Debug, Clone, Default)]
pub struct Inverse {
    /// |A^-1|_1
    norm: Option<f64>,
    /// The unit vector that a climb was at last, and A^-1 times it.
    unit: Option<(usize, Vec<f64>)>,
    /// A^-1 times the vector of alternating signs.
    alternating: Option<Vec<f64>>,
}

impl Inverse {
    /// Estimates |A^-1|_1 of n unknowns, once.
    ///
    /// # Errors
    /// Those of `solve`.
    pub fn norm(&mut self, n: usize, solve: &mut Solve) -> Result<f64> {
        if let Some(known) = self.norm {
            return Ok(known);
        }
        let norm = self.weighted(&vec![1.0; n], solve)?;
        self.norm = Some(norm);
        Ok(norm)
    }

    /// Estimates |A^-1 diag(g)|_inf for the weights g; `solve(b, x)` writes A^-1 b.
    ///
    /// # Errors
    /// Those of `solve`.
    pub fn weighted(&mut self, weights: &[f64], solve: &mut Solve) -> Result<f64> {
        let n = weights.len();
        if n == 0 {
            return Ok(0.0);
        }
        let length = |y: &[f64]| y.iter().zip(weights).map(|(y, g)| (g * y).abs()).sum::<f64>();
        let mut here = self.unit.as_ref().map_or(0.0, |(_, y)| length(y));
        let mut best = here;
        for _ in 0..STEPS {
            let (top, promised) = self.gradient(weights, solve)?;
            best = best.max(promised);
            if promised <= GAIN * here {
                break;
            }
            here = length(self.at_unit(top, n, solve)?);
            best = best.max(here);
            // signs that bring no more than those before are nearly the same, and so is the next gradient
            if here <= GAIN * promised {
                break;
            }
        }
        let norm = length(self.at_alternating(n, solve)?);
        Ok(best.max(2.0 * norm / (3.0 * n as f64)))
    }

    /// The largest entry of A^-1 (g * s) and its size, with the signs s of A^-1 times the unit vector.
    fn gradient(&self, weights: &[f64], solve: &mut Solve) -> Result<(usize, f64)> {
        let signs = match &self.unit {
            Some((_, y)) => y.iter().zip(weights).map(|(y, g)| g.copysign(*y)).collect(),
            None => weights.to_vec(),
        };
        let mut z = vec![0.0; weights.len()];
        solve(&signs, &mut z)?;
        Ok(z.iter().enumerate().fold((0, 0.0_f64), |most, (i, z)| if z.abs() > most.1 { (i, z.abs()) } else { most }))
    }

    /// A^-1 times a unit vector.
    fn at_unit(&mut self, unknown: usize, n: usize, solve: &mut Solve) -> Result<&[f64]> {
        let kept = match self.unit.take() {
            Some(kept) if kept.0 == unknown => kept,
            _ => {
                let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
                x[unknown] = 1.0;
                solve(&x, &mut y)?;
                (unknown, y)
            }
        };
        Ok(&self.unit.insert(kept).1)
    }

    /// A^-1 times alternating signs that grow from 1 to 2.
    fn at_alternating(&mut self, n: usize, solve: &mut Solve) -> Result<&[f64]> {
        let kept = match self.alternating.take() {
            Some(kept) => kept,
            None => {
                let ramp = |i: usize| 1.0 + i as f64 / (n.max(2) - 1) as f64;
                let x: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { ramp(i) } else { -ramp(i) }).collect();
                let mut y = vec![0.0; n];
                solve(&x, &mut y)?;
                y
            }
        };
        Ok(self.alternating.insert(kept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra_sparse::na::{DMatrix, DVector};

    /// A = Q diag(spread) Q^T with a fixed Q.
    fn matrix(n: usize, spread: f64) -> DMatrix<f64> {
        let q = DMatrix::from_fn(n, n, |i, j| ((i * 7 + j * 13 + i * j) % 17) as f64 - 8.0).qr().q();
        let sizes = DVector::from_fn(n, |i, _| spread.powf(-(i as f64) / (n - 1) as f64));
        &q * DMatrix::from_diagonal(&sizes) * q.transpose()
    }

    #[test]
    fn the_estimate_is_the_norm_of_the_inverse_within_a_factor_of_ten() {
        for (n, spread) in [(1, 1.0), (2, 1e3), (12, 1e2), (40, 1e6)] {
            let a = if n == 1 { DMatrix::identity(1, 1) } else { matrix(n, spread) };
            let inverse = a.clone().try_inverse().unwrap();
            let mut known = Inverse::default();
            for weights in [vec![1.0; n], (0..n).map(|i| 10.0_f64.powi(-(i as i32 % 9))).collect()] {
                let exact = (0..n)
                    .map(|i| (0..n).map(|j| (inverse[(i, j)] * weights[j]).abs()).sum::<f64>())
                    .fold(0.0, f64::max);
                let estimate = known
                    .weighted(&weights, &mut |b, x| {
                        x.copy_from_slice((&inverse * DVector::from_column_slice(b)).as_slice());
                        Ok(())
                    })
                    .unwrap();
                assert!(estimate <= exact * (1.0 + 1e-12) && 10.0 * estimate >= exact, "{n}: {estimate} {exact}");
            }
        }
    }

    #[test]
    fn a_bound_above_the_stated_digits_warns_and_so_does_one_that_is_not_a_number() {
        let sure = Accuracy { backward_error: 1e-16, condition: 1e4, forward_error: 1e-11 };
        assert_eq!(sure.warning("reference"), None);
        for forward_error in [1e-3, f64::INFINITY, f64::NAN] {
            let warning = Accuracy { forward_error, condition: 1e13, ..sure }.warning("reference").unwrap();
            assert!(warning.contains("reference") && warning.contains("1e13"), "{warning}");
        }
    }
}
