//! The gains of a few splits in the linear model, each with its own column, inside the bounds.
//!
//! With the column c of the lower half, P c and P r as in [`super::candidates`], a step t of that half lowers the squared
//! error by 2 g t - |P c|^2 t^2, g = -P c . P r; the groups that are free follow by -t X, X = (J^T J)^-1 J^T c. So the lower
//! half moves by t (1 - X_a) and the upper one by -t X_a, a their group, and t is cut where either leaves its bounds. A half
//! may have a lower bound than the group had (its springs are longer): then t must be large enough to bring it down.
//!
//! Several splits of different groups are chosen one after the other, each for what it adds to those before.

use crate::dense::dot;
use crate::error::Result;

use super::candidates::{Model, Room, Split, room};
use super::part::Part;
use super::ties::{first_of_best, ranked};
use super::worker::Worker;

/// Part of a squared column: less beyond the columns of the groups is what the ridge and rounding leave of nothing.
const BEYOND: f64 = 1e-10;

/// Part of |P c|^2: less beyond the splits that are chosen already is nothing.
const LEFT: f64 = 1e-6;

/// A split with its column.
pub struct Exact {
    /// The split; its gain is that of the linear model.
    pub split: Split,
    /// c, one number a row.
    pub column: Vec<f64>,
    /// P c.
    pub beyond: Vec<f64>,
    /// The two halves.
    pub halves: [Part; 2],
}

/// Solves the columns of the splits; those that gain, largest gain first.
///
/// # Errors
/// Where a solve is not accurate.
pub fn measure(worker: &mut Worker, model: &Model, splits: Vec<Split>) -> Result<Vec<Exact>> {
    let rows = model.rest.len();
    let sets: Vec<&[u32]> = splits.iter().map(|split| split.below.as_slice()).collect();
    let columns = worker.columns(&sets)?;
    let mut projected = columns.clone();
    let shares = model.complement.project(&mut projected);
    let mut measured: Vec<Exact> = Vec::with_capacity(splits.len());
    for (i, split) in splits.into_iter().enumerate() {
        let (column, beyond) = (&columns[i * rows..(i + 1) * rows], &projected[i * rows..(i + 1) * rows]);
        let part = &worker.parts[split.group];
        let halves = part.split(split.feature, split.threshold, &split.below, worker.ground.bounds);
        if dot(beyond, beyond) <= BEYOND * dot(column, column) {
            continue;
        }
        let phi = worker.phi()[split.group];
        let gain = match room(phi, part.upper) {
            Room::Free => {
                let at = model.free.iter().position(|&a| a == split.group).expect("it is free");
                let share = shares[i * model.free.len() + at];
                gain(beyond, &model.rest, phi, [(1.0 - share, halves[0].upper), (-share, halves[1].upper)])
            }
            _ => from_bound(model, &split, column, beyond, phi, &halves),
        };
        if gain > 0.0 {
            let (column, beyond) = (column.to_vec(), beyond.to_vec());
            measured.push(Exact { split: Split { gain, ..split }, column, beyond, halves });
        }
    }
    measured.sort_by(|a, b| place(&a.split).partial_cmp(&place(&b.split)).expect("thresholds are numbers"));
    let order = ranked(&measured.iter().map(|exact| exact.split.gain).collect::<Vec<_>>());
    let mut by_place: Vec<Option<Exact>> = measured.into_iter().map(Some).collect();
    Ok(order.into_iter().filter_map(|i| by_place[i].take()).collect())
}

/// Where a split stands among those that gain the same.
fn place(split: &Split) -> (usize, usize, f64) {
    (split.group, split.feature, split.threshold)
}

/// The gain where the group is at a bound: of the half that leaves it.
fn from_bound(model: &Model, split: &Split, column: &[f64], beyond: &[f64], phi: f64, halves: &[Part; 2]) -> f64 {
    let rows = column.len();
    let group = &model.jacobian[split.group * rows..(split.group + 1) * rows];
    let mut other: Vec<f64> = group.iter().zip(column).map(|(group, below)| group - below).collect();
    model.complement.project(&mut other);
    let [below, above] = halves;
    let moves = |beyond: &[f64], moving: &Part, still: &Part| {
        gain(beyond, &model.rest, phi, [(1.0, moving.upper), (0.0, still.upper)])
    };
    moves(beyond, below, above).max(moves(&other, above, below))
}

/// The gain of the best step t, where each half moves by rate x t from phi and stays in [0, upper].
fn gain(beyond: &[f64], rest: &[f64], phi: f64, halves: [(f64, f64); 2]) -> f64 {
    let (slope, curvature) = (-dot(beyond, rest), dot(beyond, beyond));
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for (rate, upper) in halves {
        if rate == 0.0 {
            if phi > upper {
                return f64::NEG_INFINITY;
            }
            continue;
        }
        let (a, b) = (-phi / rate, (upper - phi) / rate);
        low = low.max(a.min(b));
        high = high.min(a.max(b));
    }
    if low > high {
        return f64::NEG_INFINITY;
    }
    let t = (slope / curvature).clamp(low, high);
    2.0 * slope * t - curvature * t * t
}

/// `count` splits of different groups, fewer where there are not so many, and what each adds: `first`, then each with the
/// largest gain beyond those before it.
pub fn choose(splits: &[Exact], rest: &[f64], first: usize, count: usize) -> Vec<(usize, f64)> {
    let mut chosen = vec![(first, splits[first].split.gain)];
    if count <= 1 {
        return chosen;
    }
    let mut rest = rest.to_vec();
    let mut beyond: Vec<Vec<f64>> = splits.iter().map(|exact| exact.beyond.clone()).collect();
    let whole: Vec<f64> = beyond.iter().map(|beyond| dot(beyond, beyond)).collect();
    while chosen.len() < count {
        let last = beyond[chosen[chosen.len() - 1].0].clone();
        let square = dot(&last, &last);
        for vector in beyond.iter_mut().chain([&mut rest]) {
            let share = dot(vector, &last) / square;
            vector.iter_mut().zip(&last).for_each(|(v, l)| *v -= share * l);
        }
        // a column that follows from those chosen has nothing left but rounding; bounds hold beside others as they do alone
        let gain = |i: usize| {
            let left = dot(&beyond[i], &beyond[i]);
            let gain = if left > LEFT * whole[i] { dot(&beyond[i], &rest).powi(2) / left } else { 0.0 };
            gain.min(splits[i].split.gain)
        };
        let other_group = |i: &usize| chosen.iter().all(|&(c, _)| splits[c].split.group != splits[*i].split.group);
        let others: Vec<(usize, f64)> = (0..splits.len()).filter(other_group).map(|i| (i, gain(i))).collect();
        match first_of_best(others.iter().map(|(_, gain)| *gain)) {
            Some(next) => chosen.push(others[next]),
            None => break,
        }
    }
    chosen
}
