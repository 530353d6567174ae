use springfit::geometry::dofs::DofMap;
use springfit::geometry::selection::face_nodes;
use springfit::geometry::shapes;
use springfit::reference::material::{Material, Plane};
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
        let points = nurbs::integration_points(&patch, 0, 1.0);
        println!("{item}: {} dofs", dofs.len());
        let found = Reference::iterative(&points, lame, &dofs, &[load.clone()]).unwrap().unwrap();
        println!("{item}: {:?} {:.2} s, backward {:.1e}, {:.1} MB", found.path, found.seconds, found.backward_error, springfit::memory::peak_bytes().unwrap() as f64/1e6);
        if direct {
            let order = dofs.order(&nested_dissection(patch.grid().extents(), 2, [false; 3]));
            let reference = Reference::direct(&points, lame, &dofs, order, &[load], "").unwrap();
            let (a, b) = (&reference.cases[0], &found.cases[0]);
            println!("  direct {:.2} s, compliance {:.1e}, u_max {:.1e}, measure {:.1e} frob {:.1e}", reference.seconds, b.compliance/a.compliance - 1.0, b.u_max/a.u_max - 1.0, found.measure / reference.measure - 1.0, found.stiffness_frobenius()/reference.stiffness_frobenius() - 1.0);
        }
    }
}
