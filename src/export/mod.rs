//! Floor 4: results as files that other programs read.
//!
//! | file | idea |
//! |---|---|
//! | [`springs_json`] | the network itself: everything a simulator needs |
//! | [`control_net`] | the network as lines, with both displacements and their difference, for ParaView |
//! | [`body`] | the exact body of a patch as rational Bezier cells, with the reference displacement, for ParaView |
//! | [`mesh`] | the cells of a mesh, likewise |
//! | [`motion`] | the network in motion: a series for ParaView, a table, plots |
//! | [`plot`] | curves over time as an SVG |
//! | [`vtu`] | the XML file format of VTK's unstructured grids |
//! | [`mod@write`] | a file appears whole or not at all |
//! | [`finished`] | springs.json and result.json read back, checked |
//! | [`folder`] | all files of a run together or none of them; one run at a time |
//! | [`formats`] | a finished run in the formats of other programs |

pub mod body;
pub mod control_net;
pub mod finished;
pub mod folder;
pub mod formats;
pub mod mesh;
pub mod motion;
pub mod plot;
pub mod springs_json;
pub mod vtu;
pub mod write;

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::geometry::mesh::Mesh;
use crate::geometry::patch::Patch;
use crate::springs::grouping::Grouping;
use crate::springs::network::Network;

/// What a body is made of.
#[derive(Debug, Clone, Copy)]
pub enum Body<'a> {
    /// A patch; its nodes are the control points.
    Patch(&'a Patch),
    /// A mesh.
    Mesh(&'a Mesh),
}

/// A calibrated network beside the body it stands for.
#[derive(Debug, Clone, Copy)]
pub struct Calibrated<'a> {
    /// Name of the scene.
    pub name: &'a str,
    /// The body.
    pub body: Body<'a>,
    /// The springs between its nodes.
    pub network: &'a Network,
    /// Supports and ties of the nodes.
    pub dofs: &'a DofMap,
    /// The group of every spring.
    pub grouping: &'a Grouping,
    /// Stiffness of every spring, N/m, multiplicity included.
    pub stiffness: &'a [f64],
    /// Mass of every node, kg; when the scene has dynamics.
    pub masses: Option<&'a [f64]>,
    /// Damping of every spring, N s/m; when the scene has dynamics.
    pub damping: Option<&'a [f64]>,
    /// The load cases.
    pub cases: &'a [Case<'a>],
    /// The motions, one for each alpha; empty where nothing moved.
    pub motions: &'a [motion::Recorded<'a>],
}

/// What the nodes do under one load.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// Name of the load case; appended to the names of fields when there are several.
    pub name: &'a str,
    /// False when it was held out of the fit.
    pub fit: bool,
    /// Force on every node, N; 0 where it is held.
    pub forces: &'a [[f64; 3]],
    /// Displacement of every node in the reference, m.
    pub reference: &'a [[f64; 3]],
    /// Displacement of every node of the springs, m.
    pub springs: &'a [[f64; 3]],
}

impl Calibrated<'_> {
    /// Name of a field of one case: the plain name when there is only one.
    fn field_name(&self, field: &str, case: &Case) -> String {
        if self.cases.len() == 1 { field.to_owned() } else { format!("{field}_{}", case.name) }
    }
}

/// A way to write results, chosen by its name.
pub struct Exporter {
    /// The word on the command line.
    pub name: &'static str,
    /// What it writes, in a line.
    pub doc: &'static str,
    /// Writes into a folder, and says which files.
    pub write: fn(&Calibrated, &Path) -> Result<Vec<PathBuf>>,
}

/// All exporters.
pub const EXPORTERS: &[Exporter] = &[
    Exporter {
        name: "springs",
        doc: "springs.json: positions, masses, edges, rest lengths, groups, stiffness, damping",
        write: springs_json::write,
    },
    Exporter {
        name: "vtu",
        doc: "springs.vtu and body.vtu for ParaView: the network, and the exact body",
        write: write_vtu,
    },
    Exporter {
        name: "motion",
        doc: "motion.pvd (a series for ParaView), motion.csv and plots of strain and energies; where the scene moves",
        write: motion::write,
    },
];

/// The exporter of this name.
pub fn find(name: &str) -> Option<&'static Exporter> {
    EXPORTERS.iter().find(|exporter| exporter.name == name)
}

fn write_vtu(results: &Calibrated, folder: &Path) -> Result<Vec<PathBuf>> {
    let (springs, body) = (folder.join("springs.vtu"), folder.join("body.vtu"));
    write::whole(&springs, &control_net::document(results))?;
    let text = match results.body {
        Body::Patch(patch) => body::document(patch, results)?,
        Body::Mesh(mesh) => mesh::document(mesh, results),
    };
    write::whole(&body, &text)?;
    Ok(vec![springs, body])
}
