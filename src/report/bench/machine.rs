//! The machine under the figures: processor, threads, load, and the rate of a dense matrix product.
//!
//! The product C = A B of two N x N matrices takes 2 N^3 floating-point operations and little memory traffic; its rate
//! on one thread (the DGEMM rate) is the practical peak of the processor. A sparse factorisation cannot beat it, so its
//! share of that rate says how much there is left to gain. Another process on the machine lowers everything: the load
//! average stands beside the figures.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use serde::Serialize;

use crate::clock::{self, Stopwatch};

/// Rows of the dense product: 54 MB in three matrices, beyond the caches.
const DENSE: usize = 1500;

/// Products of which the fastest counts.
const PRODUCTS: usize = 5;

/// What the figures depend on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Machine {
    /// Name of the processor, where the system tells.
    pub processor: Option<String>,
    /// Cores that the system offers this process.
    pub cores: usize,
    /// Worker threads of this run.
    pub threads: usize,
    /// Load average of the last minute when the measurement began, where the system tells.
    pub load: Option<f64>,
    /// Rate of a dense product on one thread, Gflop/s.
    pub dense_gflops: f64,
}

impl Machine {
    /// Looks at the machine and times the dense product.
    pub fn measure() -> Self {
        Self {
            processor: processor(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            threads: rayon::current_num_threads(),
            load: load(),
            dense_gflops: dense_gflops(),
        }
    }
}

/// Load average of the last minute; `None` where the system does not tell.
pub fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// The best of [`PRODUCTS`] dense products on one thread, Gflop/s, on the clock of the processor where the system has one.
fn dense_gflops() -> f64 {
    let a = Mat::from_fn(DENSE, DENSE, |i, j| ((i * 7 + j * 3) % 11) as f64);
    let b = Mat::from_fn(DENSE, DENSE, |i, j| ((i * 5 + j * 2) % 13) as f64);
    let mut c = Mat::<f64>::zeros(DENSE, DENSE);
    let least = (0..PRODUCTS).fold(f64::INFINITY, |least, _| {
        let (processor, watch) = (clock::processor_seconds(), Stopwatch::start());
        matmul(&mut c, Accum::Replace, &a, &b, 1.0, Par::Seq);
        let spent = processor.zip(clock::processor_seconds()).map(|(before, after)| after - before);
        least.min(spent.unwrap_or(watch.seconds()))
    });
    // the product is used, so that it cannot be left out
    assert!(c[(0, 0)] > 0.0, "a product of positive numbers");
    2.0 * (DENSE as f64).powi(3) / least / 1e9
}
