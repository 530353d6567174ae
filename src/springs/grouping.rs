//! Which springs share one number.
//!
//! | file | groups |
//! |---|---|
//! | `length` | springs of similar rest length (4.11-4.13), also within each kind |
//! | `place` | springs that lie alike in the grid: kind, direction, direction and multiplicity, each by itself |
//! | `k_means` | clusters of springs that are near in direction, length and position |
//! | `sets` | parts of the body that the scene names |
//! | [`numbers`] | springs that need the same number, where that is known |
//!
//! Every spring is in exactly one group, and no group is empty.

mod k_means;
mod length;
pub mod numbers;
mod place;
mod sets;

use crate::error::Result;
use crate::geometry::dofs::{DofMap, FIXED};

use super::network::{Network, Spring};

/// A spring of which less than this part points along free components acts on held ones only.
const ACTING: f64 = 1e-13;

/// What a rule is asked for; each reads what concerns it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request<'a> {
    /// Half the width of a group of lengths, relative to their mean; between 0 and 1.
    pub gamma: f64,
    /// Most groups, where the rule chooses their number.
    pub groups: usize,
    /// Parts of the body that have groups of their own.
    pub sets: &'a [NodeSet],
}

impl Request<'_> {
    /// Asks for this gamma, and for the usual otherwise.
    pub fn with_gamma(gamma: f64) -> Self {
        Self { gamma, ..Self::default() }
    }
}

impl Default for Request<'_> {
    fn default() -> Self {
        Self { gamma: 0.1, groups: 16, sets: &[] }
    }
}

/// A part of the body by the nodes in it.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeSet {
    /// Its name in results.
    pub name: String,
    /// Its nodes, ascending.
    pub nodes: Vec<u32>,
}

/// A way to sort springs into groups, chosen by its name.
pub struct Rule {
    /// The word in the scene.
    pub name: &'static str,
    /// What it does, in a line.
    pub doc: &'static str,
    /// True when gamma matters: then Algorithm 5.1 has something to sweep.
    pub uses_gamma: bool,
    /// Sorts the springs of a network.
    pub group: fn(&Network, &Request) -> Result<Grouping>,
}

/// All groupings.
pub const GROUPINGS: &[Rule] = &[
    Rule {
        name: "length",
        doc: "springs of similar rest length, as gamma says",
        uses_gamma: true,
        group: length::by_length,
    },
    Rule { name: "kind", doc: "edges, face diagonals, body diagonals", uses_gamma: false, group: place::by_kind },
    Rule {
        name: "direction",
        doc: "springs with the same step in the grid",
        uses_gamma: false,
        group: place::by_direction,
    },
    Rule {
        name: "direction_and_multiplicity",
        doc: "springs with the same step in the grid up to its signs, in as many cells",
        uses_gamma: false,
        group: place::by_direction_and_multiplicity,
    },
    Rule {
        name: "kind_and_length",
        doc: "by kind, and within a kind by rest length, as gamma says",
        uses_gamma: true,
        group: length::by_kind_and_length,
    },
    Rule {
        name: "k_means",
        doc: "clusters in local direction, rest length and position, at most springs.groups of them",
        uses_gamma: false,
        group: k_means::by_clusters,
    },
    Rule {
        name: "adaptive",
        doc: "the kinds, split where the error asks for it, until there are springs.groups of them",
        uses_gamma: false,
        group: place::by_kind,
    },
    Rule {
        name: "sets",
        doc: "the parts of the body in [[springs.sets]], and the rest",
        uses_gamma: false,
        group: sets::by_sets,
    },
    Rule {
        name: "each",
        doc: "one group for every spring, held together by calibration.regularisation",
        uses_gamma: false,
        group: place::each,
    },
];

/// The grouping of this name.
pub fn find(name: &str) -> Option<&'static Rule> {
    GROUPINGS.iter().find(|rule| rule.name == name)
}

/// A group of springs.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Its name in results.
    pub name: String,
    /// How many springs it has.
    pub springs: usize,
    /// Their mean rest length, m.
    pub length: f64,
}

/// The group of every spring.
#[derive(Debug, Clone)]
pub struct Grouping {
    /// Number of the group, for each spring.
    pub group_of: Vec<u32>,
    /// The groups, none of them empty.
    pub groups: Vec<Group>,
}

impl Grouping {
    /// For every group whether any of its springs acts on a free component of a node: K(phi) does not depend on the others.
    pub fn acting(&self, network: &Network, dofs: &DofMap) -> Vec<bool> {
        let along_free = |Spring { nodes, direction, .. }: &Spring| {
            let ends = nodes.iter().flat_map(|&node| dofs.free(node as usize).iter().zip(direction));
            ends.filter(|(dof, _)| **dof != FIXED).map(|(_, d)| d * d).sum::<f64>()
        };
        let mut acting = vec![false; self.groups.len()];
        for (spring, &group) in network.springs.iter().zip(&self.group_of) {
            acting[group as usize] |= along_free(spring) > ACTING * ACTING;
        }
        acting
    }
}

/// Two groupings of one network are the same when they put every spring into the same group.
impl PartialEq for Grouping {
    fn eq(&self, other: &Self) -> bool {
        self.group_of == other.group_of
    }
}

/// Builds the grouping from a rank for each spring, leaving out ranks that no spring has.
fn collect(network: &Network, rank: &[usize], names: &[String]) -> Grouping {
    let mut count = vec![0_usize; names.len()];
    let mut sum = vec![0.0; names.len()];
    for (spring, &r) in network.springs.iter().zip(rank) {
        count[r] += 1;
        sum[r] += spring.length;
    }
    let mut number = vec![0_u32; names.len()];
    let mut groups = Vec::new();
    for r in (0..names.len()).filter(|&r| count[r] > 0) {
        number[r] = groups.len() as u32;
        groups.push(Group { name: names[r].clone(), springs: count[r], length: sum[r] / count[r] as f64 });
    }
    Grouping { group_of: rank.iter().map(|&r| number[r]).collect(), groups }
}
