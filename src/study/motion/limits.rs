//! How large a step of a scene may be, and what damping it needs.
//!
//! K and C of what is to move are linearised at rest ([`stability`]) and the limit is found for every alpha. A larger step is
//! refused with the smallest alpha that would do. Springs also get the limit that holds however they turn and stretch; "auto"
//! takes that one for them. A corotational continuum is linearised at rest too: its stiffness turns with it, but where it is
//! strained far it can be stiffer than there.
//!
//! Before the calibration its upper bounds (5.8) already tell a step that is safe whatever it finds: no spring becomes
//! stiffer, and none is damped more, than at its bound.

use rayon::prelude::*;

use crate::clock::Progress;
use crate::dynamics::integrator::{self, Integrator, Stability};
use crate::dynamics::springs::{Coefficients, SpringModel, isotropic};
use crate::dynamics::stability::{self, Limit, Linearised};
use crate::error::{Error, Result};
use crate::geometry::dofs::FIXED;
use crate::readable::significant;
use crate::scene::{self, Step};
use crate::springs::grouping::Grouping;
use crate::springs::{bounds, damping, weighting};
use crate::study::body::Body;
use crate::study::network::Lattice;

use super::continuum::Moving;
use super::{Mover, masses, start};

/// Unknowns above which nothing is linearised: the matrix alone would fill gigabytes.
const LARGEST_LINEARISED: usize = 300_000;

/// Unknowns up to which `check` finds a limit.
const LARGEST_CHECKED: usize = 20_000;

/// Parts of the undamped limit at which the smallest alpha is told.
const PARTS: [f64; 4] = [0.9, 0.5, 0.2, 0.1];

/// The limits of stability for one alpha.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// alpha in s; none without damping by (4.18).
    pub alpha: Option<f64>,
    /// Of small motion; none on networks too large for it.
    pub at_rest: Option<Limit>,
    /// Of springs that turn and stretch; none for linear models.
    pub any_motion: Option<Limit>,
    /// The step in s that the scene asks for, "auto" resolved.
    pub step: Option<f64>,
    /// The smallest alpha in s that is stable at that step with leapfrog; none when none is.
    pub smallest_alpha: Option<f64>,
}

impl Limits {
    /// The limit that is safe: of any motion where it is known.
    pub fn safest(&self) -> Option<Limit> {
        self.any_motion.or(self.at_rest)
    }
}

/// What a limit means for an integrator, s; none when every step is stable.
pub fn bound(integrator: &Integrator, limit: &Limit) -> Option<f64> {
    match integrator.stability {
        Stability::Unconditional => None,
        Stability::Elastic => Some(limit.undamped),
        Stability::ElasticAndDamping => Some(limit.damped),
    }
}

/// The largest step in s that is safe for small motion whatever the calibration finds within its bounds; none when every
/// step is, when the continuum moves, or when the network is too large to ask before a run.
///
/// # Errors
/// Those of the masses and of [`stability::limit`].
pub fn before_calibration(
    scene: &scene::Scene,
    body: &Body,
    lattice: &Lattice,
    groupings: &[Grouping],
) -> Result<Option<f64>> {
    let Some(settings) = &scene.dynamics else { return Ok(None) };
    let dofs = start::dofs(settings, body);
    if dofs.len() > LARGEST_CHECKED || settings.model == scene::Model::Reference {
        return Ok(None);
    }
    let network = &lattice.network;
    let mut stiffest = vec![0.0_f64; network.springs.len()];
    for grouping in groupings {
        let upper = bounds::upper_bounds(grouping, &lattice.spring_bounds, &lattice.factors);
        let stiffness = weighting::stiffness(grouping, &lattice.coefficients, &upper);
        stiffest.iter_mut().zip(stiffness).for_each(|(most, k)| *most = most.max(k));
    }
    let masses = masses(scene, body)?;
    // the smallest alpha damps most
    let alpha = settings.all_alphas().into_iter().flatten().reduce(f64::min);
    let damping = alpha.map(|alpha| damping::coefficients(network, &stiffest, &masses, alpha));
    let of = Coefficients { stiffness: &stiffest, damping: damping.as_deref() };
    let mut springs = SpringModel::new(network, &dofs, of, &masses);
    let rest = vec![0.0; dofs.len()];
    let symbolic = lattice.symbolic.clone().filter(|_| !settings.free);
    let limit = stability::limit(&Linearised::at(&mut springs, &rest, symbolic))?;
    let name = settings.integrator(scene.reference.kinematics);
    Ok(integrator::find(name).and_then(|integrator| bound(integrator, &limit)).map(|b| limit.safe(b)))
}

impl Mover<'_> {
    /// Limits for every alpha, and the smallest alpha for some steps.
    pub(super) fn limits(
        &self,
        continuum: Option<&Moving>,
        progress: &Progress,
    ) -> Result<(Vec<Limits>, Vec<[f64; 2]>)> {
        let small = self.dofs().len() <= LARGEST_LINEARISED;
        // K and C of alpha = 1 s: C of another alpha is that over alpha
        let at_rest = small.then(|| self.linearised(continuum));
        let any_motion = (self.settings.model == scene::Model::Springs).then(|| {
            let of = Coefficients { stiffness: &self.found.stiffness, damping: Some(&self.unit_damping) };
            isotropic(&self.given.lattice.network, self.dofs(), of, &self.masses)
        });
        let one = |alpha: Option<f64>| -> Result<Limits> {
            progress.check()?;
            let limit = |body: &Option<Linearised>| match body {
                // the damping of the continuum does not depend on alpha
                Some(body) if continuum.is_some() => stability::limit(body).map(Some),
                Some(body) => stability::limit(&body.with_damping_over(alpha)).map(Some),
                None => Ok(None),
            };
            let mut limits = Limits {
                alpha,
                at_rest: limit(&at_rest)?,
                any_motion: limit(&any_motion)?,
                step: None,
                smallest_alpha: None,
            };
            limits.step = self.step(&limits);
            if let (Some(body), Some(limit), Some(step), None) =
                (&at_rest, &limits.at_rest, limits.step, continuum.map(|_| ()))
            {
                limits.smallest_alpha = stability::smallest_alpha(body, limit, step);
            }
            Ok(limits)
        };
        let limits: Vec<Limits> = self.settings.all_alphas().into_par_iter().map(one).collect::<Result<_>>()?;
        let range = match (&at_rest, limits[0].at_rest, continuum.map(|_| ())) {
            (Some(body), Some(limit), None) => damping_range(body, &limit),
            _ => Vec::new(),
        };
        Ok((limits, range))
    }

    /// K and C at rest, with the damping of alpha = 1 s where springs move.
    fn linearised(&self, continuum: Option<&Moving>) -> Linearised {
        let rest = vec![0.0; self.dofs().len()];
        self.with_model(continuum, Some(1.0), |model| Linearised::at(model, &rest, self.symbolic.clone()))
    }

    /// The step of the scene in s, "auto" resolved; none when the scene has none.
    fn step(&self, limits: &Limits) -> Option<f64> {
        match self.settings.step {
            Some(Step::Fixed(step)) => Some(step),
            None if !self.settings.moves() => None,
            _ => {
                let limit = limits.safest()?;
                Some(self.settings.safety * limit.safe(bound(self.integrator, &limit)?))
            }
        }
    }

    /// The spring with the highest frequency sqrt(k (1/m_a + 1/m_b)) of its own, in words; a held end does not move. Nothing
    /// where no springs move.
    fn fastest_spring(&self) -> String {
        if self.settings.model == scene::Model::Reference {
            return String::new();
        }
        let ease = |node: u32| {
            let free = self.dofs().free(node as usize).iter().any(|&dof| dof != FIXED);
            if free { 1.0 / self.masses[self.dofs().master(node as usize)] } else { 0.0 }
        };
        let springs = self.given.lattice.network.springs.iter().zip(&self.found.stiffness);
        let square = springs.map(|(spring, k)| (k * (ease(spring.nodes[0]) + ease(spring.nodes[1])), spring.nodes));
        let fastest = square.fold((0.0, [0; 2]), |most, one| if one.0 > most.0 { one } else { most });
        let (omega, [a, b]) = (fastest.0.sqrt(), fastest.1);
        format!("; the fastest spring, between nodes {a} and {b}, alone has {} rad/s", significant(omega, 7))
    }

    /// Refuses a step above its limit.
    pub(super) fn check_step(&self, limits: &Limits, step: f64) -> Result<()> {
        let known = limits.at_rest.or(limits.any_motion);
        let Some((limit, bound)) = known.and_then(|limit| Some((limit, bound(self.integrator, &limit)?))) else {
            return Ok(());
        };
        if step <= limit.safe(bound) {
            return Ok(());
        }
        let alpha = limits.alpha.map_or(String::new(), |alpha| format!(" and alpha {alpha}"));
        let reason = format!(
            "with the largest eigenfrequency {} rad/s{alpha} the limit is {bound:.6e} s{}",
            significant(limit.omega_max, 7),
            self.fastest_spring()
        );
        let help = match limits.smallest_alpha {
            Some(alpha) if self.integrator.stability == Stability::ElasticAndDamping => {
                format!("give alpha = {} or more, a smaller step, or step = \"auto\"", significant(above(alpha), 4))
            }
            _ => "no damping makes this step stable: give a smaller one, step = \"auto\", or an implicit integrator"
                .into(),
        };
        Err(Error::UnstableStep { integrator: self.integrator.name, step, reason, help })
    }
}

/// The smallest alpha at some parts of the undamped limit.
fn damping_range(body: &Linearised, limit: &Limit) -> Vec<[f64; 2]> {
    let steps = PARTS.iter().map(|part| part * limit.undamped);
    steps.filter_map(|step| Some([step, stability::smallest_alpha(body, limit, step)?])).collect()
}

/// A little above, so that four figures of it are enough.
fn above(alpha: f64) -> f64 {
    let scale = 10.0_f64.powf(alpha.log10().floor() - 3.0);
    (alpha / scale).ceil() * scale
}
