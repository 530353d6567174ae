//! Bodies that the tests move.

use nalgebra_sparse::{CooMatrix, CsrMatrix};
use springfit::dynamics::external::External;
use springfit::dynamics::integrator::{self, Integrator};
use springfit::dynamics::linear::{Damping, LinearModel};
use springfit::dynamics::springs::{Coefficients, SpringModel, isotropic};
use springfit::dynamics::stability::Linearised;
use springfit::dynamics::stepper::{Settings, Stepper};
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::geometry::selection::face_nodes;
use springfit::geometry::shapes::{self, ShapeRequest};
use springfit::rng::Stream;
use springfit::springs::network::{Kind, Network};
use springfit::springs::{damping, topology};

/// No external force.
pub const FREE: &External = &External { parts: Vec::new() };

pub fn integrator(name: &str) -> &'static Integrator {
    integrator::find(name).expect("the table has it")
}

/// One mass of 1 kg on a spring of omega^2 N/m with the damping ratio zeta.
pub fn oscillator(omega: f64, zeta: f64) -> LinearModel {
    let mut matrix = CooMatrix::new(1, 1);
    matrix.push(0, 0, omega * omega);
    let damping = if zeta == 0.0 { Damping::None } else { Damping::Matrix(vec![2.0 * zeta * omega]) };
    LinearModel::new(&CsrMatrix::from(&matrix), damping, vec![1.0])
}

/// A network with masses, stiffness and the damping of alpha = 1 s.
pub struct Body {
    pub name: String,
    pub network: Network,
    pub dofs: DofMap,
    pub masses: Vec<f64>,
    pub stiffness: Vec<f64>,
    pub damping: Vec<f64>,
}

impl Body {
    pub fn new(name: &str, network: Network, dofs: DofMap, masses: Vec<f64>, stiffness: Vec<f64>) -> Self {
        let damping = damping::coefficients(&network, &stiffness, &masses, 1.0);
        Self { name: name.into(), network, dofs, masses, stiffness, damping }
    }

    /// The network with damping divided by alpha, or without.
    pub fn model(&self, alpha: Option<f64>) -> SpringModel<'_> {
        let damping: Option<Vec<f64>> = alpha.map(|alpha| self.damping.iter().map(|c| c / alpha).collect());
        let of = Coefficients { stiffness: &self.stiffness, damping: damping.as_deref() };
        SpringModel::new(&self.network, &self.dofs, of, &self.masses)
    }
}

impl Body {
    /// The bound on all states with this alpha.
    pub fn isotropic(&self, alpha: f64) -> Linearised {
        let of = Coefficients { stiffness: &self.stiffness, damping: Some(&self.damping) };
        isotropic(&self.network, &self.dofs, of, &self.masses).with_damping_over(Some(alpha))
    }
}

/// A grid over a box of this size with the given nodes held.
fn grid_body(name: &str, shape: &[usize], size: [f64; 3], held: &[u32], k: [f64; 3], mass: f64) -> Body {
    let grid = Grid::new(shape);
    let positions: Vec<[f64; 3]> = (0..grid.len())
        .map(|node| {
            let index = grid.index(node);
            [0, 1, 2].map(|a| {
                if grid.extents()[a] > 1 { size[a] * index[a] as f64 / (grid.extents()[a] - 1) as f64 } else { 0.0 }
            })
        })
        .collect();
    let mut fixed = vec![[false; 3]; grid.len()];
    held.iter().for_each(|&node| fixed[node as usize] = [true; 3]);
    let dofs = DofMap::untied(grid.dimension(), &fixed);
    let network = (topology::find("grid").expect("the table has it").connect)(&grid, &positions, &dofs);
    let stiffness = network.springs.iter().map(|spring| k[spring.kind as usize]).collect();
    Body::new(name, network, dofs, vec![mass; grid.len()], stiffness)
}

/// Experiment II of chapter 4: 5x5 nodes of 2 kg on [0, 2]^2, 500 N/m along edges, 400 N/m across; the left edge held.
pub fn experiment_ii() -> Body {
    let held = face_nodes(&Grid::new(&[5, 5]), "x-").expect("a face");
    grid_body("membrane", &[5, 5], [2.0, 2.0, 0.0], &held, [500.0, 400.0, 0.0], 2.0)
}

/// A membrane that nothing holds.
pub fn free_membrane() -> Body {
    grid_body("free membrane", &[4, 3], [3.0, 2.0, 0.0], &[], [300.0, 200.0, 0.0], 0.7)
}

/// A block that nothing holds.
pub fn free_block() -> Body {
    grid_body("free block", &[3, 3, 3], [1.0, 1.0, 1.0], &[], [300.0, 200.0, 100.0], 0.7)
}

/// A ladder of two rows of 2 x n nodes, held at one end: as near to a chain as stands in the plane.
pub fn chain(n: usize) -> Body {
    let held = face_nodes(&Grid::new(&[n, 2]), "x-").expect("a face");
    grid_body("chain", &[n, 2], [n as f64 - 1.0, 1.0, 0.0], &held, [900.0, 50.0, 0.0], 1.5)
}

/// A shape of the table with a stiffness for each kind of spring, scattered, and scattered masses; a face is held.
pub fn shape(name: &str) -> Body {
    let shape = shapes::find(name).expect("the table has it");
    let request = ShapeRequest {
        control_points: shape.default_control_points.to_vec(),
        degree: shape.default_degree.to_vec(),
        size: shape.default_size[..shape.dimension].to_vec(),
    };
    let patch = (shape.build)(&request).expect("a default body");
    let mut fixed = vec![[false; 3]; patch.grid().len()];
    for node in face_nodes(&patch.grid(), shape.fixed_face).expect("a face") {
        fixed[node as usize] = [true; 3];
    }
    let dofs = DofMap::untied(shape.dimension, &fixed);
    let grid = topology::find("grid").expect("the table has it");
    let network = (grid.connect)(&patch.grid(), patch.points(), &dofs);
    let mut stream = Stream::new(7, 0, 0);
    let base = |kind: Kind| [1000.0, 600.0, 300.0][kind as usize];
    let stiffness = network.springs.iter().map(|spring| base(spring.kind) * (0.5 + stream.uniform())).collect();
    let mut stream = Stream::new(8, 0, 0);
    let masses = (0..dofs.nodes()).map(|_| 1.0 + stream.uniform()).collect();
    Body::new(name, network, dofs, masses, stiffness)
}

/// Ten bodies.
pub fn ten() -> Vec<Body> {
    let mut bodies = vec![chain(12), experiment_ii()];
    bodies.extend(["square", "circle", "ellipse", "cube", "torus", "spheroid", "plate", "beam"].map(shape));
    bodies
}

/// A small displacement without a structure, the same for every run; m.
pub fn noise(n: usize, size: f64) -> Vec<f64> {
    let mut stream = Stream::new(3, 0, 0);
    (0..n).map(|_| size * stream.normal()).collect()
}

/// Steps a model from (u, 0) `steps` times without external force; `see` looks after every step and may end it with false.
pub fn swing(
    model: &mut dyn springfit::dynamics::model::Model,
    name: &str,
    step: f64,
    steps: u64,
    u: &[f64],
    see: &mut dyn FnMut(&mut Stepper) -> bool,
) -> springfit::error::Result<()> {
    let still = vec![0.0; u.len()];
    let mut stepper = Stepper::new(model, FREE, integrator(name), Settings::with_step(step), [u, &still])?;
    for _ in 0..steps {
        stepper.advance()?;
        if !see(&mut stepper) {
            break;
        }
    }
    Ok(())
}
