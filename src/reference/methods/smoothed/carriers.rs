//! Which cells meet at which face, edge or node.
//!
//! A carrier is named by its sorted corners. Every cell names all its carriers; the names are sorted, and equal ones
//! beside each other are one carrier. Nothing is hashed, so the numbers do not depend on anything but the mesh.

use crate::error::{Error, Result};
use crate::reference::methods::smoothed::Smoothing;
use crate::reference::methods::smoothed::cells::Cells;

/// The most corners a carrier has.
const CORNERS: usize = 4;

/// A place in the name of a carrier with fewer corners.
pub const NONE: u32 = u32::MAX;

/// A cell at a carrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Incidence {
    /// Sorted corners of the carrier, padded with [`NONE`].
    pub carrier: [u32; CORNERS],
    /// The cell.
    pub cell: u32,
}

/// All incidences, those of one carrier together, and the share of a cell that each gets.
///
/// # Errors
/// [`Error::Input`] at `geometry` for a face between more than two cells.
pub fn incidences(cells: &Cells, smoothing: Smoothing, dimension: usize) -> Result<(Vec<Incidence>, f64)> {
    let corners = smoothing.corners(dimension);
    let subsets: Vec<usize> =
        (1..1_usize << (dimension + 1)).filter(|set| set.count_ones() as usize == corners).collect();
    let mut found = Vec::with_capacity(cells.len() * subsets.len());
    for cell in 0..cells.len() {
        for set in &subsets {
            found.push(Incidence { carrier: name(cells.nodes(cell), *set), cell: cell as u32 });
        }
    }
    found.sort_unstable();
    if corners == dimension {
        refuse_branching(&found)?;
    }
    Ok((found, 1.0 / subsets.len() as f64))
}

/// The sorted corners of a subset.
fn name(nodes: &[u32], set: usize) -> [u32; CORNERS] {
    let mut carrier = [NONE; CORNERS];
    let chosen = nodes.iter().enumerate().filter(|(i, _)| set >> i & 1 == 1);
    carrier.iter_mut().zip(chosen).for_each(|(to, (_, &node))| *to = node);
    carrier.sort_unstable();
    carrier
}

/// A face lies between two cells at most.
fn refuse_branching(found: &[Incidence]) -> Result<()> {
    let mut groups = found.chunk_by(|a, b| a.carrier == b.carrier);
    let Some(group) = groups.find(|group| group.len() > 2) else { return Ok(()) };
    let nodes: Vec<u32> = group[0].carrier.iter().copied().filter(|&node| node != NONE).collect();
    let cells: Vec<u32> = group.iter().map(|incidence| incidence.cell).collect();
    Err(Error::input(
        "geometry",
        format!("the face {nodes:?} belongs to the {} cells {cells:?}", cells.len()),
        "a mesh in which a face lies between two cells at most",
    ))
}
