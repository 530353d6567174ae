//! The architecture, enforced: a file imports from its own room and from lower floors only (README, "The house").

use std::fs;
use std::path::{Path, PathBuf};

/// Rooms and single files by floor.
const FLOORS: &[(&str, u32)] = &[
    ("sparse", 0),
    ("dense", 0),
    ("rng", 0),
    ("memory", 0),
    ("readable", 0),
    ("clock", 0),
    ("error", 0),
    ("lanes", 0),
    ("geometry", 1),
    ("reference", 2),
    ("springs", 2),
    ("calibration", 3),
    ("dynamics", 3),
    ("scene", 4),
    ("export", 4),
    ("study", 5),
    ("report", 6),
    ("cli", 7),
    ("main", 7),
];

fn floor(room: &str) -> u32 {
    FLOORS.iter().find(|(name, _)| *name == room).unwrap_or_else(|| panic!("room {room} has no floor")).1
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("src is readable") {
        let path = entry.expect("src is readable").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The rooms that a line names behind `crate::` or `springfit::`.
fn rooms_named(line: &str) -> Vec<&str> {
    let mut rooms = Vec::new();
    for prefix in ["crate::", "springfit::"] {
        for (start, _) in line.match_indices(prefix) {
            let rest = &line[start + prefix.len()..];
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            rooms.push(&rest[..end]);
        }
    }
    rooms
}

#[test]
fn files_import_from_their_own_room_and_from_lower_floors_only() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    assert!(files.len() > 20, "the sources were found");
    let mut wrong = Vec::new();
    for path in files {
        let inside = path.strip_prefix(&src).expect("a source is in src");
        let first = inside.iter().next().and_then(|part| part.to_str()).expect("a source has a name");
        let room = first.trim_end_matches(".rs");
        if room == "lib" {
            continue;
        }
        let text = fs::read_to_string(&path).expect("sources are text");
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//")) {
            for other in rooms_named(line) {
                // floor 0 has single files beside its room; they serve each other
                let allowed = other == room
                    || floor(other) < floor(room)
                    || (floor(other) == 0 && floor(room) == 0)
                    || (room == "main" && other == "cli");
                if !allowed {
                    wrong.push(format!("{}:{}: {room} imports {other}", inside.display(), number + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
