//! Other units, the same numbers: a body in kPa or in millimetres has the same error and the stiffness in its units.
//!
//! With E times s and the same forces, all displacements are 1/s, and phi is s times as large. With lengths in mm and E in
//! N/mm^2, k is in N/mm: a thousandth of its value in N/m; the axial rigidity EA is a force and does not change. A power
//! of two only changes exponents, so there every bit of the error is the same.

use springfit::clock::Progress;
use springfit::scene::{self, Source};
use springfit::study::{self, fit::Calibration};

/// A body with its units.
#[derive(Clone, Copy)]
struct Given {
    shape: &'static str,
    size: &'static [f64],
    face: &'static str,
    force: &'static str,
    gamma: f64,
    /// Units of length in a metre.
    length: f64,
    /// Young's modulus in newtons per squared unit of length.
    young: f64,
    profile: &'static str,
}

const SQUARE: Given = Given {
    shape: "square",
    size: &[2.0, 2.0],
    face: "y-",
    force: "[200.0, -200.0]",
    gamma: 0.1,
    length: 1.0,
    young: 15e3,
    profile: "constant",
};
const CIRCLE: Given = Given { shape: "circle", force: "[600.0, 100.0]", gamma: 0.2, ..SQUARE };
const CUBE: Given = Given { shape: "cube", size: &[2.0, 2.0, 2.0], face: "z-", force: "[80.0, -40.0, 40.0]", ..SQUARE };
const TORUS: Given =
    Given { shape: "torus", size: &[2.5, 2.5, 0.75], force: "[60.0, -30.0, 30.0]", gamma: 0.5, ..SQUARE };

fn calibrate(given: Given) -> Calibration {
    let Given { shape, size, face, force, gamma, length, young, profile } = given;
    let extents: Vec<f64> = size.iter().map(|extent| extent * length).collect();
    let thickness = if size.len() == 2 { format!("thickness = {length:?}") } else { String::new() };
    let text = format!(
        "[geometry]\nshape = \"{shape}\"\nsize = {extents:?}\n[material]\nyoung = {young:?}\npoisson = 0.3\n\
         [support]\nfaces = [\"{face}\"]\n[[load]]\nforce_per_node = {force}\n[reference]\n{thickness}\n\
         [springs]\nprofile = \"{profile}\"\n[calibration]\ngamma = {gamma:?}\ngauss_newton = {{ tolerance = 1e-12 }}\n"
    );
    let scene = scene::parse(&Source { name: shape.into(), text }).expect("a legal scene");
    study::run(&scene, &Progress::default()).expect("a body that can be calibrated").calibration
}

/// The largest relative difference of the errors, and that of phi from `scale` times the other phi.
fn differences(one: &Calibration, other: &Calibration, scale: f64) -> [f64; 2] {
    let relative = |a: f64, b: f64| if a == b { 0.0 } else { (a / b - 1.0).abs() };
    let phi = one.phi.iter().zip(&other.phi).map(|(a, b)| relative(a * scale, *b)).fold(0.0, f64::max);
    [relative(one.fitted.e_rms, other.fitted.e_rms), phi]
}

/// The error agrees up to the rounding of the solves; phi less well, since the error is flat where it is smallest: a
/// relative change of it by the tolerance 1e-12 of the fit is one of phi by its square root.
fn are_equal(given: Given, [e_rms, phi]: [f64; 2]) {
    assert!(e_rms <= 1e-12, "{}: e_rms differs by {e_rms:e}", given.shape);
    assert!(phi <= 1e-5, "{}: phi differs by {phi:e}", given.shape);
}

#[test]
fn hard_case_units_young_times_1000() {
    for given in [SQUARE, CIRCLE, CUBE, TORUS] {
        let (pascal, kilo) = (calibrate(given), calibrate(Given { young: 1e3 * given.young, ..given }));
        let [e_rms, phi] = differences(&pascal, &kilo, 1e3);
        println!("{} E x 1000: e_rms {} differs by {e_rms:.1e}, phi by {phi:.1e}", given.shape, pascal.fitted.e_rms);
        are_equal(given, [e_rms, phi]);
    }
}

#[test]
fn hard_case_units_millimetres() {
    for given in [SQUARE, CIRCLE, CUBE, TORUS] {
        for (profile, scale) in [("constant", 1e-3), ("axial_rigidity", 1.0), ("inverse_square", 1e3)] {
            let metres = Given { profile, ..given };
            let millimetres = Given { length: 1e3, young: given.young / 1e6, ..metres };
            let (metres, millimetres) = (calibrate(metres), calibrate(millimetres));
            let [e_rms, phi] = differences(&metres, &millimetres, scale);
            println!(
                "{} {profile} in mm: e_rms {} differs by {e_rms:.1e}, phi by {phi:.1e}",
                given.shape, metres.fitted.e_rms
            );
            assert_eq!(metres.grouping.group_of, millimetres.grouping.group_of);
            are_equal(given, [e_rms, phi]);
        }
    }
}

#[test]
fn hard_case_units_powers_of_two_change_no_bit_of_the_error() {
    for given in [SQUARE, CIRCLE, CUBE, TORUS] {
        let here = calibrate(given);
        let stiffer = calibrate(Given { young: 1024.0 * given.young, ..given });
        assert_eq!(differences(&here, &stiffer, 1024.0), [0.0, 0.0], "{} E x 1024", given.shape);
        // 1024 units of length in a metre
        let finer = calibrate(Given { length: 1024.0, young: given.young / 1048576.0, ..given });
        assert_eq!(differences(&here, &finer, 1.0 / 1024.0), [0.0, 0.0], "{} in m / 1024", given.shape);
    }
}
