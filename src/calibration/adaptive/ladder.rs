use super::rank::{Split, Tuning, rank};
use super::worker::{Ground, Worker};
use crate::calibration::objective::Counts;
use super::descent::{DAMPING, Descent};
use crate::clock::Progress;
use crate::error::Result;
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

/// One step that lowers the error below `bar`, if at most `tries` dampings find one; true when accepted.
fn descend(worker: &mut Worker, descent: &mut Descent, phi: &[f64], bar: f64, tries: usize) -> Result<bool> {
    let upper = worker.upper();
    descent.prepare(phi);
    for _ in 0..tries {
        let mut step = descent.step(phi, &upper);
        for _ in 0..40 {
            if step.is_some() { break }
            descent.damp();
            step = descent.step(phi, &upper);
        }
        let Some((trial, predicted)) = step else { return Ok(false) };
        let tried = worker.attempt(&trial)?;
        if std::env::var("DEBUG").is_ok() { println!("   bar {bar:.4} predicted {:.4} tried {tried:.4} damping {:.1e} phi {:?} upper {:?} trial {:?}", (bar*bar-predicted).max(0.0).sqrt(), descent.damping, phi.iter().map(|x| x.round()).collect::<Vec<_>>(), upper.iter().map(|x| x.round()).collect::<Vec<_>>(), trial.iter().map(|x| x.round()).collect::<Vec<_>>()); }
        if tried < bar {
            descent.trust((bar * bar - tried * tried) / predicted);
            worker.accept();
            descent.reach *= 1.5;
            return Ok(true);
        }
        descent.damp();
        descent.reach = 0.3 * descent.reach.min(2.0);
        if predicted < 1e-4 * bar * bar { return Ok(false) }
    }
    Ok(false)
}

/// Gauss-Newton from here.
fn fit(worker: &mut Worker, reach: f64, tolerance: f64, budget: u64, progress: &Progress) -> Result<()> {
    let until = worker.counts().evaluations + budget;
    let mut descent = Descent::new(worker.phi(), &worker.upper());
    descent.reach = reach;
    while worker.counts().evaluations < until {
        progress.check()?;
        (descent.residual, descent.jacobian) = worker.linearise()?;
        let before = worker.error();
        let phi = worker.phi().to_vec();
        let left = (until - worker.counts().evaluations) as usize;
        if !descend(worker, &mut descent, &phi, before, left)? { break; }
        if before - worker.error() <= tolerance * before && descent.damping <= DAMPING { break; }
    }
    Ok(())
}

fn first(worker: &mut Worker, tuning: &Tuning, progress: &Progress) -> Result<()> {
    let upper = worker.upper();
    let smallest = upper.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let mut best: Option<(Vec<f64>, f64)> = None;
    for start in 0..tuning.starts {
        let mut stream = crate::rng::Stream::new(1, 0, start);
        let phi: Vec<f64> = upper.iter().map(|u| match start { 0 => 0.1 * u, 1 => 0.1 * smallest, _ => u * 10f64.powf(-3.0 * stream.uniform()) }).collect();
        if !worker.attempt(&phi)?.is_finite() { continue; }
        worker.accept();
        fit(worker, 3.0, 1e-3, 7, progress)?;
        if best.as_ref().is_none_or(|b| worker.error() < b.1) { best = Some((worker.phi().to_vec(), worker.error())); }
    }
    let (phi, error) = best.expect("a start");
    if worker.error() != error {
        worker.attempt(&phi)?;
        worker.accept();
    }
    fit(worker, 3.0, 1e-4, 6, progress)
}

/// Splits groups; returns phi with the new groups and the Jacobian with their columns.
fn apply(worker: &mut Worker, splits: &[&Split], phi: &[f64], jacobian: &[f64], rows: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut phi, mut jacobian) = (phi.to_vec(), jacobian.to_vec());
    for split in splits {
        let group = std::mem::take(&mut worker.groups[split.group]);
        let above: Vec<u32> = group.iter().copied().filter(|s| split.below.binary_search(s).is_err()).collect();
        worker.groups[split.group] = split.below.clone();
        worker.groups.push(above);
        phi.push(phi[split.group]);
        let at = split.group * rows;
        let rest: Vec<f64> = jacobian[at..at + rows].iter().zip(&split.column).map(|(a, b)| a - b).collect();
        jacobian[at..at + rows].copy_from_slice(&split.column);
        jacobian.extend(rest);
    }
    (phi, jacobian)
}

/// Greedy choice of several splits of different groups: each with the largest gain beyond those before it.
fn choose(splits: &[Split], residual: &[f64], first: usize, count: usize) -> Vec<usize> {
    let mut chosen = vec![first];
    let mut rest = residual.to_vec();
    let mut beyond: Vec<Vec<f64>> = splits.iter().map(|s| s.beyond.clone()).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    while chosen.len() < count {
        let last = beyond[*chosen.last().unwrap()].clone();
        let square = dot(&last, &last);
        for v in beyond.iter_mut().chain([&mut rest]) {
            let c = dot(v, &last) / square;
            v.iter_mut().zip(&last).for_each(|(v, l)| *v -= c * l);
        }
        let gain = |i: usize| dot(&beyond[i], &rest).powi(2) / (dot(&beyond[i], &beyond[i]) + 1e-2 * dot(&splits[i].column, &splits[i].column));
        let next = (0..splits.len()).filter(|&i| chosen.iter().all(|&c| splits[c].group != splits[i].group)).max_by(|&a, &b| gain(a).total_cmp(&gain(b)));
        let Some(next) = next else { break };
        chosen.push(next);
    }
    chosen
}

pub fn climb(ground: Ground, solver: &solver::Settings, start: Vec<Vec<u32>>, most: usize, tuning: &Tuning, progress: &Progress) -> Result<Vec<Step>> {
    let cpu0 = crate::clock::processor_seconds().unwrap_or(0.0);
    let mut worker = Worker::new(ground, solver, start);
    first(&mut worker, tuning, progress)?;
    let mut steps = vec![];
    let names: Vec<&str> = super::features::FEATURES.iter().map(|f| f.name).collect();
    let mut words = String::new();
    loop {
        let m = worker.groups.len();
        steps.push(Step { groups: m, error: worker.error(), counts: worker.counts(), phi: worker.phi().to_vec(), members: worker.groups.clone(), seconds: crate::clock::processor_seconds().unwrap_or(0.0) - cpu0, words: std::mem::take(&mut words) });
        if m >= most { break; }
        let (residual, jacobian) = worker.linearise()?;
        let splits = rank(&mut worker, &residual, &jacobian, tuning, 1, m)?;
        if splits.is_empty() { break; }
        let rows = residual.len();
        let whole = worker.groups.clone();
        let (phi, error) = (worker.phi().to_vec(), worker.error());
        let many = if m < tuning.together { 1 } else { ((m as f64 * tuning.fraction) as usize).max(1) }.min(most - m);
        let trials = if many > 1 { tuning.trials_many } else { tuning.trials };
        let mut best: Option<(usize, Vec<Vec<u32>>)> = None;
        for i in 0..splits.len() {
            if i >= trials && best.is_some() || i > 12 { break; }
            let chosen: Vec<&Split> = choose(&splits, &residual, i, many).into_iter().map(|i| &splits[i]).collect();
            worker.groups = whole.clone();
            let (child, columns) = apply(&mut worker, &chosen, &phi, &jacobian, rows);
            let mut descent = Descent::new(&child, &worker.upper());
            descent.reach = tuning.reach;
            descent.residual = residual.clone();
            descent.jacobian = columns;
            let bar = if best.is_some() { worker.error() } else { error };
            if descend(&mut worker, &mut descent, &child, bar, tuning.tries)? { best = Some((i, worker.groups.clone())); }
        }
        let Some((index, groups)) = best else { println!("stuck at {}", m); break };
        let split = &splits[index];
        worker.groups = groups;
        words = format!("{} of {} by {} < {:.3} ({} | {}) gain {:.4} -> {:.4} real {:.4}", index, splits.len(), names[split.feature], split.threshold, split.below.len(), whole[split.group].len() - split.below.len(), error, (error * error - split.gain).max(0.0).sqrt(), worker.error());
        fit(&mut worker, tuning.reach, tuning.tolerance, tuning.budget, progress)?;
    }
    Ok(steps)
}
