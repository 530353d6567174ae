//! `bench step`: how fast a network moves.
//!
//! The network is that of a cube of n^3 control points (side 2 m, E = 15 kPa, 1143 kg/m^3), its bottom held, with a tenth
//! of the largest stiffness in each length group: plain numbers, for the speed does not depend on them. It starts at rest
//! under a uniform acceleration g and is integrated by leapfrog ([`crate::dynamics::falling`]).
//!
//! Measured are the forces alone ([`crate::dynamics::forces`]) and the whole step, on one thread and on all:
//!
//! | figure | what |
//! |---|---|
//! | springs a second | springs of the network over the median seconds of one evaluation (one step): on one thread seconds of the processor, else of the wall |
//! | bytes a spring | what an evaluation moves (`SpringForces::bytes`) over the springs |
//! | share of memory | bytes a second over what a sum over 512 MB reads with the same threads in the same run ([`super::bandwidth`]) |
//! | share at its size | the same over what a sum over an array of the same size reads: the caches included |
//! | real time | 1/60 s over the seconds that the steps of one frame take, with the largest safe step |
//! | error | distance of the positions after a second from those of a run with a tenth of the step, over the distance moved |
//!
//! The largest safe step is the one of any motion ([`crate::dynamics::stability`]): however the springs turn and stretch.

use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;
use std::hint::black_box;

use crate::clock::{self, Progress, Stopwatch};
use crate::dynamics::falling::Falling;
use crate::dynamics::forces::SpringForces;
use crate::dynamics::springs::{Coefficients, isotropic};
use crate::dynamics::stability;
use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::reference::mass;
use crate::scene::{self, Source};
use crate::springs::grouping::{self, Request};
use crate::springs::network::Network;
use crate::springs::{bounds, damping, topology, weighting};
use crate::study::body;

use super::bandwidth;
use super::solve::{Seconds, median};

/// Stiffness as a fraction of the upper bounds.
const FRACTION: f64 = 0.1;

/// g in m/s^2.
pub const ACCELERATION: [f64; 3] = [1.0, -0.5, 0.5];

/// Simulated seconds of the runs that are compared.
const DURATION: f64 = 1.0;

/// How many times finer the run is that errors are measured against.
const FINER: usize = 10;

/// Seconds that one measured round takes at least: many steps, for one is too short for a clock.
const ROUND: f64 = 0.02;

/// A network that can move.
pub struct Rig {
    /// Control points along an edge.
    pub size: usize,
    /// The springs.
    pub network: Network,
    /// k of every spring, N/m.
    pub stiffness: Vec<f64>,
    /// c of every spring, N s/m; none without damping.
    pub damping: Option<Vec<f64>>,
    /// Of every node, kg.
    pub masses: Vec<f64>,
    /// Nodes that are held.
    pub held: Vec<bool>,
    /// The largest safe step, s.
    pub step: f64,
}

/// Speed and error of one network on some threads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Control points along an edge.
    pub size: usize,
    /// Springs of the network.
    pub springs: usize,
    /// Worker threads.
    pub threads: usize,
    /// One evaluation of all forces.
    pub forces: Seconds,
    /// One step.
    pub whole_step: Seconds,
    /// Springs a second, forces alone.
    pub springs_per_second: f64,
    /// Springs a second, whole steps.
    pub stepped_per_second: f64,
    /// Bytes that the forces move, for each spring.
    pub bytes_per_spring: f64,
    /// Bytes a second that the forces move.
    pub rate: f64,
    /// Bytes a second read from memory by these threads.
    pub memory_rate: f64,
    /// `rate` over `memory_rate`.
    pub share_of_memory: f64,
    /// Bytes a second read by these threads from an array of as many bytes as the forces move.
    pub same_size_rate: f64,
    /// `rate` over `same_size_rate`.
    pub share_at_its_size: f64,
    /// The largest safe step, s.
    pub step: f64,
    /// Simulated time over time spent, at 60 frames a second.
    pub real_time: f64,
    /// Error with this step, with half and with a quarter of it.
    pub errors: [f64; 3],
}

impl Rig {
    /// The cube of `size`^3 control points; damping (4.18) with `alpha` in s, if any.
    ///
    /// # Errors
    /// Those of the search for the largest step.
    pub fn new(size: usize, alpha: Option<f64>) -> Result<Self> {
        let text = format!(
            "[geometry]\nshape = \"cube\"\ncontrol_points = [{size}, {size}, {size}]\n\
             [material]\nyoung = 15e3\npoisson = 0.3333333333333333\ndensity = 1143.0\n\
             [support]\nfaces = [\"z-\"]\n[[load]]\nforce_per_node = [80.0, -40.0, 40.0]\n"
        );
        let scene = scene::parse(&Source { name: "cube".into(), text }).map_err(|located| located.error)?;
        let body = body::build(&scene)?;
        let (grid, points) = (body.grid().expect("a cube has one"), body.positions());
        let network = (topology::find("grid").expect("the table has it").connect)(&grid, points, &body.dofs);
        let groups = (grouping::find("length").expect("the table has it").group)(&network, &Request::with_gamma(0.1))?;
        let factors = vec![1.0; network.springs.len()];
        let coefficients = weighting::coefficients(&network, scene.springs.weighting, &factors);
        let measures = bounds::node_measures(&grid, points, &body.dofs, body.thickness);
        let each = bounds::spring_bounds(&network, &measures, scene.material.young, scene.material.poisson);
        let mut phi = bounds::upper_bounds(&groups, &each, &factors);
        phi.iter_mut().for_each(|phi| *phi *= FRACTION);
        let stiffness = weighting::stiffness(&groups, &coefficients, &phi);
        let density = scene.material.density.expect("written above");
        let masses = mass::equal_shares(&body.integration_points()?, density, &body.dofs)?;
        let damping = alpha.map(|alpha| damping::coefficients(&network, &stiffness, &masses, alpha));
        let of = Coefficients { stiffness: &stiffness, damping: damping.as_deref() };
        let limit = stability::limit(&isotropic(&network, &body.dofs, of, &masses))?;
        let held = (0..masses.len()).map(|node| is_held(&body.dofs, node)).collect();
        Ok(Self { size, network, stiffness, damping, masses, held, step: limit.safe(limit.damped) })
    }

    /// Positions after so many steps that take so many seconds together.
    pub fn positions_after(&self, steps: usize, seconds: f64) -> Vec<[f64; 3]> {
        let mut run = self.falling(seconds / steps as f64);
        (0..steps).for_each(|_| run.advance());
        run.positions().to_vec()
    }

    /// The network on its way, with this step in s.
    pub fn falling(&self, step: f64) -> Falling {
        let mobility = |node: usize| if self.held[node] { 0.0 } else { 1.0 / self.masses[node] };
        let forces = SpringForces::new(&self.network, &self.stiffness, self.damping.as_deref());
        let mobility = (0..self.masses.len()).map(mobility).collect();
        Falling::new(forces, self.network.positions.clone(), mobility, ACCELERATION, step)
    }
}

/// Nodes of the cube are held in all components or in none.
fn is_held(dofs: &DofMap, node: usize) -> bool {
    dofs.free(node).iter().all(|&dof| dof == FIXED)
}

/// Worker threads, and what they read from memory.
pub struct Workers {
    pool: ThreadPool,
    memory_rate: f64,
}

impl Workers {
    /// Starts so many threads, and measures what they read from an array of so many bytes.
    ///
    /// # Errors
    /// Threads that cannot be had.
    pub fn start(threads: usize, bytes: usize) -> Result<Self> {
        let wrong = |error| Error::input("--threads", format!("{error}"), "ask for fewer threads");
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().map_err(wrong)?;
        let memory_rate = pool.install(|| bandwidth::read_rate(bytes));
        Ok(Self { pool, memory_rate })
    }
}

/// Measures one network, with `repeat` rounds.
///
/// # Errors
/// An interruption.
pub fn measure(rig: &Rig, workers: &Workers, repeat: usize, progress: &Progress) -> Result<Row> {
    let Workers { pool, memory_rate } = workers;
    let (threads, memory_rate) = (pool.current_num_threads(), *memory_rate);
    progress.enter(&format!("{}^3 on {threads} threads", rig.size), 4);
    let step = rig.step;
    let mut run = rig.falling(step);
    let bytes = run.bytes();
    let same_size_rate = pool.install(|| bandwidth::read_rate(bytes));
    progress.advance(1);
    progress.check()?;
    let whole_step = pool.install(|| pace(repeat, &mut || run.advance()));
    progress.advance(1);
    progress.check()?;
    let forces = pool.install(|| pace(repeat, &mut || run.pull()));
    progress.advance(1);
    let errors = pool.install(|| errors(rig, step, progress))?;
    let springs = rig.network.springs.len();
    let [of_forces, of_step] = [&forces, &whole_step].map(|seconds| spent(seconds, threads));
    let rate = bytes as f64 / of_forces;
    let frame = 1.0 / 60.0;
    Ok(Row {
        size: rig.size,
        springs,
        threads,
        springs_per_second: springs as f64 / of_forces,
        stepped_per_second: springs as f64 / of_step,
        bytes_per_spring: bytes as f64 / springs as f64,
        rate,
        memory_rate,
        share_of_memory: rate / memory_rate,
        same_size_rate,
        share_at_its_size: rate / same_size_rate,
        step,
        real_time: frame / ((frame / step).ceil() * of_step),
        errors,
        forces,
        whole_step,
    })
}

/// The median of the rounds. On one thread it is that of the processor's clock, where there is one: that clock stands still
/// while others have the processor.
pub fn spent(seconds: &Seconds, threads: usize) -> f64 {
    seconds.processor.filter(|_| threads == 1).unwrap_or(seconds.median)
}

/// Times `work`: a warm-up that also finds how often it must be done for a clock, then the rounds. Seconds of one time.
fn pace(repeat: usize, work: &mut dyn FnMut()) -> Seconds {
    let mut times = 1;
    loop {
        let watch = Stopwatch::start();
        (0..times).for_each(|_| work());
        if watch.seconds() > ROUND {
            break;
        }
        times *= 2;
    }
    let mut seconds = Seconds::default();
    for _ in 0..repeat {
        let (before, watch) = (clock::processor_seconds(), Stopwatch::start());
        (0..times).for_each(|_| black_box(&mut *work)());
        let after = watch.seconds();
        seconds.rounds.push(after / times as f64);
        let processor = before.zip(clock::processor_seconds()).map(|(before, after)| (after - before) / times as f64);
        seconds.processor_rounds.extend(processor);
    }
    seconds.least = seconds.rounds.iter().copied().fold(f64::INFINITY, f64::min);
    seconds.median = median(&seconds.rounds).unwrap_or(f64::INFINITY);
    seconds.processor = median(&seconds.processor_rounds);
    seconds
}

/// Errors with a step, half and a quarter of it, against a tenth of it.
fn errors(rig: &Rig, step: f64, progress: &Progress) -> Result<[f64; 3]> {
    let steps = (DURATION / step).ceil() as usize;
    let fine = rig.positions_after(FINER * steps, DURATION);
    progress.advance(1);
    let moved = distance(&fine, &rig.network.positions);
    let mut errors = [0.0; 3];
    for (error, times) in errors.iter_mut().zip([1, 2, 4]) {
        progress.check()?;
        *error = distance(&fine, &rig.positions_after(times * steps, DURATION)) / moved;
    }
    Ok(errors)
}

/// sqrt(sum |a_i - b_i|^2).
pub fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_step_is_nearer_to_the_finest_and_damping_shortens_the_step() {
        let progress = Progress::default();
        let rig = Rig::new(5, None).expect("a cube");
        let [whole, half, quarter] = errors(&rig, rig.step, &progress).expect("not stopped");
        assert!(whole < 0.1 && half < 0.5 * whole && quarter < 0.5 * half, "{whole} {half} {quarter}");
        let damped = Rig::new(5, Some(5.0)).expect("a cube");
        assert!(damped.step < rig.step);
        let [whole, _, quarter] = errors(&damped, damped.step, &progress).expect("not stopped");
        assert!(whole < 0.1 && quarter < 0.5 * whole, "{whole} {quarter}");
        progress.cancel();
        assert!(errors(&rig, rig.step, &progress).is_err());
    }

    #[test]
    fn the_first_moments_of_a_fall_are_those_of_a_free_body() {
        // a node far from the support falls freely until a wave from it arrives
        let rig = Rig::new(9, None).expect("a cube");
        let (steps, time) = (8, 0.01);
        let far = rig.masses.len() - 1;
        let place = rig.positions_after(steps, time)[far];
        for axis in 0..3 {
            let fallen = place[axis] - rig.network.positions[far][axis];
            let free = 0.5 * ACCELERATION[axis] * time * time;
            assert!((fallen - free).abs() < 1e-6 * free.abs(), "{fallen} {free}");
        }
    }

    #[test]
    fn a_row_is_made_of_what_was_measured() {
        let rig = Rig::new(4, None).expect("a cube");
        let workers = Workers::start(1, 1 << 20).expect("a thread");
        let row = measure(&rig, &workers, 1, &Progress::default()).expect("measured");
        assert_eq!((row.springs, row.threads), (rig.network.springs.len(), 1));
        let bytes = row.bytes_per_spring * row.springs_per_second;
        assert!((row.rate / bytes - 1.0).abs() < 1e-12);
        assert!(row.real_time > 0.0 && row.share_of_memory > 0.0 && row.errors[0].is_finite());
    }
}
