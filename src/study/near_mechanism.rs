//! Whether a fit has opened the network: the motion that it resists least, beside the continuum.

use serde::Serialize;

use crate::calibration::softest::{Softest, linear_loads, softest};
use crate::calibration::sweep::SweepProblem;
use crate::error::{Error, Result};
use crate::readable::{short, significant};
use crate::reference::{Reference, statics, stiffness};
use crate::sparse::cholesky::Symbolic;
use crate::springs::solver::{SpringOperator, SpringSolver};

use super::body::Body;

/// A network on which some load that is linear in the place does so many times the work that it does on the continuum is
/// open: nearly a mechanism.
pub const NEARLY: f64 = 2.0;

/// Most free degrees of freedom for which the reference is factored once more.
const LARGEST: usize = 20_000;

/// A node that moves more than this part of the node that moves most takes part in a motion.
const PART: f64 = 0.5;

/// The motion that a network resists least, or why nobody looked for it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Weakness {
    /// It was found.
    Found(Weakest),
    /// The network has no accurate answer to some of the loads that were tried: it gives way without end.
    Mechanism {
        /// True.
        near_mechanism: bool,
        /// 0.
        stiffness_ratio: f64,
    },
    /// It was not looked for.
    NotLookedFor {
        /// Why.
        not_looked_for: &'static str,
    },
}

/// The motion that a network resists least.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Weakest {
    /// How many times the work that it does on the continuum the load does that the network resists least, among those
    /// that are linear in the place: mu of [`crate::calibration::softest`].
    pub compliance_ratio: f64,
    /// 1 / mu: the smallest eigenvalue of K(phi) relative to K_ref.
    pub stiffness_ratio: f64,
    /// True when the network is nearly a mechanism.
    pub near_mechanism: bool,
    /// The node that moves most.
    pub node: usize,
    /// The smallest box around the nodes that move at least half as much, m.
    pub region: [[f64; 3]; 2],
    /// How many nodes these are.
    pub nodes: usize,
    /// Loads that were tried.
    pub loads: usize,
}

/// Looks for it. `solver` holds K(phi) of the problem.
///
/// # Errors
/// Those of the integration and the solution of the reference.
pub fn weakness(
    body: &Body,
    reference: &Reference,
    problem: &SweepProblem,
    solver: &mut SpringSolver,
) -> Result<Weakness> {
    let not_looked_for = |why| Ok(Weakness::NotLookedFor { not_looked_for: why });
    let (SpringOperator::Assembled { .. }, Some(stiffness)) = (&problem.operator, &reference.stiffness) else {
        return not_looked_for("no factors are at hand: springs or reference are solved by iterations");
    };
    if body.dofs.len() > LARGEST {
        return not_looked_for("the reference would have to be factored once more");
    }
    let points = body.integration_points()?;
    let pattern = stiffness::pattern(&points, &body.dofs);
    let symbolic = Symbolic::analyse(&pattern, body.reference_order(&points)?)?;
    let loads = linear_loads(body.positions(), &body.dofs);
    let columns: Vec<&[f64]> = loads.chunks_exact(body.dofs.len()).collect();
    let answers = statics::solve(stiffness, &symbolic, &columns)?.displacements.concat();
    match softest(solver, loads, answers) {
        Ok(found) => Ok(Weakness::Found(Weakest::of(body, found))),
        Err(Error::Inaccurate { .. } | Error::NotPositiveDefinite { .. }) => {
            Ok(Weakness::Mechanism { near_mechanism: true, stiffness_ratio: 0.0 })
        }
        Err(other) => Err(other),
    }
}

impl Weakest {
    fn of(body: &Body, Softest { ratio, motion, loads }: Softest) -> Self {
        let moved: Vec<f64> =
            body.dofs.expand(&motion).iter().map(|u| u.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
        let (node, most) =
            moved.iter().enumerate().fold((0, 0.0), |best, (node, &u)| if u > best.1 { (node, u) } else { best });
        let taking_part = moved.iter().zip(body.positions()).filter(|(u, _)| **u >= PART * most);
        let mut region = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let mut nodes = 0;
        for (_, x) in taking_part {
            nodes += 1;
            for (a, x) in x.iter().enumerate() {
                region[0][a] = region[0][a].min(*x);
                region[1][a] = region[1][a].max(*x);
            }
        }
        let near_mechanism = ratio > NEARLY;
        Self { compliance_ratio: ratio, stiffness_ratio: 1.0 / ratio, near_mechanism, node, region, nodes, loads }
    }
}

impl Weakness {
    /// A word where the network is nearly a mechanism.
    pub fn warning(&self) -> Option<String> {
        let found = match self {
            Self::Found(found) => found,
            Self::NotLookedFor { .. } => return None,
            Self::Mechanism { .. } => {
                let words = "the network is a mechanism for some smooth load that was not fitted: fit more load cases, use \
                             fewer groups, or set calibration.regularisation";
                return Some(words.into());
            }
        };
        let [low, high] = found.region.map(|corner| corner.map(short).join(", "));
        found.near_mechanism.then(|| {
            format!(
                "the network is nearly a mechanism: it gives way {} times as far as the continuum to the smooth load that \
                 it resists least (stiffness ratio {}); {} nodes between ({low}) and ({high}) m move, node {} most; fit \
                 more load cases, use fewer groups, or set calibration.regularisation",
                significant(found.compliance_ratio, 2),
                significant(found.stiffness_ratio, 2),
                found.nodes,
                found.node
            )
        })
    }
}
