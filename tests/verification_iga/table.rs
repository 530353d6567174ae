//! The pinned numbers of `tests/reference/verification.json`.

use serde_json::Value;

/// The expected values of a check.
pub fn expected(id: &str) -> Value {
    let all: Value = serde_json::from_str(include_str!("../reference/verification.json")).expect("JSON");
    let checks = all.as_array().expect("a list of checks");
    let check = checks.iter().find(|check| check["id"] == id).expect("a check of this name");
    check["expected"].clone()
}

/// Rows of numbers.
pub fn rows(table: &Value) -> Vec<Vec<f64>> {
    let row = |row: &Value| row.as_array().expect("a row").iter().map(|v| v.as_f64().expect("a number")).collect();
    table.as_array().expect("rows").iter().map(row).collect()
}

/// Asserts a relative difference, and prints it.
pub fn assert_close(what: &str, measured: f64, expected: f64, tolerance: f64) {
    let error = ((measured - expected) / expected).abs();
    println!("{what}: {measured:e}, relative difference {error:.1e}");
    assert!(error <= tolerance, "{what} is {measured:e}, expected {expected:e}, off by {error:.1e}");
}

/// Convergence rates log2(e_i / e_(i+1)) of errors on meshes that halve.
pub fn rates(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}
