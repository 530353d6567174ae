//! Readers of JSON: patches, loads, checkpoints.

use std::path::Path;

use springfit::geometry::file::parse_patch;
use springfit::reference::load_file::{self, Wanted};
use springfit::scene::{self, Scene, Source};
use springfit::study::checkpoint::{Checkpoint, digest};

use super::{Verdict, cut_and_flipped, fuzz, within_bounds};

/// Words of these files, and numbers that are none.
pub const WORDS: &[&str] = &[
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "1000000000",
    "18446744073709551616",
    "1e400",
    "-1e400",
    "1e308",
    "1e-320",
    "0.5",
    "NaN",
    "null",
    "true",
    "",
    ",",
    "[",
    "]",
    "[]",
    "{}",
    "{",
    "}",
    "[[[[[[[[[[[[[[[[",
    "\"",
    "\\",
    "\\u0000",
    "\u{feff}",
    "\r\n",
    "\0",
    "é",
    "\"degree\":",
    "\"knots\":",
    "\"points\":",
    "\"weights\":",
    "\"cases\":",
    "\"bodies\":",
    "\"pieces\":",
    "\"content\":",
];

const PATCH: &str = include_str!("../../data/patches/quarter_ring.json");
const SOLID: &str = r#"{"degree":[1,1,2],"knots":[[0,0,1,1],[0,0,1,1],[0,0,0,1,1,1]],"points":[[0,0,0],[0,0,1],
[0,0,2],[0,1,0],[0,1,1],[0,1,2],[1,0,0],[1,0,1],[1,0,2],[1,1,0],[1,1,1],[1,1,2]]}"#;

const LOADS: [&str; 3] = [
    "[[1,2,3],[3,4,5],[-0,6e-3,7]]",
    r#"{"cases":{"push":[[1,2,3],[3,4,5],[6,7,8]]},"what":{"a":[1,null]}}"#,
    r#"{"what":"é","bodies":{"a":{"control_points":[3],"cases":{"push":[[1,2,3],[3,4,5],[6,7,8]],"pull":[]}}}}"#,
];

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A patch that was read has points, weights and knots that can be computed with.
fn patch(bytes: &[u8]) -> Verdict {
    let patch = parse_patch(&text(bytes), Path::new("body.json"))?;
    assert!(patch.points().iter().flatten().all(|x| x.is_finite()));
    assert!(patch.weights().iter().all(|&weight| weight > 0.0 && weight.is_finite()));
    assert_eq!(patch.points().len(), patch.grid().len());
    Ok(())
}

fn loads(bytes: &[u8]) -> Verdict {
    let wanted = |body, case| Wanted { body, case, dimension: 3, nodes: 3 };
    let read = |wanted| load_file::parse(&text(bytes), Path::new("loads.json"), wanted);
    let forces = read(wanted(None, None)).or_else(|_| read(wanted(Some("a"), Some("push"))))?;
    assert!(forces.len() == 3 && forces.iter().flatten().all(|f| f.is_finite()));
    Ok(())
}

/// A network that the walk of a budget has kept.
const WALKED: &str = r#"{"calibration_seconds":0.5,"control_points":[3,3],"error":2.5,"fitted":1.5,"groups":2,"springs":20,"step_seconds":1e-6}"#;

/// A ladder on its first rung.
const LADDER: &str = r#"{"inputs":"0000000000000007","standing":{"best":{"asked":[1.5],"parts":[{"pieces":[{"conditions":[],"springs":[0,1],"start":"edge"}],"springs":[0,1],"upper":2.5}],"phi":[1.5]},"last":{"asked":[1.5],"parts":[],"phi":[1.5]},"rungs":[],"taken":0}}"#;

/// The smallest scene, and a checkpoint of it with a piece of each kind.
fn checkpoint() -> (Scene, String) {
    let source = Source { name: "a.toml".into(), text: "[material]\nyoung = 1\npoisson = 0\n".into() };
    let scene = scene::parse(&source).expect("a scene");
    let counts = r#"{"cg_iterations":0,"evaluations":3,"fallbacks":0,"refactorisations":3,"rejected":0,"single_refactorisations":0,"solves":3,"stale_solves":0,"surrogate_evaluations":0}"#;
    let outcome = format!(
        r#"{{"counts":{counts},"error":0.125,"phi":[1.5,2.5e-3],"stop":"Converged","trace":[{{"error":0.125,"refactorisations":3,"seconds":0.001}}]}}"#
    );
    let pieces: Vec<String> = ["start", "chain", "descent", "polish", "answer"]
        .iter()
        .map(|stage| format!(r#"[{{"number":0,"problem":0,"stage":"{stage}"}},{outcome}]"#))
        .collect();
    let scene_text = serde_json::to_value(&scene).expect("JSON").to_string();
    let content = format!(
        r#"{{"files":{{}},"ladder":{LADDER},"scene":{scene_text},"seed":1,"sweeps":[{{"inputs":"0000000000000007","pieces":[{}],"problems":1}}],"version":"{}","walked":[[{WALKED}]]}}"#,
        pieces.join(","),
        env!("CARGO_PKG_VERSION")
    );
    (scene, content)
}

/// Reads a checkpoint and enters the sweep that it is of.
fn resume(content: &[u8], scene: &Scene) -> Verdict {
    // damage that the digest does not see
    let content = text(content);
    let value: serde_json::Value = serde_json::from_str(&content).unwrap_or_default();
    let sum = digest(value.to_string().bytes());
    let file = format!("{{\"schema\":\"springfit-checkpoint/2\",\"digest\":\"{sum:016x}\",\"content\":{content}}}");
    let checkpoint = Checkpoint::from_bytes(Path::new("checkpoint.json"), file.as_bytes(), scene)?;
    checkpoint.walked(&[3, 3]);
    checkpoint.ladder(7);
    checkpoint.enter(7, &[(0, 2)])
}

#[test]
fn patches_damaged_at_random() {
    let corpus = [PATCH, SOLID].map(|text| vec![text.as_bytes().to_vec()]);
    fuzz("patch", WORDS, &corpus, |files| patch(&files[0]), Clone::clone);
}

#[test]
fn loads_damaged_at_random() {
    let corpus = LOADS.map(|text| vec![text.as_bytes().to_vec()]);
    fuzz("loads", WORDS, &corpus, |files| loads(&files[0]), Clone::clone);
}

#[test]
fn checkpoints_damaged_at_random() {
    let (scene, content) = checkpoint();
    resume(content.as_bytes(), &scene).expect("a good checkpoint");
    fuzz("checkpoint", WORDS, &[vec![content.into_bytes()]], |files| resume(&files[0], &scene), Clone::clone);
}

#[test]
fn files_cut_anywhere_and_with_flipped_bits() {
    [PATCH, SOLID].iter().for_each(|file| cut_and_flipped(file.as_bytes(), patch));
    LOADS.iter().for_each(|file| cut_and_flipped(file.as_bytes(), loads));
    let (scene, content) = checkpoint();
    cut_and_flipped(content.as_bytes(), |bytes| resume(bytes, &scene));
}

/// What is odd but may come from another program, and what only means harm.
#[test]
fn odd_files_are_read_or_refused() {
    for file in [PATCH, SOLID] {
        assert!(patch(file.replace('\n', "\r\n").as_bytes()).is_ok());
        assert!(patch(file.replacen("[0,", "[-0,", 1).replacen("[0.0,", "[-0.0,", 1).as_bytes()).is_ok());
        for (from, to) in
            [("1", "1e400"), ("{", "\u{feff}{"), ("\"degree\"", "\"degree\":[2,2],\"degree\""), ("[", "[[")]
        {
            assert!(patch(file.replacen(from, to, 1).as_bytes()).is_err(), "{from} -> {to}");
        }
    }
    for file in LOADS {
        assert!(loads(file.replace(',', ",\r\n").as_bytes()).is_ok());
        for (from, to) in [("3,4,5", "3,4,1e400"), ("3,4,5", "3,4"), ("[3,4,5]", "[[3,4,5]]"), ("3,4,5", "3,4,\"5\"")] {
            assert!(loads(file.replacen(from, to, 1).as_bytes()).is_err(), "{from} -> {to}");
        }
    }
    for deep in ["[", "{\"a\":", "[[1],"] {
        let file = vec![deep.repeat(100_000).into_bytes()];
        within_bounds(&file, |files| {
            assert!(patch(&files[0]).is_err() && loads(&files[0]).is_err());
        });
    }
}

/// Degrees and counts of a thousand million cost nothing.
#[test]
fn claims_of_1e9_cost_nothing() {
    for claim in ["[1000000000, 2]", "[18446744073709551615, 2]", "[1, 1000000000]"] {
        let file = PATCH.replacen("[1, 2]", claim, 1);
        let (result, memory, _) = within_bounds(&[file.into_bytes()], |files| patch(&files[0]));
        assert!(result.is_err() && memory < 100_000, "{memory} bytes");
    }
    let wanted = Wanted { body: None, case: None, dimension: 3, nodes: 1_000_000_000 };
    assert!(load_file::parse(LOADS[0], Path::new("loads.json"), wanted).is_err());
}

/// The shortest entries: many numbers in few bytes.
#[test]
fn memory_of_dense_files_is_ten_times_their_size_at_most() {
    let points = "[0,0],".repeat(1_000_000);
    let points = points.trim_end_matches(',');
    let empty = "[],".repeat(2_000_000);
    let numbers = "1,".repeat(3_000_000);
    let patches = [
        format!(r#"{{"degree":[1,1],"knots":[[0,0,1,1],[0,0,1,1]],"points":[{points}]}}"#),
        format!(r#"{{"degree":[1,1],"knots":[[0,0,1,1],[0,0,1,1]],"points":[{}]}}"#, empty.trim_end_matches(',')),
        format!(r#"{{"degree":[1,1],"knots":[{}]}}"#, empty.trim_end_matches(',')),
        format!(r#"{{"degree":[1,1],"knots":[[{}]]}}"#, numbers.trim_end_matches(',')),
        format!(r#"{{"degree":[{}]}}"#, numbers.trim_end_matches(',')),
    ];
    for file in patches {
        let size = file.len();
        let (result, memory, _) = within_bounds(&[file.into_bytes()], |files| patch(&files[0]));
        println!("patch of {size} bytes: memory {:.2} times the file", memory as f64 / size as f64);
        assert!(result.is_err() && memory < 10 * size, "{memory} bytes for {size}");
    }
    for file in [format!("[{points}]"), format!(r#"{{"cases":{{"a":[{points}]}}}}"#)] {
        let size = file.len();
        let (result, memory, _) = within_bounds(&[file.into_bytes()], |files| loads(&files[0]));
        println!("loads of {size} bytes: memory {:.2} times the file", memory as f64 / size as f64);
        assert!(result.is_err() && memory < 10 * size, "{memory} bytes for {size}");
    }
}
