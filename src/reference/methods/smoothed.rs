//! Smoothed finite elements: linear simplices whose gradients are averaged over smoothing domains.
//!
//! A linear triangle or tetrahedron e has constant gradients g_ea = dN_a/dx and the measure V_e. Smoothing hands a share
//! w of every cell to each of its faces, edges or nodes; a *domain* k is what one face, edge or node collects, and all
//! strain in it is the average
//!
//! ```text
//!     V_k = sum_e w V_e        gbar_ka = (1/V_k) sum_e w V_e g_ea        a over all nodes of the cells of k
//! ```
//!
//! | [`Smoothing`] | a domain per | w in space | w in the plane |
//! |---|---|---|---|
//! | `Element` | cell: ordinary finite elements | 1 | 1 |
//! | `Face` | triangle between two tetrahedra or on the surface | 1/4 | |
//! | `Edge` | edge | 1/6 | 1/3 |
//! | `Node` | node | 1/4 | 1/3 |
//!
//! (G. R. Liu and T. Nguyen-Thoi, Smoothed Finite Element Methods, CRC Press, 2010; T. Nguyen-Thoi et al., Int. J. Numer.
//! Meth. Engng 78, 2009.) The literature writes gbar as an integral of the normal over the surface of the domain; by the
//! divergence theorem that is the same number, and the average needs neither centroids nor normals. An edge domain is an
//! average of face domains and a node domain one of edge domains, so by convexity K_element >= K_face >= K_edge >= K_node
//! in the order of quadratic forms: each is softer than the one before, on every mesh.
//!
//! *Selective* smoothing takes mu from faces and lambda from nodes, so that nearly incompressible bodies do not lock.
//! Averages over nodes alone leave the body too soft and let it flicker: they are for statics.

mod carriers;
mod cells;
mod domains;

pub use cells::Cells;
pub use domains::{Acting, Domains, Member};

use crate::error::Result;
use crate::geometry::mesh::Mesh;
use crate::reference::points::{IntegrationPoints, Part};

/// What carries a domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Smoothing {
    /// Every cell is its own domain: finite elements without smoothing.
    Element,
    /// The triangles of a tetrahedral mesh.
    Face,
    /// The edges.
    Edge,
    /// The nodes.
    Node,
}

impl Smoothing {
    /// Corners of a carrier in `dimension` directions; faces of triangles are their edges.
    fn corners(self, dimension: usize) -> usize {
        match self {
            Self::Element => dimension + 1,
            Self::Face => dimension,
            Self::Edge => 2,
            Self::Node => 1,
        }
    }
}

/// The domains of a mesh of triangles or of tetrahedra; `thickness` in m multiplies volumes in two dimensions.
///
/// # Errors
/// [`crate::error::Error::Input`] at `geometry` for cells of another kind, cells without positive measure, and, where
/// faces carry domains, a face between more than two cells.
pub fn domains(mesh: &Mesh, smoothing: Smoothing, thickness: f64) -> Result<Domains> {
    Domains::averaged(mesh, thickness, &[(smoothing, Part::Whole)])
}

/// Two sets of domains over one mesh: the shear of the material acts on the first, its volume change on the second.
///
/// # Errors
/// As [`domains`].
pub fn selective(mesh: &Mesh, shear: Smoothing, volume: Smoothing, thickness: f64) -> Result<Domains> {
    Domains::averaged(mesh, thickness, &[(shear, Part::Shear), (volume, Part::Volume)])
}

/// Face smoothing of a mesh, for the table of methods; as [`domains`].
///
/// # Errors
/// As [`domains`].
pub fn face_points(mesh: &Mesh, thickness: f64) -> Result<IntegrationPoints<'_>> {
    domains(mesh, Smoothing::Face, thickness)?.into_points(mesh)
}

/// Edge smoothing of a mesh, for the table of methods; as [`domains`].
///
/// # Errors
/// As [`domains`].
pub fn edge_points(mesh: &Mesh, thickness: f64) -> Result<IntegrationPoints<'_>> {
    domains(mesh, Smoothing::Edge, thickness)?.into_points(mesh)
}

/// Node smoothing of a mesh, for the table of methods; as [`domains`].
///
/// # Errors
/// As [`domains`].
pub fn node_points(mesh: &Mesh, thickness: f64) -> Result<IntegrationPoints<'_>> {
    domains(mesh, Smoothing::Node, thickness)?.into_points(mesh)
}

/// Shear over faces, volume change over nodes, for the table of methods; as [`selective`].
///
/// # Errors
/// As [`domains`].
pub fn selective_points(mesh: &Mesh, thickness: f64) -> Result<IntegrationPoints<'_>> {
    selective(mesh, Smoothing::Face, Smoothing::Node, thickness)?.into_points(mesh)
}
