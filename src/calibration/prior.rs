//! What is believed about the stiffness before any load is looked at: neighbours in a group do not differ by decades.
//!
//! With as many groups as springs, or more than the fitted loads can tell apart, the data leave directions of phi free:
//! whatever value a spring takes there, the fit is as good, and the next load pays for it. A prior decides them. Every
//! group is drawn towards the common value of all,
//!
//! ```text
//! minimise  e(phi)^2 + rho^2 sum_a v_a (ln phi_a - y)^2,      y = sum_b v_b ln phi_b,      v_a = springs of a / springs
//! ```
//!
//! (A. N. Tikhonov). y itself is free, so that the prior does not change when all stiffnesses are multiplied by a number. Through a
//! profile ([`crate::springs::profiles`]) the common value is one number phi and not one stiffness k. rho is in percent: a
//! network whose springs differ from their common value by a factor of e (2.7) in the root mean square costs as much as
//! an error of rho. In the logarithm no spring comes to rest at zero, which keeps mechanisms away.
//!
//! Where springs may rest at zero, ln phi gives place to arsinh(phi / c): the same above c, finite below.

use crate::calibration::objective::{Counts, Objective};
use crate::error::Result;
use crate::springs::grouping::Grouping;

/// The prior of one grouping.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// rho, percent.
    strength: f64,
    /// v_a.
    shares: Vec<f64>,
    /// c; 0 for the logarithm.
    linear_below: f64,
}

impl Prior {
    /// The prior of strength rho (percent) on the groups of a grouping.
    pub fn new(strength: f64, grouping: &Grouping) -> Self {
        let springs: Vec<usize> = grouping.groups.iter().map(|group| group.springs).collect();
        Self::of_sizes(strength, 0.0, &springs)
    }

    /// The prior on groups of so many springs, with arsinh(phi / c) for c > 0 in the place of ln phi.
    pub fn of_sizes(strength: f64, linear_below: f64, springs: &[usize]) -> Self {
        let all = springs.iter().sum::<usize>().max(1) as f64;
        Self { strength, shares: springs.iter().map(|&springs| springs as f64 / all).collect(), linear_below }
    }

    /// rho, percent.
    pub fn strength(&self) -> f64 {
        self.strength
    }

    /// v_a of every group; their sum is 1.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// The rows rho sqrt(v_a) (ln phi_a - y), one a group, percent; infinite where a group has no stiffness and c is 0.
    pub fn rows(&self, phi: &[f64]) -> Vec<f64> {
        let c = self.linear_below;
        if c == 0.0 && phi.iter().any(|phi| *phi <= 0.0) {
            return vec![f64::INFINITY; phi.len()];
        }
        let x: Vec<f64> = phi.iter().map(|phi| if c > 0.0 { (phi / c).asinh() } else { phi.ln() }).collect();
        let mean: f64 = x.iter().zip(&self.shares).map(|(x, share)| share * x).sum();
        x.iter().zip(&self.shares).map(|(x, share)| self.strength * share.sqrt() * (x - mean)).collect()
    }

    /// Puts the rows below those of a residual, and their derivatives by phi below its Jacobian (rows x m, column-major).
    pub fn append(&self, phi: &[f64], residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) {
        let (above, groups) = (residual.len(), phi.len());
        let rows = above + groups;
        residual.extend(self.rows(phi));
        let mut all = vec![0.0; rows * groups];
        for (b, column) in all.chunks_exact_mut(rows).enumerate() {
            column[..above].copy_from_slice(&jacobian[b * above..(b + 1) * above]);
            for (a, entry) in column[above..].iter_mut().enumerate() {
                let own = if a == b { 1.0 } else { 0.0 };
                let slope = (own - self.shares[b]) / phi[b].hypot(self.linear_below);
                *entry = self.strength * self.shares[a].sqrt() * slope;
            }
        }
        *jacobian = all;
    }

    /// The error with the prior, percent.
    pub fn with(&self, error: f64, phi: &[f64]) -> f64 {
        (error * error + self.rows(phi).iter().map(|row| row * row).sum::<f64>()).sqrt()
    }
}

/// An objective with a prior: its rows stand below those of the residual.
pub struct Regularised<'a, O> {
    objective: O,
    prior: &'a Prior,
    /// The last phi.
    phi: Vec<f64>,
}

impl<'a, O: Objective> Regularised<'a, O> {
    /// Adds the prior to an objective.
    pub fn new(objective: O, prior: &'a Prior) -> Self {
        Self { objective, prior, phi: Vec::new() }
    }
}

impl<O: Objective> Objective for Regularised<'_, O> {
    fn error(&mut self, phi: &[f64]) -> Result<f64> {
        self.phi = phi.to_vec();
        self.objective.error(phi).map(|error| self.prior.with(error, phi))
    }

    fn fit_scale(&mut self, phi: &mut [f64]) -> f64 {
        let error = self.objective.fit_scale(phi);
        self.phi.copy_from_slice(phi);
        self.prior.with(error, phi)
    }

    fn linearise(&mut self, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) -> Result<()> {
        self.objective.linearise(residual, jacobian)?;
        self.prior.append(&self.phi, residual, jacobian);
        Ok(())
    }

    fn counts(&self) -> Counts {
        self.objective.counts()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::springs::grouping::Group;

    /// An objective without data.
    struct Nothing;

    impl Objective for Nothing {
        fn error(&mut self, _phi: &[f64]) -> Result<f64> {
            Ok(0.0)
        }

        fn fit_scale(&mut self, _phi: &mut [f64]) -> f64 {
            0.0
        }

        fn linearise(&mut self, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) -> Result<()> {
            residual.clear();
            jacobian.clear();
            Ok(())
        }

        fn counts(&self) -> Counts {
            Counts::default()
        }
    }

    fn prior() -> Prior {
        let group = |springs| Group { name: String::new(), springs, length: 1.0 };
        let groups = [5, 2, 3].map(group).to_vec();
        Prior::new(2.0, &Grouping { group_of: vec![0, 0, 0, 0, 0, 1, 1, 2, 2, 2], groups })
    }

    #[test]
    fn a_common_value_costs_nothing_and_a_common_factor_changes_nothing() {
        let prior = prior();
        assert_eq!(prior.with(3.0, &[7.0; 3]), 3.0);
        let [phi, scaled] = [[1.0, 4.0, 0.2], [10.0, 40.0, 2.0]].map(|phi| prior.with(3.0, &phi));
        assert!((phi / scaled - 1.0).abs() < 1e-14 && phi > 3.0);
        assert_eq!(prior.with(3.0, &[1.0, 0.0, 1.0]), f64::INFINITY);
        // half of the springs a factor e stiffer: the root mean square from their mean is 1/2
        let e = 1.0_f64.exp();
        assert!((prior.with(0.0, &[e, 1.0, 1.0]) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_jacobian_of_the_rows_is_their_slope() {
        let prior = prior();
        let mut objective = Regularised::new(Nothing, &prior);
        let phi = [1.0, 4.0, 0.2];
        objective.error(&phi).expect("no data");
        let (mut residual, mut jacobian) = (vec![], vec![]);
        objective.linearise(&mut residual, &mut jacobian).expect("no data");
        assert_eq!(residual, prior.rows(&phi));
        for b in 0..3 {
            let step = 1e-6 * phi[b];
            let at = |by: f64| {
                let mut moved = phi;
                moved[b] += by;
                prior.rows(&moved)
            };
            let (ahead, behind) = (at(step), at(-step));
            for a in 0..3 {
                let slope = (ahead[a] - behind[a]) / (2.0 * step);
                assert!((jacobian[3 * b + a] - slope).abs() < 1e-8 * (1.0 + slope.abs()), "row {a}, group {b}");
            }
        }
    }
}
