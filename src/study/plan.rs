//! What a scene would build, before the work: sizes, memory, time, warnings.
//!
//! The body, the patterns and their analyses are really made (they are cheap); nothing is assembled or factored. Memory
//! counts the factors of both systems, one spring factor for every thread, and the reduced bases of the optimisers that have
//! one; time counts floating-point operations.

use serde::Serialize;

use crate::calibration::optimiser::{Optimiser, Settings};
use crate::calibration::optimisers::{reduced, surrogate};
use crate::calibration::surrogate::galerkin::Galerkin;
use crate::calibration::sweep;
use crate::error::Result;
use crate::reference::matrix_free::solve::memory_bytes;
use crate::reference::methods::Method;
use crate::reference::{self, stiffness};
use crate::scene::{self, Scene};
use crate::sparse::cholesky::Symbolic;
use crate::sparse::multigrid::TOGETHER;
use crate::springs::members::Members;
use crate::springs::solver::Path;

use super::body::Body;
use super::limits::Allowance;
use super::loads::LoadCase;
use super::network::Lattice;
use super::{body, fit, given_stiffness, large, limits, loads, motion, network};

/// Floating-point operations a second and core that supernodal factorisations of these sizes reach on a common machine;
/// for estimates only.
const RATE: f64 = 1e10;

/// Bytes of the multigrid path for each unknown, and for every further column that travels along; of the network for each
/// spring; seconds of one solve on one thread for each unknown; and solves of one problem beside two for each group; for
/// estimates only.
const GRID_BYTES: usize = 600;
const GRID_COLUMN_BYTES: usize = 80;
const NETWORK_BYTES: usize = 80;
const GRID_SECONDS: f64 = 3e-6;
const GRID_SOLVES: usize = 8;

/// Seconds of the iterated reference for each unknown and load case, and for each unknown once (its accuracy); for estimates
/// only.
const ITERATED_SECONDS: f64 = 2e-5;
const ESTIMATED_SECONDS: f64 = 2e-5;

/// Free degrees of freedom from which a run is always compared with what is free.
const SMALL: usize = 20_000;

/// Sizes of what a scene builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Sizes {
    /// Control points of a patch, nodes of a mesh, tied ones included.
    pub control_points: usize,
    /// Free degrees of freedom.
    pub free_dofs: usize,
    /// Knot spans or cells of the reference.
    pub elements: usize,
    /// Springs.
    pub springs: usize,
    /// Springs that were not created because their ends coincide.
    pub zero_length_springs: usize,
    /// Groups of the best row of the sweep (in a plan: of its finest row).
    pub groups: usize,
}

impl Sizes {
    /// Counts a body and its network with `groups` groups.
    pub fn of(body: &Body, lattice: &Lattice, groups: usize) -> Self {
        Self {
            control_points: body.positions().len(),
            free_dofs: body.dofs.len(),
            elements: body.continuum.elements(),
            springs: lattice.network.springs.len(),
            zero_length_springs: lattice.network.zero_length,
            groups,
        }
    }
}

/// What a run of a scene would do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// The scene, every default written out.
    pub scene: Scene,
    /// What would be built.
    pub sizes: Sizes,
    /// gamma (absent where the grouping does not use it) and number of groups of every row of the sweep.
    pub sweep: Vec<(Option<f64>, usize)>,
    /// Different groupings among them: problems to solve.
    pub problems: usize,
    /// Stored numbers of the Cholesky factors of the reference and of the network.
    pub factor_entries: [usize; 2],
    /// Memory the factors and matrices need, bytes.
    pub memory_bytes: usize,
    /// Rough time of the run, seconds.
    pub seconds: f64,
    /// Largest step in s that is safe for small motion whatever the calibration finds; absent where nothing bounds it, and
    /// where it is not cheap to know.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub safe_step: Option<f64>,
    /// What will be built and what will not, in words.
    pub steps: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Plans a scene.
///
/// # Errors
/// Whatever is wrong with the scene that can be found without assembling.
pub fn plan(scene: &Scene) -> Result<Plan> {
    limits::before_the_body(scene)?;
    let body = body::build(scene)?;
    let scene = body.resolved.clone();
    let loads = loads::build(&scene, &body)?;
    let lattice = network::build(&scene, &body)?;
    let (gammas, groupings) = fit::group(&scene, &body, &lattice)?;
    let same = sweep::first_equal(&groupings);
    let distinct: Vec<usize> = (0..same.len()).filter(|&i| same[i] == i).map(|i| groupings[i].groups.len()).collect();
    let problems = distinct.len();
    let (optimiser, settings) = fit::optimiser(&scene)?;
    let Cost { reference, springs, bytes: memory_bytes, seconds } =
        Cost::of(&scene, &body, &lattice, (optimiser, &settings), [fitted(&loads), loads.len()], &distinct)?;
    let [reference, springs] = [reference.factor_entries, springs.factor_entries];
    Allowance::of(&scene)?.admit("all of it", memory_bytes as f64)?;
    limits::time(&scene, seconds)?;
    let finest = groupings.iter().map(|g| g.groups.len()).max().unwrap_or(0);
    let groups = if scene.springs.grouping == scene::ADAPTIVE { finest.max(scene.springs.groups) } else { finest };
    let safe_step = motion::limits::before_calibration(&scene, &body, &lattice, &groupings)?;
    Ok(Plan {
        safe_step,
        sizes: Sizes::of(&body, &lattice, groups),
        sweep: gammas.into_iter().zip(groupings.iter().map(|g| g.groups.len())).collect(),
        problems,
        factor_entries: [reference, springs],
        memory_bytes,
        seconds,
        steps: steps(&scene, body.method, [reference, springs], [fitted(&loads), loads.len()], problems),
        warnings: body
            .warnings
            .iter()
            .chain(&lattice.warnings)
            .cloned()
            .chain(given_stiffness::warning(&scene, &body))
            .chain(loads::warnings(&scene, &loads))
            .collect(),
        scene,
    })
}

/// Load cases that are fitted.
fn fitted(loads: &[LoadCase]) -> usize {
    loads.iter().filter(|case| case.fit).count()
}

/// Refuses a run that would take more than it may, before its reference is solved and its groups are fitted. Small bodies
/// are only looked at when the scene has `[limits]`: their analysis is not worth doing twice.
///
/// # Errors
/// [`crate::error::Error::OverLimit`]; those of the groupings.
pub fn admit(scene: &Scene, body: &Body, loads: &[LoadCase], lattice: &Lattice) -> Result<()> {
    if scene.limits == scene::Limits::default() && body.dofs.len() < SMALL {
        return Ok(());
    }
    let (_, groupings) = fit::group(scene, body, lattice)?;
    let same = sweep::first_equal(&groupings);
    let distinct: Vec<usize> = (0..same.len()).filter(|&i| same[i] == i).map(|i| groupings[i].groups.len()).collect();
    let (optimiser, settings) = fit::optimiser(scene)?;
    let cost = Cost::of(scene, body, lattice, (optimiser, &settings), [fitted(loads), loads.len()], &distinct)?;
    Allowance::of(scene)?.admit("all of it", cost.bytes as f64)?;
    limits::time(scene, cost.seconds)
}

/// What a run costs.
struct Cost {
    reference: ReferenceCost,
    springs: SpringCost,
    /// Memory at most: that of the reference is free again when the springs are fitted.
    bytes: usize,
    seconds: f64,
}

impl Cost {
    /// `cases`: fitted load cases, and all; `distinct` holds the groups of each problem.
    fn of(
        scene: &Scene,
        body: &Body,
        lattice: &Lattice,
        (optimiser, settings): (&Optimiser, &Settings),
        [fitted, cases]: [usize; 2],
        distinct: &[usize],
    ) -> Result<Self> {
        let threads = rayon::current_num_threads();
        let reference = match scene.converged {
            None => reference_cost(body, cases, threads)?,
            // the finer mesh comes on top, at another time
            Some(scene::Converged { halvings, elevations }) => {
                let finer = reference_cost(&body.refined(elevations, halvings)?, cases, threads)?;
                reference_cost(body, cases, threads)?.and(finer)
            }
        };
        let springs = SpringCost::of(body, lattice, optimiser, settings, fitted, distinct);
        Ok(Self {
            bytes: reference.bytes.max(springs.bytes),
            seconds: reference.seconds + springs.seconds / threads as f64,
            reference,
            springs,
        })
    }
}

/// What the reference costs.
struct ReferenceCost {
    bytes: usize,
    factor_entries: usize,
    seconds: f64,
}

impl ReferenceCost {
    /// The cost of this one and, afterwards, another.
    fn and(self, other: Self) -> Self {
        Self {
            bytes: self.bytes.max(other.bytes),
            factor_entries: self.factor_entries,
            seconds: self.seconds + other.seconds,
        }
    }
}

/// The cost of the path that the reference will take.
fn reference_cost(body: &Body, cases: usize, threads: usize) -> Result<ReferenceCost> {
    let points = body.integration_points()?;
    let unknowns = body.dofs.len();
    if let (None, Some((patch, extra))) = (reference::reason_to_factor(&points, &body.dofs), points.splines()) {
        let bytes = memory_bytes(patch, extra, unknowns, cases, threads);
        let seconds = (ITERATED_SECONDS * cases as f64 + ESTIMATED_SECONDS) * unknowns as f64;
        return Ok(ReferenceCost { bytes, factor_entries: 0, seconds });
    }
    let order = body.reference_order(&points)?;
    let pattern = stiffness::pattern(&points, &body.dofs);
    let symbolic = Symbolic::analyse(&pattern, order)?;
    Ok(ReferenceCost {
        bytes: symbolic.factor_bytes() + 16 * pattern.entries(),
        factor_entries: symbolic.factor_entries(),
        seconds: cases as f64 * symbolic.factor_flops() / RATE,
    })
}

/// What the springs and their calibration cost.
struct SpringCost {
    bytes: usize,
    factor_entries: usize,
    /// On one thread.
    seconds: f64,
}

impl SpringCost {
    /// The cost of the path that the lattice has chosen; `distinct` holds the groups of each problem.
    fn of(
        body: &Body,
        lattice: &Lattice,
        optimiser: &Optimiser,
        settings: &Settings,
        fitted: usize,
        distinct: &[usize],
    ) -> Self {
        let (unknowns, springs) = (body.dofs.len(), lattice.network.springs.len());
        let most = distinct.iter().copied().max().unwrap_or(0);
        let Some(symbolic) = &lattice.symbolic else {
            let basis = Galerkin::bytes(unknowns, springs, reduced::capacity(fitted, most));
            let solves: usize = distinct.iter().map(|groups| fitted * (GRID_SOLVES + 2 * groups)).sum();
            // load cases travel together, and the derivatives of one
            let further = fitted.max(most.saturating_sub(1)).clamp(1, TOGETHER) - 1;
            let solver = (GRID_BYTES + GRID_COLUMN_BYTES * further) * unknowns;
            return Self {
                bytes: solver + NETWORK_BYTES * springs + Members::bytes(springs) + basis,
                factor_entries: 0,
                seconds: GRID_SECONDS * unknowns as f64 * solves as f64,
            };
        };
        // a factor in f32 takes half of one in f64, and its matrix is kept beside it
        let worker = match lattice.choice.path {
            Path::Single | Path::Stale => symbolic.factor_bytes() / 2 + 8 * symbolic.lower_rows().len(),
            _ => symbolic.factor_bytes(),
        };
        let surrogate = match optimiser.name {
            "surrogate" if surrogate::reduces(unknowns, fitted, most) => {
                let basis = Galerkin::bytes(unknowns, springs, surrogate::capacity(fitted, most));
                settings.chains * (basis + 8 * unknowns * surrogate::certified(fitted, most) + symbolic.factor_bytes())
            }
            _ => 0,
        };
        let evaluations: u64 = match () {
            () if optimiser.name == "gauss_newton" && reduced::serves(unknowns, fitted, most) => {
                (distinct.len() * GRID_SOLVES) as u64
            }
            () => distinct.iter().map(|&groups| (optimiser.expected_evaluations)(settings, groups)).sum(),
        };
        Self {
            bytes: rayon::current_num_threads() * worker
                + 16 * symbolic.lower_rows().len() * distinct.len()
                + surrogate,
            factor_entries: symbolic.factor_entries(),
            seconds: evaluations as f64 * (symbolic.factor_flops() / RATE + 2e-5),
        }
    }
}

fn steps(
    scene: &Scene,
    method: &Method,
    factor_entries: [usize; 2],
    [fitted, cases]: [usize; 2],
    problems: usize,
) -> Vec<String> {
    let dynamics = match &scene.dynamics {
        None => "no masses, no damping: the scene has no [dynamics]".to_owned(),
        Some(dynamics) => motion::announce(dynamics, scene.reference.kinematics),
    };
    let converged = scene
        .converged
        .as_ref()
        .map(|finer| format!("converged reference: {} halving(s), {} elevation(s)", finer.halvings, finer.elevations));
    let [reference, springs] = factor_entries.map(|entries| entries > 0);
    let reference = if reference { "one factorisation" } else { "conjugate gradients without a matrix" };
    let springs = if springs { "one analysis of their matrix" } else { "multigrid without a matrix" };
    let mut steps = vec![
        match large::is_asked(scene) {
            true => format!(
                "reference: {} with {cases} load case(s), each in {} steps of the load by Newton's method",
                method.name, scene.reference.load_steps
            ),
            false => format!("reference: {} with {cases} load case(s), {reference}", method.name),
        },
        format!("springs: topology \"{}\", grouping \"{}\", {springs}", scene.springs.topology, scene.springs.grouping),
        format!(
            "calibration: {}, {} on {problems} problem(s), {fitted} fitted load case(s), {} held out",
            scene.calibration.objective,
            scene.calibration.source(),
            cases - fitted
        ),
        dynamics,
    ];
    steps.splice(1..1, converged);
    let budget = scene.budget.as_ref().map(|budget| {
        let step = budget.step_time.map_or(String::new(), |seconds| format!(" and {seconds:e} s a step"));
        format!(
            "budget: {} %{step}; all of this at one resolution after the other, from the coarsest, until it is met",
            budget.max_error
        )
    });
    steps.extend(budget);
    steps
}
