//! The scene reader: text to checked settings, and how its errors are shown.

use std::fs;
use std::path::{Path, PathBuf};

use miette::{GraphicalReportHandler, GraphicalTheme};
use springfit::scene::{self, Located, Scene, Source};

use super::{Verdict, cases, cut_and_flipped, fuzz, fuzz_cases, within_bounds};

/// Keys, names and values of scenes, and what is none.
pub const WORDS: &[&str] = &[
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "-0.0",
    "1000000000",
    "9223372036854775807",
    "9223372036854775808",
    "1e400",
    "1e308",
    "1e-320",
    "-1e400",
    "nan",
    "inf",
    "true",
    "\"\"",
    "\"x\"",
    "[]",
    "{}",
    "[1, 2]",
    "[1.0, 2.0, 3.0]",
    "=",
    ".",
    ",",
    "#",
    "\"",
    "'''",
    "\"\"\"",
    "\\u0000",
    "[[[[[[[[[[[[[[[[",
    "{a={a={a={",
    "a.a.a.a.a.a.a.a = 1",
    "\u{feff}",
    "\r\n",
    "\0",
    "é",
    "1979-05-27T07:32:00Z",
    "0x1F",
    "1_000",
    "[geometry]",
    "[material]",
    "[support]",
    "[[load]]",
    "[load]",
    "[reference]",
    "[springs]",
    "[calibration]",
    "[calibration.gamma]",
    "[solver]",
    "[dynamics]",
    "young = 1",
    "poisson = 0.5",
    "shape = \"torus\"",
    "control_points = [1000000000, 1000000000]",
    "degree = [9, 9]",
    "file = \"/dev/zero\"",
    "file = \"/\"",
    "gamma = { start = 0.9, step = 1e-9 }",
    "optimiser = \"annealing\"",
    "objective = \"matrix\"",
    "grouping = \"each\"",
    "method = \"q4\"",
    "faces = [\"x-\"]",
    "nodes = [0]",
    "integrator = \"newmark\"",
    "steps = 18446744073709551615",
    "duration = 1e300",
    "step = 1e-300",
];

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenes");

/// All scenes of data/scenes, good and bad.
pub fn corpus() -> Vec<(PathBuf, Vec<u8>)> {
    let folders = [FOLDER.into(), Path::new(FOLDER).join("bad")];
    let entries = folders.iter().flat_map(|folder| fs::read_dir(folder).expect("readable"));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|found| found == "toml"));
    paths.sort();
    assert!(paths.len() > 100, "the scenes were found");
    paths.into_iter().map(|path| (path.clone(), fs::read(&path).expect("readable"))).collect()
}

/// A scene as its reader takes it; errors are shown as a user sees them.
pub fn read(bytes: &[u8]) -> Result<Scene, Located> {
    let source = Source { name: "a.toml".into(), text: String::from_utf8_lossy(bytes).into_owned() };
    let read = scene::parse(&source)
        .and_then(|scene| scene::check(&scene).map(|_| scene).map_err(|error| source.locate(error)));
    if let Err(located) = &read {
        show(located);
    }
    read
}

fn show(located: &Located) {
    let mut shown = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    handler.render_report(&mut shown, located).expect("a string has room");
    assert!(shown.len() > 10);
}

fn verdict(read: &Result<Scene, Located>) -> Verdict {
    read.as_ref().map(drop).map_err(|located| located.error.clone())
}

#[test]
fn scenes_damaged_at_random() {
    let corpus: Vec<_> = corpus().into_iter().map(|(_, bytes)| vec![bytes]).collect();
    fuzz("scene", WORDS, &corpus, |files| read(&files[0]), verdict);
}

#[test]
fn scenes_cut_anywhere_and_with_flipped_bits() {
    for name in ["motion.toml", "held_out.toml"] {
        let bytes = fs::read(Path::new(FOLDER).join(name)).expect("readable");
        cut_and_flipped(&bytes, |bytes| verdict(&read(bytes)));
    }
}

#[test]
fn sets_damaged_at_random() {
    let sets = [
        "springs.grouping=kind",
        "load[0].fit=false",
        "load.0.force_per_node=[1.0, 2.0]",
        "calibration.gamma={ start = 0.5, step = 0.1 }",
        "geometry.control_points[1]=5",
        "name=a b",
    ];
    let corpus = sets.map(|set| vec![set.as_bytes().to_vec()]);
    let path = Path::new(FOLDER).join("square.toml");
    let one = |files: &[Vec<u8>]| scene::read(&path, &[String::from_utf8_lossy(&files[0]).into_owned()]);
    fuzz_cases(cases() / 3, "--set", WORDS, &corpus, one, |read| {
        read.as_ref().map(drop).map_err(|located| {
            show(located);
            located.error.clone()
        })
    });
    let deep = [format!("{}=1", "a.".repeat(100_000) + "a"), format!("a={}", "[".repeat(100_000))];
    for set in deep {
        assert_eq!(scene::read(&path, &[set]).expect_err("no key of a scene").exit_status(), 2);
    }
}

/// Odd texts that editors make, and such that only mean harm.
#[test]
fn odd_scenes_are_read_or_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.toml");
    let from_file = |text: &[u8]| {
        fs::write(&path, text).expect("writable");
        scene::read(&path, &[]).map(|input| input.scene)
    };
    let good = fs::read_to_string(Path::new(FOLDER).join("square.toml")).expect("readable");
    let plain = from_file(good.as_bytes()).expect("a good scene");
    for same in [good.replace('\n', "\r\n"), format!("\u{feff}{good}"), good.trim_end().to_owned()] {
        assert_eq!(from_file(same.as_bytes()).expect("the same scene"), plain);
    }
    for (from, to) in [
        ("young = 15e3", "young = 1e400"),
        ("young = 15e3", "young = -0.0"),
        ("young = 15e3", "young = 15e3\nyoung = 15e3"),
        ("[material]", "[material]\n[material]"),
        ("young = 15e3", "young = 99999999999999999999"),
        ("young = 15e3", "young = \"\0\""),
        ("[material]", "\u{feff}[material]"),
    ] {
        assert!(good.contains(from), "{from}");
        assert_eq!(from_file(good.replacen(from, to, 1).as_bytes()).expect_err(to).exit_status(), 2);
    }
    assert!(from_file(b"name = \"\xff\"").expect_err("not UTF-8").to_string().contains("line 1"));
    for deep in ["[", "a=[", "a={a=", "a.", "[a.", "[[a"] {
        let text = vec![deep.repeat(30_000).into_bytes()];
        within_bounds(&text, |files| assert!(read(&files[0]).is_err()));
        let nested = format!("x = {}1{}", deep.repeat(5_000), "]".repeat(5_000));
        within_bounds(&[nested.into_bytes()], |files| assert!(read(&files[0]).is_err()));
    }
    let large = fs::File::create(&path).expect("writable");
    large.set_len(1 << 40).expect("a file may have holes");
    let (result, memory, _) = within_bounds(&[], |_| scene::read(&path, &[]));
    assert!(result.is_err() && memory < 100_000, "{memory} bytes");
}

/// The shortest entries: the largest file that is read, full of them.
#[test]
fn memory_of_dense_scenes_is_bounded() {
    let size = scene::LARGEST_FILE as usize;
    let numbers = |count: usize| (0..count).map(|i| format!("k{i:x}=1\n")).collect::<String>();
    let long = "a".repeat(size / 2);
    let texts = [
        ("numbers", format!("x=[{}]", "1,".repeat(size / 2 - 3))),
        ("tables", "[[load]]\n".repeat(size / 9)),
        ("arrays", format!("x=[{}]", "[],".repeat(size / 3 - 3))),
        ("keys", numbers(size / 10)),
        ("inline tables", format!("x=[{}]", "{a=1},".repeat(size / 6 - 3))),
        ("a long name above many", format!("[{long}]\n{}", numbers(size / 22))),
        ("a long name", format!("[material]\n{long}=1\n")),
        ("a long value", format!("[springs]\ngrouping=\"{long}\"\n")),
        ("a long line", format!("[material]\nyoung=\"{long}\"\n")),
        ("comments", "#\n".repeat(size / 2)),
        ("forces", format!("[[load]]\nforce_per_node=[{}]", "1,".repeat(size / 2 - 40))),
    ];
    for (what, text) in texts {
        assert!(text.len() <= size, "{what}: {}", text.len());
        let size = text.len();
        let (result, memory, seconds) = within_bounds(&[text.into_bytes()], |files| read(&files[0]));
        println!("{what}: {size} bytes, memory {:.1} times the file, {seconds:.3} s", memory as f64 / size as f64);
        assert!(result.is_err());
    }
}
