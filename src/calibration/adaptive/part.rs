//! A group that came about by splits and unions, and its name.

use serde::{Deserialize, Serialize};

use crate::readable::short;

use super::features::FEATURES;

/// One side of a split: the springs whose feature is below the threshold, or not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Number of the feature in [`FEATURES`].
    pub feature: usize,
    /// What it is compared with, in the unit of the feature.
    pub threshold: f64,
    /// True for the springs below it.
    pub below: bool,
}

/// Springs of one group of the start, on one side of every split that cut them out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Name of the group that it started from.
    pub start: String,
    /// The sides it took: the tightest one of each feature and direction, in the order of [`FEATURES`].
    pub conditions: Vec<Condition>,
    /// Its springs, ascending.
    pub springs: Vec<u32>,
}

/// A group: one piece, or several that share their number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its pieces; no two are the halves of a larger one.
    pub pieces: Vec<Piece>,
    /// Their springs, ascending.
    pub springs: Vec<u32>,
    /// The largest number that it may have: the largest of its springs (5.8).
    pub upper: f64,
}

impl Piece {
    /// The springs of this piece that are in `below` (ascending), or the others; none where there are none. A piece that
    /// stays whole needs no further words.
    fn side(&self, condition: Condition, below: &[u32]) -> Option<Self> {
        let of_side = |s: &u32| below.binary_search(s).is_ok() == condition.below;
        let springs: Vec<u32> = self.springs.iter().copied().filter(of_side).collect();
        let mut conditions = self.conditions.clone();
        if springs.len() < self.springs.len() {
            conditions.retain(|c| (c.feature, c.below) != (condition.feature, condition.below));
            conditions.push(condition);
            conditions.sort_by_key(|c| (c.feature, c.below));
        }
        (!springs.is_empty()).then(|| Self { start: self.start.clone(), conditions, springs })
    }

    /// Both as one piece, where this one ends at the threshold at which the other begins and all else is the same.
    fn joined(&self, other: &Self) -> Option<Self> {
        let begins = |c: &Condition| Condition { below: false, ..*c };
        let end = self.conditions.iter().find(|c| c.below && other.conditions.contains(&begins(c)))?;
        let elsewhere = |piece: &Self| -> Vec<Condition> {
            piece.conditions.iter().copied().filter(|c| c.feature != end.feature).collect()
        };
        let mut conditions = elsewhere(self);
        if self.start != other.start || conditions != elsewhere(other) {
            return None;
        }
        let of_end = |piece: &Self, below: bool| {
            piece.conditions.iter().copied().find(|c| c.feature == end.feature && c.below == below)
        };
        conditions.extend(of_end(self, false).into_iter().chain(of_end(other, true)));
        conditions.sort_by_key(|c| (c.feature, c.below));
        Some(Self { start: self.start.clone(), conditions, springs: merged(&self.springs, &other.springs) })
    }

    /// Its name: where it started and its bounds, such as "edge, 0.1 <= z < 0.31".
    fn name(&self) -> String {
        let mut name = self.start.clone();
        for (f, feature) in FEATURES.iter().enumerate() {
            let of = |below: bool| self.conditions.iter().find(|c| c.feature == f && c.below == below);
            let (low, high) = (of(false).map(|c| c.threshold), of(true).map(|c| c.threshold));
            name += &match (low, high) {
                (None, None) => continue,
                (Some(low), None) => format!(", {} >= {}", feature.name, short(low)),
                (None, Some(high)) => format!(", {} < {}", feature.name, short(high)),
                (Some(low), Some(high)) => format!(", {} <= {} < {}", short(low), feature.name, short(high)),
            };
        }
        name
    }
}

impl Part {
    /// A group that has not been split; `bounds` is the largest number of every spring.
    pub fn whole(start: &str, springs: Vec<u32>, bounds: &[f64]) -> Self {
        let piece = Piece { start: start.to_owned(), conditions: vec![], springs: springs.clone() };
        Self { upper: largest(&springs, bounds), pieces: vec![piece], springs }
    }

    /// The springs of this group that are in `below` (ascending), and the others.
    pub fn split(&self, feature: usize, threshold: f64, below: &[u32], bounds: &[f64]) -> [Self; 2] {
        [true, false].map(|lower| {
            let condition = Condition { feature, threshold, below: lower };
            let pieces: Vec<Piece> = self.pieces.iter().filter_map(|piece| piece.side(condition, below)).collect();
            let of_side = |s: &u32| below.binary_search(s).is_ok() == lower;
            let springs: Vec<u32> = self.springs.iter().copied().filter(of_side).collect();
            Self { upper: largest(&springs, bounds), pieces, springs }
        })
    }

    /// This group and another as one.
    pub fn union(&self, other: &Self) -> Self {
        let mut pieces = self.pieces.clone();
        for piece in &other.pieces {
            let mut piece = piece.clone();
            // a piece that has grown may fit another
            while let Some((i, both)) = pieces
                .iter()
                .enumerate()
                .find_map(|(i, p)| p.joined(&piece).or_else(|| piece.joined(p)).map(|both| (i, both)))
            {
                pieces.remove(i);
                piece = both;
            }
            pieces.push(piece);
        }
        Self { pieces, springs: merged(&self.springs, &other.springs), upper: self.upper.max(other.upper) }
    }

    /// Its name: those of its pieces, such as "edge, z < 0.31 or face_diagonal, x >= 2".
    pub fn name(&self) -> String {
        self.pieces.iter().map(Piece::name).collect::<Vec<_>>().join(" or ")
    }
}

/// Two lists without a common number as one, ascending.
fn merged(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut both = [a, b].concat();
    both.sort_unstable();
    both
}

/// The largest bound of some springs.
fn largest(springs: &[u32], bounds: &[f64]) -> f64 {
    springs.iter().fold(0.0, |largest: f64, &s| largest.max(bounds[s as usize]))
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
        // a body of a micron: 3.1e-7 was written as 0
        let [small, _] = whole.split(z, 3.1e-7, &[0], &bounds);
        assert_eq!(small.name(), "edge, z < 3.1e-7");
    }

    /// Halves become whole again, neighbours become one range, and what has no common name keeps both.
    #[test]
    fn a_union_has_the_shortest_name_that_is_true() {
        let z = FEATURES.iter().position(|feature| feature.name == "z").unwrap();
        let bounds = [1.0, 5.0, 2.0, 3.0, 4.0];
        let [low, rest] = Part::whole("edge", vec![0, 1, 2, 3], &bounds).split(z, 0.2, &[0], &bounds);
        let [middle, high] = rest.split(z, 0.5, &[2], &bounds);
        assert_eq!(low.union(&middle).name(), "edge, z < 0.5");
        assert_eq!(high.union(&middle).name(), "edge, z >= 0.2");
        let apart = high.union(&low);
        assert_eq!(apart.name(), "edge, z >= 0.5 or edge, z < 0.2");
        assert_eq!((&apart.springs[..], apart.upper), (&[0, 1, 3][..], 5.0));
        assert_eq!(apart.union(&middle), Part::whole("edge", vec![0, 1, 2, 3], &bounds));
        let both = low.union(&Part::whole("body_diagonal", vec![4], &bounds));
        // the edge is below, the diagonal is not: neither needs a word more
        let [edge, diagonal] = both.split(z, 0.3, &[0], &bounds);
        assert_eq!((edge.name(), diagonal.name()), ("edge, z < 0.2".to_owned(), "body_diagonal".to_owned()));
    }
}
