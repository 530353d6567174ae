//! Checks of `[geometry]`: one body, and the keys that it takes.

use crate::error::{Error, Result};
use crate::geometry::knots::MAX_DEGREE;
use crate::geometry::meshes::{MESH_SHAPES, MeshShape};

use super::super::Geometry;
use super::super::choices::{known, names};
use super::{length, positive, within};

/// Most control points of a grid, most nodes of a mesh.
pub(super) const MOST_CONTROL_POINTS: usize = 100_000_000;

/// One of shape and file, the keys that go with it, and plain ranges.
pub(super) fn check(geometry: &Geometry) -> Result<()> {
    match (&geometry.shape, &geometry.file) {
        (Some(shape), None) => {
            known("geometry.shape", shape, &names("geometry.shape"))?;
            keys_of_shape(geometry, shape)?;
        }
        (None, Some(_)) => only_with_shape(geometry)?,
        (Some(_), Some(_)) => {
            return Err(Error::input("geometry.file", "both shape and file are given", "keep one of the two"));
        }
        (None, None) => {
            let help = format!("add geometry.shape ({}) or geometry.file", names("geometry.shape").join(", "));
            return Err(Error::input("geometry.shape", "no body is given", help));
        }
    }
    for (i, &size) in geometry.size.iter().flatten().enumerate() {
        positive(&format!("geometry.size[{i}]"), size)?;
    }
    for (i, &degree) in geometry.degree.iter().flatten().enumerate() {
        within(&format!("geometry.degree[{i}]"), degree, 1, MAX_DEGREE)?;
    }
    for (i, &count) in geometry.control_points.iter().flatten().enumerate() {
        within(&format!("geometry.control_points[{i}]"), count, 2, MOST_CONTROL_POINTS)?;
    }
    let product = geometry.control_points.iter().flatten().fold(1_usize, |product, &n| product.saturating_mul(n));
    if product > MOST_CONTROL_POINTS {
        let message = format!("{:?} are {product} control points", geometry.control_points.as_deref().unwrap_or(&[]));
        return Err(Error::input("geometry.control_points", message, format!("at most {MOST_CONTROL_POINTS}")));
    }
    geometry.known_mesh().map_or(Ok(()), |shape| check_mesh(geometry, shape))
}

/// A patch has control points, a mesh has cells.
fn keys_of_shape(geometry: &Geometry, name: &str) -> Result<()> {
    let mesh = geometry.known_mesh().is_some();
    let of_a_patch = [
        ("control_points", geometry.control_points.is_some()),
        ("degree", geometry.degree.is_some()),
        ("merge_seam", geometry.merge_seam),
    ];
    let of_a_mesh = [("cells", geometry.cells.is_some()), ("distortion", geometry.distortion.is_some())];
    let wrong = if mesh { of_a_patch.iter() } else { of_a_mesh.iter() };
    let Some((key, _)) = wrong.copied().find(|&(_, given)| given) else { return Ok(()) };
    let (message, help) = match mesh {
        true => {
            let message = format!("the shape \"{name}\" is a mesh and has no {key}");
            (message, format!("remove {key}; geometry.cells says how fine a mesh is"))
        }
        false => {
            let meshes = MESH_SHAPES.iter().map(|shape| shape.name).collect::<Vec<_>>().join(", ");
            let message = format!("the shape \"{name}\" is a patch and has no {key}");
            (message, format!("geometry.control_points says how fine a patch is; meshes are {meshes}"))
        }
    };
    Err(Error::input(format!("geometry.{key}"), message, help))
}

/// Numbers of cells and distortion of a mesh.
fn check_mesh(geometry: &Geometry, shape: &MeshShape) -> Result<()> {
    length("geometry.size", geometry.size.as_ref().map(Vec::len), shape.dimension)?;
    let request = geometry.mesh_request(shape);
    shape.check(&request)?;
    let nodes = shape.nodes(&request.cells);
    if nodes > MOST_CONTROL_POINTS as u128 {
        let message = format!("cells {:?} make {nodes} nodes", request.cells);
        return Err(Error::input("geometry.cells", message, format!("at most {MOST_CONTROL_POINTS} nodes in all")));
    }
    Ok(())
}

fn only_with_shape(geometry: &Geometry) -> Result<()> {
    let given = [
        ("size", geometry.size.is_some()),
        ("control_points", geometry.control_points.is_some()),
        ("degree", geometry.degree.is_some()),
        ("cells", geometry.cells.is_some()),
        ("distortion", geometry.distortion.is_some()),
    ];
    match given.into_iter().find(|&(_, given)| given) {
        Some((key, _)) => Err(Error::input(
            format!("geometry.{key}"),
            "a body from a file has its own",
            format!("remove {key}; it goes with geometry.shape"),
        )),
        None => Ok(()),
    }
}
