//! Whether a fit has opened the network: the motion that it resists least, beside the continuum.

use serde::Serialize;

use crate::calibration::objectives;
use crate::calibration::softest::{Softest, linear_loads, softest};
use crate::calibration::sweep::SweepProblem;
use crate::error::{Error, Result};
use crate::reference::{Reference, statics, stiffness};
use crate::scene::Scene;
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

/// What to do about a network of so many groups that a fit has opened: what the objective of the scene listens to.
pub fn advice(scene: &Scene, groups: usize) -> String {
    let objective = objectives::find(&scene.calibration.objective);
    let mut ways: Vec<&str> = objective.map_or(vec![], |goal| goal.against_mechanisms.to_vec());
    if groups > 1 && scene.calibration.objective != "formula" {
        ways.push("use fewer groups");
    }
    if scene.takes_regularisation() {
        let given = scene.regularisation() > 0.0;
        ways.push(if given { "raise calibration.regularisation" } else { "set calibration.regularisation" });
    }
    match ways.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, [first])) => format!("{first} or {last}"),
        Some((last, before)) => format!("{}, or {last}", before.join(", ")),
        None => String::new(),
    }
}

impl Weakness {
    /// A word where the network is nearly a mechanism; `advice` is what to do about it.
    pub fn warning(&self, advice: &str) -> Option<String> {
        let found = match self {
            Self::Found(found) => found,
            Self::NotLookedFor { .. } => return None,
            Self::Mechanism { .. } => {
                return Some(format!("the network is a mechanism for some smooth load: {advice}"));
            }
        };
        let [low, high] = found.region.map(|corner| corner.map(|x| format!("{x:.3}")).join(", "));
        found.near_mechanism.then(|| {
            format!(
                "the network is nearly a mechanism: it gives way {:.1} times as far as the continuum to the smooth load that \
                 it resists least (stiffness ratio {:.2}); {} nodes between ({low}) and ({high}) m move, node {} most; \
                 {advice}",
                found.compliance_ratio, found.stiffness_ratio, found.nodes, found.node
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Source, parse};

    /// The advice for a square whose `[calibration]` and other tables are given.
    fn advice_for(tables: &str, groups: usize) -> String {
        let text = format!(
            "[geometry]\nshape = \"square\"\n[material]\nyoung = 1e4\npoisson = 0.3\n[support]\nfaces = [\"y-\"]\n[[load]]\n\
             force_per_node = [1.0, 0.0]\n{tables}\n"
        );
        advice(&parse(&Source { name: "a".into(), text }).expect("a scene"), groups)
    }

    #[test]
    fn advice_is_what_the_objective_listens_to() {
        let cases = [
            ("", 3, "fit more load cases, use fewer groups, or set calibration.regularisation"),
            ("", 1, "fit more load cases or set calibration.regularisation"),
            (
                "[calibration]\nregularisation = 0.5",
                3,
                "fit more load cases, use fewer groups, or raise calibration.regularisation",
            ),
            ("[calibration]\noptimiser = \"surrogate\"", 3, "fit more load cases or use fewer groups"),
            (
                "[calibration]\nobjective = \"matrix\"",
                3,
                "fit the displacements (calibration.objective = \"displacement\") or use fewer groups",
            ),
            (
                "[calibration]\nobjective = \"acceleration\"",
                1,
                "add snapshots that deform the body in other ways or fit the displacements (calibration.objective = \"displacement\")",
            ),
            (
                "[calibration]\nobjective = \"formula\"\nformula = \"lloyd\"",
                3,
                "fit the displacements (calibration.objective = \"displacement\")",
            ),
        ];
        for (tables, groups, expected) in cases {
            assert_eq!(advice_for(tables, groups), expected, "{tables}");
        }
    }

    /// No objective but that of displacements looks at load cases or takes a prior.
    #[test]
    fn no_warning_tells_to_turn_what_is_not_connected() {
        let open = Weakness::Mechanism { near_mechanism: true, stiffness_ratio: 0.0 };
        for goal in objectives::OBJECTIVES.iter().filter(|goal| goal.name != "displacement") {
            let formula = if goal.name == "formula" { "formula = \"lloyd\"" } else { "" };
            let tables = format!("[calibration]\nobjective = \"{}\"\n{formula}", goal.name);
            let told = open.warning(&advice_for(&tables, 4)).expect("a word");
            assert!(!told.contains("load cases") && !told.contains("regularisation"), "{told}");
        }
    }
}
