//! The cantilever of the comparison: how far it sags, how fast it swings, what a step costs.
//!
//! A box of 1 x 0.2 x 0.2 m, E = 1 MPa, nu = 0.3, rho = 1000 kg/m^3, held at x = 0, under its weight. The tip is the mean of
//! the four corners at x = 1 m, which no distortion moves: every mesh is measured at the same points.

use nalgebra_sparse::CsrMatrix;

use crate::clock::{Stopwatch, processor_seconds};
use crate::dynamics::corotational::CorotationalModel;
use crate::dynamics::external::{External, History, Part};
use crate::dynamics::integrator;
use crate::dynamics::model::Model;
use crate::dynamics::stepper::{Settings, Stepper};
use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::geometry::mesh::Mesh;
use crate::geometry::meshes::kuhn::{distort, kuhn_box};
use crate::reference::corotational::Tangent;
use crate::reference::corotational::held::Held;
use crate::reference::loads;
use crate::reference::material::{Lame, Material, Plane};
use crate::reference::methods::smoothed::{self, Domains, Smoothing};
use crate::reference::methods::t10;
use crate::reference::modes::lowest_frequencies;
use crate::reference::points::IntegrationPoints;
use crate::reference::{mass, stiffness};
use crate::sparse::block_jacobi::BlockJacobi;
use crate::sparse::cg;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::ordering::minimum_degree;

/// Size of the box in m.
const SIZE: [f64; 3] = [1.0, 0.2, 0.2];
/// kg/m^3.
const DENSITY: f64 = 1000.0;
/// m/s^2.
const GRAVITY: f64 = 9.81;

/// How the strain is averaged, and the name.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// The name of the method.
    pub name: &'static str,
    /// Its domains over a mesh.
    pub domains: fn(&Mesh) -> Result<Domains>,
    /// Whether it may be set in motion.
    pub moves: bool,
}

/// The methods that are compared.
pub const WAYS: &[Way] = &[
    Way { name: "t4", domains: |mesh| smoothed::domains(mesh, Smoothing::Element, 1.0), moves: true },
    Way { name: "smoothed_face", domains: |mesh| smoothed::domains(mesh, Smoothing::Face, 1.0), moves: true },
    Way { name: "smoothed_edge", domains: |mesh| smoothed::domains(mesh, Smoothing::Edge, 1.0), moves: true },
    Way { name: "smoothed_node", domains: |mesh| smoothed::domains(mesh, Smoothing::Node, 1.0), moves: false },
    Way {
        name: "smoothed_selective",
        domains: |mesh| smoothed::selective(mesh, Smoothing::Face, Smoothing::Node, 1.0),
        moves: true,
    },
];

/// The box in so many cells, its inner nodes moved by up to `alpha` cells.
pub fn mesh(cells: [usize; 3], alpha: f64, seed: u64) -> Mesh {
    let mut mesh = kuhn_box(SIZE, cells);
    distort(&mut mesh, SIZE, cells, alpha, seed);
    mesh
}

fn lame() -> Result<Lame> {
    Material { young: 1e6, poisson: 0.3 }.lame(3, Plane::Strain)
}

fn clamped(positions: &[[f64; 3]]) -> DofMap {
    let fixed: Vec<[bool; 3]> = positions.iter().map(|x| [x[0] == 0.0; 3]).collect();
    DofMap::untied(3, &fixed)
}

/// Mean of -u_z at the corners of the free end, m.
fn tip(positions: &[[f64; 3]], dofs: &DofMap, u: &[f64]) -> f64 {
    let is_corner = |x: [f64; 3]| (0..3).all(|i| (x[i] - SIZE[i]).abs() < 1e-9 || (i > 0 && x[i] == 0.0));
    let corners = (0..positions.len()).filter(|&node| is_corner(positions[node]));
    let moved = corners.map(|node| -u[dofs.free(node)[2] as usize]);
    moved.sum::<f64>() / 4.0
}

/// Tip deflection in m and first frequency in Hz of a linear body with a mass over its free degrees of freedom.
fn linear(
    points: &IntegrationPoints,
    positions: &[[f64; 3]],
    mass: &dyn Fn(&DofMap) -> Result<CsrMatrix<f64>>,
) -> Result<[f64; 2]> {
    let dofs = clamped(positions);
    let pattern = stiffness::pattern(points, &dofs);
    let matrix = stiffness::stiffness(points, lame()?, &dofs, &pattern)?;
    let mut factor = Factor::new(Symbolic::analyse(&pattern, minimum_degree(&pattern)?)?);
    factor.load(&matrix);
    factor.refactor()?;
    let load = loads::body_force(points, &dofs, &|_| [0.0, 0.0, -DENSITY * GRAVITY])?;
    let mut u = vec![0.0; dofs.len()];
    factor.solve(&load.forces, &mut u)?;
    let mass = mass(&dofs)?;
    let frequencies = lowest_frequencies(&mut factor, &|v, out| multiply(&mass, v, out), 1)?;
    Ok([tip(positions, &dofs, &u), frequencies[0]])
}

/// out = A v
fn multiply(a: &CsrMatrix<f64>, v: &[f64], out: &mut [f64]) {
    for (out, row) in out.iter_mut().zip(a.row_iter()) {
        *out = row.col_indices().iter().zip(row.values()).map(|(&j, a)| a * v[j]).sum();
    }
}

/// Tip deflection in m and first frequency in Hz of smoothed elements with lumped masses.
///
/// # Errors
/// Those of the mesh and of the solve.
pub fn sag(way: Way, mesh: &Mesh) -> Result<[f64; 2]> {
    let points = (way.domains)(mesh)?.into_points(mesh)?;
    linear(&points, mesh.positions(), &|dofs| {
        let masses = mass::lumped(&points, DENSITY, dofs)?;
        let n = dofs.len();
        let values = (0..n).map(|dof| masses[dofs.owner(dof).0]).collect();
        Ok(CsrMatrix::try_from_csr_data(n, n, (0..=n).collect(), (0..n).collect(), values).expect("a diagonal"))
    })
}

/// The same of quadratic tetrahedra with consistent masses.
///
/// # Errors
/// As [`sag`].
pub fn sag_quadratic(mesh: &Mesh) -> Result<[f64; 2]> {
    let positions = t10::Quadratic::new(mesh)?.positions;
    let points = t10::domains(mesh)?.into_points(mesh)?;
    linear(&points, &positions, &|dofs| t10::mass(mesh, DENSITY, dofs))
}

/// A corotational beam, and its weight in N.
fn moving(way: Way, mesh: &Mesh, tangent: Tangent) -> Result<(CorotationalModel, Vec<f64>)> {
    let points = (way.domains)(mesh)?.into_points(mesh)?;
    let dofs = clamped(mesh.positions());
    let masses = mass::lumped(&points, DENSITY, &dofs)?;
    let load = loads::body_force(&points, &dofs, &|_| [0.0, 0.0, -DENSITY * GRAVITY])?;
    let held = Held::new((way.domains)(mesh)?, mesh.positions(), lame()?, dofs)?;
    Ok((CorotationalModel::new(held, &masses, tangent), load.forces))
}

/// Time step of the swing in s: about a hundredth of a period.
const STEP: f64 = 0.01;

/// Steps in which the tip must have come back.
const MOST_STEPS: usize = 250;

/// The straight beam is let go under its weight, and moves by implicit midpoint, which takes nothing from the
/// amplitude: largest deflection of the tip in m, and the time in s after which it is highest again.
///
/// # Errors
/// Those of the steps.
pub fn swing(way: Way, mesh: &Mesh) -> Result<[f64; 2]> {
    let (mut model, forces) = moving(way, mesh, Tangent::Exact)?;
    let dofs = model.body().dofs().clone();
    let external = External { parts: vec![Part { forces, history: History::Constant }] };
    let midpoint = integrator::find("midpoint").expect("in the table");
    let zeros = vec![0.0; dofs.len()];
    let settings = Settings::with_step(STEP);
    let mut stepper = Stepper::new(&mut model, &external, midpoint, settings, [&zeros, &zeros])?;
    let mut path = vec![0.0];
    let mut amplitude = None;
    for _ in 0..MOST_STEPS {
        stepper.advance()?;
        path.push(tip(mesh.positions(), &dofs, &stepper.state().displacement));
        let turn = turning(&path);
        match (amplitude, turn) {
            (None, Some([_, top, sign])) if sign < 0.0 => amplitude = Some(top),
            (Some(amplitude), Some([time, low, sign])) if sign > 0.0 && low < 0.5 * amplitude => {
                return Ok([amplitude, time]);
            }
            _ => {}
        }
    }
    Ok([amplitude.unwrap_or(f64::NAN), f64::NAN])
}

/// Time and value of a turning point among the last three, by the parabola through them, and the sign of its curvature.
fn turning(path: &[f64]) -> Option<[f64; 3]> {
    let &[a, b, c] = path.last_chunk()?;
    let (slope, curvature) = (0.5 * (c - a), a - 2.0 * b + c);
    ((b - a) * (c - b) <= 0.0 && curvature != 0.0).then(|| {
        let shift = -slope / curvature;
        [((path.len() - 2) as f64 + shift) * STEP, b + 0.5 * slope * shift, curvature.signum()]
    })
}

/// Processor time of one semi-implicit step by stage, and sizes.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Cost {
    /// Domains, each with a rotation.
    pub domains: usize,
    /// 3 x 3 blocks of K, both triangles, of all nodes that can move.
    pub blocks: usize,
    /// Rotations and forces, s.
    pub force: f64,
    /// The warped tangent, s.
    pub assembly: f64,
    /// Sparse Cholesky, analysed before: factorisation and solve, s.
    pub direct: f64,
    /// Conjugate gradients with block Jacobi to 1e-6, s.
    pub iterative: f64,
    /// Their iterations.
    pub iterations: usize,
}

impl Cost {
    /// A step with the faster of the two solves, s.
    pub fn whole(&self) -> f64 {
        self.force + self.assembly + self.direct.min(self.iterative)
    }
}

/// Times that a stage is run; the shortest counts.
const RUNS: usize = 6;

/// |b - A x| / |b| that a step on a screen asks for.
const INTERACTIVE: f64 = 1e-6;

/// What a step costs in a bent state, on one thread for the factor and all for the rest.
///
/// # Errors
/// Those of the solve.
pub fn cost(way: Way, mesh: &Mesh) -> Result<Cost> {
    let (mut model, _) = moving(way, mesh, Tangent::Warped)?;
    let n = model.unknowns();
    let u: Vec<f64> = (0..n).map(|dof| bent(mesh.positions(), model.body().dofs().owner(dof))).collect();
    let (zeros, mut force, mut v) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let pattern = model.pattern().clone();
    let mut factor = Factor::new(Symbolic::analyse(&pattern, minimum_degree(&pattern)?)?);
    let (mut stiffness, mut damping) = (vec![0.0; pattern.entries()], vec![0.0; pattern.entries()]);
    let force_time = shortest(|| {
        model.internal_force(&u, &zeros, &mut force);
        Ok(())
    })?;
    let tangent_time = shortest(|| {
        model.tangent(&u, &zeros, &mut stiffness, &mut damping);
        Ok(())
    })?;
    let mut matrix = CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), stiffness).expect("its values");
    for (dof, mass) in model.masses().iter().enumerate() {
        let place = pattern.position(dof, dof).expect("the diagonal is stored");
        matrix.values_mut()[place] += mass / (STEP * STEP);
    }
    let direct = shortest(|| {
        factor.load(&matrix);
        factor.refactor()?;
        factor.solve(&force, &mut v).map(|_| ())
    })?;
    let mut jacobi = BlockJacobi::new(&pattern, |dof| model.body().dofs().owner(dof).0);
    let (mut work, mut iterations) = (cg::Workspace::new(n), 0);
    let iterative = shortest(|| {
        jacobi.load(matrix.values());
        v.fill(0.0);
        let (apply, precondition) =
            (&mut |p: &[f64], q: &mut [f64]| multiply(&matrix, p, q), &mut |r: &[f64], z: &mut [f64]| {
                jacobi.apply(r, z)
            });
        iterations = cg::solve(apply, precondition, &force, &mut v, INTERACTIVE, n, &mut work).iterations;
        Ok(())
    })?;
    let place_time = shortest(|| {
        model.elastic_energy(&u);
        Ok(())
    })?;
    Ok(Cost {
        domains: model.body().body().domains().len(),
        blocks: pattern.entries() / 9,
        force: force_time,
        // the tangent places the body anew, a step does that once
        assembly: (tangent_time - place_time).max(0.0),
        direct,
        iterative,
        iterations,
    })
}

/// A component of a bent shape at a node: a quarter of a circle.
fn bent(positions: &[[f64; 3]], (node, i): (usize, usize)) -> f64 {
    let [x, _, z] = positions[node];
    let radius = 2.0 / std::f64::consts::PI;
    let (sine, cosine) = (x / radius).sin_cos();
    match i {
        0 => (radius - z) * sine - x,
        1 => 0.0,
        _ => radius - (radius - z) * cosine - z,
    }
}

/// The shortest processor time of several runs in s; time on the wall where the system does not tell.
fn shortest(mut run: impl FnMut() -> Result<()>) -> Result<f64> {
    let mut shortest = f64::INFINITY;
    for _ in 0..RUNS {
        let (watch, before) = (Stopwatch::start(), processor_seconds());
        run()?;
        let spent = before.zip(processor_seconds()).map_or(watch.seconds(), |(before, after)| after - before);
        shortest = shortest.min(spent);
    }
    Ok(shortest)
}
