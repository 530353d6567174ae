//! Every scene in data/scenes runs to its end, writes what the interface promises, and agrees with its `check`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

/// No calibration of a scene that is worth having leaves a larger error, percent.
const LARGEST_ERROR: f64 = 25.0;

const RESULT: &[&str] = &[
    "schema",
    "version",
    "seed",
    "threads",
    "scene",
    "sizes",
    "loads",
    "reference",
    "calibration",
    "warnings",
    "seconds",
    "peak_memory_bytes",
    "processor_seconds",
];
const SIZES: &[&str] = &["control_points", "free_dofs", "elements", "springs", "zero_length_springs", "groups"];
const REFERENCE: &[&str] = &[
    "method",
    "compliance",
    "u_max",
    "u_norm2",
    "cases",
    "stiffness_frobenius",
    "measure",
    "backward_error",
    "condition",
    "forward_error",
    "seconds",
];
/// Beyond the list of the interface: `global_strain` (4.17), `fitted` (each fitted load case, like `held_out`).
const CALIBRATION: &[&str] = &[
    "generalisation",
    "objective",
    "optimiser",
    "gamma",
    "e_rms",
    "e_max",
    "stop",
    "groups",
    "held_out",
    "sweep",
    "counts",
    "trace",
    "solver",
    "global_strain",
    "fitted",
];
const GROUP: &[&str] = &["name", "springs", "length", "stiffness", "lower", "upper", "determined"];
const CASE: &[&str] = &["load", "e_rms", "e_max", "global_strain"];
const GENERATED: &[&str] = &["load", "e_rms", "e_max"];
const ANSWER: &[&str] = &["load", "compliance", "u_max", "u_norm2"];
const ROW: &[&str] =
    &["gamma", "groups", "e_rms", "e_max", "evaluations", "refactorisations", "solves", "solver", "seconds", "stop"];
const SOLVER: &[&str] = &[
    "path",
    "reason",
    "tolerance",
    "refactorisations",
    "single_refactorisations",
    "stale_solves",
    "cg_iterations",
    "fallbacks",
];
const COUNTS: &[&str] = &["evaluations", "refactorisations", "solves", "surrogate_evaluations", "rejected"];

/// The scenes of a user; those in data/scenes/bad are for tests/bad_scenes.rs.
fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes");
    let entries = fs::read_dir(folder).expect("data/scenes is there");
    let mut scenes: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    scenes.sort();
    assert!(scenes.len() >= 12, "the scenes were found");
    scenes
}

fn springfit(arguments: &[&str], scene: &Path) -> (String, String) {
    let mut command = Command::cargo_bin("springfit").expect("the binary is built");
    let output = command.args(arguments).arg(scene).arg("--json").assert().success().get_output().clone();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (text(output.stdout), text(output.stderr))
}

/// An object has these keys, all of them, and no other but the optional ones.
fn has_keys(value: &Value, required: &[&str], optional: &[&str]) {
    let object = value.as_object().unwrap_or_else(|| panic!("an object with {required:?}, not {value}"));
    let found: BTreeSet<&str> = object.keys().map(String::as_str).filter(|key| !optional.contains(key)).collect();
    assert_eq!(found, required.iter().copied().collect::<BTreeSet<_>>());
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().unwrap_or_else(|| panic!("{key} is an array"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is a number, not {}", value[key]))
}

/// JSON has no NaN: a number that is not finite would be null. Only what may be absent is null.
fn no_null(value: &Value, key: &str) {
    match value {
        Value::Null => assert!(["gamma", "alpha", "damping"].contains(&key), "{key} is null"),
        Value::Array(items) => items.iter().for_each(|item| no_null(item, key)),
        Value::Object(entries) => entries.iter().for_each(|(key, value)| no_null(value, key)),
        _ => {}
    }
}

fn result_is_as_promised(result: &Value) {
    has_keys(result, RESULT, &["dynamics", "converged", "budget", "mesh"]);
    assert_eq!(result["mesh"].is_object(), result["reference"]["method"] != "iga");
    if let Some(mesh) = result["mesh"].as_object() {
        let ratio = |value: &Value| value.as_f64().is_some_and(|ratio| ratio > 0.0 && ratio <= 1.0 + 1e-12);
        assert!(ratio(&mesh["least_measure_ratio"][0]) && ratio(&mesh["least_domain_ratio"]), "{mesh:?}");
    }
    assert_eq!(result["schema"], "springfit-result/1");
    assert_eq!(result["version"], env!("CARGO_PKG_VERSION"));
    for key in ["dynamics", "converged", "budget"] {
        assert_eq!(result[key].is_object(), result["scene"][key].is_object());
    }
    result["converged"]["cases"].as_array().into_iter().flatten().for_each(errors_add_up);
    has_keys(&result["sizes"], SIZES, &[]);
    has_keys(&result["reference"], REFERENCE, &["path", "iterations", "large"]);
    list(&result["reference"], "cases").iter().for_each(|case| has_keys(case, ANSWER, &[]));
    let calibration = &result["calibration"];
    has_keys(
        calibration,
        CALIBRATION,
        &["objective_error", "compared_frobenius", "outside_pattern", "accuracy", "agreement", "ladder"],
    );
    assert_eq!(calibration["ladder"].is_array(), result["scene"]["springs"]["grouping"] == "adaptive");
    assert_eq!(calibration["accuracy"].is_object(), !result["reference"]["large"].is_object());
    let objective = calibration["objective"].as_str().expect("a name");
    for key in ["compared_frobenius", "outside_pattern"] {
        assert_eq!(calibration[key].is_number(), objective == "matrix");
    }
    assert_eq!(calibration["objective_error"].is_number(), fitted(calibration));
    generalisation_is_told(&calibration["generalisation"], result);
    has_keys(&calibration["global_strain"], &["reference", "springs"], &[]);
    has_keys(&calibration["counts"], COUNTS, &[]);
    has_keys(&calibration["solver"], SOLVER, &["e_rms_difference"]);
    assert_eq!(calibration["solver"]["e_rms_difference"].is_number(), objective == "displacement");
    if objective == "displacement" {
        assert!(number(&calibration["solver"], "e_rms_difference") < 1e-8);
    }
    list(calibration, "groups").iter().for_each(|group| has_keys(group, GROUP, &["log_deviation"]));
    list(calibration, "sweep").iter().for_each(|row| has_keys(row, ROW, &["same_groups_as", "objective_error"]));
    for key in ["fitted", "held_out"] {
        list(calibration, key).iter().for_each(|case| has_keys(case, CASE, &[]));
    }
    no_null(result, "");
}

/// Whether the stiffness was searched.
fn fitted(calibration: &Value) -> bool {
    calibration["objective"] != "formula" && calibration["objective"] != "known"
}

/// Both sides with their loads, and generated cases exactly where the scene holds none out; or a word why not.
fn generalisation_is_told(told: &Value, result: &Value) {
    if told["not_looked_for"].is_string() {
        return;
    }
    has_keys(told, &["fields", "softest", "stiffest", "softest_linear", "near_mechanism", "moving", "held_out"], &[]);
    let held_out = list(&result["calibration"], "held_out");
    assert_eq!(list(told, "held_out").is_empty(), !held_out.is_empty());
    list(told, "held_out").iter().for_each(|case| has_keys(case, GENERATED, &[]));
    for side in ["softest", "stiffest"] {
        has_keys(&told[side], &["compliance_ratio", "load", "terms"], &[]);
        list(&told[side], "terms").iter().for_each(|term| has_keys(term, &["field", "coefficient", "share"], &[]));
    }
    let [soft, stiff] = ["softest", "stiffest"].map(|side| number(&told[side], "compliance_ratio"));
    assert!(0.0 < stiff && stiff <= soft, "{stiff} {soft}");
}

/// The triangle of springs, mesh and body; the mesh is one step coarser than the finer one in the scene that has it.
fn errors_add_up(case: &Value) {
    let [springs, mesh, total, remaining] = ["springs", "mesh", "total", "remaining"].map(|key| number(case, key));
    assert!(springs > 0.0 && mesh > 0.0 && total <= springs + mesh && total >= (springs - mesh).abs(), "{case}");
    assert!((remaining - mesh).abs() < 1e-6 * mesh, "{case}");
}

fn numbers_make_sense(result: &Value) {
    let (sizes, calibration) = (&result["sizes"], &result["calibration"]);
    let (e_rms, e_max) = (number(calibration, "e_rms"), number(calibration, "e_max"));
    assert!(e_rms > 0.0 && e_rms < LARGEST_ERROR && e_max >= e_rms, "e_rms {e_rms}, e_max {e_max}");
    assert!(number(&result["reference"], "backward_error") < 1e-13);
    for key in ["compliance", "u_max", "u_norm2", "stiffness_frobenius", "measure"] {
        assert!(number(&result["reference"], key) > 0.0, "{key}");
    }
    let names = |cases: &[Value]| cases.iter().map(|case| case["load"].clone()).collect::<Vec<_>>();
    let loads: Vec<Value> = list(result, "loads").iter().map(|load| load["name"].clone()).collect();
    assert_eq!(names(list(&result["reference"], "cases")), loads, "one answer for each load case");
    for key in ["compliance", "u_max", "u_norm2"] {
        covers_all(number(&result["reference"], key), list(&result["reference"], "cases"), |case| number(case, key));
    }
    let both = [list(calibration, "fitted"), list(calibration, "held_out")].concat();
    for body in ["reference", "springs"] {
        let strain = |owner: &Value| number(&owner["global_strain"], body);
        covers_all(strain(calibration), &both, strain);
    }
    let groups = list(calibration, "groups");
    assert_eq!(sizes["groups"], groups.len());
    assert_eq!(sizes["springs"], groups.iter().map(|g| number(g, "springs") as u64).sum::<u64>());
    for group in groups {
        let phi = number(group, "stiffness");
        assert!(number(group, "lower") <= phi && (!fitted(calibration) || phi <= number(group, "upper")), "{group}");
    }
    let sweep = list(calibration, "sweep");
    let least = sweep.iter().map(|row| number(row, "e_rms")).fold(f64::INFINITY, f64::min);
    assert_eq!(least, e_rms, "the best row of the sweep is the result");
    let trace = list(calibration, "trace");
    let error = |point: &Value| point[2].as_f64().expect("a number");
    assert!(trace.windows(2).all(|pair| error(&pair[1]) <= error(&pair[0])), "{trace:?}");
    if let Some(made_small) = calibration["objective_error"].as_f64() {
        let last = error(trace.last().expect("a trace has a point"));
        assert!((last - made_small).abs() <= 1e-9 * made_small, "the trace ends at {last}, the result is {made_small}");
        assert!(calibration["objective"] != "displacement" || (made_small - e_rms).abs() <= 1e-9 * e_rms);
    }
    let cases = list(calibration, "fitted").len() + list(calibration, "held_out").len();
    assert_eq!(cases, list(&result["scene"], "load").len());
}

/// What is told for a whole run is the largest of all its load cases.
fn covers_all(told: f64, cases: &[Value], of: impl Fn(&Value) -> f64) {
    assert_eq!(told, cases.iter().map(of).fold(f64::NEG_INFINITY, f64::max), "{cases:?}");
}

/// springs.json has the sizes of the result.
fn springs_agree(springs: &Value, result: &Value) {
    assert_eq!(springs["schema"], "springfit-springs/1");
    let count = result["sizes"]["springs"].as_u64().expect("a count") as usize;
    for key in ["edges", "rest_lengths", "group", "k"] {
        assert_eq!(list(springs, key).len(), count, "{key}");
    }
    let free = list(springs, "fixed").iter().flat_map(|node| node.as_array().expect("components"));
    assert_eq!(result["sizes"]["free_dofs"], free.filter(|fixed| **fixed == false).count());
    let groups = list(&result["calibration"], "groups");
    assert_eq!(list(springs, "groups").len(), groups.len());
    for (g, group) in groups.iter().enumerate() {
        let members = list(springs, "group").iter().filter(|member| **member == g).count();
        assert_eq!(group["springs"], members, "group {g}");
    }
    let dynamics = result["dynamics"].is_object();
    assert_eq!(springs["masses"].is_array(), dynamics);
    if dynamics {
        let masses = list(springs, "masses");
        let total: f64 = masses.iter().map(|mass| mass.as_f64().expect("a mass")).sum();
        let expected = number(&result["reference"], "measure") * number(&result["scene"]["material"], "density");
        assert!((total / expected - 1.0).abs() < 1e-12, "the masses add up to {total}, not {expected}");
    }
}

/// `check` announces the sizes and the sweep that the run then has.
fn plan_agrees(plan: &Value, result: &Value) {
    for key in SIZES.iter().filter(|key| **key != "groups") {
        assert_eq!(plan["sizes"][key], result["sizes"][key], "{key}");
    }
    assert_eq!(plan["scene"], result["scene"]);
    let sweep = list(&result["calibration"], "sweep");
    let announced: Vec<Value> = list(plan, "sweep").to_vec();
    let found: Vec<Value> = sweep.iter().map(|row| serde_json::json!([row["gamma"], row["groups"]])).collect();
    if result["calibration"]["ladder"].is_null() {
        assert_eq!(announced, found);
    }
    assert_eq!(plan["problems"], sweep.iter().filter(|row| row.get("same_groups_as").is_none()).count());
    // a run may find more to warn of: the accuracy of its solves, the network that it found, the motion
    let (before, after) = (list(plan, "warnings"), list(result, "warnings"));
    assert!(after.starts_with(before), "{after:?} after {before:?}");
}

fn run_and_compare(scene: &Path) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("new/folder");
    let (stdout, stderr) = springfit(&["run", "--out", out.to_str().expect("UTF-8")], scene);
    let file = |name: &str| fs::read_to_string(out.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(stdout, file("result.json"));
    let result: Value = serde_json::from_str(&stdout).expect("stdout is one JSON object");
    result_is_as_promised(&result);
    numbers_make_sense(&result);
    springs_agree(&serde_json::from_str(&file("springs.json")).expect("JSON"), &result);
    let names = fs::read_dir(&out).expect("readable").map(|entry| entry.expect("readable").file_name());
    let names = names.map(|name| name.into_string().expect("UTF-8"));
    // files of a motion are there exactly where the scene moves
    let (motion, names): (BTreeSet<String>, BTreeSet<String>) =
        names.partition(|name| name.starts_with("motion") || name == "strain.svg");
    assert_eq!(motion.is_empty(), result["dynamics"]["motions"].as_array().is_none_or(Vec::is_empty));
    let plots = [("front.svg", &result["budget"]), ("ladder.svg", &result["calibration"]["ladder"])];
    let plots = plots.into_iter().filter(|(_, what)| !what.is_null()).map(|(name, _)| name);
    let expected = ["body.vtu", "result.json", "springs.json", "springs.vtu"].into_iter().chain(plots);
    assert_eq!(names, expected.map(String::from).collect());
    for name in ["body.vtu", "springs.vtu"] {
        let text = file(name);
        assert!(text.starts_with("<?xml") && text.ends_with("</VTKFile>\n"), "{name} is whole");
    }
    let warnings: Vec<String> = list(&result, "warnings")
        .iter()
        .map(|warning| format!("warning: {}", warning.as_str().expect("text")))
        .collect();
    assert_eq!(stderr.lines().collect::<Vec<_>>(), warnings, "stderr shows the warnings and nothing else");
    let (plan, _) = springfit(&["check"], scene);
    if result["budget"].is_object() {
        // the resolution is not known before
        return;
    }
    plan_agrees(&serde_json::from_str(&plan).expect("stdout is one JSON object"), &result);
}

#[test]
fn every_scene_runs_and_writes_what_the_interface_promises() {
    for scene in scenes() {
        println!("{}", scene.display());
        run_and_compare(&scene);
    }
}

#[test]
fn the_summary_names_every_group_at_its_upper_bound() {
    for name in ["torus.toml", "torus_merged.toml"] {
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes").join(name);
        let result: Value = serde_json::from_str(&springfit(&["run"], &scene).0).expect("JSON");
        let groups = list(&result["calibration"], "groups");
        let at_bound: Vec<String> = groups
            .iter()
            .enumerate()
            .filter(|(_, group)| number(group, "stiffness") >= (1.0 - 1e-9) * number(group, "upper"))
            .map(|(i, group)| format!("#{i} {}", group["name"].as_str().expect("a name")))
            .collect();
        assert!(!at_bound.is_empty(), "{name} has stiff groups");
        let mut command = Command::cargo_bin("springfit").expect("the binary is built");
        let output = command.args(["run", "--quiet"]).arg(&scene).assert().success().get_output().stdout.clone();
        let summary = String::from_utf8(output).expect("UTF-8");
        let told = summary.lines().filter(|line| line.ends_with("at its upper bound"));
        let named = told.map(|line| line.split_whitespace().take(2).collect::<Vec<_>>().join(" "));
        assert_eq!(named.collect::<Vec<_>>(), at_bound, "{name}");
    }
}
