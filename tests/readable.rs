//! What people read: digits that are significant at any scale, and names that fit their column.

use serde_json::Value;
use springfit::clock::Progress;
use springfit::report::result::Document;
use springfit::report::{ladder, motion, summary};
use springfit::scene::{self, Scene, Source};
use springfit::study::{self, Study, plan};

fn parsed(text: &str) -> Scene {
    let scene = scene::parse(&Source { name: "scene".into(), text: text.into() }).expect("a legal scene");
    scene::check(&scene).expect("a scene that can be run");
    scene
}

fn run(text: &str) -> Study {
    study::run(&parsed(text), &Progress::default()).expect("a body that can be calibrated")
}

/// Numbers in a text that read as zero though they have decimals, such as 0.000: digits that were lost.
fn lost(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| c.is_whitespace() || "(),;:/[]%".contains(c));
    words.filter(|word| word.contains('.') && word.parse::<f64>().is_ok_and(|number| number == 0.0)).collect()
}

fn reads_well(text: &str) {
    assert!(lost(text).is_empty(), "{:?} in\n{text}", lost(text));
}

/// A cube of a micron with E = 15 kPa: forces of 1e-11 N move it by some nanometres, and it swings in microseconds.
fn micron(reference: &str, grouping: &str, rest: &str) -> String {
    format!(
        "[geometry]\nshape = \"cube\"\nsize = [1e-6, 1e-6, 1e-6]\ncontrol_points = [4, 4, 4]\n{reference}\n[material]\n\
         young = 15e3\npoisson = 0.3\ndensity = 1143.0\n[support]\nfaces = [\"z-\"]\n[[load]]\n\
         force_per_node = [2e-12, -1e-12, 1e-12]\n[[load]]\nforce_per_node = [0.0, 1e-12, 0.0]\nfit = false\n\
         [springs]\n{grouping}\n{rest}\n"
    )
}

#[test]
fn a_body_of_a_micron_is_read_as_well_as_one_of_a_metre() {
    let swings = "[dynamics]\nalpha = 1e8\nduration = 2e-5\nframes = 5";
    let plain = run(&micron("", "", swings));
    let of_mesh = run(&micron("[reference]\nmethod = \"t4\"", "grouping = \"adaptive\"\ngroups = 8", ""));
    assert!(plain.reference.cases[0].u_max < 1e-6);
    for study in [&plain, &of_mesh] {
        reads_well(&summary::run(study));
        reads_well(&summary::check(&plan::plan(&study.scene).expect("a plan")));
        study.warnings.iter().for_each(|warning| reads_well(warning));
        // the lengths of the groups
        let length = study.calibration.grouping.groups[0].length;
        assert!(length < 1e-6 && summary::run(study).contains(&format!("{length:.3e}")), "{length}");
    }
    reads_well(&motion::summary(plain.dynamics.as_ref().expect("it moves")));
}

#[test]
fn what_a_free_micron_turns_about_is_told_with_its_digits() {
    let text = micron("", "", "").replace("faces = [\"z-\"]", "nodes = [21, 42]");
    let error = study::run(&parsed(&text), &Progress::default()).err().expect("two nodes leave a turn").to_string();
    assert!(error.contains("it can turn about") && error.contains("e-7"), "{error}");
    reads_well(&error);
}

/// Groups that adapt have sentences for names.
#[test]
fn long_names_are_numbered_and_short_in_tables_and_whole_in_json() {
    const COLUMN: usize = 36;
    let study = run(
        "[geometry]\nshape = \"circle\"\n[material]\nyoung = 15e3\npoisson = 0.3\n[support]\nfaces = [\"y-\"]\n[springs]\n\
         grouping = \"adaptive\"\ngroups = 20\n[[load]]\nforce_per_node = [600.0, 100.0]\nmax_displacement = 1.0\n\
         [[load]]\nrandom_smooth = { seed = 3 }\nmax_displacement = 1.0\n",
    );
    let groups = &study.calibration.grouping.groups;
    let longest = groups.iter().map(|group| group.name.chars().count()).max().unwrap_or_default();
    assert!(longest > 2 * COLUMN, "a name of {longest} characters needs no care");
    let text = summary::run(&study);
    let table: Vec<&str> =
        text.lines().skip_while(|line| !line.starts_with("group ")).skip(1).take(groups.len()).collect();
    for (number, (line, group)) in table.iter().zip(groups).enumerate() {
        let (name, rest) = line.split_at(line.char_indices().nth(COLUMN).map_or(line.len(), |(at, _)| at));
        assert!(name.starts_with(&format!("#{number} ")), "{line}");
        let shown = name.trim_end().trim_end_matches("...").trim_end();
        assert!(format!("#{number} {}", group.name).starts_with(shown), "{line}: {}", group.name);
        assert_eq!(rest.split_whitespace().next(), Some(&group.springs.to_string()[..]), "{line}");
    }
    let widest = ladder::table(&study.calibration.ladder).lines().map(|line| line.chars().count()).max();
    assert!(widest.is_some_and(|width| width < 160), "{widest:?}");
    let document: Value = serde_json::from_str(&Document::of(&study).to_json()).expect("JSON");
    for (row, group) in document["calibration"]["groups"].as_array().expect("groups").iter().zip(groups) {
        assert_eq!(row["name"], group.name);
    }
}
