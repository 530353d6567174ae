//! Order where several are equally good: rounding must not choose.
//!
//! A body with a symmetry has splits that gain the same; computed gains then differ in their last digits, by units, node numbers and
//! processor, and whoever takes the largest takes another one each time. What lies within [`TIE`] of the best counts as
//! equal, and of equals the first is taken, in an order that depends on the geometry alone: groups in the order in which they
//! came to be, features in the order of their table, thresholds ascending.

/// Part of the best below which another one is as good.
pub const TIE: f64 = 1e-3;

/// Indices of these numbers, largest first, and in their own order where they are within [`TIE`] of the largest one left.
pub fn ranked(gains: &[f64]) -> Vec<usize> {
    ranked_within(gains, |best| best - TIE * best.abs())
}

/// The same where all numbers that are at least `bar` of the largest one left are equal to it.
pub fn ranked_within(gains: &[f64], bar: impl Fn(f64) -> f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..gains.len()).collect();
    order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
    let mut from = 0;
    while from < order.len() {
        let bar = bar(gains[order[from]]);
        let equal = order[from..].iter().take_while(|&&i| gains[i] >= bar).count().max(1);
        order[from..from + equal].sort_unstable();
        from += equal;
    }
    order
}

/// Index of the first number within [`TIE`] of the largest; none of none.
pub fn first_of_best(gains: impl Iterator<Item = f64> + Clone) -> Option<usize> {
    let best = gains.clone().reduce(f64::max)?;
    gains.into_iter().position(|gain| gain >= best - TIE * best.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_keep_their_order_whatever_their_last_digits() {
        let gains = [0.5, 2.0, 0.9, 2.0 * (1.0 + 1e-9), 2.0 * (1.0 - 1e-9), 0.9 * (1.0 + 1e-6)];
        assert_eq!(ranked(&gains), [1, 3, 4, 2, 5, 0]);
        assert_eq!(first_of_best(gains.into_iter()), Some(1));
        assert_eq!(first_of_best([0.0, -1.0].into_iter()), Some(0));
        assert_eq!(first_of_best(std::iter::empty()), None);
        assert_eq!(ranked(&[f64::NEG_INFINITY, 1.0]), [1, 0]);
    }
}
