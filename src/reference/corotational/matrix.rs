//! The tangent as a sparse matrix, filled again in place.
//!
//! With the turned gradients h_a = R_k gbar_ka and the twists t_ma = q_m gbar_ka, domain k couples nodes a and b by
//!
//! ```text
//!     K_ab = V_k ( lambda h_a h_b^T + mu h_b h_a^T + mu (h_a . h_b) 1 + sum_m c_m t_ma t_mb^T )
//! ```
//!
//! Where each block goes is found once. A *pair* is two acting nodes of one domain; the pairs of one block of K stand
//! together, so that a block is one sum in a fixed order and no local matrix is ever formed. Only blocks a <= b are summed;
//! every entry of K then knows its place in them.

use nalgebra_sparse::na::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::geometry::dofs::{DofMap, FIXED};
use crate::reference::corotational::body::Corotational;
use crate::reference::methods::smoothed::Domains;
use crate::reference::ragged::Ragged;
use crate::sparse::pattern::Pattern;

/// Items of a parallel loop that one task takes at least.
const AT_LEAST: usize = 256;

/// Where everything goes, and the memory to get there.
#[derive(Debug, Clone)]
pub struct TangentMatrix {
    pattern: Pattern,
    /// Domain of every acting node.
    owners: Vec<u32>,
    /// For each block of K the acting nodes whose products it sums.
    pairs: Ragged<(u32, u32)>,
    /// For each entry of K its place in `blocks`, 9 numbers a block, row-major.
    sources: Vec<u32>,
    coefficients: Vec<Coefficients>,
    turned: Vec<Turned>,
    blocks: Vec<[f64; 9]>,
}

/// V_k times the constants of a domain: lambda, mu and c_m.
#[derive(Debug, Clone, Copy)]
struct Coefficients {
    lambda: f64,
    mu: f64,
    twist: [f64; 3],
}

/// h_a and t_ma of an acting node.
#[derive(Debug, Clone, Copy)]
struct Turned {
    gradient: Vector3<f64>,
    twists: [Vector3<f64>; 3],
}

impl TangentMatrix {
    /// Finds the places of all blocks.
    pub fn new(domains: &Domains, dofs: &DofMap) -> Self {
        let mut owners = vec![0; domains.all_acting().len()];
        (0..domains.len()).for_each(|k| owners[domains.acting_range(k)].fill(k as u32));
        let (names, pairs) = block_pairs(domains, dofs);
        let unknowns = |nodes: &[u32; 2]| nodes.iter().flat_map(|&n| dofs.free(n as usize)).copied().collect();
        let cliques: Vec<Vec<u32>> = names.iter().map(unknowns).collect();
        let pattern = Pattern::from_cliques(dofs.len(), cliques.iter().map(Vec::as_slice));
        let none = Coefficients { lambda: 0.0, mu: 0.0, twist: [0.0; 3] };
        let unturned = Turned { gradient: Vector3::zeros(), twists: [Vector3::zeros(); 3] };
        Self {
            sources: sources(&pattern, dofs, &names),
            coefficients: vec![none; domains.len()],
            turned: vec![unturned; owners.len()],
            blocks: vec![[0.0; 9]; names.len()],
            owners,
            pairs,
            pattern,
        }
    }

    /// The entries of K, both triangles.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Writes the tangent that was chosen last for the body (see [`Corotational::linearise`]), in N/m. Allocates nothing.
    ///
    /// # Panics
    /// When there is not one value for each entry of the pattern, or the body is another.
    pub fn fill(&mut self, body: &Corotational, values: &mut [f64]) {
        assert_eq!(values.len(), self.sources.len(), "one value for each entry of the pattern");
        let domains = body.domains();
        self.coefficients.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(k, coefficients)| {
            let (volume, lame) = (domains.volume(k), body.constants(k));
            let twist = body.twist(k).map_or([0.0; 3], |twist| twist.coefficients.map(|c| volume * c));
            *coefficients = Coefficients { lambda: volume * lame.lambda, mu: volume * lame.mu, twist };
        });
        let (owners, acting) = (&self.owners, domains.all_acting());
        self.turned.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(i, turned)| {
            let (domain, gradient) = (owners[i] as usize, Vector3::from(acting[i].gradient));
            turned.gradient = body.rotation(domain) * gradient;
            if let Some(twist) = body.twist(domain) {
                turned.twists = twist.directions.map(|q| q * gradient);
            }
        });
        let (pairs, turned, coefficients) = (&self.pairs, &self.turned, &self.coefficients);
        let twisted = !body.domains().is_empty() && body.twist(0).is_some();
        self.blocks.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(block, sum)| {
            let mut total = Matrix3::zeros();
            for &(a, b) in pairs.row(block) {
                let (domain, a, b) = (owners[a as usize] as usize, &turned[a as usize], &turned[b as usize]);
                add(&mut total, &coefficients[domain], a, b, twisted);
            }
            *sum = total.transpose().as_slice().try_into().expect("nine entries");
        });
        let blocks = self.blocks.as_flattened();
        let entries = values.par_iter_mut().with_min_len(16 * AT_LEAST).zip(&self.sources);
        entries.for_each(|(value, &source)| *value = blocks[source as usize]);
    }
}

/// Adds the block of two acting nodes of a domain.
fn add(sum: &mut Matrix3<f64>, with: &Coefficients, a: &Turned, b: &Turned, twisted: bool) {
    let (g, h) = (&a.gradient, &b.gradient);
    let diagonal = with.mu * g.dot(h);
    for i in 0..3 {
        for j in 0..3 {
            sum[(i, j)] += with.lambda * g[i] * h[j] + with.mu * h[i] * g[j];
        }
        sum[(i, i)] += diagonal;
    }
    if twisted {
        for ((c, s), t) in with.twist.iter().zip(&a.twists).zip(&b.twists) {
            *sum += (s * *c) * t.transpose();
        }
    }
}

/// The blocks a <= b of K as pairs of (master) nodes, ascending, and the pairs of acting nodes that each sums.
fn block_pairs(domains: &Domains, dofs: &DofMap) -> (Vec<[u32; 2]>, Ragged<(u32, u32)>) {
    let acting = domains.all_acting();
    let master = |i: usize| dofs.master(acting[i].node as usize) as u32;
    let movable = |i: usize| dofs.free(acting[i].node as usize).iter().any(|&dof| dof != FIXED);
    let mut found: Vec<([u32; 2], (u32, u32))> = Vec::new();
    for range in (0..domains.len()).map(|k| domains.acting_range(k)) {
        for a in range.clone().filter(|&a| movable(a)) {
            for b in range.clone().filter(|&b| movable(b) && master(a) <= master(b)) {
                found.push(([master(a), master(b)], (a as u32, b as u32)));
            }
        }
    }
    // acting nodes are numbered domain by domain, so that the sums go in the order of the domains
    found.sort_unstable();
    let (mut names, mut pairs) = (Vec::new(), Ragged::default());
    for group in found.chunk_by(|x, y| x.0 == y.0) {
        names.push(group[0].0);
        group.iter().for_each(|&(_, pair)| pairs.push(pair));
        pairs.close();
    }
    (names, pairs)
}

/// Place of every entry of the pattern in the blocks.
fn sources(pattern: &Pattern, dofs: &DofMap, names: &[[u32; 2]]) -> Vec<u32> {
    let mut sources = Vec::with_capacity(pattern.entries());
    for row in 0..pattern.len() {
        let (a, i) = dofs.owner(row);
        for &column in pattern.row(row) {
            let (b, j) = dofs.owner(column);
            // of a diagonal block one triangle is read, so that K is symmetric to the last bit
            let (name, place) = if (a, i) <= (b, j) { ([a, b], 3 * i + j) } else { ([b, a], 3 * j + i) };
            let name = name.map(|node| node as u32);
            let block = names.binary_search(&name).expect("the pattern was made from the blocks");
            sources.push((9 * block + place) as u32);
        }
    }
    sources
}
