//! Which springs share one number.
//!
//! By length (4.11-4.13), with 0 < gamma < 1: the lengths are swept in descending order. Lengths equal to 1e-9
//! (relative) are one block. A block joins the current group if every member then lies inside
//!
//! ```text
//! [ l (1 - gamma), l (1 + gamma) ],     l = mean rest length of the group with the block
//! ```
//!
//! and starts a new group otherwise. The groups are numbered from the shortest. Other groupings ask for the place of a
//! spring in the grid. Every spring is in exactly one group, and no group is empty.

use std::cmp::Reverse;

use crate::error::{Error, Result};

use super::network::{Kind, Network, Spring};

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
    Rule { name: "length", doc: "springs of similar rest length, as gamma says", uses_gamma: true, group: by_length },
    Rule { name: "kind", doc: "edges, face diagonals, body diagonals", uses_gamma: false, group: by_kind },
    Rule { name: "direction", doc: "springs with the same step in the grid", uses_gamma: false, group: by_direction },
    Rule {
        name: "kind_and_length",
        doc: "by kind, and within a kind by rest length, as gamma says",
        uses_gamma: true,
        group: by_kind_and_length,
    },
    Rule { name: "each", doc: "one group for every spring", uses_gamma: false, group: each },
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

/// Two groupings of one network are the same when they put every spring into the same group.
impl PartialEq for Grouping {
    fn eq(&self, other: &Self) -> bool {
        self.group_of == other.group_of
    }
}

/// Lengths that differ by less than this part are equal.
const SAME_LENGTH: f64 = 1e-9;

fn by_length(network: &Network, request: &Request) -> Result<Grouping> {
    let gamma = legal_gamma(request)?;
    let all: Vec<usize> = (0..network.springs.len()).collect();
    let (rank, count) = sweep(network, all, gamma);
    Ok(collect(network, &rank, &(1..=count).map(|a| format!("length_{a}")).collect::<Vec<_>>()))
}

fn by_kind(network: &Network, _request: &Request) -> Result<Grouping> {
    let rank: Vec<usize> = network.springs.iter().map(|spring| spring.kind as usize).collect();
    Ok(collect(network, &rank, &Kind::ALL.map(|kind| kind.name().to_owned())))
}

fn by_direction(network: &Network, _request: &Request) -> Result<Grouping> {
    if network.springs.iter().any(|spring| spring.offset == [0; 3]) {
        let help = "use length, kind, kind_and_length or each on a mesh without a grid";
        return Err(Error::input("springs.grouping", "\"direction\" needs nodes on a grid", help));
    }
    let key = |spring: &Spring| (spring.kind, Reverse(spring.offset));
    let mut keys: Vec<_> = network.springs.iter().map(key).collect();
    keys.sort_unstable();
    keys.dedup();
    let rank: Vec<usize> = network.springs.iter().map(|spring| keys.partition_point(|k| *k < key(spring))).collect();
    let names: Vec<String> = keys.iter().map(|(_, Reverse(offset))| step_name(*offset, network)).collect();
    Ok(collect(network, &rank, &names))
}

fn by_kind_and_length(network: &Network, request: &Request) -> Result<Grouping> {
    let gamma = legal_gamma(request)?;
    let mut rank = vec![0; network.springs.len()];
    let mut names = Vec::new();
    for kind in Kind::ALL {
        let members: Vec<usize> = (0..rank.len()).filter(|&s| network.springs[s].kind == kind).collect();
        let (within, count) = sweep(network, members.clone(), gamma);
        for s in members {
            rank[s] = names.len() + within[s];
        }
        names.extend((1..=count).map(|a| format!("{}_{a}", kind.name())));
    }
    Ok(collect(network, &rank, &names))
}

fn each(network: &Network, _request: &Request) -> Result<Grouping> {
    let rank: Vec<usize> = (0..network.springs.len()).collect();
    let names: Vec<String> = rank.iter().map(|s| format!("spring_{s}")).collect();
    Ok(collect(network, &rank, &names))
}

/// The gamma of a request, between 0 and 1.
fn legal_gamma(&Request { gamma, .. }: &Request) -> Result<f64> {
    if gamma > 0.0 && gamma < 1.0 {
        return Ok(gamma);
    }
    Err(Error::input("calibration.gamma", format!("gamma is {gamma}"), "gamma lies between 0 and 1, both excluded"))
}

/// Name of a grid step: one sign for each direction, such as `+0-`.
fn step_name(offset: [i8; 3], network: &Network) -> String {
    let signs = offset[..network.dimension].iter().map(|step| match step {
        1.. => '+',
        0 => '0',
        _ => '-',
    });
    signs.collect()
}

/// A group while the sweep fills it.
struct Open {
    longest: f64,
    sum: f64,
    count: usize,
}

impl Open {
    /// Takes a block in if every member then lies near enough to the mean.
    fn admit(&mut self, block: &[f64], gamma: f64) -> bool {
        let (sum, count) = (self.sum + block.iter().sum::<f64>(), self.count + block.len());
        let (mean, shortest) = (sum / count as f64, block[block.len() - 1]);
        let inside = shortest >= mean * (1.0 - gamma) * (1.0 - SAME_LENGTH)
            && self.longest <= mean * (1.0 + gamma) * (1.0 + SAME_LENGTH);
        if inside {
            (self.sum, self.count) = (sum, count);
        }
        inside
    }
}

/// The descending sweep over some springs: the number of the group of each (from the shortest; 0 for the springs that
/// do not take part), and how many groups there are.
fn sweep(network: &Network, mut members: Vec<usize>, gamma: f64) -> (Vec<usize>, usize) {
    members.sort_by(|&r, &s| network.springs[s].length.total_cmp(&network.springs[r].length).then(r.cmp(&s)));
    let lengths: Vec<f64> = members.iter().map(|&s| network.springs[s].length).collect();
    let mut from_longest = vec![0; lengths.len()];
    let mut groups = 0;
    let mut open = Open { longest: 0.0, sum: 0.0, count: 0 };
    let mut start = 0;
    while start < lengths.len() {
        let end = start + lengths[start..].iter().take_while(|&&l| l >= lengths[start] * (1.0 - SAME_LENGTH)).count();
        let block = &lengths[start..end];
        if groups == 0 || !open.admit(block, gamma) {
            open = Open { longest: block[0], sum: block.iter().sum(), count: block.len() };
            groups += 1;
        }
        from_longest[start..end].fill(groups);
        start = end;
    }
    let mut number = vec![0; network.springs.len()];
    for (&s, &group) in members.iter().zip(&from_longest) {
        number[s] = groups - group;
    }
    (number, groups)
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
