//! Floor 2: the elastic body that the springs shall imitate.
//!
//! | file | idea |
//! |---|---|
//! | [`material`] | Young's modulus and Poisson's ratio to the two constants of isotropic elasticity |
//! | [`points`] | integration points, the one currency between a method and every integral |
//! | [`methods`] | how each method fills them: isogeometric |
//! | [`stiffness`] | element stiffness, its pattern and its assembly |
//! | [`loads`] | forces on nodes, tractions, body forces |
//! | [`supports`] | do the supports hold the body |
//! | [`statics`] | K u = f with a checked backward error |
//! | [`stress`] | displacement and stress at a place |
//!
//! [`Reference::solve`] puts them together. The room does not know that springs exist.

pub mod loads;
pub mod material;
pub mod matrix_free;
pub mod methods;
pub mod points;
mod quadrature;
pub mod statics;
pub mod stiffness;
pub mod stress;
pub mod supports;

use nalgebra_sparse::CsrMatrix;

use crate::clock::Stopwatch;
use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::reference::loads::Load;
use crate::reference::material::Lame;
use crate::reference::points::IntegrationPoints;
use crate::sparse::cholesky::Symbolic;

/// The solved body: what a calibration compares springs with.
#[derive(Debug, Clone)]
pub struct Reference {
    /// K over the free degrees of freedom in N/m, both triangles.
    pub stiffness: CsrMatrix<f64>,
    /// One for each load case, in the order of the loads.
    pub cases: Vec<Case>,
    /// Volume in m^3, area in m^2 in two dimensions, as the quadrature of the stiffness sees it.
    pub measure: f64,
    /// Largest componentwise backward error of the solutions.
    pub backward_error: f64,
    /// Seconds for assembly, analysis, factorisation and solves.
    pub seconds: f64,
}

/// The answer of the body to one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Displacement of each free degree of freedom in m.
    pub displacement: Vec<f64>,
    /// f.u in J, twice the strain energy.
    pub compliance: f64,
    /// max_i |u_i| over the nodes, in m.
    pub u_max: f64,
    /// sqrt(sum_i |u_i|^2) over the nodes (tied ones each count), in m.
    pub u_norm2: f64,
}

impl Reference {
    /// Assembles K, factors it in the elimination order `order` (a permutation of the free degrees of freedom) and
    /// solves for every load.
    ///
    /// # Errors
    /// [`crate::error::Error::FoldedElement`], [`crate::error::Error::NotPositiveDefinite`],
    /// [`crate::error::Error::Inaccurate`]; call [`supports::check`] first to name a body that is not held.
    pub fn solve(
        points: &IntegrationPoints,
        lame: Lame,
        dofs: &DofMap,
        order: Vec<u32>,
        loads: &[Load],
    ) -> Result<Self> {
        let watch = Stopwatch::start();
        let pattern = stiffness::pattern(points, dofs);
        let stiffness = stiffness::stiffness(points, lame, dofs, &pattern)?;
        let symbolic = Symbolic::analyse(&pattern, order)?;
        let right: Vec<&[f64]> = loads.iter().map(|load| load.forces.as_slice()).collect();
        let solved = statics::solve(&stiffness, &symbolic, &right)?;
        let cases = loads.iter().zip(solved.displacements).map(|(load, u)| Case::new(dofs, &load.forces, u)).collect();
        let measure = points.measure()?;
        Ok(Self { stiffness, cases, measure, backward_error: solved.backward_error, seconds: watch.seconds() })
    }

    /// sqrt(sum of K_ij^2) over the free degrees of freedom, in N/m.
    pub fn stiffness_frobenius(&self) -> f64 {
        self.stiffness.values().iter().map(|k| k * k).sum::<f64>().sqrt()
    }
}

impl Case {
    fn new(dofs: &DofMap, forces: &[f64], displacement: Vec<f64>) -> Self {
        let squares: Vec<f64> =
            dofs.expand(&displacement).iter().map(|u| u.iter().map(|c| c * c).sum::<f64>()).collect();
        Self {
            compliance: forces.iter().zip(&displacement).map(|(f, u)| f * u).sum(),
            u_max: squares.iter().fold(0.0, |most: f64, &s| most.max(s)).sqrt(),
            u_norm2: squares.iter().sum::<f64>().sqrt(),
            displacement,
        }
    }
}
