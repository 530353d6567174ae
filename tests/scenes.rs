//! Every scene in data/scenes is checked, and what is read is a scene or a message (their runs: tests/results.rs).

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenes");

fn scenes() -> Vec<PathBuf> {
    let paths = std::fs::read_dir(FOLDER).unwrap().map(|entry| entry.unwrap().path());
    let mut scenes: Vec<PathBuf> = paths.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    scenes.sort();
    scenes
}

fn stdout(arguments: &[&str], scene: &Path) -> String {
    let output = Command::cargo_bin("springfit")
        .unwrap()
        .args(&arguments[..1])
        .arg(scene)
        .args(&arguments[1..])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {message}", scene.display());
    assert!(message.lines().all(|line| line.starts_with("warning: ")), "{}: {message}", scene.display());
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn every_scene_checks() {
    for scene in scenes() {
        let plan: Value = serde_json::from_str(&stdout(&["check", "--json"], &scene)).unwrap();
        assert!(plan["sizes"]["springs"].as_u64().unwrap() > 0, "{plan}");
        assert!(!stdout(&["check"], &scene).is_empty());
    }
}

#[test]
fn the_scene_in_the_result_is_a_scene() {
    let printed = stdout(&["run", "--json"], &Path::new(FOLDER).join("two_loads.toml"));
    let result: Value = serde_json::from_str(&printed).unwrap();
    let scene: springfit::scene::Scene = serde_json::from_value(result["scene"].clone()).unwrap();
    assert_eq!(scene.geometry.degree, Some(vec![2, 2, 2]));
    let again = springfit::scene::Source { name: "again".into(), text: toml::to_string(&scene).unwrap() };
    assert_eq!(springfit::scene::parse(&again).unwrap(), scene);
}

#[test]
fn a_damaged_scene_gives_an_error_and_no_panic() {
    let text = std::fs::read_to_string(Path::new(FOLDER).join("two_loads.toml")).unwrap();
    let read = |text: String| {
        let source = springfit::scene::Source { name: "damaged".into(), text };
        match springfit::scene::parse(&source) {
            Ok(scene) => springfit::scene::check(&scene).map(|_| ()).map_err(|error| source.locate(error)),
            Err(error) => Err(error),
        }
    };
    for (place, letter) in text.char_indices() {
        let (before, after) = (&text[..place], &text[place + letter.len_utf8()..]);
        let _ = read(before.to_owned());
        for other in ["", "\"", "[", "]", "=", "\n", "-", "9", "é", "\0", "{ a = ", "nan"] {
            if let Err(error) = read(format!("{before}{other}{after}")) {
                assert_eq!(error.exit_status(), 2, "{error}");
                assert!(!format!("{:?}", miette::Report::new(error)).is_empty());
            }
        }
    }
    assert!(read("a = ".to_owned() + &"[".repeat(100_000)).is_err());
}
