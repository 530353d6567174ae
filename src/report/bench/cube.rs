//! The problem that every method is measured on: K(phi) u = f on a cube of n x n x n control points.
//!
//! Quadratic, held at its bottom, one force on every free control point, length groups at gamma = 0.1 (three on a cube:
//! edges, face and body diagonals), phi a tenth of its upper bounds: what `springfit run` meets at its first start. The
//! number of unknowns is 3 n^2 (n - 1).
//!
//! The matrix is analysed and assembled when a method first asks for it, so that methods without one go as far as they can.

use std::cell::OnceCell;
use std::sync::Arc;

use crate::error::Result;
use crate::geometry::dofs::FIXED;
use crate::scene::{self, Scene, Source};
use crate::sparse::cholesky::Symbolic;
use crate::springs::affine::{self, AffineStiffness};
use crate::springs::bounds;
use crate::springs::grouping::{self, Grouping, Request};
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
    /// The network.
    pub lattice: Lattice,
    /// The groups.
    pub grouping: Grouping,
    /// phi, N/m.
    pub phi: Vec<f64>,
    /// K(phi), once it was asked for.
    operator: OnceCell<SpringOperator<'static>>,
}

impl Cube {
    /// Builds the cube of n^3 control points.
    ///
    /// # Errors
    /// None that these scenes have.
    ///
    /// # Panics
    /// When `size` is not one of [`SIZES`].
    pub fn new(size: usize) -> Result<Self> {
        assert!(SIZES.contains(&size), "a size that the command line allows");
        let scene = scene(size);
        let body = body::build(&scene)?;
        let forces = loads::build(&scene, &body)?.swap_remove(0).load.forces;
        let lattice = network::connect(&scene, &body)?;
        let groups =
            (grouping::find("length").expect("the table has it").group)(&lattice.network, &Request::with_gamma(0.1))?;
        let upper = bounds::upper_bounds(&groups, &lattice.spring_bounds, &lattice.factors);
        let phi = upper.iter().map(|upper| FRACTION * upper).collect();
        Ok(Self { size, body, forces, lattice, grouping: groups, phi, operator: OnceCell::new() })
    }

    /// K(phi), assembled.
    ///
    /// # Errors
    /// When its factor cannot be stored.
    pub fn operator(&self) -> Result<&SpringOperator<'static>> {
        if self.operator.get().is_none() {
            let Lattice { network, coefficients, .. } = &self.lattice;
            let pattern = affine::pattern(network, &self.body.dofs);
            let symbolic = Symbolic::analyse(&pattern, self.body.spring_order(&self.lattice.network, &pattern)?)?;
            let stiffness = AffineStiffness::new(network, &self.grouping, coefficients, &self.body.dofs, &symbolic);
            // nobody else can have set it: the cell is not shared between threads
            let _ = self.operator.set(SpringOperator::Assembled { stiffness, symbolic });
        }
        Ok(self.operator.get().expect("set just now"))
    }

    /// K(phi), and the analysis of its pattern.
    ///
    /// # Errors
    /// As [`Cube::operator`].
    pub fn assembled(&self) -> Result<(&AffineStiffness, &Arc<Symbolic>)> {
        Ok(self.operator()?.assembled().expect("made with a matrix"))
    }

    /// |f - K(phi) u| / |f|, with K from the springs themselves, not from the matrix that was factored.
    pub fn residual(&self, phi: &[f64], u: &[f64]) -> f64 {
        let mut rest = self.forces.clone();
        for (s, spring) in self.lattice.network.springs.iter().enumerate() {
            let ends = spring.nodes.map(|node| self.body.dofs.free(node as usize));
            let moved = |end: &[u32]| -> f64 {
                let parts = end.iter().zip(&spring.direction).filter(|part| *part.0 != FIXED);
                parts.map(|(&dof, d)| d * u[dof as usize]).sum()
            };
            let stiffness = phi[self.grouping.group_of[s] as usize] * self.lattice.coefficients[s];
            let tension = stiffness * (moved(ends[1]) - moved(ends[0]));
            for (end, sign) in ends.into_iter().zip([1.0, -1.0]) {
                for (&dof, d) in end.iter().zip(&spring.direction).filter(|part| *part.0 != FIXED) {
                    rest[dof as usize] += sign * tension * d;
                }
            }
        }
        (rest.iter().map(|r| r * r).sum::<f64>() / self.forces.iter().map(|f| f * f).sum::<f64>()).sqrt()
    }
}

/// The scene of a cube.
fn scene(size: usize) -> Scene {
    let text = format!(
        "[geometry]\nshape = \"cube\"\ncontrol_points = [{size}, {size}, {size}]\n\
         [material]\nyoung = 15e3\npoisson = 0.3333333333333333\n\
         [support]\nfaces = [\"z-\"]\n[[load]]\nforce_per_node = [80.0, -40.0, 40.0]\n"
    );
    scene::parse(&Source { name: "cube".into(), text }).expect("a valid scene")
}
