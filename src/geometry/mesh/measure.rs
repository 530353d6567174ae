//! Area and volume of cells.
//!
//! A tetrahedron with the edges d1, d2, d3 from its first corner has V = det(d1, d2, d3) / 6 (m^3), negative when its corners
//! are numbered the other way round.

/// Signed volume (m^3) of a tetrahedron from its corners (m).
pub fn tetrahedron_volume(x: [[f64; 3]; 4]) -> f64 {
    let [a, b, c] = std::array::from_fn(|edge| std::array::from_fn::<f64, 3, _>(|axis| x[edge + 1][axis] - x[0][axis]));
    (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6.0
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
}
