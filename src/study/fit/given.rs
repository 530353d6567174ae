//! What a fit works on, and the steps of a calibration on it: problems, their answers, the network under all loads.

use std::sync::Arc;

use crate::calibration::errors::{self, Errors};
use crate::calibration::linear::complete;
use crate::calibration::objective::Counts;
use crate::calibration::objectives::displacement::weights;
use crate::calibration::optimisers::many;
use crate::calibration::pieces::Kept;
use crate::calibration::prior::Prior;
use crate::calibration::sweep::{self, Shared, Solved, SweepProblem};
use crate::clock::{Interrupt, Progress};
use crate::error::{Error, Result};
use crate::reference::Reference;
use crate::scene::Scene;
use crate::sparse::cholesky::Factor;
use crate::sparse::condition::Accuracy;
use crate::springs::affine::AffineStiffness;
use crate::springs::grouping::Grouping;
use crate::springs::solver::{GridSprings, SpringOperator, SpringSolver};
use crate::springs::{bounds, weighting};
use crate::study::body::Body;
use crate::study::checkpoint::{self, Checkpoint};
use crate::study::large;
use crate::study::linear_fit::Goal;
use crate::study::loads::LoadCase;
use crate::study::near_mechanism;
use crate::study::network::{self, Lattice};

use super::{Calibration, Matrices, Row, deviation, optimiser, undetermined};

/// Bytes that the Jacobians of Gauss-Newton may take.
pub(in crate::study) const LARGEST_JACOBIAN: f64 = 8e9;

/// What a fit works on.
#[derive(Clone, Copy)]
pub struct Given<'a> {
    /// The scene, with every default written out.
    pub scene: &'a Scene,
    /// The body.
    pub body: &'a Body,
    /// The load cases.
    pub loads: &'a [LoadCase],
    /// The solved continuum.
    pub reference: &'a Reference,
    /// The network with its analysis.
    pub lattice: &'a Lattice,
}

/// Some load cases, one after the other.
pub(in crate::study) struct Cases {
    /// Forces over the free dofs (cases x n), N.
    pub forces: Vec<f64>,
    /// Displacements of the continuum (cases x n), m.
    pub reference: Vec<f64>,
    /// Weight of each case, percent per metre.
    pub weights: Vec<f64>,
}

/// A network under all loads.
struct Loaded {
    /// Its displacements (cases x n), m.
    displacement: Vec<f64>,
    /// How sure they are; none under large displacements.
    accuracy: Option<Accuracy>,
    /// [`deviation::deviations`].
    deviations: Vec<Option<f64>>,
}

impl Given<'_> {
    /// Indices of the fitted load cases.
    pub(super) fn fitted(&self) -> Vec<usize> {
        (0..self.loads.len()).filter(|&c| self.loads[c].fit).collect()
    }

    /// The cases that are fitted, or those that are held out.
    pub(in crate::study) fn cases(&self, fit: bool) -> Cases {
        let chosen: Vec<usize> = (0..self.loads.len()).filter(|&c| self.loads[c].fit == fit).collect();
        let largest: Vec<f64> = chosen.iter().map(|&c| self.reference.cases[c].u_max).collect();
        let answers = chosen.iter().map(|&c| &self.reference.cases[c].displacement);
        Cases {
            forces: chosen.iter().flat_map(|&c| self.loads[c].load.forces.iter().copied()).collect(),
            reference: answers.flatten().copied().collect(),
            weights: weights(&largest, self.body.dofs.masters().count()),
        }
    }

    /// The springs and bounds of one grouping.
    pub(in crate::study) fn problem<'b>(
        &'b self,
        goal: &'b Goal,
        grouping: &'b Grouping,
        index: usize,
    ) -> Result<SweepProblem<'b>> {
        let Lattice { factors, spring_bounds, .. } = self.lattice;
        let upper = bounds::upper_bounds(grouping, spring_bounds, factors);
        let strength = self.scene.regularisation();
        let prior = (strength > 0.0).then(|| Prior::new(strength, grouping));
        let (operator, search) = (self.operator(grouping), goal.search(self, grouping)?);
        Ok(SweepProblem { operator, upper, search, prior, index })
    }

    /// The springs of one grouping, in the form that their path needs.
    pub(in crate::study) fn operator(&self, grouping: &Grouping) -> SpringOperator<'_> {
        let Lattice { network, symbolic, coefficients, .. } = self.lattice;
        let dofs = &self.body.dofs;
        match symbolic {
            Some(symbolic) => SpringOperator::Assembled {
                stiffness: AffineStiffness::new(network, grouping, coefficients, dofs, symbolic),
                symbolic: Arc::clone(symbolic),
            },
            None => {
                let grid = self.body.grid().expect("multigrid was tried on a grid");
                SpringOperator::OnGrid(GridSprings { network, grid, dofs, grouping: grouping.clone(), coefficients })
            }
        }
    }

    /// Refuses matrices that would not fit: a Jacobian with one column a group, four copies at a time for each of two
    /// starts; for a linear objective the pull of every group on every node, and some triangles as wide as the groups.
    /// The number of threads does not count, so that a scene is refused on every machine or on none.
    pub(in crate::study) fn check_memory(&self, groups: usize) -> Result<()> {
        let (optimiser, _) = optimiser(self.scene)?;
        let unknowns = self.body.dofs.len() as f64;
        let columns = groups as f64;
        let numbers = match self.scene.calibration.objective.as_str() {
            "displacement" if !optimiser.uses_jacobian => 0.0,
            "displacement" if optimiser.name == "gauss_newton" && many::serves(groups) => 8.0 * unknowns,
            "displacement" => 4.0 * 2.0 * columns * unknowns * self.fitted().len() as f64,
            "formula" | "known" => 0.0,
            _ => columns * unknowns + 16.0 * columns * columns,
        };
        if 8.0 * numbers <= LARGEST_JACOBIAN {
            return Ok(());
        }
        let message = format!("{groups} groups on {unknowns} degrees of freedom need {:.1} GB", 8e-9 * numbers);
        Err(Error::input("springs.grouping", message, "use fewer groups, fewer control points, or annealing"))
    }

    /// Runs the optimiser on all problems.
    pub(in crate::study) fn solve(
        &self,
        problems: &[SweepProblem],
        progress: &Progress,
        checkpoint: &Checkpoint,
    ) -> Result<Vec<Solved>> {
        let Cases { forces, reference: targets, weights } = self.cases(true);
        let (optimiser, settings) = optimiser(self.scene)?;
        let expected = problems.iter().map(|problem| (optimiser.expected_evaluations)(&settings, problem.upper.len()));
        progress.enter("calibration", expected.sum());
        let solver = network::settings(self.scene);
        let groups: Vec<_> = problems.iter().map(|problem| (problem.index, problem.upper.len())).collect();
        checkpoint.enter(self.digest(problems, &[&forces, &targets, &weights]), &groups)?;
        let kept = Kept {
            known: &|piece| {
                let known = checkpoint.known(piece)?;
                progress.advance(known.counts.evaluations);
                Some(known)
            },
            tell: &|piece, outcome| {
                if !checkpoint.keep(piece, outcome) {
                    progress.cancel();
                }
            },
        };
        let (dofs, what) = (&self.body.dofs, self.what());
        let (reference, solver, kept) = (&targets[..], &solver, &kept);
        let shared = Shared { forces: &forces, reference, weights: &weights, dofs, what, solver, kept };
        sweep::solve(problems, shared, optimiser, &settings, self.scene.calibration.seed, progress)
            .map_err(|error| checkpoint.failure().unwrap_or(error).advised(self.advice(problems)))
    }

    /// What the network is called in an error.
    fn what(&self) -> &'static str {
        if self.scene.calibration.optimiser().is_some() { "fitted network" } else { "given network" }
    }

    /// What to do where the fit of a problem leaves a mechanism.
    fn advice(&self, problems: &[SweepProblem]) -> String {
        near_mechanism::advice(self.scene, problems.iter().map(|problem| problem.upper.len()).max().unwrap_or(1))
    }

    /// A digest of the numbers that the sweep begins with, and of the path of solution.
    pub(in crate::study) fn digest(&self, problems: &[SweepProblem], vectors: &[&[f64]]) -> u64 {
        let Lattice { network, coefficients, choice, .. } = self.lattice;
        let of_problems = problems.iter().flat_map(|problem| problem.upper.iter().copied());
        let numbers = vectors.iter().copied().flatten().chain(coefficients).chain(network.positions.iter().flatten());
        let bits = numbers.copied().chain(of_problems).flat_map(|number| number.to_bits().to_le_bytes());
        checkpoint::digest(choice.path.name().bytes().chain(bits))
    }

    /// Displacements of the fitted cases (cases x n) at an answer: those of its linear solve, or of its equilibrium
    /// beside a continuum that turns.
    pub(super) fn moved(&self, found: &Solved, grouping: &Grouping, progress: &Progress) -> Result<Vec<f64>> {
        match large::is_asked(self.scene) {
            true => large::network(self, grouping, &found.outcome.phi, &self.fitted(), &progress.interrupt()),
            false => Ok(found.displacement.clone()),
        }
    }

    /// The network with `phi` under all loads.
    fn under_all_loads(&self, problem: &SweepProblem, grouping: &Grouping, phi: &[f64]) -> Result<Loaded> {
        if large::is_asked(self.scene) {
            let all: Vec<usize> = (0..self.loads.len()).collect();
            let displacement = large::network(self, grouping, phi, &all, &Interrupt::default())?;
            return Ok(Loaded { displacement, accuracy: None, deviations: vec![None; phi.len()] });
        }
        let forces: Vec<f64> = self.loads.iter().flat_map(|case| case.load.forces.iter().copied()).collect();
        let settings = sweep::exact(&problem.operator, &network::settings(self.scene));
        let mut solver = SpringSolver::new(&problem.operator, &settings);
        let mut displacement = vec![0.0; forces.len()];
        solver.set(phi)?;
        solver
            .solve(&forces, &mut displacement, settings.tolerance)
            .map_err(|error| self.opened(error, problem, phi))?;
        let accuracy = solver.accuracy(&problem.operator.members(), phi, &forces, &displacement)?;
        let deviations = deviation::deviations(self, &mut solver, (phi, &problem.upper), &displacement)?;
        Ok(Loaded { displacement, accuracy: Some(accuracy), deviations })
    }

    /// A network that does not bear every load, for it is nearly loose: the node that is.
    fn opened(&self, error: Error, problem: &SweepProblem, phi: &[f64]) -> Error {
        let (Error::Inaccurate { .. }, Some((stiffness, symbolic))) = (&error, problem.operator.assembled()) else {
            return error;
        };
        let mut factor = Factor::new(Arc::clone(symbolic));
        stiffness.assemble_into(phi, factor.values_mut());
        let dof = match factor.refactor() {
            Ok(()) => factor.weakest_pivot().0,
            Err(Error::NotPositiveDefinite { dof }) => dof,
            Err(other) => return other,
        };
        let (node, component) = self.body.dofs.owner(dof);
        let motions = vec![format!("node {node} can move along {}", ['x', 'y', 'z'][component])];
        Error::mechanism(self.what(), 1, motions).advised(near_mechanism::advice(self.scene, phi.len()))
    }

    /// Errors of the fitted cases for their displacements (cases x n).
    pub(in crate::study) fn fitted_errors(&self, displacement: &[f64]) -> Vec<Errors> {
        let cases = self.fitted().into_iter().zip(displacement.chunks_exact(self.body.dofs.len()));
        cases.map(|(c, u)| errors::errors(&self.body.dofs, &self.reference.cases[c].displacement, u)).collect()
    }

    /// The calibrated network under all loads.
    pub(in crate::study) fn finish(
        &self,
        sweep: Vec<Row>,
        best: usize,
        grouping: Grouping,
        problem: &SweepProblem,
        matrices: Option<Matrices>,
    ) -> Result<Calibration> {
        let mut phi = sweep[best].outcome.phi.clone();
        let determined = undetermined::determined(self, problem, &grouping);
        complete(&mut phi, &problem.upper, &determined);
        let n = self.body.dofs.len();
        let Loaded { displacement, accuracy, deviations } = self.under_all_loads(problem, &grouping, &phi)?;
        let displacements: Vec<Vec<f64>> = displacement.chunks_exact(n).map(<[f64]>::to_vec).collect();
        let pairs = self.reference.cases.iter().zip(&displacements);
        let errors = pairs.clone().map(|(case, u)| errors::errors(&self.body.dofs, &case.displacement, u)).collect();
        let strain = |u: &[f64]| errors::global_strain(&self.lattice.network, &self.body.dofs.expand(u));
        let global_strain = pairs.map(|(case, u)| [strain(&case.displacement), strain(u)]).collect();
        let mut counts = Counts::default();
        sweep
            .iter()
            .enumerate()
            .filter(|(i, row)| row.solved_by == *i)
            .for_each(|(_, row)| counts += row.outcome.counts);
        Ok(Calibration {
            stiffness: weighting::stiffness(&grouping, &self.lattice.coefficients, &phi),
            global_strain,
            fitted: sweep[best].errors,
            matrices,
            left_out: undetermined::words(self, &grouping, &determined, &phi, &problem.upper),
            determined,
            deviations,
            upper: problem.upper.clone(),
            sweep,
            best,
            grouping,
            phi,
            displacements,
            accuracy,
            errors,
            counts,
            ladder: vec![],
        })
    }
}
