//! A boundary value problem with a known answer: solve it, and measure the errors.

use springfit::geometry::dofs::DofMap;
use springfit::geometry::patch::Patch;
use springfit::geometry::selection::face_nodes;
use springfit::reference::loads::{self, Face};
use springfit::reference::material::{Lame, Material, Plane};
use springfit::reference::methods::nurbs;
use springfit::reference::points::{ElementPoints, displacement_gradient};
use springfit::reference::{statics, stiffness};
use springfit::sparse::cholesky::Symbolic;
use springfit::sparse::ordering::nested_dissection;

/// A field over places.
pub type Field<'a, T> = &'a dyn Fn([f64; 3]) -> T;

/// Displacement (m) and stress (Pa) of the exact solution.
pub struct Exact<'a> {
    pub displacement: Field<'a, [f64; 3]>,
    pub stress: Field<'a, [[f64; 3]; 3]>,
}

/// Relative errors in the L2 and the energy norm, and the strain energy (J) of the exact solution.
#[derive(Debug, Clone, Copy)]
pub struct Errors {
    pub l2: f64,
    pub energy_norm: f64,
    pub exact_energy: f64,
}

pub fn lame(young: f64, poisson: f64, plane: Plane) -> Lame {
    Material { young, poisson }.lame(2, plane).expect("a material")
}

/// Holds the given components of the nodes of whole faces; coincident control points stay separate.
pub fn held(body: &Patch, faces: &[(&str, &[usize])]) -> DofMap {
    let mut fixed = vec![[false; 3]; body.points().len()];
    for (face, components) in faces {
        for node in face_nodes(&body.grid(), face).expect("a face") {
            components.iter().for_each(|&i| fixed[node as usize][i] = true);
        }
    }
    DofMap::untied(body.dimension(), &fixed)
}

/// Consistent nodal forces of the exact stress on one face.
pub fn exact_traction(body: &Patch, face: &str, extra_points: usize, dofs: &DofMap, exact: &Exact) -> Vec<f64> {
    let face = Face { patch: body, name: face, thickness: 1.0, extra_points };
    let load = loads::traction(face, dofs, &|x, n| (exact.stress)(x).map(|row| row[0] * n[0] + row[1] * n[1]));
    load.expect("a traction").forces
}

/// A solved problem: displacement of all nodes (m), and the strain energy (J) as the quadrature of K sees it.
pub struct Solved {
    pub displacement: Vec<[f64; 3]>,
    pub energy: f64,
}

/// Solves with `forces` on the free dofs and displacements `given` (n x 3) at the held components.
pub fn solve(body: &Patch, extra: usize, lame: Lame, dofs: &DofMap, forces: &[f64], given: &[[f64; 3]]) -> Solved {
    let points = nurbs::integration_points(body, extra, 1.0);
    let mut right = forces.to_vec();
    statics::prescribe(&points, lame, dofs, given, &mut right).expect("forces of the given displacement");
    let pattern = stiffness::pattern(&points, dofs);
    let matrix = stiffness::stiffness(&points, lame, dofs, &pattern).expect("a stiffness");
    let reach = *body.degree().iter().max().expect("degrees");
    let order = dofs.order(&nested_dissection(body.grid().extents(), reach, [false; 3]));
    let symbolic = Symbolic::analyse(&pattern, order).expect("an analysis");
    let solved = statics::solve(&matrix, &symbolic, &[&right]).expect("a solution");
    let mut displacement = dofs.expand(&solved.displacements[0]);
    for (u, given) in displacement.iter_mut().zip(given) {
        (0..3).for_each(|i| u[i] += given[i]);
    }
    let reactions = stiffness::internal_forces(&points, lame, &displacement).expect("forces");
    let work = |(f, u): (&[f64; 3], &[f64; 3])| f.iter().zip(u).map(|(f, u)| f * u).sum::<f64>();
    let energy = 0.5 * reactions.iter().zip(&displacement).map(work).sum::<f64>();
    Solved { displacement, energy }
}

/// Integrates the differences to the exact solution with `extra` Gauss points beyond degree + 1.
pub fn errors(body: &Patch, extra: usize, lame: Lame, displacement: &[[f64; 3]], exact: &Exact) -> Errors {
    let points = nurbs::integration_points(body, extra, 1.0);
    let mut filled = ElementPoints::default();
    let [mut u_square, mut u_error, mut energy, mut energy_error] = [0.0; 4];
    for element in 0..points.elements() {
        points.fill(element, &mut filled).expect("points");
        let acting = points.acting(element);
        for (q, &volume) in filled.volumes.iter().enumerate() {
            let local = q * acting.len()..(q + 1) * acting.len();
            let gradient = displacement_gradient(acting, &filled.gradients[local.clone()], displacement);
            let (stress, found) = ((exact.stress)(filled.positions[q]), lame.stress(&gradient));
            let u = (exact.displacement)(filled.positions[q]);
            let mut difference = u;
            for (&node, value) in acting.iter().zip(&filled.values[local]) {
                (0..3).for_each(|i| difference[i] -= value * displacement[node as usize][i]);
            }
            u_square += volume * u.iter().map(|u| u * u).sum::<f64>();
            u_error += volume * difference.iter().map(|u| u * u).sum::<f64>();
            energy += volume * energy_density(lame, |i, j| stress[i][j]);
            energy_error += volume * energy_density(lame, |i, j| stress[i][j] - found[i][j]);
        }
    }
    Errors { l2: (u_error / u_square).sqrt(), energy_norm: (energy_error / energy).sqrt(), exact_energy: energy }
}

/// sigma : e / 2 in the plane, with the inverted law e = (sigma - lambda tr(sigma) / (2 (lambda + mu)) 1) / (2 mu).
fn energy_density(lame: Lame, sigma: impl Fn(usize, usize) -> f64) -> f64 {
    let trace = sigma(0, 0) + sigma(1, 1);
    let squares = sigma(0, 0).powi(2) + sigma(1, 1).powi(2) + 2.0 * sigma(0, 1).powi(2);
    (squares - lame.lambda / (2.0 * (lame.lambda + lame.mu)) * trace * trace) / (4.0 * lame.mu)
}
