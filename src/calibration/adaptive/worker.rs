//! A network whose groups change while it is fitted: displacements, columns of the Jacobian, and its transpose.
//!
//! Every spring is a group of its own in K(k) = sum_s k_s w_s b_s b_s^T, so that a split changes numbers and nothing else.
//! With the residual r of [`crate::calibration::objectives::displacement`], r_c = w_c (u_c - u_ref,c) for each load case c,
//! the derivative by the number of one spring is
//!
//! ```text
//! dr_c/dk_s = -w_c K^-1 b_s w_s (b_s . u_c)
//! ```
//!
//! A set of springs that moves together has the sum of these as its column: one solve a case. The transpose needs no
//! column: for any z in the space of the residuals and lambda_c = K^-1 z_c
//!
//! ```text
//! z^T dr/dk_s = - sum_c w_c w_s (b_s . lambda_c) (b_s . u_c)
//! ```
//!
//! for all springs at once, one solve a case; with z = r it is half the gradient of the squared error. The same lambda with the columns
//! at hand gives what the residual adds to the second derivative, without a further solve ([`Curvature`]; J_b,c is column b
//! in the rows of case c):
//!
//! ```text
//! S_ab = T_ab + T_ba,    T_ab = - sum_c sum over s in a of w_s (b_s . lambda_c) (b_s . J_b,c),     lambda_c = K^-1 r_c
//! ```
//!
//! Two networks are kept, the
//! one that stands and the one that is tried, each with its factor: going back costs nothing.

use std::borrow::Cow;

use crate::calibration::objective::Counts;
use crate::calibration::optimisers::descent::Curvature;
use crate::calibration::prior::Prior;
use crate::clock::Interrupt;
use crate::error::{Error, Result};
use crate::sparse::vectors::{dot, scale};
use crate::springs::members::Members;
use crate::springs::solver::{Settings, SpringOperator};

use super::part::Part;
use super::state::{Cases, State};

/// Relative residual that is enough for columns and their transpose on a path that iterates.
const COLUMN_TOLERANCE: f64 = 1e-6;

/// What a ladder is climbed on.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// The springs, each a group of its own, with w_s as its coefficient.
    pub operator: &'a SpringOperator<'a>,
    /// The cases that are fitted.
    pub fitted: Cases<'a>,
    /// The cases that are not; may be none.
    pub held_out: Cases<'a>,
    /// The largest number of every spring (5.8), in the unit of phi.
    pub bounds: &'a [f64],
    /// The features of all springs: [`super::features::table`].
    pub features: &'a [Vec<f64>],
    /// How far two values of each feature are one: [`super::features::resolutions`].
    pub resolutions: &'a [f64],
    /// The names of the free degrees of freedom for probes: [`super::places::places`].
    pub places: &'a [u64],
}

/// The network that stands, the one that is tried, and the groups of both.
pub struct Worker<'a> {
    /// What it works on.
    pub ground: Ground<'a>,
    /// The groups.
    pub parts: Vec<Part>,
    members: Cow<'a, Members>,
    settings: Settings,
    interrupt: Interrupt,
    here: State<'a>,
    there: State<'a>,
    /// Number of every spring.
    numbers: Vec<f64>,
    /// Elongations sqrt(w_s) b_s . u_c of the network that stands, case after case.
    elongations: Vec<f64>,
    counts: Counts,
}

impl<'a> Worker<'a> {
    /// A worker that has not solved anything yet.
    pub fn new(ground: Ground<'a>, settings: &Settings, parts: Vec<Part>, interrupt: &Interrupt) -> Self {
        let members = ground.operator.members();
        let springs = members.len();
        Self {
            here: State::new(&ground, settings, interrupt),
            there: State::new(&ground, settings, interrupt),
            settings: *settings,
            interrupt: interrupt.clone(),
            numbers: vec![0.0; springs],
            elongations: vec![0.0; springs * ground.fitted.weights.len()],
            counts: Counts::default(),
            parts,
            members,
            ground,
        }
    }

    /// Goes where a worker stood that was left after [`Worker::settle`] with these groups: `phi` and `counts` are its.
    ///
    /// # Errors
    /// As [`Worker::settle`].
    pub fn stand(&mut self, phi: &[f64], counts: Counts) -> Result<()> {
        self.go(phi)?;
        self.rest()?;
        self.counts = counts;
        Ok(())
    }

    /// Forgets all but the groups and their numbers, so that what follows is a function of these alone: on a path
    /// that remembers earlier systems they are solved anew. Returns the error over the held-out cases.
    ///
    /// # Errors
    /// Where a solve is not accurate; on interruption.
    pub fn settle(&mut self) -> Result<Option<f64>> {
        if self.here.solver.remembers() {
            self.collect();
            let phi = std::mem::take(&mut self.here.phi);
            let fresh = || State::new(&self.ground, &self.settings, &self.interrupt);
            (self.here, self.there) = (fresh(), fresh());
            self.go(&phi)?;
        }
        self.rest()
    }

    /// Solves the network of these numbers and makes it the one that stands.
    fn go(&mut self, phi: &[f64]) -> Result<()> {
        if !self.attempt(phi)?.is_finite() {
            return Err(Error::Inaccurate { backward_error: f64::NAN, limit: self.settings.tolerance });
        }
        self.accept();
        Ok(())
    }

    /// The last solves on a rung.
    fn rest(&mut self) -> Result<Option<f64>> {
        let held_out = self.held_out_error()?;
        self.collect();
        Ok(held_out)
    }

    /// Takes over the counts of the solvers, which decide by them how to go on.
    fn collect(&mut self) {
        let mut work = self.here.solver.take_work();
        work += self.there.solver.take_work();
        self.counts += Counts::default().with(work);
    }

    /// The numbers of the groups of the network that stands.
    pub fn phi(&self) -> &[f64] {
        &self.here.phi
    }

    /// Its error over the fitted cases, percent.
    pub fn error(&self) -> f64 {
        self.here.error
    }

    /// Its error over the held-out cases, percent; none where there are none.
    ///
    /// # Errors
    /// Where a solve is not accurate.
    fn held_out_error(&mut self) -> Result<Option<f64>> {
        let cases = self.ground.held_out;
        if cases.weights.is_empty() {
            return Ok(None);
        }
        let mut displacement = vec![0.0; cases.forces.len()];
        self.here.solver.solve(cases.forces, &mut displacement, self.settings.tolerance)?;
        self.counts.solves += cases.weights.len() as u64;
        Ok(Some(cases.error(&displacement)))
    }

    /// Upper bounds of the groups.
    pub fn upper(&self) -> Vec<f64> {
        self.parts.iter().map(|part| part.upper).collect()
    }

    /// Work so far.
    pub fn counts(&self) -> Counts {
        let mut work = self.here.solver.work();
        work += self.there.solver.work();
        let mut counts = self.counts;
        counts += Counts::default().with(work);
        counts
    }

    fn rows(&self) -> usize {
        self.ground.fitted.forces.len()
    }

    fn unknowns(&self) -> usize {
        self.here.solver.unknowns()
    }

    /// A prior on the groups as they are.
    pub fn prior(&self, strength: f64, linear_below: f64) -> Prior {
        let springs: Vec<usize> = self.parts.iter().map(|part| part.springs.len()).collect();
        Prior::of_sizes(strength, linear_below, &springs)
    }

    /// The network that was tried last with its numbers times their best common factor.
    pub fn tried_scaled(&self) -> Vec<f64> {
        self.there.scaled(&self.ground.fitted, &self.parts)
    }

    /// The error at phi; infinite where K is not positive definite.
    ///
    /// # Errors
    /// On interruption.
    pub fn attempt(&mut self, phi: &[f64]) -> Result<f64> {
        for (part, phi) in self.parts.iter().zip(phi) {
            part.springs.iter().for_each(|&s| self.numbers[s as usize] = *phi);
        }
        self.counts.evaluations += 1;
        let there = &mut self.there;
        there.phi = phi.to_vec();
        there.error = f64::INFINITY;
        // where a path that iterates begins
        there.displacement.copy_from_slice(&self.here.displacement);
        let set = there.solver.set(&self.numbers);
        let forces = self.ground.fitted.forces;
        match set.and_then(|()| there.solver.solve(forces, &mut there.displacement, self.settings.tolerance)) {
            Ok(()) => {}
            Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => {
                self.counts.rejected += 1;
                return Ok(f64::INFINITY);
            }
            Err(other) => return Err(other),
        }
        self.counts.solves += self.ground.fitted.weights.len() as u64;
        there.error = self.ground.fitted.error(&there.displacement);
        Ok(there.error)
    }

    /// Makes the network that was tried the one that stands.
    pub fn accept(&mut self) {
        std::mem::swap(&mut self.here, &mut self.there);
    }

    /// Residual and Jacobian (rows x groups, column-major) of the network that stands.
    ///
    /// # Errors
    /// Where a solve is not accurate.
    pub fn linearise(&mut self) -> Result<(Vec<f64>, Vec<f64>)> {
        let (n, springs) = (self.unknowns(), self.members.len());
        for (u, out) in self.here.displacement.chunks_exact(n).zip(self.elongations.chunks_exact_mut(springs)) {
            self.members.elongations(u, out);
        }
        let parts = std::mem::take(&mut self.parts);
        let sets: Vec<&[u32]> = parts.iter().map(|part| part.springs.as_slice()).collect();
        let columns = self.columns(&sets);
        self.parts = parts;
        Ok((self.residual(), columns?))
    }

    fn residual(&self) -> Vec<f64> {
        let Cases { reference, weights, .. } = self.ground.fitted;
        let n = self.unknowns();
        let cases = self.here.displacement.chunks_exact(n).zip(reference.chunks_exact(n)).zip(weights);
        cases.flat_map(|((u, reference), w)| u.iter().zip(reference).map(move |(u, r)| w * (u - r))).collect()
    }

    /// Columns (rows each) of sets of springs that move together, at the last [`Worker::linearise`].
    ///
    /// # Errors
    /// Where a solve is not accurate.
    pub fn columns(&mut self, sets: &[&[u32]]) -> Result<Vec<f64>> {
        let (n, rows, springs) = (self.unknowns(), self.rows(), self.members.len());
        let mut right = vec![0.0; sets.len() * rows];
        for (set, right) in sets.iter().zip(right.chunks_exact_mut(rows)) {
            for (tensions, right) in self.elongations.chunks_exact(springs).zip(right.chunks_exact_mut(n)) {
                self.members.pull(set, tensions, right);
            }
        }
        let mut columns = vec![0.0; right.len()];
        self.here.solver.solve(&right, &mut columns, self.settings.tolerance.max(COLUMN_TOLERANCE))?;
        self.counts.solves += (right.len() / n) as u64;
        for column in columns.chunks_exact_mut(rows) {
            for (part, w) in column.chunks_exact_mut(n).zip(self.ground.fitted.weights) {
                scale(-w, part);
            }
        }
        Ok(columns)
    }

    /// z^T dr/dk_s of every spring for each of some vectors z (rows each), at the last [`Worker::linearise`]; the numbers
    /// of one spring stand together (springs x vectors).
    ///
    /// # Errors
    /// Where a solve is not accurate.
    pub fn transposed(&mut self, vectors: &[f64]) -> Result<Vec<f64>> {
        let (n, rows, springs) = (self.unknowns(), self.rows(), self.members.len());
        let count = vectors.len() / rows;
        let mut adjoint = vec![0.0; vectors.len()];
        self.here.solver.solve(vectors, &mut adjoint, self.settings.tolerance.max(COLUMN_TOLERANCE))?;
        self.counts.solves += (vectors.len() / n) as u64;
        let mut products = vec![0.0; count * springs];
        let mut stretched = vec![0.0; springs];
        for (i, adjoint) in adjoint.chunks_exact(rows).enumerate() {
            let cases = adjoint.chunks_exact(n).zip(self.elongations.chunks_exact(springs));
            for ((lambda, elongations), w) in cases.zip(self.ground.fitted.weights) {
                self.members.elongations(lambda, &mut stretched);
                for (s, (a, b)) in stretched.iter().zip(elongations).enumerate() {
                    products[s * count + i] -= w * a * b;
                }
            }
        }
        Ok(products)
    }

    /// What the residual adds to the second derivative, at the last [`Worker::linearise`] that gave these.
    ///
    /// # Errors
    /// Where a solve is not accurate.
    pub fn curvature(&mut self, residual: &[f64], jacobian: &[f64]) -> Result<Curvature> {
        let (n, rows, m) = (self.unknowns(), residual.len(), self.parts.len());
        let mut adjoint = vec![0.0; rows];
        self.here.solver.solve(residual, &mut adjoint, self.settings.tolerance.max(COLUMN_TOLERANCE))?;
        self.counts.solves += (rows / n) as u64;
        let (mut second, mut gradient) = (vec![0.0; m * m], vec![0.0; m]);
        let mut stretched = [vec![0.0; self.members.len()], vec![0.0; self.members.len()]];
        let [of_adjoint, of_column] = &mut stretched;
        for (case, lambda) in adjoint.chunks_exact(n).enumerate() {
            self.members.elongations(lambda, of_adjoint);
            for (b, column) in jacobian.chunks_exact(rows).enumerate() {
                self.members.elongations(&column[case * n..(case + 1) * n], of_column);
                for (a, part) in self.parts.iter().enumerate() {
                    let product = |&s: &u32| of_adjoint[s as usize] * of_column[s as usize];
                    let of_part: f64 = part.springs.iter().map(product).sum();
                    second[a * m + b] -= of_part;
                    second[b * m + a] -= of_part;
                }
            }
        }
        for (slope, column) in gradient.iter_mut().zip(jacobian.chunks_exact(rows)) {
            *slope = dot(column, residual);
        }
        Ok(Curvature { second, gradient })
    }
}
