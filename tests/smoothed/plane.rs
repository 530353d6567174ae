//! Corotational triangles: energy, forces and tangents by differences, turned and inside out.

use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::geometry::grid_mesh::mesh_of_grid;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::reference::corotational::Tangent;
use springfit::reference::corotational::held::Held;
use springfit::reference::corotational::statics::{self, Search};
use springfit::reference::material::{Material, Plane};
use springfit::reference::methods::smoothed::{self, Smoothing};
use springfit::rng::Stream;

fn triangles() -> Mesh {
    let grid = Grid::new(&[4, 3]);
    let mut stream = Stream::new(5, 0, 0);
    let positions = (0..grid.len()).map(|node| {
        let [i, j, _] = grid.index(node).map(|i| i as f64);
        [0.3 * i + 0.03 * stream.normal(), 0.2 * j + 0.02 * stream.normal(), 0.0]
    });
    mesh_of_grid(&grid, positions.collect(), CellKind::Triangle)
}

fn body(mesh: &Mesh, smoothing: Smoothing, fixed: &[[bool; 3]]) -> Held {
    let domains = smoothed::domains(mesh, smoothing, 0.1).expect("triangles");
    let lame = Material { young: 1e4, poisson: 0.3 }.lame(2, Plane::Stress).expect("a material");
    Held::new(domains, mesh.positions(), lame, DofMap::untied(2, fixed)).expect("it has cells")
}

#[test]
fn forces_and_tangents_in_the_plane_are_derivatives_of_the_energy() {
    let mesh = triangles();
    let nodes = mesh.positions().len();
    for smoothing in [Smoothing::Element, Smoothing::Edge] {
        // displacements large enough to turn triangles, and some of them inside out
        for (seed, size) in [(1, 0.02), (2, 0.1), (3, 0.3)] {
            let mut held = body(&mesh, smoothing, &vec![[false; 3]; nodes]);
            let n = held.dofs().len();
            assert_eq!(n, 2 * nodes);
            let mut stream = Stream::new(seed, 0, 0);
            let u: Vec<f64> = (0..n).map(|_| size * stream.normal()).collect();
            let d: Vec<f64> = (0..n).map(|_| stream.normal()).collect();
            assert!(size < 0.2 || !held.inversion(&u).domains.is_empty());
            let h = 1e-6;
            let mut at = |t: f64| {
                let place: Vec<f64> = u.iter().zip(&d).map(|(u, d)| u + t * d).collect();
                let mut force = vec![0.0; n];
                held.place(&place);
                held.internal_force(&mut force);
                (held.energy(), force)
            };
            let ((before, f0), (after, f1), (_, force)) = (at(-h), at(h), at(0.0));
            let slope: f64 = force.iter().zip(&d).map(|(f, d)| f * d).sum();
            assert!(((after - before) / (2.0 * h) - slope).abs() < 1e-6 * slope.abs().max(1.0), "{smoothing:?} {size}");
            let mut product = vec![0.0; n];
            held.linearise(Tangent::Exact);
            held.apply(&d, &mut product);
            let largest = product.iter().fold(0.0_f64, |most, p| most.max(p.abs()));
            for (p, (a, b)) in product.iter().zip(f0.iter().zip(&f1)) {
                assert!((p - (b - a) / (2.0 * h)).abs() < 1e-5 * largest, "{smoothing:?} {size}");
            }
            let pattern = held.pattern().clone();
            let mut values = vec![0.0; pattern.entries()];
            held.fill(&mut values);
            for i in 0..n {
                let row = pattern.row(i).iter().enumerate();
                let entry: f64 = row.map(|(k, &j)| values[pattern.offsets()[i] + k] * d[j]).sum();
                assert!((entry - product[i]).abs() < 1e-10 * largest);
            }
            // no force and no torque in sum
            let places: Vec<[f64; 2]> =
                (0..nodes).map(|a| [0, 1].map(|i| mesh.positions()[a][i] + u[2 * a + i])).collect();
            let torque: f64 = (0..nodes).map(|a| places[a][0] * force[2 * a + 1] - places[a][1] * force[2 * a]).sum();
            let most = force.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
            assert!(torque.abs() < 1e-11 * most && force.iter().step_by(2).sum::<f64>().abs() < 1e-11 * most);
        }
    }
}

#[test]
fn a_strip_of_triangles_bends_far_comes_back_from_inside_out_and_does_not_feel_a_turn() {
    let mesh = triangles();
    let fixed: Vec<[bool; 3]> = (0..mesh.positions().len()).map(|node| [node < 3; 3]).collect();
    for smoothing in [Smoothing::Element, Smoothing::Edge] {
        let mut held = body(&mesh, smoothing, &fixed);
        let n = held.dofs().len();
        let forces: Vec<f64> = (0..n).map(|dof| if held.dofs().owner(dof).1 == 1 { -1.5 } else { 0.0 }).collect();
        let search = Search { load_steps: 4, ..Search::default() };
        let found = statics::solve(&mut held, &forces, &vec![0.0; n], search).expect("it bends");
        let most = found.displacement.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        assert!(most > 0.1 && held.inversion(&found.displacement).is_sound(), "{most}");
        // mirrored across the support, every triangle inside out
        let mirrored: Vec<f64> = (0..n)
            .map(|dof| match held.dofs().owner(dof) {
                (node, 0) => -2.0 * mesh.positions()[node][0],
                _ => 0.0,
            })
            .collect();
        assert!(!held.inversion(&mirrored).is_sound());
        if let Ok(back) = statics::solve(&mut held, &vec![0.0; n], &mirrored, Search::default()) {
            assert!(back.energy.is_finite() && back.displacement.iter().all(|u| u.is_finite()));
        }
        let mut unheld = body(&mesh, smoothing, &vec![[false; 3]; mesh.positions().len()]);
        let (sine, cosine) = 2.5_f64.sin_cos();
        let turned = mesh
            .positions()
            .iter()
            .flat_map(|x| [cosine * x[0] - sine * x[1] + 3.0 - x[0], sine * x[0] + cosine * x[1] - 1.0 - x[1]]);
        unheld.place(&turned.collect::<Vec<f64>>());
        assert!(unheld.energy() < 1e-20, "{}", unheld.energy());
    }
}
