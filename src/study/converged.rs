//! How much of the error is the mesh, and how much the springs.
//!
//! The calibrated network is compared with a continuum on the same nodes, so its error does not say how far it is from the
//! body. With `[converged]` the body is solved once more on a finer mesh that contains the displacements of this one
//! (every degree raised, every knot span halved; Hughes, Cottrell and Bazilevs 2005), and three fields are compared over
//! the body: u of the springs and u_ref of the continuum, both spread by the shape functions of the mesh, and u_* of
//! the finer mesh:
//!
//! ```text
//! e(a, b) = 100 sqrt(int |a - b|^2 dV / V) / max |u_*|       percent
//!
//! springs = e(u, u_ref)      the spring model, on one mesh
//! mesh    = e(u_ref, u_*)    the discretisation
//! total   = e(u, u_*)        what a user sees; at most the sum of the two
//! ```
//!
//! Tractions and body forces act on the finer mesh as they are; forces on nodes as the body force that does the same work on
//! this mesh ([`transfer`]). How converged u_* is shows by its distance from the mesh one step coarser.

use crate::clock::Progress;
use crate::error::Result;
use crate::geometry::refine::refined;
use crate::reference::transfer;
use crate::scene;
use crate::sparse::vectors::norm;

use super::body::Body;
use super::fit::{Calibration, Given};
use super::loads::{self, LoadCase};
use super::solve_reference;

/// A field: its coefficients at all nodes.
type Field = Vec<[f64; 3]>;

/// The comparison with a finer mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Converged {
    /// Control points of the finer mesh.
    pub control_points: usize,
    /// Its free degrees of freedom.
    pub free_dofs: usize,
    /// One for each load case.
    pub cases: Vec<Split>,
}

/// The errors under one load case, in percent of the largest displacement of the finer mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// Springs against the continuum on the same mesh.
    pub springs: f64,
    /// The continuum on this mesh against the finer one.
    pub mesh: f64,
    /// Springs against the finer mesh.
    pub total: f64,
    /// The finer mesh against the one a step coarser: what may still be missing.
    pub remaining: f64,
}

/// How much finer a mesh is: elevations of the degree, then halvings of the knot spans.
#[derive(Debug, Clone, Copy)]
struct Steps {
    elevations: usize,
    halvings: usize,
}

/// Solves on the finer mesh and compares; none when the scene does not ask for it.
///
/// # Errors
/// [`crate::error::Error::Input`] where the body cannot be refined; those of the reference.
pub fn compare(given: Given, found: &Calibration, progress: &Progress) -> Result<Option<Converged>> {
    let Some(scene::Converged { halvings, elevations }) = given.scene.converged else { return Ok(None) };
    progress.enter("converged reference", 0);
    let (steps, last) = match halvings {
        0 => (Steps { elevations: elevations - 1, halvings }, Steps { elevations: 1, halvings: 0 }),
        _ => (Steps { elevations, halvings: halvings - 1 }, Steps { elevations: 0, halvings: 1 }),
    };
    let coarser = given.body.refined(steps.elevations, steps.halvings)?;
    let fine = coarser.refined(last.elevations, last.halvings)?;
    let densities = densities(&given)?;
    let before = displacements(&given, &densities, &coarser, |density| lift(given.body, density, steps), progress)?;
    let to_fine = |field: Field| lift(&coarser, lift(given.body, field, steps)?, last);
    let truth = displacements(&given, &densities, &fine, to_fine, progress)?;
    let points = fine.integration_points()?;
    let distance = |a: &Field, b: &Field| {
        let apart: Field = a.iter().zip(b).map(|(a, b)| [a[0] - b[0], a[1] - b[1], a[2] - b[2]]).collect();
        transfer::size(&points, &apart).map(|size| size.root_mean_square)
    };
    let split = |(c, before): (usize, Field)| {
        let dofs = &given.body.dofs;
        let springs = to_fine(dofs.expand(&found.displacements[c]))?;
        let continuum = to_fine(dofs.expand(&given.reference.cases[c].displacement))?;
        let scale = 100.0 / transfer::size(&points, &truth[c])?.largest;
        Ok(Split {
            springs: scale * distance(&springs, &continuum)?,
            mesh: scale * distance(&continuum, &truth[c])?,
            total: scale * distance(&springs, &truth[c])?,
            remaining: scale * distance(&lift(&coarser, before, last)?, &truth[c])?,
        })
    };
    let cases = before.into_iter().enumerate().map(split).collect::<Result<_>>()?;
    Ok(Some(Converged { control_points: fine.positions().len(), free_dofs: fine.dofs.len(), cases }))
}

/// A field of a body written on its refinement.
fn lift(body: &Body, field: Field, Steps { elevations, halvings }: Steps) -> Result<Field> {
    Ok(refined(&body.patch()?.with_points(field)?, elevations, halvings)?.points().to_vec())
}

/// For each load case the body force (coefficients on this mesh) that stands for its forces on nodes; none where the scene
/// gives a traction or a body force.
fn densities(given: &Given) -> Result<Vec<Option<Field>>> {
    let nodal = |load: &scene::Load| load.traction.is_none() && load.body_force.is_none();
    let pairs = || given.scene.load.iter().zip(given.loads);
    let forces: Vec<&[f64]> =
        pairs().filter(|(load, _)| nodal(load)).map(|(_, case)| case.load.forces.as_slice()).collect();
    if forces.is_empty() {
        return Ok(vec![None; given.loads.len()]);
    }
    let points = given.body.integration_points()?;
    let order = given.body.reference_order(&points)?;
    let mut found = transfer::densities(&points, &given.body.dofs, order, &forces)?.into_iter();
    Ok(pairs().map(|(load, _)| if nodal(load) { found.next() } else { None }).collect())
}

/// Displacements of a finer body under every load case, m; `lift` brings a body force of this mesh to the finer one.
fn displacements(
    given: &Given,
    densities: &[Option<Field>],
    finer: &Body,
    lift: impl Fn(Field) -> Result<Field>,
    progress: &Progress,
) -> Result<Vec<Field>> {
    let points = finer.integration_points()?;
    let one = |c: usize| -> Result<LoadCase> {
        let (scene, case) = (&given.scene.load[c], &given.loads[c]);
        let load = match &densities[c] {
            Some(density) => transfer::load(&points, &finer.dofs, &lift(density.clone())?)?,
            None => {
                let mut load = loads::forces(scene, finer)?;
                if scene.max_displacement.is_some() {
                    load.scale(norm(&case.load.forces) / norm(&loads::forces(scene, given.body)?.forces));
                }
                load
            }
        };
        Ok(LoadCase { name: case.name.clone(), fit: case.fit, load })
    };
    let cases: Vec<LoadCase> = (0..given.loads.len()).map(one).collect::<Result<_>>()?;
    let solved = solve_reference(finer, &cases, progress)?;
    Ok(solved.cases.iter().map(|case| finer.dofs.expand(&case.displacement)).collect())
}
