//! How good the cells of a mesh are.
//!
//! - The measure V of a cell (m^2 or m^3), positive when it is numbered right.
//! - The smallest angle of triangles (at a corner) and tetrahedra (between two faces, the dihedral angle), in degrees: 60 and
//!   70.53 in the regular ones. With the outward normals n of two faces it is atan2(|n1 x n2|, -n1 . n2).
//! - The scaled Jacobian of quadrilaterals and hexahedra: at every corner the determinant of the edges that leave it, each
//!   divided by its length; the smallest of them. 1 in a rectangle, 0 at a straight angle, negative where the cell is folded.
//!
//! A cell is *inverted* when its measure is not positive or a corner is folded.

use super::measure::{cross, determinant, difference, dot};
use super::{CellKind, Mesh};

/// The worst of a mesh, and where it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Number of cells.
    pub cells: usize,
    /// Area (m^2) or volume (m^3) of all cells together.
    pub measure: f64,
    /// The smallest measure of a cell and the cell.
    pub least_measure: (f64, u32),
    /// Smallest angle of triangles and tetrahedra (degrees) and its cell; none without such cells.
    pub least_angle: Option<(f64, u32)>,
    /// Smallest scaled Jacobian of quadrilaterals and hexahedra and its cell; none without such cells.
    pub least_jacobian: Option<(f64, u32)>,
    /// Cells whose measure is not positive, or with a folded corner, ascending.
    pub inverted: Vec<u32>,
}

impl Quality {
    /// Mean measure of a cell (m^2 or m^3).
    pub fn mean_measure(&self) -> f64 {
        self.measure / self.cells as f64
    }
}

/// Looks at every cell; none for a mesh without cells.
pub fn quality(mesh: &Mesh) -> Option<Quality> {
    if mesh.cells() == 0 {
        return None;
    }
    let mut result = Quality {
        cells: mesh.cells(),
        measure: 0.0,
        least_measure: (f64::INFINITY, 0),
        least_angle: None,
        least_jacobian: None,
        inverted: Vec::new(),
    };
    for cell in 0..mesh.cells() {
        let measure = mesh.measure(cell);
        result.measure += measure;
        if measure < result.least_measure.0 {
            result.least_measure = (measure, cell as u32);
        }
        let mut folded = false;
        match mesh.kind(cell) {
            CellKind::Triangle => keep_least(&mut result.least_angle, triangle_angle(mesh, cell), cell),
            CellKind::Tetrahedron => keep_least(&mut result.least_angle, dihedral_angle(mesh.places(cell)), cell),
            CellKind::Quadrilateral | CellKind::Hexahedron => {
                let jacobian = scaled_jacobian(mesh, cell);
                folded = jacobian <= 0.0;
                keep_least(&mut result.least_jacobian, jacobian, cell);
            }
        }
        if folded || measure <= 0.0 {
            result.inverted.push(cell as u32);
        }
    }
    Some(result)
}

fn keep_least(least: &mut Option<(f64, u32)>, value: f64, cell: usize) {
    if least.is_none_or(|(before, _)| value < before) {
        *least = Some((value, cell as u32));
    }
}

/// Smallest corner angle of a triangle in degrees.
fn triangle_angle(mesh: &Mesh, cell: usize) -> f64 {
    let x: [[f64; 3]; 3] = mesh.places(cell);
    let angle = |corner: usize| {
        let (a, b) = (difference(x[(corner + 1) % 3], x[corner]), difference(x[(corner + 2) % 3], x[corner]));
        let normal = cross(a, b);
        dot(normal, normal).sqrt().atan2(dot(a, b)).to_degrees()
    };
    (0..3).map(angle).fold(f64::INFINITY, f64::min)
}

/// Smallest angle between two faces of a tetrahedron in degrees.
fn dihedral_angle(x: [[f64; 3]; 4]) -> f64 {
    let faces = CellKind::Tetrahedron.faces();
    let normals: [[f64; 3]; 4] = std::array::from_fn(|face| {
        let [a, b, c] = [faces[face][0], faces[face][1], faces[face][2]].map(|corner| x[corner]);
        cross(difference(b, a), difference(c, a))
    });
    let mut least = f64::INFINITY;
    for first in 0..4 {
        for second in first + 1..4 {
            let side = cross(normals[first], normals[second]);
            let angle = dot(side, side).sqrt().atan2(-dot(normals[first], normals[second])).to_degrees();
            least = least.min(angle);
        }
    }
    least
}

/// Smallest scaled Jacobian over the corners; 0 where an edge has no length.
fn scaled_jacobian(mesh: &Mesh, cell: usize) -> f64 {
    let corners = mesh.corners(cell);
    let at = |corner: usize| mesh.positions()[corners[corner] as usize];
    let corner = |(corner, others): (usize, &&[usize])| {
        let unit = |other: usize| {
            let edge = difference(at(others[other]), at(corner));
            let length = dot(edge, edge).sqrt();
            edge.map(|component| if length > 0.0 { component / length } else { 0.0 })
        };
        let third = if others.len() == 3 { unit(2) } else { [0.0, 0.0, 1.0] };
        determinant([unit(0), unit(1), third])
    };
    mesh.kind(cell).around().iter().enumerate().map(corner).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::meshes::kuhn::kuhn_box;

    #[test]
    fn regular_cells_have_their_angles() {
        let mut triangle = Mesh::new(2, vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.75f64.sqrt(), 0.0]]);
        triangle.push(CellKind::Triangle, &[0, 1, 2]);
        assert!((quality(&triangle).unwrap().least_angle.unwrap().0 - 60.0).abs() < 1e-13);
        let regular = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        assert!((dihedral_angle(regular) - (1.0f64 / 3.0).acos().to_degrees()).abs() < 1e-13);
        let kuhn = quality(&kuhn_box([1.0; 3], [2; 3])).unwrap();
        assert!((kuhn.least_angle.unwrap().0 - 45.0).abs() < 1e-12);
        assert!((kuhn.measure - 1.0).abs() < 1e-15 && kuhn.inverted.is_empty());
        assert!((kuhn.mean_measure() - 1.0 / 48.0).abs() < 1e-16);
    }

    #[test]
    fn every_corner_of_a_box_is_right_handed_and_a_fold_is_found() {
        let plane = [[0.0; 3], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mut space = Mesh::new(3, plane.iter().copied().chain(plane.map(|[x, y, _]| [x, y, 2.0])).collect());
        space.push(CellKind::Hexahedron, &[0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(quality(&space).unwrap().least_jacobian, Some((1.0, 0)));
        let mut dart = Mesh::new(2, vec![[0.0; 3], [1.0, 0.0, 0.0], [0.2, 0.2, 0.0], [0.0, 1.0, 0.0]]);
        dart.push(CellKind::Quadrilateral, &[0, 1, 2, 3]);
        let found = quality(&dart).unwrap();
        assert_eq!(found.inverted, [0]);
        assert!(found.least_measure.0 > 0.0 && found.least_jacobian.unwrap().0 < 0.0);
        assert_eq!(quality(&Mesh::new(2, Vec::new())), None);
    }
}
