//! The table of hard cases: all of them, each with its test, the same in the README and on the command line.

use assert_cmd::Command;
use serde_json::Value;
use springfit::report::hard_cases::{HARD_CASES, markdown};

const README: &str = include_str!("../../README.md");
const LIST: &str = include_str!("../reference/hard_cases.json");
const TESTS: [&str; 6] = [
    include_str!("bodies.rs"),
    include_str!("files.rs"),
    include_str!("motion.rs"),
    include_str!("numbers.rs"),
    include_str!("runs.rs"),
    include_str!("springs.rs"),
];

#[test]
fn every_case_of_the_list_has_a_line_and_a_test() {
    let list: Value = serde_json::from_str(LIST).expect("JSON");
    let names: Vec<&str> = list.as_array().expect("a list").iter().filter_map(|case| case["case"].as_str()).collect();
    assert_eq!(HARD_CASES.each_ref().map(|case| case.case).to_vec(), names);
    for case in &HARD_CASES {
        let test = format!("#[test]\nfn {}() {{", case.test);
        assert!(TESTS.iter().chain([&include_str!("supports.rs")]).any(|file| file.contains(&test)), "{}", case.test);
    }
}

#[test]
fn the_readme_and_the_command_line_have_the_table() {
    assert!(README.contains(&markdown()), "the table of the README is\n{}", markdown());
    let output =
        Command::cargo_bin("springfit").expect("built").args(["list", "hard-cases"]).output().expect("it ends");
    let text = String::from_utf8(output.stdout).expect("text");
    for case in &HARD_CASES {
        assert!(text.contains(case.case) && text.contains(case.happens), "{}", case.case);
    }
}
