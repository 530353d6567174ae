//! Malformed files: scenes, patches and meshes, cut off and flipped at every byte.

use std::path::Path;

use springfit::error::Error;
use springfit::geometry::file::parse_patch;
use springfit::geometry::mesh_files;

use super::common::{SQUARE, parse};

const PATCH: &str = "{\n  \"degree\": [1, 1],\n  \"knots\": [[0, 0, 1, 1], [0, 0, 1, 1]],\n  \
                     \"points\": [[0, 0], [0, 1], [1, 0], [1, 1]],\n  \"weights\": [1, 1, 1, 1]\n}\n";

/// Reads a scene: it is one, or the error says where.
fn scene(text: &str) {
    if let Err(located) = parse(text) {
        assert_eq!(located.exit_status(), 2, "{located}");
        assert!(!located.to_string().is_empty());
    }
}

/// Reads a patch: it is one, or the error names the file.
fn patch(text: &str) -> Result<(), Error> {
    let outcome = parse_patch(text, Path::new("hard.json")).map(|_| ());
    if let Err(error) = &outcome {
        assert_eq!(error.exit_status(), 2, "{error}");
        assert!(error.to_string().contains("hard.json"), "{error}");
    }
    outcome
}

#[test]
fn malformed_files() {
    assert!(patch(PATCH).is_ok());
    for end in 0..PATCH.len() {
        let cut = patch(&PATCH[..end]);
        assert!(cut.is_err() || PATCH[end..].trim().is_empty(), "{}", &PATCH[..end]);
    }
    (0..SQUARE.len()).for_each(|end| scene(&SQUARE[..end]));
    for (at, bit) in (0..SQUARE.len().max(PATCH.len())).flat_map(|at| (0..7).map(move |bit| (at, bit))) {
        let flipped = |text: &str| {
            let mut bytes = text.as_bytes().to_vec();
            if at < bytes.len() {
                bytes[at] ^= 1 << bit;
            }
            String::from_utf8(bytes).ok()
        };
        flipped(SQUARE).iter().for_each(|text| scene(text));
        flipped(PATCH).iter().for_each(|text| drop(patch(text)));
    }
    // deep nesting, long counts, numbers beyond f64, signed zero, keys twice, marks and line ends of other systems
    for bad in [
        format!("{}{}", "[".repeat(100_000), "]".repeat(100_000)),
        PATCH.replace("[1, 1],", "[1000000000, 1],"),
        PATCH.replace("[1, 1],", "[18446744073709551615, 1],"),
        PATCH.replace("[[0, 0]", "[[1e400, 0]"),
        PATCH.replace("\"degree\"", "\"knots\": [], \"degree\""),
        PATCH.replace("[[0, 0], [0, 1]", "[[0, 0, 0], [0, 1]"),
        format!("{PATCH}{PATCH}"),
    ] {
        assert!(patch(&bad).is_err(), "{}", &bad[..bad.len().min(200)]);
    }
    assert!(patch(&PATCH.replace('\n', "\r\n")).is_ok());
    assert!(patch(&PATCH.replace("[[0, 0], [0, 1]", "[[-0.0, 0], [0, 1]")).is_ok());
    scene(&format!("\u{feff}{SQUARE}"));
    assert!(parse(&SQUARE.replace('\n', "\r\n")).is_ok());
    scene(&format!("deep = {}{}\n{SQUARE}", "[".repeat(50_000), "]".repeat(50_000)));
    let twice = parse(&format!("{SQUARE}gamma = 0.2\n"));
    assert!(twice.expect_err("a key twice").to_string().contains("given twice"));
    // counts that no file can hold cost nothing: the reader stops where the file does
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [
        ("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1000000000\n1 0 0 0\n$EndNodes\n"),
        ("b.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1000000000 double\n0 0 0\n"),
        ("c.ele", "1000000000 4 0\n1 1 2 3 4\n"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("a file");
        std::fs::write(folder.path().join("c.node"), "1000000000 3 0 0\n1 0 0 0\n").expect("a file");
        let error = mesh_files::read(&path).expect_err("no mesh");
        assert_eq!(error.exit_status(), 2, "{error}");
        assert!(error.to_string().contains(&name[..2]), "{error}");
    }
    // a file of forces with a claim that is not kept
    let loads = folder.path().join("loads.json");
    std::fs::write(&loads, "{\"bodies\": 1e400}").expect("a file");
    let wanted = format!("file = {loads:?}");
    let text = SQUARE.replace("force_per_node = [2.0, -1.0]", &wanted);
    let error = super::common::refused(&text);
    assert!(error.exit_status() == 2 && error.to_string().contains("loads.json"), "{error}");
}
