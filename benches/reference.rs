//! The iterated reference on fine bodies: seconds, iterations, residual, accuracy, memory.
//!
//! Policy: the six bodies' load, p + 1 Gauss points, all threads (RAYON_NUM_THREADS sets them), one run each; memory is the
//! largest of the process so far. Run with `cargo bench --bench reference`.

use springfit::geometry::dofs::DofMap;
use springfit::geometry::selection::face_nodes;
use springfit::geometry::shapes::{self, ShapeRequest};
use springfit::memory::peak_bytes;
use springfit::reference::material::{Material, Plane};
use springfit::reference::matrix_free::solve::memory_bytes;
use springfit::reference::methods::nurbs;
use springfit::reference::{Path, Reference, loads};

fn main() {
    for (name, control_points, degree) in [
        ("cube", [17; 3], [2; 3]),
        ("cube", [33; 3], [2; 3]),
        ("spheroid", [65, 64, 9], [2, 2, 1]),
        ("torus", [65, 33, 33], [2; 3]),
        ("cube", [65; 3], [2; 3]),
    ] {
        let shape = shapes::find(name).expect("a shape of the table");
        let request = ShapeRequest {
            control_points: control_points.to_vec(),
            degree: degree.to_vec(),
            ..shape.default_request()
        };
        let patch = (shape.build)(&request).expect("a size that the shape can have");
        let mut fixed = vec![[false; 3]; patch.grid().len()];
        let held = face_nodes(&patch.grid(), shape.fixed_face).expect("a face of the grid");
        held.iter().for_each(|&node| fixed[node as usize] = [true; 3]);
        let dofs = DofMap::untied(3, &fixed);
        let lame = Material { young: 15e3, poisson: 1.0 / 3.0 }.lame(3, Plane::Stress).expect("a material");
        let load = loads::per_node(&dofs, shape.default_force).expect("a load");
        let points = nurbs::integration_points(&patch, 0, 1.0);
        let found = Reference::iterative(&points, lame, &dofs, &[load]).expect("a whole body").expect("converges");
        let Path::Iterative { iterations, residual } = &found.path else {
            unreachable!("the iterative path was asked for")
        };
        let expected = memory_bytes(&patch, 0, dofs.len(), 1, rayon::current_num_threads()) as f64 / 1e9;
        println!(
            "{name} {control_points:?}: {} dofs, {:.2} s, {iterations:?} iterations, residual {residual:.1e}, \
             backward error {:.1e}, condition {:.1e}, forward error {:.1e}, {expected:.2} GB expected, {:.2} GB so far",
            dofs.len(),
            found.seconds,
            found.accuracy.backward_error,
            found.accuracy.condition,
            found.accuracy.forward_error,
            peak_bytes().unwrap_or(0) as f64 / 1e9
        );
    }
}
