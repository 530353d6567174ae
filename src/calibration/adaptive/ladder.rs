use super::rank::{Split, Tuning, rank};
use super::worker::{Ground, Worker};
use crate::calibration::objective::{Counts, Objective};
use crate::calibration::optimiser::Settings;
use crate::calibration::optimisers::gauss_newton::go_on;
use crate::clock::Progress;
use crate::error::{Error, Result};
use crate::springs::solver;

pub struct Step {
    pub groups: usize,
    pub error: f64,
    pub counts: Counts,
    pub phi: Vec<f64>,
    pub members: Vec<Vec<u32>>,
    pub seconds: f64,
    pub words: String,
}

fn settings(tolerance: f64, until: u64) -> Settings {
    Settings { refactorisations: until, tolerance, ..Settings::default() }
}

/// A fit from a point with a known error; evaluations so far plus budget.
fn fit(worker: &mut Worker, phi: Vec<f64>, error: f64, tolerance: f64, budget: u64, progress: &Progress) -> Result<(Vec<f64>, f64, bool)> {
    let until = worker.counts().evaluations + budget;
    let upper = worker.upper();
    let start = error;
    let out = go_on(worker, (phi, error), &upper, &settings(tolerance, until), progress)?;
    let _ = start;
    Ok((out.phi, out.error, true))
}

/// Makes the factor belong to phi.
fn settle(worker: &mut Worker, phi: &mut Vec<f64>) -> Result<f64> {
    worker.error(phi)
}

fn first(worker: &mut Worker, tuning: &Tuning, progress: &Progress) -> Result<(Vec<f64>, f64)> {
    let upper = worker.upper();
    let smallest = upper.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let mut best: Option<(Vec<f64>, f64)> = None;
    for start in 0..tuning.starts {
        let mut stream = crate::rng::Stream::new(1, 0, start);
        let mut phi: Vec<f64> = upper.iter().map(|u| match start { 0 => 0.1 * u, 1 => 0.1 * smallest, _ => u * 10f64.powf(-3.0 * stream.uniform()) }).collect();
        match worker.error(&phi) {
            Ok(_) => {}
            Err(Error::NotPositiveDefinite { .. }) => continue,
            Err(e) => return Err(e),
        }
        let error = worker.fit_scale(&mut phi);
        let (phi, error, _) = fit(worker, phi, error, 1e-3, 8, progress)?;
        if best.as_ref().is_none_or(|b| error < b.1) { best = Some((phi, error)); }
    }
    let (mut phi, _) = best.expect("a start");
    let error = settle(worker, &mut phi)?;
    let (mut phi, _, _) = fit(worker, phi, error, 1e-4, 6, progress)?;
    let error = settle(worker, &mut phi)?;
    Ok((phi, error))
}

fn apply(worker: &mut Worker, split: &Split, phi: &[f64]) -> Vec<f64> {
    let group = std::mem::take(&mut worker.groups[split.group]);
    let above: Vec<u32> = group.iter().copied().filter(|s| split.below.binary_search(s).is_err()).collect();
    worker.groups[split.group] = split.below.clone();
    worker.groups.push(above);
    let mut phi = phi.to_vec();
    phi.push(phi[split.group]);
    phi
}

pub fn climb(ground: Ground, solver: &solver::Settings, start: Vec<Vec<u32>>, most: usize, tuning: &Tuning, progress: &Progress) -> Result<Vec<Step>> {
    let cpu0 = crate::clock::processor_seconds().unwrap_or(0.0);
    let mut worker = Worker::new(ground, solver, start);
    let (mut phi, mut error) = first(&mut worker, tuning, progress)?;
    let mut steps = vec![];
    let names: Vec<&str> = super::features::FEATURES.iter().map(|f| f.name).collect();
    let mut words = String::new();
    loop {
        steps.push(Step { groups: phi.len(), error, counts: worker.counts(), phi: phi.clone(), members: worker.groups.clone(), seconds: crate::clock::processor_seconds().unwrap_or(0.0) - cpu0, words: std::mem::take(&mut words) });
        if phi.len() >= most { break; }
        let (mut residual, mut jacobian) = (vec![], vec![]);
        worker.linearise(&mut residual, &mut jacobian)?;
        let splits = rank(&mut worker, &phi, &residual, &jacobian, tuning, 1, phi.len())?;
        if splits.is_empty() { break; }
        let rows = residual.len();
        let whole = worker.groups.clone();
        let mut best: Option<(Vec<f64>, f64, Vec<Vec<u32>>, usize)> = None;
        for (i, split) in splits.iter().enumerate() {
            if i >= tuning.trials && best.is_some() { break; }
            let child = apply(&mut worker, split, &phi);
            let mut columns = jacobian.clone();
            let at = split.group * rows;
            let rest: Vec<f64> = jacobian[at..at + rows].iter().zip(&split.column).map(|(a, b)| a - b).collect();
            columns[at..at + rows].copy_from_slice(&split.column);
            columns.extend(rest);
            worker.known = Some((residual.clone(), columns));
            let (tried, e, _) = fit(&mut worker, child, error, tuning.tolerance, tuning.tries, progress)?;
            if e < error && best.as_ref().is_none_or(|b| e < b.1) { best = Some((tried, e, worker.groups.clone(), i)); }
            worker.groups = whole.clone();
            worker.known = None;
        }
        let Some((tried, e, groups, index)) = best else { println!("stuck at {}", phi.len()); break };
        let split = &splits[index];
        words = format!("{} of {} by {} < {:.3} ({} | {}) gain {:.4} -> {:.4} real {:.4}", index, splits.len(), names[split.feature], split.threshold, split.below.len(), whole[split.group].len() - split.below.len(), error, (error * error - split.gain).max(0.0).sqrt(), e);
        worker.groups = groups;
        phi = tried;
        error = settle(&mut worker, &mut phi)?;
        let (p, _, _) = fit(&mut worker, phi, error, tuning.tolerance, tuning.budget, progress)?;
        phi = p;
        error = settle(&mut worker, &mut phi)?;
    }
    Ok(steps)
}
