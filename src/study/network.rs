//! The spring network of a scene on the control points of its body, analysed once.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::ordering::nested_dissection;
use crate::springs::affine::{self, AffineStiffness};
use crate::springs::grouping;
use crate::springs::network::Network;
use crate::springs::{bounds, topology, weighting};

use super::body::Body;

/// A pivot below this fraction of its diagonal entry is zero up to rounding.
const LOOSE: f64 = 1e-13;

/// A network with what all its groupings share.
pub struct Lattice {
    /// The springs.
    pub network: Network,
    /// The analysis of the pattern of K(phi).
    pub symbolic: Arc<Symbolic>,
    /// k_s = phi w_s: the coefficient of every spring.
    pub coefficients: Vec<f64>,
    /// Upper bound (4.19) of every spring, N/m.
    pub spring_bounds: Vec<f64>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Builds the network and checks that it is none that moves without resistance.
///
/// # Errors
/// [`Error::Mechanism`] with a loose node; [`Error::Input`] for an unknown topology.
pub fn build(scene: &Scene, body: &Body) -> Result<Lattice> {
    let name = &scene.springs.topology;
    let topology = topology::find(name).ok_or_else(|| {
        Error::input("springs.topology", format!("there is no topology {name}"), "see `springfit list topologies`")
    })?;
    let (grid, positions) = (body.grid(), body.patch.points());
    let network = (topology.connect)(&grid, positions, &body.dofs);
    let coefficients = weighting::coefficients(&network, scene.springs.weighting, scene.springs.law);
    let measures = bounds::node_measures(&grid, positions, &body.dofs, body.thickness);
    let spring_bounds = bounds::spring_bounds(&network, &measures, scene.material.young, scene.material.poisson);
    let order = body.dofs.order(&nested_dissection(grid.extents(), 1, body.closed()));
    let symbolic = Symbolic::analyse(&affine::pattern(&network, &body.dofs), order)?;
    let mut warnings = Vec::new();
    if network.zero_length > 0 {
        warnings.push(format!(
            "{} springs between coincident control points have no direction and were left out",
            network.zero_length
        ));
    }
    let lattice = Lattice { network, symbolic, coefficients, spring_bounds, warnings };
    lattice.check_stiff(body)?;
    Ok(lattice)
}

impl Lattice {
    /// Factors the network with k = 1 for every spring: a pivot that vanishes names a loose node.
    fn check_stiff(&self, body: &Body) -> Result<()> {
        let kinds = (grouping::find("kind").expect("the table has it").group)(&self.network, 0.0)?;
        let ones = vec![1.0; self.network.springs.len()];
        let stiffness = AffineStiffness::new(&self.network, &kinds, &ones, &body.dofs, &self.symbolic);
        let mut factor = Factor::new(Arc::clone(&self.symbolic));
        stiffness.assemble_into(&vec![1.0; kinds.groups.len()], factor.values_mut());
        let loose = match factor.refactor() {
            Err(Error::NotPositiveDefinite { dof }) => Some(dof),
            Err(other) => return Err(other),
            Ok(()) => {
                let (dof, ratio) = factor.weakest_pivot();
                (ratio.is_nan() || ratio < LOOSE).then_some(dof)
            }
        };
        match loose {
            None => Ok(()),
            Some(dof) => {
                let (node, component) = body.dofs.owner(dof);
                Err(Error::Mechanism { what: "spring network".into(), node, direction: ['x', 'y', 'z'][component] })
            }
        }
    }
}
