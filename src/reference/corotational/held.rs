//! A corotational body over its free degrees of freedom.
//!
//! Displacements u are over the free degrees of freedom; held components stay where they are at rest, or where they were
//! put ([`Held::hold`]).

use crate::error::Result;
use crate::geometry::dofs::{DofMap, FIXED};
use crate::reference::corotational::Tangent;
use crate::reference::corotational::body::Corotational;
use crate::reference::corotational::inversion::Inversion;
use crate::reference::corotational::matrix::TangentMatrix;
use crate::reference::material::Lame;
use crate::reference::methods::smoothed::Domains;
use crate::sparse::pattern::Pattern;

/// A body, its supports and its tangent matrix.
#[derive(Debug, Clone)]
pub struct Held {
    body: Corotational,
    matrix: TangentMatrix,
    dofs: DofMap,
    /// Place of every node where u = 0.
    start: Vec<[f64; 3]>,
    /// Present places; workspace of products.
    places: Vec<[f64; 3]>,
    forces: Vec<[f64; 3]>,
    rounding: f64,
}

impl Held {
    /// The body with the nodes at `positions` (m) at rest.
    ///
    /// # Errors
    /// Those of [`Corotational::new`].
    pub fn new(domains: Domains, positions: &[[f64; 3]], lame: Lame, dofs: DofMap) -> Result<Self> {
        let matrix = TangentMatrix::new(&domains, &dofs);
        let mut body = Corotational::new(domains, lame)?;
        body.place(positions);
        let (start, places) = (positions.to_vec(), positions.to_vec());
        let extent = positions.as_flattened().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let rounding = body.rounding(extent);
        Ok(Self { rounding, body, matrix, dofs, start, places, forces: vec![[0.0; 3]; positions.len()] })
    }

    /// Puts held components to the places given (m); the others are where u counts from, as before.
    ///
    /// # Panics
    /// When there is not one place for each node.
    pub fn hold(&mut self, places: &[[f64; 3]]) {
        assert_eq!(places.len(), self.start.len(), "one place for each node");
        for (node, place) in places.iter().enumerate() {
            let held = self.dofs.free(node).iter().enumerate().filter(|(_, dof)| **dof == FIXED);
            held.for_each(|(i, _)| self.start[node][i] = place[i]);
        }
    }

    /// The body.
    pub fn body(&self) -> &Corotational {
        &self.body
    }

    /// Its degrees of freedom.
    pub fn dofs(&self) -> &DofMap {
        &self.dofs
    }

    /// The entries that a tangent can have.
    pub fn pattern(&self) -> &Pattern {
        self.matrix.pattern()
    }

    /// Moves the body to the displacement u (m).
    pub fn place(&mut self, u: &[f64]) {
        self.places.copy_from_slice(&self.start);
        add_free(&self.dofs, u, &mut self.places);
        self.body.place(&self.places);
    }

    /// Elastic energy in J where the body was placed.
    pub fn energy(&self) -> f64 {
        self.body.energy()
    }

    /// Writes the internal force dE/du in N where the body was placed.
    pub fn internal_force(&mut self, out: &mut [f64]) {
        self.body.forces(&mut self.forces);
        gather(&self.dofs, &self.forces, out);
        out.iter_mut().for_each(|f| *f = -*f);
    }

    /// The largest force on a node in N, reactions of the supports included, as the last call of
    /// [`Held::internal_force`] found it.
    pub fn largest_force(&self) -> f64 {
        self.forces.as_flattened().iter().fold(0.0, |most: f64, f| most.max(f.abs()))
    }

    /// Force in N that rounding leaves on a body at rest.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// Chooses the tangent for [`Held::apply`] and [`Held::fill`] where the body was placed.
    pub fn linearise(&mut self, tangent: Tangent) {
        self.body.linearise(tangent);
    }

    /// Writes the product of the tangent with a vector over the free degrees of freedom.
    pub fn apply(&mut self, direction: &[f64], out: &mut [f64]) {
        self.places.fill([0.0; 3]);
        add_free(&self.dofs, direction, &mut self.places);
        self.body.apply(&self.places, &mut self.forces);
        gather(&self.dofs, &self.forces, out);
    }

    /// Writes the tangent on the pattern, in N/m.
    pub fn fill(&mut self, values: &mut [f64]) {
        self.matrix.fill(&self.body, values);
    }

    /// What is turned inside out at the displacement u (m).
    pub fn inversion(&self, u: &[f64]) -> Inversion {
        let mut places = self.start.clone();
        add_free(&self.dofs, u, &mut places);
        Inversion::of(self.body.domains(), &places)
    }
}

/// Adds a vector over the free degrees of freedom to all nodes.
fn add_free(dofs: &DofMap, u: &[f64], nodes: &mut [[f64; 3]]) {
    for (node, value) in nodes.iter_mut().enumerate() {
        for (value, &dof) in value.iter_mut().zip(dofs.free(node)) {
            if dof != FIXED {
                *value += u[dof as usize];
            }
        }
    }
}

/// Sums vectors on the nodes over the free degrees of freedom.
fn gather(dofs: &DofMap, nodes: &[[f64; 3]], out: &mut [f64]) {
    out.fill(0.0);
    for (node, value) in nodes.iter().enumerate() {
        for (value, &dof) in value.iter().zip(dofs.free(node)) {
            if dof != FIXED {
                out[dof as usize] += value;
            }
        }
    }
}
