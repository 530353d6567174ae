//! Which nodes of a structured grid are joined by springs; `mesh_topology` does the same on any mesh.
//!
//! The full pattern joins every two nodes whose index offset lies in {-1,0,1}^d: d directions of edges, the diagonals of
//! the cell faces, and in three dimensions the four diagonals of each cell (section 3.1 of the thesis). Each unordered
//! pair is visited once, from the end where the first step that is not zero is +1.
//!
//! A spring with the offset o belongs to prod_a c_a cells; c_a = 1 where o_a != 0 or the node lies on an end of
//! direction a, else 2. A direction with a single layer of nodes has no cells of its own and counts once.
//!
//! Tied nodes (a merged seam) are replaced by their masters. Springs that then join the same two nodes are one spring,
//! and their cells add up.

use std::collections::HashMap;

use crate::geometry::dofs::DofMap;
use crate::geometry::grid::Grid;

use crate::geometry::mesh::Mesh;

use super::mesh_topology;
use super::network::{Kind, Network, Spring, rest};

/// A way to join nodes, chosen by its name.
pub struct Topology {
    /// The word in the scene.
    pub name: &'static str,
    /// What it does, in a line.
    pub doc: &'static str,
    /// Joins the nodes of a grid at these positions (m, one for each node), ties taken from the map.
    pub connect: fn(&Grid, &[[f64; 3]], &DofMap) -> Network,
    /// Joins the nodes of a mesh, ties taken from the map; the grid gives the steps where the nodes lie on one.
    pub connect_mesh: fn(&Mesh, Option<&Grid>, &DofMap) -> Network,
}

/// All topologies.
pub const TOPOLOGIES: &[Topology] = &[
    Topology {
        name: "grid",
        doc: "springs along the edges of all cells, their face diagonals and body diagonals",
        connect: edges_and_diagonals,
        connect_mesh: mesh_topology::edges_and_diagonals,
    },
    Topology {
        name: "edges",
        doc: "springs along the edges of all cells only; a mechanism unless the cells are triangles or tetrahedra",
        connect: edges_only,
        connect_mesh: mesh_topology::edges_only,
    },
];

/// The topology of this name.
pub fn find(name: &str) -> Option<&'static Topology> {
    TOPOLOGIES.iter().find(|topology| topology.name == name)
}

/// Nodes closer than this part of the body's diagonal lie on one place.
pub(super) const COINCIDENT: f64 = 1e-13;

fn edges_and_diagonals(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap) -> Network {
    connect(grid, positions, dofs, &offsets(grid.dimension()))
}

fn edges_only(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap) -> Network {
    let mut edges = offsets(grid.dimension());
    edges.retain(|&offset| Kind::of(offset) == Kind::Edge);
    connect(grid, positions, dofs, &edges)
}

/// The offsets of {-1,0,1}^d whose first step that is not zero is +1: 4 in two dimensions, 13 in three.
fn offsets(dimension: usize) -> Vec<[i8; 3]> {
    let third: &[i8] = if dimension == 3 { &[-1, 0, 1] } else { &[0] };
    let mut found = Vec::new();
    for i in [0, 1] {
        for j in [-1, 0, 1] {
            found.extend(third.iter().map(|&k| [i, j, k]).filter(|&offset| offset > [0, 0, 0]));
        }
    }
    found
}

/// Joins every node to its neighbours at the given offsets.
fn connect(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap, offsets: &[[i8; 3]]) -> Network {
    assert_eq!(grid.len(), positions.len(), "one position for every node");
    let tolerance = COINCIDENT * diagonal(positions);
    let mut springs: Vec<Spring> = Vec::with_capacity(grid.len() * offsets.len());
    let mut zero_length = 0;
    for node in 0..grid.len() {
        let index = grid.index(node);
        for &offset in offsets {
            let Some(neighbour) = step(grid, index, offset) else { continue };
            let (a, b) = (dofs.master(node), dofs.master(neighbour));
            if let Some((length, direction)) = rest(positions[a], positions[b], tolerance) {
                let (nodes, cells) = ([a as u32, b as u32], cells_around(grid, index, offset));
                springs.push(Spring { nodes, length, direction, kind: Kind::of(offset), offset, cells });
            } else {
                zero_length += 1;
            }
        }
    }
    if (0..grid.len()).any(|node| dofs.master(node) != node) {
        springs = joined(springs);
    }
    Network { dimension: grid.dimension(), positions: positions.to_vec(), springs, zero_length }
}

/// Makes springs between the same two nodes one spring, the first of them, with the cells of all.
pub(super) fn joined(springs: Vec<Spring>) -> Vec<Spring> {
    let mut known: HashMap<[u32; 2], usize> = HashMap::with_capacity(springs.len());
    let mut kept: Vec<Spring> = Vec::with_capacity(springs.len());
    for spring in springs {
        let [a, b] = spring.nodes;
        let place = *known.entry([a.min(b), a.max(b)]).or_insert(kept.len());
        match kept.get_mut(place) {
            Some(first) => first.cells += spring.cells,
            None => kept.push(spring),
        }
    }
    kept
}

/// The node at this offset from `index`, if the grid has it.
fn step(grid: &Grid, index: [usize; 3], offset: [i8; 3]) -> Option<usize> {
    let mut next = [0; 3];
    for a in 0..3 {
        next[a] = index[a].checked_add_signed(isize::from(offset[a])).filter(|&i| i < grid.extents()[a])?;
    }
    Some(grid.node(next))
}

/// Cells that contain the spring from `index` with this offset.
fn cells_around(grid: &Grid, index: [usize; 3], offset: [i8; 3]) -> u32 {
    let inside = |a: usize| offset[a] == 0 && index[a] > 0 && index[a] + 1 < grid.extents()[a];
    (0..grid.dimension()).map(|a| if inside(a) { 2 } else { 1 }).product()
}

/// Length of the diagonal of the box around the points, m.
pub(super) fn diagonal(positions: &[[f64; 3]]) -> f64 {
    let extent = |a: usize| {
        let (low, high) =
            positions.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x[a]), high.max(x[a])));
        high - low
    };
    if positions.is_empty() { 0.0 } else { (0..3).map(|a| extent(a).powi(2)).sum::<f64>().sqrt() }
}
