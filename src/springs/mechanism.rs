//! Networks that move without resistance.
//!
//! A spring resists along its direction only, so a network may be loose though every node has springs: squares without
//! diagonals, a single row, a flat sheet in space. Springs with k = 0 are not there. The zero modes of K are counted before
//! anything is solved ([`crate::sparse::zero_modes`]), on the network whose springs all have the same stiffness:
//! whether it moves without resistance does not depend on how stiff its springs are, only on which there are.

use std::sync::Arc;

use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::geometry::loose::mechanism;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::zero_modes::{ZeroModes, zero_modes};

use super::affine::AffineStiffness;
use super::grouping::{Group, Grouping};
use super::network::Network;

/// The zero modes of a network; `present` says which springs are there.
///
/// # Panics
/// When `present` has not one entry for every spring, or the analysis does not contain their pattern.
pub fn count(network: &Network, present: &[bool], dofs: &DofMap, symbolic: &Arc<Symbolic>) -> ZeroModes {
    let mut values = vec![0.0; symbolic.lower_rows().len()];
    equal_springs(network, present, dofs, symbolic).assemble_into(&[1.0], &mut values);
    zero_modes(symbolic, &values)
}

/// Checks that a network resists every motion; `what` names it in the error.
///
/// # Errors
/// [`crate::error::Error::Mechanism`] with the number of zero modes, a loose node of each and its direction.
///
/// # Panics
/// As [`count`].
pub fn check(what: &str, network: &Network, present: &[bool], dofs: &DofMap, symbolic: &Arc<Symbolic>) -> Result<()> {
    let mut factor = Factor::new(Arc::clone(symbolic));
    equal_springs(network, present, dofs, symbolic).assemble_into(&[1.0], factor.values_mut());
    match factor.refactor_or_count()? {
        None => Ok(()),
        Some(modes) => Err(mechanism(what, &modes, dofs)),
    }
}

/// Checks a network whose groups with phi = 0 are not there.
///
/// # Errors
/// As [`check`].
///
/// # Panics
/// When there is not one number for every group.
pub fn of_groups(
    what: &str,
    stiffness: &AffineStiffness,
    phi: &[f64],
    dofs: &DofMap,
    symbolic: &Arc<Symbolic>,
) -> Result<()> {
    let present: Vec<f64> = phi.iter().map(|&phi| f64::from(u8::from(phi > 0.0))).collect();
    let mut values = vec![0.0; symbolic.lower_rows().len()];
    stiffness.assemble_into(&present, &mut values);
    let modes = zero_modes(symbolic, &values);
    if modes.count == 0 { Ok(()) } else { Err(mechanism(what, &modes, dofs)) }
}

/// K of the springs that are there, all with k = 1 N/m.
fn equal_springs(network: &Network, present: &[bool], dofs: &DofMap, symbolic: &Symbolic) -> AffineStiffness {
    let springs = network.springs.len();
    let group = Group { name: "all".into(), springs, length: 1.0 };
    let grouping = Grouping { group_of: vec![0; springs], groups: vec![group] };
    let coefficients: Vec<f64> = present.iter().map(|&there| f64::from(u8::from(there))).collect();
    AffineStiffness::new(network, &grouping, &coefficients, dofs, symbolic)
}
