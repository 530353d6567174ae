//! How far a calibrated network can be trusted on loads that are not in the scene: both sides of its error.
//!
//! A network that fits its loads is too soft for some others and too stiff for others. The compliance ratios of
//! [`crate::calibration::compliance_ratios`] bound both over all smooth loads; each side comes with the load that it is found
//! under. Where the scene holds no load case out, generated ones take their place ([`super::other_loads`]).

use serde::Serialize;

use crate::calibration::compliance_ratios::{self, Extreme};
use crate::calibration::errors;
use crate::calibration::sweep;
use crate::error::{Error, Result};
use crate::springs::solver::SpringSolver;

use super::fit::{Calibration, Given};
use super::near_mechanism::{Moving, NEARLY};
use super::network;
use super::other_loads::OtherLoads;

/// A load is named by the fields that make up this part of its square, the largest first, three at most.
const NAMED: f64 = 0.8;
const NAMES: usize = 3;

/// What a network does under other loads, or why nobody looked.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Generalisation {
    /// It was measured.
    Measured(Box<Measured>),
    /// The network has no accurate answer to some of the loads: it gives way without end.
    Mechanism {
        /// True.
        near_mechanism: bool,
    },
    /// It was not looked for.
    NotLookedFor {
        /// Why.
        not_looked_for: &'static str,
    },
}

/// What was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// Independent force fields whose combinations were tried.
    pub fields: usize,
    /// Where the network is softest beside the continuum: the largest compliance ratio.
    pub softest: Side,
    /// Where it is stiffest: the smallest.
    pub stiffest: Side,
    /// The largest ratio under the loads that are linear in the place alone.
    pub softest_linear: f64,
    /// True when the network is nearly a mechanism: so soft under a linear load.
    pub near_mechanism: bool,
    /// What moves under the load of the softest side.
    pub moving: Moving,
    /// Errors under generated load cases, percent; none where the scene holds a case out itself.
    pub held_out: Vec<Case>,
}

/// One side, and the load that it is found under.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Side {
    /// Work of the load on the network over its work on the continuum.
    pub compliance_ratio: f64,
    /// The load in words: the fields that it mostly lies along.
    pub load: String,
    /// The load as a sum of force fields.
    pub terms: Vec<Term>,
}

/// A force field of a load.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// Its name ([`crate::reference::polynomial_loads`]).
    pub field: String,
    /// How often it is in the load, N; the root mean square of the forces is 1 N.
    pub coefficient: f64,
    /// Part of the square of the load along what the field adds to those before it.
    pub share: f64,
}

/// The errors under a generated load case, percent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// Its name.
    pub load: String,
    /// (4.20)
    pub e_rms: f64,
    /// (4.21)
    pub e_max: f64,
}

/// Measures a calibrated network under other loads, under which the continuum moves by `answers` (m, one after the other).
///
/// # Errors
/// Those of a factorisation of K(phi) that has been made before.
pub fn measure(
    given: Given,
    found: &Calibration,
    others: std::result::Result<&OtherLoads, &'static str>,
    answers: &[f64],
) -> Result<Generalisation> {
    let others = match others {
        Ok(others) => others,
        Err(not_looked_for) => return Ok(Generalisation::NotLookedFor { not_looked_for }),
    };
    let operator = given.operator(&found.grouping);
    let settings = sweep::exact(&operator, &network::settings(given.scene));
    let mut solver = SpringSolver::new(&operator, &settings);
    solver.set(&found.phi)?;
    match under(given, others, answers, &mut solver, settings.tolerance) {
        Err(Error::Inaccurate { .. } | Error::NotPositiveDefinite { .. }) => {
            Ok(Generalisation::Mechanism { near_mechanism: true })
        }
        Ok(None) => Ok(Generalisation::NotLookedFor { not_looked_for: "no smooth load moves the continuum" }),
        Ok(Some(measured)) => Ok(Generalisation::Measured(Box::new(measured))),
        Err(other) => Err(other),
    }
}

fn under(
    given: Given,
    others: &OtherLoads,
    answers: &[f64],
    solver: &mut SpringSolver,
    tolerance: f64,
) -> Result<Option<Measured>> {
    let (basis, body) = (&others.basis, given.body);
    let (smooth, of_cases) = answers.split_at(basis.forces.len());
    let Some(extremes) = compliance_ratios::extremes(solver, basis, smooth, others.linear)? else { return Ok(None) };
    let mut moved = vec![0.0; of_cases.len()];
    solver.solve(&others.forces[basis.forces.len()..], &mut moved, tolerance)?;
    let n = body.dofs.len();
    let pairs = of_cases.chunks_exact(n).zip(moved.chunks_exact(n));
    let held_out = others.cases.iter().zip(pairs).map(|(case, (reference, u))| {
        let errors = errors::errors(&body.dofs, reference, u);
        Case { load: case.name.clone(), e_rms: errors.e_rms, e_max: errors.e_max }
    });
    Ok(Some(Measured {
        fields: basis.kept.len(),
        softest_linear: extremes.softest_of_first,
        near_mechanism: extremes.softest_of_first > NEARLY,
        moving: Moving::of(body, &extremes.softest.motion),
        held_out: held_out.collect(),
        softest: Side::of(others, extremes.softest),
        stiffest: Side::of(others, extremes.stiffest),
    }))
}

impl Side {
    fn of(others: &OtherLoads, extreme: Extreme) -> Self {
        let share = |i: usize| others.basis.kept.iter().position(|&kept| kept == i).map_or(0.0, |j| extreme.shares[j]);
        let fields = others.fields.iter().zip(extreme.coefficients).enumerate();
        let terms: Vec<Term> = fields
            .map(|(i, (field, coefficient))| Term { field: field.clone(), coefficient, share: share(i) })
            .collect();
        Self { compliance_ratio: extreme.ratio, load: words(&terms), terms }
    }
}

/// The fields that a load mostly lies along, with their shares.
fn words(terms: &[Term]) -> String {
    let mut order: Vec<&Term> = terms.iter().collect();
    // shares to six digits, so that equal ones keep the order of the fields
    order.sort_by_key(|term| std::cmp::Reverse((1e6 * term.share).round() as u64));
    let mut left = NAMED;
    let named = order.into_iter().take(NAMES).take_while(|term| {
        let first = left > 0.0;
        left -= term.share;
        first
    });
    named.map(|term| format!("{} ({:.0} %)", term.field, 100.0 * term.share)).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_is_named_by_its_largest_shares_and_equal_ones_in_the_order_of_the_fields() {
        let term = |(field, share): (&str, f64)| Term { field: field.into(), coefficient: 1.0, share };
        let named = |shares: &[(&str, f64)]| words(&shares.iter().copied().map(term).collect::<Vec<_>>());
        assert_eq!(named(&[("a", 0.1), ("b", 0.9)]), "b (90 %)");
        assert_eq!(named(&[("a", 0.5 - 1e-12), ("b", 0.5)]), "a (50 %), b (50 %)");
        assert_eq!(named(&[("a", 0.25); 4]), "a (25 %), a (25 %), a (25 %)");
    }
}
