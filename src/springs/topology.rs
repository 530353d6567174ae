//! Which nodes of a structured grid are joined by springs; `mesh_topology` does the same on any mesh.
//!
//! The full pattern joins every two nodes whose index offset lies in {-1,0,1}^d: d directions of edges, the diagonals of
//! the cell faces, and in three dimensions the four diagonals of each cell (section 3.1 of the thesis). Each unordered
//! pair is visited once, from the end where the first step that is not zero is +1.
//!
//! A spring with the offset o belongs to prod_a c_a cells; c_a = 1 where o_a != 0 or the node lies on an end of
//! direction a, else 2. A direction with a single layer of nodes has no cells of its own and counts once.
//!
//! The second ring adds the primitive offsets of two steps, such as (2, 1, 0) or (1, -2, 2): no node lies on the way, so they
//! are no pairs of shorter springs. Such a spring goes from corner to corner of a box of cells and counts by the same formula,
//! once for each such box. Richer networks reach materials that springs between neighbours cannot: with all springs of a
//! cell a homogeneous lattice has the symmetry c_12 = c_44 of Cauchy whatever their stiffness, but its bending and its
//! anisotropy follow the springs there are.
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
    Topology {
        name: "second_ring",
        doc: "the springs of \"grid\", and to all nodes two steps away with none between; without a grid to the \
              neighbours of neighbours",
        connect: two_rings,
        connect_mesh: mesh_topology::two_rings,
    },
    Topology {
        name: "list",
        doc: "only the springs of springs.edges and springs.edge_file",
        connect: unconnected,
        connect_mesh: mesh_topology::unconnected,
    },
];

/// The topology of this name.
pub fn find(name: &str) -> Option<&'static Topology> {
    TOPOLOGIES.iter().find(|topology| topology.name == name)
}

/// Nodes closer than this part of the body's diagonal lie on one place.
pub(super) const COINCIDENT: f64 = 1e-13;

fn edges_and_diagonals(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap) -> Network {
    connect(grid, positions, dofs, &[offsets(grid.dimension(), 1)])
}

fn edges_only(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap) -> Network {
    let mut edges = offsets(grid.dimension(), 1);
    edges.retain(|&offset| Kind::of(offset) == Kind::Edge);
    connect(grid, positions, dofs, &[edges])
}

fn two_rings(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap) -> Network {
    connect(grid, positions, dofs, &[1, 2].map(|reach| offsets(grid.dimension(), reach)))
}

fn unconnected(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap) -> Network {
    connect(grid, positions, dofs, &[])
}

/// The primitive offsets (no node lies between) of at most `reach` steps, and exactly so many in one direction, whose first
/// step that is not zero is positive: 4 in two dimensions and 13 in three for one step, 4 and 36 more for two.
pub(super) fn offsets(dimension: usize, reach: i8) -> Vec<[i8; 3]> {
    let third = if dimension == 3 { reach } else { 0 };
    let mut found = Vec::new();
    for i in 0..=reach {
        for j in -reach..=reach {
            found.extend((-third..=third).map(|k| [i, j, k]));
        }
    }
    let primitive = |offset: &[i8; 3]| {
        (2..=reach).all(|divisor| offset.iter().any(|step| step % divisor != 0))
            && offset.iter().any(|step| step.abs() == reach)
    };
    found.retain(|offset| *offset > [0, 0, 0] && primitive(offset));
    found
}

/// Joins every node to its neighbours at the offsets of one ring after the other.
fn connect(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap, rings: &[Vec<[i8; 3]>]) -> Network {
    assert_eq!(grid.len(), positions.len(), "one position for every node");
    let links = rings.iter().flat_map(|offsets| links(grid, dofs, offsets));
    collect(grid.dimension(), positions, dofs, links)
}

/// Two nodes, not yet their masters, and how they are to be joined.
#[derive(Debug, Clone, Copy)]
pub(super) struct Link {
    pub(super) nodes: [usize; 2],
    pub(super) kind: Kind,
    pub(super) offset: [i8; 3],
    pub(super) cells: u32,
}

/// The links of a grid at some offsets, node after node.
pub(super) fn links(grid: &Grid, dofs: &DofMap, offsets: &[[i8; 3]]) -> Vec<Link> {
    let closed = dofs.closed(grid);
    let of_node = |node: usize| {
        let index = grid.index(node);
        offsets.iter().filter_map(move |&offset| {
            let neighbour = step(grid, closed, index, offset)?;
            let cells = cells_around(grid, index, offset);
            Some(Link { nodes: [node, neighbour], kind: Kind::of(offset), offset, cells })
        })
    };
    (0..grid.len()).flat_map(of_node).collect()
}

/// The network of some links: ties followed, links without a length left out, those between the same nodes made one.
pub(super) fn collect(
    dimension: usize,
    positions: &[[f64; 3]],
    dofs: &DofMap,
    links: impl Iterator<Item = Link>,
) -> Network {
    let tolerance = COINCIDENT * diagonal(positions);
    let (mut springs, mut zero_length) = (Vec::new(), 0);
    for Link { nodes, kind, offset, cells } in links {
        let [a, b] = nodes.map(|node| dofs.master(node));
        if a == b {
            // tied nodes are one: nothing is missing between them
            continue;
        }
        if let Some((length, direction)) = rest(positions[a], positions[b], tolerance) {
            springs.push(Spring { nodes: [a as u32, b as u32], length, direction, kind, offset, cells });
        } else {
            zero_length += 1;
        }
    }
    if (0..positions.len()).any(|node| dofs.master(node) != node) {
        springs = joined(springs);
    }
    Network { dimension, positions: positions.to_vec(), springs, zero_length }
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

/// The node at this offset from `index`, if the grid has it. Where a direction is closed, steps of more than one go on
/// beyond its end; those from the end itself are those from its beginning, which are there already.
fn step(grid: &Grid, closed: [bool; 3], index: [usize; 3], offset: [i8; 3]) -> Option<usize> {
    let mut next = [0; 3];
    for a in 0..3 {
        let (last, reached) = (grid.extents()[a] as isize - 1, index[a] as isize + isize::from(offset[a]));
        let inside = (0..=last).contains(&reached);
        let inner = 0 < index[a] && (index[a] as isize) < last;
        next[a] = match () {
            () if inside => reached as usize,
            () if closed[a] && inner => reached.rem_euclid(last) as usize,
            () => return None,
        };
    }
    Some(grid.node(next))
}

/// Cells that contain the spring from `index` with this offset, or the boxes of cells that it crosses.
fn cells_around(grid: &Grid, index: [usize; 3], offset: [i8; 3]) -> u32 {
    let inside = |a: usize| offset[a] == 0 && index[a] > 0 && index[a] + 1 < grid.extents()[a];
    (0..grid.dimension()).map(|a| if inside(a) { 2 } else { 1 }).product()
}

/// Length of the diagonal of the box around the points, m.
pub fn diagonal(positions: &[[f64; 3]]) -> f64 {
    let extent = |a: usize| {
        let (low, high) =
            positions.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x[a]), high.max(x[a])));
        high - low
    };
    if positions.is_empty() { 0.0 } else { (0..3).map(|a| extent(a).powi(2)).sum::<f64>().sqrt() }
}
