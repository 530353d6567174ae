//! May the run start? Its memory and its time against what there is.
//!
//! Memory is compared three times, each time before what it would fill is allocated, with what `[limits]` allows and what
//! the machine has free, whichever is less:
//!
//! | when | estimate |
//! |---|---|
//! | before the body | the nodes of the grid, times what a node takes on the path that takes least |
//! | before a factor | the symbolic count of its entries |
//! | before the fit | the plan's estimate of all workers, with `limits.seconds` against its time |
//!
//! A mesh or patch from a file cannot be larger than its file, so it needs no estimate before it is read.

use crate::error::{Error, Result};
use crate::memory;
use crate::readable::significant;
use crate::scene::Scene;

/// Bytes of a node of the network, its springs, their solver and the reference on the path that takes least: measured as
/// 5.7 kB on cubes of 65 and 97 nodes an edge; in the plane the entries of the factor come on top.
const NODE_IN_SPACE: f64 = 5_000.0;
const NODE_IN_THE_PLANE: f64 = 1_500.0;

/// Bytes of a node in the factors of a plane grid for every doubling of the nodes: nested dissection stores about
/// 7.75 n log2 n entries of 2 x 2 numbers for n nodes (A. George, SIAM J. Numer. Anal. 10, 1973).
const FACTOR_IN_THE_PLANE: f64 = 7.75 * 4.0 * 8.0;

/// What a run may take, and who says so.
#[derive(Debug, Clone, PartialEq)]
pub struct Allowance {
    bytes: Option<u64>,
    reason: String,
}

impl Allowance {
    /// The allowance of a scene on this machine, now.
    ///
    /// # Errors
    /// [`Error::Input`] at `limits.memory` for a text that is no amount.
    pub fn of(scene: &Scene) -> Result<Self> {
        let limit = scene.limits.memory.as_ref().map(|memory| memory.bytes()).transpose()?;
        Ok(Self::least(limit, memory::available_bytes()))
    }

    fn least(limit: Option<u64>, free: Option<u64>) -> Self {
        match (limit, free) {
            (Some(limit), free) if free.is_none_or(|free| limit <= free) => {
                Self { bytes: Some(limit), reason: format!("limits.memory allows {}", amount(limit as f64)) }
            }
            (_, Some(free)) => {
                Self { bytes: Some(free), reason: format!("{} are free on this machine", amount(free as f64)) }
            }
            _ => Self { bytes: None, reason: String::new() },
        }
    }

    /// Refuses what does not fit; `what` says what the bytes are for.
    ///
    /// # Errors
    /// [`Error::OverLimit`] with the estimate and the limit.
    pub fn admit(&self, what: &str, bytes: f64) -> Result<()> {
        match self.bytes {
            Some(allowed) if bytes > allowed as f64 => Err(Error::OverLimit {
                estimate: format!("{} of memory ({what})", amount(bytes)),
                limit: self.reason.clone(),
                help:
                    "use fewer control points or groups, fewer threads, or raise limits.memory where that is the limit"
                        .into(),
            }),
            _ => Ok(()),
        }
    }
}

/// Refuses a grid that cannot fit, before anything of it is made.
///
/// # Errors
/// [`Error::OverLimit`]; [`Error::Input`] at `limits.memory`.
pub fn before_the_body(scene: &Scene) -> Result<()> {
    let geometry = &scene.geometry;
    let Some(shape) = geometry.known_shape() else { return Ok(()) };
    let counts = geometry.control_points.clone().unwrap_or_else(|| shape.default_control_points.to_vec());
    let mut nodes: f64 = counts.iter().map(|&count| count as f64).product();
    if let Some(finer) = &scene.converged {
        nodes *= 2.0_f64.powf((finer.halvings * shape.dimension) as f64);
    }
    let bytes = nodes
        * match shape.dimension {
            2 => NODE_IN_THE_PLANE + FACTOR_IN_THE_PLANE * nodes.log2(),
            _ => NODE_IN_SPACE,
        };
    Allowance::of(scene)?.admit(&format!("{nodes:.0} nodes, {counts:?}"), bytes)
}

/// Refuses a run that takes longer than `limits.seconds`.
///
/// # Errors
/// [`Error::OverLimit`] with both.
pub fn time(scene: &Scene, seconds: f64) -> Result<()> {
    match scene.limits.seconds {
        Some(limit) if seconds > limit => Err(Error::OverLimit {
            estimate: format!("{} s", significant(seconds, 3)),
            limit: format!("limits.seconds allows {limit} s"),
            help: "use fewer control points, groups or evaluations, or raise limits.seconds".into(),
        }),
        _ => Ok(()),
    }
}

/// Bytes with the unit that reads best.
fn amount(bytes: f64) -> String {
    let (size, unit) = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")]
        .into_iter()
        .find(|(size, _)| bytes >= *size)
        .unwrap_or((1.0, "B"));
    format!("{:.1} {unit}", bytes / size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smaller_of_limit_and_machine_counts_and_is_named() {
        let refused = |limit, free, bytes| Allowance::least(limit, free).admit("a factor", bytes).err();
        assert_eq!(refused(Some(4_000), Some(9_000), 3_999.0), None);
        assert_eq!(refused(None, None, 1e30), None);
        for (limit, free, words) in [
            (Some(4_000), Some(9_000), "limits.memory allows 4.0 kB"),
            (Some(4_000), None, "limits.memory allows 4.0 kB"),
            (Some(40_000), Some(5_000), "5.0 kB are free on this machine"),
            (None, Some(5_000_000_000), "5.0 GB are free on this machine"),
        ] {
            let error = refused(limit, free, 2e12).expect("too much").to_string();
            assert!(error.contains(words) && error.contains("2.0 TB of memory (a factor)"), "{error}");
        }
    }
}
