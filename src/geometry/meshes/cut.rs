//! Quadrilaterals cut into triangles, hexahedra into tetrahedra.
//!
//! A quadrilateral is cut along its shorter diagonal; along the other one when a triangle would be folded; along 0-2
//! where both are equally long.
//!
//! A hexahedron is a pyramid from its corner of the smallest number over each of the three faces that do not have that corner.
//! Every face is cut by the diagonal through its smallest number, which its other cell finds as well: the mesh is conforming,
//! whatever the mesh of hexahedra. There are always six tetrahedra; on a grid numbered along its directions they are those of
//! Kuhn (`kuhn`).

use crate::geometry::mesh::measure::triangle_area;
use crate::geometry::mesh::{CellKind, Mesh};

/// The mesh with every quadrilateral in two triangles or every hexahedron in six tetrahedra, in the order of the cells; the
/// nodes stay. Triangles and tetrahedra are kept.
pub fn simplices(mesh: &Mesh) -> Mesh {
    let mut cut = Mesh::new(mesh.dimension(), mesh.positions().to_vec());
    for cell in 0..mesh.cells() {
        match mesh.kind(cell) {
            kind @ (CellKind::Triangle | CellKind::Tetrahedron) => cut.push(kind, mesh.corners(cell)),
            CellKind::Quadrilateral => {
                halves(mesh, cell).iter().for_each(|triangle| cut.push(CellKind::Triangle, triangle));
            }
            CellKind::Hexahedron => {
                sixths(mesh.corners(cell)).iter().for_each(|tetrahedron| cut.push(CellKind::Tetrahedron, tetrahedron));
            }
        }
    }
    cut
}

/// The two triangles of a quadrilateral.
fn halves(mesh: &Mesh, cell: usize) -> [[u32; 3]; 2] {
    /// Diagonals whose squares differ by less than this share count as equally long.
    const EQUAL: f64 = 1e-9;
    let x: [[f64; 3]; 4] = mesh.places(cell);
    let square = |a: usize, b: usize| (0..2).map(|axis| (x[a][axis] - x[b][axis]).powi(2)).sum::<f64>();
    let first = [[0, 1, 2], [0, 2, 3]];
    let second = [[0, 1, 3], [1, 2, 3]];
    let folded =
        |halves: &[[usize; 3]; 2]| halves.iter().any(|half| triangle_area(half.map(|corner| x[corner])) <= 0.0);
    let shorter = square(0, 2) <= square(1, 3) * (1.0 + EQUAL);
    let (wanted, other) = if shorter { (first, second) } else { (second, first) };
    let chosen = if folded(&wanted) && !folded(&other) { other } else { wanted };
    let corners = mesh.corners(cell);
    chosen.map(|half| half.map(|corner| corners[corner]))
}

/// The six tetrahedra of a hexahedron.
fn sixths(corners: &[u32]) -> [[u32; 4]; 6] {
    let apex = (0..8).min_by_key(|&corner| corners[corner]).expect("a hexahedron has corners");
    let mut found = [[0; 4]; 6];
    let faces = CellKind::Hexahedron.faces().iter().filter(|face| !face.contains(&apex));
    for (pair, face) in found.chunks_mut(2).zip(faces) {
        let first = (0..4).min_by_key(|&i| corners[face[i]]).expect("a face has corners");
        let [a, b, c, d] = [0, 1, 2, 3].map(|step| corners[face[(first + step) % 4]]);
        // Seen from outside the face is counter-clockwise, from the apex inside clockwise.
        pair[0] = [a, c, b, corners[apex]];
        pair[1] = [a, d, c, corners[apex]];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::quality::quality;
    use crate::geometry::meshes::grid::regular;
    use crate::geometry::meshes::kuhn::kuhn_box;
    use crate::rng::Stream;

    #[test]
    fn a_grid_of_hexahedra_becomes_the_tetrahedra_of_kuhn() {
        let sorted = |mesh: &Mesh| {
            let mut cells: Vec<Vec<[u64; 3]>> = (0..mesh.cells())
                .map(|cell| {
                    let mut places: Vec<[u64; 3]> = mesh.places::<4>(cell).map(|x| x.map(f64::to_bits)).to_vec();
                    places.sort_unstable();
                    places
                })
                .collect();
            cells.sort_unstable();
            cells
        };
        let ours = simplices(&regular([1.0, 2.0, 3.0], [2, 3, 2]));
        assert_eq!(sorted(&ours), sorted(&kuhn_box([1.0, 2.0, 3.0], [2, 3, 2])));
        assert!(quality(&ours).unwrap().inverted.is_empty());
    }

    /// The nodes of a grid numbered at random: the cut must still be conforming, since every face counts its cells.
    #[test]
    fn hexahedra_numbered_anyhow_are_cut_conformingly() {
        let grid = regular([1.0; 3], [3; 3]);
        let mut order: Vec<u32> = (0..grid.positions().len() as u32).collect();
        let mut stream = Stream::new(5, 0, 0);
        (1..order.len()).rev().for_each(|i| order.swap(i, stream.below(i + 1)));
        let mut places = vec![[0.0; 3]; order.len()];
        order.iter().zip(grid.positions()).for_each(|(&node, &place)| places[node as usize] = place);
        let mut mixed = Mesh::new(3, places);
        for cell in 0..grid.cells() {
            let corners: Vec<u32> = grid.corners(cell).iter().map(|&node| order[node as usize]).collect();
            mixed.push(CellKind::Hexahedron, &corners);
        }
        let cut = simplices(&mixed);
        let found = quality(&cut).unwrap();
        assert!((found.measure - 1.0).abs() < 1e-14 && found.inverted.is_empty());
        assert_eq!(cut.cells(), 6 * 27);
        assert_eq!(cut.boundary_faces().unwrap().len(), 2 * 6 * 9);
    }

    #[test]
    fn a_dart_is_cut_through_its_inner_corner() {
        let mut dart = Mesh::new(2, vec![[0.0; 3], [1.0, 0.0, 0.0], [0.2, 0.2, 0.0], [0.0, 1.0, 0.0]]);
        dart.push(CellKind::Quadrilateral, &[0, 1, 2, 3]);
        let cut = simplices(&dart);
        assert_eq!((cut.corners(0), cut.corners(1)), ([0, 1, 2].as_slice(), [0, 2, 3].as_slice()));
        assert!(quality(&cut).unwrap().inverted.is_empty());
        let flat = simplices(&regular([2.0, 1.0, 0.0], [2, 1, 0]));
        assert_eq!((flat.cells(), quality(&flat).unwrap().measure), (4, 2.0));
    }
}
