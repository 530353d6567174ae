//! Meshes, and boundary value problems on them.

use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::geometry::grid_mesh::mesh_of_grid;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::reference::loads::Load;
use springfit::reference::material::{Lame, Material, Plane};
use springfit::reference::methods::{self, MethodBody};
use springfit::reference::points::IntegrationPoints;
use springfit::reference::{side_loads, statics, stiffness};
use springfit::sparse::cholesky::Symbolic;
use springfit::sparse::ordering::minimum_degree;

/// A field over places.
pub type Field<'a, T> = &'a dyn Fn([f64; 3]) -> T;

pub fn lame(young: f64, poisson: f64, dimension: usize, plane: Plane) -> Lame {
    Material { young, poisson }.lame(dimension, plane).expect("a material")
}

/// The grid of these numbers of cells on the unit square or cube, every node moved by `place`, cut into `kind`.
pub fn mapped(cells: &[usize], kind: CellKind, place: Field<[f64; 3]>) -> Mesh {
    let grid = Grid::new(&cells.iter().map(|n| n + 1).collect::<Vec<_>>());
    let share = |node: usize| {
        let index = grid.index(node);
        [0, 1, 2].map(|a| cells.get(a).map_or(0.0, |&n| index[a] as f64 / n as f64))
    };
    mesh_of_grid(&grid, (0..grid.len()).map(share).map(place).collect(), kind)
}

/// A method of the table on a mesh, thickness 1.
pub fn points<'a>(method: &str, mesh: &'a Mesh) -> IntegrationPoints<'a> {
    match methods::find(method).expect("in the table").body {
        MethodBody::Mesh { points, .. } => points(mesh, 1.0).expect("cells of the method"),
        MethodBody::Patch(_) => panic!("{method} does not work on meshes"),
    }
}

/// Holds the components that `held` names at each place.
pub fn supports(mesh: &Mesh, held: Field<[bool; 3]>) -> DofMap {
    let fixed: Vec<[bool; 3]> = mesh.positions().iter().map(|&x| held(x)).collect();
    DofMap::untied(mesh.dimension(), &fixed)
}

/// A traction on the boundary sides whose corners all satisfy `on`.
pub fn traction(mesh: &Mesh, dofs: &DofMap, on: Field<bool>, value: &dyn Fn([f64; 3], [f64; 3]) -> [f64; 3]) -> Load {
    let faces = mesh.boundary_faces().expect("a manifold");
    let there = |corners: &&[u32]| corners.iter().all(|&node| on(mesh.positions()[node as usize]));
    side_loads::traction(mesh, faces.iter().map(|face| face.nodes()).filter(there), 1.0, dofs, value)
        .expect("a traction")
}

/// Displacement of all nodes under forces on the free dofs, with displacements `given` (n x 3) at held components.
pub fn solve(
    points: &IntegrationPoints,
    lame: Lame,
    dofs: &DofMap,
    forces: &[f64],
    given: &[[f64; 3]],
) -> Vec<[f64; 3]> {
    let mut right = forces.to_vec();
    statics::prescribe(points, lame, dofs, given, &mut right).expect("forces of the given displacement");
    let pattern = stiffness::pattern(points, dofs);
    let matrix = stiffness::stiffness(points, lame, dofs, &pattern).expect("a stiffness");
    let symbolic = Symbolic::analyse(&pattern, minimum_degree(&pattern).expect("an order")).expect("an analysis");
    let solved = statics::solve(&matrix, &symbolic, &[&right]).expect("a solution");
    let mut displacement = dofs.expand(&solved.displacements[0]);
    for (u, given) in displacement.iter_mut().zip(given) {
        (0..3).for_each(|i| u[i] += given[i]);
    }
    displacement
}

/// The node at a place.
pub fn node_at(mesh: &Mesh, place: [f64; 3]) -> usize {
    let near = |x: &[f64; 3]| (0..3).all(|a| (x[a] - place[a]).abs() < 1e-9);
    mesh.positions().iter().position(near).expect("a node there")
}
