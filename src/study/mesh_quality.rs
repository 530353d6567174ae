//! How good the mesh of a body is.
//!
//! Cells are judged by the smallest measure over the mean, the smallest angle of triangles and tetrahedra, and the smallest
//! scaled Jacobian of quadrilaterals and hexahedra ([`crate::geometry::mesh::quality`]); the domains that a method smooths over by
//! their smallest volume over the mean. A domain takes its share of the cells around a face, an edge or a node; at the
//! boundary it has fewer of them.

use serde::Serialize;

use crate::error::Result;
use crate::geometry::mesh::quality::quality;
use crate::readable::significant;
use crate::reference::points::ElementPoints;

use super::body::Body;
use super::continuum::Continuum;

/// The mesh of a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshQuality {
    /// Cells.
    pub cells: usize,
    /// Smallest measure of a cell over the mean, and its cell.
    pub least_measure_ratio: (f64, u32),
    /// Smallest angle of a triangle, or between two faces of a tetrahedron, in degrees, and its cell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_angle: Option<(f64, u32)>,
    /// Smallest scaled Jacobian of a quadrilateral or hexahedron, and its cell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_jacobian: Option<(f64, u32)>,
    /// Elements that the method integrates over: cells, or the domains that it smooths over.
    pub domains: usize,
    /// Smallest volume of one of them over the mean.
    pub least_domain_ratio: f64,
}

/// The quality of the mesh of a body; none of a patch.
///
/// # Errors
/// Those of the integration points.
pub fn of(body: &Body) -> Result<Option<MeshQuality>> {
    let Continuum::Elements { mesh, .. } = &body.continuum else { return Ok(None) };
    let Some(found) = quality(mesh) else { return Ok(None) };
    let points = body.integration_points()?;
    let (mut filled, mut sum, mut least) = (ElementPoints::default(), 0.0, f64::INFINITY);
    for element in 0..points.elements() {
        points.fill(element, &mut filled)?;
        let volume: f64 = filled.volumes.iter().sum();
        sum += volume;
        least = least.min(volume);
    }
    Ok(Some(MeshQuality {
        cells: found.cells,
        least_measure_ratio: (found.least_measure.0 / found.mean_measure(), found.least_measure.1),
        least_angle: found.least_angle,
        least_jacobian: found.least_jacobian,
        domains: points.elements(),
        least_domain_ratio: least * points.elements() as f64 / sum,
    }))
}

impl MeshQuality {
    /// A line for a person.
    pub fn summary(&self) -> String {
        let (ratio, cell) = self.least_measure_ratio;
        let mut line =
            format!("mesh: {} cells, the smallest (cell {cell}) {} of the mean", self.cells, significant(ratio, 3));
        if let Some((angle, cell)) = self.least_angle {
            line += &format!(", smallest angle {} degrees (cell {cell})", significant(angle, 3));
        }
        if let Some((jacobian, cell)) = self.least_jacobian {
            line += &format!(", smallest scaled Jacobian {} (cell {cell})", significant(jacobian, 3));
        }
        line + &format!(
            "; {} elements of the method, the smallest {} of the mean",
            self.domains,
            significant(self.least_domain_ratio, 3)
        )
    }
}
