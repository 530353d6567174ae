//! Every body of the table: its nodes, its sides, what it refuses.

use super::*;
use crate::geometry::mesh::quality::quality;
use crate::geometry::shapes;

fn request(cells: &[usize], size: &[f64], simplices: bool) -> MeshRequest {
    MeshRequest { cells: cells.to_vec(), size: size.to_vec(), simplices, distortion: None }
}

#[test]
fn every_mesh_has_its_nodes_its_extent_and_no_inverted_cell() {
    for shape in MESH_SHAPES {
        for simplices in [false, true] {
            let size = [3.0, 4.0, 5.0];
            let mesh = shape.mesh(&request(shape.default_cells, &size[..shape.dimension], simplices)).unwrap();
            assert_eq!(mesh.dimension(), shape.dimension, "{}", shape.name);
            assert_eq!(mesh.positions().len() as u128, (shape.nodes)(shape.default_cells), "{}", shape.name);
            assert!((mesh.extent() - size[shape.dimension - 1]).abs() < 1e-14, "{}: {}", shape.name, mesh.extent());
            assert!(quality(&mesh).unwrap().inverted.is_empty() && mesh.faces().is_ok(), "{}", shape.name);
            let grid = shape.grid(shape.default_cells);
            assert!(grid.is_none_or(|grid| grid.len() == mesh.positions().len()), "{}", shape.name);
        }
        assert!(shapes::find(shape.name).is_none() && find(shape.name).is_some(), "one body a name");
    }
    assert!(find("cone").is_none());
}

/// Every side of the boundary lies in one of the parts, and no part has the sides of another, in any size, cut or not,
/// distorted or not; the whole of a round surface is its parts together.
#[test]
fn the_sides_of_a_body_cover_its_boundary_once() {
    for shape in MESH_SHAPES {
        for (cells, simplices) in [(2, false), (3, true)] {
            let (cells, size) = (vec![cells; shape.counts.len()], &[0.3, 4.0, 50.0][..shape.dimension]);
            let distortion = shape.distorts().then_some((0.45, 3));
            let mesh = shape.mesh(&MeshRequest { distortion, ..request(&cells, size, simplices) }).unwrap();
            let (parts, wholes): (Vec<_>, Vec<_>) =
                shape.sides(&mesh, size).into_iter().partition(|(name, _)| name.ends_with(['-', '+']));
            assert!(parts.iter().any(|(name, _)| name == shape.fixed_face), "{}", shape.name);
            assert_eq!(parts.len(), 2 * shape.dimension, "{}", shape.name);
            for face in mesh.boundary_faces().unwrap() {
                let has = |set: &&sides::Set| face.nodes().iter().all(|node| set.1.binary_search(node).is_ok());
                assert_eq!(parts.iter().filter(has).count(), 1, "{} {:?}", shape.name, face.nodes());
            }
            for (name, nodes) in wholes {
                let round = parts.iter().filter(|(part, _)| name != "side" || !part.starts_with('z'));
                let mut together: Vec<u32> = round.flat_map(|(_, nodes)| nodes.clone()).collect();
                together.sort_unstable();
                together.dedup();
                assert_eq!(nodes, together, "{} {name}", shape.name);
            }
        }
    }
}

#[test]
fn numbers_that_make_no_mesh_are_refused() {
    let refusal = |name: &str, request: MeshRequest| find(name).unwrap().mesh(&request).unwrap_err().to_string();
    assert_eq!(refusal("ball", request(&[4], &[1.0; 3], false)), "geometry.cells: cells [4] for the mesh \"ball\"");
    assert_eq!(
        refusal("disk", request(&[4, 0], &[1.0; 2], false)),
        "geometry.cells: cells [4, 0] for the mesh \"disk\""
    );
    let huge = refusal("box", request(&[1 << 20; 3], &[1.0; 3], false));
    assert!(huge.contains("make 1152924803144876033 nodes"), "{huge}");
    assert_eq!(
        refusal("box", request(&[1; 3], &[1.0, 0.0, 1.0], false)),
        "geometry.size: size [1.0, 0.0, 1.0] for the mesh \"box\""
    );
    let distorted = |name: &str, alpha| {
        refusal(name, MeshRequest { distortion: Some((alpha, 1)), ..find(name).unwrap().default_request() })
    };
    assert_eq!(distorted("ball", 0.1), "geometry.distortion: the mesh \"ball\" cannot be distorted");
    assert_eq!(distorted("kuhn_box", 1.5), "geometry.distortion.alpha: 1.5 is out of range");
    assert_eq!(distorted("kuhn_box", f64::NAN), "geometry.distortion.alpha: NaN is out of range");
}
