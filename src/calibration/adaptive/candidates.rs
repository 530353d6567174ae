//! Which splits to look at: the gain of every threshold on every feature, estimated from one block of adjoint solves.
//!
//! A split of a group gives half of its springs (the set S) a number of its own. To first order its new column
//! c = sum over S of dr/dk_s matters as far as the columns of the groups that are there cannot do the same: with P the
//! projection on what these do not reach, the best step along it lowers the squared error by
//!
//! ```text
//! gain = (c . P r)^2 / |P c|^2
//! ```
//!
//! Neither part needs the column. c . P r is the sum over S of the adjoint gradient for z = P r. And for a vector z of
//! independent normal numbers ([`super::places`]) (c . P z)^2 is |P c|^2 on average (M. F. Hutchinson, Commun. Stat. Simul.
//! Comput. 18, 1989), so some such probes, solved with P r in one block, give the curvature of *every* set: prefix sums over the
//! springs of a group, sorted by a feature, run through its thresholds. The best are solved exactly in [`super::exact`].
//!
//! P takes the groups between their bounds as free. A group at a bound may split too, if one half wants to leave it.

use crate::dense::Complement;
use crate::error::{Error, Result};

use super::part::Part;
use super::places::probes;
use super::ties::ranked;
use super::worker::Worker;

/// Probes of the curvature.
const PROBES: usize = 64;

/// Splits that are solved exactly.
const SHORTLIST: usize = 96;

/// Thresholds of one feature in one group that are looked at, and the best of them that stay.
const THRESHOLDS: usize = 32;
const KEPT: usize = 3;

/// Part of the largest curvature of a spring: a set with less is reached by the groups, and what is left of it is the ridge.
const REACHED: f64 = 1e-14;

/// Part of the squared columns that is added to tell columns apart that depend on each other.
const RIDGE: f64 = 1e-9;

/// Which way a group may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Room {
    /// Both ways.
    Free,
    /// It is at 0.
    Up,
    /// It is at its upper bound.
    Down,
}

/// Which way a group with the number `phi` may move.
pub fn room(phi: f64, upper: f64) -> Room {
    match () {
        () if phi <= 0.0 => Room::Up,
        () if phi >= upper * (1.0 - 1e-12) => Room::Down,
        () => Room::Free,
    }
}

/// A network in its linear model.
pub struct Model {
    /// r.
    pub residual: Vec<f64>,
    /// One column a group (rows each).
    pub jacobian: Vec<f64>,
    /// Groups between their bounds.
    pub free: Vec<usize>,
    /// P.
    pub complement: Complement,
    /// P r.
    pub rest: Vec<f64>,
    /// The step of the free groups that leaves it.
    pub steps: Vec<f64>,
}

impl Model {
    /// The model of the network that stands.
    ///
    /// # Errors
    /// Where a solve is not accurate.
    pub fn new(worker: &mut Worker) -> Result<Self> {
        let (residual, jacobian) = worker.linearise()?;
        let rows = residual.len();
        let pairs = worker.phi().iter().zip(&worker.parts).enumerate();
        let free: Vec<usize> =
            pairs.filter(|(_, (phi, part))| room(**phi, part.upper) == Room::Free).map(|(a, _)| a).collect();
        let columns: Vec<f64> = free.iter().flat_map(|&a| jacobian[a * rows..(a + 1) * rows].iter().copied()).collect();
        let complement = Complement::new(&columns, rows, free.len(), RIDGE)
            .ok_or(Error::Inaccurate { backward_error: f64::NAN, limit: RIDGE })?;
        let mut rest = residual.clone();
        let steps = complement.project(&mut rest).into_iter().map(|share| -share).collect();
        Ok(Self { residual, jacobian, free, complement, rest, steps })
    }
}

/// A split: the springs of a group whose feature is below a threshold.
#[derive(Debug, Clone)]
pub struct Split {
    /// The group.
    pub group: usize,
    /// Number of the feature.
    pub feature: usize,
    /// The threshold.
    pub threshold: f64,
    /// The springs below it, ascending.
    pub below: Vec<u32>,
    /// How far it lowers the squared error.
    pub gain: f64,
}

/// The splits with the largest estimated gains, largest first, no two the same; `level` names the probes.
///
/// # Errors
/// Where a solve is not accurate.
pub fn shortlist(worker: &mut Worker, model: &Model, level: usize) -> Result<Vec<Split>> {
    let cases = worker.ground.fitted.weights.len();
    let mut vectors = probes(worker.ground.places, cases, PROBES, level);
    model.complement.project(&mut vectors);
    vectors.splice(0..0, model.rest.iter().copied());
    let slopes = worker.transposed(&vectors)?;
    let curvatures = slopes.chunks_exact(PROBES + 1).map(|of_spring| square(&of_spring[1..]));
    let floor = REACHED * curvatures.fold(0.0, f64::max);
    let mut found: Vec<Place> = Vec::new();
    for (group, part) in worker.parts.iter().enumerate() {
        let room = room(worker.phi()[group], part.upper);
        for (feature, values) in worker.ground.features.iter().enumerate() {
            let thresholds = thresholds(part, values, worker.ground.resolutions[feature], &slopes);
            let places = places(&thresholds, floor, room);
            let mut best = by_gain(&places);
            best.truncate(KEPT);
            best.sort_unstable();
            found.extend(best.into_iter().map(|i| Place { group, feature, ..places[i] }));
        }
    }
    let mut splits: Vec<Split> = Vec::new();
    for Place { gain, group, feature, threshold } in by_gain(&found).into_iter().map(|i| found[i]) {
        let part = &worker.parts[group];
        let values = &worker.ground.features[feature];
        let below: Vec<u32> = part.springs.iter().copied().filter(|&s| values[s as usize] < threshold).collect();
        let same = |other: &Split| other.group == group && equal_halves(&other.below, &below, part.springs.len());
        if !splits.iter().any(same) {
            splits.push(Split { group, feature, threshold, below, gain });
        }
        if splits.len() == SHORTLIST {
            break;
        }
    }
    Ok(splits)
}

/// True when two lower halves of a group with so many springs part it the same way.
fn equal_halves(a: &[u32], b: &[u32], springs: usize) -> bool {
    a == b || a.len() + b.len() == springs && b.iter().all(|s| a.binary_search(s).is_err())
}

/// Indices of the places, largest gain first.
fn by_gain(places: &[Place]) -> Vec<usize> {
    ranked(&places.iter().map(|place| place.gain).collect::<Vec<_>>())
}

/// A threshold with its gain.
#[derive(Clone, Copy)]
struct Place {
    gain: f64,
    group: usize,
    feature: usize,
    threshold: f64,
}

/// A threshold of one feature in one group with the sums of the slopes below and above it.
struct Threshold {
    at: f64,
    sides: [Sums; 2],
}

/// The thresholds of one feature in one group, ascending; values within `resolution` of each other are one.
fn thresholds(part: &Part, values: &[f64], resolution: f64, slopes: &[f64]) -> Vec<Threshold> {
    let mut order = part.springs.clone();
    order.sort_by(|&r, &s| values[r as usize].total_cmp(&values[s as usize]).then(r.cmp(&s)));
    let value = |i: usize| values[order[i] as usize];
    let steps: Vec<usize> = (1..order.len()).filter(|&i| value(i) - value(i - 1) > resolution).collect();
    let stride = steps.len().div_ceil(THRESHOLDS).max(1);
    let mut total = [0.0; PROBES + 1];
    part.springs.iter().for_each(|&s| add(&mut total, slopes, s));
    let mut below = [0.0; PROBES + 1];
    let mut done = 0;
    let mut found = Vec::new();
    for &step in steps.iter().skip((stride - 1) / 2).step_by(stride) {
        order[done..step].iter().for_each(|&s| add(&mut below, slopes, s));
        done = step;
        let above = std::array::from_fn(|i| total[i] - below[i]);
        found.push(Threshold { at: 0.5 * (value(step - 1) + value(step)), sides: [below, above] });
    }
    found
}

/// The thresholds that gain, as places in the first group and feature.
fn places(thresholds: &[Threshold], floor: f64, room: Room) -> Vec<Place> {
    let of = |threshold: &Threshold| {
        let [below, above] = &threshold.sides;
        let other = if room == Room::Free { 0.0 } else { gain(above, floor, room) };
        let gain = gain(below, floor, room).max(other);
        (gain > 0.0).then_some(Place { gain, group: 0, feature: 0, threshold: threshold.at })
    };
    thresholds.iter().filter_map(of).collect()
}

/// The sums of the slopes of some springs: for P r, then for the probes.
type Sums = [f64; PROBES + 1];

/// Adds the slopes of a spring.
fn add(sums: &mut Sums, slopes: &[f64], spring: u32) {
    let of_spring = &slopes[spring as usize * (PROBES + 1)..][..PROBES + 1];
    sums.iter_mut().zip(of_spring).for_each(|(sum, slope)| *sum += slope);
}

/// The estimated gain of a set with these sums; 0 where its curvature is not above the floor.
fn gain(sums: &Sums, floor: f64, room: Room) -> f64 {
    let slope = sums[0];
    let stays = room == Room::Up && slope >= 0.0 || room == Room::Down && slope <= 0.0;
    let curvature = square(&sums[1..]);
    if stays || curvature <= floor { 0.0 } else { slope * slope / curvature }
}

/// The mean square of what the probes say.
fn square(sums: &[f64]) -> f64 {
    sums.iter().map(|s| s * s).sum::<f64>() / PROBES as f64
}
