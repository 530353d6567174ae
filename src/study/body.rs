//! The body of a scene: what it is made of, its material, and which nodes are held or tied. The nodes of a patch are its
//! control points.

use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, tie_coincident};
use crate::geometry::grid::Grid;
use crate::geometry::mesh::Mesh;
use crate::geometry::patch::Patch;
use crate::geometry::{refine, selection};
use crate::reference::material::{Lame, Material, Plane};
use crate::reference::methods::{Method, PatchPoints};
use crate::reference::points::IntegrationPoints;
use crate::reference::{locking, stiffness, supports};
use crate::scene::{self, Scene};
use crate::sparse::ordering::{minimum_degree, nested_dissection};
use crate::sparse::pattern::Pattern;
use crate::springs::network::Network;

use super::continuum::{self, Built, Continuum};
use super::large;

/// Nodes nearer than this fraction of the body's extent are tied when the seam is merged.
const SEAM: f64 = 1e-9;

/// Springs of more grid steps than this are ordered without the grid.
const LONGEST_LEAP: usize = 3;

/// The body of a scene.
pub struct Body {
    /// The scene with every default written out.
    pub resolved: Scene,
    /// What it is made of.
    pub continuum: Continuum,
    /// The method of the reference.
    pub method: &'static Method,
    /// Free, held and tied degrees of freedom of the nodes.
    pub dofs: DofMap,
    /// Elastic constants.
    pub lame: Lame,
    /// Thickness in m; 1 in three dimensions.
    pub thickness: f64,
    /// Gauss points beyond degree + 1.
    pub extra_points: usize,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Builds the body.
///
/// # Errors
/// [`Error::Input`] at the key that does not fit the body; [`Error::Mechanism`] when the supports do not hold it.
pub fn build(scene: &Scene) -> Result<Body> {
    let Built { continuum, method, mut warnings } = continuum::build(scene)?;
    let dimension = continuum.dimension();
    scene::check_body(scene, dimension, continuum.positions().len())?;
    large::check(scene, method)?;
    let resolved = scene::resolve(scene, dimension, method);
    let material = Material { young: resolved.material.young, poisson: resolved.material.poisson };
    let plane = match resolved.reference.plane {
        Some(scene::Plane::Strain) => Plane::Strain,
        _ => Plane::Stress,
    };
    let lame = material.lame(dimension, plane)?;
    let (dofs, chosen) = dofs(&resolved, &continuum)?;
    warnings.extend(held_by_us(&chosen));
    if scene.geometry.file.is_some() {
        warnings.extend(continuum.mesh().and_then(|mesh| cut(mesh, &dofs)));
    }
    supports::check(continuum.positions(), continuum.mesh(), &dofs)?;
    let thickness = resolved.reference.thickness.unwrap_or(1.0);
    let extra_points = resolved.reference.extra_gauss_points;
    if dimension == 3 || plane == Plane::Strain {
        warnings.extend(locking::warning(method, continuum.spans(), material.poisson));
    }
    let mut body = Body { resolved, continuum, method, dofs, lame, thickness, extra_points, warnings };
    if scene.converged.is_some() {
        // asked now, for it is needed at the end only
        body.patch()?;
    }
    let from_file = scene.geometry.file.is_some();
    if from_file || body.continuum.mesh().is_some() {
        let points = body.integration_points()?;
        // folds are found before anything is built on them; the patches of our own shapes have none
        points.measure()?;
        // and those are as we made them (the torus is left-handed by its grid order): nothing to tell about them
        let remarks = if from_file { points.warnings().to_vec() } else { Vec::new() };
        drop(points);
        body.warnings.extend(remarks);
    }
    Ok(body)
}

/// A word about the components that `support.fix_rigid` holds.
fn held_by_us(chosen: &[(usize, usize)]) -> Option<String> {
    let names: Vec<String> = chosen.iter().map(|&(node, i)| format!("{} of node {node}", ["x", "y", "z"][i])).collect();
    (!chosen.is_empty()).then(|| {
        format!(
            "support.fix_rigid holds {}: these take whatever of a load is not in balance with itself",
            names.join(", ")
        )
    })
}

/// A word about nodes of a mesh that lie on others and are not tied to them.
fn cut(mesh: &Mesh, dofs: &DofMap) -> Option<String> {
    let mut loose = mesh.coincident_nodes();
    loose.retain(|&(a, b)| dofs.master(a as usize) != dofs.master(b as usize));
    let &(a, b) = loose.first()?;
    let at = mesh.positions()[a as usize];
    Some(format!(
        "{} nodes lie on another one, so the body is cut there: first nodes {a} and {b} (from 0) at {at:?}; \
         geometry.merge_seam = true ties them",
        loose.len()
    ))
}

/// Ties and supports of the nodes, and the components that `support.fix_rigid` adds to them.
fn dofs(scene: &Scene, continuum: &Continuum) -> Result<(DofMap, Vec<(usize, usize)>)> {
    let (dimension, points) = (continuum.dimension(), continuum.positions());
    let master = match scene.geometry.merge_seam {
        true => tie_coincident(points, SEAM * extent(points)),
        false => (0..points.len() as u32).collect(),
    };
    let mut fixed = vec![[false; 3]; points.len()];
    for (key, support) in scene.support.keyed() {
        let mut components = [false; 3];
        match &support.components {
            Some(axes) => axes.iter().for_each(|axis| components[axis.index()] = true),
            None => components[..dimension].fill(true),
        }
        for node in held(support, &key, continuum)? {
            fixed[node as usize].iter_mut().zip(components).for_each(|(fixed, held)| *fixed |= held);
        }
    }
    let mut dofs = DofMap::new(dimension, master, &fixed);
    let mut chosen = Vec::new();
    if scene.support.tables().iter().any(|support| support.fix_rigid) {
        chosen = supports::hold_loose(points, continuum.mesh(), &dofs);
        dofs = dofs.holding(&chosen);
    }
    if dofs.is_empty() {
        return Err(Error::input("support", "holds every node", "leave at least one free"));
    }
    Ok((dofs, chosen))
}

/// The nodes that one table of the supports names; `key` is its key.
fn held(support: &scene::Support, key: &str, continuum: &Continuum) -> Result<Vec<u32>> {
    let mut held: Vec<u32> = support.nodes.iter().map(|&node| node as u32).collect();
    for face in &support.faces {
        held.extend(continuum.face_nodes(face, &format!("{key}.faces"))?);
    }
    for (i, set) in support.sets.iter().enumerate() {
        held.extend(continuum.set_nodes(set, &format!("{key}.sets[{i}]"))?);
    }
    if let Some(region) = &support.r#box {
        held.extend(box_nodes(region, continuum.positions()));
    }
    if held.is_empty() && !support.fix_rigid {
        let help = "name a face (x-, x+, y-, ...), a node, a set, or a box that contains some";
        return Err(Error::input(key, "holds no node", help));
    }
    Ok(held)
}

/// The nodes inside a box of the scene, ascending.
pub(super) fn box_nodes(region: &scene::BoxRegion, points: &[[f64; 3]]) -> Vec<u32> {
    let corner = |given: &[f64]| [0, 1, 2].map(|a| given.get(a).copied().unwrap_or(0.0));
    selection::box_nodes(points, corner(&region.min), corner(&region.max))
}

/// Largest extent of the nodes, m.
fn extent(points: &[[f64; 3]]) -> f64 {
    let span = |a: usize| {
        let coordinates = points.iter().map(|p| p[a]);
        coordinates.clone().fold(f64::NEG_INFINITY, f64::max) - coordinates.fold(f64::INFINITY, f64::min)
    };
    span(0).max(span(1)).max(span(2))
}

impl Body {
    /// The patch that the body is.
    ///
    /// # Errors
    /// [`Error::Input`] when it is a mesh.
    pub fn patch(&self) -> Result<&Patch> {
        self.splines().map(|(patch, _)| patch)
    }

    fn splines(&self) -> Result<(&Patch, PatchPoints)> {
        match &self.continuum {
            Continuum::Splines { patch, points } => Ok((patch, *points)),
            Continuum::Elements { .. } => {
                let message = format!("\"{}\" works on a mesh, which is not refined", self.method.name);
                Err(Error::input("converged", message, "use \"iga\" on a patch, or remove the table"))
            }
        }
    }

    /// The same body, held alike, with every degree raised by `elevations` and every knot span halved `halvings` times.
    ///
    /// # Errors
    /// [`Error::Input`] when it is a mesh, or the degree or the number of control points becomes too large.
    pub fn refined(&self, elevations: usize, halvings: usize) -> Result<Self> {
        let (patch, points) = self.splines()?;
        let continuum = Continuum::Splines { patch: refine::refined(patch, elevations, halvings)?, points };
        let (dofs, _) = dofs(&self.resolved, &continuum)?;
        let (resolved, warnings) = (self.resolved.clone(), Vec::new());
        Ok(Self { resolved, continuum, dofs, warnings, ..*self })
    }

    /// Places of the nodes, m.
    pub fn positions(&self) -> &[[f64; 3]] {
        self.continuum.positions()
    }

    /// The grid of the nodes; a mesh from a file has none.
    pub fn grid(&self) -> Option<Grid> {
        self.continuum.grid()
    }

    /// The integration points of the reference.
    ///
    /// # Errors
    /// Those of the method: a mesh that it cannot take.
    pub fn integration_points(&self) -> Result<IntegrationPoints<'_>> {
        match &self.continuum {
            Continuum::Splines { patch, points } => Ok(points(patch, self.extra_points, self.thickness)),
            Continuum::Elements { mesh, points, .. } => points(mesh, self.thickness),
        }
    }

    /// An elimination order for the reference: nested dissection of the grid, approximate minimum degree where there is none.
    ///
    /// # Errors
    /// Those of [`minimum_degree`].
    pub fn reference_order(&self, points: &IntegrationPoints) -> Result<Vec<u32>> {
        match self.dissected(self.continuum.reach()) {
            Some(order) => Ok(order),
            None => minimum_degree(&stiffness::pattern(points, &self.dofs)),
        }
    }

    /// An elimination order for the springs of a network with this pattern, likewise; minimum degree too where springs
    /// leap so far that the separators of a grid would be most of it.
    ///
    /// # Errors
    /// Those of [`minimum_degree`].
    pub fn spring_order(&self, network: &Network, pattern: &Pattern) -> Result<Vec<u32>> {
        let reach = network.reach().filter(|&reach| reach <= LONGEST_LEAP);
        reach.and_then(|reach| self.dissected(reach)).map_or_else(|| minimum_degree(pattern), Ok)
    }

    /// Nested dissection of the grid for couplings of up to `reach` steps; `None` without a grid.
    fn dissected(&self, reach: usize) -> Option<Vec<u32>> {
        let grid = self.grid()?;
        Some(self.dofs.order(&nested_dissection(grid.extents(), reach, self.dofs.closed(&grid))))
    }
}
