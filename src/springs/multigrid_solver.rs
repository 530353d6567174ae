//! K(phi) u = f on fine grids: conjugate gradients in f64 on the stencil of the springs, one V-cycle as preconditioner.
//!
//! Time and memory grow like the number of unknowns. The answer is that of f64: the cycle only decides how many
//! iterations it takes, and the residual |f - K u| / |f| that is reported is computed from the u that is handed back.
//! On an ill-conditioned body that residual cannot fall below the rounding of u itself, about 1e-16 |K| |u| / |f|, however
//! it is solved; there the solve is done when the backward error |f - K u| / (|K| |u| + |f|) is at most [`ROUNDING`], if
//! the residual is at most [`MOST`].
//! A body on which the cycle works badly (a thin shell held at one end, one group a thousand times the others) shows by
//! its iterations: beyond [`LIMIT`] the solve is an error value, and the caller takes a direct one.

use rayon::prelude::*;

use crate::clock::Interrupt;
use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::geometry::grid::Grid;
use crate::sparse::cg;
use crate::sparse::multigrid::padded::components;
use crate::sparse::multigrid::{Multigrid, TOGETHER};
use crate::sparse::vectors;

use super::grouping::Grouping;
use super::network::Network;
use super::stencil::{Refusal, Stencil};

/// Numbers that one task serves.
const PIECE: usize = 16_384;

/// Iterations after which a body is too hard for this path.
pub const LIMIT: usize = 600;

/// A backward error that no solve in f64 improves.
pub const ROUNDING: f64 = 1e-15;

/// Largest |f - K u| / |f| that can be rounding. Where K is singular u grows without end, and with it |K| |u|: the backward
/// error is then as small as one likes, and means nothing.
pub const MOST: f64 = 1e-6;

/// How a solve went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// Iterations of the conjugate gradients, of all columns.
    pub iterations: usize,
    /// |f - K u| / |f|, computed in f64 from the result, of the worst column; above the tolerance only where rounding allows
    /// no less.
    pub residual: f64,
}

/// One worker: springs, hierarchy, workspace. Nothing of the length of a vector is allocated after the first solve for as many
/// columns at once.
pub struct MultigridSolver {
    stencil: Stencil,
    multigrid: Multigrid,
    work: cg::Workspace,
    right: Vec<f64>,
    solution: Vec<f64>,
    /// Largest extent of the body, m: positions of the cycle are divided by it.
    extent: f64,
}

impl MultigridSolver {
    /// Prepares the springs of a network on its grid; `coefficients` is w_s of every spring.
    ///
    /// # Errors
    /// A [`Refusal`] when this path does not fit the body: take a direct one.
    ///
    /// # Panics
    /// When there is not one group and one coefficient for every spring.
    pub fn new(
        network: &Network,
        grid: &Grid,
        dofs: &DofMap,
        grouping: &Grouping,
        coefficients: &[f64],
    ) -> std::result::Result<Self, Refusal> {
        let stencil = Stencil::new(network, grid, dofs, grouping, coefficients)?;
        let (centre, extent) = frame(&network.positions);
        let mut positions = vec![0.0; 3 * stencil.padded().len()];
        for (c, component) in components(&stencil.bars().positions).into_iter().enumerate() {
            let to = &mut positions[c * component.len()..(c + 1) * component.len()];
            to.iter_mut().zip(component).for_each(|(to, x)| *to = ((x - centre[c]) / extent) as f32);
        }
        let multigrid = Multigrid::new(stencil.padded(), positions, stencil.free().to_vec()).ok_or(Refusal::Small)?;
        let n = 3 * stencil.padded().len();
        let work = cg::Workspace::new(n);
        Ok(Self { work, right: vec![0.0; n], solution: vec![0.0; n], extent, stencil, multigrid })
    }

    /// Ends solves when the user stops the run.
    pub fn watch(&mut self, interrupt: &Interrupt) {
        self.work.watch(interrupt);
    }

    /// Number of free degrees of freedom.
    pub fn unknowns(&self) -> usize {
        self.stencil.unknowns()
    }

    /// The springs without a matrix.
    pub fn stencil(&self) -> &Stencil {
        &self.stencil
    }

    /// The hierarchy.
    pub fn multigrid(&mut self) -> &mut Multigrid {
        &mut self.multigrid
    }

    /// Takes the numbers of the groups and builds all coarse grids anew: the state depends on nothing that was before.
    ///
    /// # Panics
    /// When `phi` has not one number for every group.
    pub fn set(&mut self, phi: &[f64]) {
        self.set_keeping_cycle(phi);
        let Self { stencil, multigrid, extent, .. } = self;
        let c = &stencil.bars().coefficients;
        let largest = c.par_iter().with_min_len(PIECE).copied().reduce(|| 0.0, f64::max);
        // any factor on the operator of the cycle is one on the preconditioner, which changes nothing
        let scale = if largest > 0.0 { 1.0 / (largest * *extent * *extent) } else { 0.0 };
        let area = *extent * *extent;
        let to = multigrid.coefficients_mut().par_iter_mut().with_min_len(PIECE);
        to.zip(c).for_each(|(to, c)| *to = (c * area * scale) as f32);
        multigrid.update();
    }

    /// Takes the numbers of the groups for the product only: the cycle stays that of the last [`MultigridSolver::set`],
    /// which costs iterations, not accuracy. Worth it while phi moves by less than about a factor of two.
    ///
    /// # Panics
    /// When `phi` has not one number for every group.
    pub fn set_keeping_cycle(&mut self, phi: &[f64]) {
        self.stencil.set(phi);
    }

    /// Solves K(phi) x = b from the initial guess in `x`, until |b - K x| <= tolerance |b| or the backward error is at
    /// most [`ROUNDING`].
    ///
    /// # Errors
    /// [`Error::Inaccurate`] with the residual after [`LIMIT`] iterations without that; `x` is what was found.
    /// [`Error::Interrupted`], see [`MultigridSolver::watch`].
    ///
    /// # Panics
    /// When `b` or `x` is not as long as there are unknowns.
    pub fn solve(&mut self, b: &[f64], x: &mut [f64], tolerance: f64) -> Result<Report> {
        assert_eq!(b.len(), self.unknowns(), "a vector over the free degrees of freedom");
        self.solve_columns(b, x, tolerance)
    }

    /// Solves for `b.len() / n` columns, one after another in memory, as [`MultigridSolver::solve`] does for one, to the
    /// same bits; [`TOGETHER`] of them travel in step and share what is read of the springs and the coarse grids.
    ///
    /// # Errors
    /// As [`MultigridSolver::solve`]; columns behind the one that failed may not have been looked at.
    ///
    /// # Panics
    /// When `b` is not a whole number of columns, or `x` has another length.
    pub fn solve_columns(&mut self, b: &[f64], x: &mut [f64], tolerance: f64) -> Result<Report> {
        let n = self.unknowns().max(1);
        assert!(b.len() == x.len() && b.len().is_multiple_of(n), "whole columns over the free degrees of freedom");
        let mut report = Report { iterations: 0, residual: 0.0 };
        for (b, x) in b.chunks(TOGETHER * n).zip(x.chunks_mut(TOGETHER * n)) {
            let found = self.together(b, x, tolerance)?;
            report.iterations += found.iterations;
            report.residual = report.residual.max(found.residual);
        }
        Ok(report)
    }

    /// Solves for up to [`TOGETHER`] columns.
    fn together(&mut self, b: &[f64], x: &mut [f64], tolerance: f64) -> Result<Report> {
        let (n, padded) = (self.unknowns(), 3 * self.stencil.padded().len());
        self.make_room(b.len() / n);
        let Self { stencil, multigrid, work, right, solution, .. } = self;
        let length = b.len() / n * padded;
        let (right, solution) = (&mut right[..length], &mut solution[..length]);
        for (from, to) in [(b, &mut *right), (&*x, &mut *solution)] {
            from.chunks_exact(n).zip(to.chunks_exact_mut(padded)).for_each(|(from, to)| stencil.spread(from, to));
        }
        let outcome = cg::solve_columns(
            &mut |u, out| stencil.product(u, out),
            &mut |r, z| multigrid.apply(r, z),
            right,
            solution,
            tolerance,
            LIMIT,
            work,
        );
        solution.chunks_exact(padded).zip(x.chunks_exact_mut(n)).for_each(|(from, to)| stencil.collect(from, to));
        work.check()?;
        let failed = |(residual, (b, x)): &(f64, (&[f64], &[f64]))| {
            let rounding = || {
                let (size, load) = (vectors::norm(x) * stencil.stiffest(), vectors::norm(b));
                residual * load <= ROUNDING * (size + load)
            };
            *residual > tolerance && !(*residual <= MOST && rounding())
        };
        match work.residuals().zip(b.chunks_exact(n).zip(x.chunks_exact(n))).find(failed) {
            None => Ok(Report { iterations: outcome.iterations, residual: outcome.residual }),
            Some((residual, _)) => Err(Error::Inaccurate { backward_error: residual, limit: tolerance }),
        }
    }

    /// Makes room for more columns.
    fn make_room(&mut self, columns: usize) {
        let length = 3 * self.stencil.padded().len() * columns;
        for vectors in [&mut self.right, &mut self.solution] {
            if vectors.len() < length {
                vectors.resize(length, 0.0);
            }
        }
    }

    /// out = K_a u over the free degrees of freedom.
    pub fn apply_group(&self, group: usize, u: &[f64], out: &mut [f64]) {
        self.stencil.apply_group(group, u, out);
    }

    /// Bytes held, workspace included: as many columns as were solved for at once, [`TOGETHER`] at most.
    pub fn memory_bytes(&self) -> usize {
        self.stencil.bytes() + self.multigrid.bytes() + 8 * 2 * self.right.len() + self.work.bytes()
    }
}

/// Centre and largest extent of a set of points, m.
fn frame(points: &[[f64; 3]]) -> ([f64; 3], f64) {
    let ends = [0, 1, 2].map(|c| {
        let coordinates = points.iter().map(|x| x[c]);
        (coordinates.clone().fold(f64::INFINITY, f64::min), coordinates.fold(f64::NEG_INFINITY, f64::max))
    });
    let extent = ends.iter().map(|(low, high)| high - low).fold(0.0, f64::max);
    (ends.map(|(low, high)| 0.5 * (low + high)), if extent > 0.0 { extent } else { 1.0 })
}
