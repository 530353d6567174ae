//! The cantilever of the reference numbers: mesh, methods, supports, masses, loads.

use nalgebra_sparse::CsrMatrix;
use nalgebra_sparse::na::DMatrix;
use serde_json::Value;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::mesh::Mesh;
use springfit::geometry::meshes::kuhn::{distort, kuhn_box};
use springfit::reference::loads::nodal;
use springfit::reference::material::{Lame, Material, Plane};
use springfit::reference::methods::smoothed::{self, Domains, Smoothing};
use springfit::reference::methods::t10;
use springfit::reference::modes::lowest_frequencies;
use springfit::reference::points::{IntegrationPoints, Part};
use springfit::reference::stiffness;
use springfit::sparse::cholesky::{Factor, Symbolic};
use springfit::sparse::ordering::minimum_degree;

pub const SIZE: [f64; 3] = [1.0, 0.2, 0.2];
pub const DENSITY: f64 = 1000.0;
pub const GRAVITY: f64 = -9.81;

/// The four methods by the names of the reference file.
pub const METHODS: [(&str, Smoothing); 4] =
    [("fem", Smoothing::Element), ("fs", Smoothing::Face), ("es", Smoothing::Edge), ("ns", Smoothing::Node)];

pub fn reference_numbers() -> Value {
    serde_json::from_str(include_str!("smoothed_fem.json")).expect("the reference numbers are JSON")
}

pub fn lame(poisson: f64) -> Lame {
    Material { young: 1e6, poisson }.lame(3, Plane::Strain).expect("a compressible material")
}

pub fn beam(cells: [usize; 3], alpha: f64, seed: u64) -> Mesh {
    let mut mesh = kuhn_box(SIZE, cells);
    distort(&mut mesh, SIZE, cells, alpha, seed);
    mesh
}

/// Degrees of freedom with everything at x = 0 held.
pub fn clamped(positions: &[[f64; 3]]) -> DofMap {
    let fixed: Vec<[bool; 3]> = positions.iter().map(|x| [x[0] == 0.0; 3]).collect();
    DofMap::untied(3, &fixed)
}

/// Volume that every node stands for, by row sums of the mean shape functions.
pub fn row_sums(domains: &Domains) -> Vec<f64> {
    let mut volumes = vec![0.0; domains.nodes()];
    for k in (0..domains.len()).filter(|&k| domains.part(k) != Part::Volume) {
        for acting in domains.acting(k) {
            volumes[acting.node as usize] += domains.volume(k) * acting.value;
        }
    }
    volumes
}

/// Gravity on the free unknowns.
pub fn weight(dofs: &DofMap, volumes: &[f64]) -> Vec<f64> {
    let forces: Vec<[f64; 3]> = volumes.iter().map(|v| [0.0, 0.0, v * DENSITY * GRAVITY]).collect();
    nodal(dofs, &forces).expect("a weight").forces
}

/// Mean of -u_z over the corners of the face x = L.
pub fn tip(positions: &[[f64; 3]], displacement: &[[f64; 3]], axis: usize) -> f64 {
    let corner = |x: &[f64; 3]| (0..3).all(|i| (x[i] - SIZE[i]).abs() < 1e-12 || (i > 0 && x[i] == 0.0));
    let at: Vec<f64> = positions.iter().zip(displacement).filter(|(x, _)| corner(x)).map(|(_, u)| u[axis]).collect();
    assert_eq!(at.len(), 4);
    at.iter().sum::<f64>() / 4.0
}

/// What the linear problem answers.
pub struct Answer {
    pub tip: f64,
    pub energy: f64,
    pub frequencies: Vec<f64>,
}

/// The mass over the free unknowns.
type Mass<'a> = &'a dyn Fn(&DofMap) -> CsrMatrix<f64>;

/// A lumped mass.
pub fn lumped(dofs: &DofMap, volumes: &[f64]) -> CsrMatrix<f64> {
    let n = dofs.len();
    let masses = (0..n).map(|dof| DENSITY * volumes[dofs.owner(dof).0]).collect();
    CsrMatrix::try_from_csr_data(n, n, (0..=n).collect(), (0..n).collect(), masses).expect("a diagonal")
}

/// out = A v
fn multiply(a: &CsrMatrix<f64>, v: &[f64], out: &mut [f64]) {
    for (out, row) in out.iter_mut().zip(a.row_iter()) {
        *out = row.col_indices().iter().zip(row.values()).map(|(&j, a)| a * v[j]).sum();
    }
}

/// Solves the cantilever with the volumes that the nodes stand for under gravity and in motion.
pub fn solve(points: &IntegrationPoints, positions: &[[f64; 3]], lame: Lame, volumes: &[f64], mass: Mass) -> Answer {
    let dofs = clamped(positions);
    let pattern = stiffness::pattern(points, &dofs);
    let matrix = stiffness::stiffness(points, lame, &dofs, &pattern).expect("no folds");
    let symbolic = Symbolic::analyse(&pattern, minimum_degree(&pattern).expect("small")).expect("small");
    let mut factor = Factor::new(symbolic);
    factor.load(&matrix);
    factor.refactor().expect("held");
    let forces = weight(&dofs, volumes);
    let mut u = vec![0.0; forces.len()];
    factor.solve(&forces, &mut u).expect("accurate");
    let mass = mass(&dofs);
    Answer {
        tip: -tip(positions, &dofs.expand(&u), 2),
        energy: 0.5 * forces.iter().zip(&u).map(|(f, u)| f * u).sum::<f64>(),
        frequencies: lowest_frequencies(&mut factor, &|v, out| multiply(&mass, v, out), 4).expect("settled"),
    }
}

/// The cantilever on smoothing domains.
pub fn solve_smoothed(mesh: &Mesh, domains: Domains, poisson: f64) -> Answer {
    let volumes = row_sums(&domains);
    solve(&domains.into_points(mesh).expect("its mesh"), mesh.positions(), lame(poisson), &volumes, &|dofs| {
        lumped(dofs, &volumes)
    })
}

/// The cantilever on quadratic tetrahedra.
pub fn solve_quadratic(mesh: &Mesh, poisson: f64) -> Answer {
    let positions = t10::Quadratic::new(mesh).expect("tetrahedra").positions;
    let domains = t10::domains(mesh).expect("positive");
    let volumes = row_sums(&domains);
    let mass = |dofs: &DofMap| t10::mass(mesh, DENSITY, dofs).expect("positive");
    solve(&domains.into_points(mesh).expect("its mesh"), &positions, lame(poisson), &volumes, &mass)
}

pub fn smoothed_domains(mesh: &Mesh, smoothing: Smoothing) -> Domains {
    smoothed::domains(mesh, smoothing, 1.0).expect("a box of tetrahedra")
}

/// Every method of the acceptance list on one mesh, with the places of its nodes.
pub fn every_method(mesh: &Mesh) -> Vec<(&'static str, Domains, Vec<[f64; 3]>)> {
    let corners = mesh.positions().to_vec();
    let mut all: Vec<_> =
        METHODS.iter().map(|&(name, smoothing)| (name, smoothed_domains(mesh, smoothing), corners.clone())).collect();
    let selective = smoothed::selective(mesh, Smoothing::Face, Smoothing::Node, 1.0).expect("tetrahedra");
    all.push(("selective", selective, corners));
    let quadratic = t10::Quadratic::new(mesh).expect("tetrahedra").positions;
    all.push(("t10", t10::domains(mesh).expect("positive"), quadratic));
    all
}

/// A matrix as a dense one.
pub fn dense(matrix: &CsrMatrix<f64>) -> DMatrix<f64> {
    let mut dense = DMatrix::zeros(matrix.nrows(), matrix.ncols());
    matrix.triplet_iter().for_each(|(i, j, &value)| dense[(i, j)] = value);
    dense
}

/// Degrees of freedom of a body that nothing holds.
pub fn free(nodes: usize) -> DofMap {
    DofMap::untied(3, &vec![[false; 3]; nodes])
}

/// The stiffness of domains of a mesh over degrees of freedom, at rest.
pub fn linear_stiffness(mesh: &Mesh, domains: Domains, lame: Lame, dofs: &DofMap) -> CsrMatrix<f64> {
    let points = domains.into_points(mesh).expect("its mesh");
    let pattern = stiffness::pattern(&points, dofs);
    stiffness::stiffness(&points, lame, dofs, &pattern).expect("no folds")
}
