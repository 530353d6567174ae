//! P1, P3, P4: a mesh whose boundary follows a linear displacement is under constant stress, whatever its cells.
//!
//! R. H. MacNeal and R. L. Harder, A proposed standard set of problems to test finite element accuracy, Finite Elements in
//! Analysis and Design 1 (1985).

use springfit::geometry::dofs::DofMap;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::reference::material::Plane;
use springfit::reference::points::ElementPoints;
use springfit::reference::{stiffness, stress};

use crate::problem::{lame, mapped, points, solve};
use crate::table::{assert_close, expected};

/// The displacement of MacNeal and Harder's patch tests.
fn linear(dimension: usize, [x, y, z]: [f64; 3]) -> [f64; 3] {
    match dimension {
        2 => [1e-3 * (x + y / 2.0), 1e-3 * (y + x / 2.0), 0.0],
        _ => [1e-3 * (2.0 * x + y + z) / 2.0, 1e-3 * (x + 2.0 * y + z) / 2.0, 1e-3 * (x + y + 2.0 * z) / 2.0],
    }
}

/// What a patch test found, relative to the largest values: errors of displacement and stress, forces inside.
struct Outcome {
    displacement: f64,
    stress: f64,
    imbalance: f64,
    /// The stress at every integration point.
    stresses: Vec<[[f64; 3]; 3]>,
}

fn largest<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> f64 {
    numbers.into_iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

fn patch_test(mesh: &Mesh, method: &str, plane: Plane) -> Outcome {
    let (dimension, points) = (mesh.dimension(), points(method, mesh));
    let law = lame(1e6, 0.25, dimension, plane);
    let mut fixed = vec![[false; 3]; mesh.positions().len()];
    for face in mesh.boundary_faces().expect("a manifold") {
        face.nodes().iter().for_each(|&node| fixed[node as usize] = [true; 3]);
    }
    let dofs = DofMap::untied(dimension, &fixed);
    assert!(!dofs.is_empty(), "a patch test needs inner nodes");
    let exact: Vec<[f64; 3]> = mesh.positions().iter().map(|&x| linear(dimension, x)).collect();
    let given: Vec<_> = exact.iter().zip(&fixed).map(|(u, held)| if held[0] { *u } else { [0.0; 3] }).collect();
    let solved = solve(&points, law, &dofs, &vec![0.0; dofs.len()], &given);
    let forces = stiffness::internal_forces(&points, law, &exact).expect("forces");
    let inner = forces.iter().zip(&fixed).filter(|(_, held)| !held[0]).flat_map(|(force, _)| force);
    let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| linear(dimension, e));
    let gradient = [0, 1, 2].map(|i| [0, 1, 2].map(|j| if j < dimension { columns[j][i] } else { 0.0 }));
    let sigma = law.stress(&gradient);
    let (mut filled, mut stresses) = (ElementPoints::default(), Vec::new());
    for element in 0..points.elements() {
        points.fill(element, &mut filled).expect("no fold");
        stresses.extend(stress::in_element(&filled, points.acting(element), law, &solved));
    }
    let difference = |found: &[[f64; 3]; 3]| {
        found.as_flattened().iter().zip(sigma.as_flattened()).map(|(f, s)| f - s).collect::<Vec<_>>()
    };
    let wrong: Vec<f64> = solved.as_flattened().iter().zip(exact.as_flattened()).map(|(u, e)| u - e).collect();
    Outcome {
        displacement: largest(&wrong) / largest(exact.as_flattened()),
        stress: largest(&stresses.iter().flat_map(difference).collect::<Vec<_>>()) / largest(sigma.as_flattened()),
        imbalance: largest(inner) / largest(forces.as_flattened()),
        stresses,
    }
}

/// Moves the inner nodes of the unit square or cube by a fixed quasi-random sequence.
fn distorted(dimension: usize, kind: CellKind) -> Mesh {
    let cells = 3;
    let place = |x: [f64; 3]| {
        let inside = x[..dimension].iter().all(|x| *x > 0.0 && *x < 1.0);
        let seed = 1.0 + 7.0 * x[0] + 11.0 * x[1] + 13.0 * x[2];
        let turn = |a: usize| 2.0 * (seed * (a as f64 + 1.0) * 17.618_033_988_75).fract() - 1.0;
        [0, 1, 2].map(|a| x[a] + if inside && a < dimension { 0.15 / cells as f64 * turn(a) } else { 0.0 })
    };
    mapped(&vec![cells; dimension], kind, &place)
}

#[test]
fn p1_patch_test_of_every_method() {
    for (method, kind) in [
        ("q4", CellKind::Quadrilateral),
        ("q4_bbar", CellKind::Quadrilateral),
        ("t3", CellKind::Triangle),
        ("b8", CellKind::Hexahedron),
        ("b8_bbar", CellKind::Hexahedron),
        ("t4", CellKind::Tetrahedron),
    ] {
        let mesh = distorted(kind.dimension(), kind);
        for plane in [Plane::Stress, Plane::Strain] {
            let Outcome { displacement, stress, imbalance, .. } = patch_test(&mesh, method, plane);
            println!("{method} {plane:?}: u {displacement:.1e}, stress {stress:.1e}, forces {imbalance:.1e}");
            assert!(displacement < 1e-12 && stress < 1e-12 && imbalance < 1e-12, "{method} {plane:?}");
        }
    }
}

#[test]
fn p3_macneal_harder_patch_of_q4() {
    let outer = [[0.0, 0.0], [0.24, 0.0], [0.24, 0.12], [0.0, 0.12]];
    let inner = [[0.04, 0.02], [0.18, 0.03], [0.16, 0.08], [0.08, 0.08]];
    let places = outer.iter().chain(&inner).map(|&[x, y]| [x, y, 0.0]);
    let mut mesh = Mesh::new(2, places.collect());
    for corners in [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7]] {
        mesh.push(CellKind::Quadrilateral, &corners);
    }
    let pinned = expected("P3");
    let number = |key: &str| pinned[key].as_f64().expect("a number");
    for method in ["q4", "q4_bbar"] {
        let outcome = patch_test(&mesh, method, Plane::Stress);
        for sigma in &outcome.stresses {
            assert_close("sx", sigma[0][0], number("sx"), 1e-12);
            assert_close("sy", sigma[1][1], number("sy"), 1e-12);
            assert_close("txy", sigma[0][1], number("txy"), 1e-12);
        }
        assert!(outcome.displacement < 1e-12 && outcome.imbalance < 1e-12, "{method}");
    }
}

#[test]
fn p4_macneal_harder_patch_of_b8() {
    let cube = [0.0, 1.0].map(|z| [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]]).concat();
    let inner = [
        [0.249, 0.342, 0.192],
        [0.826, 0.288, 0.288],
        [0.850, 0.649, 0.263],
        [0.273, 0.750, 0.230],
        [0.320, 0.186, 0.643],
        [0.677, 0.305, 0.683],
        [0.788, 0.693, 0.644],
        [0.165, 0.745, 0.702],
    ];
    let mut mesh = Mesh::new(3, [cube, inner.to_vec()].concat());
    mesh.push(CellKind::Hexahedron, &[8, 9, 10, 11, 12, 13, 14, 15]);
    // one cell between each face of the cube and the same face of the inner cell: outer corners, then inner ones
    for [a, b, c, d] in [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]] {
        mesh.push(CellKind::Hexahedron, &[a, b, c, d, a + 8, b + 8, c + 8, d + 8]);
    }
    let pinned = expected("P4");
    let number = |key: &str| pinned[key].as_f64().expect("a number");
    for method in ["b8", "b8_bbar"] {
        let outcome = patch_test(&mesh, method, Plane::Stress);
        for sigma in &outcome.stresses {
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let key = if i == j { "normal" } else { "shear" };
                assert_close(key, sigma[i][j], number(key), 1e-12);
            }
        }
        assert!(outcome.displacement < 1e-12 && outcome.imbalance < 1e-12, "{method}");
    }
}
