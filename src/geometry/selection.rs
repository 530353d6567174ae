//! Parts of a body: faces of its control grid, and boxes.
//!
//! A face is named by a direction of the control grid and an end of it: "x-" holds the nodes with the first index 0,
//! "y+" those with the last second index, "z-" .. the third. On a box these are the sides of the box; on a curved body
//! they follow the grid (the torus: "y-" is the side towards its axis).

use super::grid::Grid;
use super::patch::Patch;
use crate::error::{Error, Result};

/// The direction of a face and whether it lies at the last index.
///
/// # Errors
/// [`Error::Input`] (`support.faces`) for a name that is not a face of a body with `dimension` directions.
pub fn parse_face(dimension: usize, face: &str) -> Result<(usize, bool)> {
    let names = &["x-", "x+", "y-", "y+", "z-", "z+"][..2 * dimension];
    match names.iter().position(|&name| name == face) {
        Some(place) => Ok((place / 2, place % 2 == 1)),
        None => Err(Error::input(
            "support.faces",
            format!("\"{face}\" is not a face of a body with {dimension} directions"),
            format!("one of {}", names.join(", ")),
        )),
    }
}

/// Nodes of a face, ascending.
///
/// # Errors
/// As [`parse_face`].
pub fn face_nodes(grid: &Grid, face: &str) -> Result<Vec<u32>> {
    let (direction, last) = parse_face(grid.dimension(), face)?;
    let index = if last { grid.shape()[direction] - 1 } else { 0 };
    Ok((0..grid.len()).filter(|&node| grid.index(node)[direction] == index).map(|node| node as u32).collect())
}

/// Elements that touch a face, as span triples in the order of [`Patch::elements`].
///
/// # Errors
/// As [`parse_face`].
pub fn face_elements(patch: &Patch, face: &str) -> Result<Vec<[usize; 3]>> {
    let (direction, last) = parse_face(patch.dimension(), face)?;
    let knots = patch.knots(direction);
    let span = if last { knots.len() - 1 } else { knots.degree() };
    Ok(patch.elements().into_iter().filter(|element| element[direction] == span).collect())
}

/// Nodes inside the box from `min` to `max` (m), ends included, ascending.
///
/// A point may miss the box by 1e-9 of the largest extent of the points, so that 0.4 finds 0.39999999999999997.
pub fn box_nodes(points: &[[f64; 3]], min: [f64; 3], max: [f64; 3]) -> Vec<u32> {
    let extent = |a: usize| {
        let along = points.iter().map(|x| x[a]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    let slack = 1e-9 * (0..3).map(extent).fold(0.0, f64::max);
    let inside = |x: &[f64; 3]| (0..3).all(|a| x[a] >= min[a] - slack && x[a] <= max[a] + slack);
    points.iter().enumerate().filter(|(_, x)| inside(x)).map(|(node, _)| node as u32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;

    #[test]
    fn faces_are_the_ends_of_the_grid() {
        let grid = Grid::new(&[2, 3]);
        assert_eq!(face_nodes(&grid, "x-").unwrap(), [0, 1, 2]);
        assert_eq!(face_nodes(&grid, "x+").unwrap(), [3, 4, 5]);
        assert_eq!(face_nodes(&grid, "y+").unwrap(), [2, 5]);
        assert_eq!(face_nodes(&Grid::new(&[2, 2, 2]), "z-").unwrap(), [0, 2, 4, 6]);
        for face in ["z-", "x", "", "w+"] {
            let error = face_nodes(&grid, face).unwrap_err();
            assert_eq!(error.help().unwrap(), "one of x-, x+, y-, y+");
        }
    }

    #[test]
    fn elements_of_a_face_and_nodes_of_a_box() {
        let shape = shapes::find("square").unwrap();
        let patch = (shape.build)(&shape.default_request()).unwrap();
        assert_eq!(face_elements(&patch, "y-").unwrap(), [[2, 2, 0], [3, 2, 0], [4, 2, 0], [5, 2, 0]]);
        assert_eq!(face_elements(&patch, "x+").unwrap(), [[5, 2, 0], [5, 3, 0], [5, 4, 0], [5, 5, 0]]);
        let nodes = box_nodes(patch.points(), [0.8, 1.6, 0.0], [1.2, 5.0, 0.0]);
        assert_eq!(nodes, [16, 17, 22, 23]);
        assert!(box_nodes(&[], [0.0; 3], [1.0; 3]).is_empty());
    }
}
