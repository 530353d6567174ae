//! Boxes of equal cells (see [`crate::geometry::grid_mesh`]), and flat meshes drawn out into space.
//!
//! Nodes of a box are numbered as in [`Grid`], the last index fastest. Node i in layer k of a drawn-out mesh has the number i + k n, n nodes in a layer.

use crate::geometry::grid::Grid;
use crate::geometry::grid_mesh::mesh_of_grid;
use crate::geometry::mesh::{CellKind, Mesh};

/// The box [0, size] (m) in `cells` cells along each axis; flat, in quadrilaterals, when `cells[2]` is 0.
///
/// # Panics
/// When a direction has no cell, or there are more nodes than u32 can number.
pub fn regular(size: [f64; 3], cells: [usize; 3]) -> Mesh {
    let dimension = if cells[2] == 0 { 2 } else { 3 };
    assert!(cells[..dimension].iter().all(|&n| n > 0), "at least one cell along each axis");
    let grid = Grid::new(&cells.map(|n| n + 1)[..dimension]);
    let along =
        |axis: usize, index: usize| if cells[axis] == 0 { 0.0 } else { size[axis] * index as f64 / cells[axis] as f64 };
    let at = |node| {
        let index = grid.index(node);
        std::array::from_fn(|axis| along(axis, index[axis]))
    };
    let kind = if dimension == 2 { CellKind::Quadrilateral } else { CellKind::Hexahedron };
    mesh_of_grid(&grid, (0..grid.len()).map(at).collect(), kind)
}

/// Quadrilaterals drawn out along z into `layers` layers of hexahedra, to the height `length` (m).
///
/// # Panics
/// When the mesh is not flat and of quadrilaterals, there is no layer, or there are more nodes than u32 can number.
pub fn extruded(flat: &Mesh, length: f64, layers: usize) -> Mesh {
    assert!(flat.dimension() == 2 && layers > 0, "a flat mesh and at least one layer");
    let nodes = flat.positions().len();
    assert!(u32::try_from(nodes * (layers + 1)).is_ok(), "the nodes can be numbered");
    let height = |layer: usize| length * layer as f64 / layers as f64;
    let places = (0..=layers).flat_map(|layer| flat.positions().iter().map(move |&[x, y, _]| [x, y, height(layer)]));
    let mut mesh = Mesh::new(3, places.collect());
    for layer in 0..layers {
        for cell in 0..flat.cells() {
            assert_eq!(flat.kind(cell), CellKind::Quadrilateral, "only quadrilaterals become hexahedra");
            let mut corners = [0; 8];
            for (i, &node) in flat.corners(cell).iter().enumerate() {
                corners[i] = node + (layer * nodes) as u32;
                corners[i + 4] = node + ((layer + 1) * nodes) as u32;
            }
            mesh.push(CellKind::Hexahedron, &corners);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::quality::quality;

    #[test]
    fn a_grid_has_the_cells_and_the_measure_of_its_box() {
        let flat = regular([2.0, 3.0, 0.0], [4, 2, 0]);
        assert_eq!((flat.dimension(), flat.cells(), flat.positions().len()), (2, 8, 15));
        assert_eq!(flat.corners(0), [0, 3, 4, 1]);
        assert_eq!(quality(&flat).unwrap().least_measure.0, 0.75);
        let space = regular([2.0, 3.0, 1.0], [4, 2, 3]);
        let found = quality(&space).unwrap();
        assert_eq!((space.cells(), space.positions().len()), (24, 60));
        assert!((found.measure - 6.0).abs() < 1e-14 && found.least_jacobian.unwrap().0 == 1.0);
        assert_eq!(space.faces().unwrap().len(), (5 * 2 * 3) + (4 * 3 * 3) + (4 * 2 * 4));
    }

    #[test]
    fn a_drawn_out_mesh_is_the_flat_one_times_its_height() {
        let mesh = extruded(&regular([2.0, 3.0, 0.0], [4, 2, 0]), 0.5, 3);
        let found = quality(&mesh).unwrap();
        assert_eq!((mesh.cells(), mesh.positions().len()), (24, 60));
        assert!((found.measure - 3.0).abs() < 1e-14 && found.inverted.is_empty());
    }
}
