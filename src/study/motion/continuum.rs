//! The continuum of a scene in motion: linear, or turning with its domains.

use std::sync::Arc;

use crate::dynamics::corotational::CorotationalModel;
use crate::dynamics::linear::{Damping, LinearModel};
use crate::dynamics::model::Model;
use crate::dynamics::motion::Motion;
use crate::error::Result;
use crate::readable::significant;
use crate::reference::corotational::held::Held;
use crate::reference::stiffness;
use crate::scene;
use crate::sparse::cholesky::Symbolic;
use crate::study::large;

use super::Mover;

/// A continuum that can be set in motion.
#[derive(Clone)]
pub(super) enum Moving {
    /// K, C and M about rest.
    Linear(Box<LinearModel>),
    /// Stiffness that turns with the body.
    Corotational(Box<CorotationalModel>),
}

impl Moving {
    /// The body as integrators see it.
    pub fn model(&mut self) -> &mut dyn Model {
        match self {
            Self::Linear(model) => model.as_mut(),
            Self::Corotational(model) => model.as_mut(),
        }
    }

    fn as_model(&self) -> &dyn Model {
        match self {
            Self::Linear(model) => model.as_ref(),
            Self::Corotational(model) => model.as_ref(),
        }
    }
}

/// What was turned inside out in the records of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inverted {
    /// Records with an inverted cell or smoothing domain.
    pub records: usize,
    /// Time of the first of them in s; none when there is none.
    pub first: Option<f64>,
    /// Smallest det F of a cell in any record.
    pub least_cell: f64,
    /// Smallest det F of a smoothing domain in any record.
    pub least_domain: f64,
}

impl Inverted {
    /// Looks at every record.
    fn of(body: &Held, motion: &Motion) -> Self {
        let mut found = Self { records: 0, first: None, least_cell: f64::INFINITY, least_domain: f64::INFINITY };
        for (time, frame) in motion.times.iter().zip(&motion.frames) {
            let inversion = body.inversion(frame);
            found.least_cell = found.least_cell.min(inversion.least_cell);
            found.least_domain = found.least_domain.min(inversion.least_domain);
            if !inversion.is_sound() {
                found.records += 1;
                found.first.get_or_insert(*time);
            }
        }
        found
    }

    /// The finding in words, if there is one.
    pub fn warning(&self) -> Option<String> {
        let Self { records, first, least_cell, least_domain } = self;
        first.map(|time| {
            format!(
                "in {records} records of the motion, first at {} s, cells of the continuum are turned inside out \
                 (smallest det F of a cell {}, of a smoothing domain {})",
                significant(time, 4),
                significant(*least_cell, 3),
                significant(*least_domain, 3)
            )
        })
    }
}

impl Mover<'_> {
    /// The continuum in motion, if that is what moves.
    pub(super) fn continuum(&self) -> Result<Option<Moving>> {
        let (scene, settings) = (self.given.scene, self.settings);
        match settings.model {
            scene::Model::Reference if large::is_asked(scene) => self.corotational().map(Some),
            scene::Model::Reference => self.linear().map(Some),
            _ => Ok(None),
        }
    }

    fn corotational(&self) -> Result<Moving> {
        let (scene, body) = (self.given.scene, self.given.body);
        let held = Held::new(large::domains(scene, body)?, body.positions(), body.lame, self.dofs().clone())?;
        let tangent = self.settings.tangent(self.integrator.name);
        let [mass, stiffness] = self.settings.rayleigh.unwrap_or_default();
        let model = CorotationalModel::new(held, &self.masses, tangent).with_damping(mass, stiffness);
        Ok(Moving::Corotational(Box::new(model)))
    }

    fn linear(&self) -> Result<Moving> {
        let (body, dofs) = (self.given.body, self.dofs());
        let assembled = match &self.given.reference.stiffness {
            Some(stiffness) if !self.settings.free => stiffness.clone(),
            _ => {
                let points = body.integration_points()?;
                stiffness::stiffness(&points, body.lame, dofs, &stiffness::pattern(&points, dofs))?
            }
        };
        let damping = match self.settings.rayleigh {
            Some([mass, stiffness]) => Damping::Rayleigh { mass, stiffness },
            None => Damping::None,
        };
        let masses = (0..dofs.len()).map(|dof| self.masses[dofs.owner(dof).0]).collect();
        Ok(Moving::Linear(Box::new(LinearModel::new(&assembled, damping, masses))))
    }

    /// The analysis of the pattern of what moves; none where springs have none because they are many, and for a free body.
    pub(super) fn analysis(&self, continuum: Option<&Moving>) -> Result<Option<Arc<Symbolic>>> {
        match continuum {
            _ if self.settings.free => Ok(None),
            None => Ok(self.given.lattice.symbolic.clone()),
            Some(continuum) => {
                let order = self.given.body.reference_order(&self.given.body.integration_points()?)?;
                Symbolic::analyse(continuum.as_model().pattern(), order).map(Some)
            }
        }
    }

    /// What was turned inside out in a motion of a corotational continuum.
    pub(super) fn inverted(&self, continuum: Option<&Moving>, motion: &Motion) -> Option<Inverted> {
        match continuum {
            Some(Moving::Corotational(model)) => Some(Inverted::of(model.body(), motion)),
            _ => None,
        }
    }
}
