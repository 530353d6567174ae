//! A scene of SOFA (sofa-framework.org) with the springs of a finished run.
//!
//! The components and their words are those of SOFA 24.06 and later: `MechanicalObject` for the nodes, `SpringForceField` with
//! five numbers a spring (two nodes, k in N/m, damping along the spring in N s/m, rest length in m), a
//! `PartialFixedProjectiveConstraint` for each combination of held components, `ConstantForceField` for the first load case. With
//! masses (`DiagonalMass`) it moves by `EulerImplicitSolver`; without it is solved at rest by `StaticSolver`. In two
//! dimensions the third component of all nodes is held. Gravity is off: the loads are what the springs were fitted to.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::export::finished::{Finished, padded};
use crate::export::write;

/// The parts of SOFA that the scene needs.
const PLUGINS: [&str; 8] = [
    "Sofa.Component.Constraint.Projective",
    "Sofa.Component.LinearSolver.Direct",
    "Sofa.Component.Mass",
    "Sofa.Component.MechanicalLoad",
    "Sofa.Component.ODESolver.Backward",
    "Sofa.Component.SolidMechanics.Spring",
    "Sofa.Component.StateContainer",
    "Sofa.Component.Topology.Container.Dynamic",
];

/// Time step of the moving scene, s; every step is stable.
const STEP: f64 = 0.01;

/// Writes springs.scn.
pub(super) fn write(run: &Finished, folder: &Path) -> Result<Vec<PathBuf>> {
    let path = folder.join("springs.scn");
    write::whole(&path, document(run).as_bytes())?;
    Ok(vec![path])
}

fn document(run: &Finished) -> String {
    let springs = &run.springs;
    let mut text = format!("<?xml version=\"1.0\"?>\n<Node name=\"root\" dt=\"{STEP}\" gravity=\"0 0 0\">\n");
    PLUGINS.iter().for_each(|plugin| text.push_str(&format!("  <RequiredPlugin name=\"{plugin}\"/>\n")));
    text += "  <DefaultAnimationLoop/>\n  <Node name=\"springs\">\n";
    text += if springs.masses.is_some() { "    <EulerImplicitSolver/>\n" } else { "    <StaticSolver/>\n" };
    text += "    <EigenSimplicialLDLT template=\"CompressedRowSparseMatrixMat3x3d\"/>\n";
    let places = run.network.positions.iter().flatten().copied();
    element(&mut text, "MechanicalObject name=\"nodes\" template=\"Vec3d\"", &[("position", numbers(places))]);
    let edges = springs.edges.iter().flatten().map(u32::to_string).collect::<Vec<_>>().join(" ");
    element(&mut text, "EdgeSetTopologyContainer position=\"@nodes.position\"", &[("edges", edges)]);
    if let Some(masses) = &springs.masses {
        element(&mut text, "DiagonalMass", &[("vertexMass", numbers(masses.iter().copied()))]);
    }
    element(&mut text, "SpringForceField", &[("spring", bars(run))]);
    for (held, nodes) in supports(run) {
        let directions = held.map(|held| if held { "1" } else { "0" }).join(" ");
        let values = [("fixedDirections", directions), ("indices", nodes)];
        element(&mut text, "PartialFixedProjectiveConstraint", &values);
    }
    if let Some(load) = springs.loads.first() {
        let forces: Vec<[f64; 3]> = load.forces.iter().map(|force| padded(force, 0.0)).collect();
        let loaded: Vec<usize> = (0..forces.len()).filter(|&node| forces[node] != [0.0; 3]).collect();
        let indices = loaded.iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
        let forces = numbers(loaded.iter().flat_map(|&node| forces[node]));
        element(&mut text, "ConstantForceField", &[("indices", indices), ("forces", forces)]);
    }
    text + "  </Node>\n</Node>\n"
}

fn element(text: &mut String, start: &str, values: &[(&str, String)]) {
    let _ = write!(text, "    <{start}");
    values.iter().for_each(|(name, value)| text.push_str(&format!(" {name}=\"{value}\"")));
    *text += "/>\n";
}

fn numbers(values: impl Iterator<Item = f64>) -> String {
    values.map(|value| format!("{value:?}")).collect::<Vec<_>>().join(" ")
}

/// Two nodes, k, c and rest length of every spring.
fn bars(run: &Finished) -> String {
    let springs = &run.springs;
    let one = |(s, [a, b]): (usize, &[u32; 2])| {
        let damping = springs.c.as_ref().map_or(0.0, |c| c[s]);
        format!("{a} {b} {:?} {damping:?} {:?}", springs.k[s], springs.rest_lengths[s])
    };
    springs.edges.iter().enumerate().map(one).collect::<Vec<_>>().join(" ")
}

/// The nodes that are held in each combination of components.
fn supports(run: &Finished) -> BTreeMap<[bool; 3], String> {
    let mut found: BTreeMap<[bool; 3], String> = BTreeMap::new();
    for (node, held) in run.springs.fixed.iter().enumerate() {
        // a body in the plane stays in it
        let held = padded(held, true);
        if held != [false; 3] {
            let nodes = found.entry(held).or_default();
            let _ = write!(nodes, "{}{node}", if nodes.is_empty() { "" } else { " " });
        }
    }
    found
}
