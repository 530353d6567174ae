//! Zero modes, counted: 3 in the plane and 6 in space for every free body, none for one that is held.

use std::sync::Arc;

use springfit::geometry::dofs::{DofMap, tie_coincident};
use springfit::geometry::grid::Grid;
use springfit::geometry::grid_mesh::mesh_of_grid;
use springfit::geometry::patch::Patch;
use springfit::geometry::selection::face_nodes;
use springfit::geometry::shapes::{self, SHAPES, Shape};
use springfit::reference::material::{Material, Plane};
use springfit::reference::methods::{METHODS, MethodBody, nurbs};
use springfit::reference::points::IntegrationPoints;
use springfit::reference::stiffness;
use springfit::sparse::cholesky::Symbolic;
use springfit::sparse::ordering::minimum_degree;
use springfit::sparse::zero_modes::zero_modes;
use springfit::springs::network::Network;
use springfit::springs::{affine, mechanism, topology};

pub fn patch(shape: &Shape) -> Patch {
    (shape.build)(&shape.default_request()).expect("a body")
}

/// Nodes at one place tied, the nodes of a face held.
pub fn dofs(dimension: usize, points: &[[f64; 3]], held: &[u32]) -> DofMap {
    let mut fixed = vec![[false; 3]; points.len()];
    held.iter().for_each(|&node| fixed[node as usize] = [true; 3]);
    DofMap::new(dimension, tie_coincident(points, 1e-9), &fixed)
}

/// Zero modes of the continuum.
pub fn of_continuum(points: &IntegrationPoints, poisson: f64, dofs: &DofMap) -> usize {
    let lame = Material { young: 15e3, poisson }.lame(points.dimension(), Plane::Strain).expect("a material");
    let pattern = stiffness::pattern(points, dofs);
    let matrix = stiffness::stiffness(points, lame, dofs, &pattern).expect("a stiffness");
    let symbolic = Symbolic::analyse(&pattern, minimum_degree(&pattern).expect("an order")).expect("an analysis");
    zero_modes(&symbolic, &symbolic.lower_of(&matrix)).count
}

/// The analysis of a network.
pub fn analysis(network: &Network, dofs: &DofMap) -> Arc<Symbolic> {
    let pattern = affine::pattern(network, dofs);
    Symbolic::analyse(&pattern, minimum_degree(&pattern).expect("an order")).expect("an analysis")
}

/// Zero modes of a network with all its springs.
pub fn of_network(network: &Network, dofs: &DofMap) -> usize {
    let all = vec![true; network.springs.len()];
    mechanism::count(network, &all, dofs, &analysis(network, dofs)).count
}

/// The springs of a topology on a grid.
pub fn connect(name: &str, grid: &Grid, points: &[[f64; 3]], dofs: &DofMap) -> Network {
    (topology::find(name).expect("a topology").connect)(grid, points, dofs)
}

fn rigid(dimension: usize) -> usize {
    if dimension == 2 { 3 } else { 6 }
}

#[test]
fn free_bodies_have_exactly_their_rigid_motions_as_splines_and_as_springs() {
    for shape in SHAPES {
        let body = patch(shape);
        let free = dofs(shape.dimension, body.points(), &[]);
        for poisson in [-0.5, 0.3, 0.49] {
            let found = of_continuum(&nurbs::integration_points(&body, 0, 1.0), poisson, &free);
            assert_eq!(found, rigid(shape.dimension), "{} nu {poisson}", shape.name);
        }
        let network = connect("grid", &body.grid(), body.points(), &free);
        assert_eq!(of_network(&network, &free), rigid(shape.dimension), "springs of {}", shape.name);
    }
}

#[test]
fn free_bodies_have_exactly_their_rigid_motions_under_every_method_with_merged_seams() {
    for method in METHODS {
        let MethodBody::Mesh { cells, points } = method.body else { continue };
        let shapes: &[&str] = if cells[0].dimension() == 2 { &["square", "circle"] } else { &["cube", "torus"] };
        for name in shapes {
            let shape = shapes::find(name).expect("a shape");
            let mut request = shape.default_request();
            if *name == "torus" {
                request.control_points = vec![9, 3, 3];
            }
            let (grid, nodes) = (Grid::new(&request.control_points), shape.nodes(&request).expect("nodes"));
            let free = dofs(shape.dimension, &nodes, &[]);
            let mesh = mesh_of_grid(&grid, nodes, cells[0]);
            let found = of_continuum(&points(&mesh, 1.0).expect("points"), 0.3, &free);
            assert_eq!(found, rigid(shape.dimension), "{} on {name}", method.name);
            let network = (topology::TOPOLOGIES[0].connect_mesh)(&mesh, Some(&grid), &free);
            assert_eq!(of_network(&network, &free), rigid(shape.dimension), "springs of {} on {name}", method.name);
        }
    }
}

#[test]
fn thesis_bodies_with_a_face_held_have_none() {
    for name in ["square", "circle", "ellipse", "cube", "torus", "spheroid"] {
        let shape = shapes::find(name).expect("a shape");
        let body = patch(shape);
        let face = face_nodes(&body.grid(), shape.fixed_face).expect("a face");
        let held = dofs(shape.dimension, body.points(), &face);
        assert_eq!(of_continuum(&nurbs::integration_points(&body, 0, 1.0), 1.0 / 3.0, &held), 0, "{name}");
        assert_eq!(of_network(&connect("grid", &body.grid(), body.points(), &held), &held), 0, "springs of {name}");
    }
}
