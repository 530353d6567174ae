//! Disk, cylinder and ball: a core of a grid, and shells around it.
//!
//! A square mapped onto a disk is flattened at its corners, a cube onto a ball along its edges, the more the finer the
//! grid. So only the inner part is a grid, of m cells along each direction, and r shells of cells lie between its boundary and the
//! circle or the sphere. Every boundary cell then touches the boundary with one side.
//!
//! With p in [-1, 1]^d a point of the grid, |p| its largest component and q = tan(pi p / 4), which spreads the boundary evenly,
//!
//! ```text
//! core     x = R c (q (1 - b s) + b s |p| q / |q|_2),   s = |p|, c the share of the core, b how round its boundary is
//! shells   x = (1 - t) x_core + t R q / |q|_2,          t = 1/r, ..., 1
//! ```
//!
//! Cells keep their shape when the mesh is refined: with c = 0.5 and b = 0.6 the smallest scaled Jacobian is 0.8 in the disk and
//! 0.69 in the ball; cut into simplices (`cut`) no angle is below 29 degrees in the disk, 24 in the ball, 26 in the cylinder.
//!
//! Nodes: those of the core in the order of its grid, then those of each shell in the order of the core's boundary nodes.

use crate::geometry::mesh::{CellKind, Mesh};
use crate::geometry::meshes::grid::{extruded, regular};

/// Radius of the core along an axis, as a share of the radius.
const CORE: f64 = 0.5;

/// How round the boundary of the core is: 0 a square or cube, 1 a circle or sphere.
const ROUND: f64 = 0.6;

/// A disk of quadrilaterals around the origin (radius in m): m x m in its core, 4 m in each of r shells.
///
/// # Panics
/// When m or r is 0.
pub fn disk(radius: f64, core: usize, shells: usize) -> Mesh {
    in_shells(regular([2.0, 2.0, 0.0], [core, core, 0]), radius, shells)
}

/// A cylinder of hexahedra along z from 0 to `length` (m): a [`disk`] in `layers` layers.
///
/// # Panics
/// When m, r or the number of layers is 0.
pub fn cylinder(radius: f64, length: f64, core: usize, shells: usize, layers: usize) -> Mesh {
    extruded(&disk(radius, core, shells), length, layers)
}

/// A ball of hexahedra around the origin (radius in m): m^3 in its core, 6 m^2 in each of r shells.
///
/// # Panics
/// When m or r is 0.
pub fn ball(radius: f64, core: usize, shells: usize) -> Mesh {
    in_shells(regular([2.0; 3], [core; 3]), radius, shells)
}

/// Bends the grid on [0, 2]^d into the core and puts the shells around it.
fn in_shells(grid: Mesh, radius: f64, shells: usize) -> Mesh {
    assert!(shells > 0, "at least one shell");
    let dimension = grid.dimension();
    let sides = grid.boundary_faces().expect("a grid is a body");
    let mut rim: Vec<u32> = sides.iter().flat_map(|side| side.nodes().iter().copied()).collect();
    rim.sort_unstable();
    rim.dedup();
    let [inner, outer] = [in_core, on_boundary].map(|place| {
        let place = move |at: &[f64; 3]| place(dimension, *at).map(|component| radius * component);
        grid.positions().iter().map(place).collect::<Vec<_>>()
    });
    let mut places = inner.clone();
    for shell in 1..=shells {
        let t = shell as f64 / shells as f64;
        let between = |&node: &u32| {
            let (a, b) = (inner[node as usize], outer[node as usize]);
            std::array::from_fn(|axis| (1.0 - t) * a[axis] + t * b[axis])
        };
        places.extend(rim.iter().map(between));
    }
    assert!(u32::try_from(places.len()).is_ok(), "the nodes can be numbered");
    let mut mesh = Mesh::new(dimension, places);
    for cell in 0..grid.cells() {
        mesh.push(grid.kind(cell), grid.corners(cell));
    }
    // Node `node` of the boundary of the core, `shell` shells further out.
    let out = |node: u32, shell: usize| {
        let at = rim.binary_search(&node).expect("a node of the boundary");
        if shell == 0 { node } else { (inner.len() + (shell - 1) * rim.len() + at) as u32 }
    };
    for shell in 0..shells {
        for side in &sides {
            match *side.nodes() {
                // The outside lies to the right of the side.
                [a, b] => {
                    let corners = [out(b, shell), out(a, shell), out(a, shell + 1), out(b, shell + 1)];
                    mesh.push(CellKind::Quadrilateral, &corners);
                }
                [a, b, c, d] => {
                    let [lower, upper] = [shell, shell + 1].map(|shell| [a, b, c, d].map(|node| out(node, shell)));
                    mesh.push(CellKind::Hexahedron, &[lower, upper].concat());
                }
                _ => unreachable!("the sides of a grid have 2 or 4 nodes"),
            }
        }
    }
    mesh
}

/// Direction from the origin to a point of the grid, evenly spread, and its largest component before that.
fn spread(dimension: usize, at: [f64; 3]) -> ([f64; 3], f64) {
    let mut p = at.map(|x| x - 1.0);
    p[dimension..].fill(0.0);
    let largest = p.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    (p.map(|x| (std::f64::consts::FRAC_PI_4 * x).tan()), largest)
}

fn length(q: [f64; 3]) -> f64 {
    q.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Where a point of the grid lies in the core of a unit disk or ball.
fn in_core(dimension: usize, at: [f64; 3]) -> [f64; 3] {
    let (q, largest) = spread(dimension, at);
    let size = length(q);
    if size == 0.0 {
        return q;
    }
    let blend = ROUND * largest;
    q.map(|x| CORE * x * (1.0 - blend + blend * largest / size))
}

/// Where a boundary point of the grid lies on the unit circle or sphere.
fn on_boundary(dimension: usize, at: [f64; 3]) -> [f64; 3] {
    let (q, _) = spread(dimension, at);
    let size = length(q);
    q.map(|x| if size == 0.0 { 0.0 } else { x / size })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::quality::quality;
    use crate::geometry::meshes::cut::simplices;
    use std::f64::consts::PI;

    #[test]
    fn disk_and_ball_have_their_counts_and_a_round_boundary() {
        let flat = disk(2.0, 4, 3);
        assert_eq!((flat.cells(), flat.positions().len()), (16 + 3 * 16, 25 + 3 * 16));
        let space = ball(2.0, 3, 2);
        assert_eq!((space.cells(), space.positions().len()), (27 + 2 * 54, 64 + 2 * 56));
        for mesh in [flat, space] {
            for side in mesh.boundary_faces().unwrap() {
                assert!(side.nodes().iter().all(|&node| (length(mesh.positions()[node as usize]) - 2.0).abs() < 1e-15));
            }
        }
    }

    /// The measure tends to that of the body with the square of the cell size.
    #[test]
    fn the_measure_converges_with_the_second_order() {
        let error = |mesh: Mesh, exact: f64| 1.0 - quality(&mesh).unwrap().measure / exact;
        let [flat, finer] = [4, 8].map(|m| error(disk(1.0, m, m / 2), PI));
        assert!((flat / finer).log2() > 1.95, "{flat} {finer}");
        let [space, finer] = [4, 8].map(|m| error(ball(1.0, m, m / 2), 4.0 / 3.0 * PI));
        assert!((space / finer).log2() > 1.95, "{space} {finer}");
        let pipe = error(cylinder(0.5, 3.0, 4, 2, 5), 0.75 * PI);
        assert!((pipe - flat).abs() < 1e-14, "{pipe} {flat}");
    }

    /// Well-shaped at any resolution: refinement does not flatten the cells, and none is inverted.
    #[test]
    fn cells_stay_well_shaped_when_refined() {
        for (core, shells) in [(2, 1), (4, 2), (8, 4), (12, 6)] {
            let worst = |mesh: &Mesh| {
                let found = quality(mesh).unwrap();
                assert!(found.inverted.is_empty(), "{core} {shells}");
                (found.least_jacobian.map(|least| least.0), found.least_angle.map(|least| least.0))
            };
            let (flat, space) = (disk(1.0, core, shells), ball(1.0, core, shells));
            let (jacobian, _) = worst(&flat);
            assert!(jacobian.unwrap() > 0.77, "disk {core}: {jacobian:?}");
            let (jacobian, _) = worst(&space);
            assert!(jacobian.unwrap() > 0.68, "ball {core}: {jacobian:?}");
            let (_, angle) = worst(&simplices(&flat));
            assert!(angle.unwrap() > 28.0, "triangles {core}: {angle:?}");
            let (_, angle) = worst(&simplices(&space));
            assert!(angle.unwrap() > 24.0, "tetrahedra {core}: {angle:?}");
            let (_, angle) = worst(&simplices(&cylinder(1.0, 2.0, core, shells, 2 * core)));
            assert!(angle.unwrap() > 25.0, "cylinder {core}: {angle:?}");
        }
    }
}
