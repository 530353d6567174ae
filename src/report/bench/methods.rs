//! The methods of `bench solve`: a name and a function each. A new one is one more line in [`METHODS`].
//!
//! The direct path meets the same phi in every round. The others depend on the phi before, so theirs moves: every group
//! goes up or down by 1 % from round to round, as in the last steps of a calibration. Their factorisation, if there is one, is part of
//! their solve. The stale path starts from the displacements of the round before, the others from zero.

use std::hint::black_box;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::geometry::grid::Grid;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::ordering::nested_dissection;
use crate::sparse::single::SingleFactor;
use crate::springs::affine;
use crate::springs::multigrid_solver::MultigridSolver;
use crate::springs::solver::{Path, Settings, SpringSolver};

use super::cube::Cube;
use super::solve::{Rounds, Row, Stages};

/// Largest |f - K u| / |f| that iterations are asked for.
const TOLERANCE: f64 = 1e-10;

/// Relative step of every group between two rounds.
const STEP: f64 = 0.01;

/// A way to solve K(phi) u = f.
pub struct Method {
    /// Name on the command line.
    pub name: &'static str,
    /// One line of help.
    pub doc: &'static str,
    /// Measures it; `None` where it does not fit the cube.
    pub measure: fn(&Cube, Rounds) -> Result<Option<Row>>,
}

/// All methods.
pub const METHODS: &[Method] = &[
    Method { name: "direct", doc: "f64 Cholesky, refactored at every phi", measure: direct },
    Method {
        name: "single",
        doc: "f32 Cholesky, refactored at every phi, and f64 conjugate gradients",
        measure: |cube, rounds| springs("single", Path::Single, cube, rounds),
    },
    Method {
        name: "stale",
        doc: "the last f32 Cholesky, and f64 conjugate gradients",
        measure: |cube, rounds| springs("stale", Path::Stale, cube, rounds),
    },
    Method { name: "multigrid", doc: "no matrix: f64 conjugate gradients and an f32 V-cycle", measure: multigrid },
];

/// The method of this name.
///
/// # Errors
/// [`Error::Input`] with the known names.
pub fn find(name: &str) -> Result<&'static Method> {
    METHODS.iter().find(|method| method.name == name).ok_or_else(|| {
        let known: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
        Error::input("--methods", format!("there is no method {name}"), format!("the methods are {}", known.join(", ")))
    })
}

/// phi of a round: every group 1 % up or down in turn.
fn stepped(cube: &Cube, round: usize) -> Vec<f64> {
    let step = |(group, phi): (usize, &f64)| if (group + round).is_multiple_of(2) { *phi } else { (1.0 + STEP) * phi };
    cube.phi.iter().enumerate().map(step).collect()
}

/// The direct path.
fn direct(cube: &Cube, rounds: Rounds) -> Result<Option<Row>> {
    let mut stages = Stages::default();
    let pattern = affine::pattern(&cube.lattice.network, &cube.body.dofs);
    let (stiffness, symbolic) = cube.assembled()?;
    let mut factor = Factor::new(Arc::clone(symbolic));
    let mut u = vec![0.0; cube.forces.len()];
    let (mut residual, mut backward_error) = (0.0_f64, 0.0_f64);
    for round in 0..=rounds.repeat {
        rounds.progress.check()?;
        stages.analyse.time(round, || {
            let order = nested_dissection([cube.size; 3], 1, [false; 3]);
            Symbolic::analyse(&pattern, cube.body.dofs.order(&order))
        })?;
        stages.update.time(round, || stiffness.assemble_into(black_box(&cube.phi), factor.values_mut()));
        stages.refactor.time(round, || factor.refactor())?;
        backward_error = backward_error.max(stages.solve.time(round, || factor.solve(&cube.forces, &mut u))?);
        residual = residual.max(cube.residual(&cube.phi, &u));
        rounds.progress.advance(1);
    }
    let row = stages.row("direct", cube);
    Ok(Some(Row {
        residual,
        backward_error: Some(backward_error),
        factor_bytes: symbolic.factor_bytes(),
        flop: symbolic.factor_flops(),
        gflops: symbolic.factor_flops() / row.refactor.processor.unwrap_or(row.refactor.least) / 1e9,
        ..row
    }))
}

/// The paths of the solver of the springs that iterate.
fn springs(name: &'static str, path: Path, cube: &Cube, rounds: Rounds) -> Result<Option<Row>> {
    let mut stages = Stages::default();
    let (_, symbolic) = cube.assembled()?;
    let mut solver = SpringSolver::new(cube.operator()?, &Settings { path, tolerance: TOLERANCE });
    let mut u = vec![0.0; cube.forces.len()];
    let (mut residual, mut iterations) = (0.0_f64, 0);
    for round in 0..=rounds.repeat {
        rounds.progress.check()?;
        let phi = stepped(cube, round);
        if path == Path::Single {
            u.fill(0.0);
        }
        let before = solver.work().iterations;
        stages.update.time(round, || solver.set(&phi))?;
        stages.refactor.time(round, || ());
        stages.solve.time(round, || solver.solve(&cube.forces, &mut u, TOLERANCE))?;
        iterations = (solver.work().iterations - before) as usize;
        residual = residual.max(cube.residual(&phi, &u));
        rounds.progress.advance(1);
    }
    let factor_bytes = SingleFactor::bytes(symbolic) + 8 * symbolic.lower_rows().len();
    Ok(Some(Row { residual, iterations: Some(iterations), factor_bytes, ..stages.row(name, cube) }))
}

/// Multigrid on the grid of the springs.
fn multigrid(cube: &Cube, rounds: Rounds) -> Result<Option<Row>> {
    let (grid, lattice) = (Grid::new(&[cube.size; 3]), &cube.lattice);
    let mut stages = Stages::default();
    let make = || MultigridSolver::new(&lattice.network, &grid, &cube.body.dofs, &cube.grouping, &lattice.coefficients);
    let Ok(mut solver) = stages.analyse.time(1, make) else { return Ok(None) };
    let mut u = vec![0.0; cube.forces.len()];
    let (mut residual, mut iterations) = (0.0_f64, 0);
    for round in 0..=rounds.repeat {
        rounds.progress.check()?;
        let phi = stepped(cube, round);
        u.fill(0.0);
        stages.update.time(round, || ());
        stages.refactor.time(round, || solver.set(&phi));
        iterations = stages.solve.time(round, || solver.solve(&cube.forces, &mut u, TOLERANCE))?.iterations;
        residual = residual.max(cube.residual(&phi, &u));
        rounds.progress.advance(1);
    }
    let factor_bytes = solver.memory_bytes();
    Ok(Some(Row { residual, iterations: Some(iterations), factor_bytes, ..stages.row("multigrid", cube) }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::Progress;

    #[test]
    fn every_method_is_measured_with_its_error() {
        let cube = Cube::new(9).expect("a small cube");
        for method in METHODS {
            let rounds = Rounds { repeat: 2, progress: &Progress::default() };
            let row = (method.measure)(&cube, rounds).expect("positive definite").expect("a grid for all methods");
            assert_eq!((row.method, row.unknowns), (method.name, 3 * 9 * 9 * 8));
            assert!(row.residual < 1.01 * TOLERANCE, "{}: {}", row.method, row.residual);
            assert!(row.evaluation.least > 0.0 && row.evaluation.least <= row.evaluation.median);
        }
    }
}
