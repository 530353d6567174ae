//! The network as tables: a head line, then a line a node, a spring, a group. Numbers have every digit that f64 has.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::export::finished::Finished;
use crate::export::write;

const AXES: [char; 3] = ['x', 'y', 'z'];

/// Writes nodes.csv, springs.csv and groups.csv.
pub(super) fn write(run: &Finished, folder: &Path) -> Result<Vec<PathBuf>> {
    let tables = [("nodes.csv", nodes(run)), ("springs.csv", springs(run)), ("groups.csv", groups(run))];
    let one = |(name, text): (&str, String)| {
        let path = folder.join(name);
        write::whole(&path, text.as_bytes()).map(|()| path)
    };
    tables.into_iter().map(one).collect()
}

fn nodes(run: &Finished) -> String {
    let springs = &run.springs;
    let axes = &AXES[..springs.dimension];
    let named = |before: &str| axes.iter().map(|axis| format!("{before}{axis}")).collect::<Vec<_>>();
    let mut head = vec!["node".to_owned(), "control_point".to_owned()];
    head.extend(named(""));
    head.extend(named("held_"));
    head.extend(springs.masses.is_some().then(|| "mass".to_owned()));
    head.extend(springs.loads.iter().flat_map(|load| named(&format!("force_{}_", load.name)).into_iter().map(quoted)));
    let mut text = head.join(",") + "\n";
    for node in 0..springs.nodes.len() {
        let _ = write!(text, "{node},{}", springs.nodes[node]);
        springs.positions[node].iter().for_each(|x| text.push_str(&format!(",{x:?}")));
        springs.fixed[node].iter().for_each(|&held| text.push_str(&format!(",{}", u8::from(held))));
        springs.masses.iter().for_each(|masses| text.push_str(&format!(",{:?}", masses[node])));
        springs
            .loads
            .iter()
            .flat_map(|load| &load.forces[node])
            .for_each(|force| text.push_str(&format!(",{force:?}")));
        text.push('\n');
    }
    text
}

fn springs(run: &Finished) -> String {
    let springs = &run.springs;
    let mut text = "spring,from,to,length,group,k".to_owned() + if springs.c.is_some() { ",c\n" } else { "\n" };
    for (s, [a, b]) in springs.edges.iter().enumerate() {
        let group = quoted(springs.groups[springs.group[s] as usize].clone());
        let _ = write!(text, "{s},{a},{b},{:?},{group},{:?}", springs.rest_lengths[s], springs.k[s]);
        springs.c.iter().for_each(|c| text.push_str(&format!(",{:?}", c[s])));
        text.push('\n');
    }
    text
}

fn groups(run: &Finished) -> String {
    let mut text = "group,springs,length,stiffness,lower,upper\n".to_owned();
    for group in &run.groups {
        let _ = write!(text, "{},{},{:?}", quoted(group.name.clone()), group.springs, group.length);
        let _ = writeln!(text, ",{:?},{:?},{:?}", group.stiffness, group.lower, group.upper);
    }
    text
}

/// A name that may hold commas or quotes.
fn quoted(name: String) -> String {
    if name.contains([',', '"', '\n', '\r']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name }
}
