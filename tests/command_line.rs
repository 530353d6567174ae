//! The commands as a user calls them: what goes where, and the exit status.

use std::io::Read;
use std::process::{Command as Process, Stdio};

use assert_cmd::Command;
use serde_json::Value;

const SQUARE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenes/square.toml");

/// Status, stdout and stderr of a call.
fn call(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("springfit").unwrap().args(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn list_shows_every_table() {
    let (status, text, _) = call(&["list"]);
    assert_eq!(status, 0);
    let (_, json, _) = call(&["list", "--json"]);
    let tables: Value = serde_json::from_str(&json).unwrap();
    let tables = tables.as_object().unwrap();
    assert_eq!(tables.len(), 13);
    for (name, table) in tables {
        assert!(text.contains(name));
        let (status, one, _) = call(&["list", name]);
        assert_eq!(status, 0);
        for (choice, doc) in table["names"].as_object().unwrap() {
            assert!(one.contains(choice) && one.contains(doc.as_str().unwrap()));
        }
    }
    let (status, _, message) = call(&["list", "shape"]);
    assert_eq!(status, 2);
    assert!(message.contains("the tables are shapes, methods"), "{message}");
}

#[test]
fn every_new_scene_passes_the_check() {
    let (_, json, _) = call(&["list", "shapes", "--json"]);
    let tables: Value = serde_json::from_str(&json).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for shape in tables["shapes"]["names"].as_object().unwrap().keys() {
        let (status, text, _) = call(&["new", shape]);
        assert_eq!(status, 0);
        let path = folder.path().join(format!("{shape}.toml"));
        std::fs::write(&path, text).unwrap();
        let (status, _, message) = call(&["check", path.to_str().unwrap()]);
        assert_eq!(status, 0, "{shape}: {message}");
    }
    assert_eq!(call(&["new", "cuboid"]).0, 2);
}

#[test]
fn the_schema_knows_every_table_of_a_scene() {
    let (status, text, _) = call(&["schema"]);
    assert_eq!(status, 0);
    let schema: Value = serde_json::from_str(&text).unwrap();
    let keys = schema["properties"].as_object().unwrap().keys().map(String::as_str).collect::<Vec<_>>();
    let expected = [
        "budget",
        "calibration",
        "converged",
        "dynamics",
        "geometry",
        "limits",
        "load",
        "material",
        "name",
        "reference",
        "solver",
        "springs",
        "support",
    ];
    assert_eq!(keys, expected);
}

#[test]
fn set_changes_the_scene_and_its_errors_show_the_line() {
    let (status, text, _) = call(&["check", SQUARE, "--json", "--set", "springs.grouping=kind", "--set", "name=x"]);
    assert_eq!(status, 0);
    let plan: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(plan["scene"]["springs"]["grouping"], "kind");
    assert_eq!(plan["scene"]["name"], "x");
    let (status, _, message) = call(&["check", SQUARE, "--set", "load[0].force_per_node=[1.0, 2.0, 3.0]"]);
    assert_eq!(status, 2);
    assert!(message.contains("force_per_node = [1.0, 2.0, 3.0]"), "{message}");
    let (status, _, message) = call(&["check", SQUARE, "--set", "springs"]);
    assert_eq!(status, 2);
    assert!(message.contains("there is no \"=\""), "{message}");
}

#[test]
fn the_seed_on_the_command_line_wins() {
    let (status, text, _) = call(&["run", SQUARE, "--json", "--seed", "7", "--threads", "1", "--quiet"]);
    assert_eq!(status, 0);
    let result: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&result["seed"], &result["threads"]), (&7.into(), &1.into()));
}

#[test]
fn warnings_go_to_stderr_unless_quiet() {
    let sets = ["--set", "calibration.gamma=0.3", "--set", "springs.grouping=kind"];
    let (_, _, message) = call(&[&["run", SQUARE], &sets[..]].concat());
    assert!(message.starts_with("warning: calibration.gamma has no effect"), "{message}");
    let (_, _, message) = call(&[&["run", SQUARE, "--quiet"], &sets[..]].concat());
    assert_eq!(message, "");
}

#[test]
fn a_wrong_call_exits_with_2() {
    for arguments in [&[][..], &["fly"], &["run"], &["run", SQUARE, "--threads", "0"], &["reproduce", "1.1"]] {
        let (status, text, message) = call(arguments);
        assert_eq!((status, text.as_str()), (2, ""), "{arguments:?}");
        assert!(!message.is_empty());
    }
    assert_eq!(call(&["--help"]).0, 0);
    assert_eq!(call(&["--version"]).0, 0);
}

#[test]
fn a_closed_pipe_is_no_error() {
    let binary = assert_cmd::cargo::cargo_bin!("springfit");
    let mut child = Process::new(binary).arg("schema").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let mut message = String::new();
    child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    assert_eq!((child.wait().unwrap().code(), message.as_str()), (Some(0), ""));
}

#[test]
fn an_output_folder_that_cannot_be_made_exits_with_2() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let (status, _, message) = call(&["run", SQUARE, "--quiet", "--out", file.path().to_str().unwrap()]);
    assert_eq!(status, 2, "{message}");
    assert!(message.contains(file.path().to_str().unwrap()), "{message}");
}

#[test]
fn a_budget_takes_the_cheapest_network_and_one_that_cannot_be_met_exits_with_4() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenes/budget.toml");
    // seconds, so that a loaded machine chooses the same networks
    let run = |sets: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let fixed = ["run", scene, "--out", folder.path().to_str().unwrap(), "--set", "budget.step_time=60.0"];
        let (status, _, message) = call(&fixed.into_iter().chain(sets).collect::<Vec<_>>());
        let text = std::fs::read_to_string(folder.path().join("result.json")).unwrap();
        assert!(folder.path().join("front.svg").exists() && folder.path().join("springs.json").exists());
        (status, message, serde_json::from_str::<Value>(&text).unwrap())
    };
    let (status, message, result) = run(&[]);
    assert_eq!(status, 0, "{message}");
    let budget = &result["budget"];
    let points = budget["points"].as_array().unwrap();
    let taken = &points[budget["chosen"].as_u64().unwrap() as usize];
    let error = |point: &Value| point["error"].as_f64().unwrap();
    assert!(budget["met"] == true && error(taken) <= 3.0, "{budget}");
    // no coarser network was good enough, and the result is that of the one that was taken
    assert!(points.iter().all(|point| point["control_points"] == taken["control_points"] || error(point) > 3.0));
    assert_eq!(result["scene"]["geometry"]["control_points"], taken["control_points"]);
    assert_eq!(result["sizes"]["springs"], taken["springs"]);
    let held_out = result["calibration"]["held_out"].as_array().unwrap();
    let mean = held_out.iter().map(|case| case["e_rms"].as_f64().unwrap().powi(2)).sum::<f64>() / held_out.len() as f64;
    assert!((mean.sqrt() - error(taken)).abs() < 1e-12 * mean.sqrt(), "{mean} {taken}");

    let (status, message, result) = run(&["budget.max_error=0.01", "budget.finest=[6, 6, 6]"]);
    assert_eq!(status, 4, "{message}");
    assert!(
        message.contains("the budget cannot be met: the best of") && message.contains("(allowed 0.01 %)"),
        "{message}"
    );
    assert_eq!(result["budget"]["met"], false);
    let points = result["budget"]["points"].as_array().unwrap();
    let best = points.iter().map(error).fold(f64::INFINITY, f64::min);
    assert_eq!(error(&points[result["budget"]["chosen"].as_u64().unwrap() as usize]), best);
}

#[test]
fn bench_measures_with_the_error_beside_the_time() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let (status, json, message) = call(&[
        "bench",
        "solve",
        "--sizes",
        "4,5",
        "--repeat",
        "2",
        "--threads",
        "1",
        "--json",
        "--out",
        out,
        "--write",
        out,
    ]);
    assert_eq!(status, 0, "{message}");
    let document: Value = serde_json::from_str(&json).unwrap();
    let rows = document["rows"].as_array().unwrap();
    assert_eq!(rows.iter().filter(|row| row["method"] == "direct").count(), 2);
    for row in rows {
        assert!(row["residual"].as_f64().unwrap() < 1e-9 && row["evaluation"]["median"].as_f64().unwrap() > 0.0);
    }
    for name in ["bench-solve.json", "bench-solve.svg", "cube_4.mtx", "cube_4_rhs.mtx", "cube_4_order.txt"] {
        assert!(folder.path().join(name).exists(), "{name}");
    }

    let (status, text, message) =
        call(&["bench", "calibrate", SQUARE, "--set", "calibration.annealing.evaluations=40", "--out", out]);
    assert_eq!(status, 0, "{message}");
    for variant in ["annealing, one chain", "annealing, many chains", "gauss_newton", "hybrid", "surrogate"] {
        assert!(text.contains(variant), "{text}");
    }
    assert!(folder.path().join("bench-calibrate.svg").exists());
    // the chains of the scene are those of every variant that does not say another number
    let short = ["--set", "calibration.annealing.evaluations=40", "--set", "calibration.gamma=0.1"];
    let (_, json, _) = call(&[["bench", "calibrate", SQUARE, "--json"].as_slice(), &short].concat());
    let rows: Value = serde_json::from_str(&json).unwrap();
    for optimiser in ["hybrid", "surrogate"] {
        let choice = format!("calibration.optimiser=\"{optimiser}\"");
        let run = ["run", SQUARE, "--out", out, "--set", &choice];
        assert_eq!(call(&[run.as_slice(), &short].concat()).0, 0);
        let result = std::fs::read_to_string(folder.path().join("result.json")).unwrap();
        let counts = serde_json::from_str::<Value>(&result).unwrap()["calibration"]["counts"].clone();
        let mut rows = rows["rows"].as_array().unwrap().iter();
        let row = rows.find(|row| row["variant"].as_str().unwrap().ends_with(optimiser)).unwrap();
        assert_eq!((&row["evaluations"], &row["solves"]), (&counts["evaluations"], &counts["solves"]), "{optimiser}");
    }

    let (status, json, message) =
        call(&["bench", "growth", "--sizes", "4,5", "--direct-up-to", "4", "--threads", "1", "--json", "--out", out]);
    assert_eq!(status, 0, "{message}");
    let document: Value = serde_json::from_str(&json).unwrap();
    let rows = document["rows"].as_array().unwrap();
    let paths: Vec<_> = rows.iter().map(|row| (row["size"].as_u64().unwrap(), row["path"].as_str().unwrap())).collect();
    assert_eq!(paths, [(4, "auto"), (4, "direct"), (5, "auto")]);
    for row in rows {
        assert!(row["seconds"].as_f64().unwrap() > 0.0 && row["e_rms"].as_f64().unwrap() > 0.0, "{row}");
        let checked = row["exact_difference"].as_f64();
        assert!(row["path"] == "direct" || checked.unwrap() < 1e-8, "{row}");
    }
    assert!(folder.path().join("bench-growth.svg").exists());

    let (status, text, message) = call(&["bench", "tradeoff", SQUARE, "--finest", "5,5", "--out", out]);
    assert_eq!(status, 0, "{message}");
    assert!(text.contains("5 x 5") && text.contains("Pareto front"), "{text}");
    assert!(folder.path().join("bench-tradeoff.svg").exists());

    let (status, json, message) = call(&["bench", "corotational", "--sizes", "5,10", "--json", "--out", out]);
    assert_eq!(status, 0, "{message}");
    let document: Value = serde_json::from_str(&json).unwrap();
    let domains = |row: &Value| (row["method"].as_str().unwrap().to_owned(), row["cost"]["domains"].as_u64().unwrap());
    let rows: Vec<_> = document["rows"].as_array().unwrap().iter().map(domains).collect();
    assert_eq!(rows.len(), 10);
    // 6 tetrahedra a cell; faces = 2 tetrahedra + half of the boundary's
    assert_eq!(rows[0], ("t4".to_owned(), 30));
    assert_eq!(rows[1], ("smoothed_face".to_owned(), 2 * 30 + (4 * 5 * 2 + 2 * 2) / 2));
    assert_eq!(rows[5], ("t4".to_owned(), 240));
    assert!(folder.path().join("bench-corotational.svg").exists());
    let (status, _, message) = call(&["bench", "corotational", "--sizes", "12"]);
    assert!(status == 2 && message.contains("--sizes: 12 is out of range"), "{message}");

    for (arguments, expected) in [
        (["--sizes", "2"], "from 3 to 129"),
        (["--methods", "magic"], "the methods are direct"),
        (["--repeat", "0"], "1..="),
    ] {
        let (status, _, message) = call(&[&["bench", "solve"], &arguments[..]].concat());
        assert_eq!(status, 2);
        assert!(message.contains(expected), "{message}");
    }
}
