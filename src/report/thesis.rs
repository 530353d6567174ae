//! What the thesis prints in its chapter 5, and the scenes behind it (J. P. da Silva, UFBA, 2015).

use serde::Serialize;

/// One row of a table: a body of chapter 5 with a gamma, and what the thesis prints for it.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Experiment {
    /// Name of the body.
    pub body: &'static str,
    /// Control points in each direction.
    pub control_points: &'static [usize],
    /// True for the linear basis of table 5.7.
    pub linear: bool,
    /// Gamma of the grouping by length.
    pub gamma: f64,
    /// Groups that the thesis prints.
    pub groups: Option<usize>,
    /// Smallest and largest stiffness that the thesis prints, N/m.
    pub stiffness_range: Option<[f64; 2]>,
    /// e_rms and e_max that the thesis prints, percent.
    pub errors: [f64; 2],
}

/// A table of the thesis.
pub struct Table {
    /// Its number.
    pub id: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// Its rows.
    pub rows: &'static [Experiment],
}

/// Support and load of a body (method, section 8).
struct Set {
    face: &'static str,
    force: &'static str,
}

fn set(body: &str) -> Set {
    match body {
        "square" => Set { face: "y-", force: "[200.0, -200.0]" },
        "circle" => Set { face: "y-", force: "[600.0, 100.0]" },
        "ellipse" => Set { face: "y-", force: "[1600.0, 200.0]" },
        "torus" => Set { face: "y-", force: "[60.0, -30.0, 30.0]" },
        "spheroid" => Set { face: "z-", force: "[100.0, -50.0, 50.0]" },
        _ => Set { face: "z-", force: "[80.0, -40.0, 40.0]" },
    }
}

impl Experiment {
    /// The scene of this row.
    pub fn scene(&self, weighting: &str, optimiser: &str, evaluations: usize) -> String {
        let Set { face, force } = set(self.body);
        let degree =
            if self.linear { format!("degree = {:?}\n", vec![1; self.control_points.len()]) } else { String::new() };
        format!(
            "name = \"{body}\"\n[geometry]\nshape = \"{body}\"\ncontrol_points = {points:?}\n{degree}\
             [material]\nyoung = 15e3\npoisson = 0.3333333333333333\n[support]\nfaces = [\"{face}\"]\n\
             [[load]]\nforce_per_node = {force}\n[springs]\nweighting = \"{weighting}\"\n\
             [calibration]\noptimiser = \"{optimiser}\"\ngamma = {gamma:?}\nannealing = {{ evaluations = {evaluations} }}\n",
            body = self.body,
            points = self.control_points,
            gamma = self.gamma,
        )
    }

    /// True when another row asks for the same calibration.
    pub fn same_problem(&self, other: &Self) -> bool {
        self.body == other.body
            && self.control_points == other.control_points
            && self.linear == other.linear
            && self.gamma == other.gamma
    }
}

const fn row(
    body: &'static str,
    control_points: &'static [usize],
    gamma: f64,
    groups: usize,
    stiffness_range: Option<[f64; 2]>,
    errors: [f64; 2],
) -> Experiment {
    Experiment { body, control_points, linear: false, gamma, groups: Some(groups), stiffness_range, errors }
}

const fn plain(body: &'static str, control_points: &'static [usize], linear: bool, errors: [f64; 2]) -> Experiment {
    Experiment { body, control_points, linear, gamma: 0.1, groups: None, stiffness_range: None, errors }
}

const PLANE: &[usize] = &[6, 6];
const CUBE: &[usize] = &[6, 6, 6];
const TORUS: &[usize] = &[9, 5, 5];
const SPHEROID: &[usize] = &[9, 10, 3];

/// Rows shared by tables 5.2 (groups and stiffness) and 5.3 (errors).
const BODIES: &[Experiment] = &[
    row("square", PLANE, 0.1, 2, Some([5360.352, 8624.863]), [1.14, 2.79]),
    row("circle", PLANE, 0.01, 16, Some([347.737, 23116.788]), [2.5, 8.87]),
    row("ellipse", PLANE, 0.001, 28, Some([276.385, 47256.123]), [2.44, 6.67]),
    row("cube", CUBE, 0.1, 3, Some([624.417, 3825.382]), [1.73, 7.44]),
    row("torus", TORUS, 0.5, 4, Some([25.095, 52900.287]), [14.28, 31.37]),
    row("spheroid", SPHEROID, 0.6, 3, Some([583.968, 47793.992]), [5.37, 22.01]),
];

/// All tables of chapter 5 that a displacement calibration answers.
pub const TABLES: &[Table] = &[
    Table { id: "5.2", title: "groups and range of the stiffness of the six bodies", rows: BODIES },
    Table { id: "5.3", title: "errors of the six bodies", rows: BODIES },
    Table {
        id: "5.4",
        title: "errors against resolution",
        rows: &[
            plain("square", &[3, 3], false, [14.37, 22.69]),
            plain("square", &[4, 4], false, [2.35, 5.25]),
            plain("square", PLANE, false, [1.14, 2.79]),
            plain("square", &[9, 9], false, [0.5, 1.41]),
            plain("cube", &[3, 3, 3], false, [14.03, 27.27]),
            plain("cube", &[4, 4, 4], false, [2.94, 6.25]),
            plain("cube", CUBE, false, [1.73, 7.44]),
            plain("cube", &[9, 9, 9], false, [1.7, 4.6]),
        ],
    },
    Table {
        id: "5.5",
        title: "errors against gamma",
        rows: &[
            row("circle", PLANE, 0.8, 2, None, [5.56, 25.2]),
            row("circle", PLANE, 0.2, 6, None, [5.14, 19.44]),
            row("circle", PLANE, 0.01, 16, None, [2.5, 8.87]),
            row("circle", PLANE, 0.001, 17, None, [3.31, 14.3]),
            row("ellipse", PLANE, 0.7, 2, None, [10.86, 36.89]),
            row("ellipse", PLANE, 0.1, 9, None, [5.47, 23.17]),
            row("ellipse", PLANE, 0.05, 16, None, [5.03, 11.65]),
            row("ellipse", PLANE, 0.001, 28, None, [2.44, 6.67]),
            row("torus", TORUS, 0.7, 2, None, [22.95, 51.27]),
            row("torus", TORUS, 0.5, 4, None, [14.28, 31.37]),
            row("torus", TORUS, 0.2, 8, None, [34.9, 63.51]),
            row("torus", TORUS, 0.1, 16, None, [43.8, 75.3]),
            row("spheroid", SPHEROID, 0.8, 2, None, [47.19, 75.35]),
            row("spheroid", SPHEROID, 0.6, 3, None, [5.37, 22.01]),
            row("spheroid", SPHEROID, 0.2, 7, None, [10.04, 19.17]),
            row("spheroid", SPHEROID, 0.01, 60, None, [34.62, 61.56]),
        ],
    },
    Table {
        id: "5.7",
        title: "errors with the linear basis (displacement approach)",
        rows: &[plain("square", PLANE, true, [1.19, 2.55]), plain("cube", CUBE, true, [2.34, 11.33])],
    },
];
