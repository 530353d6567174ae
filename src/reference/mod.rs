//! Floor 2: the elastic body that the springs shall imitate.
//!
//! | file | idea |
//! |---|---|
//! | [`material`] | Young's modulus and Poisson's ratio to the two constants of isotropic elasticity |
//! | [`locking`] | a word about methods that lock near nu = 1/2 |
//! | [`points`] | integration points, the one currency between a method and every integral |
//! | [`methods`] | the table of methods, and how each fills them: splines, finite elements |
//! | [`stiffness`] | element stiffness, its pattern and its assembly |
//! | [`mass`] | consistent and lumped masses, Rayleigh damping |
//! | [`loads`] | forces on nodes, tractions on faces of a patch, body forces |
//! | [`load_fields`] | torsion, bending, radial and random smooth forces |
//! | [`polynomial_loads`] | all forces of degree 2 in the place |
//! | [`load_file`] | forces from a JSON file |
//! | [`side_loads`] | tractions on sides of a mesh |
//! | [`corotational`] | large rotations: energy, forces and tangents by domain, and their equilibrium |
//! | [`supports`] | do the supports hold the body |
//! | [`statics`] | K u = f with a checked backward error |
//! | [`matrix_free`] | K u = f on fine meshes: conjugate gradients on a K that is applied and not stored |
//! | [`modes`] | the lowest natural frequencies |
//! | [`stress`] | displacement and stress at a place |
//! | [`transfer`] | forces and fields between a mesh and a finer one |
//!
//! [`Reference::solve`] puts them together and chooses between the two ways to solve. The room does not know that springs exist.

pub mod corotational;
pub mod load_fields;
pub mod load_file;
pub mod loads;
pub mod locking;
pub mod mass;
pub mod material;
pub mod matrix_free;
pub mod methods;
pub mod modes;
pub mod points;
pub mod polynomial_loads;
mod quadrature;
mod ragged;
pub mod side_loads;
pub mod statics;
pub mod stiffness;
pub mod stress;
pub mod supports;
pub mod transfer;

use nalgebra_sparse::CsrMatrix;

use crate::clock::{Interrupt, Stopwatch};
use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::geometry::loose::mechanism;
use crate::reference::corotational::statics::Large;
use crate::reference::loads::Load;
use crate::reference::material::Lame;
use crate::reference::matrix_free::solve::Limits;
use crate::reference::points::IntegrationPoints;
use crate::sparse::cholesky::Symbolic;
use crate::sparse::condition::Accuracy;
use crate::sparse::zero_modes::zero_modes;

/// Iterations after which conjugate gradients are given up and the matrix is factored.
const ITERATIONS: usize = 1000;

/// Free degrees of freedom from which on the iteration takes less time than the factorisation, in two and in three
/// dimensions (measured on squares, cubes, spheroids and tori; in two dimensions it only saves memory).
const ITERATE_FROM: [usize; 2] = [1_000_000, 3_000];

/// |f - K u| / |f| that the iteration goes to: displacements then agree with the direct ones to 1e-10 or better.
pub const TOLERANCE: f64 = 1e-12;

/// The solved body: what a calibration compares springs with.
#[derive(Debug, Clone)]
pub struct Reference {
    /// K over the free degrees of freedom in N/m, both triangles; absent when it was applied and not stored.
    pub stiffness: Option<CsrMatrix<f64>>,
    /// sqrt(sum of K_ij^2) over the free degrees of freedom, in N/m.
    frobenius: f64,
    /// How it was solved.
    pub path: Path,
    /// One for each load case, in the order of the loads.
    pub cases: Vec<Case>,
    /// Volume in m^3, area in m^2 in two dimensions, as the quadrature of the stiffness sees it.
    pub measure: f64,
    /// How the cases were solved under large displacements; none for a body that is linear.
    pub large: Option<Large>,
    /// How sure the solutions are, the worst of all load cases.
    pub accuracy: Accuracy,
    /// Seconds for all of it.
    pub seconds: f64,
}

/// What a body is solved under.
#[derive(Debug, Clone, Copy)]
pub struct Forces<'a> {
    /// The load cases.
    pub loads: &'a [Load],
    /// Further forces on the free degrees of freedom, one after the other, N: they have displacements and nothing else, and
    /// change no bit of the load cases.
    pub probes: &'a [f64],
}

/// How a body was solved.
#[derive(Debug, Clone, PartialEq)]
pub enum Path {
    /// By a factorisation of K.
    Direct {
        /// Why not by iteration.
        reason: &'static str,
    },
    /// By conjugate gradients on a K that is not stored.
    Iterative {
        /// Iterations of each load case, without those of its refinement.
        iterations: Vec<usize>,
        /// Largest |f - K u| / |f|, computed.
        residual: f64,
    },
}

/// The answer of the body to one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Displacement of each free degree of freedom in m.
    pub displacement: Vec<f64>,
    /// f.u in J, twice the strain energy of a linear body.
    pub compliance: f64,
    /// max_i |u_i| over the nodes, in m.
    pub u_max: f64,
    /// sqrt(sum_i |u_i|^2) over the nodes (tied ones each count), in m.
    pub u_norm2: f64,
}

/// Why [`Reference::solve`] would factor K, if it would; `None` when it would iterate.
pub fn reason_to_factor(points: &IntegrationPoints, dofs: &DofMap) -> Option<&'static str> {
    match points.splines() {
        None => Some("the body is not a spline patch"),
        Some(_) if dofs.len() < ITERATE_FROM[points.dimension() - 2] => Some("the body is small"),
        Some(_) => None,
    }
}

impl Reference {
    /// Solves for every load: by iteration where that is faster ([`reason_to_factor`]), otherwise, and where the
    /// iteration does not converge, by a factorisation of K in the elimination order `order` (a permutation of the free
    /// degrees of freedom).
    ///
    /// # Errors
    /// [`crate::error::Error::FoldedElement`], [`crate::error::Error::Mechanism`] of a body whose pieces hang together
    /// loosely, [`crate::error::Error::Inaccurate`]; call [`supports::check`] first to name a body that is not held.
    pub fn solve(
        points: &IntegrationPoints,
        lame: Lame,
        dofs: &DofMap,
        order: Vec<u32>,
        loads: &[Load],
    ) -> Result<Self> {
        Self::solve_watching(points, lame, dofs, order, loads, &Interrupt::default())
    }

    /// [`Reference::solve`] that ends soon after the user stops the run, when it iterates.
    ///
    /// # Errors
    /// Those of [`Reference::solve`], and [`crate::error::Error::Interrupted`].
    pub fn solve_watching(
        points: &IntegrationPoints,
        lame: Lame,
        dofs: &DofMap,
        order: Vec<u32>,
        loads: &[Load],
        interrupt: &Interrupt,
    ) -> Result<Self> {
        Ok(Self::solve_probing(points, lame, dofs, order, Forces { loads, probes: &[] }, interrupt)?.0)
    }

    /// [`Reference::solve_watching`], and the displacements (m, one after the other) under the probes.
    ///
    /// # Errors
    /// Those of [`Reference::solve_watching`].
    pub fn solve_probing(
        points: &IntegrationPoints,
        lame: Lame,
        dofs: &DofMap,
        order: Vec<u32>,
        forces: Forces,
        interrupt: &Interrupt,
    ) -> Result<(Self, Vec<f64>)> {
        if let Some(reason) = reason_to_factor(points, dofs) {
            return Self::factor(points, lame, dofs, order, forces, reason);
        }
        match Self::iterate(points, lame, dofs, forces, interrupt)? {
            Some(found) => Ok(found),
            None => Self::factor(points, lame, dofs, order, forces, "the iteration did not converge"),
        }
    }

    /// Assembles K and factors it; `reason` is kept in the result.
    ///
    /// # Errors
    /// Those of [`Reference::solve`].
    pub fn direct(
        points: &IntegrationPoints,
        lame: Lame,
        dofs: &DofMap,
        order: Vec<u32>,
        loads: &[Load],
        reason: &'static str,
    ) -> Result<Self> {
        Ok(Self::factor(points, lame, dofs, order, Forces { loads, probes: &[] }, reason)?.0)
    }

    fn factor(
        points: &IntegrationPoints,
        lame: Lame,
        dofs: &DofMap,
        order: Vec<u32>,
        Forces { loads, probes }: Forces,
        reason: &'static str,
    ) -> Result<(Self, Vec<f64>)> {
        let watch = Stopwatch::start();
        let pattern = stiffness::pattern(points, dofs);
        let stiffness = stiffness::stiffness(points, lame, dofs, &pattern)?;
        let symbolic = Symbolic::analyse(&pattern, order)?;
        let right: Vec<&[f64]> = loads.iter().map(|load| load.forces.as_slice()).collect();
        let (solved, probed) =
            statics::solve_probing(&stiffness, &symbolic, &right, probes).map_err(|error| match error {
                Error::NotPositiveDefinite { .. } => {
                    let modes = zero_modes(&symbolic, &symbolic.lower_of(&stiffness));
                    if modes.count == 0 { error } else { mechanism("reference body", &modes, dofs) }
                }
                other => other,
            })?;
        let found = Self {
            frobenius: stiffness
                .row_iter()
                .map(|row| row.values().iter().map(|k| k * k).sum::<f64>())
                .sum::<f64>()
                .sqrt(),
            stiffness: Some(stiffness),
            path: Path::Direct { reason },
            cases: Case::of_all(dofs, loads, solved.displacements),
            measure: points.measure()?,
            accuracy: solved.accuracy,
            large: None,
            seconds: watch.seconds(),
        };
        Ok((found, probed))
    }

    /// Solves by conjugate gradients; `None` when the body is not a spline patch or the iteration does not converge.
    ///
    /// # Errors
    /// [`crate::error::Error::FoldedElement`].
    pub fn iterative(points: &IntegrationPoints, lame: Lame, dofs: &DofMap, loads: &[Load]) -> Result<Option<Self>> {
        let found = Self::iterate(points, lame, dofs, Forces { loads, probes: &[] }, &Interrupt::default())?;
        Ok(found.map(|(reference, _)| reference))
    }

    fn iterate(
        points: &IntegrationPoints,
        lame: Lame,
        dofs: &DofMap,
        Forces { loads, probes }: Forces,
        interrupt: &Interrupt,
    ) -> Result<Option<(Self, Vec<f64>)>> {
        let watch = Stopwatch::start();
        let right: Vec<&[f64]> = loads.iter().map(|load| load.forces.as_slice()).collect();
        let limits = Limits { tolerance: TOLERANCE, iterations: ITERATIONS };
        let solve = |right: &[&[f64]]| matrix_free::solve::solve(points, lame, dofs, right, limits, interrupt);
        let Some(found) = solve(&right)? else { return Ok(None) };
        let probes: Vec<&[f64]> = probes.chunks_exact(dofs.len().max(1)).collect();
        let probed = match probes.is_empty() {
            true => vec![],
            false => match solve(&probes)? {
                Some(probed) => probed.displacements.concat(),
                None => return Ok(None),
            },
        };
        let reference = Self {
            stiffness: None,
            frobenius: found.frobenius,
            path: Path::Iterative { iterations: found.iterations, residual: found.residual },
            cases: Case::of_all(dofs, loads, found.displacements),
            measure: found.volume / points.thickness(),
            large: None,
            accuracy: found.accuracy,
            seconds: watch.seconds(),
        };
        Ok(Some((reference, probed)))
    }

    /// sqrt(sum of K_ij^2) over the free degrees of freedom, in N/m.
    pub fn stiffness_frobenius(&self) -> f64 {
        self.frobenius
    }
}

impl Case {
    /// The answer to the same load times `factor`.
    pub fn scale(&mut self, factor: f64) {
        self.displacement.iter_mut().for_each(|u| *u *= factor);
        self.compliance *= factor * factor;
        self.u_max *= factor.abs();
        self.u_norm2 *= factor.abs();
    }

    fn of_all(dofs: &DofMap, loads: &[Load], displacements: Vec<Vec<f64>>) -> Vec<Self> {
        loads.iter().zip(displacements).map(|(load, u)| Self::new(dofs, &load.forces, u)).collect()
    }

    /// The case with this displacement under these forces, both over the free degrees of freedom.
    pub fn new(dofs: &DofMap, forces: &[f64], displacement: Vec<f64>) -> Self {
        // a power of two in front of all keeps the squares of very small and very large ones in range, and every digit
        let largest = displacement.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        let unit = if largest > 0.0 && largest.is_finite() { largest.log2().floor().exp2() } else { 1.0 };
        let squares: Vec<f64> =
            dofs.expand(&displacement).iter().map(|u| u.iter().map(|c| (c / unit).powi(2)).sum::<f64>()).collect();
        Self {
            compliance: forces.iter().zip(&displacement).map(|(f, u)| f * u).sum(),
            u_max: unit * squares.iter().fold(0.0, |most: f64, &s| most.max(s)).sqrt(),
            u_norm2: unit * squares.iter().sum::<f64>().sqrt(),
            displacement,
        }
    }
}
