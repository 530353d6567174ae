//! The spring network as ParaView shows it: one line a spring, between the nodes.
//!
//! On the points the displacement of the reference, that of the springs, and their difference (springs minus
//! reference), m; with several load cases one field a case. On the lines the group, the stiffness (N/m) and the rest
//! length (m). Tied nodes are there with the displacement of their master; their springs end at the master.

use super::Calibrated;
use super::vtu::{self, Cells, Field, UnstructuredGrid};

/// The text of springs.vtu.
pub fn document(results: &Calibrated) -> Vec<u8> {
    let network = results.network;
    let lengths = network.springs.iter().map(|spring| spring.length).collect();
    let groups = results.grouping.group_of.iter().map(|&group| i64::from(group)).collect();
    vtu::document(&UnstructuredGrid {
        points: network.positions.clone(),
        cells: Cells::equal(vtu::LINE, 2, network.springs.iter().flat_map(|spring| spring.nodes).collect()),
        point_fields: displacements(results),
        cell_fields: vec![
            Field::integer("group", groups),
            Field::scalar("stiffness", results.stiffness.to_vec()),
            Field::scalar("length", lengths),
        ],
    })
}

fn displacements(results: &Calibrated) -> Vec<Field> {
    let mut fields = Vec::new();
    for case in results.cases {
        let pairs = case.reference.iter().zip(case.springs);
        let error: Vec<[f64; 3]> = pairs.map(|(u, v)| [v[0] - u[0], v[1] - u[1], v[2] - u[2]]).collect();
        for (name, values) in
            [("displacement_reference", case.reference), ("displacement_springs", case.springs), ("error", &error)]
        {
            fields.push(Field::vector(results.field_name(name, case), values));
        }
    }
    fields
}
