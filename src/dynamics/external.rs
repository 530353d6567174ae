//! External forces in time.
//!
//! ```text
//! f_ext(t) = sum_c g_c(t) f_c
//! ```
//!
//! with forces f_c in N over the n free degrees of freedom (a load case, or weight m g) and numbers g_c(t) that say when
//! and how much of each acts. The *step force* of the thesis (experiments II and V) acts in full until a time and then
//! ends: the body is released and swings.

/// How much of a force acts at a time.
#[derive(Debug, Clone, PartialEq)]
pub enum History {
    /// All of it, for ever.
    Constant,
    /// All of it before this time in s, nothing from then on.
    Until(f64),
    /// Factors at times in s, ascending; straight lines between them, the first and the last for ever outside.
    Table(Vec<[f64; 2]>),
}

/// Part of a step by which rounding may move a time.
const ROUNDING: f64 = 1e-9;

impl History {
    /// The factor g(t) at the time t in s; `step` in s is the size of the steps that t is a multiple of.
    pub fn factor(&self, time: f64, step: f64) -> f64 {
        match self {
            Self::Constant => 1.0,
            Self::Until(end) => f64::from(time < end - ROUNDING * step),
            Self::Table(rows) => between(rows, time),
        }
    }
}

/// Linear interpolation in a table of (time, factor).
fn between(rows: &[[f64; 2]], time: f64) -> f64 {
    let after = rows.partition_point(|row| row[0] <= time);
    match (after.checked_sub(1).map(|before| rows[before]), rows.get(after)) {
        (Some([t0, g0]), Some([t1, g1])) => g0 + (g1 - g0) * (time - t0) / (t1 - t0),
        (Some([_, factor]), None) | (None, Some(&[_, factor])) => factor,
        (None, None) => 0.0,
    }
}

/// A force and its history.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// N, one entry for every unknown.
    pub forces: Vec<f64>,
    /// When it acts.
    pub history: History,
}

/// All external forces on a body; none at all when empty.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct External {
    /// They add up.
    pub parts: Vec<Part>,
}

impl External {
    /// out = f_ext(t) in N.
    ///
    /// # Panics
    /// When a part has another length than `out`.
    pub fn at(&self, time: f64, step: f64, out: &mut [f64]) {
        out.fill(0.0);
        for part in &self.parts {
            assert_eq!(part.forces.len(), out.len(), "one force for every unknown");
            let factor = part.history.factor(time, step);
            if factor != 0.0 {
                out.iter_mut().zip(&part.forces).for_each(|(out, force)| *out += factor * force);
            }
        }
    }
}

/// The weight m g in N of every unknown: `owner(i)` is the component of space of unknown i, gravity in m/s^2.
pub fn weight(masses: &[f64], component: impl Fn(usize) -> usize, gravity: [f64; 3]) -> Vec<f64> {
    masses.iter().enumerate().map(|(i, mass)| mass * gravity[component(i)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_force_ends_at_the_step_that_reaches_its_end() {
        let (end, step) = (1.0 / 30.0, 1.0 / 240.0);
        let acting: Vec<f64> = (0..10).map(|n| History::Until(end).factor(f64::from(n) * step, step)).collect();
        assert_eq!(acting, [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn a_table_is_joined_by_straight_lines() {
        let table = History::Table(vec![[1.0, 0.0], [2.0, 4.0], [4.0, 2.0]]);
        let factors = [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(|t| table.factor(t, 0.1));
        assert_eq!(factors, [0.0, 0.0, 2.0, 4.0, 3.0, 2.0, 2.0]);
        let external = External {
            parts: vec![
                Part { forces: vec![1.0, 2.0], history: table },
                Part { forces: weight(&[3.0, 3.0], |i| i, [0.0, -10.0, 0.0]), history: History::Constant },
            ],
        };
        let mut forces = [f64::NAN; 2];
        external.at(3.0, 0.1, &mut forces);
        assert_eq!(forces, [3.0, -24.0]);
    }
}
