//! A group that came about by splits, and its name.

use super::features::FEATURES;

/// One side of a split: the springs whose feature is below the threshold, or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Number of the feature in [`FEATURES`].
    pub feature: usize,
    /// What it is compared with, in the unit of the feature.
    pub threshold: f64,
    /// True for the springs below it.
    pub below: bool,
}

/// A group: where it started, which sides it took, and its springs.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name of the group that it started from.
    pub start: String,
    /// The sides it took, one a split.
    pub conditions: Vec<Condition>,
    /// Its springs, ascending.
    pub springs: Vec<u32>,
    /// The largest number that it may have: the largest of its springs (5.8).
    pub upper: f64,
}

impl Part {
    /// A group that has not been split; `bounds` is the largest number of every spring.
    pub fn whole(start: &str, springs: Vec<u32>, bounds: &[f64]) -> Self {
        let upper = largest(&springs, bounds);
        Self { start: start.to_owned(), conditions: vec![], springs, upper }
    }

    /// The springs of this group that are in `below` (ascending), and the others.
    pub fn split(&self, feature: usize, threshold: f64, below: &[u32], bounds: &[f64]) -> [Self; 2] {
        let side = |lower: bool| {
            let of_side = |s: &u32| below.binary_search(s).is_ok() == lower;
            let springs: Vec<u32> = self.springs.iter().copied().filter(of_side).collect();
            let mut conditions = self.conditions.clone();
            conditions.push(Condition { feature, threshold, below: lower });
            Self { start: self.start.clone(), conditions, upper: largest(&springs, bounds), springs }
        };
        [side(true), side(false)]
    }

    /// Its name: where it started and the tightest bounds of each feature, such as "edge, 0.1 <= z < 0.31".
    pub fn name(&self) -> String {
        let mut name = self.start.clone();
        for (f, feature) in FEATURES.iter().enumerate() {
            let of = |below: bool| {
                let sides = self.conditions.iter().filter(move |c| c.feature == f && c.below == below);
                sides.map(|condition| condition.threshold)
            };
            name += &match (of(false).reduce(f64::max), of(true).reduce(f64::min)) {
                (None, None) => continue,
                (Some(low), None) => format!(", {} >= {}", feature.name, short(low)),
                (None, Some(high)) => format!(", {} < {}", feature.name, short(high)),
                (Some(low), Some(high)) => format!(", {} <= {} < {}", short(low), feature.name, short(high)),
            };
        }
        name
    }
}

/// The largest bound of some springs.
fn largest(springs: &[u32], bounds: &[f64]) -> f64 {
    springs.iter().fold(0.0, |largest: f64, &s| largest.max(bounds[s as usize]))
}

/// A threshold with the digits that a person needs.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_tells_the_tightest_bounds() {
        let z = FEATURES.iter().position(|feature| feature.name == "z").unwrap();
        let bounds = [1.0, 5.0, 2.0, 3.0];
        let whole = Part::whole("edge", vec![0, 1, 2, 3], &bounds);
        let [below, above] = whole.split(z, 0.5, &[0, 2, 3], &bounds);
        assert_eq!((below.upper, above.upper, whole.upper), (3.0, 5.0, 5.0));
        let [first, rest] = below.split(z, 0.31, &[0], &bounds);
        assert_eq!((whole.name(), above.name()), ("edge".to_owned(), "edge, z >= 0.5".to_owned()));
        assert_eq!((first.name(), rest.name()), ("edge, z < 0.31".to_owned(), "edge, 0.31 <= z < 0.5".to_owned()));
        assert_eq!(rest.springs, [2, 3]);
        assert_eq!([-0.0, 2.0, 1.0 / 3.0].map(short), ["0", "2", "0.3333"]);
    }
}
