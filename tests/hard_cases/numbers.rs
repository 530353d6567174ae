//! Numbers: Poisson's ratio, what is no number, gamma, sizes, units.

use springfit::calibration::sweep::gammas;
use springfit::error::Error;
use springfit::study::plan;

use super::common::{CUBE, SQUARE, parse, refused, runs, says, warned};

#[test]
fn poisson_ratio() {
    let square = |poisson: &str, plane: &str| {
        format!(
            "{}[reference]\nplane = \"{plane}\"\n",
            SQUARE.replace("poisson = 0.3", &format!("poisson = {poisson}"))
        )
    };
    let cube = |poisson: &str| CUBE.replace("poisson = 0.3", &format!("poisson = {poisson}"));
    for text in [
        square("0.5", "strain"),
        cube("0.5"),
        cube("-1"),
        square("-1", "stress"),
        square("0.51", "stress"),
        cube("1e9"),
    ] {
        says(&refused(&text), 2, &["material.poisson", "0.5"]);
    }
    let sheet = runs(&square("0.5", "stress"));
    assert!(!sheet.warnings.iter().any(|warning| warning.contains("poisson")), "{:?}", sheet.warnings);
    for text in [cube("0.4999"), square("0.4999", "strain"), cube("0.49999")] {
        warned(
            &runs(&text).warnings,
            &["material.poisson = 0.4999", "\"iga\" of degree 2 locks from nu = 0.4", "degree 3"],
        );
    }
    for text in [cube("-0.99"), square("-0.99", "stress"), cube("0.49"), cube("0")] {
        let study = runs(&text);
        assert!(study.reference.accuracy.backward_error < 1e-12);
        assert!(!study.warnings.iter().any(|warning| warning.contains("poisson")), "{:?}", study.warnings);
    }
}

/// A scene with a number in every kind of field.
const ALL_FIELDS: &str = "[geometry]\nshape = \"square\"\nsize = [2.0, 2.0]\ncontrol_points = [4, 4]\ndegree = [2, 2]\n\
    [material]\nyoung = 15e3\npoisson = 0.3\ndensity = 1143.0\n\
    [support]\nnodes = [0, 1]\nbox = { min = [0.0, 0.0], max = [0.5, 2.0] }\n\
    [[load]]\nforce_per_node = [2.0, -1.0]\nmax_displacement = 0.5\n\
    [[load]]\ntraction = { face = \"x+\", value = [1.0, 0.5] }\n[[load]]\nbody_force = [1.0, 2.0]\n\
    [[load]]\npoint = { node = 15, force = [1.0, 2.0] }\n\
    [reference]\nthickness = 0.5\nextra_gauss_points = 1\n\
    [calibration]\nseed = 3\nstarts = 2\ngamma = { start = 0.8, step = 0.2 }\n\
    annealing = { chains = 2, evaluations = 100, initial_temperature = 1.0, final_temperature = 0.1 }\n\
    gauss_newton = { refactorisations = 30, polish = 5, tolerance = 1e-6 }\n\
    [solver]\ntolerance = 1e-10\n[limits]\nseconds = 1e6\nmemory = 4000000000\n\
    [dynamics]\nalpha = 200.0\nduration = 0.1\nstep = 1e-3\nframes = 4\n";

/// Where numbers stand in a text: byte ranges.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let mut found = Vec::new();
    let mut start = None;
    for (at, c) in text.char_indices().chain([(text.len(), ' ')]) {
        let inside = c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '+' | '_' | '"');
        match (start, inside) {
            (None, true) => start = Some(at),
            (Some(first), false) => {
                if text[first..at].parse::<f64>().is_ok() {
                    found.push(first..at);
                }
                start = None;
            }
            _ => {}
        }
    }
    found
}

#[test]
fn not_a_number_in_any_field() {
    let sound = parse(ALL_FIELDS).unwrap_or_else(|error| panic!("{error}"));
    plan::plan(&sound).unwrap_or_else(|error| panic!("{error}"));
    let places = numbers(ALL_FIELDS);
    assert!(places.len() > 40, "{}", places.len());
    for place in places {
        for bad in ["nan", "inf", "-inf", "1e400", "-1e400", "\"x\""] {
            let mut text = ALL_FIELDS.to_owned();
            text.replace_range(place.clone(), bad);
            let line = 1 + ALL_FIELDS[..place.start].matches('\n').count();
            let located = parse(&text).err().unwrap_or_else(|| panic!("{bad} in line {line} is accepted"));
            assert_eq!(located.exit_status(), 2, "{located}");
            let shown = format!("{:?}", miette::Report::new(located));
            assert!(shown.contains(&format!("hard.toml:{line}:")), "{bad} in line {line}: {shown}");
        }
    }
}

#[test]
fn gamma_outside_its_range() {
    for bad in ["0.0", "1.0", "-1.0", "nan", "1.5", "inf"] {
        let text = SQUARE.replace("gamma = 0.1", &format!("gamma = {bad}"));
        says(&refused(&text), 2, &["calibration.gamma"]);
    }
    for (start, step) in [("0.8", "0.0"), ("0.8", "-0.1"), ("0.8", "1e-9"), ("0.8", "nan"), ("1.2", "0.1")] {
        let text = SQUARE.replace("gamma = 0.1", &format!("gamma = {{ start = {start}, step = {step} }}"));
        says(&refused(&text), 2, &["calibration.gamma"]);
    }
    // the loop of Algorithm 5.1 is counted before it starts
    assert_eq!(gammas(0.9, 0.0009).expect("legal").len(), 1000);
    assert!(gammas(0.9, 0.00089).is_err() && gammas(0.9, 0.0).is_err());
}

#[test]
fn size() {
    // 10^8 nodes are allowed to be asked for, and refused with the bytes before any of them is made
    let square = |counts: &str, more: &str| format!("{}{more}", SQUARE.replace("[4, 4]", counts));
    let big = refused(&square("[10000, 10000]", "[limits]\nmemory = \"64 GB\"\n"));
    says(&big, 3, &["100000000 nodes", "GB", "use fewer control points"]);
    assert!(matches!(big, Error::OverLimit { .. }), "{big}");
    says(&refused(&square("[10000, 10001]", "")), 2, &["100010000 control points", "at most 100000000"]);
    let counts = "[4294967296, 4294967297]";
    says(&refused(&square(counts, "")), 2, &["4294967296 is out of range", "from 2 to 100000000"]);
    says(&refused(&square("[18446744073709551616, 4]", "")), 2, &["line 3"]);
    says(&refused(&square("[-4, 4]", "")), 2, &["control_points[0]"]);
    let cube = CUBE.replace("[4, 4, 4]", "[400, 400, 400]") + "[limits]\nmemory = \"64 GB\"\n";
    says(&refused(&cube), 3, &["64000000 nodes", "320.0 GB of memory"]);
    // a factor that does not fit what the scene allows is refused by its symbolic count
    let factor = refused(&square("[60, 60]", "[limits]\nmemory = \"9 MB\"\n"));
    says(&factor, 3, &["MB of memory", "limits.memory allows 9.0 MB", "raise limits.memory"]);
    let time = refused(&square("[20, 20]", "[limits]\nseconds = 1e-9\n"));
    says(&time, 3, &["limits.seconds allows 0.000000001 s", "raise limits.seconds"]);
    runs(&format!("{SQUARE}[limits]\nmemory = \"1 GB\"\nseconds = 3600\n"));
}

#[test]
fn units() {
    let with = |young: &str, size: &str, force: &str| {
        SQUARE
            .replace("young = 15e3", &format!("young = {young}"))
            .replace("control_points", &format!("size = [{size}, {size}]\ncontrol_points"))
            .replace("[2.0, -1.0]", force)
            + "gauss_newton = { tolerance = 1e-12 }\n"
    };
    let pascal = runs(&with("15e3", "2.0", "[2.0, -1.0]"));
    for (text, scale) in [
        (with("15e6", "2.0", "[2.0, -1.0]"), 1e3),
        (with("15e6", "2.0", "[2e3, -1e3]"), 1e3),
        // millimetres: E in N/mm^2, thickness 1 m is 1000 mm
        (with("15e-3", "2000.0", "[2.0, -1.0]") + "[reference]\nthickness = 1000.0\n", 1e-3),
    ] {
        let other = runs(&text);
        let [a, b] = [&pascal, &other].map(|study| study.calibration.fitted.e_rms);
        assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        for (one, two) in pascal.calibration.phi.iter().zip(&other.calibration.phi) {
            // the error is flat where it is smallest: phi is known to the root of the tolerance
            assert!(*one == 0.0 && *two == 0.0 || (one * scale / two - 1.0).abs() < 1e-5, "{one} {two}");
        }
    }
}
