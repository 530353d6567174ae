//! Area and volume of cells, and cells numbered the wrong way round.
//!
//! A triangle with the edges d1, d2 from its first corner has A = (d1 x d2)_z / 2 (m^2), a tetrahedron with d1, d2, d3
//! V = det(d1, d2, d3) / 6 (m^3). A quadrilateral is two triangles, whichever diagonal cuts it. A hexahedron is measured by the
//! divergence theorem over its faces: the bilinear face halves the space between its two cuts into triangles, so the mean
//! of the two is exact.
//!
//! All are signed: a cell numbered the other way round has a negative measure.

use super::{CellKind, Mesh};

/// Signed volume (m^3) of a tetrahedron from its corners (m).
pub fn tetrahedron_volume(x: [[f64; 3]; 4]) -> f64 {
    determinant([difference(x[1], x[0]), difference(x[2], x[0]), difference(x[3], x[0])]) / 6.0
}

/// Signed area (m^2) of a triangle in the plane from its corners (m).
pub fn triangle_area(x: [[f64; 3]; 3]) -> f64 {
    let (a, b) = (difference(x[1], x[0]), difference(x[2], x[0]));
    (a[0] * b[1] - a[1] * b[0]) / 2.0
}

impl Mesh {
    /// Signed area (m^2) or volume (m^3) of a cell.
    pub fn measure(&self, cell: usize) -> f64 {
        match self.kind(cell) {
            CellKind::Triangle => triangle_area(self.places(cell)),
            CellKind::Quadrilateral => {
                let [a, b, c, d] = self.places(cell);
                triangle_area([a, b, c]) + triangle_area([a, c, d])
            }
            CellKind::Tetrahedron => tetrahedron_volume(self.places(cell)),
            CellKind::Hexahedron => hexahedron_volume(self.places(cell)),
        }
    }

    /// Turns the cells of negative measure, and says how many.
    pub fn orient(&mut self) -> usize {
        let negative: Vec<usize> = (0..self.cells()).filter(|&cell| self.measure(cell) < 0.0).collect();
        for &cell in &negative {
            let start = self.starts[cell] as usize;
            let mut before = [0; 8];
            let order = self.kinds[cell].turned();
            before[..order.len()].copy_from_slice(self.corners(cell));
            for (i, &corner) in order.iter().enumerate() {
                self.corners[start + i] = before[corner];
            }
        }
        negative.len()
    }
}

/// Volume between the six bilinear faces.
fn hexahedron_volume(x: [[f64; 3]; 8]) -> f64 {
    let from_first = x.map(|corner| difference(corner, x[0]));
    let cone = |a: usize, b: usize, c: usize| determinant([from_first[a], from_first[b], from_first[c]]) / 6.0;
    let half = |face: &&[usize]| {
        let [a, b, c, d] = [face[0], face[1], face[2], face[3]];
        0.5 * (cone(a, b, c) + cone(a, c, d) + cone(a, b, d) + cone(b, c, d))
    };
    CellKind::Hexahedron.faces().iter().map(half).sum()
}

/// a - b.
pub(super) fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// Cross product.
pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Scalar product.
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a . (b x c).
pub(super) fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    dot(a, cross(b, c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_of_a_box_is_a_sixth_of_it() {
        let corner = [[1.0, 1.0, 1.0], [3.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 6.0]];
        assert_eq!(tetrahedron_volume(corner), 5.0);
        assert_eq!(tetrahedron_volume([corner[0], corner[2], corner[1], corner[3]]), -5.0);
    }

    /// A trilinear cell against the integral of its Jacobian by two Gauss points a direction, which is exact.
    #[test]
    fn a_bent_hexahedron_has_the_volume_of_its_trilinear_map() {
        let signs: [[f64; 3]; 8] =
            [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
                .map(|corner: [i32; 3]| corner.map(f64::from));
        let bend = |[x, y, z]: [f64; 3]| [x + 0.2 * y * z, y - 0.1 * x * z + 0.3, z + 0.15 * x * y * z - 0.2 * x];
        let mut mesh = Mesh::new(3, signs.map(bend).to_vec());
        mesh.push(CellKind::Hexahedron, &[0, 1, 2, 3, 4, 5, 6, 7]);
        let mut integral = 0.0;
        for point in signs.map(|corner| corner.map(|s| s / 3f64.sqrt())) {
            let [x, y, z] = point;
            let columns = [
                [1.0, -0.1 * z, 0.15 * y * z - 0.2],
                [0.2 * z, 1.0, 0.15 * x * z],
                [0.2 * y, -0.1 * x, 1.0 + 0.15 * x * y],
            ];
            integral += determinant(columns);
        }
        assert!((mesh.measure(0) - integral).abs() < 1e-14, "{} {integral}", mesh.measure(0));
    }

    #[test]
    fn cells_of_every_kind_are_turned_once() {
        let plane = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mut flat = Mesh::new(2, plane.to_vec());
        flat.push(CellKind::Quadrilateral, &[0, 3, 2, 1]);
        flat.push(CellKind::Triangle, &[0, 2, 1]);
        flat.push(CellKind::Triangle, &[0, 1, 2]);
        assert_eq!((flat.orient(), flat.orient()), (2, 0));
        assert_eq!([flat.measure(0), flat.measure(1), flat.measure(2)], [1.0, 0.5, 0.5]);
        let both = plane.iter().copied().chain(plane.map(|[x, y, _]| [x, y, 2.0]));
        let mut space = Mesh::new(3, both.collect());
        space.push(CellKind::Hexahedron, &[4, 5, 6, 7, 0, 1, 2, 3]);
        space.push(CellKind::Tetrahedron, &[0, 3, 1, 4]);
        assert_eq!((space.measure(0), space.orient(), space.orient()), (-2.0, 2, 0));
        assert_eq!([space.measure(0), space.measure(1)], [2.0, 1.0 / 3.0]);
    }
}
