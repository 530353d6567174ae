//! The spring network of a scene on the nodes of its body, analysed once.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::scene::{Scene, Springs};
use crate::sparse::cholesky::Symbolic;
use crate::springs::affine;
use crate::springs::grouping::{self, Request};
use crate::springs::mechanism;
use crate::springs::network::Network;
use crate::springs::profiles::{self, Profile};
use crate::springs::solver::{self, Choice, GridSprings, Path};
use crate::springs::topology::{self, Topology};
use crate::springs::{bounds, edge_list, weighting};

use super::body::Body;
use super::continuum::Continuum;
use super::limits::Allowance;
use super::matrix_profile;
use super::springs_file::{self, FromFile};

/// Free degrees of freedom in space from which multigrid is tried.
const MULTIGRID_FROM: usize = 20_000;

/// The topology that knows the most springs of a grid: listed ones keep their kind, step and cells.
const WIDEST: &str = "second_ring";

/// A trial solve to this residual that takes more than so many iterations makes a body too hard for multigrid.
const TRIAL_TOLERANCE: f64 = 1e-6;
const TRIAL_ITERATIONS: usize = 60;

/// How a scene wants K(phi) u = f solved.
pub fn settings(scene: &Scene) -> solver::Settings {
    solver::Settings { path: scene.solver.path, tolerance: scene.solver.tolerance }
}

/// A network with what all its groupings share.
pub struct Lattice {
    /// The springs.
    pub network: Network,
    /// The analysis of the pattern of K(phi); none on the multigrid path.
    pub symbolic: Option<Arc<Symbolic>>,
    /// How K(phi) u = f is solved, and why.
    pub choice: Choice,
    /// p_s: the factor that the profile gives every spring.
    pub factors: Vec<f64>,
    /// k_s = phi w_s: the coefficient of every spring.
    pub coefficients: Vec<f64>,
    /// Upper bound (4.19) of every spring, N/m.
    pub spring_bounds: Vec<f64>,
    /// Stiffness and groups, where the network comes from a file that has them.
    pub from_file: Option<FromFile>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Keeps the entries whose flag is set.
pub(super) fn retain<T>(list: &mut Vec<T>, kept: &[bool]) {
    assert_eq!(list.len(), kept.len(), "one word for every entry");
    let mut flags = kept.iter();
    list.retain(|_| *flags.next().expect("as many as entries"));
}

/// Builds the network and checks that it is none that moves without resistance.
///
/// # Errors
/// [`Error::Mechanism`] with the loose nodes; [`Error::OverLimit`]; [`Error::Input`] for an unknown topology.
pub fn build(scene: &Scene, body: &Body) -> Result<Lattice> {
    let lattice = connect(scene, body)?;
    let fine = body.dofs.len() >= MULTIGRID_FROM && body.dofs.dimension() == 3;
    match (scene.solver.path, fine) {
        (Path::Multigrid, _) => match lattice.try_grid(body) {
            Ok(reason) => Ok(lattice.on_grid(reason)),
            Err(reason) => {
                let message = format!("multigrid does not fit: {reason}");
                Err(Error::input("solver.path", message, "use auto, direct, single or stale"))
            }
        },
        (Path::Auto, true) => match lattice.try_grid(body) {
            Ok(reason) => Ok(lattice.on_grid(reason)),
            Err(reason) => lattice.analysed(scene, body, Some(&reason)),
        },
        _ => lattice.analysed(scene, body, None),
    }
}

/// The springs of a scene, not checked and without a path of solution.
///
/// # Errors
/// [`Error::Input`] for an unknown topology.
pub fn connect(scene: &Scene, body: &Body) -> Result<Lattice> {
    let (network, from_file) = match &scene.calibration.springs {
        Some(path) => {
            let (known, bare) = (network_of(named(WIDEST)?, body), network_of(named("list")?, body));
            let (network, from_file) = springs_file::network(path, body, &known, bare)?;
            (network, Some(from_file))
        }
        None => (with_edges(network_of(named(&scene.springs.topology)?, body), scene, body)?, None),
    };
    let profile = profile(scene)?;
    let fitted = match profile.needs_matrix {
        true => matrix_profile::factors(body, &network, scene.springs.weighting)?,
        false => Vec::new(),
    };
    let factors = (profile.factor)(&network, &fitted);
    let coefficients = weighting::coefficients(&network, scene.springs.weighting, &factors);
    let measures = match &body.continuum {
        Continuum::Splines { patch, .. } => {
            bounds::node_measures(&patch.grid(), patch.points(), &body.dofs, body.thickness)
        }
        Continuum::Elements { mesh, .. } => bounds::node_measures_of_mesh(mesh, &body.dofs, body.thickness),
    };
    let spring_bounds = bounds::spring_bounds(&network, &measures, scene.material.young, scene.material.poisson);
    let mut warnings = Vec::new();
    if network.zero_length > 0 {
        warnings.push(format!(
            "{} springs between coincident nodes have no direction and were left out",
            network.zero_length
        ));
    }
    let choice = Choice { path: Path::Multigrid, reason: String::new() };
    Ok(Lattice { network, symbolic: None, choice, factors, coefficients, spring_bounds, from_file, warnings })
}

/// The topology of this name.
fn named(name: &str) -> Result<&'static Topology> {
    topology::find(name).ok_or_else(|| {
        Error::input("springs.topology", format!("there is no topology {name}"), "see `springfit list topologies`")
    })
}

/// The network with the springs that the scene names.
fn with_edges(mut network: Network, scene: &Scene, body: &Body) -> Result<Network> {
    let Springs { edges, edge_file, .. } = &scene.springs;
    let from_file = edge_file.as_deref().map(edge_list::read).transpose()?.unwrap_or_default();
    if edges.is_empty() && from_file.is_empty() {
        return Ok(network);
    }
    let known = network_of(named(WIDEST)?, body);
    let grid = body.grid();
    for (key, pairs) in [("springs.edges", edges), ("springs.edge_file", &from_file)] {
        edge_list::add(&mut network, pairs, key, &known, grid.as_ref(), &body.dofs)?;
    }
    Ok(network)
}

/// The profile of a scene.
///
/// # Errors
/// [`Error::Input`] for an unknown name.
pub fn profile(scene: &Scene) -> Result<&'static Profile> {
    let name = scene.springs.profile();
    profiles::find(name).ok_or_else(|| {
        Error::input("springs.profile", format!("there is no profile {name}"), "see `springfit list profiles`")
    })
}

/// The springs of a topology: on the control grid of a patch, along the cells of a mesh.
fn network_of(topology: &Topology, body: &Body) -> Network {
    match &body.continuum {
        Continuum::Splines { patch, .. } => (topology.connect)(&patch.grid(), patch.points(), &body.dofs),
        Continuum::Elements { mesh, grid, .. } => (topology.connect_mesh)(mesh, grid.as_ref(), &body.dofs),
    }
}

impl Lattice {
    /// Keeps only some springs; the analysis stays, for its pattern contains theirs.
    ///
    /// # Panics
    /// When there is not one word for every spring.
    pub fn retain(&mut self, kept: &[bool]) {
        retain(&mut self.network.springs, kept);
        retain(&mut self.factors, kept);
        retain(&mut self.coefficients, kept);
        retain(&mut self.spring_bounds, kept);
    }

    fn on_grid(mut self, reason: String) -> Self {
        self.choice = Choice { path: Path::Multigrid, reason };
        self
    }

    /// A trial of multigrid with k = 1 for every spring: why to take it, or why not.
    fn try_grid(&self, body: &Body) -> std::result::Result<String, String> {
        let kinds = (grouping::find("kind").expect("the table has it").group)(&self.network, &Request::default())
            .map_err(|error| error.to_string())?;
        let grid = body.grid().ok_or("the nodes do not lie on a grid")?;
        let ones = vec![1.0; self.network.springs.len()];
        let springs =
            GridSprings { network: &self.network, grid, dofs: &body.dofs, coefficients: &ones, grouping: kinds };
        let mut worker = springs.worker().map_err(|refusal| refusal.to_string())?;
        worker.set(&vec![1.0; springs.grouping.groups.len()]);
        let forces: Vec<f64> = (0..body.dofs.len()).map(|dof| 1.0 + body.dofs.owner(dof).1 as f64).collect();
        let mut trial = vec![0.0; forces.len()];
        let report = worker
            .solve(&forces, &mut trial, TRIAL_TOLERANCE)
            .map_err(|_| format!("a trial did not reach {TRIAL_TOLERANCE:.0e}"))?;
        if report.iterations > TRIAL_ITERATIONS {
            return Err(format!("a trial took {} iterations", report.iterations));
        }
        Ok(format!(
            "{} unknowns on a grid in space; a trial took {} iterations to {TRIAL_TOLERANCE:.0e}",
            forces.len(),
            report.iterations
        ))
    }

    /// The lattice on a path with factors: analysed, and checked for loose nodes. `instead`: why not multigrid.
    ///
    /// # Errors
    /// [`Error::Mechanism`] with the loose nodes; [`Error::OverLimit`] for a factor that does not fit.
    pub fn analysed(mut self, scene: &Scene, body: &Body, instead: Option<&str>) -> Result<Self> {
        let pattern = affine::pattern(&self.network, &body.dofs);
        let symbolic = Symbolic::analyse(&pattern, body.spring_order(&self.network, &pattern)?)?;
        Allowance::of(scene)?.admit("one factor of the springs", symbolic.factor_bytes() as f64)?;
        self.choice = solver::choose(&settings(scene), &symbolic);
        if let Some(instead) = instead {
            self.choice.reason += &format!("; not multigrid: {instead}");
        }
        let all = vec![true; self.network.springs.len()];
        mechanism::check("spring network", &self.network, &all, &body.dofs, &symbolic)?;
        self.symbolic = Some(symbolic);
        Ok(self)
    }
}
