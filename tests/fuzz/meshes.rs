//! Mesh readers: no cell that cannot be computed on.

use std::fs;
use std::path::Path;

use springfit::geometry::mesh_files::{MeshFile, parse, parse_tetgen};

use super::memory::measured;
use super::{Verdict, fuzz};

/// Words that readers take for counts, places and kinds.
const WORDS: &[&str] = &[
    "0",
    "1",
    "-1",
    "2",
    "3",
    "4",
    "5",
    "7",
    "9",
    "10",
    "11",
    "12",
    "99",
    "1000000000",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999999",
    "nan",
    "inf",
    "1e999",
    "-1e308",
    "1e308",
    "1e-320",
    "",
    "\n",
    " ",
    "\r\n",
    "#",
    "\"",
    "\0",
    "é",
    "$Nodes",
    "$EndNodes",
    "$Elements",
    "$EndElements",
    "$Entities",
    "$EndEntities",
    "$PhysicalNames",
    "$MeshFormat",
    "$Other",
    "2.2",
    "4.1",
    "OFFSETS",
    "CONNECTIVITY",
    "CELLS",
    "CELL_TYPES",
    "POINTS",
    "POLYGONS",
    "LINES",
    "FIELD",
    "METADATA",
    "POINT_DATA",
    "ASCII",
    "BINARY",
    "POLYDATA",
    "UNSTRUCTURED_GRID",
    "vtktypeint64",
    "float",
    "double",
];

/// Every cell of a mesh that was read can be computed on.
fn assert_sound(file: &MeshFile) {
    let mesh = &file.mesh;
    assert!(mesh.cells() > 0);
    assert!(mesh.positions().iter().flatten().all(|x| x.is_finite()));
    for cell in 0..mesh.cells() {
        assert!(mesh.measure(cell) > 0.0 && mesh.measure(cell).is_finite(), "cell {cell}: {}", mesh.measure(cell));
    }
    assert!(mesh.faces().is_ok());
    let nodes = mesh.positions().len() as u32;
    assert!(
        file.sets.iter().all(|(_, set)| !set.is_empty() && set.is_sorted() && set.iter().all(|&node| node < nodes))
    );
}

/// A mesh that was read is sound; an error says what to do.
fn verdict(result: &springfit::error::Result<MeshFile>) -> Verdict {
    result.as_ref().map(assert_sound).map_err(Clone::clone)
}

fn fixtures(extension: &str) -> Vec<Vec<Vec<u8>>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|found| found == extension));
    paths.sort();
    assert!(!paths.is_empty());
    paths.iter().map(|path| vec![fs::read(path).unwrap()]).collect()
}

#[test]
fn gmsh_files_damaged_at_random() {
    fuzz("gmsh", WORDS, &fixtures("msh"), |files| parse(Path::new("body.msh"), &files[0]), verdict);
}

#[test]
fn vtk_files_damaged_at_random() {
    fuzz("vtk", WORDS, &fixtures("vtk"), |files| parse(Path::new("body.vtk"), &files[0]), verdict);
}

#[test]
fn tetgen_files_damaged_at_random() {
    let flat = [
        "4 2 1 1\n1 0 0 9 5\n2 1 0 9 0\n3 1 1 9 -2\n4 0 1 9 5 # last\n",
        "# remark\n2 3 1\n1 1 2 3 0.5\n2 1 4 3 0.5\n",
    ];
    let (mut nodes, mut cells) = (fixtures("node"), fixtures("ele"));
    let space = vec![nodes.remove(0).remove(0), cells.remove(0).remove(0)];
    let corpus = [space, flat.map(|text| text.as_bytes().to_vec()).to_vec()];
    let read = |files: &[Vec<u8>]| parse_tetgen(Path::new("b.node"), &files[0], Path::new("b.ele"), &files[1]);
    fuzz("tetgen", WORDS, &corpus, read, verdict);
}

/// Files that claim a thousand million nodes or cells, as text and binary, cost no more than small files.
#[test]
fn a_claim_of_1e9_nodes_costs_nothing() {
    let head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    let new = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
    let nodes = "$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n";
    let new_nodes = "$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n$EndNodes\n";
    let vtk = "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\n";
    let points = "POINTS 3 float\n0 0 0 1 0 0 0 1 0\n";
    let binary = vtk.replace("ASCII", "BINARY");
    let claims = [
        ("a.msh", format!("{head}$Nodes\n1000000000\n1 0 0 0\n")),
        ("a.msh", format!("{head}{nodes}$Elements\n1000000000\n1 2 0 1 2 3\n")),
        ("a.msh", format!("{head}$PhysicalNames\n1000000000\n1 1 \"a\"\n")),
        ("a.msh", format!("{new}$Nodes\n1 1000000000 1 1000000000\n2 1 0 1000000000\n1\n")),
        ("a.msh", format!("{new}$Entities\n1000000000 0 0 0\n1 0 0 0 1000000000 1\n")),
        ("a.msh", format!("{new}{new_nodes}$Elements\n1 1000000000 1 9\n2 1 2 1000000000\n1 1 2 3\n")),
        ("a.vtk", format!("{vtk}POINTS 1000000000 double\n0 0 0\n")),
        ("a.vtk", format!("{vtk}{points}CELLS 1000000000 4000000000\n3 0 1 2\n")),
        ("a.vtk", format!("{vtk}{points}CELLS 1000000000 4000000000\nOFFSETS vtktypeint64\n0 3\n")),
        ("a.vtk", format!("{vtk}{points}CELL_TYPES 1000000000\n5\n")),
        ("a.vtk", format!("{vtk}FIELD f 1\na 1000000000 1000000000 double\n5\n")),
        ("a.vtk", format!("{binary}POINTS 1000000000 double\n12345678")),
    ];
    for (name, text) in claims {
        let (result, memory) = measured(|| parse(Path::new(name), text.as_bytes()));
        assert!(result.is_err() && memory < 100_000, "{memory} bytes: {text}");
    }
    let pair = || parse_tetgen(Path::new("b.node"), b"1000000000 3\n0 0 0 0\n", Path::new("b.ele"), b"");
    let (result, memory) = measured(pair);
    assert!(result.is_err() && memory < 100_000, "{memory} bytes");
}

/// The shortest records: many nodes and cells in few bytes.
#[test]
fn memory_of_dense_files_is_ten_times_their_size_at_most() {
    let side = 300_usize;
    let mut points = String::new();
    let (mut old, mut cells) = (String::new(), String::new());
    for i in 0..side * side {
        points += &format!("{} {} 0\n", i % side, i / side);
        old += &format!("{} {} {} 0\n", i, i % side, i / side);
    }
    let corners = |i: usize| [i, i + 1, i + side + 1, i + side];
    let starts = || (0..side * (side - 1)).filter(|i| i % side < side - 1);
    for i in starts() {
        let [a, b, c, d] = corners(i);
        cells += &format!("4 {a} {b} {c} {d}\n");
    }
    let count = (side - 1) * (side - 1);
    let vtk = format!(
        "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS {} float\n{points}POLYGONS {count} {}\n{cells}",
        side * side,
        5 * count
    );
    let elements: String = starts()
        .map(|i| {
            let [a, b, c, d] = corners(i);
            format!("1 3 1 7 {a} {b} {c} {d}\n")
        })
        .collect();
    let gmsh = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n{old}$EndNodes\n$Elements\n{count}\n{elements}$EndElements\n",
        side * side
    );
    for (name, text) in [("dense.vtk", vtk), ("dense.msh", gmsh)] {
        let (result, memory) = measured(|| parse(Path::new(name), text.as_bytes()));
        assert_eq!(result.unwrap().mesh.cells(), count);
        println!("{name}: {} bytes, memory {:.2} times the file", text.len(), memory as f64 / text.len() as f64);
        assert!(memory < 9 * text.len(), "{memory} bytes for a file of {}", text.len());
    }
}
