//! Which nodes of a mesh are joined by springs.
//!
//! Every cell joins its corners: along its edges, across its faces and, in hexahedra, through its inside. A spring belongs to
//! as many cells as have both its nodes. On the quadrilaterals and hexahedra of a grid this gives the springs of
//! [`super::topology`]; triangles and tetrahedra have edges only.
//!
//! Where the nodes lie on a grid a spring keeps its step in the grid, and its kind is that of the step: the cut of a
//! square into two triangles is a face diagonal. On a mesh without a grid the step is zero and the kind that in the cell;
//! of two cells that disagree (a tetrahedron beside a hexahedron) the shorter kind counts.
//!
//! The second ring is that of the grid where there is one. Elsewhere it joins every node to the neighbours of its
//! neighbours, unless another node lies on the way; such a spring counts once.

use std::collections::{BTreeMap, BTreeSet};

use crate::geometry::dofs::DofMap;
use crate::geometry::grid::Grid;
use crate::geometry::mesh::{CellKind, Mesh};

use super::network::{Kind, Network};
use super::topology::{self, Link};

/// Corners of a hexahedron as steps from the first.
const HEXAHEDRON: [[i8; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

/// All pairs of corners of all cells.
pub(super) fn edges_and_diagonals(mesh: &Mesh, grid: Option<&Grid>, dofs: &DofMap) -> Network {
    connect(mesh, grid, dofs, |_| true)
}

/// The edges of all cells.
pub(super) fn edges_only(mesh: &Mesh, grid: Option<&Grid>, dofs: &DofMap) -> Network {
    connect(mesh, grid, dofs, |kind| kind == Kind::Edge)
}

/// No spring at all.
pub(super) fn unconnected(mesh: &Mesh, grid: Option<&Grid>, dofs: &DofMap) -> Network {
    connect(mesh, grid, dofs, |_| false)
}

/// All pairs of corners, and what is two steps away: in the grid where there is one, else the neighbours of neighbours.
pub(super) fn two_rings(mesh: &Mesh, grid: Option<&Grid>, dofs: &DofMap) -> Network {
    let mut all = links(mesh, grid, |_| true);
    match grid {
        Some(grid) => {
            let near: BTreeSet<[usize; 2]> = all.iter().map(|link| link.nodes).collect();
            let rings = [1, 2].map(|reach| topology::links(grid, dofs, &topology::offsets(grid.dimension(), reach)));
            let further = rings.into_iter().flatten();
            all.extend(
                further.filter(|link| {
                    !near.contains(&[link.nodes[0].min(link.nodes[1]), link.nodes[0].max(link.nodes[1])])
                }),
            );
        }
        None => all.extend(beyond(mesh, &all, dofs)),
    }
    topology::collect(mesh.dimension(), mesh.positions(), dofs, all.into_iter())
}

fn connect(mesh: &Mesh, grid: Option<&Grid>, dofs: &DofMap, wanted: fn(Kind) -> bool) -> Network {
    topology::collect(mesh.dimension(), mesh.positions(), dofs, links(mesh, grid, wanted).into_iter())
}

/// The links inside the cells, of the kinds that are wanted.
fn links(mesh: &Mesh, grid: Option<&Grid>, wanted: fn(Kind) -> bool) -> Vec<Link> {
    let inside = pairs(mesh).into_iter().filter(|(_, (kind, _))| wanted(*kind));
    let link = |([node, neighbour], (kind, cells)): ([u32; 2], (Kind, u32))| {
        let offset = grid.map_or([0; 3], |grid| step(grid, node, neighbour));
        let kind = if offset == [0; 3] { kind } else { Kind::of(offset) };
        Link { nodes: [node as usize, neighbour as usize], kind, offset, cells }
    };
    inside.map(link).collect()
}

/// Links to the neighbours of neighbours, without those on whose way a node lies.
fn beyond(mesh: &Mesh, near: &[Link], dofs: &DofMap) -> Vec<Link> {
    let mut around = vec![BTreeSet::new(); dofs.nodes()];
    for [a, b] in near.iter().map(|link| link.nodes.map(|node| dofs.master(node))).filter(|[a, b]| a != b) {
        around[a].insert(b);
        around[b].insert(a);
    }
    let mut found = Vec::new();
    for (node, near) in around.iter().enumerate() {
        let mut reached: BTreeMap<usize, bool> = BTreeMap::new();
        for &middle in near {
            for &far in around[middle].iter().filter(|&&far| far > node && !near.contains(&far)) {
                let [a, b, c] = [node, middle, far].map(|node| mesh.positions()[node]);
                *reached.entry(far).or_insert(true) &= !on_the_way(a, b, c);
            }
        }
        let free = reached.into_iter().filter(|(_, free)| *free);
        found.extend(free.map(|(far, _)| Link {
            nodes: [node, far],
            kind: Kind::SecondRing,
            offset: [0; 3],
            cells: 1,
        }));
    }
    found
}

/// True when `b` lies on the line from `a` to `c`: |b - a| + |c - b| = |c - a| up to rounding.
fn on_the_way(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> bool {
    let between = |p: [f64; 3], q: [f64; 3]| (0..3).map(|i| (q[i] - p[i]).powi(2)).sum::<f64>().sqrt();
    between(a, b) + between(b, c) <= between(a, c) * (1.0 + 1e-12)
}

/// Pairs of nodes with a cell in common, the smaller first, ascending: their kind and how many cells they share.
fn pairs(mesh: &Mesh) -> BTreeMap<[u32; 2], (Kind, u32)> {
    let mut found = BTreeMap::new();
    for cell in 0..mesh.cells() {
        let corners = mesh.corners(cell);
        for j in 1..corners.len() {
            for i in 0..j {
                let kind = kind_in_cell(mesh.kind(cell), i, j);
                let pair = [corners[i].min(corners[j]), corners[i].max(corners[j])];
                let entry = found.entry(pair).or_insert((kind, 0));
                *entry = (entry.0.min(kind), entry.1 + 1);
            }
        }
    }
    found
}

/// How the corners i and j lie in a cell.
fn kind_in_cell(cell: CellKind, i: usize, j: usize) -> Kind {
    match cell {
        CellKind::Triangle | CellKind::Tetrahedron => Kind::Edge,
        CellKind::Quadrilateral | CellKind::Hexahedron => {
            Kind::of([0, 1, 2].map(|a| HEXAHEDRON[j][a] - HEXAHEDRON[i][a]))
        }
    }
}

/// Step in the grid from a node to a later one; its first step that is not zero is positive.
fn step(grid: &Grid, from: u32, to: u32) -> [i8; 3] {
    let (start, end) = (grid.index(from as usize), grid.index(to as usize));
    [0, 1, 2].map(|a| (end[a] as i64 - start[a] as i64) as i8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::grid_mesh::mesh_of_grid;

    fn sheared(grid: &Grid) -> Vec<[f64; 3]> {
        let place = |node: usize| grid.index(node).map(|i| i as f64);
        (0..grid.len()).map(place).map(|[x, y, z]| [x + 0.25 * y + 0.5 * z, y, z]).collect()
    }

    fn sorted(mut network: Network) -> Network {
        network.springs.sort_by_key(|spring| spring.nodes);
        network
    }

    #[test]
    fn on_a_grid_of_quadrilaterals_or_hexahedra_both_ways_to_connect_agree() {
        for (shape, kind) in [(vec![3, 4], CellKind::Quadrilateral), (vec![4, 3, 2], CellKind::Hexahedron)] {
            let grid = Grid::new(&shape);
            let mesh = mesh_of_grid(&grid, sheared(&grid), kind);
            let mut master: Vec<u32> = (0..grid.len() as u32).collect();
            for tied in [false, true] {
                if tied {
                    let last = grid.len() - 1;
                    master[last] = last as u32 - 2;
                }
                let dofs = DofMap::new(grid.dimension(), master.clone(), &vec![[false; 3]; grid.len()]);
                for topology in topology::TOPOLOGIES {
                    let on_grid = (topology.connect)(&grid, mesh.positions(), &dofs);
                    let on_mesh = (topology.connect_mesh)(&mesh, Some(&grid), &dofs);
                    assert_eq!(sorted(on_mesh), sorted(on_grid), "{} {kind:?} tied: {tied}", topology.name);
                }
            }
        }
    }

    #[test]
    fn simplices_of_a_cube_have_one_diagonal_a_face_and_one_inside() {
        let grid = Grid::new(&[2, 2, 2]);
        let mesh = mesh_of_grid(&grid, sheared(&grid), CellKind::Tetrahedron);
        let dofs = DofMap::untied(3, &[[false; 3]; 8]);
        let network = edges_and_diagonals(&mesh, Some(&grid), &dofs);
        let count = |kind: Kind| network.springs.iter().filter(|spring| spring.kind == kind).count();
        assert_eq!(Kind::ALL.map(count), [12, 6, 1, 0, 0]);
        assert_eq!(network.springs.iter().map(|spring| spring.cells).sum::<u32>(), 6 * 6);
        let alone = edges_and_diagonals(&mesh, None, &dofs);
        assert!(alone.springs.iter().all(|spring| spring.kind == Kind::Edge && spring.offset == [0; 3]));
    }
}
