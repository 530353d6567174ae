//! Forces of springs: the sweep over bands and lists against the plain formulas (3.2), (3.3) and (3.1), and its bits.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use springfit::dynamics::forces::SpringForces;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::springs::force;
use springfit::springs::network::{Kind, Network, Spring};
use springfit::springs::topology;

/// A network in some state of motion.
struct State {
    network: Network,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    positions: Vec<[f64; 3]>,
    velocities: Vec<[f64; 3]>,
}

impl State {
    /// Any stiffness and damping over four powers of ten, any stretch and velocity. Every hundredth node lies on another.
    fn of(network: Network, seed: u64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut spread = || 10.0_f64.powf(4.0 * random.random::<f64>());
        let stiffness: Vec<f64> = network.springs.iter().map(|_| spread()).collect();
        let damping = network.springs.iter().map(|_| 0.01 * spread()).collect();
        let mut vector = |size: f64| [(); 3].map(|()| size * (2.0 * random.random::<f64>() - 1.0));
        let flat = network.dimension == 2;
        let velocities = network.positions.iter().map(|_| vector(3.0)).collect();
        let mut positions: Vec<[f64; 3]> = network.positions.iter().map(|x| plus(*x, vector(0.4))).collect();
        if flat {
            positions.iter_mut().for_each(|x| x[2] = 0.0);
        }
        for node in (99..positions.len()).step_by(100) {
            positions[node] = positions[node - 1];
        }
        Self { network, stiffness, damping, positions, velocities }
    }

    fn forces(&self, damped: bool) -> Vec<[f64; 3]> {
        let mut forces = SpringForces::new(&self.network, &self.stiffness, damped.then_some(&self.damping[..]));
        // twice: what is left of the first call must not matter
        let mut out = vec![[f64::NAN; 3]; self.positions.len()];
        forces.forces(&self.velocities, &self.positions, &mut out);
        forces.forces(&self.positions, &self.velocities, &mut out);
        out
    }

    fn energy(&self) -> f64 {
        SpringForces::new(&self.network, &self.stiffness, None).energy(&self.positions)
    }

    /// The formulas, spring by spring: forces, what their size is measured by at every node, and energy.
    fn plainly(&self, damped: bool) -> (Vec<[f64; 3]>, Vec<f64>, f64) {
        let (mut out, mut scale, mut energy) =
            (vec![[0.0; 3]; self.positions.len()], vec![0.0; self.positions.len()], 0.0);
        for (s, spring) in self.network.springs.iter().enumerate() {
            let [a, b] = spring.nodes.map(|node| node as usize);
            let (x, y, v, w) = (self.positions[a], self.positions[b], self.velocities[a], self.velocities[b]);
            let (k, c) = (self.stiffness[s], if damped { self.damping[s] } else { 0.0 });
            let (length, approach) = (norm(minus(y, x)), norm(minus(w, v)));
            energy += force::energy(k, spring.length, x, y);
            let pull = plus(force::elastic(k, spring.length, x, y), force::damping(c, x, y, v, w));
            out[a] = plus(out[a], pull);
            out[b] = minus(out[b], pull);
            for node in [a, b] {
                scale[node] += k * (length + spring.length) + c * approach;
            }
        }
        (out, scale, energy)
    }

    fn agrees(&self) {
        for damped in [false, true] {
            let ((plain, scale, energy), forces) = (self.plainly(damped), self.forces(damped));
            for (node, scale) in scale.iter().enumerate() {
                let error = norm(minus(plain[node], forces[node]));
                assert!(error <= 1e-14 * scale, "node {node}: {:?} is not {:?}", forces[node], plain[node]);
            }
            assert!((self.energy() - energy).abs() <= 1e-14 * energy, "{} is not {energy}", self.energy());
        }
    }
}

fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// A grid of unit cells; every node whose number is in `tied` is tied to node 0.
fn grid(shape: &[usize], tied: &[usize]) -> Network {
    let grid = Grid::new(shape);
    let points: Vec<[f64; 3]> = (0..grid.len()).map(|node| grid.index(node).map(|i| i as f64)).collect();
    let master = (0..grid.len()).map(|node| if tied.contains(&node) { 0 } else { node as u32 }).collect();
    let dofs = DofMap::new(shape.len(), master, &vec![[false; 3]; grid.len()]);
    (topology::find("grid").expect("in the table").connect)(&grid, &points, &dofs)
}

/// Springs between any nodes: bands never happen, two springs may join the same nodes, and some nodes have none.
fn mesh(nodes: usize, springs: usize, seed: u64) -> Network {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut number = || random.random::<f64>();
    let positions: Vec<[f64; 3]> = (0..nodes).map(|_| [(); 3].map(|()| 10.0 * number())).collect();
    let spring = |_| {
        let a = (number() * nodes as f64) as usize;
        let b = (a + 1 + (number() * (nodes - 1) as f64) as usize) % nodes;
        let d = minus(positions[b], positions[a]);
        let length = norm(d);
        let (nodes, direction) = ([a as u32, b as u32], d.map(|d| d / length));
        Spring { nodes, length, direction, kind: Kind::Edge, offset: [0; 3], cells: 1 }
    };
    let springs = (0..springs).map(spring).collect();
    Network { dimension: 3, positions, springs, zero_length: 0 }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn grids_agree_with_the_plain_formulas(shape in prop::collection::vec(1_usize..9, 2..=3), seed: u64) {
        State::of(grid(&shape, &[]), seed).agrees();
    }

    #[test]
    fn grids_with_ties_agree_with_the_plain_formulas(
        shape in prop::collection::vec(2_usize..7, 3),
        tied in prop::collection::vec(1_usize..50, 0..6),
        seed: u64,
    ) {
        State::of(grid(&shape, &tied), seed).agrees();
    }

    #[test]
    fn meshes_agree_with_the_plain_formulas(nodes in 2_usize..60, springs in 0_usize..300, seed: u64) {
        State::of(mesh(nodes, springs, seed), seed).agrees();
    }
}

#[test]
fn bits_are_equal_for_any_number_of_threads() {
    // several blocks each: a cube, a membrane, a grid with a seam, and springs between any nodes
    let seam: Vec<usize> = (400..4000).step_by(37).collect();
    for network in [grid(&[17, 17, 17], &[]), grid(&[90, 70], &[]), grid(&[17, 16, 20], &seam), mesh(5000, 20_000, 3)] {
        let state = State::of(network, 7);
        state.agrees();
        let with = |threads: usize, damped: bool| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let (forces, energy) = pool.install(|| (state.forces(damped), state.energy()));
            (forces.as_flattened().iter().map(|f| f.to_bits()).collect::<Vec<_>>(), energy.to_bits())
        };
        for damped in [false, true] {
            let one = with(1, damped);
            for threads in [2, 3, 4] {
                assert!(with(threads, damped) == one, "{threads} threads, damped {damped}");
            }
        }
    }
}

#[test]
fn a_turned_body_has_no_forces_and_forces_are_the_slope_of_the_energy() {
    let mut state = State::of(grid(&[6, 5, 7], &[]), 11);
    let turned = |x: &[f64; 3]| [0.6 * x[0] - 0.8 * x[1] + 3.0, 0.8 * x[0] + 0.6 * x[1], x[2] - 1.0];
    let deformed = std::mem::replace(&mut state.positions, state.network.positions.iter().map(turned).collect());
    assert!(state.forces(false).as_flattened().iter().all(|f| f.abs() < 1e-10), "rigid motion");
    state.positions = deformed;
    let forces = state.forces(false);
    for (node, axis) in [(0, 0), (17, 1), (111, 2), (209, 0)] {
        let at = |state: &mut State, shift: f64| {
            let before = state.positions[node][axis];
            state.positions[node][axis] += shift;
            let energy = state.energy();
            state.positions[node][axis] = before;
            energy
        };
        let slope = (at(&mut state, 1e-5) - at(&mut state, -1e-5)) / 2e-5;
        let force = forces[node][axis];
        assert!((force + slope).abs() < 1e-6 * force.abs().max(1e3), "node {node}: force {force}, slope {slope}");
    }
}
