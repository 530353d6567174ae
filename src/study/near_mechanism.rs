//! Whether a fit has opened the network: the motion that it resists least, beside the continuum.

use serde::Serialize;

use crate::calibration::softest::{Softest, softest};
use crate::calibration::sweep::SweepProblem;
use crate::error::Result;
use crate::reference::Reference;
use crate::springs::solver::{SpringOperator, SpringSolver};

use super::body::Body;

/// A network that some load moves so many times as far as the continuum is nearly a mechanism.
pub const NEARLY: f64 = 30.0;

/// A node that moves more than this part of the node that moves most takes part in a motion.
const PART: f64 = 0.5;

/// The motion that a network resists least, or why nobody looked for it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Weakness {
    /// It was found.
    Found(Weakest),
    /// It was not looked for.
    NotLookedFor {
        /// Why.
        not_looked_for: &'static str,
    },
}

/// The motion that a network resists least.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Weakest {
    /// How many times as far as the continuum the network moves under the forces that it resists least: mu of
    /// [`crate::calibration::softest`].
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
    /// Solves that were needed.
    pub solves: usize,
}

/// Looks for it. `solver` holds K(phi) of the problem.
///
/// # Errors
/// Where a solve is not accurate.
pub fn weakness(
    body: &Body,
    reference: &Reference,
    problem: &SweepProblem,
    solver: &mut SpringSolver,
) -> Result<Weakness> {
    let not_looked_for = |why| Ok(Weakness::NotLookedFor { not_looked_for: why });
    let SpringOperator::Assembled { .. } = problem.operator else {
        return not_looked_for("the springs are solved by iterations, and the search would take longer than the fit");
    };
    let Some(stiffness) = &reference.stiffness else {
        return not_looked_for("the stiffness of the reference is not stored");
    };
    let continuum = |x: &[f64], out: &mut [f64]| {
        for (out, row) in out.iter_mut().zip(stiffness.row_iter()) {
            *out = row.col_indices().iter().zip(row.values()).map(|(&column, value)| value * x[column]).sum();
        }
        Ok(())
    };
    Ok(Weakness::Found(Weakest::of(body, softest(solver, &continuum)?)))
}

impl Weakest {
    fn of(body: &Body, Softest { ratio, motion, solves }: Softest) -> Self {
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
        Self { compliance_ratio: ratio, stiffness_ratio: 1.0 / ratio, near_mechanism, node, region, nodes, solves }
    }
}

impl Weakness {
    /// A word where the network is nearly a mechanism.
    pub fn warning(&self) -> Option<String> {
        let Self::Found(found) = self else { return None };
        let [low, high] = found.region.map(|corner| corner.map(|x| format!("{x:.3}")).join(", "));
        found.near_mechanism.then(|| {
            format!(
                "the network is nearly a mechanism: under the forces that it resists least it moves {:.0} times as far as \
                 the continuum (stiffness ratio {:.1e}), {} nodes between ({low}) and ({high}) m, node {} most; fit more \
                 load cases, use fewer groups, or set calibration.regularisation",
                found.compliance_ratio, found.stiffness_ratio, found.nodes, found.node
            )
        })
    }
}
