//! How a motion starts, and what acts on it.

use std::borrow::Cow;

use crate::dynamics::external::{External, History, Part, weight};
use crate::geometry::dofs::DofMap;
use crate::scene::{self, Initial};
use crate::study::body::Body;

use super::Mover;

/// The degrees of freedom of a body in motion: its own, or all where the supports let go.
pub fn dofs<'a>(settings: &scene::Dynamics, body: &'a Body) -> Cow<'a, DofMap> {
    let held = &body.dofs;
    if !settings.free {
        return Cow::Borrowed(held);
    }
    let master = (0..held.nodes()).map(|node| held.master(node) as u32).collect();
    Cow::Owned(DofMap::new(held.dimension(), master, &vec![[false; 3]; held.nodes()]))
}

impl Mover<'_> {
    /// A vector over the degrees of freedom of the static problem, over those that move: zero where that had none.
    fn carried(&self, values: &[f64]) -> Vec<f64> {
        let nodes = self.given.body.dofs.expand(values);
        (0..self.dofs().len()).map(|dof| self.dofs().owner(dof)).map(|(node, a)| nodes[node][a]).collect()
    }

    /// Index of the load case that acts.
    fn case(&self) -> usize {
        let named = |name: &String| self.given.loads.iter().position(|case| &case.name == name);
        self.settings.load_case.as_ref().and_then(named).unwrap_or(0)
    }

    /// Displacement and velocity at the start.
    pub(super) fn start(&self) -> [Vec<f64>; 2] {
        let displacement = match (self.settings.initial, self.settings.model) {
            (Initial::Rest, _) => vec![0.0; self.dofs().len()],
            (_, scene::Model::Reference) => self.carried(&self.given.reference.cases[self.case()].displacement),
            _ => self.carried(&self.found.displacements[self.case()]),
        };
        let velocity = self.velocity(&displacement);
        [displacement, velocity]
    }

    /// v + w x (x - c) with the centre of mass c of the displaced body.
    fn velocity(&self, displacement: &[f64]) -> Vec<f64> {
        let along = padded(self.settings.velocity.as_deref());
        let spin = match self.settings.angular_velocity.as_deref() {
            // in the plane a body turns about z
            Some(&[about]) => [0.0, 0.0, about],
            given => padded(given),
        };
        let moved = self.dofs().expand(displacement);
        let place = |node: usize| [0, 1, 2].map(|a| self.given.body.positions()[node][a] + moved[node][a]);
        let total: f64 = self.masses.iter().sum();
        let mut centre = [0.0; 3];
        for (node, mass) in self.masses.iter().enumerate() {
            centre.iter_mut().zip(place(node)).for_each(|(c, x)| *c += mass / total * x);
        }
        let at = |dof: usize| {
            let (node, a) = self.dofs().owner(dof);
            let (x, [b, c]) = (place(node), [(a + 1) % 3, (a + 2) % 3]);
            along[a] + spin[b] * (x[c] - centre[c]) - spin[c] * (x[b] - centre[b])
        };
        (0..self.dofs().len()).map(at).collect()
    }

    /// The forces in time: the load case as long as it acts, and weight.
    pub(super) fn external(&self) -> External {
        let mut parts = Vec::new();
        if self.settings.initial == Initial::Rest && !self.settings.free {
            let history = match (self.settings.load_until, self.settings.load_factors.is_empty()) {
                (Some(end), _) => History::Until(end),
                (None, false) => History::Table(self.settings.load_factors.clone()),
                (None, true) => History::Constant,
            };
            parts.push(Part { forces: self.given.loads[self.case()].load.forces.clone(), history });
        }
        if let Some(gravity) = &self.settings.gravity {
            let dofs = self.dofs();
            let masses: Vec<f64> = (0..dofs.len()).map(|dof| self.masses[dofs.owner(dof).0]).collect();
            let forces = weight(&masses, |dof| dofs.owner(dof).1, padded(Some(gravity)));
            parts.push(Part { forces, history: History::Constant });
        }
        External { parts }
    }
}

/// Three components, zero where none is given.
fn padded(given: Option<&[f64]>) -> [f64; 3] {
    [0, 1, 2].map(|a| given.and_then(|given| given.get(a)).copied().unwrap_or(0.0))
}
