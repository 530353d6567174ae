//! Whether a fit has opened the network: what moves where it is softest beside the continuum.
//!
//! A fit on few loads may take springs away that no fitted load needs, and open the network for others. The compliance ratio
//! under the loads that are linear in the place (pulls, twists, stretches and shears) tells: on the merged torus it is 2.4 to 3.7
//! for fits on the load of the source alone, whose errors on other loads are 20 to 78 %, and 1.0 to 1.4 for fits on
//! four loads, with 14 to 20 %. Quadratic loads tell less sharply: springs follow them less well, and they find 2.1 on the
//! soundest of these networks (7.7 on the most open).

use serde::Serialize;

use crate::calibration::objectives;
use crate::readable::{short, significant};
use crate::scene::Scene;

use super::body::Body;
use super::generalisation::Generalisation;

/// A network on which some linear load does so many times the work that it does on the continuum is open: nearly a mechanism.
pub const NEARLY: f64 = 2.0;

/// A node that moves more than this part of the node that moves most takes part in a motion.
const PART: f64 = 0.5;

/// The nodes that take part in a motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moving {
    /// The node that moves most.
    pub node: usize,
    /// The smallest box around the nodes that move at least half as much, m.
    pub region: [[f64; 3]; 2],
    /// How many nodes these are.
    pub nodes: usize,
}

impl Moving {
    /// Those of a motion over the free degrees of freedom.
    pub(super) fn of(body: &Body, motion: &[f64]) -> Self {
        let moved: Vec<f64> =
            body.dofs.expand(motion).iter().map(|u| u.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
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
        Self { node, region, nodes }
    }
}

/// What to do about a network of so many groups that is open: what the objective of the scene listens to.
pub fn advice(scene: &Scene, groups: usize) -> String {
    let objective = objectives::find(&scene.calibration.objective);
    let mut ways: Vec<&str> = objective.map_or(vec![], |goal| goal.against_mechanisms.to_vec());
    if groups > 1 && scene.calibration.optimiser().is_some() {
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

impl Generalisation {
    /// A word where the network is nearly a mechanism; `advice` is what to do about it.
    pub fn warning(&self, advice: &str) -> Option<String> {
        let found = match self {
            Self::Measured(found) => found,
            Self::NotLookedFor { .. } => return None,
            Self::Mechanism { .. } => {
                return Some(format!(
                    "the network is a mechanism for some smooth load that is not in the scene: {advice}"
                ));
            }
        };
        let [low, high] = found.moving.region.map(|corner| corner.map(short).join(", "));
        found.near_mechanism.then(|| {
            format!(
                "the network is nearly a mechanism: it gives way {} times as far as the continuum to the smooth load for which it is \
                 softest, {}; {} nodes between ({low}) and ({high}) m move, node {} most; {advice}",
                significant(found.softest.compliance_ratio, 2),
                found.softest.load,
                found.moving.nodes,
                found.moving.node
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
    fn no_advice_tells_to_turn_what_is_not_connected() {
        for goal in objectives::OBJECTIVES.iter().filter(|goal| goal.name != "displacement") {
            let formula = if goal.name == "formula" { "formula = \"lloyd\"" } else { "" };
            let tables = format!("[calibration]\nobjective = \"{}\"\n{formula}", goal.name);
            let told = advice_for(&tables, 4);
            assert!(!told.is_empty() && !told.contains("load cases") && !told.contains("regularisation"), "{told}");
        }
    }
}
