//! The displacement objective (5.7) on groups that change while it works.

use std::borrow::Cow;

use crate::calibration::objective::Counts;
use crate::error::{Error, Result};
use crate::sparse::vectors::{dot, scale, square_of_difference};
use crate::springs::members::Members;
use crate::springs::solver::{Settings, SpringOperator, SpringSolver};

/// What a ladder is climbed on.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// The springs, each a group of its own, with w_s = c_s times the profile.
    pub operator: &'a SpringOperator<'a>,
    pub forces: &'a [f64],
    pub reference: &'a [f64],
    pub weights: &'a [f64],
    /// Largest number of every spring.
    pub upper: &'a [f64],
    pub features: &'a [Vec<f64>],
}

/// A network that has been solved: one factor and what came of it.
struct State<'a> {
    solver: SpringSolver<'a>,
    phi: Vec<f64>,
    /// K(phi) is this times the matrix that `solver` holds.
    scale: f64,
    displacement: Vec<f64>,
    error: f64,
}

pub struct Worker<'a> {
    pub ground: Ground<'a>,
    members: Cow<'a, Members>,
    tolerance: f64,
    pub groups: Vec<Vec<u32>>,
    /// Where the ladder stands.
    here: State<'a>,
    /// Where it tries to go.
    there: State<'a>,
    /// Number of every spring.
    values: Vec<f64>,
    /// Elongations of the springs here, case after case.
    elongations: Vec<f64>,
    counts: Counts,
}

const COLUMN_TOLERANCE: f64 = 1e-6;

impl<'a> Worker<'a> {
    pub fn new(ground: Ground<'a>, settings: &Settings, groups: Vec<Vec<u32>>) -> Self {
        let members = ground.operator.members();
        let springs = members.len();
        let state = || State {
            solver: SpringSolver::new(ground.operator, settings),
            phi: vec![0.0; groups.len()],
            scale: 1.0,
            displacement: vec![0.0; ground.forces.len()],
            error: f64::INFINITY,
        };
        Self {
            here: state(),
            there: state(),
            tolerance: settings.tolerance,
            groups,
            values: vec![0.0; springs],
            elongations: vec![0.0; springs * ground.weights.len()],
            counts: Counts::default(),
            members,
            ground,
        }
    }

    pub fn unknowns(&self) -> usize {
        self.here.solver.unknowns()
    }

    pub fn springs(&self) -> usize {
        self.members.len()
    }

    pub fn phi(&self) -> &[f64] {
        &self.here.phi
    }

    pub fn error(&self) -> f64 {
        self.here.error
    }

    pub fn counts(&self) -> Counts {
        let mut work = self.here.solver.work();
        work += self.there.solver.work();
        self.counts.with(work)
    }

    pub fn upper_of(&self, group: &[u32]) -> f64 {
        group.iter().fold(0.0, |a: f64, &s| a.max(self.ground.upper[s as usize]))
    }

    pub fn upper(&self) -> Vec<f64> {
        self.groups.iter().map(|group| self.upper_of(group)).collect()
    }

    /// The error at phi with the best common factor; infinite where K is not positive definite.
    pub fn attempt(&mut self, phi: &[f64]) -> Result<f64> {
        self.counts.evaluations += 1;
        for (group, phi) in self.groups.iter().zip(phi) {
            group.iter().for_each(|&s| self.values[s as usize] = *phi);
        }
        let upper = self.upper();
        let there = &mut self.there;
        there.phi = phi.to_vec();
        there.scale = 1.0;
        there.error = f64::INFINITY;
        // a path that iterates begins with the displacements from here
        there.displacement.copy_from_slice(&self.here.displacement);
        let set = there.solver.set(&self.values);
        match set.and_then(|()| there.solver.solve(self.ground.forces, &mut there.displacement, self.tolerance)) {
            Ok(()) => {}
            Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => {
                self.counts.rejected += 1;
                return Ok(f64::INFINITY);
            }
            Err(other) => return Err(other),
        }
        self.counts.solves += self.ground.weights.len() as u64;
        there.fit_scale(&self.ground, &upper);
        Ok(there.error)
    }

    /// Takes the last attempt as the place to stand.
    pub fn accept(&mut self) {
        std::mem::swap(&mut self.here, &mut self.there);
    }

    /// Elongations of the displacements of all cases.
    pub fn elongate(&mut self) {
        let (n, springs) = (self.unknowns(), self.springs());
        for (u, out) in self.here.displacement.chunks_exact(n).zip(self.elongations.chunks_exact_mut(springs)) {
            self.members.elongations(u, out);
        }
    }

    /// Columns of the Jacobian of sets of springs, each moved by one common number, here.
    pub fn columns(&mut self, sets: &[&[u32]]) -> Result<Vec<f64>> {
        let (n, cases) = (self.unknowns(), self.ground.weights.len());
        let springs = self.springs();
        let mut right = vec![0.0; sets.len() * cases * n];
        for (set, right) in sets.iter().zip(right.chunks_exact_mut(cases * n)) {
            for (tensions, right) in self.elongations.chunks_exact(springs).zip(right.chunks_exact_mut(n)) {
                self.members.pull(set, tensions, right);
            }
        }
        let mut solved = vec![0.0; right.len()];
        self.here.solver.solve(&right, &mut solved, self.tolerance.max(COLUMN_TOLERANCE))?;
        self.counts.solves += (sets.len() * cases) as u64;
        for column in solved.chunks_exact_mut(cases * n) {
            for (part, w) in column.chunks_exact_mut(n).zip(self.ground.weights) {
                part.iter_mut().for_each(|x| *x *= -w / self.here.scale);
            }
        }
        Ok(solved)
    }

    /// J^T z of every spring moved by itself, for vectors z of the residual space (rows each): springs numbers each.
    pub fn pulled_back(&mut self, vectors: &[f64]) -> Result<Vec<f64>> {
        let (n, springs) = (self.unknowns(), self.springs());
        let rows = n * self.ground.weights.len();
        let count = vectors.len() / rows;
        let mut adjoint = vec![0.0; vectors.len()];
        self.here.solver.solve(vectors, &mut adjoint, self.tolerance.max(COLUMN_TOLERANCE))?;
        self.counts.solves += (count * self.ground.weights.len()) as u64;
        let mut out = vec![0.0; count * springs];
        let mut one = vec![0.0; springs];
        for (adjoint, out) in adjoint.chunks_exact(rows).zip(out.chunks_exact_mut(springs)) {
            for (c, lambda) in adjoint.chunks_exact(n).enumerate() {
                self.members.elongations(lambda, &mut one);
                let elongations = &self.elongations[c * springs..(c + 1) * springs];
                let w = -self.ground.weights[c] / self.here.scale;
                for ((out, a), b) in out.iter_mut().zip(&one).zip(elongations) {
                    *out += w * a * b;
                }
            }
        }
        Ok(out)
    }

    /// Residual and Jacobian here.
    pub fn linearise(&mut self) -> Result<(Vec<f64>, Vec<f64>)> {
        self.elongate();
        let groups = std::mem::take(&mut self.groups);
        let sets: Vec<&[u32]> = groups.iter().map(Vec::as_slice).collect();
        let columns = self.columns(&sets);
        self.groups = groups;
        Ok((self.residual(), columns?))
    }

    fn residual(&self) -> Vec<f64> {
        let n = self.unknowns();
        let mut residual = Vec::with_capacity(self.here.displacement.len());
        for (case, w) in self.ground.weights.iter().enumerate() {
            let range = case * n..(case + 1) * n;
            residual.extend(self.here.displacement[range.clone()].iter().zip(&self.ground.reference[range]).map(|(u, r)| w * (u - r)));
        }
        residual
    }
}

impl State<'_> {
    fn fit_scale(&mut self, ground: &Ground, upper: &[f64]) {
        let n = self.solver.unknowns();
        let (mut with_reference, mut with_itself) = (0.0, 0.0);
        let cases = self.displacement.chunks_exact(n).zip(ground.reference.chunks_exact(n));
        for ((u, reference), w) in cases.zip(ground.weights) {
            with_reference += w * w * dot(u, reference);
            with_itself += w * w * dot(u, u);
        }
        let largest = self.phi.iter().zip(upper).fold(f64::INFINITY, |s, (p, u)| s.min(u / p));
        let best = if with_reference > 0.0 { (with_itself / with_reference).min(largest) } else { 1.0 };
        for (p, upper) in self.phi.iter_mut().zip(upper) {
            *p = (*p * best).min(*upper);
        }
        scale(1.0 / best, &mut self.displacement);
        self.scale *= best;
        let cases = self.displacement.chunks_exact(n).zip(ground.reference.chunks_exact(n));
        let squares = cases.zip(ground.weights).map(|((u, reference), w)| w * w * square_of_difference(u, reference));
        self.error = squares.sum::<f64>().sqrt();
    }
}
