//! How well the loads determine each stiffness: the standard deviation of ln phi from the Jacobian.
//!
//! With J_a = dr/d ln phi_a of the groups between their bounds and s^2 = |r|^2 / (rows - groups), the variance of what is left of the
//! residual, the covariance of ln phi is s^2 (J^T J)^-1 (linear regression; G. A. F. Seber and C. J. Wild, Nonlinear Regression,
//! 1989, section 2.1.2). .01 is a stiffness known to 1 %; 1 and more is one that another start, another mesh or a further load may change
//! by a factor of e. The residual of a network beside a continuum is no noise, so the number compares groups; it is no
//! probability.

use crate::calibration::optimisers::many;
use crate::dense::Complement;
use crate::error::Result;
use crate::sparse::vectors::norm;
use crate::springs::solver::SpringSolver;

use super::Given;

/// Part of the squared columns that is added: a deviation of 1e7 s / |J_a| reads as one without end.
const RIDGE: f64 = 1e-14;

/// Part of an upper bound from which a stiffness rests there.
const AT_BOUND: f64 = 1.0 - 1e-9;

/// Columns of J, cases times groups, that are solved for at most.
const MOST: usize = 1024;

/// Relative residual that is enough for a column on a path that iterates.
const COLUMN_TOLERANCE: f64 = 1e-6;

/// The standard deviation of ln phi of every group; none of one at a bound, of an objective without displacements, of many groups, or
/// where there are not more rows than groups. `solver` holds K(phi), `displacement` its answers to all load cases (cases x n, m).
///
/// # Errors
/// Where a solve is not accurate.
pub fn deviations(
    given: &Given,
    solver: &mut SpringSolver,
    (phi, upper): (&[f64], &[f64]),
    displacement: &[f64],
) -> Result<Vec<Option<f64>>> {
    let mut found = vec![None; phi.len()];
    let (n, fitted, cases) = (solver.unknowns(), given.fitted(), given.cases(true));
    let free: Vec<usize> = (0..phi.len()).filter(|&a| phi[a] > 0.0 && phi[a] < AT_BOUND * upper[a]).collect();
    let rows = n * fitted.len();
    let asked = given.scene.calibration.objective == "displacement" && !many::serves(phi.len());
    if !asked || rows <= free.len() || free.is_empty() || fitted.len() * free.len() > MOST {
        return Ok(found);
    }
    let (mut residual, mut columns) = (vec![0.0; rows], vec![0.0; rows * free.len()]);
    for (place, &case) in fitted.iter().enumerate() {
        let (u, w) = (&displacement[case * n..(case + 1) * n], cases.weights[place]);
        let reference = &cases.reference[place * n..(place + 1) * n];
        let of_case = &mut residual[place * n..(place + 1) * n];
        of_case.iter_mut().zip(u).zip(reference).for_each(|((r, u), reference)| *r = w * (u - reference));
        let mut pulls = vec![0.0; n * free.len()];
        for (pull, &a) in pulls.chunks_exact_mut(n).zip(&free) {
            solver.apply(a, u, pull);
            pull.iter_mut().for_each(|entry| *entry *= w * phi[a]);
        }
        let mut answers = vec![0.0; pulls.len()];
        solver.solve(&pulls, &mut answers, COLUMN_TOLERANCE)?;
        for (column, answer) in columns.chunks_exact_mut(rows).zip(answers.chunks_exact(n)) {
            column[place * n..(place + 1) * n].copy_from_slice(answer);
        }
    }
    let deviation = norm(&residual) / ((rows - free.len()) as f64).sqrt();
    let Some(complement) = Complement::new(&columns, rows, free.len(), RIDGE) else { return Ok(found) };
    let inverse = complement.inverse();
    for (i, &a) in free.iter().enumerate() {
        found[a] = Some(deviation * inverse[i * free.len() + i].max(0.0).sqrt());
    }
    Ok(found)
}
