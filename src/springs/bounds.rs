//! How stiff a spring may become (4.19, 5.8).
//!
//! For a spring between the nodes i and j,
//!
//! ```text
//! k_b = sqrt(d) E (1 + nu) max(V_i, V_j) / (2 l0^2),     V_i = n_i max_e V_e
//! ```
//!
//! where e runs over the n_i cells (of the grid or of the mesh) that contain node i and V_e is the measure of a cell: its
//! area by the shoelace formula times the thickness, or its (trilinear) volume. The bound of the number phi of a group is the
//! largest k_b / p_s of its members, p_s the factor of the profile ([`super::profiles`]). Short springs get huge bounds. V in m^3, E in Pa, k in N/m.

use crate::geometry::dofs::DofMap;
use crate::geometry::grid::Grid;
use crate::geometry::mesh::Mesh;

use super::grouping::Grouping;
use super::network::Network;

/// V_i of every node: the largest measure of the grid cells around it times their number, m^3.
///
/// `positions` in metres; `thickness` in metres (used in two dimensions only). Cells around tied nodes count for all of them.
pub fn node_measures(grid: &Grid, positions: &[[f64; 3]], dofs: &DofMap, thickness: f64) -> Vec<f64> {
    let measure = |corners: &[u32]| match grid.dimension() {
        2 => area(corners, positions) * thickness,
        _ => volume(corners, positions),
    };
    around_nodes(dofs, grid.cells().into_iter().map(|corners| (measure(&corners), corners)))
}

/// V_i of every node of a mesh, as [`node_measures`].
pub fn node_measures_of_mesh(mesh: &Mesh, dofs: &DofMap, thickness: f64) -> Vec<f64> {
    let factor = if mesh.dimension() == 2 { thickness } else { 1.0 };
    let cells = (0..mesh.cells()).map(|cell| (mesh.measure(cell).abs() * factor, mesh.corners(cell).to_vec()));
    around_nodes(dofs, cells)
}

/// The largest measure of the cells around each node times their number.
fn around_nodes(dofs: &DofMap, cells: impl Iterator<Item = (f64, Vec<u32>)>) -> Vec<f64> {
    let mut largest = vec![0.0_f64; dofs.nodes()];
    let mut number = vec![0_u32; dofs.nodes()];
    for (measure, corners) in cells {
        for &corner in &corners {
            let node = dofs.master(corner as usize);
            largest[node] = largest[node].max(measure);
            number[node] += 1;
        }
    }
    (0..dofs.nodes()).map(|node| dofs.master(node)).map(|node| largest[node] * f64::from(number[node])).collect()
}

/// k_b of every spring (4.19), N/m. `measures` is V_i of every node, m^3; `young` in Pa.
pub fn spring_bounds(network: &Network, measures: &[f64], young: f64, poisson: f64) -> Vec<f64> {
    let factor = (network.dimension as f64).sqrt() * young * (1.0 + poisson) / 2.0;
    let bound =
        |[a, b]: [u32; 2], length: f64| factor * measures[a as usize].max(measures[b as usize]) / length.powi(2);
    network.springs.iter().map(|spring| bound(spring.nodes, spring.length)).collect()
}

/// Upper bound of the number of each group (5.8), in the unit of the profile.
///
/// `bounds` is k_b of every spring, N/m; `factors` is p_s of every spring.
///
/// # Panics
/// When there is not one bound and one factor for every spring.
pub fn upper_bounds(grouping: &Grouping, bounds: &[f64], factors: &[f64]) -> Vec<f64> {
    assert_eq!(
        [bounds.len(), factors.len()],
        [grouping.group_of.len(); 2],
        "one bound and one factor for every spring"
    );
    let mut upper = vec![0.0_f64; grouping.groups.len()];
    for ((&group, bound), factor) in grouping.group_of.iter().zip(bounds).zip(factors) {
        upper[group as usize] = upper[group as usize].max(bound / factor);
    }
    upper
}

/// Area of a quadrilateral in the plane z = 0, m^2; corners in C order.
fn area(corners: &[u32], positions: &[[f64; 3]]) -> f64 {
    let [a, b, c, d] = [0, 1, 3, 2].map(|corner| positions[corners[corner] as usize]);
    let (p, q) = ([c[0] - a[0], c[1] - a[1]], [d[0] - b[0], d[1] - b[1]]);
    (p[0] * q[1] - p[1] * q[0]).abs() / 2.0
}

/// Volume of a trilinear hexahedron, m^3: 2 x 2 x 2 Gauss points; corners in C order.
fn volume(corners: &[u32], positions: &[[f64; 3]]) -> f64 {
    let point = 0.5 - 0.5 / 3.0_f64.sqrt();
    let mut total = 0.0;
    for gauss in 0..8 {
        let xi = [0, 1, 2].map(|a| if gauss >> (2 - a) & 1 == 0 { point } else { 1.0 - point });
        total += determinant(jacobian(corners, positions, xi)) / 8.0;
    }
    total.abs()
}

/// dx_a / dxi_b of the trilinear map on the unit cube.
fn jacobian(corners: &[u32], positions: &[[f64; 3]], xi: [f64; 3]) -> [[f64; 3]; 3] {
    let mut dx = [[0.0; 3]; 3];
    for (corner, &node) in corners.iter().enumerate() {
        let upper = [0, 1, 2].map(|a| corner >> (2 - a) & 1 == 1);
        let linear = |a: usize| if upper[a] { xi[a] } else { 1.0 - xi[a] };
        for b in 0..3 {
            let sign = if upper[b] { 1.0 } else { -1.0 };
            let slope = sign * linear((b + 1) % 3) * linear((b + 2) % 3);
            for (row, x) in dx.iter_mut().zip(positions[node as usize]) {
                row[b] += slope * x;
            }
        }
    }
    dx
}

fn determinant(m: [[f64; 3]; 3]) -> f64 {
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
}
