//! Large displacements: the corotational continuum of a scene, and the network beside it.
//!
//! With `reference.kinematics = "corotational"` a load case is answered by the equilibrium of the body at any turn. A network
//! that is compared with it has to turn as well: its displacements under the same forces are those of the full spring
//! force (3.2) in equilibrium, not those of K(phi) u = f.
//!
//! ```text
//! sum_s T_s n_s = f at x + u        instead of        K(phi) u = f
//! ```

use std::sync::Arc;

use nalgebra_sparse::na::Vector3;

use crate::clock::{Interrupt, Progress};
use crate::error::{Error, Result};
use crate::readable::significant;
use crate::reference::Reference;
use crate::reference::corotational::body::Corotational;
use crate::reference::corotational::held::Held;
use crate::reference::corotational::inversion::Inversion;
use crate::reference::corotational::statics::{self, Search};
use crate::reference::loads::Load;
use crate::reference::methods::smoothed::Domains;
use crate::reference::methods::{METHODS, Method};
use crate::scene::{Kinematics, Scene};
use crate::sparse::cholesky::Symbolic;
use crate::sparse::equilibrium::{Newton, Potential};
use crate::springs::affine;
use crate::springs::grouping::Grouping;
use crate::springs::statics::LargeSprings;

use super::body::Body;
use super::continuum::Continuum;
use super::fit::Given;
use super::loads::LoadCase;

/// Whether the continuum of a scene may turn and bend far.
pub fn is_asked(scene: &Scene) -> bool {
    scene.reference.kinematics == Kinematics::Corotational
}

/// Refuses a method that has no large displacements where the scene asks for them.
///
/// # Errors
/// [`Error::Input`] at `reference.kinematics` with the methods that have.
pub fn check(scene: &Scene, method: &Method) -> Result<()> {
    if !is_asked(scene) || method.domains.is_some() {
        return Ok(());
    }
    let able: Vec<&str> = METHODS.iter().filter(|method| method.domains.is_some()).map(|method| method.name).collect();
    let message = format!("\"{}\" is for small displacements", method.name);
    let help = format!("methods that turn are {}; or set kinematics = \"linear\"", able.join(", "));
    Err(Error::input("reference.kinematics", message, help))
}

/// How equilibrium is sought for a scene.
pub fn search(scene: &Scene) -> Search {
    Search { load_steps: scene.reference.load_steps, ..Search::default() }
}

/// The domains of the body.
///
/// # Errors
/// Those of [`check`], and of the domains.
pub fn domains(scene: &Scene, body: &Body) -> Result<Domains> {
    check(scene, body.method)?;
    match (&body.continuum, body.method.domains) {
        (Continuum::Elements { mesh, .. }, Some(domains)) => domains(mesh, body.thickness),
        _ => Err(Error::input("reference.kinematics", "the body has no cells", "use a method for meshes")),
    }
}

/// The corotational body with its supports, at rest.
///
/// # Errors
/// Those of [`domains`] and of [`Held::new`].
pub fn held(scene: &Scene, body: &Body) -> Result<Held> {
    Held::new(domains(scene, body)?, body.positions(), body.lame, body.dofs.clone())
}

/// Answers the load cases of a reference anew, by equilibrium, if the scene asks for it.
///
/// # Errors
/// [`Error::NoEquilibrium`] with the load; [`Error::Interrupted`].
pub fn answer(
    scene: &Scene,
    body: &Body,
    loads: &[LoadCase],
    reference: &mut Reference,
    progress: &Progress,
) -> Result<()> {
    if !is_asked(scene) {
        return Ok(());
    }
    let mut held = held(scene, body)?;
    let all: Vec<(&str, &Load)> = loads.iter().map(|case| (case.name.as_str(), &case.load)).collect();
    let (cases, mut large) = statics::answers(&mut held, &all, search(scene), &progress.interrupt())?;
    large.linear = std::mem::replace(&mut reference.cases, cases);
    reference.large = Some(large);
    Ok(())
}

/// The corotational body in equilibrium with parts of one load: displacements over the free degrees of freedom, m.
///
/// # Errors
/// As [`answer`].
pub fn history(given: &Given, case: &LoadCase, fractions: &[f64]) -> Result<Vec<Vec<f64>>> {
    let mut held = held(given.scene, given.body)?;
    let mut newton = Newton::new(Held::pattern(&held), None)?;
    let rest = vec![0.0; given.body.dofs.len()];
    let mut one = |fraction: &f64| -> Result<Vec<f64>> {
        let forces: Vec<f64> = case.load.forces.iter().map(|force| fraction * force).collect();
        let found = newton.solve(&mut held, &forces, &rest, search(given.scene));
        Ok(found.map_err(|error| error.under(&format!("{fraction} of {}", case.name)))?.displacement)
    };
    fractions.iter().map(&mut one).collect()
}

/// Forces in N with which the corotational body resists a displacement of all its nodes (m), held ones included.
///
/// # Errors
/// Those of [`domains`].
pub fn resistance(given: &Given, displacement: &[[f64; 3]]) -> Result<Vec<[f64; 3]>> {
    let mut body = Corotational::new(domains(given.scene, given.body)?, given.body.lame)?;
    let moved = |(x, u): (&[f64; 3], &[f64; 3])| (Vector3::from(*x) + Vector3::from(*u)).into();
    let places: Vec<[f64; 3]> = given.body.positions().iter().zip(displacement).map(moved).collect();
    body.place(&places);
    let mut forces = vec![[0.0; 3]; places.len()];
    body.forces(&mut forces);
    forces.as_flattened_mut().iter_mut().for_each(|force| *force = -*force);
    Ok(forces)
}

/// The network with the numbers `phi` in equilibrium with some load cases: displacements over the free degrees of freedom
/// (cases x n), m.
///
/// # Errors
/// [`Error::NoEquilibrium`] with the load; [`Error::Interrupted`].
pub fn network(
    given: &Given,
    grouping: &Grouping,
    phi: &[f64],
    cases: &[usize],
    interrupt: &Interrupt,
) -> Result<Vec<f64>> {
    let mut springs =
        LargeSprings::new(&given.lattice.network, grouping, &given.lattice.coefficients, &given.body.dofs);
    springs.set(phi);
    let mut newton = Newton::new(springs.pattern(), given.lattice.symbolic.as_ref())?.watching(interrupt);
    let rest = vec![0.0; given.body.dofs.len()];
    let mut all = Vec::with_capacity(cases.len() * rest.len());
    for case in cases.iter().map(|&c| &given.loads[c]) {
        let found = newton.solve(&mut springs, &case.load.forces, &rest, search(given.scene));
        all.extend(found.map_err(|error| error.under(&case.name))?.displacement);
    }
    Ok(all)
}

/// What the displacement objective needs beside the springs.
pub struct Goal {
    /// The analysis of the pattern of the network.
    pub symbolic: Arc<Symbolic>,
    /// Displacements of the body linearised at rest under the fitted cases (cases x n), m.
    pub linear: Vec<f64>,
}

/// The displacement objective of a continuum that turns.
///
/// # Errors
/// Those of [`Symbolic::analyse`].
pub fn goal(given: &Given) -> Result<Goal> {
    let linear = given.reference.large.iter().flat_map(|large| &large.linear).zip(given.loads);
    let fitted = linear.filter(|(_, case)| case.fit).flat_map(|(answer, _)| answer.displacement.iter().copied());
    Ok(Goal { symbolic: analysis(given)?, linear: fitted.collect() })
}

fn analysis(given: &Given) -> Result<Arc<Symbolic>> {
    if let Some(symbolic) = &given.lattice.symbolic {
        return Ok(Arc::clone(symbolic));
    }
    let pattern = affine::pattern(&given.lattice.network, &given.body.dofs);
    Symbolic::analyse(&pattern, given.body.spring_order(&given.lattice.network, &pattern)?)
}

/// What is turned inside out in the static answers, in words.
pub fn warnings(loads: &[LoadCase], reference: &Reference) -> Vec<String> {
    let inversions = reference.large.iter().flat_map(|large| &large.inversions);
    let told = loads
        .iter()
        .zip(inversions)
        .filter_map(|(case, inversion)| Some(format!("under the load {}: {}", case.name, describe(inversion)?)));
    told.collect()
}

/// What is inverted, in words; none where nothing is.
pub fn describe(inversion: &Inversion) -> Option<String> {
    (!inversion.is_sound()).then(|| {
        format!(
            "{} cells and {} smoothing domains of the continuum are turned inside out (smallest det F {} and {})",
            inversion.cells.len(),
            inversion.domains.len(),
            significant(inversion.least_cell, 3),
            significant(inversion.least_domain, 3)
        )
    })
}
