//! How the springs lie in memory: in the order in which the force sweep meets them.
//!
//! Eight nodes side by side are a row of lanes, nodes 8 r to 8 r + 7. In a grid, most springs of those nodes go to the
//! eight nodes that lie one and the same *step* b - a further on. Such springs are a *band*: a row of eight (k, l0), and c
//! when there is damping, without indices. A cube of n^3 nodes has 13 bands, a membrane 4; where a node has no spring in a
//! band, k = 0. All bands of a row of nodes follow on each other, so the sweep reads one stream.
//!
//! Springs whose step is rare (across a merged seam, or in an unstructured mesh) are *loose*: each end keeps the spring in
//! a list with the number of the other end, 4 bytes more, and it is computed from both ends. The lists of eight nodes
//! are as long as the longest of them, filled up with k = 0.
//!
//! | springs | bytes a spring | computed |
//! |---|---|---|
//! | in a band | 16, with damping 24, over the share of the band that is filled | once |
//! | loose | 40, with damping 56, over the share of the lists that is filled | twice |

use std::collections::BTreeMap;

use crate::lanes::{LANES, Lanes};
use crate::springs::network::Network;

/// A step is a band when this share of the nodes has a spring in it: below, the empty places cost more than the lists.
const FILLED: f64 = 0.3;

/// What the force of one spring depends on.
#[derive(Debug, Clone, Copy)]
struct Spring {
    /// The ends, the smaller number first.
    ends: [usize; 2],
    /// k in N/m, l0 in m, c in N s/m.
    numbers: [f64; 3],
}

/// The springs in the order of the sweep.
#[derive(Debug, Clone)]
pub(super) struct Storage {
    /// Number of nodes.
    pub nodes: usize,
    /// b - a of each band, ascending.
    pub steps: Vec<usize>,
    /// The largest step, rounded up to whole rows.
    pub reach: usize,
    /// Numbers of a spring: 2 (k, l0) or 3 (k, l0, c).
    pub numbers: usize,
    /// The bands: row of nodes, step, number.
    pub bands: Vec<Lanes>,
    /// Where the loose springs of each row of nodes begin, as entries; one more than rows.
    pub starts: Vec<usize>,
    /// The other ends, one entry of eight after the other.
    pub others: Vec<[u32; LANES]>,
    /// The loose springs: entry, number.
    pub loose: Vec<Lanes>,
}

impl Storage {
    /// Sorts the springs of a network into bands and lists.
    pub fn new(network: &Network, stiffness: &[f64], damping: Option<&[f64]>) -> Self {
        let spring = |s: usize| {
            let [a, b] = network.springs[s].nodes.map(|node| node as usize);
            let numbers = [stiffness[s], network.springs[s].length, damping.map_or(0.0, |damping| damping[s])];
            Spring { ends: [a.min(b), a.max(b)], numbers }
        };
        let springs: Vec<Spring> = (0..stiffness.len()).map(spring).collect();
        let nodes = network.positions.len();
        let steps = frequent_steps(nodes, &springs);
        let reach = steps.last().map_or(0, |step| step.next_multiple_of(LANES));
        let numbers = if damping.is_some() { 3 } else { 2 };
        let (starts, others) = (Vec::new(), Vec::new());
        let mut storage = Self { nodes, steps, reach, numbers, bands: Vec::new(), starts, others, loose: Vec::new() };
        let loose = storage.fill_bands(&springs);
        storage.fill_lists(&loose);
        storage
    }

    /// Rows of eight nodes.
    pub fn rows(&self) -> usize {
        self.nodes.div_ceil(LANES)
    }

    /// The bands of a row.
    #[inline(always)]
    pub fn bands_of(&self, row: usize) -> &[Lanes] {
        let size = self.steps.len() * self.numbers;
        &self.bands[row * size..(row + 1) * size]
    }

    /// Bytes that one sweep reads of the springs themselves.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.bands[..]) + size_of_val(&self.others[..]) + size_of_val(&self.loose[..])
    }

    /// Elastic energy in J of the springs of the bands that begin at a row, and half of that of its loose springs.
    pub fn energy_of(&self, row: usize, x: &[[f64; 3]]) -> f64 {
        let energy = |[a, b]: [usize; 2], numbers: &[Lanes], lane: usize| {
            let square: f64 = (0..3).map(|axis| (x[b][axis] - x[a][axis]).powi(2)).sum();
            0.5 * numbers[0].0[lane] * (square.sqrt() - numbers[1].0[lane]).powi(2)
        };
        let own = row * LANES..self.nodes.min((row + 1) * LANES);
        let mut sum = 0.0;
        for (&step, numbers) in self.steps.iter().zip(self.bands_of(row).chunks_exact(self.numbers)) {
            let inside = own.start..own.end.min(self.nodes.saturating_sub(step));
            sum += inside.enumerate().map(|(lane, a)| energy([a, a + step], numbers, lane)).sum::<f64>();
        }
        for entry in self.starts[row]..self.starts[row + 1] {
            let numbers = &self.loose[entry * self.numbers..(entry + 1) * self.numbers];
            let others = own.clone().zip(self.others[entry]).enumerate();
            sum += 0.5 * others.map(|(lane, (a, b))| energy([a, b as usize], numbers, lane)).sum::<f64>();
        }
        sum
    }

    /// Writes the bands, and returns the springs that have no place in them.
    fn fill_bands(&mut self, springs: &[Spring]) -> Vec<Spring> {
        let places = self.rows() * self.steps.len();
        self.bands = vec![Lanes::ZERO; places * self.numbers];
        let mut taken = vec![false; places * LANES];
        let mut loose = Vec::new();
        for spring in springs {
            let [a, b] = spring.ends;
            let place = |step| a / LANES * self.steps.len() + step;
            let free = self.steps.binary_search(&(b - a)).map(place).ok().filter(|p| !taken[p * LANES + a % LANES]);
            let Some(place) = free else {
                loose.push(*spring);
                continue;
            };
            taken[place * LANES + a % LANES] = true;
            for (number, value) in spring.numbers[..self.numbers].iter().enumerate() {
                self.bands[place * self.numbers + number].0[a % LANES] = *value;
            }
        }
        loose
    }

    /// Writes the lists of the nodes, each in the order of the springs.
    fn fill_lists(&mut self, springs: &[Spring]) {
        let mut lists: Vec<Vec<(u32, [f64; 3])>> = vec![Vec::new(); self.rows() * LANES];
        for Spring { ends: [a, b], numbers } in springs {
            lists[*a].push((*b as u32, *numbers));
            lists[*b].push((*a as u32, *numbers));
        }
        self.starts = vec![0];
        for (row, lists) in lists.chunks_exact(LANES).enumerate() {
            // in the places that are not filled a node is joined to itself, or to the last where there is none
            let own: [u32; LANES] = std::array::from_fn(|l| (row * LANES + l).min(self.nodes - 1) as u32);
            let longest = lists.iter().map(Vec::len).max().unwrap_or(0);
            for entry in 0..longest {
                self.others.push(std::array::from_fn(|l| lists[l].get(entry).map_or(own[l], |found| found.0)));
                let number = |n: usize| std::array::from_fn(|l| lists[l].get(entry).map_or(0.0, |found| found.1[n]));
                self.loose.extend((0..self.numbers).map(|n| Lanes(number(n))));
            }
            self.starts.push(self.others.len());
        }
    }
}

/// The steps that are worth a band, ascending. A spring from a node to itself has none.
fn frequent_steps(nodes: usize, springs: &[Spring]) -> Vec<usize> {
    let mut counts = BTreeMap::<usize, usize>::new();
    for Spring { ends: [a, b], .. } in springs.iter().filter(|spring| spring.ends[0] < spring.ends[1]) {
        *counts.entry(b - a).or_default() += 1;
    }
    counts.retain(|_, count| *count as f64 >= FILLED * nodes as f64);
    counts.into_keys().collect()
}
