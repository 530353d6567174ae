//! What it costs that two groups share a number, in the linear model.
//!
//! With y the steps of the two groups a and b, and all free groups beside them at their best, the squared error is a quadratic of
//! y: 2 g . y + y . S y on top of what it is at y = 0. On phi_a + y_a = phi_b + y_b = x it is one of x, and its minimum in [0, upper],
//! less the minimum where each group has its own number, is the loss. Groups that are both at 0 lose nothing.
//!
//! With G = (J^T J)^-1 over the free groups F, d = -G J^T r their step, and P c and X as in [`super::exact`]:
//!
//! | a | b | G or S of the two | step or gradient |
//! |---|---|---|---|
//! | free | free | G_aa, G_ab, G_bb | d_a, d_b |
//! | bound | free | 1/q, -X_b/q, G_bb + X_b^2/q; q = P c_a . P c_a | t = -P c_a . P r / q, d_b - X_b t |
//! | bound | bound | S: P c_a . P c_a, P c_a . P c_b, P c_b . P c_b | g: P c_a . P r, P c_b . P r |
//!
//! where S is the inverse of G and g = -S times the step.

use crate::dense::dot;

use super::candidates::Model;
use super::ties::{TIE, ranked_within};

/// Part of the squared error that no loss is told from nothing below.
const NOTHING: f64 = 1e-6;

/// Two groups, a before b, as one.
#[derive(Debug, Clone, Copy)]
pub struct Union {
    /// The groups, ascending.
    pub groups: [usize; 2],
    /// Their common number.
    pub number: f64,
    /// How far it raises the squared error.
    pub loss: f64,
}

/// The steps of two groups: S and g, and the error below that of y = 0 with a number each.
struct Pair {
    curvature: [f64; 3],
    slope: [f64; 2],
    best: f64,
}

/// All pairs of groups with these numbers and bounds, smallest loss first.
pub fn unions(phi: &[f64], upper: &[f64], model: &Model) -> Vec<Union> {
    let held = Held::new(model, phi.len());
    let mut found = Vec::with_capacity(phi.len() * phi.len() / 2);
    for b in 0..phi.len() {
        for a in 0..b {
            let pair = held.pair(model, a, b);
            let (number, loss) = pair.minimum([phi[a], phi[b]], upper[a].max(upper[b]));
            if loss.is_finite() {
                found.push(Union { groups: [a, b], number, loss });
            }
        }
    }
    // groups at rest at 0 lose nothing, to rounding: the first two are taken
    let floor = NOTHING * dot(&model.residual, &model.residual);
    let gains: Vec<f64> = found.iter().map(|union| -union.loss.max(0.0)).collect();
    ranked_within(&gains, |best| best * (1.0 + TIE) - floor).into_iter().map(|i| found[i]).collect()
}

impl Pair {
    /// From the entries of G and the steps.
    fn of_inverse([aa, ab, bb]: [f64; 3], y: [f64; 2], best: f64) -> Self {
        let determinant = aa * bb - ab * ab;
        let curvature = [bb / determinant, -ab / determinant, aa / determinant];
        let slope = [-(curvature[0] * y[0] + curvature[1] * y[1]), -(curvature[1] * y[0] + curvature[2] * y[1])];
        Self { curvature, slope, best }
    }

    /// The common number in [0, upper] with the smallest loss, and that loss.
    fn minimum(&self, phi: [f64; 2], upper: f64) -> (f64, f64) {
        let ([aa, ab, bb], [ga, gb]) = (self.curvature, self.slope);
        // y = x - phi
        let quadratic = aa + 2.0 * ab + bb;
        let linear = ga + gb - (aa + ab) * phi[0] - (ab + bb) * phi[1];
        let x = if quadratic > 0.0 { (-linear / quadratic).clamp(0.0, upper) } else { phi[0].min(upper) };
        let y = phi.map(|phi| x - phi);
        let value = 2.0 * (ga * y[0] + gb * y[1]) + aa * y[0] * y[0] + 2.0 * ab * y[0] * y[1] + bb * y[1] * y[1];
        (x, value - self.best)
    }
}

/// What all pairs need.
struct Held {
    /// Place of a group among the free ones or, beyond, among the others.
    place: Vec<Result<usize, usize>>,
    inverse: Vec<f64>,
    /// P c of the groups that are not free, and X.
    beyond: Vec<f64>,
    shares: Vec<f64>,
}

impl Held {
    fn new(model: &Model, groups: usize) -> Self {
        let rows = model.rest.len();
        let mut place = Vec::with_capacity(groups);
        let mut beyond = Vec::new();
        for group in 0..groups {
            place.push(model.free.binary_search(&group).map_err(|_| beyond.len() / rows));
            if place[group].is_err() {
                beyond.extend_from_slice(&model.jacobian[group * rows..(group + 1) * rows]);
            }
        }
        let shares = model.complement.project(&mut beyond);
        Self { place, inverse: model.complement.inverse(), beyond, shares }
    }

    fn pair(&self, model: &Model, a: usize, b: usize) -> Pair {
        let (rows, m) = (model.rest.len(), model.free.len());
        let g = |i: usize, j: usize| self.inverse[i * m + j];
        let beyond = |i: usize| &self.beyond[i * rows..(i + 1) * rows];
        match (self.place[a], self.place[b]) {
            (Ok(i), Ok(j)) => {
                let y = [model.steps[i], model.steps[j]];
                let pair = Pair::of_inverse([g(i, i), g(i, j), g(j, j)], y, 0.0);
                Pair { best: pair.slope[0] * y[0] + pair.slope[1] * y[1], ..pair }
            }
            (Err(i), Err(j)) => Pair {
                curvature: [dot(beyond(i), beyond(i)), dot(beyond(i), beyond(j)), dot(beyond(j), beyond(j))],
                slope: [dot(beyond(i), &model.rest), dot(beyond(j), &model.rest)],
                best: 0.0,
            },
            (Err(i), Ok(j)) => self.mixed(model, i, j),
            (Ok(i), Err(j)) => {
                let Pair { curvature: [aa, ab, bb], slope: [ga, gb], best } = self.mixed(model, j, i);
                Pair { curvature: [bb, ab, aa], slope: [gb, ga], best }
            }
        }
    }

    /// A group at a bound, and a free one.
    fn mixed(&self, model: &Model, bound: usize, free: usize) -> Pair {
        let (rows, m) = (model.rest.len(), model.free.len());
        let beyond = &self.beyond[bound * rows..(bound + 1) * rows];
        let (q, slope) = (dot(beyond, beyond), dot(beyond, &model.rest));
        let (t, x) = (-slope / q, self.shares[bound * m + free]);
        let y = [t, model.steps[free] - x * t];
        let pair = Pair::of_inverse([1.0 / q, -x / q, self.inverse[free * m + free] + x * x / q], y, 0.0);
        // the minimum over both, and what the bound keeps from it
        let least = pair.slope[0] * y[0] + pair.slope[1] * y[1];
        Pair { best: least + slope * slope / q, ..pair }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::Complement;
    use crate::rng::Stream;

    const ROWS: usize = 12;

    /// The smallest squared error with the columns of `free` free, from the residual r.
    fn smallest(r: &[f64], free: &[&[f64]]) -> f64 {
        let mut rest = r.to_vec();
        Complement::new(&free.concat(), ROWS, free.len(), 0.0).unwrap().project(&mut rest);
        dot(&rest, &rest)
    }

    /// Three free groups, one at 0 and two at their bounds: every loss beside the problem of that union, solved anew.
    #[test]
    fn a_loss_is_what_the_linear_model_with_one_group_less_says() {
        let mut stream = Stream::new(5, 0, 0);
        let jacobian: Vec<f64> = (0..6 * ROWS).map(|_| stream.normal()).collect();
        let residual: Vec<f64> = (0..ROWS).map(|_| stream.normal()).collect();
        let (phi, upper) = ([0.4, 0.7, 1.1, 0.0, 1.5, 2.0], [2.0, 2.0, 2.0, 2.0, 1.5, 2.0]);
        let column = |a: usize| &jacobian[a * ROWS..(a + 1) * ROWS];
        let complement = Complement::new(&jacobian[..3 * ROWS], ROWS, 3, 0.0).unwrap();
        let mut rest = residual.clone();
        let steps = complement.project(&mut rest).iter().map(|share| -share).collect();
        let with_all = dot(&rest, &rest);
        let model = Model {
            residual: residual.clone(),
            jacobian: jacobian.clone(),
            free: vec![0, 1, 2],
            complement,
            rest,
            steps,
        };
        let found = unions(&phi, &upper, &model);
        assert_eq!(found.len(), 15);
        let floor = TIE * found[14].loss + NOTHING * dot(&residual, &residual);
        assert!(found.windows(2).all(|pair| pair[0].loss <= pair[1].loss + floor));
        for Union { groups: [a, b], number, loss } in found {
            let others: Vec<&[f64]> = (0..3).filter(|i| *i != a && *i != b).map(column).collect();
            let loss_at = |x: f64| {
                let moved = |i: usize| residual[i] + (x - phi[a]) * column(a)[i] + (x - phi[b]) * column(b)[i];
                smallest(&(0..ROWS).map(moved).collect::<Vec<_>>(), &others) - with_all
            };
            assert!((loss_at(number) - loss).abs() < 1e-11, "{a} {b}: {} {loss}", loss_at(number));
            let most = upper[a].max(upper[b]);
            assert!((0.0..=most).contains(&number));
            for x in [number - 1e-3, number + 1e-3, 0.0, most] {
                assert!(loss_at(x.clamp(0.0, most)) >= loss - 1e-11, "{a} {b}: {x} is better than {number}");
            }
        }
    }
}
