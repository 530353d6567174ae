//! What holds for every method of the table on every mesh.

use nalgebra_sparse::na::{DMatrix, SymmetricEigen};
use springfit::geometry::dofs::DofMap;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::geometry::shapes;
use springfit::reference::material::{Lame, Plane};
use springfit::reference::methods::{METHODS, nurbs};
use springfit::reference::points::IntegrationPoints;
use springfit::reference::{loads, mass, stiffness};

use crate::problem::{lame, mapped, points, traction};

/// A sheared and bent box of 2 x 1.5 (x 1) m in two cells a direction.
fn body(kind: CellKind) -> Mesh {
    let bend = |[x, y, z]: [f64; 3]| match kind.dimension() {
        2 => [2.0 * x + 0.3 * y, 1.5 * y + 0.2 * x * x, 0.0],
        _ => [2.0 * x + 0.3 * y * z, 1.5 * y + 0.2 * x * x, z + 0.1 * x * y],
    };
    mapped(&vec![2; kind.dimension()], kind, &bend)
}

/// Every method for meshes with a body for it.
fn bodies() -> Vec<(&'static str, Mesh)> {
    METHODS.iter().filter_map(|method| Some((method.name, body(method.cell()?)))).collect()
}

fn free(mesh: &Mesh) -> DofMap {
    DofMap::untied(mesh.dimension(), &vec![[false; 3]; mesh.positions().len()])
}

fn dense(points: &IntegrationPoints, law: Lame, dofs: &DofMap) -> DMatrix<f64> {
    let pattern = stiffness::pattern(points, dofs);
    let sparse = stiffness::stiffness(points, law, dofs, &pattern).expect("a stiffness");
    let mut matrix = DMatrix::zeros(dofs.len(), dofs.len());
    sparse.triplet_iter().for_each(|(i, j, value)| matrix[(i, j)] = *value);
    matrix
}

#[test]
fn free_bodies_have_the_rigid_motions_and_no_other_free_mode() {
    for (name, mesh) in bodies() {
        for plane in [Plane::Stress, Plane::Strain] {
            let law = lame(15e3, 0.3, mesh.dimension(), plane);
            let mut values: Vec<f64> =
                SymmetricEigen::new(dense(&points(name, &mesh), law, &free(&mesh))).eigenvalues.as_slice().to_vec();
            values.sort_by(f64::total_cmp);
            let (rigid, largest) = (if mesh.dimension() == 2 { 3 } else { 6 }, values[values.len() - 1]);
            assert!(values[..rigid].iter().all(|value| value.abs() < 1e-13 * largest), "{name}: {values:?}");
            assert!(values[rigid] > 1e-3 * largest, "{name} {plane:?}: {} of {largest}", values[rigid]);
        }
    }
}

/// A single element shows hourglass modes that a mesh may hide.
#[test]
fn a_single_element_has_the_rigid_motions_and_no_other_free_mode() {
    for method in METHODS {
        let Some(kind) = method.cell() else { continue };
        let whole = body(kind);
        let mut mesh = Mesh::new(whole.dimension(), whole.positions().to_vec());
        mesh.push(kind, whole.corners(0));
        let mut fixed = vec![[true; 3]; mesh.positions().len()];
        mesh.corners(0).iter().for_each(|&node| fixed[node as usize] = [false; 3]);
        let dofs = DofMap::untied(mesh.dimension(), &fixed);
        let law = lame(15e3, 0.3, mesh.dimension(), Plane::Strain);
        let values = SymmetricEigen::new(dense(&points(method.name, &mesh), law, &dofs)).eigenvalues;
        let zero = values.iter().filter(|value| value.abs() < 1e-12 * values.max()).count();
        assert_eq!(zero, if mesh.dimension() == 2 { 3 } else { 6 }, "{}: {values}", method.name);
    }
}

#[test]
fn forces_of_a_displacement_are_the_matrix_times_it() {
    for (name, mesh) in bodies() {
        let (dofs, elements) = (free(&mesh), points(name, &mesh));
        let law = lame(15e3, 0.4, mesh.dimension(), Plane::Strain);
        let wave = |x: &[f64; 3]| [x[0] * x[1] + x[2], (x[0] - 2.0 * x[1]).sin(), x[2] * x[0] - 0.5 * x[1]];
        let mut given: Vec<[f64; 3]> = mesh.positions().iter().map(wave).collect();
        given.iter_mut().for_each(|u| u[mesh.dimension()..].fill(0.0));
        let u: Vec<f64> = given.iter().flat_map(|u| &u[..mesh.dimension()]).copied().collect();
        let product = dense(&elements, law, &dofs) * nalgebra_sparse::na::DVector::from_vec(u);
        let forces = stiffness::internal_forces(&elements, law, &given).expect("forces");
        let found: Vec<f64> = forces.iter().flat_map(|f| &f[..mesh.dimension()]).copied().collect();
        let largest = product.amax();
        assert!(found.iter().zip(product.iter()).all(|(f, g)| (f - g).abs() < 1e-13 * largest), "{name}");
    }
}

#[test]
fn masses_3_11_and_3_12_are_those_of_the_body() {
    const DENSITY: f64 = 1143.0;
    for (name, mesh) in bodies() {
        let (dofs, elements) = (free(&mesh), points(name, &mesh));
        let whole = DENSITY * elements.measure().expect("a measure");
        let pattern = stiffness::pattern(&elements, &dofs);
        let consistent = mass::consistent(&elements, DENSITY, &dofs, &pattern).expect("a mass");
        let lumped = mass::lumped(&elements, DENSITY, &dofs).expect("masses");
        let shares = mass::equal_shares(&elements, DENSITY, &dofs).expect("masses");
        for masses in [&lumped, &shares] {
            assert!(
                (masses.iter().sum::<f64>() / whole - 1.0).abs() < 1e-14 && masses.iter().all(|m| *m > 0.0),
                "{name}"
            );
        }
        for (dof, row) in consistent.row_iter().enumerate() {
            let (node, component) = dofs.owner(dof);
            let same = row.col_indices().iter().zip(row.values()).filter(|(j, _)| dofs.owner(**j).1 == component);
            let sum: f64 = same.map(|(_, value)| value).sum();
            assert!(
                (sum / lumped[node] - 1.0).abs() < 1e-13,
                "{name}: row {dof} adds up to {sum}, not {}",
                lumped[node]
            );
        }
        let total: f64 = consistent.values().iter().sum();
        assert!((total / (whole * mesh.dimension() as f64) - 1.0).abs() < 1e-13, "{name}");
        let k = stiffness::stiffness(&elements, lame(15e3, 0.3, mesh.dimension(), Plane::Stress), &dofs, &pattern);
        let k = k.expect("a stiffness");
        let damping = mass::rayleigh(&consistent, &k, 0.5, 0.25);
        let sums = damping.values().iter().zip(consistent.values()).zip(k.values());
        assert!(sums.into_iter().all(|((c, m), k)| *c == 0.5 * m + 0.25 * k), "{name}");
    }
}

/// The mass of a body does not depend on how its stiffness is integrated: on one mesh every method that takes its cells has
/// the same masses at every node, the same volume and the same forces of a body force that varies.
#[test]
fn masses_volume_and_body_forces_are_those_of_the_mesh_whatever_the_method() {
    let kinds = [CellKind::Triangle, CellKind::Quadrilateral, CellKind::Tetrahedron, CellKind::Hexahedron];
    let mut meshes = kinds.map(body).to_vec();
    for [few, many] in [[1, 0], [3, 2]] {
        let mut mixed = meshes[many].clone();
        mixed.push(kinds[few], meshes[few].corners(0));
        meshes.push(mixed);
    }
    let mut compared = 0;
    for mesh in &meshes {
        let dofs = free(mesh);
        let able: Vec<_> = METHODS.iter().filter(|method| method.check(mesh).is_ok()).collect();
        let first = integrals(&points(able[0].name, mesh), &dofs);
        for method in &able[1..] {
            let found = integrals(&points(method.name, mesh), &dofs);
            for ((what, ours), (_, theirs)) in found.iter().zip(&first) {
                let apart =
                    ours.iter().zip(theirs).map(|(a, b)| (a - b).abs() / b.abs().max(1e-300)).fold(0.0, f64::max);
                assert!(ours.len() == theirs.len() && apart <= 1e-14, "{what} of {} is {apart:e} off", method.name);
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 5 * (3 + 1 + 6 + 1 + 1 + 1), "methods beside the first on each mesh");
}

/// What is integrated over the body: masses (3.11) and (3.12), the consistent ones that are not 0, forces of a body force,
/// the volume.
fn integrals(points: &IntegrationPoints, dofs: &DofMap) -> Vec<(&'static str, Vec<f64>)> {
    let pattern = stiffness::pattern(points, dofs);
    let consistent = mass::consistent(points, 1143.0, dofs, &pattern).expect("a mass");
    let density = |[x, y, z]: [f64; 3]| [1.0 + x * y, 2.0 + y * y, 3.0 + x + z];
    vec![
        ("the lumped mass", mass::lumped(points, 1143.0, dofs).expect("masses")),
        ("the mass by elements", mass::equal_shares(points, 1143.0, dofs).expect("masses")),
        ("the consistent mass", consistent.values().iter().copied().filter(|&mass| mass != 0.0).collect()),
        ("a body force", loads::body_force(points, dofs, &density).expect("forces").forces),
        ("the volume", vec![points.measure().expect("a measure")]),
    ]
}

/// Triangles m/12 (1 + delta), tetrahedra m/20 (1 + delta), bars of one square m/36 (4, 2, 1).
#[test]
fn consistent_mass_of_single_elements() {
    let unit = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    for (method, kind, places, scale, row) in [
        ("t3", CellKind::Triangle, &unit[..3], 0.5 / 12.0, vec![2.0, 1.0, 1.0]),
        ("t4", CellKind::Tetrahedron, &unit[..], 1.0 / 6.0 / 20.0, vec![2.0, 1.0, 1.0, 1.0]),
        ("q4", CellKind::Quadrilateral, &square[..], 1.0 / 36.0, vec![4.0, 2.0, 1.0, 2.0]),
    ] {
        let mut mesh = Mesh::new(kind.dimension(), places.to_vec());
        mesh.push(kind, &(0..places.len() as u32).collect::<Vec<_>>());
        let (dofs, elements) = (free(&mesh), points(method, &mesh));
        let matrix = mass::consistent(&elements, 1.0, &dofs, &stiffness::pattern(&elements, &dofs)).expect("a mass");
        for (node, expected) in row.iter().enumerate() {
            let found = matrix.get_entry(0, node * kind.dimension()).expect("in the pattern").into_value();
            assert!((found - scale * expected).abs() < 1e-15, "{method} 0 {node}: {found}");
        }
    }
}

#[test]
fn q4_on_a_grid_is_a_patch_of_degree_1() {
    for (name, method) in [("square", "q4"), ("cube", "b8")] {
        let shape = shapes::find(name).expect("in the table");
        let mut request = shape.default_request();
        request.degree = vec![1; shape.dimension];
        let patch = (shape.build)(&request).expect("a patch");
        let kind = springfit::reference::methods::find(method).and_then(|method| method.cell()).expect("cells");
        let positions = shape.nodes(&request).expect("nodes");
        let mesh = springfit::geometry::grid_mesh::mesh_of_grid(&patch.grid(), positions, kind);
        let law = lame(15e3, 0.3, shape.dimension, Plane::Strain);
        let dofs = free(&mesh);
        let (ours, theirs) =
            (dense(&points(method, &mesh), law, &dofs), dense(&nurbs::integration_points(&patch, 0, 1.0), law, &dofs));
        assert!((&ours - &theirs).amax() <= 1e-14 * theirs.amax(), "{name}: {:e}", (&ours - &theirs).amax());
    }
}

#[test]
fn a_pressure_on_the_whole_boundary_is_in_balance() {
    for (name, mesh) in bodies() {
        let load = traction(&mesh, &free(&mesh), &|_| true, &|_, n| n.map(|n| -3.0 * n));
        assert!(load.total.iter().all(|f| f.abs() < 1e-14), "{name}: {:?}", load.total);
        // the work of a pressure on a swelling u = x is -p d V
        let forces = load.forces.chunks_exact(mesh.dimension());
        let work: f64 =
            forces.zip(mesh.positions()).map(|(f, x)| f.iter().zip(x).map(|(f, x)| f * x).sum::<f64>()).sum();
        let volume = points(name, &mesh).measure().expect("a measure");
        let expected = -3.0 * mesh.dimension() as f64 * volume;
        assert!((work / expected - 1.0).abs() < 1e-13, "{name}: {work} instead of {expected}");
    }
}
