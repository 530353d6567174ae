//! How many iterations an old factor needs, known before the first.
//!
//! Let a factor belong to the stiffnesses psi. K = sum_a phi_a K_a, and every K_a is positive semidefinite, so for all u
//!
//! ```text
//! min_a (phi_a / psi_a)  <=  u.K(phi)u / u.K(psi)u  <=  max_a (phi_a / psi_a),        c = max / min of these ratios,
//! ```
//!
//! and c bounds the condition number of K(psi)^-1 K(phi), whatever the mesh. Conjugate gradients lower an error of 1 to t in
//! at most ln(2 / t) / ln((sqrt c + 1) / (sqrt c - 1)) iterations: to 1e-10 in 5 after a step of 1 % in every group, in 8
//! after 10 %. A common factor of all stiffnesses costs nothing.
//!
//! The last displacements serve as the guess, scaled to the least error; by the inequality of Kantorovich their error is
//! at most (c - 1) / (c + 1) of the answer, c now between the phi of the guess and this one.
//!
//! What a factorisation costs in iterations is a constant of the pattern, so that what is done never depends on the clock.

use crate::sparse::cholesky::Symbolic;

/// Time of one operation of a factorisation over that of one stored number of L in an iteration, in either precision, where L is
/// larger than the caches.
const FACTOR_TO_SWEEP: f64 = 0.022;

/// What a factorisation costs in iterations where it is too small to run at full speed.
const LEAST: f64 = 9.0;

/// What a further column adds to an iteration, as a part of the first: L is read once for all.
const FURTHER_COLUMN: f64 = 0.25;

/// The largest factor by which an iteration with an f32 factor lowers the error.
const LARGEST_GAIN: f64 = 1e5;

/// What a factorisation costs in iterations of conjugate gradients with one right-hand side.
pub fn refactorisation_in_iterations(symbolic: &Symbolic) -> f64 {
    (FACTOR_TO_SWEEP * symbolic.factor_flops() / symbolic.factor_entries().max(1) as f64).max(LEAST)
}

/// What one iteration of `columns` right-hand sides together costs in iterations of one.
pub fn columns_in_iterations(columns: usize) -> f64 {
    1.0 + FURTHER_COLUMN * columns.saturating_sub(1) as f64
}

/// The ratio c = max / min of phi_a / psi_a over the groups: 1 for proportional stiffnesses, infinite when one of them is
/// zero in one only.
///
/// # Panics
/// When the slices have different lengths.
pub fn spread(phi: &[f64], psi: &[f64]) -> f64 {
    assert_eq!(phi.len(), psi.len(), "one number for every group");
    let ratios = phi.iter().zip(psi).filter(|(phi, psi)| **phi != 0.0 || **psi != 0.0).map(|(phi, psi)| phi / psi);
    // min and max would pass over what is not a number
    if ratios.clone().any(|ratio| !ratio.is_finite()) {
        return f64::INFINITY;
    }
    let (least, most) = ratios.fold((f64::INFINITY, 0.0_f64), |(least, most), r| (least.min(r), most.max(r)));
    match most / least {
        c if c >= 1.0 => c,
        // no group has a stiffness: nothing can be foretold
        _ => f64::INFINITY,
    }
}

/// The largest error of the displacements at psi as a guess for those at phi, a spread of `c` away, relative to these.
pub fn guess_error(c: f64) -> f64 {
    if c.is_finite() { (c - 1.0) / (c + 1.0) } else { 1.0 }
}

/// Most iterations that lower an error of `guess` to `tolerance`, both relative to the answer, with the factor of a matrix
/// that is a spread of `c` away.
pub fn iterations(c: f64, guess: f64, tolerance: f64) -> f64 {
    if c.is_infinite() {
        return f64::INFINITY;
    }
    let root = c.sqrt();
    let gain = ((root + 1.0) / (root - 1.0)).min(LARGEST_GAIN);
    ((2.0 * guess / tolerance).ln() / gain.ln()).max(0.0).ceil()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_one_and_ten_percent_need_five_and_eight_iterations() {
        let step = |s: f64| iterations(spread(&[1.0 + s, 2.0], &[1.0, 2.0 * (1.0 + s)]), 1.0, 1e-10);
        assert_eq!([step(0.01), step(0.1)], [5.0, 8.0]);
        assert_eq!(iterations(1.0, 1.0, 1e-10), 3.0);
        assert_eq!(iterations(1.0, 0.0, 1e-10), 0.0);
        assert_eq!(iterations(f64::INFINITY, 1.0, 1e-10), f64::INFINITY);
    }

    #[test]
    fn a_common_factor_is_no_step_and_a_lost_group_is_an_infinite_one() {
        assert!((spread(&[3.0, 6.0], &[1.0, 2.0]) - 1.0).abs() < 1e-15);
        assert_eq!(spread(&[3.0, 0.0], &[1.0, 0.0]), 1.0);
        for phi in [[1.0, 0.0], [1.0, f64::NAN], [1.0, f64::INFINITY], [0.0, 0.0]] {
            assert_eq!(spread(&phi, &[1.0, 2.0]), f64::INFINITY, "{phi:?}");
        }
        assert_eq!(spread(&[1.0, 2.0], &[1.0, 0.0]), f64::INFINITY);
    }
}
