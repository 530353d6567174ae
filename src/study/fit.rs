//! Groups, bounds and fits: Algorithm 5.1 on the network of a scene.
//!
//! Every gamma gives a grouping; equal groupings are one problem. Each problem is an affine stiffness K(phi) on the one
//! analysed pattern with the bounds (5.8) of its groups. The best row of the sweep is the calibrated network: its springs get their
//! stiffness, and it is loaded with all cases, fitted and held out.

use std::sync::Arc;

use crate::calibration::adaptive::Rung;
use crate::calibration::errors::{self, Errors};
use crate::calibration::objective::Counts;
use crate::calibration::objectives::displacement::weights;
use crate::calibration::optimiser::{self, Optimiser, Outcome, Settings};
use crate::calibration::optimisers::many;
use crate::calibration::pieces::Kept;
use crate::calibration::prior::Prior;
use crate::calibration::sweep::{self, Shared, Solved, SweepProblem};
use crate::clock::{Interrupt, Progress};
use crate::error::{Error, Result};
use crate::reference::Reference;
use crate::scene::{ADAPTIVE, Scene};
use crate::sparse::cholesky::Factor;
use crate::sparse::condition::Accuracy;
use crate::springs::affine::AffineStiffness;
use crate::springs::grouping::{self, Grouping, Request};
use crate::springs::solver::{GridSprings, SpringOperator, SpringSolver};
use crate::springs::{bounds, weighting};

use super::adaptive;
use super::body::Body;
use super::checkpoint::{self, Checkpoint};
use super::large;
use super::linear_fit::{self, Goal};
use super::loads::LoadCase;
use super::near_mechanism::{self, Weakness};
use super::network::{self, Lattice};
use super::spring_sets;

/// Bytes that the Jacobians of Gauss-Newton may take.
pub(super) const LARGEST_JACOBIAN: f64 = 8e9;

/// What a calibration found.
pub struct Calibration {
    /// One row for each gamma (one in all when the grouping does not use gamma).
    pub sweep: Vec<Row>,
    /// Index of the best row.
    pub best: usize,
    /// The groups of the best row.
    pub grouping: Grouping,
    /// Their stiffness phi, in the unit of the profile: N/m unless the scene says otherwise.
    pub phi: Vec<f64>,
    /// Their upper bounds, like phi.
    pub upper: Vec<f64>,
    /// Stiffness k_s of every spring, N/m, its multiplicity included.
    pub stiffness: Vec<f64>,
    /// Displacements of the network, one vector over the free dofs for each load case, m.
    pub displacements: Vec<Vec<f64>>,
    /// How sure they are, the worst of all; none under large displacements, where they balance forces instead.
    pub accuracy: Option<Accuracy>,
    /// Errors of each load case, percent.
    pub errors: Vec<Errors>,
    /// Errors over the fitted cases, percent.
    pub fitted: Errors,
    /// The part of K_ref between nodes that no spring joins, percent of |K_ref|_F; only for the matrix objective.
    pub outside_pattern: Option<f64>,
    /// Global strain (4.17) of the continuum and of the network under the first fitted load, percent.
    pub global_strain: [f64; 2],
    /// The motion that the network resists least.
    pub weakness: Weakness,
    /// Work of the whole sweep.
    pub counts: Counts,
    /// The networks on the way, where the groups adapt; otherwise empty.
    pub ladder: Vec<Rung>,
}

impl Calibration {
    /// Keeps only some springs, and the groups that still have some.
    ///
    /// # Panics
    /// When there is not one word for every spring.
    pub fn retain(&mut self, kept: &[bool]) {
        network::retain(&mut self.stiffness, kept);
        network::retain(&mut self.grouping.group_of, kept);
        let mut counts = vec![0; self.grouping.groups.len()];
        self.grouping.group_of.iter().for_each(|&group| counts[group as usize] += 1);
        let filled: Vec<bool> = counts.iter().map(|&count| count > 0).collect();
        let before = |group: usize| filled[..group].iter().filter(|filled| **filled).count() as u32;
        let numbers: Vec<u32> = (0..filled.len()).map(before).collect();
        self.grouping.group_of.iter_mut().for_each(|group| *group = numbers[*group as usize]);
        self.grouping.groups.iter_mut().zip(counts).for_each(|(group, count)| group.springs = count);
        network::retain(&mut self.grouping.groups, &filled);
        network::retain(&mut self.phi, &filled);
        network::retain(&mut self.upper, &filled);
    }

    /// A word where the bounds, not the optimiser, decide: every group is at its upper bound.
    pub fn warning(&self) -> Option<String> {
        let at_bound = |(phi, upper): (&f64, &f64)| *phi >= (1.0 - 1e-9) * upper;
        self.phi.iter().zip(&self.upper).all(at_bound).then(|| {
            format!(
                "every group is at its upper bound (5.8): the network cannot be as stiff as the body (e_rms {:.1} %); \
                 use cells of more equal sides",
                self.fitted.e_rms
            )
        })
    }
}

/// One row of the sweep table.
pub struct Row {
    /// gamma, if the grouping uses it.
    pub gamma: Option<f64>,
    /// Number of groups.
    pub groups: usize,
    /// Index of the row that solved this problem: its own, or an earlier one with equal groups.
    pub solved_by: usize,
    /// Errors over the fitted cases, percent.
    pub errors: Errors,
    /// Relative difference of the optimiser's error and the one that the direct solve confirms; none where the
    /// optimiser made another error small than that of the displacements.
    pub error_difference: Option<f64>,
    /// Seconds of the fit.
    pub seconds: f64,
    /// What the optimiser found.
    pub outcome: Arc<Outcome>,
}

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
pub(super) struct Cases {
    /// Forces over the free dofs (cases x n), N.
    pub forces: Vec<f64>,
    /// Displacements of the continuum (cases x n), m.
    pub reference: Vec<f64>,
    /// Weight of each case, percent per metre.
    pub weights: Vec<f64>,
}

/// Fits the network of a scene to the reference; what is finished goes into the checkpoint, what is in it is not done again.
///
/// # Errors
/// [`Error::Input`] for a name or gamma that is not allowed; those of the optimiser; [`Error::File`] for a checkpoint of
/// another run or one that cannot be written.
pub fn calibrate(given: Given, progress: &Progress, checkpoint: &Checkpoint) -> Result<Calibration> {
    if given.scene.springs.grouping == ADAPTIVE {
        return adaptive::calibrate(given, progress, checkpoint);
    }
    let (gammas, groupings) = group(given.scene, given.body, given.lattice)?;
    let goal = linear_fit::goal(&given)?;
    let same = sweep::first_equal(&groupings);
    let distinct: Vec<usize> = (0..groupings.len()).filter(|&i| same[i] == i).collect();
    given.check_memory(distinct.iter().map(|&i| groupings[i].groups.len()).max().unwrap_or(0))?;
    let problems: Vec<SweepProblem> =
        distinct.iter().map(|&i| given.problem(&goal, &groupings[i], i)).collect::<Result<_>>()?;
    let solved = given.solve(&problems, progress, checkpoint)?;
    let displacements: Vec<Vec<f64>> = distinct
        .iter()
        .zip(&solved)
        .map(|(&i, found)| given.moved(found, &groupings[i], progress))
        .collect::<Result<_>>()?;
    let answer = |i: usize| distinct.iter().position(|&d| d == same[i]).unwrap_or(0);
    let sweep: Vec<Row> = (0..gammas.len())
        .map(|i| {
            let Solved { outcome, error_difference, seconds, .. } = &solved[answer(i)];
            let errors = errors::over_cases(&given.fitted_errors(&displacements[answer(i)]));
            let error_difference = match goal {
                Goal::Large(_) => Some((outcome.error - errors.e_rms).abs() / errors.e_rms),
                _ => *error_difference,
            };
            let outcome = Arc::new(outcome.clone());
            Row {
                gamma: gammas[i],
                groups: groupings[i].groups.len(),
                solved_by: same[i],
                errors,
                error_difference,
                seconds: *seconds,
                outcome,
            }
        })
        .collect();
    let best = (0..sweep.len()).min_by(|&i, &j| rank(&sweep[i], &sweep[j])).expect("a sweep has a row");
    let grouping = groupings[best].clone();
    let outside_pattern = goal.outside_pattern(&given);
    given.finish(sweep, best, grouping, &problems[answer(best)], outside_pattern)
}

/// Rows by error; of equals the one with fewer groups, then the earlier.
fn rank(a: &Row, b: &Row) -> std::cmp::Ordering {
    a.errors.e_rms.total_cmp(&b.errors.e_rms).then(a.groups.cmp(&b.groups))
}

/// The gammas of a scene (one entry without gamma for a grouping that does not use it) and their groupings.
pub(super) fn group(scene: &Scene, body: &Body, lattice: &Lattice) -> Result<(Vec<Option<f64>>, Vec<Grouping>)> {
    if scene.calibration.objective == "formula" {
        return Ok((vec![None], vec![linear_fit::formula_grouping(scene, body, lattice)?]));
    }
    let name = &scene.springs.grouping;
    let rule = grouping::find(name).ok_or_else(|| {
        Error::input("springs.grouping", format!("there is no grouping {name}"), "see `springfit list groupings`")
    })?;
    let gammas: Vec<Option<f64>> = match rule.uses_gamma {
        true => scene.calibration.gamma.values()?.into_iter().map(Some).collect(),
        false => vec![None],
    };
    let sets = spring_sets::sets(scene, body)?;
    let usual = Request { groups: scene.springs.groups, sets: &sets, ..Request::default() };
    let one = |gamma: &Option<f64>| {
        let request = Request { gamma: gamma.unwrap_or(usual.gamma), ..usual };
        (rule.group)(&lattice.network, &request)
    };
    let groupings = gammas.iter().map(one).collect::<Result<_>>()?;
    Ok((gammas, groupings))
}

/// The optimiser of a scene and its settings; a formula has none and gets the one that does nothing beside it.
pub(super) fn optimiser(scene: &Scene) -> Result<(&'static Optimiser, Settings)> {
    let given = &scene.calibration;
    let name = given.optimiser().unwrap_or("least_squares");
    let optimiser = optimiser::find(name).ok_or_else(|| {
        let message = format!("there is no optimiser {name}");
        Error::input("calibration.optimiser", message, "see `springfit list optimisers`")
    })?;
    let settings = Settings {
        starts: given.starts,
        refactorisations: given.gauss_newton.refactorisations as u64,
        polish: given.gauss_newton.polish as u64,
        tolerance: given.gauss_newton.tolerance,
        chains: given.annealing.chains,
        evaluations: given.annealing.evaluations as u64,
        initial_temperature: given.annealing.initial_temperature,
        final_temperature: given.annealing.final_temperature,
    };
    Ok((optimiser, settings))
}

impl Given<'_> {
    /// Indices of the fitted load cases.
    fn fitted(&self) -> Vec<usize> {
        (0..self.loads.len()).filter(|&c| self.loads[c].fit).collect()
    }

    /// The cases that are fitted, or those that are held out.
    pub(super) fn cases(&self, fit: bool) -> Cases {
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
    pub(super) fn problem<'b>(
        &'b self,
        goal: &'b Goal,
        grouping: &'b Grouping,
        index: usize,
    ) -> Result<SweepProblem<'b>> {
        let Lattice { network, symbolic, factors, coefficients, spring_bounds, .. } = self.lattice;
        let dofs = &self.body.dofs;
        let operator = match symbolic {
            Some(symbolic) => SpringOperator::Assembled {
                stiffness: AffineStiffness::new(network, grouping, coefficients, dofs, symbolic),
                symbolic: Arc::clone(symbolic),
            },
            None => {
                let grid = self.body.grid().expect("multigrid was tried on a grid");
                SpringOperator::OnGrid(GridSprings { network, grid, dofs, grouping: grouping.clone(), coefficients })
            }
        };
        let upper = bounds::upper_bounds(grouping, spring_bounds, factors);
        let strength = self.scene.regularisation();
        let prior = (strength > 0.0).then(|| Prior::new(strength, grouping));
        Ok(SweepProblem { operator, upper, search: goal.search(self, grouping)?, prior, index })
    }

    /// Refuses matrices that would not fit: a Jacobian with one column a group, four copies at a time for each of two
    /// starts; for a linear objective the pull of every group on every node, and some triangles as wide as the groups.
    /// The number of threads does not count, so that a scene is refused on every machine or on none.
    pub(super) fn check_memory(&self, groups: usize) -> Result<()> {
        let (optimiser, _) = optimiser(self.scene)?;
        let unknowns = self.body.dofs.len() as f64;
        let columns = groups as f64;
        let numbers = match self.scene.calibration.objective.as_str() {
            "displacement" if !optimiser.uses_jacobian => 0.0,
            "displacement" if optimiser.name == "gauss_newton" && many::serves(groups) => 8.0 * unknowns,
            "displacement" => 4.0 * 2.0 * columns * unknowns * self.fitted().len() as f64,
            "formula" => 0.0,
            _ => columns * unknowns + 16.0 * columns * columns,
        };
        if 8.0 * numbers <= LARGEST_JACOBIAN {
            return Ok(());
        }
        let message = format!("{groups} groups on {unknowns} degrees of freedom need {:.1} GB", 8e-9 * numbers);
        Err(Error::input("springs.grouping", message, "use fewer groups, fewer control points, or annealing"))
    }

    /// Runs the optimiser on all problems.
    pub(super) fn solve(
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
        let dofs = &self.body.dofs;
        let shared =
            Shared { forces: &forces, reference: &targets, weights: &weights, dofs, solver: &solver, kept: &kept };
        sweep::solve(problems, shared, optimiser, &settings, self.scene.calibration.seed, progress)
            .map_err(|error| checkpoint.failure().unwrap_or(error))
    }

    /// A digest of the numbers that the sweep begins with, and of the path of solution.
    fn digest(&self, problems: &[SweepProblem], vectors: &[&[f64]]) -> u64 {
        let Lattice { network, coefficients, choice, .. } = self.lattice;
        let of_problems = problems.iter().flat_map(|problem| problem.upper.iter().copied());
        let numbers = vectors.iter().copied().flatten().chain(coefficients).chain(network.positions.iter().flatten());
        let bits = numbers.copied().chain(of_problems).flat_map(|number| number.to_bits().to_le_bytes());
        checkpoint::digest(choice.path.name().bytes().chain(bits))
    }

    /// Displacements of the fitted cases (cases x n) at an answer: those of its linear solve, or of its equilibrium
    /// beside a continuum that turns.
    fn moved(&self, found: &Solved, grouping: &Grouping, progress: &Progress) -> Result<Vec<f64>> {
        match large::is_asked(self.scene) {
            true => large::network(self, grouping, &found.outcome.phi, &self.fitted(), &progress.interrupt()),
            false => Ok(found.displacement.clone()),
        }
    }

    /// The network with `phi` under all loads: displacements (cases x n), m, and where they are linear how sure they are, and
    /// the motion that the network resists least.
    fn under_all_loads(
        &self,
        problem: &SweepProblem,
        grouping: &Grouping,
        phi: &[f64],
    ) -> Result<(Vec<f64>, Option<Accuracy>, Weakness)> {
        if large::is_asked(self.scene) {
            let all: Vec<usize> = (0..self.loads.len()).collect();
            let displacement = large::network(self, grouping, phi, &all, &Interrupt::default())?;
            let not_looked_for = "under large displacements the network is another at every load";
            return Ok((displacement, None, Weakness::NotLookedFor { not_looked_for }));
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
        let weakness = near_mechanism::weakness(self.body, self.reference, problem, &mut solver)?;
        Ok((displacement, Some(accuracy), weakness))
    }

    /// A network that bears the fitted loads and no others: the node that is loose.
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
        Error::Mechanism { what: "network that fits the loads with fit = true".into(), modes: 1, motions }
    }

    /// Errors of the fitted cases for their displacements (cases x n).
    pub(super) fn fitted_errors(&self, displacement: &[f64]) -> Vec<Errors> {
        let cases = self.fitted().into_iter().zip(displacement.chunks_exact(self.body.dofs.len()));
        cases.map(|(c, u)| errors::errors(&self.body.dofs, &self.reference.cases[c].displacement, u)).collect()
    }

    /// The calibrated network under all loads.
    pub(super) fn finish(
        &self,
        sweep: Vec<Row>,
        best: usize,
        grouping: Grouping,
        problem: &SweepProblem,
        outside_pattern: Option<f64>,
    ) -> Result<Calibration> {
        let phi = sweep[best].outcome.phi.clone();
        let n = self.body.dofs.len();
        let (displacement, accuracy, weakness) = self.under_all_loads(problem, &grouping, &phi)?;
        let displacements: Vec<Vec<f64>> = displacement.chunks_exact(n).map(<[f64]>::to_vec).collect();
        let pairs = self.reference.cases.iter().zip(&displacements);
        let errors = pairs.map(|(case, u)| errors::errors(&self.body.dofs, &case.displacement, u)).collect();
        let first = self.fitted()[0];
        let strain = |u: &[f64]| errors::global_strain(&self.lattice.network, &self.body.dofs.expand(u));
        let mut counts = Counts::default();
        sweep
            .iter()
            .enumerate()
            .filter(|(i, row)| row.solved_by == *i)
            .for_each(|(_, row)| counts += row.outcome.counts);
        Ok(Calibration {
            stiffness: weighting::stiffness(&grouping, &self.lattice.coefficients, &phi),
            global_strain: [strain(&self.reference.cases[first].displacement), strain(&displacements[first])],
            fitted: sweep[best].errors,
            weakness,
            outside_pattern,
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
