//! Two finished runs side by side: a network that was tuned by hand and a fitted one, or two ways to fit.
//!
//! Errors are percent of the displacements of the run's own continuum, so they compare networks only where body, supports
//! and loads are the same. Where they are not, the runs are shown all the same and the keys of the scenes that differ are named:
//! two resolutions of a body are worth a look, too. Numbers that a run does not have are absent.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use serde::Serialize;
use serde_json::Value;

/// Name and version of the JSON.
const SCHEMA: &str = "springfit-comparison/1";

/// Tables of a scene that make the continuum and its loads.
const BODY: [&str; 5] = ["geometry", "material", "support", "load", "reference"];

/// Rows of groups that a person gets to see.
const SHOWN: usize = 32;

/// Letters of a column; longer words stand below each other.
const COLUMN: usize = 24;

/// What is compared: the words, and the place in result.json.
const ROWS: &[(&str, &str)] = &[
    ("scene", "/scene/name"),
    ("objective", "/calibration/objective"),
    ("found by", "/calibration/optimiser"),
    ("springs", "/sizes/springs"),
    ("groups", "/sizes/groups"),
    ("e_rms %", "/calibration/e_rms"),
    ("e_max %", "/calibration/e_max"),
    ("stiffest, times the work", "/calibration/generalisation/stiffest/compliance_ratio"),
    ("softest, times the work", "/calibration/generalisation/softest/compliance_ratio"),
    ("stiffest under", "/calibration/generalisation/stiffest/load"),
    ("softest under", "/calibration/generalisation/softest/load"),
    ("nearly a mechanism", "/calibration/generalisation/near_mechanism"),
    ("condition of K", "/calibration/accuracy/condition"),
    ("omega_max 1/s", "/dynamics/omega_max"),
    ("safe step s", "/dynamics/safe_step"),
];

/// Two runs side by side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    schema: &'static str,
    runs: [String; 2],
    rows: Vec<Row>,
    groups: Vec<Group>,
    /// Keys of the scenes in which body, supports and loads differ.
    differences: Vec<String>,
}

/// One number of both.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Row {
    what: String,
    values: [Value; 2],
}

/// A group by its name: springs, and stiffness in the unit of the profile.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Group {
    name: String,
    springs: [Value; 2],
    stiffness: [Value; 2],
}

impl Comparison {
    /// Takes two folders and the result.json in each.
    pub fn new(runs: [String; 2], results: &[Value; 2]) -> Self {
        let differences = BODY.iter().flat_map(|table| {
            let [a, b] = results.each_ref().map(|result| &result["scene"][table]);
            different(table, a, b)
        });
        Self { schema: SCHEMA, runs, rows: rows(results), groups: groups(results), differences: differences.collect() }
    }

    /// A word where the runs have not the same body, supports and loads.
    pub fn warning(&self) -> Option<String> {
        (!self.differences.is_empty()).then(|| {
            format!(
                "errors of different bodies or loads say little side by side: {} differ",
                self.differences.join(", ")
            )
        })
    }

    /// Indented JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// The table for a person.
    pub fn table(&self) -> String {
        let [a, b] = &self.runs;
        let mut text = format!("{:<32} {a:>24} {b:>24}\n", "");
        for Row { what, values } in &self.rows {
            let [a, b] = values.each_ref().map(shown);
            let _ = match a.len().max(b.len()) <= COLUMN {
                true => writeln!(text, "{what:<32} {a:>COLUMN$} {b:>COLUMN$}"),
                false => writeln!(text, "{what}\n    {a}\n    {b}"),
            };
        }
        let _ = writeln!(text, "\n{:<32} {:>24} {:>24}", "group", "springs, stiffness", "springs, stiffness");
        for Group { name, springs, stiffness } in self.groups.iter().take(SHOWN) {
            let [a, b] = [0, 1].map(|run| match springs[run].is_null() {
                true => "-".to_owned(),
                false => format!("{}, {}", shown(&springs[run]), shown(&stiffness[run])),
            });
            let _ = writeln!(text, "{name:<32} {a:>COLUMN$} {b:>COLUMN$}");
        }
        if self.groups.len() > SHOWN {
            let _ = writeln!(text, "... and {} more (--json has all)", self.groups.len() - SHOWN);
        }
        text
    }
}

/// A value of result.json in a table: numbers to five digits.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "-".into(),
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => {
            let x = number.as_f64().unwrap_or(f64::NAN);
            if x == 0.0 || (1e-3..1e5).contains(&x.abs()) { format!("{x:.5}") } else { format!("{x:.5e}") }
        }
        other => other.to_string(),
    }
}

fn rows(results: &[Value; 2]) -> Vec<Row> {
    let at = |pointer: &str| results.each_ref().map(|result| result.pointer(pointer).cloned().unwrap_or_default());
    let mut rows: Vec<Row> =
        ROWS.iter().map(|(what, pointer)| Row { what: (*what).into(), values: at(pointer) }).collect();
    for (what, list) in [
        ("", "/calibration/fitted"),
        ("held out ", "/calibration/held_out"),
        ("generated ", "/calibration/generalisation/held_out"),
    ] {
        let cases = side_by_side(results.each_ref().map(|result| result.pointer(list)), "load");
        rows.extend(cases.into_iter().map(|(name, cases)| Row {
            what: format!("e_rms % {what}{name}"),
            values: cases.map(|case| case["e_rms"].clone()),
        }));
    }
    let seconds = |result: &Value| {
        let stages = result["seconds"].as_object()?;
        serde_json::Number::from_f64(stages.values().filter_map(Value::as_f64).sum()).map(Value::Number)
    };
    let values = results.each_ref().map(|result| seconds(result).unwrap_or_default());
    rows.push(Row { what: "seconds".into(), values });
    let warnings = results.each_ref().map(|result| result["warnings"].as_array().map_or(0, Vec::len).into());
    rows.push(Row { what: "warnings".into(), values: warnings });
    rows
}

fn groups(results: &[Value; 2]) -> Vec<Group> {
    let lists = results.each_ref().map(|result| result.pointer("/calibration/groups"));
    let of = |(name, found): (&str, [&Value; 2])| Group {
        name: name.to_owned(),
        springs: found.map(|group| group["springs"].clone()),
        stiffness: found.map(|group| group["stiffness"].clone()),
    };
    side_by_side(lists, "name").into_iter().map(of).collect()
}

/// The objects of two lists by their names, those of the second list alone after the others; null where there is none.
fn side_by_side<'a>(lists: [Option<&'a Value>; 2], key: &str) -> Vec<(&'a str, [&'a Value; 2])> {
    let mut place = BTreeMap::new();
    let mut pairs: Vec<(&str, [&Value; 2])> = vec![];
    for (run, list) in lists.into_iter().enumerate() {
        for object in list.and_then(Value::as_array).into_iter().flatten() {
            let Some(name) = object[key].as_str() else { continue };
            let at = *place.entry(name).or_insert(pairs.len());
            if at == pairs.len() {
                pairs.push((name, [&Value::Null; 2]));
            }
            pairs[at].1[run] = object;
        }
    }
    pairs
}

/// The keys at which two parts of scenes differ.
fn different(key: &str, a: &Value, b: &Value) -> Vec<String> {
    match (a, b) {
        _ if a == b => vec![],
        (Value::Object(first), Value::Object(second)) => {
            let keys: BTreeSet<&String> = first.keys().chain(second.keys()).collect();
            let below = |name: &String| different(&format!("{key}.{name}"), &a[name.as_str()], &b[name.as_str()]);
            keys.into_iter().flat_map(below).collect()
        }
        (Value::Array(first), Value::Array(second))
            if first.len() == second.len() && first.iter().all(Value::is_object) =>
        {
            let pairs = first.iter().zip(second).enumerate();
            pairs.flat_map(|(i, (a, b))| different(&format!("{key}[{i}]"), a, b)).collect()
        }
        _ => vec![key.to_owned()],
    }
}
