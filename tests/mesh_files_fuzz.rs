//! Mesh readers on damaged files: no panic, no cell that cannot be computed on, memory of at most 64 MB and ten times the file.
//!
//! Valid files are changed at random: bytes, numbers and words are replaced, pieces are cut out, doubled and moved. Seed and number of cases
//! are fixed; `SPRINGFIT_FUZZ_CASES=1000000 cargo test --release --test mesh_files_fuzz -- --nocapture` runs more and prints how many were read,
//! the greatest memory and the longest time.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use proptest::collection::vec;
use proptest::prelude::any;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use springfit::error::Result;
use springfit::geometry::mesh_files::{MeshFile, parse, parse_tetgen};

const SEED: u64 = 20_241;
const CASES: u32 = 3_000;

/// The system's allocator, which counts the bytes that the thread holds.
struct Counting;

thread_local! {
    /// Bytes held now, and the most since the count began.
    static HELD: Cell<(usize, usize)> = const { Cell::new((0, 0)) };
}

fn count(change: impl Fn(usize) -> usize) {
    HELD.with(|held| {
        let now = change(held.get().0);
        held.set((now, held.get().1.max(now)));
    });
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(|held| held + layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(|held| held.saturating_sub(layout.size()));
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What a reader returned, and the most memory it held.
fn measured(read: impl Fn() -> Result<MeshFile>) -> (Result<MeshFile>, usize) {
    HELD.with(|held| held.set((0, 0)));
    let result = read();
    (result, HELD.with(|held| held.get().1))
}

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

type Change = (u8, u32, u32, u32);

/// The start and the end of word `which`.
fn word(bytes: &[u8], which: u32) -> (usize, usize) {
    let start = which as usize % (bytes.len() + 1);
    let start = (start..bytes.len()).find(|&at| !bytes[at].is_ascii_whitespace()).unwrap_or(bytes.len());
    let begin = (0..start).rev().find(|&at| bytes[at].is_ascii_whitespace()).map_or(0, |at| at + 1);
    let end = (start..bytes.len()).find(|&at| bytes[at].is_ascii_whitespace()).unwrap_or(bytes.len());
    (begin, end)
}

fn damage(bytes: &mut Vec<u8>, (kind, a, b, c): Change) {
    let place = |x: u32| x as usize % (bytes.len() + 1);
    let text = WORDS[c as usize % WORDS.len()].as_bytes();
    match kind % 9 {
        0 if !bytes.is_empty() => {
            let at = a as usize % bytes.len();
            bytes[at] = c as u8;
        }
        1 => bytes.truncate(place(a)),
        2 => {
            let (start, end) = (place(a), place(a) + (b as usize % 40));
            bytes.drain(start..end.min(bytes.len()));
        }
        3 => {
            let (start, end) = (place(a), (place(a) + b as usize % 200).min(bytes.len()));
            let piece = bytes[start..end].to_vec();
            let at = place(c);
            bytes.splice(at..at, piece);
        }
        4 | 5 => {
            let (start, end) = word(bytes, a);
            bytes.splice(start..end, text.iter().copied());
        }
        6 => {
            let (from, to) = (word(bytes, a), word(bytes, b));
            let other = bytes[from.0..from.1].to_vec();
            bytes.splice(to.0..to.1, other);
        }
        7 => {
            let at = place(a);
            bytes.splice(at..at, text.iter().copied());
        }
        _ => {
            let at = place(a);
            let extreme = [0, 1, u64::MAX, 1 << 31, 1 << 62, u64::from(c), 1_000_000_000, 0x7FF0_0000_0000_0000];
            let width = if c % 2 == 0 { 4 } else { 8 };
            let value = extreme[b as usize % extreme.len()].to_le_bytes();
            let end = (at + width).min(bytes.len());
            bytes[at..end].copy_from_slice(&value[..end - at]);
        }
    }
}

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

/// Damages the files, `parts` of them making one mesh, and reads them.
fn fuzz(what: &str, corpus: &[Vec<Vec<u8>>], read: impl Fn(&[Vec<u8>]) -> Result<MeshFile>) {
    let cases = std::env::var("SPRINGFIT_FUZZ_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(CASES);
    let config = Config { cases, rng_seed: RngSeed::Fixed(SEED), failure_persistence: None, ..Config::default() };
    let change = (any::<u8>(), any::<u32>(), any::<u32>(), any::<u32>());
    let figures = Cell::new((0_u32, 0_usize, Duration::ZERO));
    TestRunner::new(config)
        .run(&(0..corpus.len(), vec(change, 1..4)), |(which, changes)| {
            let mut files = corpus[which].clone();
            for change in changes {
                let parts = files.len() as u32;
                damage(&mut files[(change.1 % parts) as usize], (change.0, change.1 / parts, change.2, change.3));
            }
            let start = Instant::now();
            let (result, memory) = measured(|| read(&files));
            let time = start.elapsed();
            let bound = (64 << 20) + 10 * files.iter().map(Vec::len).sum::<usize>();
            assert!(memory <= bound, "{memory} bytes");
            let (good, most, longest) = figures.get();
            figures.set((good + u32::from(result.is_ok()), most.max(memory), longest.max(time)));
            match result {
                Ok(file) => assert_sound(&file),
                Err(error) => assert!(error.help().is_some() && error.exit_status() == 2, "{error}"),
            }
            Ok(())
        })
        .unwrap();
    let (good, most, longest) = figures.get();
    println!("{what}: {cases} cases of seed {SEED}, {good} read, at most {most} bytes, at most {longest:?}");
    assert!(good > 0, "some damage is harmless");
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
    fuzz("gmsh", &fixtures("msh"), |files| parse(Path::new("body.msh"), &files[0]));
}

#[test]
fn vtk_files_damaged_at_random() {
    fuzz("vtk", &fixtures("vtk"), |files| parse(Path::new("body.vtk"), &files[0]));
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
    fuzz("tetgen", &corpus, |files| parse_tetgen(Path::new("b.node"), &files[0], Path::new("b.ele"), &files[1]));
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
