//! K(phi) u = f, again and again for one network after another: which factor to use, and when to make a new one.
//!
//! | path | one evaluation |
//! |---|---|
//! | direct | factor K(phi) in f64, solve, check the backward error |
//! | single | factor K(phi) in f32 ([`crate::sparse::single`]), conjugate gradients in f64 with it |
//! | stale | conjugate gradients with the last f32 factor, while that is cheaper than a new one |
//! | multigrid | conjugate gradients with a V-cycle, nothing assembled or factored ([`super::multigrid_solver`]) |
//!
//! When an old factor is cheaper than a new one is known before the first iteration ([`prediction`]), from the step in phi
//! and the sizes of the problem alone: never from a clock, so that the same run does the same.
//!
//! Where f32 fails (a pivot that is not positive, or no convergence: a condition number above about 1e7 after scaling),
//! the direct path takes over for this phi, and for the rest when that happens often. It is counted. Every answer of conjugate
//! gradients has a computed residual |f - K u| / |f| of at most the tolerance; one of the direct path a backward error that
//! is checked ([`crate::sparse::cholesky`]).

use std::borrow::Cow;
use std::ops::AddAssign;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::clock::Interrupt;
use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::geometry::grid::Grid;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::condition::{self, Accuracy, Inverse, Solved};

use super::affine::AffineStiffness;
use super::grouping::Grouping;
use super::iterative::Iterative;
use super::members::Members;
use super::multigrid_solver::MultigridSolver;
use super::network::Network;
use super::prediction;
use super::residual::Residual;
use super::stencil::Refusal;

/// Floating-point operations of a factorisation below which the direct path is as fast as any other.
const DIRECT_BELOW: f64 = 2e8;

/// Residual to which an estimate is solved.
const ROUGHLY: f64 = 1e-2;

/// Tolerance from which the direct path does not ask for rounding.
const LOOSE: f64 = 1e-8;

/// How K(phi) u = f is solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Path {
    /// By size and step: direct where a factorisation is cheap, otherwise stale.
    #[default]
    Auto,
    /// A factor in double precision for every evaluation.
    Direct,
    /// A factor in single precision for every evaluation, and conjugate gradients in double precision.
    Single,
    /// The last factor in single precision while it is cheaper than a new one, and conjugate gradients in double precision.
    Stale,
    /// Conjugate gradients in double precision with a multigrid cycle in single precision; for fine grids in space.
    Multigrid,
}

impl Path {
    /// The name in a scene and in a result.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Direct => "direct",
            Self::Single => "single",
            Self::Stale => "stale",
            Self::Multigrid => "multigrid",
        }
    }
}

/// What a user may say about the solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The path.
    pub path: Path,
    /// Largest |f - K u| / |f| of an answer of conjugate gradients.
    pub tolerance: f64,
}

impl Settings {
    /// The path every other one is measured against.
    pub const DIRECT: Self = Self { path: Path::Direct, tolerance: 1e-10 };
}

impl Default for Settings {
    fn default() -> Self {
        Self { path: Path::Auto, tolerance: 1e-10 }
    }
}

/// The path of a problem, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The path; never [`Path::Auto`].
    pub path: Path,
    /// Why, in words with numbers.
    pub reason: String,
}

/// Chooses the path of all systems on one analysed pattern.
pub fn choose(settings: &Settings, symbolic: &Symbolic) -> Choice {
    let flops = symbolic.factor_flops();
    match settings.path {
        Path::Auto if flops < DIRECT_BELOW => Choice {
            path: Path::Direct,
            reason: format!("a factorisation takes {flops:.1e} operations, below {DIRECT_BELOW:.0e}"),
        },
        Path::Auto => Choice {
            path: Path::Stale,
            reason: format!(
                "a factorisation takes {flops:.1e} operations, as long as {:.0} iterations with an old one",
                prediction::refactorisation_in_iterations(symbolic)
            ),
        },
        path => Choice { path, reason: "solver.path asks for it".into() },
    }
}

/// How often the expensive things were done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Factorisations, in either precision.
    pub refactorisations: u64,
    /// Factorisations in single precision among them.
    pub single_refactorisations: u64,
    /// Solves with the factor of an earlier phi.
    pub stale_solves: u64,
    /// Iterations of conjugate gradients.
    pub iterations: u64,
    /// Times single precision failed and double precision took over.
    pub fallbacks: u64,
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.refactorisations += other.refactorisations;
        self.single_refactorisations += other.single_refactorisations;
        self.stale_solves += other.stale_solves;
        self.iterations += other.iterations;
        self.fallbacks += other.fallbacks;
    }
}

/// The springs of one grouping, in the form that their path needs; shared by all workers.
pub enum SpringOperator<'a> {
    /// K(phi) on an analysed pattern: for all paths with factors.
    Assembled {
        /// K(phi).
        stiffness: AffineStiffness,
        /// The analysis that it was made with.
        symbolic: Arc<Symbolic>,
    },
    /// The springs on their grid, nothing assembled: for multigrid.
    OnGrid(GridSprings<'a>),
}

/// What a multigrid worker is made of.
#[derive(Clone)]
pub struct GridSprings<'a> {
    /// The springs.
    pub network: &'a Network,
    /// The grid of their nodes.
    pub grid: Grid,
    /// Supports; no ties.
    pub dofs: &'a DofMap,
    /// The groups.
    pub grouping: Grouping,
    /// k_s = phi w_s: the coefficient of every spring.
    pub coefficients: &'a [f64],
}

impl GridSprings<'_> {
    /// A worker.
    ///
    /// # Errors
    /// A [`Refusal`] when multigrid does not fit the body.
    pub fn worker(&self) -> std::result::Result<MultigridSolver, Refusal> {
        MultigridSolver::new(self.network, &self.grid, self.dofs, &self.grouping, self.coefficients)
    }
}

impl SpringOperator<'_> {
    /// K(phi) and its analysis, where it is assembled.
    pub fn assembled(&self) -> Option<(&AffineStiffness, &Arc<Symbolic>)> {
        match self {
            Self::Assembled { stiffness, symbolic } => Some((stiffness, symbolic)),
            Self::OnGrid(_) => None,
        }
    }

    /// The springs by group; made anew when they are on a grid.
    pub fn members(&self) -> Cow<'_, Members> {
        match self {
            Self::Assembled { stiffness, .. } => Cow::Borrowed(stiffness.members()),
            Self::OnGrid(GridSprings { network, grouping, coefficients, dofs, .. }) => {
                Cow::Owned(Members::new(network, grouping, coefficients, dofs))
            }
        }
    }

    /// Number of free degrees of freedom.
    pub fn unknowns(&self) -> usize {
        match self {
            Self::Assembled { stiffness, .. } => stiffness.unknowns(),
            Self::OnGrid(springs) => springs.dofs.len(),
        }
    }
}

/// One worker's solver.
pub struct SpringSolver<'a> {
    unknowns: usize,
    engine: Engine<'a>,
}

/// The ways, with what each worker owns.
enum Engine<'a> {
    Direct { stiffness: &'a AffineStiffness, factor: Box<Factor>, work: Work },
    Iterative { stiffness: &'a AffineStiffness, iterative: Box<Iterative> },
    Multigrid { solver: Box<MultigridSolver>, work: Work },
}

impl<'a> SpringSolver<'a> {
    /// Allocates what the chosen path needs.
    ///
    /// # Panics
    /// When the operator is on a grid that multigrid refuses: try [`GridSprings::worker`] first.
    pub fn new(operator: &'a SpringOperator, settings: &Settings) -> Self {
        let engine = match operator {
            SpringOperator::Assembled { stiffness, symbolic } => match choose(settings, symbolic).path {
                path @ (Path::Single | Path::Stale) => {
                    Engine::Iterative { stiffness, iterative: Box::new(Iterative::new(symbolic, path == Path::Stale)) }
                }
                _ => Engine::Direct {
                    stiffness,
                    factor: Box::new(Factor::new(Arc::clone(symbolic))),
                    work: Work::default(),
                },
            },
            SpringOperator::OnGrid(springs) => {
                let solver = springs.worker().expect("whoever chose multigrid has tried it");
                Engine::Multigrid { solver: Box::new(solver), work: Work::default() }
            }
        };
        Self { unknowns: operator.unknowns(), engine }
    }

    /// Number of free degrees of freedom.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Ends iterations with [`Error::Interrupted`] when the user stops the run.
    pub fn watch(&mut self, interrupt: &Interrupt) {
        match &mut self.engine {
            Engine::Direct { .. } => {}
            Engine::Iterative { iterative, .. } => iterative.watch(interrupt),
            Engine::Multigrid { solver, .. } => solver.watch(interrupt),
        }
    }

    /// Work done so far.
    pub fn work(&self) -> Work {
        match &self.engine {
            Engine::Direct { work, .. } | Engine::Multigrid { work, .. } => *work,
            Engine::Iterative { iterative, .. } => iterative.work,
        }
    }

    /// Work done since the last call.
    pub fn take_work(&mut self) -> Work {
        match &mut self.engine {
            Engine::Direct { work, .. } | Engine::Multigrid { work, .. } => std::mem::take(work),
            Engine::Iterative { iterative, .. } => std::mem::take(&mut iterative.work),
        }
    }

    /// True on a path whose answers depend, within the tolerance, on the systems that were solved before and on guesses.
    pub fn remembers(&self) -> bool {
        !matches!(self.engine, Engine::Direct { .. })
    }

    /// Takes the stiffnesses of the systems to come. A group with 0 is not there; nothing is rounded up to be.
    ///
    /// # Errors
    /// [`Error::Input`] for a number that is negative or not finite; [`Error::NotPositiveDefinite`] on the direct path, the
    /// others find out when they solve.
    ///
    /// # Panics
    /// When `phi` has not one number for every group.
    pub fn set(&mut self, phi: &[f64]) -> Result<()> {
        if let Some(group) = phi.iter().position(|k| !(k.is_finite() && *k >= 0.0)) {
            let message = format!("the stiffness of group {group} is {}", phi[group]);
            return Err(Error::input(
                "springs",
                message,
                "a finite number from 0; 0 takes the springs of the group out",
            ));
        }
        match &mut self.engine {
            Engine::Direct { stiffness, factor, work } => {
                stiffness.assemble_into(phi, factor.values_mut());
                work.refactorisations += 1;
                factor.refactor()
            }
            Engine::Iterative { stiffness, iterative } => {
                iterative.set(stiffness, phi);
                Ok(())
            }
            Engine::Multigrid { solver, .. } => {
                solver.set(phi);
                Ok(())
            }
        }
    }

    /// How sure `answers` to `forces` (whole columns) are, the worst of all, measured on the springs themselves;
    /// `members` are those of the operator, `phi` what was set last. Takes about six solves to two digits, and one or two for every
    /// further column.
    ///
    /// # Errors
    /// [`Error::Interrupted`], see [`SpringSolver::watch`].
    ///
    /// # Panics
    /// When a slice has not its length.
    pub fn accuracy(&mut self, members: &Members, phi: &[f64], forces: &[f64], answers: &[f64]) -> Result<Accuracy> {
        let n = self.unknowns.max(1);
        let mut worst = Accuracy { backward_error: 0.0, condition: 0.0, forward_error: 0.0 };
        let mut inverse = Inverse::default();
        for (f, u) in forces.chunks_exact(n).zip(answers.chunks_exact(n)) {
            let Residual { backward_error, residual, scale, norm, longest_row } = members.residual(phi, f, u);
            let solved = Solved { norm, longest_row, backward_error, residual: &residual, scale: &scale, solution: u };
            let found = match condition::accuracy(&solved, &mut inverse, &mut |b, x| self.solve(b, x, ROUGHLY)) {
                Ok(found) => found,
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                // a system that cannot be solved to two digits has no condition number to speak of
                Err(_) => Accuracy { backward_error, condition: f64::INFINITY, forward_error: f64::INFINITY },
            };
            worst = worst.worse(found);
        }
        Ok(worst)
    }

    /// out = K_a u.
    pub fn apply(&self, group: usize, u: &[f64], out: &mut [f64]) {
        match &self.engine {
            Engine::Direct { stiffness, .. } | Engine::Iterative { stiffness, .. } => stiffness.apply(group, u, out),
            Engine::Multigrid { solver, .. } => solver.apply_group(group, u, out),
        }
    }

    /// Solves K(phi) U = F for `forces.len() / n` columns, n the number of unknowns. `answers` holds guesses (such as the
    /// displacements at the phi before, or zeros) and takes the answers; after an error it holds zeros or nothing useful.
    /// `tolerance` is the largest |f - K u| / |f| of a column. The direct path reads no guesses, and solves to rounding unless
    /// the tolerance is loose (1e-8 or more).
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`], or [`Error::Inaccurate`] when no path is accurate;
    /// [`Error::Interrupted`] on a path that iterates, see [`SpringSolver::watch`].
    ///
    /// # Panics
    /// When `forces` is not a whole number of columns, or `answers` has another length.
    pub fn solve(&mut self, forces: &[f64], answers: &mut [f64], tolerance: f64) -> Result<()> {
        assert_eq!(forces.len(), answers.len(), "as many answers as forces");
        assert_eq!(forces.len() % self.unknowns.max(1), 0, "whole columns");
        match &mut self.engine {
            Engine::Direct { factor, .. } if tolerance < LOOSE => factor.solve(forces, answers).map(|_| ()),
            Engine::Direct { factor, .. } => factor.solve_within(forces, answers, tolerance),
            Engine::Iterative { iterative, .. } => iterative.solve(forces, answers, tolerance),
            Engine::Multigrid { solver, work } => match solver.solve_columns(forces, answers, tolerance) {
                Ok(report) => {
                    work.iterations += report.iterations as u64;
                    Ok(())
                }
                Err(error) => {
                    // what is left is no guess
                    answers.fill(0.0);
                    Err(error)
                }
            },
        }
    }
}
