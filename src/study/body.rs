//! The body of a scene: its patch, its material, and which control points are held or tied.

use std::path::Path;

use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, tie_coincident};
use crate::geometry::grid::Grid;
use crate::geometry::patch::Patch;
use crate::geometry::shapes::{self, ShapeRequest};
use crate::geometry::{file, selection};
use crate::reference::material::{Lame, Material, Plane};
use crate::reference::methods::nurbs;
use crate::reference::points::{ElementPoints, IntegrationPoints};
use crate::reference::supports;
use crate::scene::{self, Scene};

/// Control points nearer than this fraction of the body's extent are tied when the seam is merged.
const SEAM: f64 = 1e-9;

/// The body of a scene.
pub struct Body {
    /// The scene with every default written out.
    pub resolved: Scene,
    /// The geometry.
    pub patch: Patch,
    /// Free, held and tied degrees of freedom of the control points.
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

/// The nodes of all elements with what masses are made of.
pub struct ElementShares {
    /// Control points that act in each element, one element after the other.
    pub nodes: Vec<u32>,
    /// Volume of each element, m^3.
    pub measures: Vec<f64>,
    /// Integral of the shape function over the element, like `nodes`, m^3.
    pub integrals: Vec<f64>,
}

/// Builds the body.
///
/// # Errors
/// [`Error::Input`] at the key that does not fit the body; [`Error::Mechanism`] when the supports do not hold it.
pub fn build(scene: &Scene) -> Result<Body> {
    let patch = patch(scene)?;
    let dimension = patch.dimension();
    scene::check_body(scene, dimension, patch.grid().len())?;
    let resolved = scene::resolve(scene, dimension);
    let material = Material { young: resolved.material.young, poisson: resolved.material.poisson };
    let plane = match resolved.reference.plane {
        Some(scene::Plane::Strain) => Plane::Strain,
        _ => Plane::Stress,
    };
    let lame = material.lame(dimension, plane)?;
    let dofs = dofs(&resolved, &patch)?;
    supports::check(patch.points(), &dofs)?;
    let thickness = resolved.reference.thickness.unwrap_or(1.0);
    let extra_points = resolved.reference.extra_gauss_points;
    let mut warnings: Vec<String> = material.locking_warning(dimension, plane).into_iter().collect();
    if scene.geometry.file.is_some() {
        // our own shapes are as we made them (the torus is left-handed by its grid order): nothing to tell about those
        warnings.extend(nurbs::integration_points(&patch, extra_points, thickness).warnings().iter().cloned());
    }
    Ok(Body { resolved, patch, dofs, lame, thickness, extra_points, warnings })
}

/// The patch of a shape or of a file.
fn patch(scene: &Scene) -> Result<Patch> {
    let geometry = &scene.geometry;
    if let Some(path) = &geometry.file {
        return file::read_patch(Path::new(path));
    }
    let name = geometry.shape.as_deref().unwrap_or_default();
    let shape = shapes::find(name).ok_or_else(|| {
        Error::input("geometry.shape", format!("there is no shape {name:?}"), "see `springfit list shapes`")
    })?;
    let size = geometry.size.clone().unwrap_or_else(|| shape.default_size[..shape.dimension].to_vec());
    let control_points = geometry.control_points.clone().unwrap_or_else(|| shape.default_control_points.to_vec());
    let degree = geometry.degree.clone().unwrap_or_else(|| shape.default_degree.to_vec());
    (shape.build)(&ShapeRequest { control_points, degree, size })
}

/// Ties and supports of the control points.
fn dofs(scene: &Scene, patch: &Patch) -> Result<DofMap> {
    let (grid, points) = (patch.grid(), patch.points());
    let dimension = patch.dimension();
    let master = match scene.geometry.merge_seam {
        true => tie_coincident(points, SEAM * extent(points)),
        false => (0..points.len() as u32).collect(),
    };
    let mut held: Vec<u32> = scene.support.nodes.iter().map(|&node| node as u32).collect();
    for face in &scene.support.faces {
        held.extend(selection::face_nodes(&grid, face)?);
    }
    if let Some(region) = &scene.support.r#box {
        let corner = |given: &[f64]| [0, 1, 2].map(|a| given.get(a).copied().unwrap_or(0.0));
        held.extend(selection::box_nodes(points, corner(&region.min), corner(&region.max)));
    }
    if held.is_empty() {
        let help = "name a face (x-, x+, y-, ...), a control point, or a box that contains some";
        return Err(Error::input("support", "holds no control point", help));
    }
    let mut components = [false; 3];
    match &scene.support.components {
        Some(axes) => axes.iter().for_each(|axis| components[axis.index()] = true),
        None => components[..dimension].fill(true),
    }
    let mut fixed = vec![[false; 3]; points.len()];
    held.iter().for_each(|&node| fixed[node as usize] = components);
    let dofs = DofMap::new(dimension, master, &fixed);
    if dofs.is_empty() {
        return Err(Error::input("support", "holds every control point", "leave at least one free"));
    }
    Ok(dofs)
}

/// Largest extent of the control net, m.
fn extent(points: &[[f64; 3]]) -> f64 {
    let span = |a: usize| {
        let coordinates = points.iter().map(|p| p[a]);
        coordinates.clone().fold(f64::NEG_INFINITY, f64::max) - coordinates.fold(f64::INFINITY, f64::min)
    };
    span(0).max(span(1)).max(span(2))
}

impl Body {
    /// The grid of control points.
    pub fn grid(&self) -> Grid {
        self.patch.grid()
    }

    /// The integration points of the isogeometric reference.
    pub fn integration_points(&self) -> IntegrationPoints<'_> {
        nurbs::integration_points(&self.patch, self.extra_points, self.thickness)
    }

    /// Grid directions whose last plane of control points is tied to the first.
    pub fn closed(&self) -> [bool; 3] {
        let grid = self.grid();
        [0, 1, 2].map(|a| {
            let last = grid.extents()[a] - 1;
            let tied = |node: usize| {
                let mut index = grid.index(node);
                let at_end = index[a] == last;
                index[a] = 0;
                !at_end || self.dofs.master(node) == self.dofs.master(grid.node(index))
            };
            last > 1 && (0..grid.len()).all(tied)
        })
    }

    /// What masses are made of.
    ///
    /// # Errors
    /// As [`IntegrationPoints::fill`].
    pub fn element_shares(&self) -> Result<ElementShares> {
        let points = self.integration_points();
        let mut filled = ElementPoints::default();
        let mut shares = ElementShares { nodes: vec![], measures: vec![], integrals: vec![] };
        for element in 0..points.elements() {
            points.fill(element, &mut filled)?;
            let acting = points.acting(element);
            shares.nodes.extend_from_slice(acting);
            shares.measures.push(filled.volumes.iter().sum());
            for a in 0..acting.len() {
                let values = filled.values.iter().skip(a).step_by(acting.len());
                shares.integrals.push(values.zip(&filled.volumes).map(|(n, v)| n * v).sum());
            }
        }
        Ok(shares)
    }
}
