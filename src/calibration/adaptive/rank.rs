//! Ranking of splits.
use super::worker::{Ground, Worker};
use crate::dense::Complement;
use crate::error::Result;
use crate::rng::Stream;

#[derive(Clone)]
pub struct Split {
    pub group: usize,
    pub feature: usize,
    pub threshold: f64,
    /// Springs below the threshold.
    pub below: Vec<u32>,
    pub gain: f64,
    /// Residual-space column of `below`.
    pub column: Vec<f64>,
    /// What the column has beyond those of the groups.
    pub beyond: Vec<f64>,
    parent: f64,
}

pub struct Tuning {
    pub probes: usize,
    pub shortlist: usize,
    pub trials: usize,
    pub budget: u64,
    pub reach: f64,
    pub together: usize,
    pub fraction: f64,
    pub trials_many: usize,
    pub tries: usize,
    pub thresholds: usize,
    pub smallest: usize,
    pub damping: f64,
    pub features: Vec<bool>,
    pub per_feature: bool,
    pub tolerance: f64,
    pub starts: usize,
    pub swaps: usize,
}

/// The side that may move and how.
#[derive(Clone, Copy, PartialEq)]
pub enum Side { Both, Up, Down }

pub fn side(phi: f64, upper: f64) -> Side {
    if phi <= 0.0 { Side::Up } else if phi >= upper * (1.0 - 1e-12) { Side::Down } else { Side::Both }
}

/// The candidates with the largest estimated gains.
pub fn rank(worker: &mut Worker, residual: &[f64], jacobian: &[f64], tuning: &Tuning, seed: u64, level: usize) -> Result<Vec<Split>> {
    let rows = residual.len();
    let phi = &worker.phi().to_vec()[..];
    let m = phi.len();
    let upper = worker.upper();
    let free: Vec<usize> = (0..m).filter(|&a| side(phi[a], upper[a]) == Side::Both).collect();
    let columns: Vec<f64> = free.iter().flat_map(|&a| jacobian[a * rows..(a + 1) * rows].iter().copied()).collect();
    let complement = Complement::new(&columns, rows, free.len(), 1e-9).expect("ridge");
    let mut probes = residual.to_vec();
    let mut stream = Stream::new(seed, 1, level);
    probes.extend((0..tuning.probes * rows).map(|_| stream.normal()));
    complement.project(&mut probes);
    let rest = probes[..rows].to_vec();
    // the adjoint problem of w r, not r: pulled_back puts the weight in
    let pulled = worker.pulled_back(&probes)?;
    let springs = worker.springs();
    let Ground { features, .. } = worker.ground;
    let mut found: Vec<(f64, usize, usize, f64, usize)> = Vec::new();
    let count = tuning.probes + 1;
    let mut sums = vec![0.0; count];
    for (g, group) in worker.groups.iter().enumerate().filter(|(_, g)| g.len() > 1) {
        let total: Vec<f64> = (0..count).map(|q| group.iter().map(|&s| pulled[q * springs + s as usize]).sum()).collect();
        let side = side(phi[g], upper[g]);
        for (f, feature) in features.iter().enumerate().filter(|(f, _)| tuning.features[*f]) {
            let mut order = group.clone();
            order.sort_by(|&r, &s| feature[r as usize].total_cmp(&feature[s as usize]).then(r.cmp(&s)));
            let value = |i: usize| feature[order[i] as usize];
            let spread = value(order.len() - 1) - value(0);
            let size = value(0).abs().max(value(order.len() - 1).abs());
            if spread <= 1e-9 * size { continue; }
            let places: Vec<usize> = (1..order.len()).filter(|&i| value(i) - value(i - 1) > 1e-7 * size).collect();
            let stride = places.len().div_ceil(tuning.thresholds).max(1);
            sums.fill(0.0);
            let mut done = 0;
            let mut best: Vec<(f64, usize, usize, f64, usize)> = Vec::new();
            for &place in places.iter().skip((stride - 1) / 2).step_by(stride) {
                for &s in &order[done..place] {
                    for (q, sum) in sums.iter_mut().enumerate() { *sum += pulled[q * springs + s as usize]; }
                }
                done = place;
                if place < tuning.smallest || order.len() - place < tuning.smallest { continue; }
                let mut gain: f64 = 0.0;
                for (below, sums) in [(true, sums.clone()), (false, total.iter().zip(&sums).map(|(t, s)| t - s).collect::<Vec<f64>>())] {
                    if side == Side::Both && !below { continue; }
                    // dE/dk is twice the sum: positive means that it should fall
                    let slope = sums[0];
                    if side == Side::Up && slope >= 0.0 || side == Side::Down && slope <= 0.0 { continue; }
                    let curvature = sums[1..].iter().map(|s| s * s).sum::<f64>() / tuning.probes as f64;
                    if curvature > 0.0 { gain = gain.max(slope * slope / curvature); }
                }
                if gain > 0.0 { best.push((gain, g, f, 0.5 * (value(place - 1) + value(place)), place)); }
            }
            best.sort_by(|a, b| b.0.total_cmp(&a.0));
            found.extend(best.into_iter().take(if tuning.per_feature { 3 } else { usize::MAX }));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)).then(a.3.total_cmp(&b.3)));
    let mut splits: Vec<Split> = Vec::new();
    for (gain, group, feature, threshold, _) in found {
        let mut below: Vec<u32> = worker.groups[group].iter().copied().filter(|&s| features[feature][s as usize] < threshold).collect();
        below.sort_unstable();
        if splits.iter().any(|other| other.group == group && (other.below == below || other.below.len() + below.len() == worker.groups[group].len() && below.iter().all(|s| other.below.binary_search(s).is_err()))) { continue; }
        splits.push(Split { group, feature, threshold, below, gain, column: vec![], beyond: vec![], parent: 0.0 });
        if splits.len() == tuning.shortlist { break; }
    }
    refine(worker, phi, &upper, &free, &complement, &rest, jacobian, &mut splits, tuning)?;
    Ok(splits)
}

#[allow(clippy::too_many_arguments)]
fn refine(worker: &mut Worker, phi: &[f64], upper: &[f64], free: &[usize], complement: &Complement, rest: &[f64], jacobian: &[f64], splits: &mut Vec<Split>, tuning: &Tuning) -> Result<()> {
    let rows = rest.len();
    let sets: Vec<&[u32]> = splits.iter().map(|split| split.below.as_slice()).collect();
    let columns = worker.columns(&sets)?;
    let mut projected = columns.clone();
    // for groups at a bound the other half may be the one that moves
    let other: Vec<f64> = splits.iter().enumerate().flat_map(|(i, split)| {
        (0..rows).map(move |r| (i, r, split.group))
    }).map(|(i, r, g)| jacobian[g * rows + r] - columns[i * rows + r]).collect();
    let mut others = other.clone();
    let moved = complement.project(&mut projected);
    let moved_other = complement.project(&mut others);
    let f = free.len();
    for (i, split) in splits.iter_mut().enumerate() {
        let above: Vec<u32> = worker.groups[split.group].iter().copied().filter(|s| split.below.binary_search(s).is_err()).collect();
        let (ub, ua) = (worker.upper_of(&split.below), worker.upper_of(&above));
        let p = phi[split.group];
        let gain = |c: &[f64], whole: &[f64], parent: f64, ub: f64, ua: f64| -> f64 {
            let num: f64 = -c.iter().zip(rest).map(|(a, b)| a * b).sum::<f64>();
            let square: f64 = c.iter().map(|a| a * a).sum();
            let size: f64 = whole.iter().map(|a| a * a).sum();
            let den = square + tuning.damping * size;
            // child moves by t (1 - parent), its sibling by -t parent
            let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
            for (rate, up) in [(1.0 - parent, ub), (-parent, ua)] {
                let (a, b) = (-p / rate, (up - p) / rate);
                low = low.max(a.min(b));
                high = high.min(a.max(b));
            }
            if low > high { return f64::NEG_INFINITY }
            let t = (num / den).clamp(low, high);
            2.0 * num * t - square * t * t
        };
        let c = &projected[i * rows..(i + 1) * rows];
        let whole = &columns[i * rows..(i + 1) * rows];
        split.gain = match side(p, upper[split.group]) {
            Side::Both => {
                let at = free.iter().position(|&a| a == split.group).expect("free");
                gain(c, whole, moved[i * f + at], ub, ua)
            }
            _ => gain(c, whole, 0.0, ub, ua).max(gain(&others[i * rows..(i + 1) * rows], &other[i * rows..(i + 1) * rows], 0.0, ua, ub)),
        };
        split.column = whole.to_vec();
        split.beyond = c.to_vec();
    }
    let _ = moved_other;
    splits.retain(|split| split.gain > 0.0);
    splits.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(())
}
