use springfit::geometry::dofs::DofMap;
use springfit::geometry::selection::face_nodes;
use springfit::geometry::shapes;
use springfit::reference::material::{Material, Plane};
use springfit::reference::matrix_free::solve;
use springfit::reference::methods::nurbs;
use springfit::reference::{Reference, loads};
use springfit::sparse::ordering::nested_dissection;

#[test]
fn probe() {
    let spec = std::env::var("PROBE").unwrap_or("cube:6,6,6;square:6,6;circle:7,8;torus:9,5,5;spheroid:9,10,3;plate:7,7,2".into());
    let direct = std::env::var("DIRECT").is_ok();
    for item in spec.split(';') {
        let (name, n) = item.split_once(':').unwrap();
        let shape = shapes::find(name).unwrap();
        let mut request = shape.default_request();
        request.control_points = n.split(',').map(|n| n.parse().unwrap()).collect();
        let patch = (shape.build)(&request).unwrap();
        let mut fixed = vec![[false; 3]; patch.points().len()];
        for node in face_nodes(&patch.grid(), shape.fixed_face).unwrap() {
            fixed[node as usize] = [true; 3];
        }
        let dofs = DofMap::untied(patch.dimension(), &fixed);
        let lame = Material { young: 15e3, poisson: 0.3 }.lame(patch.dimension(), Plane::Stress).unwrap();
        let load = loads::per_node(&dofs, shape.default_force).unwrap();
        println!("{item}: {} dofs", dofs.len());
        let found = solve::solve((&patch, 0, 1.0), lame, &dofs, &[&load.forces], 1e-12, 500).unwrap().unwrap();
        println!("{item}: {:?} {:e}", found.iterations, found.residual);
        if direct {
            let points = nurbs::integration_points(&patch, 0, 1.0);
            let order = dofs.order(&nested_dissection(patch.grid().extents(), 2, [false; 3]));
            let reference = Reference::solve(&points, lame, &dofs, order, &[load]).unwrap();
            let exact = &reference.cases[0].displacement;
            let norm = exact.iter().map(|u| u * u).sum::<f64>().sqrt();
            let error = exact.iter().zip(&found.displacements[0]).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            println!("  direct {:.2} s, error {:e}, measure {:e}", reference.seconds, error / norm, found.volume / reference.measure - 1.0);
        }
    }
}
