//! One row for each path of solution on a hard problem.

use std::sync::Arc;

use crate::calibration::objective::Objective;
use crate::calibration::objectives::displacement::Target;
use crate::calibration::surrogate::certificate::Certificate;
use crate::calibration::surrogate::galerkin::Galerkin;
use crate::calibration::surrogate::walker::Walker;
use crate::clock::Stopwatch;
use crate::error::{Error, Result};
use crate::reference::loads::Load;
use crate::reference::{self, Reference, stiffness};
use crate::sparse::backward_error::{self, Lower};
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::condition::Accuracy;
use crate::springs::solver::{GridSprings, Path, Settings, SpringOperator, SpringSolver};

use super::double;
use super::problems::{Hard, Problem};
use super::{Answer, Row};

/// The componentwise backward error that factors promise.
pub const PROMISE: f64 = 1e-15;

/// |f - K u| / |f| that conjugate gradients are asked for.
const TOLERANCE: f64 = 1e-10;

/// How far phi moves for the stale factor, and to make the basis of the surrogate.
const STEP: f64 = 0.01;

/// A linear system and its answer with twice the digits.
struct Truth {
    symbolic: Arc<Symbolic>,
    values: Vec<f64>,
    forces: Vec<f64>,
    answer: Option<Vec<f64>>,
}

impl Truth {
    fn new(symbolic: &Arc<Symbolic>, values: Vec<f64>, forces: &[f64]) -> Self {
        let lower = Lower { starts: symbolic.lower_starts(), rows: symbolic.lower_rows(), values: &values };
        let right: Vec<f64> = symbolic.order().iter().map(|&i| forces[i as usize]).collect();
        let answer = double::solve(lower, &right).map(|permuted| {
            let mut answer = vec![0.0; permuted.len()];
            symbolic.order().iter().zip(permuted).for_each(|(&i, x)| answer[i as usize] = x);
            answer
        });
        Self { symbolic: Arc::clone(symbolic), values, forces: forces.to_vec(), answer }
    }

    /// Componentwise backward error of u.
    fn backward_error(&self, u: &[f64]) -> f64 {
        let symbolic = &self.symbolic;
        let permute = |v: &[f64]| -> Vec<f64> { symbolic.order().iter().map(|&i| v[i as usize]).collect() };
        let lower = Lower { starts: symbolic.lower_starts(), rows: symbolic.lower_rows(), values: &self.values };
        let (mut residual, mut scale) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        backward_error::residual(lower, &permute(u), &permute(&self.forces), &mut residual, &mut scale)
    }

    /// |u - u_exact|_inf / |u_exact|_inf.
    fn forward_error(&self, u: &[f64]) -> Option<f64> {
        let exact = self.answer.as_ref()?;
        let largest = exact.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        Some(exact.iter().zip(u).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / largest)
    }

    fn answer(&self, u: &[f64], accuracy: Option<Accuracy>) -> Answer {
        Answer {
            backward_error: self.backward_error(u),
            forward_error: self.forward_error(u),
            estimated: accuracy.map(|sure| sure.forward_error),
            condition: accuracy.map(|sure| sure.condition),
        }
    }
}

/// A phi about 1 % away; groups move in turn, so that it is no multiple of this one.
fn moved(phi: &[f64], side: f64) -> Vec<f64> {
    let shift = |(a, phi): (usize, &f64)| phi * (1.0 + side * STEP * if a % 2 == 0 { 1.0 } else { -0.5 });
    phi.iter().enumerate().map(shift).collect()
}

/// The row of a path that refused.
pub fn refused(hard: &Hard, path: &'static str, unknowns: usize, words: String, seconds: f64) -> Row {
    Row { case: hard.name.clone(), path, unknowns, answer: None, words, kept: true, seconds }
}

/// All paths of the springs.
///
/// # Errors
/// None that a path can say in words.
pub fn springs(hard: &Hard, problem: &Problem) -> Result<Vec<Row>> {
    let (stiffness, symbolic) = problem.assembled();
    let mut values = vec![0.0; symbolic.lower_rows().len()];
    stiffness.assemble_into(&problem.phi, &mut values);
    let truth = Truth::new(symbolic, values, &problem.forces);
    let mut rows = vec![direct(hard, "direct", &truth)];
    rows.push(iterated(hard, "single", problem, &problem.operator, Path::Single, &truth));
    rows.push(iterated(hard, "stale", problem, &problem.operator, Path::Stale, &truth));
    rows.push(multigrid(hard, problem, &truth));
    let condition = rows[0].answer.and_then(|answer| answer.condition).unwrap_or(f64::INFINITY);
    rows.push(surrogate(hard, problem, &truth, condition));
    Ok(rows)
}

/// A factor in f64: its answer, and its estimates.
fn direct(hard: &Hard, path: &'static str, truth: &Truth) -> Row {
    let watch = Stopwatch::start();
    let mut factor = Factor::new(Arc::clone(&truth.symbolic));
    factor.values_mut().copy_from_slice(&truth.values);
    let mut u = vec![0.0; truth.forces.len()];
    let outcome = factor.refactor().and_then(|()| factor.solve(&truth.forces, &mut u));
    let seconds = watch.seconds();
    match outcome {
        Err(error) => refused(hard, path, u.len(), error.to_string(), seconds),
        Ok(_) => {
            let accuracy = factor.accuracy(&truth.forces, &u);
            let answer = truth.answer(&u, Some(accuracy));
            let words = accuracy.warning("it warns").unwrap_or_else(|| format!("backward error <= {PROMISE:.0e}"));
            let kept = answer.backward_error <= PROMISE;
            Row { case: hard.name.clone(), path, unknowns: u.len(), answer: Some(answer), words, kept, seconds }
        }
    }
}

/// A path of the solver of the springs that iterates; the stale one has met a phi 1 % away before.
fn iterated(
    hard: &Hard,
    name: &'static str,
    problem: &Problem,
    operator: &SpringOperator,
    path: Path,
    truth: &Truth,
) -> Row {
    let n = problem.forces.len();
    let mut solver = SpringSolver::new(operator, &Settings { path, tolerance: TOLERANCE });
    let mut u = vec![0.0; n];
    if path == Path::Stale {
        let near = moved(&problem.phi, 1.0);
        if solver.set(&near).and_then(|()| solver.solve(&problem.forces, &mut u, TOLERANCE)).is_err() {
            u.fill(0.0);
        }
    }
    let before = solver.work();
    let watch = Stopwatch::start();
    let outcome = solver.set(&problem.phi).and_then(|()| solver.solve(&problem.forces, &mut u, TOLERANCE));
    let (seconds, work) = (watch.seconds(), solver.work());
    if let Err(error) = outcome {
        return refused(hard, name, n, error.to_string(), seconds);
    }
    let found = operator.members().residual(&problem.phi, &problem.forces, &u);
    let (rest, force) = (length(&found.residual), length(&problem.forces));
    let residual = rest / force;
    let normwise = rest / (found.norm * length(&u) + force);
    // what the solver of the springs does with an answer that it hands out
    let sure = (path == Path::Multigrid)
        .then(|| solver.accuracy(&operator.members(), &problem.phi, &problem.forces, &u).expect("nobody interrupts"));
    let answer = truth.answer(&u, sure);
    let iterations = work.iterations - before.iterations;
    let mut words = match () {
        () if work.fallbacks > 0 && iterations == 0 => "f32 failed, double precision took over".to_owned(),
        () if residual > 1.01 * TOLERANCE => {
            format!("residual {residual:.1e} at the limit of rounding: normwise backward error {normwise:.1e}")
        }
        () => format!("residual {residual:.1e}, asked {TOLERANCE:.0e}, {iterations} iterations"),
    };
    if let Some(warning) = sure.and_then(|sure| sure.warning("; it warns")) {
        words += &warning;
    }
    let kept = residual <= 1.01 * TOLERANCE || answer.backward_error <= PROMISE || normwise <= PROMISE;
    Row { case: hard.name.clone(), path: name, unknowns: n, answer: Some(answer), words, kept, seconds }
}

fn length(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn multigrid(hard: &Hard, problem: &Problem, truth: &Truth) -> Row {
    let (body, lattice) = (&problem.body, &problem.lattice);
    let unknowns = problem.forces.len();
    let Some(grid) = body.grid() else {
        return refused(hard, "multigrid", unknowns, "does not fit: no grid".into(), 0.0);
    };
    let springs = GridSprings {
        network: &lattice.network,
        grid,
        dofs: &body.dofs,
        grouping: problem.grouping.clone(),
        coefficients: &lattice.coefficients,
    };
    match springs.worker() {
        Err(refusal) => refused(hard, "multigrid", unknowns, format!("does not fit: {refusal}"), 0.0),
        Ok(_) => {
            let operator = SpringOperator::OnGrid(springs);
            iterated(hard, "multigrid", problem, &operator, Path::Multigrid, truth)
        }
    }
}

/// A basis of the answers at a phi 1 % to both sides, asked for the phi between them.
fn surrogate(hard: &Hard, problem: &Problem, truth: &Truth, condition: f64) -> Row {
    let n = problem.forces.len();
    let outcome = || -> Result<(Vec<f64>, f64, f64)> {
        let target = Target {
            operator: &problem.operator,
            upper: &problem.phi,
            forces: &problem.forces,
            reference: &problem.forces,
            weights: &[1.0],
        };
        let mut basis = Galerkin::new(target);
        let mut solver = SpringSolver::new(&problem.operator, &Settings::DIRECT);
        for side in [-1.0, 1.0] {
            let near = moved(&problem.phi, side);
            let mut u = vec![0.0; n];
            solver.set(&near)?;
            solver.solve(&problem.forces, &mut u, TOLERANCE)?;
            basis.enrich(&u);
        }
        let mut certificate = Certificate::new(target, &problem.phi)?;
        certificate.extend(&basis);
        let watch = Stopwatch::start();
        let mut walker = Walker::new(&basis, None);
        walker.error(&problem.phi)?;
        let mut workspace = Walker::bound_workspace(&certificate);
        let bound = walker.bound(&certificate, &mut workspace).energy;
        let seconds = watch.seconds();
        Ok((walker.displacement(), bound, seconds))
    };
    match outcome() {
        Err(error) => refused(hard, "surrogate", n, error.to_string(), 0.0),
        Ok((u, bound, seconds)) => {
            let size = truth.answer.as_ref().map_or(0.0, |exact| energy(problem, exact));
            let error = energy_of_the_error(problem, truth, &u);
            let words = format!("energy error {error:.1e}, certified {bound:.1e}, of {size:.1e}");
            let answer = Some(truth.answer(&u, None));
            // the certificate is computed with a factor, whose rounding is that of every solve
            let kept = error <= bound * (1.0 + 1e-6) + condition * f64::EPSILON * size;
            Row { case: hard.name.clone(), path: "surrogate", unknowns: n, answer, words, kept, seconds }
        }
    }
}

/// |u - u_exact| in the energy norm of K(phi), sqrt(N m).
fn energy_of_the_error(problem: &Problem, truth: &Truth, u: &[f64]) -> f64 {
    let Some(exact) = &truth.answer else { return 0.0 };
    let error: Vec<f64> = u.iter().zip(exact).map(|(a, b)| a - b).collect();
    energy(problem, &error)
}

/// sqrt(u K u): a sum of squares over the springs.
fn energy(problem: &Problem, u: &[f64]) -> f64 {
    let members = problem.operator.members();
    let mut elongations = vec![0.0; members.len()];
    members.elongations(u, &mut elongations);
    let group = |a: usize| elongations[members.group(a)].iter().map(|e| e * e).sum::<f64>();
    (0..problem.phi.len()).map(|a| problem.phi[a] * group(a)).sum::<f64>().sqrt()
}

/// The paths of the continuum: a factor, and conjugate gradients preconditioned by fast diagonalisation.
///
/// # Errors
/// A body that cannot be integrated.
pub fn continuum(hard: &Hard, problem: &Problem) -> Result<Vec<Row>> {
    let body = &problem.body;
    let points = body.integration_points()?;
    let pattern = stiffness::pattern(&points, &body.dofs);
    let matrix = stiffness::stiffness(&points, body.lame, &body.dofs, &pattern)?;
    let symbolic = Symbolic::analyse(&pattern, body.reference_order(&points)?)?;
    let truth = Truth::new(&symbolic, symbolic.lower_of(&matrix), &problem.forces);
    let mut rows = vec![direct(hard, "continuum direct", &truth)];
    let load = Load { forces: problem.forces.clone(), ..Load::default() };
    let watch = Stopwatch::start();
    let outcome = Reference::iterative(&points, body.lame, &body.dofs, &[load]);
    let (seconds, name, n) = (watch.seconds(), "fast diagonalisation", problem.forces.len());
    rows.push(match outcome {
        Ok(Some(found)) => {
            let u = &found.cases[0].displacement;
            let (iterations, residual) = match &found.path {
                reference::Path::Iterative { iterations, residual } => (iterations[0], *residual),
                reference::Path::Direct { .. } => (0, 0.0),
            };
            let answer = truth.answer(u, Some(found.accuracy));
            let mut words = format!("residual {residual:.1e}, {iterations} iterations");
            if let Some(warning) = found.accuracy.warning("; it warns") {
                words += &warning;
            }
            let kept = residual <= reference::TOLERANCE || answer.backward_error <= PROMISE;
            Row { case: hard.name.clone(), path: name, unknowns: n, answer: Some(answer), words, kept, seconds }
        }
        Ok(None) => refused(hard, name, n, "did not converge: the continuum is factored instead".into(), seconds),
        Err(error @ Error::FoldedElement { .. }) => return Err(error),
        Err(error) => refused(hard, name, n, error.to_string(), seconds),
    });
    Ok(rows)
}
