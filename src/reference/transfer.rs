//! Between a mesh and a finer one whose displacements contain its own.
//!
//! Forces on the nodes of a mesh mean work on its displacements only; on a finer mesh they say nothing yet. They are read as the body
//! force b that the mesh itself can represent and that does the same work on it,
//!
//! ```text
//! b = sum_a N_a g_a,    sum_b (int N_a N_b dV) g_b = f_a          (M g = f, over what is free)
//! ```
//!
//! which acts on the finer mesh by F_A = int N_A b dV. With P, the coarse displacements written in the finer mesh,
//! P^T F = f: the coarse solution is then the projection of the finer one, and what lies between them is the error of
//! the discretisation and nothing else. b in N/m^3, f in N.
//!
//! Two fields over one mesh are compared as fields, by integrals over the body and not by their coefficients.

use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::reference::loads::{self, Load};
use crate::reference::points::{ElementPoints, IntegrationPoints};
use crate::reference::{mass, statics, stiffness};
use crate::sparse::cholesky::Symbolic;

/// The body forces whose work is that of the forces of each load (N, over the free degrees of freedom): coefficients
/// for every node in N/m^3, zero where it is held. `order`: an elimination order of the free degrees of freedom.
///
/// # Errors
/// Those of the integration points and of [`statics::solve`].
pub fn densities(
    points: &IntegrationPoints,
    dofs: &DofMap,
    order: Vec<u32>,
    loads: &[&[f64]],
) -> Result<Vec<Vec<[f64; 3]>>> {
    let pattern = stiffness::pattern(points, dofs);
    let mass = mass::consistent(points, 1.0, dofs, &pattern)?;
    let solved = statics::solve(&mass, &Symbolic::analyse(&pattern, order)?, loads)?;
    Ok(solved.displacements.iter().map(|density| dofs.expand(density)).collect())
}

/// The load of a body force given by its coefficients (nodes x 3, N/m^3).
///
/// # Errors
/// Those of the integration points and of [`loads::nodal`].
pub fn load(points: &IntegrationPoints, dofs: &DofMap, density: &[[f64; 3]]) -> Result<Load> {
    let points = points.of_body();
    let shares = points.map_mass(|e, filled| {
        let acting = points.acting(e);
        let mut shares = vec![[0.0; 3]; acting.len()];
        for_each_point(acting, filled, density, |volume, values, b| {
            for (share, value) in shares.iter_mut().zip(values) {
                (0..3).for_each(|c| share[c] += volume * value * b[c]);
            }
        });
        shares
    })?;
    let mut forces = vec![[0.0; 3]; dofs.nodes()];
    for (e, shares) in shares.iter().enumerate() {
        for (&node, share) in points.acting(e).iter().zip(shares) {
            (0..3).for_each(|c| forces[node as usize][c] += share[c]);
        }
    }
    loads::nodal(dofs, &forces)
}

/// How large a field is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// sqrt(int |u|^2 dV / V), like the field.
    pub root_mean_square: f64,
    /// Largest |u| at an integration point.
    pub largest: f64,
}

/// The size of the field with these coefficients (nodes x 3).
///
/// # Errors
/// Those of the integration points.
pub fn size(points: &IntegrationPoints, field: &[[f64; 3]]) -> Result<Size> {
    let points = points.of_body();
    let parts = points.map_mass(|e, filled| {
        let (mut square, mut volume, mut largest) = (0.0, 0.0, 0.0_f64);
        for_each_point(points.acting(e), filled, field, |v, _, u| {
            let length: f64 = u.iter().map(|u| u * u).sum();
            square += v * length;
            volume += v;
            largest = largest.max(length);
        });
        (square, volume, largest)
    })?;
    let (square, volume) = parts.iter().fold((0.0, 0.0), |(s, v), part| (s + part.0, v + part.1));
    let largest = parts.iter().fold(0.0_f64, |most, part| most.max(part.2));
    Ok(Size { root_mean_square: (square / volume).sqrt(), largest: largest.sqrt() })
}

/// Calls `f` with volume, shape functions and value of the field at every point of an element.
fn for_each_point(
    acting: &[u32],
    filled: &ElementPoints,
    field: &[[f64; 3]],
    mut f: impl FnMut(f64, &[f64], [f64; 3]),
) {
    for (&volume, values) in filled.volumes.iter().zip(filled.values.chunks_exact(acting.len().max(1))) {
        let mut sum = [0.0; 3];
        for (&node, value) in acting.iter().zip(values) {
            (0..3).for_each(|c| sum[c] += value * field[node as usize][c]);
        }
        f(volume, values, sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::dofs::tie_coincident;
    use crate::geometry::patch::Patch;
    use crate::geometry::refine::refined;
    use crate::geometry::selection::face_nodes;
    use crate::geometry::shapes;
    use crate::reference::methods::nurbs;
    use crate::rng::Stream;
    use crate::sparse::ordering::minimum_degree;

    fn held(patch: &Patch, face: &str, merged: bool) -> DofMap {
        let mut fixed = vec![[false; 3]; patch.points().len()];
        face_nodes(&patch.grid(), face).unwrap().iter().for_each(|&node| fixed[node as usize] = [true; 3]);
        let master = match merged {
            true => tie_coincident(patch.points(), 1e-9),
            false => (0..patch.points().len() as u32).collect(),
        };
        DofMap::new(patch.dimension(), master, &fixed)
    }

    #[test]
    fn forces_do_the_same_work_on_a_finer_mesh() {
        for (name, face, merged) in
            [("circle", "x-", false), ("torus", "y-", false), ("torus", "y-", true), ("cube", "z-", false)]
        {
            let shape = shapes::find(name).unwrap();
            let patch = (shape.build)(&shape.default_request()).unwrap();
            let fine = refined(&patch, 1, 1).unwrap();
            let (coarse_dofs, fine_dofs) = (held(&patch, face, merged), held(&fine, face, merged));
            // rational functions: more points than the degree asks for, so that both meshes integrate alike
            let (coarse_points, fine_points) =
                (nurbs::integration_points(&patch, 8, 1.0), nurbs::integration_points(&fine, 8, 1.0));
            let mut stream = Stream::new(7, 0, 0);
            let mut random = |n: usize| (0..n).map(|_| 2.0 * stream.uniform() - 1.0).collect::<Vec<f64>>();
            let (force, displacement) = (random(coarse_dofs.len()), random(coarse_dofs.len()));
            let order = minimum_degree(&stiffness::pattern(&coarse_points, &coarse_dofs)).unwrap();
            let density = densities(&coarse_points, &coarse_dofs, order, &[&force]).unwrap().pop().unwrap();
            let lift = |field: Vec<[f64; 3]>| refined(&patch.with_points(field).unwrap(), 1, 1).unwrap();
            let finer = load(&fine_points, &fine_dofs, lift(density).points()).unwrap();
            let moved = lift(coarse_dofs.expand(&displacement));
            let work: f64 = force.iter().zip(&displacement).map(|(f, u)| f * u).sum();
            let size: f64 = force.iter().zip(&displacement).map(|(f, u)| (f * u).abs()).sum();
            let mut once = vec![0.0; fine_dofs.len()];
            for (node, u) in moved.points().iter().enumerate() {
                for (&dof, u) in fine_dofs.free(node).iter().zip(u).filter(|(dof, _)| **dof != u32::MAX) {
                    once[dof as usize] = *u;
                }
            }
            let fine_work: f64 = finer.forces.iter().zip(&once).map(|(f, u)| f * u).sum();
            assert!((work - fine_work).abs() < 1e-11 * size, "{name} {merged}: {work} {fine_work}");
        }
    }

    #[test]
    fn the_size_of_a_rigid_rotation_is_that_of_its_inertia() {
        // u = (-y, x) on the unit square: mean |u|^2 = mean of x^2 + y^2 = 2/3
        let shape = shapes::find("square").unwrap();
        let mut request = shape.default_request();
        request.size = vec![1.0, 1.0];
        let patch = (shape.build)(&request).unwrap();
        let corner = patch.points().iter().fold([f64::INFINITY; 2], |m, x| [m[0].min(x[0]), m[1].min(x[1])]);
        let turned = patch.points().iter().map(|x| [corner[1] - x[1], x[0] - corner[0], 0.0]).collect::<Vec<_>>();
        let found = size(&nurbs::integration_points(&patch, 0, 1.0), &turned).unwrap();
        assert!((found.root_mean_square - (2.0_f64 / 3.0).sqrt()).abs() < 1e-14, "{found:?}");
        assert!(found.largest < 2.0_f64.sqrt() && found.largest > 1.2, "{found:?}");
    }
}
