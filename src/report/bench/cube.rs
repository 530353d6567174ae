//! The problem that every method is measured on: K(phi) u = f on a cube of n x n x n control points.
//!
//! Quadratic, held at its bottom, one force on every free control point, length groups at gamma = 0.1 (three on a cube:
//! edges, face and body diagonals), phi a tenth of its upper bounds: what `springfit run` meets at its first start. The
//! number of unknowns is 3 n^2 (n - 1).

use std::sync::Arc;

use crate::error::Result;
use crate::scene::{self, Scene, Source};
use crate::sparse::cholesky::Symbolic;
use crate::springs::affine::AffineStiffness;
use crate::springs::bounds;
use crate::springs::grouping::{self, Grouping};
use crate::springs::solver::SpringOperator;
use crate::study::body::{self, Body};
use crate::study::loads;
use crate::study::network::{self, Lattice};

/// Sizes n that can be asked for: the smallest quadratic cube, and what 32-bit indices of a pattern allow.
pub const SIZES: std::ops::RangeInclusive<usize> = 3..=129;

/// Stiffness as a fraction of the upper bounds.
const FRACTION: f64 = 0.1;

/// A cube with its network.
pub struct Cube {
    /// Control points along an edge.
    pub size: usize,
    /// The body.
    pub body: Body,
    /// Forces on the free degrees of freedom, N.
    pub forces: Vec<f64>,
    /// The network with its analysis.
    pub lattice: Lattice,
    /// The groups.
    pub grouping: Grouping,
    /// K(phi), assembled.
    pub operator: SpringOperator<'static>,
    /// phi, N/m.
    pub phi: Vec<f64>,
}

impl Cube {
    /// Builds the cube of n^3 control points.
    ///
    /// # Errors
    /// When its factor cannot be stored.
    ///
    /// # Panics
    /// When `size` is not one of [`SIZES`].
    pub fn new(size: usize) -> Result<Self> {
        assert!(SIZES.contains(&size), "a size that the command line allows");
        let scene = scene(size);
        let body = body::build(&scene)?;
        let forces = loads::build(&scene, &body)?.swap_remove(0).load.forces;
        let lattice = network::build(&scene, &body)?;
        let groups = (grouping::find("length").expect("the table has it").group)(&lattice.network, 0.1)?;
        let symbolic = Arc::clone(lattice.symbolic.as_ref().expect("the scene asks for a path with factors"));
        let stiffness = AffineStiffness::new(&lattice.network, &groups, &lattice.coefficients, &body.dofs, &symbolic);
        let operator = SpringOperator::Assembled { stiffness, symbolic };
        let upper = bounds::upper_bounds(&lattice.network, &groups, &lattice.spring_bounds, scene.springs.law);
        let phi = upper.iter().map(|upper| FRACTION * upper).collect();
        Ok(Self { size, body, forces, lattice, grouping: groups, operator, phi })
    }

    /// K(phi).
    pub fn stiffness(&self) -> &AffineStiffness {
        self.operator.assembled().expect("assembled when it was made").0
    }

    /// The analysis of its pattern.
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        self.operator.assembled().expect("assembled when it was made").1
    }

    /// |f - K(phi) u| / |f|, with K from the springs themselves, not from the matrix that was factored.
    pub fn residual(&self, phi: &[f64], u: &[f64]) -> f64 {
        let mut product = vec![0.0; u.len()];
        self.stiffness().apply_all(phi, u, &mut product);
        let difference: f64 = self.forces.iter().zip(&product).map(|(f, p)| (f - p).powi(2)).sum();
        (difference / self.forces.iter().map(|f| f * f).sum::<f64>()).sqrt()
    }
}

/// The scene of a cube.
fn scene(size: usize) -> Scene {
    let text = format!(
        "[geometry]\nshape = \"cube\"\ncontrol_points = [{size}, {size}, {size}]\n\
         [material]\nyoung = 15e3\npoisson = 0.3333333333333333\n\
         [support]\nfaces = [\"z-\"]\n[[load]]\nforce_per_node = [80.0, -40.0, 40.0]\n\
         [solver]\npath = \"direct\"\n"
    );
    scene::parse(&Source { name: "cube".into(), text }).expect("a valid scene")
}
