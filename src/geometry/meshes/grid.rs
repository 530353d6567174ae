//! Quadrilaterals and hexahedra on a structured grid of points, and flat meshes drawn out into space.
//!
//! Nodes of a grid are numbered as in [`Grid`], the last index fastest, so the mesh on the control grid of a patch has the nodes
//! of the patch. Node i in layer k of a drawn-out mesh has the number i + k n, n nodes in a layer.

use crate::geometry::grid::Grid;
use crate::geometry::mesh::{CellKind, Mesh};

/// The cells of a grid between its points: quadrilaterals with two directions, hexahedra with three. They have a
/// positive measure when the directions of the grid are right-handed.
///
/// # Panics
/// When there are not as many points as the grid has nodes, or more than u32 can number.
pub fn structured(grid: &Grid, points: Vec<[f64; 3]>) -> Mesh {
    assert_eq!(grid.len(), points.len(), "a point for every node of the grid");
    assert!(u32::try_from(points.len()).is_ok(), "the nodes can be numbered");
    let mut mesh = Mesh::new(grid.dimension(), points);
    let cells = grid.extents().map(|nodes| nodes.saturating_sub(1));
    let flat = grid.dimension() == 2;
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            for k in 0..if flat { 1 } else { cells[2] } {
                let square =
                    |k| [[i, j, k], [i + 1, j, k], [i + 1, j + 1, k], [i, j + 1, k]].map(|at| grid.node(at) as u32);
                if flat {
                    mesh.push(CellKind::Quadrilateral, &square(0));
                } else {
                    mesh.push(CellKind::Hexahedron, &[square(k), square(k + 1)].concat());
                }
            }
        }
    }
    mesh
}

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
    let points = (0..grid.len()).map(at).collect();
    structured(&grid, points)
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
