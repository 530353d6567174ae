//! The exact body as rational Bezier cells, one a knot span.
//!
//! Every non-empty span of a NURBS patch is one rational Bezier piece with its own control points and weights, so that
//! a viewer that knows such cells shows the true shape. Neighbours share the control points of their common face: in
//! direction a, s_a spans of degree p_a make a grid of s_a p_a + 1 Bezier points.
//!
//! The reference displacement lives in the same functions as the shape. Its Bezier coefficients come out of the same
//! cut: the control points' displacements take the place of their positions, in homogeneous form (w u, w).
//!
//! VTK numbers the points of a cell by corners, edges, faces, inside. The first parameter runs fastest inside edges, faces and cell. In a
//! file below version 2.1, as ours is, the upright edges of a hexahedron come in the order of a grid: the last two are the
//! other way round than in `vtkBezierHexahedron` of VTK 9, whose reader exchanges them.

use crate::error::Result;
use crate::geometry::grid::Grid;
use crate::geometry::patch::Patch;
use crate::geometry::refine::bezier_elements;

use super::Calibrated;
use super::vtu::{self, Cells, Field, UnstructuredGrid, Values};

/// The text of body.vtu of a patch.
///
/// # Errors
/// When a displacement is not finite.
pub fn document(patch: &Patch, results: &Calibrated) -> Result<Vec<u8>> {
    let net = BezierNet::of(patch);
    let (points, weights) = net.points(patch);
    let mut point_fields = vec![Field::scalar(vtu::RATIONAL_WEIGHTS, weights)];
    for case in results.cases {
        let moved = with_points(patch, case.reference)?;
        point_fields.push(Field::vector(results.field_name("displacement_reference", case), &net.points(&moved).0));
    }
    let cells = net.spans.iter().product::<usize>();
    let degrees = net.degree.map(|p| p as f64).repeat(cells);
    Ok(vtu::document(&UnstructuredGrid {
        points,
        cells: Cells::equal(
            if patch.dimension() == 2 { vtu::BEZIER_QUADRILATERAL } else { vtu::BEZIER_HEXAHEDRON },
            net.degree.iter().map(|p| p + 1).product(),
            net.connectivity(patch.dimension()),
        ),
        point_fields,
        cell_fields: vec![Field {
            name: vtu::HIGHER_ORDER_DEGREES.into(),
            components: 3,
            values: Values::Float(degrees),
        }],
    }))
}

/// The same patch with other control points.
fn with_points(patch: &Patch, points: &[[f64; 3]]) -> Result<Patch> {
    let knots = (0..patch.dimension()).map(|a| patch.knots(a).clone()).collect();
    Patch::new(knots, points.to_vec(), patch.weights().to_vec())
}

/// The grid of all Bezier points of a patch.
struct BezierNet {
    degree: [usize; 3],
    spans: [usize; 3],
    grid: Grid,
}

impl BezierNet {
    fn of(patch: &Patch) -> Self {
        let degree = patch.degree();
        let spans = std::array::from_fn(|a| if a < patch.dimension() { patch.knots(a).spans().len() } else { 1 });
        let extents: [usize; 3] = std::array::from_fn(|a| spans[a] * degree[a] + 1);
        Self { degree, spans, grid: Grid::new(&extents) }
    }

    /// First Bezier point of every cell, in the order of the elements.
    fn cells(&self) -> Vec<[usize; 3]> {
        let elements = Grid::new(&self.spans);
        (0..elements.len()).map(|e| elements.index(e)).map(|e| std::array::from_fn(|a| e[a] * self.degree[a])).collect()
    }

    /// Control points and weights of the pieces on the whole grid.
    fn points(&self, patch: &Patch) -> (Vec<[f64; 3]>, Vec<f64>) {
        let mut points = vec![[0.0; 3]; self.grid.len()];
        let mut weights = vec![0.0; self.grid.len()];
        let local = Grid::new(&self.degree.map(|p| p + 1));
        for (piece, first) in bezier_elements(patch).iter().zip(self.cells()) {
            for i in 0..local.len() {
                let index = local.index(i);
                let node = self.grid.node(std::array::from_fn(|a| first[a] + index[a]));
                points[node] = piece.points[i];
                weights[node] = piece.weights[i];
            }
        }
        (points, weights)
    }

    /// Bezier points of every cell in VTK's order.
    fn connectivity(&self, dimension: usize) -> Vec<u32> {
        let order = if dimension == 2 { quadrilateral(self.degree) } else { hexahedron(self.degree) };
        let of_cell = |first: [usize; 3]| {
            order.iter().map(move |local| self.grid.node(std::array::from_fn(|a| first[a] + local[a])) as u32)
        };
        self.cells().into_iter().flat_map(of_cell).collect()
    }
}

/// Local indices of a Bezier quadrilateral in VTK's order: corners and edges around, then the inside.
fn quadrilateral([p, q, _]: [usize; 3]) -> Vec<[usize; 3]> {
    let mut order = vec![[0, 0, 0], [p, 0, 0], [p, q, 0], [0, q, 0]];
    order.extend(around(p, q, 0));
    order.extend(inside(q).flat_map(|j| inside(p).map(move |i| [i, j, 0])));
    order
}

/// Local indices of a Bezier hexahedron in VTK's order, as in files below version 2.1.
fn hexahedron([p, q, r]: [usize; 3]) -> Vec<[usize; 3]> {
    let corners = [[0, 0], [p, 0], [p, q], [0, q]];
    let upright = [[0, 0], [p, 0], [0, q], [p, q]];
    let mut order: Vec<[usize; 3]> = [0, r].iter().flat_map(|&k| corners.map(|[i, j]| [i, j, k])).collect();
    order.extend([0, r].into_iter().flat_map(|k| around(p, q, k)));
    order.extend(upright.into_iter().flat_map(|[i, j]| inside(r).map(move |k| [i, j, k])));
    order.extend([0, p].into_iter().flat_map(|i| inside(r).flat_map(move |k| inside(q).map(move |j| [i, j, k]))));
    order.extend([0, q].into_iter().flat_map(|j| inside(r).flat_map(move |k| inside(p).map(move |i| [i, j, k]))));
    order.extend([0, r].into_iter().flat_map(|k| inside(q).flat_map(move |j| inside(p).map(move |i| [i, j, k]))));
    order.extend(inside(r).flat_map(|k| inside(q).flat_map(move |j| inside(p).map(move |i| [i, j, k]))));
    order
}

/// The points inside the four edges of one layer k: low j, high i, high j, low i, each with its index ascending.
fn around(p: usize, q: usize, k: usize) -> Vec<[usize; 3]> {
    let mut edges: Vec<[usize; 3]> = inside(p).map(|i| [i, 0, k]).collect();
    edges.extend(inside(q).map(|j| [p, j, k]));
    edges.extend(inside(p).map(|i| [i, q, k]));
    edges.extend(inside(q).map(|j| [0, j, k]));
    edges
}

/// The indices strictly between 0 and the degree.
fn inside(degree: usize) -> std::ops::Range<usize> {
    1..degree.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `vtkBezierQuadrilateral::PointIndexFromIJK` and `vtkBezierHexahedron::PointIndexFromIJK` of VTK 9.7 behind its reader of
    /// files of version 1.0, which exchanges the last two upright edges.
    #[test]
    fn vtk_point_numbering_of_files_of_version_1() {
        let flat =
            |order: Vec<[usize; 3]>| order.iter().map(|[i, j, k]| format!("{i}{j}{k}")).collect::<Vec<_>>().join(" ");
        assert_eq!(flat(quadrilateral([3, 2, 0])), "000 300 320 020 100 200 310 120 220 010 110 210");
        assert_eq!(
            flat(hexahedron([2, 2, 2])),
            "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 021 221 011 211 101 121 110 112 111"
        );
        assert_eq!(
            flat(hexahedron([3, 2, 1])),
            "000 300 320 020 001 301 321 021 100 200 310 120 220 010 101 201 311 121 221 011 110 210 111 211"
        );
        assert_eq!(flat(hexahedron([1, 1, 1])), "000 100 110 010 001 101 111 011");
    }

    #[test]
    fn every_point_is_numbered_once() {
        for degree in [[2, 2, 2], [3, 4, 2], [1, 5, 2], [4, 3, 1]] {
            let mut order = hexahedron(degree);
            order.sort_unstable();
            order.dedup();
            assert_eq!(order.len(), degree.iter().map(|p| p + 1).product::<usize>());
        }
    }
}
