//! What a scene would build, before the work: sizes, memory, time, warnings.
//!
//! The body, the patterns and their analyses are really made (they are cheap); nothing is assembled or factored. Memory
//! counts the factors of both systems and one spring factor for every thread; time counts floating-point operations.

use serde::Serialize;

use crate::calibration::sweep;
use crate::error::Result;
use crate::reference::matrix_free::solve::memory_bytes;
use crate::reference::methods::Method;
use crate::reference::{self, stiffness};
use crate::scene::Scene;
use crate::sparse::cholesky::Symbolic;

use super::body::Body;
use super::network::Lattice;
use super::{body, fit, loads, motion, network};

/// Floating-point operations a second and core that supernodal factorisations of these sizes reach on a common machine;
/// for estimates only.
const RATE: f64 = 1e10;

/// Bytes of the multigrid path, and seconds of one solve on one thread, for each unknown; for estimates only.
const GRID_BYTES: usize = 600;
const GRID_SECONDS: f64 = 2e-6;

/// Seconds of the iterated reference for each unknown and load case; for estimates only.
const ITERATED_SECONDS: f64 = 2e-5;

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
    let body = body::build(scene)?;
    let scene = body.resolved.clone();
    let loads = loads::build(&scene, &body)?;
    let lattice = network::build(&scene, &body)?;
    let (gammas, groupings) = fit::group(&scene, &lattice)?;
    let same = sweep::first_equal(&groupings);
    let distinct: Vec<usize> = (0..same.len()).filter(|&i| same[i] == i).map(|i| groupings[i].groups.len()).collect();
    let problems = distinct.len();
    let (optimiser, settings) = fit::optimiser(&scene)?;
    let threads = rayon::current_num_threads();
    let reference = reference_cost(&body, threads)?;
    let evaluations =
        distinct.iter().map(|&groups| (optimiser.expected_evaluations)(&settings, groups)).sum::<u64>() as f64;
    let groups = groupings.iter().map(|g| g.groups.len()).max().unwrap_or(0);
    let (spring_entries, spring_bytes, evaluation) = match &lattice.symbolic {
        Some(symbolic) => {
            let bytes = threads * symbolic.factor_bytes() + 16 * symbolic.lower_rows().len() * problems;
            (symbolic.factor_entries(), bytes, (symbolic.factor_flops() / RATE + 2e-5) / threads as f64)
        }
        None => {
            let unknowns = body.dofs.len();
            (0, GRID_BYTES * unknowns, GRID_SECONDS * unknowns as f64 * groups as f64 / threads as f64)
        }
    };
    let memory_bytes = reference.bytes.max(spring_bytes);
    let seconds = reference.seconds * loads.len() as f64 + evaluations * evaluation;
    let safe_step = motion::limits::before_calibration(&scene, &body, &lattice, &groupings)?;
    Ok(Plan {
        safe_step,
        sizes: Sizes::of(&body, &lattice, groups),
        sweep: gammas.into_iter().zip(groupings.iter().map(|g| g.groups.len())).collect(),
        problems,
        factor_entries: [reference.factor_entries, spring_entries],
        memory_bytes,
        seconds,
        steps: steps(
            &scene,
            body.method,
            loads.iter().filter(|case| case.fit).count(),
            loads.len(),
            optimiser.name,
            problems,
        ),
        warnings: body.warnings.iter().chain(&lattice.warnings).cloned().collect(),
        scene,
    })
}

/// What the reference costs.
struct ReferenceCost {
    bytes: usize,
    factor_entries: usize,
    seconds: f64,
}

/// The cost of the path that the reference will take.
fn reference_cost(body: &Body, threads: usize) -> Result<ReferenceCost> {
    let points = body.integration_points()?;
    let unknowns = body.dofs.len();
    if let (None, Some((patch, extra))) = (reference::reason_to_factor(&points, &body.dofs), points.splines()) {
        let bytes = memory_bytes(patch, extra, unknowns, threads);
        return Ok(ReferenceCost { bytes, factor_entries: 0, seconds: ITERATED_SECONDS * unknowns as f64 });
    }
    let order = body.reference_order(&points)?;
    let pattern = stiffness::pattern(&points, &body.dofs);
    let symbolic = Symbolic::analyse(&pattern, order)?;
    Ok(ReferenceCost {
        bytes: symbolic.factor_bytes() + 16 * pattern.entries(),
        factor_entries: symbolic.factor_entries(),
        seconds: symbolic.factor_flops() / RATE,
    })
}

fn steps(scene: &Scene, method: &Method, fitted: usize, cases: usize, optimiser: &str, problems: usize) -> Vec<String> {
    let dynamics = match &scene.dynamics {
        None => "no masses, no damping: the scene has no [dynamics]".to_owned(),
        Some(dynamics) => motion::announce(dynamics),
    };
    vec![
        format!("reference: {} with {cases} load case(s), one factorisation", method.name),
        format!(
            "springs: topology \"{}\", grouping \"{}\", one analysis",
            scene.springs.topology, scene.springs.grouping
        ),
        format!(
            "calibration: {optimiser} on {problems} problem(s), {fitted} fitted load case(s), {} held out",
            cases - fitted
        ),
        dynamics,
    ]
}
