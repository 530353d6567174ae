//! One rung: which groups split, which share a number from then on, and the fit of all.
//!
//! A rung that is to have one group more may split two and let two others share a number instead: the second split is worth
//! it when the linear model says that it gains more than the union loses ([`super::unions`]). Many groups end at a bound,
//! most of them at 0; they share a number for nothing. What the model promises is tried like any other split, beside the same
//! rung without unions, and the lowest error stays.

use crate::calibration::optimisers::descent::Descent;
use crate::clock::Progress;
use crate::error::Result;
use crate::readable::short;

use super::Limits;
use super::candidates::{Model, shortlist};
use super::exact::{Exact, choose, measure};
use super::features::FEATURES;
use super::fit::{MOST, Pull, REACH, fit, step};
use super::part::Part;
use super::ties::TIE;
use super::unions::{Union, unions};
use super::worker::Worker;

/// Plans that are tried before a rung is taken, and tried at most when all fail.
const TRIALS: usize = 3;
const MOST_TRIALS: usize = 12;

/// Shorter and shorter steps that a trial may take.
const TRIES: usize = 3;

/// Groups from which several split at once, and one of how many does.
const TOGETHER_FROM: usize = 16;
const ONE_OF: usize = 8;

/// Unions of a rung at most, and the part of the gain of its first split that one must be worth.
const UNIONS: usize = 2;
const WORTH: f64 = 0.05;

/// What a rung tries.
struct Plan {
    /// Indices of its splits.
    splits: Vec<usize>,
    /// Its unions; of groups that do not split.
    unions: Vec<Union>,
}

/// Climbs one rung: the splits and unions that were made, in words; none when nothing lowers the error.
///
/// # Errors
/// Where a solve is not accurate; on interruption.
pub fn climb_one(worker: &mut Worker, limits: &Limits, progress: &Progress) -> Result<Option<Vec<String>>> {
    progress.check()?;
    let m = worker.parts.len();
    let model = Model::new(worker)?;
    let found = shortlist(worker, &model, m)?;
    let splits = measure(worker, &model, found)?;
    let unions = unions(worker.phi(), &worker.upper(), &model);
    let together = if m < TOGETHER_FROM { 1 } else { m / ONE_OF };
    let count = together.min(limits.groups - m);
    let (whole, phi) = (worker.parts.clone(), worker.phi().to_vec());
    let pull = Pull::of(worker, limits.regularisation);
    let (before, first) = (worker.error(), pull.error(worker));
    let mut best: Option<(Vec<Part>, Plan, f64)> = None;
    let plans = (0..splits.len()).flat_map(|first| plans(&splits, &unions, &model.rest, first, count));
    for (trial, plan) in plans.take(MOST_TRIALS).enumerate() {
        if trial >= TRIALS && best.is_some() {
            break;
        }
        worker.parts.clone_from(&whole);
        let (child, mut descent) = child(worker, &model, &phi, &splits, &plan, &pull);
        progress.check()?;
        // once there is one to beat, it must be beaten clearly, and a short step of another does not
        let tries = if best.is_none() { TRIES } else { 1 };
        let bar = best.as_ref().map_or(first, |(_, _, low)| (low * low - TIE * (first * first - low * low)).sqrt());
        let prior = pull.prior(worker);
        if let Some((tried, _)) = step(worker, &mut descent, &prior, (&child, bar), tries)? {
            best = Some((worker.parts.clone(), plan, tried));
        }
    }
    let Some((parts, plan, _)) = best else {
        worker.parts = whole;
        return Ok(None);
    };
    worker.parts = parts;
    fit(worker, &pull, REACH, MOST, progress)?;
    Ok((worker.error() < before).then(|| words(&plan, &splits, &whole)))
}

/// The plans that begin with the split `first`, for `count` groups more: with unions, where they are worth it, and
/// without.
fn plans(splits: &[Exact], unions: &[Union], rest: &[f64], first: usize, count: usize) -> Vec<Plan> {
    let chosen = choose(splits, rest, first, count + UNIONS);
    let (certain, more) = chosen.split_at(count.min(chosen.len()));
    let plain: Vec<usize> = certain.iter().map(|(i, _)| *i).collect();
    let group = |i: usize| splits[i].split.group;
    let mut taken: Vec<usize> = plain.iter().map(|&i| group(i)).collect();
    let mut with = Plan { splits: plain.clone(), unions: vec![] };
    for &(i, gain) in more {
        if taken.contains(&group(i)) {
            continue;
        }
        taken.push(group(i));
        let fits = |union: &&Union| union.groups.iter().all(|group| !taken.contains(group));
        match unions.iter().find(fits) {
            Some(union) if gain - union.loss > WORTH * chosen[0].1 => {
                taken.extend(union.groups);
                with.splits.push(i);
                with.unions.push(*union);
            }
            _ => break,
        }
    }
    let without = (!with.unions.is_empty()).then(|| Plan { splits: plain, unions: vec![] });
    std::iter::once(with).chain(without).collect()
}

/// Carries a plan out on the groups: where the numbers are then, and the linear model there, with the rows of the prior.
fn child(
    worker: &mut Worker,
    model: &Model,
    phi: &[f64],
    splits: &[Exact],
    plan: &Plan,
    pull: &Pull,
) -> (Vec<f64>, Descent) {
    let rows = model.residual.len();
    let (mut phi, mut residual) = (phi.to_vec(), model.residual.clone());
    let mut columns: Vec<Vec<f64>> = model.jacobian.chunks_exact(rows).map(<[f64]>::to_vec).collect();
    for &i in &plan.splits {
        let Exact { split, column, halves: [below, above], .. } = &splits[i];
        worker.parts[split.group] = below.clone();
        worker.parts.push(above.clone());
        phi.push(phi[split.group]);
        columns.push(columns[split.group].iter().zip(column).map(|(group, below)| group - below).collect());
        columns[split.group].clone_from(column);
    }
    for Union { groups: [a, b], number, .. } in &plan.unions {
        for group in [*a, *b] {
            let step = number - phi[group];
            residual.iter_mut().zip(&columns[group]).for_each(|(r, c)| *r += step * c);
        }
        worker.parts[*a] = worker.parts[*a].union(&worker.parts[*b]);
        phi[*a] = *number;
        let other = std::mem::take(&mut columns[*b]);
        columns[*a].iter_mut().zip(other).for_each(|(a, b)| *a += b);
    }
    let mut gone: Vec<usize> = plan.unions.iter().map(|union| union.groups[1]).collect();
    gone.sort_unstable();
    for b in gone.into_iter().rev() {
        worker.parts.remove(b);
        phi.remove(b);
        columns.remove(b);
    }
    let mut descent = Descent::with_chart(pull.chart);
    descent.reach = REACH;
    (descent.residual, descent.jacobian) = (residual, columns.concat());
    pull.prior(worker).append(&phi, &mut descent.residual, &mut descent.jacobian);
    (phi, descent)
}

/// A plan in words.
fn words(plan: &Plan, splits: &[Exact], whole: &[Part]) -> Vec<String> {
    let of_split = |&i: &usize| {
        let split = &splits[i].split;
        format!("{}: {} < {}", whole[split.group].name(), FEATURES[split.feature].name, short(split.threshold))
    };
    let of_union = |union: &Union| {
        let [a, b] = union.groups.map(|group| whole[group].name());
        format!("{a} with {b}")
    };
    plan.splits.iter().map(of_split).chain(plan.unions.iter().map(of_union)).collect()
}
