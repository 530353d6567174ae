//! The network of a finished run for ParaView: one line a spring.

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::export::finished::{Finished, padded};
use crate::export::vtu::{self, Cells, Field, UnstructuredGrid};
use crate::export::write;

/// Writes network.vtu.
pub(super) fn write(run: &Finished, folder: &Path) -> Result<Vec<PathBuf>> {
    let springs = &run.springs;
    let held = springs.fixed.iter().map(|held| padded(held, false).map(|held| f64::from(u8::from(held))));
    let mut point_fields = vec![
        Field::integer("control_point", springs.nodes.iter().map(|&node| node as i64).collect()),
        Field::vector("held", &held.collect::<Vec<_>>()),
    ];
    point_fields.extend(springs.masses.as_ref().map(|masses| Field::scalar("mass", masses.clone())));
    for load in &springs.loads {
        let forces: Vec<[f64; 3]> = load.forces.iter().map(|force| padded(force, 0.0)).collect();
        point_fields.push(Field::vector(format!("force_{}", load.name), &forces));
    }
    let mut cell_fields = vec![
        Field::integer("group", springs.group.iter().map(|&group| i64::from(group)).collect()),
        Field::scalar("k", springs.k.to_vec()),
        Field::scalar("length", springs.rest_lengths.clone()),
    ];
    cell_fields.extend(springs.c.as_ref().map(|c| Field::scalar("c", c.to_vec())));
    let grid = UnstructuredGrid {
        points: run.network.positions.clone(),
        cells: Cells::equal(vtu::LINE, 2, springs.edges.concat()),
        point_fields,
        cell_fields,
    };
    let path = folder.join("network.vtu");
    write::whole(&path, &vtu::document(&grid))?;
    Ok(vec![path])
}
