//! The hard problems: scenes that are small, so that they can be solved with twice the digits, and as bad as can be.
//!
//! | case | what is hard |
//! |---|---|
//! | spread | every spring its own stiffness, log-uniform over so many decades (seeded) |
//! | weak diagonals | face and body diagonals so much softer than edges: nearly a mechanism |
//! | flat box | a box so thin for its width |
//! | seam, pole, coincident | nodes that lie on each other, tied or not |
//! | units | a Young's modulus in the units of another trade |
//! | poisson | a continuum near both ends of its range |
//! | one element | the smallest body |

use std::sync::Arc;

use crate::error::Result;
use crate::rng::Stream;
use crate::scene::{self, Scene, Source};
use crate::sparse::cholesky::Symbolic;
use crate::springs::affine::{self, AffineStiffness};
use crate::springs::bounds;
use crate::springs::grouping::{self, Grouping, Request};
use crate::springs::network::Kind;
use crate::springs::solver::SpringOperator;
use crate::study::body::{self, Body};
use crate::study::loads;
use crate::study::network::{self, Lattice};

/// Stiffness of ordinary springs as a fraction of their upper bounds.
const FRACTION: f64 = 0.1;

/// Seed of the random stiffnesses.
const SEED: u64 = 6;

/// How stiff the springs are.
#[derive(Debug, Clone, Copy)]
enum Stiffness {
    /// A tenth of the bounds, group by length.
    Ordinary,
    /// 10^(2 + decades x) with a random x of its own for each spring.
    Spread(f64),
    /// Edges 1e3, diagonals so many decades less.
    WeakDiagonals(f64),
}

/// A scene of the bench.
pub struct Hard {
    /// Its name.
    pub name: String,
    /// How hard it is, in words.
    pub doc: String,
    text: String,
    stiffness: Stiffness,
    /// The paths of the continuum are measured too.
    pub continuum: bool,
}

/// A hard network, ready to be solved.
pub struct Problem {
    /// The scene it comes from.
    pub scene: Scene,
    /// The body.
    pub body: Body,
    /// The network.
    pub lattice: Lattice,
    /// The groups.
    pub grouping: Grouping,
    /// The number of every group.
    pub phi: Vec<f64>,
    /// Forces on the free degrees of freedom, N.
    pub forces: Vec<f64>,
    /// K(phi), assembled.
    pub operator: SpringOperator<'static>,
}

impl Hard {
    fn new(name: String, doc: &str, text: String, stiffness: Stiffness) -> Self {
        Self { name, doc: doc.into(), text, stiffness, continuum: matches!(stiffness, Stiffness::Ordinary) }
    }

    /// Builds it.
    ///
    /// # Errors
    /// What is wrong with a body that is too hard to be built.
    pub fn problem(&self) -> Result<Problem> {
        let source = Source { name: self.name.clone(), text: self.text.clone() };
        let scene = scene::parse(&source).map_err(|located| located.error)?;
        let body = body::build(&scene)?;
        let forces = loads::build(&scene, &body)?.swap_remove(0).load.forces;
        let lattice = network::connect(&scene, &body)?;
        let (rule, gamma) = match self.stiffness {
            Stiffness::Ordinary => ("length", 0.1),
            Stiffness::Spread(_) => ("each", 0.1),
            Stiffness::WeakDiagonals(_) => ("kind", 0.1),
        };
        let grouping =
            (grouping::find(rule).expect("the table has it").group)(&lattice.network, &Request::with_gamma(gamma))?;
        let phi = self.phi(&lattice, &grouping);
        let pattern = affine::pattern(&lattice.network, &body.dofs);
        let symbolic = Symbolic::analyse(&pattern, body.spring_order(&lattice.network, &pattern)?)?;
        let stiffness = AffineStiffness::new(&lattice.network, &grouping, &lattice.coefficients, &body.dofs, &symbolic);
        let operator = SpringOperator::Assembled { stiffness, symbolic };
        Ok(Problem { scene, body, lattice, grouping, phi, forces, operator })
    }

    fn phi(&self, lattice: &Lattice, grouping: &Grouping) -> Vec<f64> {
        match self.stiffness {
            Stiffness::Ordinary => {
                let upper = bounds::upper_bounds(grouping, &lattice.spring_bounds, &lattice.factors);
                upper.iter().map(|upper| FRACTION * upper).collect()
            }
            Stiffness::Spread(decades) => {
                let mut stream = Stream::new(SEED, 0, 0);
                grouping.groups.iter().map(|_| 10.0_f64.powf(2.0 + decades * stream.uniform())).collect()
            }
            Stiffness::WeakDiagonals(decades) => grouping
                .groups
                .iter()
                .map(|group| if group.name == Kind::Edge.name() { 1e3 } else { 10.0_f64.powf(3.0 - decades) })
                .collect(),
        }
    }
}

impl Problem {
    /// K(phi) and its analysis.
    pub fn assembled(&self) -> (&AffineStiffness, &Arc<Symbolic>) {
        self.operator.assembled().expect("made with a matrix")
    }
}

/// All hard problems of the bench.
pub fn all() -> Vec<Hard> {
    let mut found = Vec::new();
    let cube = || scene_text("cube", "", "", "z-", 3);
    for decades in [2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 13.0, 15.0] {
        let name = format!("spread 1e{decades:.0}");
        found.push(Hard::new(name, "every spring its own stiffness", cube(), Stiffness::Spread(decades)));
    }
    for decades in [3.0, 6.0, 9.0, 12.0] {
        let name = format!("weak diagonals 1e-{decades:.0}");
        found.push(Hard::new(name, "nearly a mechanism", cube(), Stiffness::WeakDiagonals(decades)));
    }
    for height in ["1e-3", "1e-6", "1e-9"] {
        let text = scene_text("cube", &format!("size = [1.0, 1.0, {height}]\n"), "", "x-", 3);
        found.push(Hard::new(format!("flat box {height}"), "a thin box", text, Stiffness::Ordinary));
    }
    for (name, doc, shape, geometry, face, dimension) in [
        ("seam, tied", "a closed ring", "torus", "control_points = [9, 3, 3]\nmerge_seam = true\n", "y-", 3),
        ("seam, slit", "a ring with a slit", "torus", "control_points = [9, 3, 3]\n", "y-", 3),
        ("pole, tied", "a face collapsed to a point", "ball_octant", "merge_seam = true\n", "y-", 3),
        ("coincident points", "two corners on one place", "plate_with_hole", "", "x-", 2),
        ("one element", "the smallest body", "cube", "control_points = [3, 3, 3]\n", "z-", 3),
    ] {
        let text = scene_text(shape, geometry, "", face, dimension);
        found.push(Hard::new(name.into(), doc, text, Stiffness::Ordinary));
    }
    for young in ["1e-6", "1e15"] {
        let text = cube().replace("15e3", young);
        found.push(Hard::new(format!("units {young}"), "E in other units", text, Stiffness::Ordinary));
    }
    for poisson in ["-0.99", "0.4999", "0.49999"] {
        let text = cube().replace("0.3333333333333333", poisson);
        found.push(Hard::new(format!("poisson {poisson}"), "near the end of its range", text, Stiffness::Ordinary));
    }
    found
}

fn scene_text(shape: &str, geometry: &str, more: &str, face: &str, dimension: usize) -> String {
    let points = if shape == "cube" && !geometry.contains("control") { "control_points = [5, 5, 5]\n" } else { "" };
    let force = if dimension == 2 { "[80.0, -40.0]" } else { "[80.0, -40.0, 40.0]" };
    format!(
        "[geometry]\nshape = \"{shape}\"\n{points}{geometry}[material]\nyoung = 15e3\npoisson = 0.3333333333333333\n\
         [support]\nfaces = [\"{face}\"]\n[[load]]\nforce_per_node = {force}\n{more}"
    )
}
