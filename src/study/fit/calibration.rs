//! What a calibration found: the rows of its sweep and the network of the best one.

use std::sync::Arc;

use crate::calibration::adaptive::Rung;
use crate::calibration::errors::Errors;
use crate::calibration::objective::Counts;
use crate::calibration::optimiser::Outcome;
use crate::readable::significant;
use crate::sparse::condition::Accuracy;
use crate::springs::grouping::Grouping;
use crate::study::network;

/// What a calibration found.
pub struct Calibration {
    /// One row for each gamma (one in all when the grouping does not use gamma).
    pub sweep: Vec<Row>,
    /// Index of the best row.
    pub best: usize,
    /// The groups of the best row.
    pub grouping: Grouping,
    /// Their stiffness phi, in the unit of the profile: N/m unless the scene says otherwise.
    pub phi: Vec<f64>,
    /// Their upper bounds, like phi.
    pub upper: Vec<f64>,
    /// For every group whether the fit determines its stiffness; the others have a stated one
    /// ([`crate::calibration::linear::complete`]).
    pub determined: Vec<bool>,
    /// Why it does not determine them: a word for each reason.
    pub left_out: Vec<String>,
    /// Stiffness k_s of every spring, N/m, its multiplicity included.
    pub stiffness: Vec<f64>,
    /// Displacements of the network, one vector over the free dofs for each load case, m.
    pub displacements: Vec<Vec<f64>>,
    /// How sure they are, the worst of all; none under large displacements, where they balance forces instead.
    pub accuracy: Option<Accuracy>,
    /// Errors of each load case, percent.
    pub errors: Vec<Errors>,
    /// Errors over the fitted cases, percent.
    pub fitted: Errors,
    /// What the matrices leave to tell; only for the matrix objective.
    pub matrices: Option<Matrices>,
    /// Global strain (4.17) of the continuum and of the network under each load case, percent.
    pub global_strain: Vec<[f64; 2]>,
    /// Work of the whole sweep.
    pub counts: Counts,
    /// The networks on the way, where the groups adapt; otherwise empty.
    pub ladder: Vec<Rung>,
}

impl Calibration {
    /// The largest global strain of the continuum and of the network under any load case, percent.
    pub fn largest_strain(&self) -> [f64; 2] {
        [0, 1].map(|body| self.global_strain.iter().fold(0.0, |most: f64, strain| most.max(strain[body])))
    }

    /// Keeps only some springs, and the groups that still have some.
    ///
    /// # Panics
    /// When there is not one word for every spring.
    pub fn retain(&mut self, kept: &[bool]) {
        network::retain(&mut self.stiffness, kept);
        network::retain(&mut self.grouping.group_of, kept);
        let mut counts = vec![0; self.grouping.groups.len()];
        self.grouping.group_of.iter().for_each(|&group| counts[group as usize] += 1);
        let filled: Vec<bool> = counts.iter().map(|&count| count > 0).collect();
        let before = |group: usize| filled[..group].iter().filter(|filled| **filled).count() as u32;
        let numbers: Vec<u32> = (0..filled.len()).map(before).collect();
        self.grouping.group_of.iter_mut().for_each(|group| *group = numbers[*group as usize]);
        self.grouping.groups.iter_mut().zip(counts).for_each(|(group, count)| group.springs = count);
        network::retain(&mut self.grouping.groups, &filled);
        network::retain(&mut self.phi, &filled);
        network::retain(&mut self.upper, &filled);
        network::retain(&mut self.determined, &filled);
    }

    /// A word where the bounds, not the optimiser, decide: every group is at its upper bound.
    pub fn warning(&self) -> Option<String> {
        let at_bound = |(phi, upper): (&f64, &f64)| *phi >= (1.0 - 1e-9) * upper;
        self.phi.iter().zip(&self.upper).all(at_bound).then(|| {
            format!(
                "every group is at its upper bound (5.8): the network cannot be as stiff as the body (e_rms {} %); \
                 use cells of more equal sides",
                significant(self.fitted.e_rms, 3)
            )
        })
    }
}

/// What the matrix objective compares, and what no spring can answer for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matrices {
    /// |K_ref|_F over the blocks that the reading compares, N/m.
    pub compared_frobenius: f64,
    /// The part of them between nodes that no spring joins, percent of `compared_frobenius`.
    pub outside_pattern: f64,
}

/// One row of the sweep table.
pub struct Row {
    /// gamma, if the grouping uses it.
    pub gamma: Option<f64>,
    /// Number of groups.
    pub groups: usize,
    /// Index of the row that solved this problem: its own, or an earlier one with equal groups.
    pub solved_by: usize,
    /// Errors over the fitted cases, percent.
    pub errors: Errors,
    /// Relative difference of the optimiser's error and the one that the direct solve confirms; none where the
    /// optimiser made another error small than that of the displacements.
    pub error_difference: Option<f64>,
    /// Seconds of the fit.
    pub seconds: f64,
    /// What the optimiser found.
    pub outcome: Arc<Outcome>,
}
