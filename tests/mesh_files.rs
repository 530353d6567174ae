//! Mesh files: what other programs wrote is read, what is wrong is refused with its line.
//!
//! The files under `tests/meshes` were written by meshio 5.3.5 (`tets*`, `hexes*`, `mixed*`) and by Gmsh 4.15.2 (`gmsh*`).

use std::fs;
use std::path::{Path, PathBuf};

use springfit::geometry::mesh::quality::quality;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::geometry::mesh_files::{MeshFile, parse, parse_tetgen, read};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes").join(name)
}

fn mesh_of(name: &str) -> MeshFile {
    read(&fixture(name)).unwrap_or_else(|error| panic!("{error}"))
}

fn measure(mesh: &Mesh) -> f64 {
    quality(mesh).expect("there are cells").measure
}

/// Two tetrahedra on one face: the corner of the unit cube, and the one beyond it.
fn two_tetrahedra() -> Mesh {
    let places = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
    let mut mesh = Mesh::new(3, places.to_vec());
    mesh.push(CellKind::Tetrahedron, &[0, 1, 2, 3]);
    mesh.push(CellKind::Tetrahedron, &[1, 2, 3, 4]);
    mesh
}

#[test]
fn tetrahedra_of_meshio_come_back_from_every_format() {
    for name in [
        "tets_22.msh",
        "tets_22_binary.msh",
        "tets_41.msh",
        "tets_41_binary.msh",
        "tets_51.vtk",
        "tets.node",
        "tets.ele",
    ] {
        let file = mesh_of(name);
        assert_eq!(file.mesh, two_tetrahedra(), "{name}");
        assert_eq!(file.warnings, Vec::<String>::new(), "{name}");
    }
}

#[test]
fn physical_groups_of_meshio_are_sets() {
    for name in ["tets_22.msh", "tets_22_binary.msh"] {
        let sets = mesh_of(name).sets;
        assert_eq!(sets, [("held".to_owned(), vec![0, 1, 2, 3]), ("body".to_owned(), vec![0, 1, 2, 3, 4])], "{name}");
    }
}

#[test]
fn hexahedra_of_meshio_come_back_from_both_versions_of_vtk() {
    let first = mesh_of("hexes_42.vtk");
    assert_eq!((first.mesh.cells(), measure(&first.mesh)), (2, 2.0));
    assert_eq!(first.mesh.corners(1), [1, 2, 5, 4, 7, 8, 11, 10]);
    for name in ["hexes_42_binary.vtk", "hexes_51.vtk", "hexes_51_binary.vtk"] {
        assert_eq!(mesh_of(name), first, "{name}");
    }
}

#[test]
fn quadrilaterals_and_triangles_share_a_flat_mesh() {
    let file = mesh_of("mixed_flat_42.vtk");
    assert_eq!((file.mesh.dimension(), file.mesh.cells(), measure(&file.mesh)), (2, 3, 2.0));
    assert_eq!(mesh_of("mixed_flat_22.msh").mesh, file.mesh);
}

/// Two cubes, the volume of the second and one face of the first in two groups each: version 2 writes their elements once a
/// group, version 4 once.
#[test]
fn an_element_of_gmsh_in_two_groups_is_one_cell_in_both_sets() {
    let new = mesh_of("gmsh_groups_41.msh");
    let cells = |name: &str| {
        let (_, nodes) = new.sets.iter().find(|(set, _)| set == name).expect("a group of the file");
        (0..new.mesh.cells()).filter(|&c| new.mesh.corners(c).iter().all(|node| nodes.contains(node))).count()
    };
    assert_eq!((new.mesh.cells(), cells("body"), cells("right")), (48, 48, 24));
    assert!((measure(&new.mesh) - 2.0).abs() < 1e-14);
    for name in ["gmsh_groups_22.msh", "gmsh_groups_22_binary.msh"] {
        assert_eq!(mesh_of(name), new, "{name}");
    }
    // the first corner of the second cube's first cell at another place in one of the two: still the same cell
    let text = fs::read_to_string(fixture("gmsh_groups_22.msh")).unwrap();
    let [from, to] = ["34 4 2 2 2 22 23 14 20", "34 4 2 2 2 23 14 22 20"];
    assert!(text.contains(from));
    let parsed = |text: &str| parse(Path::new("two.msh"), text.as_bytes());
    assert_eq!(parsed(&text.replace(from, to)).unwrap(), new);
    // twice in one group it is a fault
    let twice = parsed(&text.replace(from, "34 4 2 1 2 22 23 14 20")).unwrap_err().to_string();
    assert!(twice.contains("is shared by 3 cells: of lines 71, 72"), "{twice}");
}

#[test]
fn a_box_of_gmsh_is_the_same_in_every_version() {
    let old = mesh_of("gmsh_box_22.msh");
    assert_eq!(old.mesh.dimension(), 3);
    assert!((measure(&old.mesh) - 0.5).abs() < 1e-15);
    let sets: Vec<(&str, usize)> = old.sets.iter().map(|(name, nodes)| (name.as_str(), nodes.len())).collect();
    assert_eq!(sets, [("fixed face", 5), ("body", 10), ("surface 12", 5)]);
    let fixed = &old.sets[0].1;
    assert!(fixed.iter().all(|&node| old.mesh.positions()[node as usize][2] == 0.0));
    for name in ["gmsh_box_22_binary.msh", "gmsh_box_41.msh", "gmsh_box_41_binary.msh"] {
        let other = mesh_of(name);
        assert_eq!((other.mesh.cells(), &other.sets), (old.mesh.cells(), &old.sets), "{name}");
        assert_eq!(other.mesh.positions(), old.mesh.positions(), "{name}");
    }
}

#[test]
fn the_centre_of_a_circle_is_left_out_with_a_word() {
    for name in ["gmsh_box_all.msh", "gmsh_box.vtk"] {
        let file = mesh_of(name);
        assert_eq!(file.mesh.positions().len(), 10, "{name}");
        assert!(
            file.warnings[0].starts_with("1 of 11 nodes are no corner of a cell and were left out: "),
            "{:?}",
            file.warnings
        );
        assert_eq!(file.mesh, mesh_of("gmsh_box_22.msh").mesh, "{name}");
    }
}

/// Table 4.1 of the thesis, experiment IV: nodes, and springs along the edges and the diagonals of quadrilaterals.
#[test]
fn thesis_table_4_1_membranes_of_experiment_iv() {
    let cases = [
        ("irregular_square.msh", 101, 328, 4.0, 48),
        ("circle_membrane.msh", 89, 316, 12.0 * 15f64.to_radians().sin(), 24),
    ];
    for (name, nodes, springs, area, boundary) in cases {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/meshes").join(name);
        let file = read(&path).unwrap();
        let mesh = &file.mesh;
        let found = quality(mesh).unwrap();
        assert_eq!((mesh.positions().len(), mesh.edges().len() + 2 * mesh.cells()), (nodes, springs), "{name}");
        assert!((found.measure - area).abs() < 1e-14, "{name}: {}", found.measure);
        assert!(found.least_jacobian.unwrap().0 > 0.67, "{found:?}");
        assert_eq!(mesh.boundary_faces().unwrap().len(), boundary);
        assert!(file.warnings.is_empty(), "{:?}", file.warnings);
        let members: usize = file.sets.iter().map(|(_, nodes)| nodes.len()).sum();
        assert_eq!(members, nodes + if boundary == 48 { 4 * 13 } else { 24 }, "{name}");
    }
}

/// The text of a fixture with one place changed.
fn changed(name: &str, from: &str, to: &str) -> String {
    let text = fs::read_to_string(fixture(name)).unwrap();
    assert!(text.contains(from), "{name} holds {from:?}");
    text.replacen(from, to, 1)
}

fn refusal(name: &str, text: &str) -> String {
    match parse(Path::new(name), text.as_bytes()) {
        Err(error) => format!("{error} | {}", error.help().expect("a remedy")),
        Ok(file) => format!("read: {file:?}"),
    }
}

/// Every change of the fixture, from one text to another, is refused with the message.
fn assert_refused(fixture: &str, name: &str, cases: &[(&str, &str, &str)]) {
    let wrong: Vec<String> = cases
        .iter()
        .map(|&(from, to, expected)| (refusal(name, &changed(fixture, from, to)), from, to, expected))
        .filter(|(found, _, _, expected)| !found.starts_with(&format!("{name}: ")) || !found.contains(expected))
        .map(|(found, from, to, expected)| format!("{from:?} -> {to:?}\n  expected {expected}\n  found    {found}"))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn gmsh_2_2_is_refused_with_line_and_remedy() {
    let cases = [
        ("2.2 0 8", "1.0 0 8", "line 2: version 1.0 is not read | save the mesh as version 4.1 or 2.2"),
        ("2.2 0 8", "4.0 0 8", "line 2: version 4.0 is not read"),
        ("2.2 0 8", "2.2 0 4", "line 2: file type 0 with data size 4"),
        ("2.2 0 8", "2.2 0", "line 2: the line ends where the data size should stand"),
        ("$MeshFormat", "MeshFormat", "line 1: \"MeshFormat\" stands where $MeshFormat should"),
        ("$EndMeshFormat", "$Nodes", "line 3: \"$Nodes\" stands where $EndMeshFormat should"),
        ("2 7 \"held\"", "2 7", "line 6: group 7 has no name"),
        ("2\n2 7", "3\n2 7", "line 8: the dimension of a group is \"$EndPhysicalNames\", not a whole number"),
        ("2\n2 7", "70000\n2 7", "line 5: 70000 names of groups | at most 65536"),
        ("\n5\n1 0", "\n4\n1 0", "line 15: \"5\" stands where $EndNodes should"),
        ("\n5\n1 0", "\n6\n1 0", "line 16: the number of a node is \"$EndNodes\", not a whole number from 0"),
        ("\n5\n1 0", "\n1000000000\n1 0", "line 16: the number of a node is \"$EndNodes\""),
        ("\n5\n1 0", "\n99999999999999999999999\n1 0", "line 10: the number of nodes is \"99999999999999999999999\""),
        ("2 1.0000000000000000e+00", "2 nan", "line 12: x is NaN | coordinates are finite"),
        ("2 1.0000000000000000e+00", "2 1e999", "line 12: x is inf"),
        ("2 1.0000000000000000e+00", "2 1,0", "line 12: x is \"1,0\", not a number"),
        ("2 1.0000000000000000e+00 ", "2 ", "line 12: the line ends where z should stand"),
        ("2 1.0000000000000000e+00 ", "2 7 8 ", "line 12: \"0.0000000000000000e+00\" stands behind the end of a node"),
        ("2 1.0000000000000000e+00", "1 1.0000000000000000e+00", "two nodes of this section have the number 1"),
        ("2 1.0000000000000000e+00", "2 1e300", "line 21: the cell is too large to be measured"),
        ("3 4 2 3 1 1 2 3 4", "3 4 2 3 1 1 2 3 9", "line 21: node 9 is named, but the file has no such node"),
        ("3 4 2 3 1 1 2 3 4", "3 4 2 3 1 1 2 3", "line 21: the line ends where a node of a cell should stand"),
        ("3 4 2 3 1 1 2 3 4", "3 4 2 3 1 1 2 3 3", "line 21: the cell has node 3 at two corners"),
        ("3 4 2 3 1 1 2 3 4", "3 4 2 3 1 1 2 3 4 5", "line 21: \"5\" stands behind the end of a cell"),
        (
            "3 4 2 3 1 1 2 3 4",
            "3 11 2 3 1 1 2 3 4",
            "line 21: a cell is a second-order tetrahedron (10 nodes), Gmsh's type 11 | save the mesh with straight",
        ),
        ("3 4 2 3 1 1 2 3 4", "3 6 2 3 1 1 2 3 4", "line 21: a cell is a prism, Gmsh's type 6 | cells are triangles"),
        ("3 4 2 3 1 1 2 3 4", "3 99 2 3 1 1 2 3 4", "line 21: a cell is a cell unknown here, Gmsh's type 99"),
        (
            "3 4 2 3 1 1 2 3 4",
            "3 4 2 3 1 2 3 4 5",
            "the cells of lines 21, 22 have the same corners | keep one of them",
        ),
        ("$Elements\n4", "$Elements\n5", "line 23: the number of an element is \"$EndElements\""),
        ("$Elements\n4", "$Elements\n3", "line 22: \"4\" stands where $EndElements should"),
        ("$EndElements", "", "the end of the file stands where $EndElements should"),
        ("$EndElements\n", "$EndElements\n$Nodes\n", "line 24: the section is there twice"),
        ("$EndElements\n", "$EndElements\n$Comments\nx", "line 24: the section $Comments has no end"),
        ("$EndElements\n", "$EndElements\nx", "line 24: \"x\" stands where a section should start"),
        ("$Nodes", "$Elements", "line 9: $Elements stands before $Nodes"),
    ];
    assert_refused("tets_22.msh", "body.msh", &cases);
    let only_boundary =
        changed("tets_22.msh", "4\n1 2", "0\n$EndElements\n$Skip\n1 2").replace("4 5\n$EndElements", "4 5\n$EndSkip");
    assert!(refusal("body.msh", &only_boundary).contains("holds no triangles, quadrilaterals"));
    assert!(refusal("body.msh", "").contains("line 1: the end of the file stands where $MeshFormat should"));
}

#[test]
fn gmsh_4_1_is_refused_with_line_and_remedy() {
    let cases = [
        ("1 5 1 5", "1 6 1 5", "line 16: the section says 6 nodes, its blocks hold 5"),
        ("1 5 1 5", "2 5 1 5", "line 17: the dimension of a block is \"$EndNodes\""),
        (
            "3 0 0 5",
            "3 0 0 1000000000",
            "line 12: the number of a node is \"0.0000000000000000e+00\", not a whole number from 0",
        ),
        ("3 0 0 5", "3 0 1 5", "line 12: the line ends where a parameter of a node should stand"),
        ("1 2 1 2", "1 3 1 2", "line 22: the section says 3 cells, its blocks hold 2"),
        ("3 0 4 2", "2 0 4 2", "line 20: cells of dimension 3 in an entity of dimension 2"),
        ("3 0 4 2", "3 0 11 2", "line 20: a cell is a second-order tetrahedron (10 nodes), Gmsh's type 11"),
        ("3 0 4 2", "3 0 4 3", "line 23: the number of a cell is \"$EndElements\""),
        ("2 2 3 4 5", "2 2 3 4 6", "line 22: node 6 is named, but the file has no such node"),
        ("2 2 3 4 5", "2 2 3 4", "line 22: the line ends where a node of a cell should stand"),
    ];
    assert_refused("tets_41.msh", "body.msh", &cases);
}

#[test]
fn binary_files_are_refused_when_cut_or_turned_round() {
    for name in [
        "tets_22_binary.msh",
        "tets_41_binary.msh",
        "gmsh_box_41_binary.msh",
        "hexes_42_binary.vtk",
        "hexes_51_binary.vtk",
    ] {
        let whole = fs::read(fixture(name)).unwrap();
        for end in 0..whole.len() - 20 {
            if let Ok(file) = parse(Path::new(name), &whole[..end]) {
                assert_eq!(file, mesh_of(name), "{name} cut at {end}");
            }
        }
    }
    let mut turned = fs::read(fixture("tets_41_binary.msh")).unwrap();
    let one = turned.windows(4).position(|bytes| bytes == [1, 0, 0, 0]).unwrap();
    turned[one..one + 4].reverse();
    let found = parse(Path::new("body.msh"), &turned).unwrap_err().to_string();
    assert!(found.contains("other order of bytes"), "{found}");
}

#[test]
fn vtk_is_refused_with_line_and_remedy() {
    let new = [
        ("# vtk DataFile", "# VTK DataFile", "line 1: the file does not begin with \"# vtk DataFile Version\""),
        ("ASCII", "TEXT", "line 3: \"TEXT\" stands where ASCII or BINARY should"),
        ("UNSTRUCTURED_GRID", "STRUCTURED_POINTS", "line 4: the data set is \"STRUCTURED_POINTS\""),
        ("POINTS 12 double", "POINTS 12 string", "points of type \"string\" | float or double"),
        ("POINTS 12 double", "POINTS 13 double", "line 7: x is \"CELLS\", not a number"),
        ("POINTS 12 double", "POINTS 11 double", "line 6: \"2.0\" stands where a section should start"),
        ("POINTS 12 double", "POINTS 1000000000 double", "line 7: x is \"CELLS\""),
        ("0.0 0.0 0.0 1.0", "0.0 0.0 -inf 1.0", "line 6: z is -inf"),
        ("CELLS 3 16", "CELLS 3 17", "the last offset is 16, but the cells have 17 points"),
        ("OFFSETS vtktypeint64", "OFFSETS float", "OFFSETS of type \"float\""),
        ("\n0\n8\n16", "\n0\n17\n16", "offset 1 is 17, not in 0..=16"),
        ("\n0\n8\n16", "\n1\n8\n16", "offset 0 is 1, not in 0..=0"),
        ("\n0\n8\n16", "\n0\n7\n16", "has 7 points | it must have 8"),
        ("CONNECTIVITY", "CONNECTED", "stands where CONNECTIVITY should"),
        ("CELL_TYPES 2\n12\n12", "CELL_TYPES 1\n12", "1 types for 2 cells"),
        ("CELL_TYPES 2\n12\n12", "", "the section CELL_TYPES is missing"),
        (
            "CELL_TYPES 2\n12",
            "CELL_TYPES 2\n25",
            "a cell is a second-order hexahedron (20 nodes), VTK's type 25: cell 0",
        ),
        ("CELL_TYPES 2\n12", "CELL_TYPES 2\n13", "a cell is a prism, VTK's type 13"),
        ("CELL_TYPES 2\n12", "CELL_TYPES 2\n-3", "cell of VTK's type -3"),
        ("CELL_TYPES 2\n12", "CELL_TYPES 2\n10", "cell 0 of VTK's type 10 has 8 points | it must have 4"),
        ("CELL_TYPES 2\n12\n12", "CELL_TYPES 2\n1\n1", "holds no triangles, quadrilaterals"),
    ];
    assert_refused("hexes_51.vtk", "body.vtk", &new);
    let old = [
        ("CELLS 3 13", "CELLS 3 12", "the section says 12 numbers, its cells hold 13"),
        ("3\n1\n2\n5", "3\n1\n2\n6", "line 13: cell 1 names point 6, but the file has 6 points"),
        ("3\n1\n2\n5", "3\n1\n2\n-5", "line 16: a cell names point -5"),
        ("3\n1\n2\n5", "3\n1\n2\n2", "line 13: the cell has node 2 at two corners"),
        ("3\n1\n2\n5", "3\n0\n1\n2", "line 13: the cell has no area: 0.000e0"),
        ("2.0 1.0 0.0", "2.0 1.0 0.5", "a surface in space: node 0 has z = 0, node 5 z = 0.5"),
        ("CELL_TYPES 3\n9", "CELL_TYPES 3\n6", "line 8: a cell is a strip of triangles, VTK's type 6: cell 0"),
    ];
    assert_refused("mixed_flat_42.vtk", "body.vtk", &old);
}

#[test]
fn polygons_fields_metadata_pixels_and_voxels_of_vtk() {
    let head = "# vtk DataFile Version 4.2\ntitle\nASCII\nDATASET";
    let polygons = format!(
        "{head} POLYDATA\nFIELD FieldData 1\nTime 1 1 double\n0.5\nPOINTS 5 float\n0 0 3 1 0 3\n1 1 3 0 1 3 2 0 3\nMETADATA\nINFORMATION 0\n\nLINES 1 3\n2 0 1\nPOLYGONS 2 9\n4 0 1 2 3 3 1 2 4\nPOINT_DATA 5\nwhatever"
    );
    let file = parse(Path::new("p.vtk"), polygons.as_bytes()).unwrap();
    assert_eq!((file.mesh.cells(), measure(&file.mesh)), (2, 1.5));
    assert_eq!(file.warnings[0], "the mesh lies in the plane z = 3 and was moved to z = 0");
    assert_eq!(file.warnings[1], "1 of 2 cells were numbered the wrong way round and were turned");
    let five = polygons.replace("9\n4 0 1 2 3 3 1 2 4", "6\n5 0 1 2 3 4").replace("POLYGONS 2", "POLYGONS 1");
    assert!(refusal("p.vtk", &five).contains("a cell is a polygon with neither 3 nor 4 corners, VTK's type 7"));
    let strips = polygons.replace("POLYGONS", "TRIANGLE_STRIPS");
    assert!(refusal("p.vtk", &strips).contains("strip of triangles"));
    let strange = polygons.replace("Time 1 1 double", "Time 1 1 string");
    assert!(refusal("p.vtk", &strange).contains("an array of type \"string\" before the cells"));
    let box_points = "0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1";
    let voxel = format!(
        "{head} UNSTRUCTURED_GRID\nPOINTS 8 float\n{box_points}\nCELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n11\n"
    );
    assert_eq!(measure(&parse(Path::new("v.vtk"), voxel.as_bytes()).unwrap().mesh), 1.0);
    let pixel =
        format!("{head} UNSTRUCTURED_GRID\nPOINTS 8 float\n{box_points}\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n8\n");
    assert_eq!(measure(&parse(Path::new("v.vtk"), pixel.as_bytes()).unwrap().mesh), 1.0);
    assert!(
        refusal("v.vtk", &voxel.replace("POINTS", "NOTHING"))
            .contains("\"NOTHING\" stands where a section should start")
    );
    let twice = voxel.replace("CELL_TYPES", "CELLS 0 0\nCELL_TYPES");
    assert!(refusal("v.vtk", &twice).contains("the cells are there twice"));
    assert!(refusal("v.vtk", &voxel[..voxel.find("CELLS").unwrap()]).contains("the file holds no cells"));
}

const TRIANGLE_NODES: &str = "4 2 1 1\n1 0 0 9 5\n2 1 0 9 0\n3 1 1 9 -2\n4 0 1 9 5 # last\n";
const TRIANGLE_CELLS: &str = "# remark\n2 3 1\n1 1 2 3 0.5\n2 1 4 3 0.5\n";

fn tetgen(nodes: &str, cells: &str) -> Result<MeshFile, String> {
    let parsed = parse_tetgen(Path::new("b.node"), nodes.as_bytes(), Path::new("b.ele"), cells.as_bytes());
    parsed.map_err(|error| format!("{error} | {}", error.help().expect("a remedy")))
}

#[test]
fn triangles_of_triangle_with_markers() {
    let file = tetgen(TRIANGLE_NODES, TRIANGLE_CELLS).unwrap();
    assert_eq!((file.mesh.dimension(), measure(&file.mesh)), (2, 1.0));
    assert_eq!(file.sets, [("marker -2".to_owned(), vec![2]), ("marker 5".to_owned(), vec![0, 3])]);
    assert_eq!(file.warnings, ["1 of 2 cells were numbered the wrong way round and were turned"]);
}

#[test]
fn tetgen_is_refused_with_file_line_and_remedy() {
    let nodes = [
        ("4 2 1 1", "4 4 1 1", "b.node: line 1: the dimension is 4 | 2 (Triangle) or 3 (TetGen)"),
        ("4 2 1 1", "5 2 1 1", "b.node: line 6: the file ends where the number of a node should stand"),
        ("4 2 1 1", "3 2 1 1", "b.node: line 5: more follows behind the last of 3 nodes"),
        ("4 2 1 1", "4 2 1 0", "b.node: line 2: \"5\" stands behind the end of a node"),
        ("2 1 0 9 0", "2 1 0 9", "b.node: line 3: the line ends where the marker of a node should stand"),
        ("2 1 0 9 0", "2 NaN 0 9 0", "b.node: line 3: x is NaN"),
        ("2 1 0 9 0", "1 1 0 9 0", "two nodes of this section have the number 1"),
    ];
    for (from, to, expected) in nodes {
        let found = tetgen(&TRIANGLE_NODES.replacen(from, to, 1), TRIANGLE_CELLS).unwrap_err();
        assert!(found.contains(expected), "{from:?} -> {to:?}: {found}");
    }
    let cells = [
        ("2 3 1", "2 6 1", "b.ele: line 2: a cell is a second-order triangle (6 nodes)"),
        ("2 3 1", "2 4 1", "b.ele: line 2: a cell is a cell with 4 nodes in 2 dimensions"),
        ("2 3 1", "3 3 1", "b.ele: line 5: the file ends where the number of a cell should stand"),
        ("2 3 1", "1 3 1", "b.ele: line 4: more follows behind the last of 1 cells"),
        ("1 1 2 3 0.5", "1 1 2 7 0.5", "b.ele: line 3: node 7 is named, but the file has no such node"),
        ("1 1 2 3 0.5", "1 0 2 3 0.5", "b.ele: line 3: node 0 is named, but the file has no such node"),
    ];
    for (from, to, expected) in cells {
        let found = tetgen(TRIANGLE_NODES, &TRIANGLE_CELLS.replacen(from, to, 1)).unwrap_err();
        assert!(found.contains(expected), "{from:?} -> {to:?}: {found}");
    }
    let folder = tempfile::tempdir().unwrap();
    let alone = folder.path().join("alone.node");
    fs::write(&alone, TRIANGLE_NODES).unwrap();
    assert!(read(&alone).unwrap_err().to_string().contains("alone.ele"));
}

#[test]
fn faces_of_three_cells_and_folds() {
    let nodes = "6 3\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 0 0 -1\n5 1 1 1\n";
    let crowded = tetgen(nodes, "3 4\n0 0 1 2 3\n1 0 1 2 4\n2 0 1 2 5\n").unwrap_err();
    assert!(
        crowded
            .contains("the face of the nodes 0, 1, 2 is shared by 3 cells: of lines 2, 3, 4 | a face joins two cells"),
        "{crowded}"
    );
    let folded = tetgen(nodes, "2 4\n0 0 1 2 3\n1 0 1 2 5\n").unwrap().warnings.join("\n");
    assert!(folded.contains("1 faces have both their cells on one side"), "{folded}");
    let dart = "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0 0 0 1 0 0 .2 .2 0 0 1 0\nPOLYGONS 1 5\n4 0 1 2 3\n";
    let warnings = parse(Path::new("dart.vtk"), dart.as_bytes()).unwrap().warnings.join("\n");
    assert!(warnings.contains("1 quadrilaterals are folded at a corner, cell 0"), "{warnings}");
}

#[test]
fn files_that_are_no_mesh_files() {
    let unknown = read(Path::new("body.stl")).unwrap_err();
    assert_eq!(unknown.to_string(), "body.stl: \".stl\" is no mesh file that can be read");
    assert_eq!(unknown.help().unwrap(), "one of .msh, .vtk, .node, .ele");
    assert!(read(Path::new("/no/such/body.msh")).is_err());
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("folder.msh");
    fs::create_dir(&directory).unwrap();
    assert!(read(&directory).unwrap_err().to_string().contains("not a regular file"));
}
