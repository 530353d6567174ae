//! The methods: how each fills the integration points of its elements.
//!
//! | file | methods |
//! |---|---|
//! | [`nurbs`] | isogeometric: the splines of the body |
//! | [`elements`] | finite elements on the cells of a mesh |
//! | [`cell_rules`] | their shape functions and Gauss points |
//! | [`smoothed`] | smoothed finite elements on triangles and tetrahedra |
//! | [`losses`] | how far each locks near nu = 1/2, measured |
//! | [`t10`] | quadratic tetrahedra, to measure the others against |
//!
//! A method is a line of [`METHODS`]. One more is a file that fills integration points, and a line here: the scene, the
//! lists and the tests loop over the table.

pub mod cell_rules;
pub mod elements;
pub mod losses;
pub mod nurbs;
pub mod smoothed;
pub mod t10;

use crate::error::{Error, Result};
use crate::geometry::mesh::{CellKind, Mesh};
use crate::geometry::patch::Patch;
use crate::reference::methods::losses::Losses;
use crate::reference::methods::smoothed::{Domains, Smoothing};
use crate::reference::points::IntegrationPoints;

/// A method of the table.
#[derive(Debug, Clone, Copy)]
pub struct Method {
    /// Name in a scene.
    pub name: &'static str,
    /// What it is, in a line.
    pub doc: &'static str,
    /// What it works on, and how it fills the points.
    pub body: MethodBody,
    /// Its domains, where it can turn and bend far ([`crate::reference::corotational`]).
    pub domains: Option<MeshDomains>,
    /// What it loses near nu = 1/2.
    pub losses: Losses,
}

/// Fills the points of a patch; Gauss points beyond degree + 1, and the thickness in m (looked at in two dimensions only).
pub type PatchPoints = fn(&Patch, usize, f64) -> IntegrationPoints<'_>;

/// Fills the points of a mesh; the number is the thickness in m (looked at in two dimensions only).
pub type MeshPoints = fn(&Mesh, f64) -> Result<IntegrationPoints<'_>>;

/// The domains of a mesh; the number is the thickness in m (looked at in two dimensions only).
pub type MeshDomains = fn(&Mesh, f64) -> Result<Domains>;

/// What a method works on.
#[derive(Debug, Clone, Copy)]
pub enum MethodBody {
    /// A patch.
    Patch(PatchPoints),
    /// A mesh of certain cells.
    Mesh {
        /// Cells that it can take; a grid is cut into the first kind.
        cells: &'static [CellKind],
        /// How it fills the points.
        points: MeshPoints,
    },
}

const QUADRILATERALS: &[CellKind] = &[CellKind::Quadrilateral, CellKind::Triangle];
const HEXAHEDRA: &[CellKind] = &[CellKind::Hexahedron, CellKind::Tetrahedron];

/// All methods. The first that takes all cells of a mesh is its default.
pub const METHODS: &[Method] = &[
    Method {
        name: "iga",
        doc: "isogeometric: the NURBS of the body carry the displacement",
        body: MethodBody::Patch(nurbs::integration_points),
        domains: None,
        losses: Losses::Degrees([&losses::PLANE_SPLINES, &losses::SOLID_SPLINES]),
    },
    Method {
        name: "t3",
        doc: "triangles with linear displacement, 1 Gauss point",
        body: MethodBody::Mesh { cells: &[CellKind::Triangle], points: elements::integration_points },
        domains: Some(|mesh, thickness| smoothed::domains(mesh, Smoothing::Element, thickness)),
        losses: Losses::Cells(&[losses::T3]),
    },
    Method {
        name: "t4",
        doc: "tetrahedra with linear displacement, 1 Gauss point",
        body: MethodBody::Mesh { cells: &[CellKind::Tetrahedron], points: elements::integration_points },
        domains: Some(|mesh, thickness| smoothed::domains(mesh, Smoothing::Element, thickness)),
        losses: Losses::Cells(&[losses::T4]),
    },
    Method {
        name: "q4",
        doc: "bilinear quadrilaterals, 2 x 2 Gauss points",
        body: MethodBody::Mesh { cells: QUADRILATERALS, points: elements::integration_points },
        domains: None,
        losses: Losses::Cells(&[losses::Q4, losses::T3]),
    },
    Method {
        name: "b8",
        doc: "trilinear hexahedra, 2 x 2 x 2 Gauss points",
        body: MethodBody::Mesh { cells: HEXAHEDRA, points: elements::integration_points },
        domains: None,
        losses: Losses::Cells(&[losses::B8, losses::T4]),
    },
    Method {
        name: "q4_bbar",
        doc: "q4 with the change of volume averaged over the element, against locking (B-bar)",
        body: MethodBody::Mesh { cells: QUADRILATERALS, points: elements::with_mean_dilatation },
        domains: None,
        losses: Losses::Cells(&[losses::Q4_BBAR, losses::T3]),
    },
    Method {
        name: "b8_bbar",
        doc: "b8 with the change of volume averaged over the element, against locking (B-bar)",
        body: MethodBody::Mesh { cells: HEXAHEDRA, points: elements::with_mean_dilatation },
        domains: None,
        losses: Losses::Cells(&[losses::B8_BBAR, losses::T4]),
    },
    Method {
        name: "smoothed_face",
        doc: "tetrahedra with the strain averaged over faces (FS-FEM): softer than t4, hardly more expensive",
        body: MethodBody::Mesh { cells: &[CellKind::Tetrahedron], points: smoothed::face_points },
        domains: Some(|mesh, thickness| smoothed::domains(mesh, Smoothing::Face, thickness)),
        losses: Losses::Cells(&[losses::SMOOTHED_FACE]),
    },
    Method {
        name: "smoothed_edge",
        doc: "tetrahedra with the strain averaged over edges (ES-FEM): nearest to quadratic tetrahedra on coarse meshes",
        body: MethodBody::Mesh { cells: &[CellKind::Tetrahedron], points: smoothed::edge_points },
        domains: Some(|mesh, thickness| smoothed::domains(mesh, Smoothing::Edge, thickness)),
        losses: Losses::Cells(&[losses::SMOOTHED_EDGE]),
    },
    Method {
        name: "smoothed_node",
        doc: "tetrahedra with the strain averaged over nodes (NS-FEM): softer than the body, for statics",
        body: MethodBody::Mesh { cells: &[CellKind::Tetrahedron], points: smoothed::node_points },
        domains: Some(|mesh, thickness| smoothed::domains(mesh, Smoothing::Node, thickness)),
        losses: Losses::Cells(&[losses::SMOOTHED_NODE]),
    },
    Method {
        name: "smoothed_selective",
        doc: "tetrahedra with shear averaged over faces and volume change over nodes, against locking",
        body: MethodBody::Mesh { cells: &[CellKind::Tetrahedron], points: smoothed::selective_points },
        domains: Some(|mesh, thickness| smoothed::selective(mesh, Smoothing::Face, Smoothing::Node, thickness)),
        losses: Losses::Cells(&[losses::SMOOTHED_SELECTIVE]),
    },
    Method {
        name: "smoothed_triangle",
        doc: "triangles with the strain averaged over edges (ES-FEM)",
        body: MethodBody::Mesh { cells: &[CellKind::Triangle], points: smoothed::edge_points },
        domains: Some(|mesh, thickness| smoothed::domains(mesh, Smoothing::Edge, thickness)),
        losses: Losses::Cells(&[losses::SMOOTHED_TRIANGLE]),
    },
];

/// The method of this name.
pub fn find(name: &str) -> Option<&'static Method> {
    METHODS.iter().find(|method| method.name == name)
}

/// The method that a mesh gets when nobody names one.
pub fn default_for(mesh: &Mesh) -> &'static Method {
    let fits = |method: &&Method| method.check(mesh).is_ok();
    METHODS.iter().find(fits).expect("b8 and q4 take every cell of their dimension")
}

impl Method {
    /// Directions of its bodies; `None` when it takes both 2 and 3.
    pub fn dimension(&self) -> Option<usize> {
        self.cell().map(CellKind::dimension)
    }

    /// The cells that a grid is cut into for this method; `None` for a method that works on patches.
    pub fn cell(&self) -> Option<CellKind> {
        match self.body {
            MethodBody::Patch(_) => None,
            MethodBody::Mesh { cells, .. } => Some(cells[0]),
        }
    }

    /// Whether the method makes use of the knots and weights of a patch.
    pub fn works_on_patches(&self) -> bool {
        matches!(self.body, MethodBody::Patch(_))
    }

    /// Checks that it can take every cell of a mesh.
    ///
    /// # Errors
    /// [`Error::Input`] at `reference.method` with the first cell that does not fit and the methods that would.
    pub fn check(&self, mesh: &Mesh) -> Result<()> {
        let cells: &[CellKind] = match self.body {
            MethodBody::Patch(_) => &[],
            MethodBody::Mesh { cells, .. } => cells,
        };
        let Some(cell) = (0..mesh.cells()).find(|&cell| !cells.contains(&mesh.kind(cell))) else { return Ok(()) };
        let takes_all = |method: &&Method| match method.body {
            MethodBody::Patch(_) => false,
            MethodBody::Mesh { cells, .. } => (0..mesh.cells()).all(|cell| cells.contains(&mesh.kind(cell))),
        };
        let others: Vec<&str> = METHODS.iter().filter(takes_all).map(|method| method.name).collect();
        Err(Error::input(
            "reference.method",
            format!("\"{}\" cannot take cell {cell} of the mesh, a {}", self.name, cell_name(mesh.kind(cell))),
            format!("methods for this mesh are {}", others.join(", ")),
        ))
    }
}

fn cell_name(kind: CellKind) -> &'static str {
    match kind {
        CellKind::Triangle => "triangle",
        CellKind::Quadrilateral => "quadrilateral",
        CellKind::Tetrahedron => "tetrahedron",
        CellKind::Hexahedron => "hexahedron",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mesh_has_a_method_and_every_method_a_name() {
        for (dimension, kinds, method) in [
            (2, vec![CellKind::Triangle], "t3"),
            (2, vec![CellKind::Quadrilateral], "q4"),
            (2, vec![CellKind::Triangle, CellKind::Quadrilateral], "q4"),
            (3, vec![CellKind::Tetrahedron], "t4"),
            (3, vec![CellKind::Hexahedron, CellKind::Tetrahedron], "b8"),
        ] {
            let mut mesh = Mesh::new(dimension, vec![[0.0; 3]; 8]);
            kinds.iter().for_each(|&kind| mesh.push(kind, &(0..kind.corners() as u32).collect::<Vec<_>>()));
            assert_eq!(default_for(&mesh).name, method);
            assert!(find("iga").expect("in the table").check(&mesh).is_err());
        }
        for (i, method) in METHODS.iter().enumerate() {
            assert!(METHODS[..i].iter().all(|other| other.name != method.name) && !method.doc.is_empty());
        }
    }
}
