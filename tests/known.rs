//! A network that exists is judged as a fitted one is, and two runs are shown side by side: calibrate, hand the springs over,
//! and the same numbers come back.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::{Value, json};
use tempfile::TempDir;

/// The cube of the thesis, with masses and a load that is held out.
const CUBE: &str = "[geometry]\nshape = \"cube\"\n[material]\nyoung = 15e3\npoisson = 0.3333333333333333\ndensity = 1143.0\n\
                    [support]\nfaces = [\"z-\"]\n[[load]]\nforce_per_node = [80.0, -40.0, 40.0]\n[dynamics]\n";
const HELD_OUT: &str = "[[load]]\nname = \"twist\"\nfit = false\ntorsion = { axis = \"z\" }\n";

/// Calls the binary; status, stdout and stderr.
fn call(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("springfit").unwrap().args(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// A folder with scenes and their runs.
struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs a scene into the folder `name`; its result.
    fn run(&self, name: &str, text: &str) -> Value {
        let (status, _, message) = self.try_run(name, text);
        assert_eq!(status, 0, "{message}");
        read(&self.path(name).join("result.json"))
    }

    fn try_run(&self, name: &str, text: &str) -> (i32, String, String) {
        let scene = self.path(&format!("{name}.toml"));
        fs::write(&scene, text).expect("written");
        call(&["run", scene.to_str().unwrap(), "--out", self.path(name).to_str().unwrap()])
    }
}

fn read(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("there")).expect("JSON")
}

/// Every number of `a` is that of `b` to a relative 1e-11, every word the same.
fn same(what: &str, a: &Value, b: &Value) {
    match (a, b) {
        (Value::Number(x), Value::Number(y)) => {
            let (x, y) = (x.as_f64().unwrap(), y.as_f64().unwrap());
            assert!((x - y).abs() <= 1e-11 * x.abs().max(y.abs()).max(1e-6), "{what}: {x} {y}");
        }
        (Value::Array(x), Value::Array(y)) => {
            assert_eq!(x.len(), y.len(), "{what}");
            x.iter().zip(y).for_each(|(x, y)| same(what, x, y));
        }
        (Value::Object(x), Value::Object(y)) => {
            assert!(x.keys().eq(y.keys()), "{what}: {x:?} {y:?}");
            x.iter().for_each(|(key, value)| same(&format!("{what}.{key}"), value, &y[key]));
        }
        _ => assert_eq!(a, b, "{what}"),
    }
}

/// A result without what only a fit can tell: how well its loads determine a stiffness.
fn of_the_network(result: &Value) -> Value {
    let mut result = result.clone();
    for group in result["calibration"]["groups"].as_array_mut().expect("groups") {
        group.as_object_mut().expect("a group").remove("log_deviation");
    }
    result
}

/// All that is told of a network is the same: errors, both sides, groups, steps.
fn judged_alike(a: &Value, b: &Value) {
    let [a, b] = [a, b].map(of_the_network);
    for pointer in [
        "/sizes",
        "/calibration/e_rms",
        "/calibration/e_max",
        "/calibration/global_strain",
        "/calibration/fitted",
        "/calibration/held_out",
        "/calibration/groups",
        "/calibration/generalisation/softest/compliance_ratio",
        "/calibration/generalisation/softest/load",
        "/calibration/generalisation/stiffest/compliance_ratio",
        "/calibration/generalisation/stiffest/load",
        "/calibration/generalisation/near_mechanism",
        "/calibration/generalisation/held_out",
        "/dynamics/safe_step",
        "/dynamics/omega_max",
    ] {
        same(pointer, a.pointer(pointer).expect(pointer), b.pointer(pointer).expect(pointer));
    }
}

#[test]
fn the_springs_of_a_fit_are_judged_as_the_fit_was() {
    let desk = Desk::new();
    let fitted = desk.run("fitted", CUBE);
    let known = format!("{CUBE}[calibration]\nobjective = \"known\"\nsprings = \"fitted/springs.json\"\n");
    let judged = desk.run("judged", &known);
    judged_alike(&fitted, &judged);
    assert_eq!(judged["calibration"]["stop"], "not_fitted");
    assert_eq!(judged["calibration"]["counts"]["evaluations"], 0);
    let [a, b] = ["fitted", "judged"].map(|name| read(&desk.path(name).join("springs.json")));
    for key in ["edges", "k", "masses", "group", "groups"] {
        same(key, &a[key], &b[key]);
    }
}

#[test]
fn the_numbers_of_the_groups_are_judged_as_the_fit_was_in_order_and_by_name() {
    let desk = Desk::new();
    let springs = "[springs]\nprofile = \"axial_rigidity\"\n";
    for (name, held_out) in [("alone", ""), ("tried", HELD_OUT)] {
        let scene = format!("{CUBE}{held_out}{springs}[calibration]\ngamma = 0.1\n");
        let fitted = desk.run(name, &scene);
        let groups = fitted["calibration"]["groups"].as_array().expect("groups");
        assert!(groups.len() > 1);
        let in_order: Vec<String> = groups.iter().map(|group| group["stiffness"].to_string()).collect();
        let named: Vec<String> =
            groups.iter().map(|group| format!("{} = {}", group["name"], group["stiffness"])).collect();
        for given in [format!("[{}]", in_order.join(", ")), format!("{{ {} }}", named.join(", "))] {
            let known = format!("{scene}objective = \"known\"\nstiffness = {given}\n");
            judged_alike(&fitted, &desk.run("known", &known));
        }
    }
}

#[test]
fn a_file_says_which_springs_there_are() {
    let desk = Desk::new();
    desk.run("fitted", &format!("{CUBE}[springs]\ngrouping = \"kind\"\n"));
    let mut springs = read(&desk.path("fitted/springs.json"));
    // one spring is gone, another goes from corner to corner, and one is there twice with half its stiffness
    let number = |springs: &Value, key: &str, s: usize| springs[key][s].clone();
    let count = springs["edges"].as_array().unwrap().len();
    for key in ["edges", "rest_lengths", "group", "k"] {
        springs[key].as_array_mut().unwrap().remove(count - 1);
    }
    let half = json!(number(&springs, "k", 0).as_f64().unwrap() / 2.0);
    springs["k"][0] = half.clone();
    for (key, twice, long) in [
        ("edges", number(&springs, "edges", 0), json!([0, 215])),
        ("rest_lengths", number(&springs, "rest_lengths", 0), json!(12f64.sqrt())),
        ("group", number(&springs, "group", 0), json!(0)),
        ("k", half, json!(25.0)),
    ] {
        springs[key].as_array_mut().unwrap().extend([twice, long]);
    }
    fs::write(desk.path("mine.json"), springs.to_string()).expect("written");
    let known = format!("{CUBE}[calibration]\nobjective = \"known\"\nsprings = \"mine.json\"\n");
    let judged = desk.run("judged", &known);
    assert_eq!(judged["sizes"]["springs"], count);
    let groups = judged["calibration"]["groups"].as_array().unwrap();
    let names: Vec<&str> = groups.iter().map(|group| group["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["edge_1", "edge_2", "face_diagonal", "body_diagonal"]);
    assert_eq!((&groups[0]["springs"], &groups[0]["stiffness"]), (&json!(1), &json!(25.0)));
    let again = read(&desk.path("judged/springs.json"));
    let k = |springs: &Value, s: usize| springs["k"][s].as_f64().unwrap();
    assert!((k(&again, 0) / (2.0 * k(&springs, 0)) - 1.0).abs() < 1e-12, "springs side by side add up");
    assert_eq!(again["edges"][count - 1], json!([0, 215]));
}

#[test]
fn edges_alone_are_told_to_be_a_mechanism() {
    let desk = Desk::new();
    let known = format!("{CUBE}[springs]\ngrouping = \"kind\"\n[calibration]\nobjective = \"known\"\n");
    let bars = "stiffness = { edge = 900.0, face_diagonal = 0.0, body_diagonal = 0.0 }\n";
    let (status, _, message) = desk.try_run("bars", &(known.clone() + bars));
    assert_eq!(status, 3, "{message}");
    assert!(message.contains("mechanism") && !message.contains("fits the loads"), "{message}");
    // nearly none: it is answered, and told to be nearly one, with a remedy for a network that nobody fitted
    let nearly = "stiffness = { edge = 900.0, face_diagonal = 20.0, body_diagonal = 0.0 }\n";
    let (status, text, message) = desk.try_run("nearly", &(known + nearly));
    assert_eq!(status, 0, "{message}");
    assert!(message.contains("nearly a mechanism") && message.contains("make springs stiffer there"), "{message}");
    assert!(text.contains("not fitted load 1") && !text.contains("\nfitted"), "{text}");
}

#[test]
fn two_runs_are_compared_number_by_number() {
    let desk = Desk::new();
    let scene = format!("{CUBE}[springs]\ngrouping = \"kind\"\n");
    let fitted = desk.run("fitted", &scene);
    let by_hand = format!("{scene}[calibration]\nobjective = \"known\"\nstiffness = 600.0\n");
    let tuned = desk.run("by_hand", &by_hand);
    let folders = ["fitted", "by_hand"].map(|name| desk.path(name).display().to_string());
    let (status, text, message) = call(&["compare", &folders[0], &folders[1], "--json"]);
    assert_eq!((status, message.as_str()), (0, ""), "the same body");
    let compared: Value = serde_json::from_str(&text).expect("JSON");
    let values = |what: &str| {
        let rows = compared["rows"].as_array().unwrap();
        rows.iter().find(|row| row["what"] == what).unwrap_or_else(|| panic!("{what} in {rows:?}"))["values"].clone()
    };
    for (what, pointer) in [
        ("e_rms %", "/calibration/e_rms"),
        ("softest, times the work", "/calibration/generalisation/softest/compliance_ratio"),
        ("stiffest, times the work", "/calibration/generalisation/stiffest/compliance_ratio"),
        ("safe step s", "/dynamics/safe_step"),
        ("springs", "/sizes/springs"),
    ] {
        assert_eq!(values(what), json!([fitted.pointer(pointer), tuned.pointer(pointer)]), "{what}");
    }
    assert!(values("e_rms %")[0].as_f64() < values("e_rms %")[1].as_f64(), "the fit is better");
    assert!(values("e_rms % generated torsion")[0].is_number());
    let edge = &compared["groups"][0];
    assert_eq!((&edge["name"], &edge["stiffness"][1]), (&json!("edge"), &json!(600.0)));
    assert_eq!(compared["differences"], json!([]));
    let (_, table, _) = call(&["compare", &folders[0], &folders[1]]);
    assert!(table.lines().any(|line| line.starts_with("edge ") && line.contains("600.00000")), "{table}");

    // another load and another material: a warning that names the keys
    let other = scene.replace("80.0", "81.0").replace("15e3", "16e3");
    desk.run("other", &other);
    let (status, _, message) = call(&["compare", &folders[0], desk.path("other").to_str().unwrap()]);
    assert_eq!(status, 0);
    assert!(message.contains("material.young, load[0].force_per_node differ"), "{message}");
    let (status, _, message) = call(&["compare", &folders[0], desk.path("nothing").to_str().unwrap()]);
    assert_eq!(status, 2);
    assert!(message.contains("there is no such folder"), "{message}");
}
