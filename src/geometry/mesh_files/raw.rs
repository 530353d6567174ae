//! What a file holds, before it is a mesh: nodes with the numbers of the file, cells of both dimensions, groups.

use super::source::Source;
use crate::error::{Error, Result};
use crate::geometry::mesh::CellKind;
use crate::geometry::patch::MAX_NODES;

/// Nodes of a file, with the numbers it gives them.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    /// Places (m).
    pub(super) positions: Vec<[f64; 3]>,
    tags: Vec<u64>,
    sorted: Vec<(u64, u32)>,
}

impl Nodes {
    /// Room for `count` more nodes.
    pub(super) fn reserve(&mut self, count: usize) {
        self.positions.reserve_exact(count);
        self.tags.reserve_exact(count);
    }

    /// Appends a node with the file's number for it.
    pub(super) fn push(&mut self, tag: u64, position: [f64; 3]) {
        self.tags.push(tag);
        self.positions.push(position);
    }

    /// The file's number of a node.
    pub(super) fn tag(&self, node: u32) -> u64 {
        self.tags[node as usize]
    }

    /// True when the file numbers its nodes one after the other.
    fn in_sequence(&self) -> bool {
        self.tags.windows(2).all(|pair| pair[0].checked_add(1) == Some(pair[1]))
    }

    /// Makes the nodes findable by their numbers.
    ///
    /// # Errors
    /// A number that two nodes have; more nodes than can be numbered.
    pub(super) fn index(&mut self, source: &Source) -> Result<()> {
        if self.positions.len() > MAX_NODES {
            let message = format!("the file has {} nodes", self.positions.len());
            return Err(source.refuse(message, format!("at most {MAX_NODES}")));
        }
        if self.in_sequence() {
            return Ok(());
        }
        self.sorted = self.tags.iter().zip(0..).map(|(&tag, node)| (tag, node)).collect();
        self.sorted.sort_unstable();
        match self.sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            None => Ok(()),
            Some(pair) => Err(source.refuse(
                format!("two nodes of this section have the number {}", pair[0].0),
                "give every node its own number",
            )),
        }
    }

    /// The node with this number.
    pub(super) fn find(&self, tag: u64) -> Option<u32> {
        if self.sorted.is_empty() {
            let node = tag.checked_sub(*self.tags.first()?)?;
            return (node < self.tags.len() as u64).then_some(node as u32);
        }
        self.sorted.binary_search_by_key(&tag, |&(tag, _)| tag).ok().map(|at| self.sorted[at].1)
    }

    /// The node with this number, or an error at this place.
    pub(super) fn corner(&self, tag: u64, source: &Source) -> Result<u32> {
        self.find(tag).ok_or_else(|| {
            source.refuse(
                format!("node {tag} is named, but the file has no such node"),
                format!("it has {} nodes; name one of them", self.positions.len()),
            )
        })
    }
}

/// Cells of one dimension, with their lines in the file.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub(super) kinds: Vec<CellKind>,
    pub(super) corners: Vec<u32>,
    /// The line of each cell, 0 where it has none.
    pub(super) lines: Vec<u32>,
}

/// Corners of a cell, at most.
const CORNERS: usize = 8;

impl Cells {
    /// Makes cells with the same corners one cell, the first of them, where they are in different groups (one number a cell,
    /// in the order of the cells): a format with one group a cell repeats those in several. Others stay, to be refused.
    pub(super) fn unite(&mut self, groups: &[i32]) {
        if groups.windows(2).all(|pair| pair[0] == pair[1]) {
            return;
        }
        let mut named: Vec<([u32; CORNERS], i32, u32)> = Vec::with_capacity(groups.len());
        let mut start = 0;
        for (cell, (kind, &group)) in self.kinds.iter().zip(groups).enumerate() {
            let mut corners = [u32::MAX; CORNERS];
            corners[..kind.corners()].copy_from_slice(&self.corners[start..][..kind.corners()]);
            corners.sort_unstable();
            named.push((corners, group, cell as u32));
            start += kind.corners();
        }
        named.sort_unstable();
        let mut kept = vec![true; groups.len()];
        for same in named.chunk_by(|a, b| a.0 == b.0) {
            if same.windows(2).all(|pair| pair[0].1 != pair[1].1) {
                let first = same.iter().map(|cell| cell.2).min();
                same.iter().for_each(|cell| kept[cell.2 as usize] = Some(cell.2) == first);
            }
        }
        self.retain(&kept);
    }

    /// Keeps only some cells.
    fn retain(&mut self, kept: &[bool]) {
        let of_corners =
            self.kinds.iter().zip(kept).flat_map(|(kind, &kept)| std::iter::repeat_n(kept, kind.corners()));
        let mut of_corners = of_corners.collect::<Vec<_>>().into_iter();
        self.corners.retain(|_| of_corners.next() == Some(true));
        for_kept(&mut self.kinds, kept);
        for_kept(&mut self.lines, kept);
    }
}

/// Keeps only some items.
fn for_kept<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    items.retain(|_| kept.next() == Some(&true));
}

/// A group of the file: its dimension, [`MARKER`] where it has none, and its number.
pub(super) type Group = (i32, i32);

/// The dimension of a group that is a marker of nodes.
pub(super) const MARKER: i32 = -1;

/// Groups in a file, at most.
pub(super) const MOST_GROUPS: usize = 1 << 16;

/// All that a reader found.
#[derive(Debug, Default)]
pub(super) struct Raw {
    pub(super) nodes: Nodes,
    /// Triangles and quadrilaterals, then tetrahedra and hexahedra.
    pub(super) cells: [Cells; 2],
    /// Names that the file gives to groups.
    pub(super) names: Vec<(Group, String)>,
    /// Groups and their nodes, in any order and repeated.
    pub(super) members: Vec<(Group, u32)>,
    /// For each node the last run of cells that enrolled it.
    enrolled: Vec<u32>,
}

impl Raw {
    /// Appends a cell.
    pub(super) fn push(&mut self, kind: CellKind, corners: &[u32], line: usize) {
        let cells = &mut self.cells[kind.dimension() - 2];
        cells.kinds.push(kind);
        cells.corners.extend_from_slice(corners);
        cells.lines.push(u32::try_from(line).unwrap_or(0));
    }

    /// Room for `count` cells of a kind.
    pub(super) fn reserve(&mut self, kind: CellKind, count: usize) {
        let cells = &mut self.cells[kind.dimension() - 2];
        cells.kinds.reserve(count);
        cells.corners.reserve(count * kind.corners());
        cells.lines.reserve(count);
    }

    /// Puts the corners of a cell into groups. Cells of equal groups that follow each other have the same `run`, from 1: a
    /// node is written once a run.
    pub(super) fn enroll(&mut self, groups: &[Group], run: u32, corners: &[u32], source: &Source) -> Result<()> {
        let most = source.length() / 2 + (1 << 20);
        self.enrolled.resize(self.nodes.positions.len(), 0);
        for &node in corners {
            if std::mem::replace(&mut self.enrolled[node as usize], run) == run {
                continue;
            }
            if self.members.len() + groups.len() > most {
                let message = format!("the groups hold more than {most} nodes together");
                return Err(source.refuse(message, "put each entity into fewer groups"));
            }
            self.members.extend(groups.iter().map(|&group| (group, node)));
        }
        Ok(())
    }
}

/// Refuses a kind of cell that is not read, naming it.
pub(super) fn unsupported(source: &Source, name: &str) -> Error {
    let help = if name.contains("order") || name.contains("quadratic") {
        "save the mesh with straight cells of the first order (in Gmsh: Mesh.ElementOrder = 1)"
    } else {
        "cells are triangles, quadrilaterals, tetrahedra and hexahedra: mesh the body with these"
    };
    source.refuse(format!("a cell is a {name}"), help)
}
