//! Do the supports hold the body?
//!
//! An elastic body in one piece moves without resistance only as a whole. The supports hold it when no rigid motion
//! (`rigid`) leaves all held components at rest, that is when the rows of the rigid motions at the held components have
//! full rank. This is decided before anything is factored, because a factorisation of a singular matrix may succeed by
//! rounding. The motions that are left are counted and named, and on demand held by as few components as it takes
//! ([`hold_loose`]): the 3-2-1 rule of a free solid, two nodes of a free plate.

mod rigid;

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::geometry::mesh::Mesh;

use rigid::{Nodes, RigidMotions};

/// Checks that no rigid motion of the nodes at `positions` (m, n x 3) is free; with a mesh that of each of its pieces,
/// which have no cell in common, and no node that is tied to one of the other.
///
/// # Errors
/// [`Error::Mechanism`] with the number of free motions, of all pieces together, and what they are.
pub fn check(positions: &[[f64; 3]], mesh: Option<&Mesh>, dofs: &DofMap) -> Result<()> {
    let mut found = Vec::new();
    let pieces = pieces(positions, mesh, dofs);
    for nodes in &pieces {
        let motions = RigidMotions::of(nodes, dofs.dimension());
        let names = motions.names(&motions.free(&motions.held(nodes, dofs)));
        match pieces.len() {
            1 => found.extend(names),
            _ => found.extend(names.iter().map(|name| format!("the piece of node {}: {name}", nodes[0].0))),
        }
    }
    match found.is_empty() {
        true => Ok(()),
        false => Err(Error::mechanism("reference body", found.len(), found)),
    }
}

/// Components of nodes that hold what the supports leave free, as few as there are free motions: node and component of
/// each. Always the component that the motions left move most; of equals the first.
pub fn hold_loose(positions: &[[f64; 3]], mesh: Option<&Mesh>, dofs: &DofMap) -> Vec<(usize, usize)> {
    pieces(positions, mesh, dofs).iter().flat_map(|nodes| hold_piece(nodes, dofs)).collect()
}

fn hold_piece(nodes: &Nodes, dofs: &DofMap) -> Vec<(usize, usize)> {
    let motions = RigidMotions::of(nodes, dofs.dimension());
    let mut held = motions.held(nodes, dofs);
    let mut chosen = Vec::new();
    loop {
        let free = motions.free(&held);
        let mut most = (0.0, None);
        for &(node, position) in nodes {
            for i in (0..dofs.dimension()).filter(|&i| dofs.free(node)[i] != FIXED && free.ncols() > 0) {
                let row = motions.component(position, i);
                let part = |m: usize| row.iter().zip(free.column(m).iter()).map(|(r, m)| r * m).sum::<f64>();
                let moved: f64 = (0..free.ncols()).map(|m| part(m).powi(2)).sum();
                // a clear winner only: equal motions go to the first node and axis, whatever the rounding
                if moved > most.0 * (1.0 + 1e-9) {
                    most = (moved, Some((node, position, i)));
                }
            }
        }
        let Some((node, position, i)) = most.1 else { return chosen };
        motions.hold(&mut held, position, i);
        chosen.push((node, i));
    }
}

/// The nodes of every piece of the body; one piece without a mesh.
fn pieces(positions: &[[f64; 3]], mesh: Option<&Mesh>, dofs: &DofMap) -> Vec<Vec<(usize, [f64; 3])>> {
    let Some(mesh) = mesh else { return vec![positions.iter().copied().enumerate().collect()] };
    let mut piece: Vec<usize> = (0..dofs.nodes()).map(|node| dofs.master(node)).collect();
    for cell in 0..mesh.cells() {
        let corners = mesh.corners(cell);
        let roots: Vec<usize> = corners.iter().map(|&node| root(&mut piece, node as usize)).collect();
        let first = roots.iter().copied().min().unwrap_or(0);
        roots.into_iter().for_each(|other| piece[other] = first);
    }
    let mut pieces = BTreeMap::<usize, Vec<(usize, [f64; 3])>>::new();
    for (node, &position) in positions.iter().enumerate() {
        pieces.entry(root(&mut piece, node)).or_default().push((node, position));
    }
    pieces.into_values().collect()
}

/// The first node of the piece of a node; shortens the way there.
fn root(piece: &mut [usize], node: usize) -> usize {
    let mut at = node;
    while piece[at] != at {
        piece[at] = piece[piece[at]];
        at = piece[at];
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::CellKind;

    const CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0]];

    fn dofs(dimension: usize, positions: &[[f64; 3]], held: &[(usize, usize)]) -> DofMap {
        let mut fixed = vec![[false; 3]; positions.len()];
        for &(node, component) in held {
            fixed[node][component] = true;
        }
        DofMap::untied(dimension, &fixed)
    }

    fn outcome(dimension: usize, positions: &[[f64; 3]], held: &[(usize, usize)]) -> Result<()> {
        check(positions, None, &dofs(dimension, positions, held))
    }

    fn loose(modes: usize, motions: &[&str]) -> Result<()> {
        let motions = motions.iter().map(|motion| (*motion).to_owned()).collect();
        Err(Error::mechanism("reference body", modes, motions))
    }

    #[test]
    fn the_free_motions_are_counted_and_named() {
        assert_eq!(outcome(2, &CORNERS, &[(0, 0), (0, 1), (1, 0)]), Ok(()));
        let turn = "it can turn about z through (0, 0) m";
        assert_eq!(outcome(2, &CORNERS, &[(0, 0), (0, 1)]), loose(1, &[turn]));
        let slides = ["it can slide along x", "it can slide along y"];
        let about_centre = "it can turn about z through (1, 1) m";
        assert_eq!(outcome(2, &CORNERS, &[]), loose(3, &[about_centre, slides[0], slides[1]]));
        // two held in y at different places, nothing in x: slides along x
        assert_eq!(outcome(2, &CORNERS, &[(0, 1), (2, 1)]), loose(1, &slides[..1]));
    }

    #[test]
    fn what_is_loose_is_held_by_as_many_components_as_there_are_motions() {
        let mut solid = CORNERS.to_vec();
        solid.extend(CORNERS.map(|[x, y, _]| [x, y, 3.0]));
        for (dimension, positions, held, count) in [
            (2, &CORNERS[..], &[][..], 3),
            (2, &CORNERS, &[(0, 0), (0, 1)], 1),
            (3, &solid, &[], 6),
            (3, &solid, &[(0, 0), (0, 1), (0, 2), (4, 0), (4, 1)], 1),
            (3, &solid, &[(0, 0), (0, 1), (0, 2), (4, 0), (4, 1), (1, 0)], 0),
        ] {
            let chosen = hold_loose(positions, None, &dofs(dimension, positions, held));
            assert_eq!(chosen.len(), count, "{held:?}: {chosen:?}");
            assert_eq!(outcome(dimension, positions, &[held, &chosen].concat()), Ok(()), "{held:?}: {chosen:?}");
        }
    }

    #[test]
    fn two_pieces_are_held_each_by_itself() {
        let mut positions = CORNERS.to_vec();
        positions.extend(CORNERS.map(|[x, y, z]| [x + 5.0, y, z]));
        let mut mesh = Mesh::new(2, positions.clone());
        mesh.push(CellKind::Quadrilateral, &[0, 2, 3, 1]);
        mesh.push(CellKind::Quadrilateral, &[4, 6, 7, 5]);
        let held = |nodes: &[usize]| {
            let mut fixed = vec![[false; 3]; 8];
            nodes.iter().for_each(|&node| fixed[node] = [true; 3]);
            DofMap::untied(2, &fixed)
        };
        let first = held(&[0, 1]);
        assert_eq!(check(&positions, None, &first), Ok(()));
        let named = |motion: &str| format!("the piece of node 4: it can {motion}");
        let motions = ["turn about z through (6, 1) m", "slide along x", "slide along y"].map(named);
        let motions = [&motions[0][..], &motions[1], &motions[2]];
        assert_eq!(check(&positions, Some(&mesh), &first), loose(3, &motions));
        assert_eq!(hold_loose(&positions, Some(&mesh), &first).len(), 3);
        assert_eq!(check(&positions, Some(&mesh), &held(&[0, 1, 6, 7])), Ok(()));
        // tied at two nodes, the first piece holds the second
        let mut fixed = vec![[false; 3]; 8];
        fixed[..2].fill([true; 3]);
        let tied = DofMap::new(2, vec![0, 1, 2, 3, 2, 3, 6, 7], &fixed);
        assert_eq!(check(&positions, Some(&mesh), &tied), Ok(()));
    }

    #[test]
    fn a_solid_held_along_a_line_turns_about_it() {
        let mut positions = CORNERS.to_vec();
        positions.extend(CORNERS.map(|[x, y, _]| [x, y, 3.0]));
        let line: Vec<(usize, usize)> = [0, 4].iter().flat_map(|&n| (0..3).map(move |i| (n, i))).collect();
        assert!(outcome(3, &positions, &line).is_err());
        let plane: Vec<(usize, usize)> = [0, 1, 2].iter().flat_map(|&n| (0..3).map(move |i| (n, i))).collect();
        assert_eq!(outcome(3, &positions, &plane), Ok(()));
    }
}
