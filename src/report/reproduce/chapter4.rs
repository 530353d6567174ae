//! What the thesis prints about the acceleration and the matrix approach (chapter 4, table 5.6), and the scenes behind it.
//!
//! Bodies of chapter 4 are grids of linear elements, 2 m x 2 m (x 2 m or 0.4 m), every spring counted once. The supports and
//! the initial states of the thesis are lost; here the face y- is held, with the loads of our verification list, and the
//! body is released from a stretch of 10 % along y, or along each axis in turn.

/// A body with its support and load, and what the thesis prints.
pub struct Body {
    /// Its name.
    pub name: &'static str,
    /// `[geometry]` of its scene.
    pub geometry: &'static str,
    /// Components of the force on every free node, N.
    pub force: &'static str,
    /// Grouping, and gamma where it matters.
    pub grouping: (&'static str, f64),
    /// Poisson's ratio.
    pub poisson: f64,
    /// Stiffness that the thesis prints for the acceleration approach, N/m, in the order of our groups.
    pub stiffness: &'static [f64],
    /// e_rms and e_max that the thesis prints for the matrix approach, percent.
    pub matrix: Option<[f64; 2]>,
    /// The same for the acceleration approach.
    pub acceleration: Option<[f64; 2]>,
}

const MEMBRANE: Body = Body {
    name: "membrane 9x9",
    geometry: "shape = \"square\"\ncontrol_points = [9, 9]\ndegree = [1, 1]",
    force: "[250.0, -400.0]",
    grouping: ("kind", 0.01),
    poisson: 1.0 / 3.0,
    stiffness: &[6228.075, 5086.067],
    matrix: Some([8.19, 15.82]),
    acceleration: Some([5.59, 7.92]),
};

/// Experiment 4.III: tables 4.2 (stiffness) and 4.3 (errors).
pub const BODIES: &[Body] = &[
    MEMBRANE,
    Body {
        name: "cube 7x7x7",
        geometry: "shape = \"cube\"\ncontrol_points = [7, 7, 7]\ndegree = [1, 1, 1]",
        force: "[1000.0, -1000.0, 0.0]",
        stiffness: &[500.898, 554.145, 929.238],
        matrix: Some([11.91, 22.7]),
        acceleration: Some([13.31, 33.06]),
        ..MEMBRANE
    },
    Body {
        name: "plate 7x7x2",
        geometry: "shape = \"plate\"\nsize = [2.0, 2.0, 0.4]\ncontrol_points = [7, 7, 2]\ndegree = [1, 1, 1]",
        force: "[1000.0, -1000.0, 0.0]",
        grouping: ("kind_and_length", 0.01),
        stiffness: &[156.564, 3492.76, 948.079, 1548.904, 624.774],
        matrix: Some([27.03, 64.47]),
        acceleration: Some([12.12, 24.59]),
        ..MEMBRANE
    },
];

/// Table 4.4: the membrane with other materials, acceleration approach.
pub const MATERIALS: &[Body] = &[
    Body {
        name: "membrane, nu = 0.1",
        poisson: 0.1,
        stiffness: &[5308.765, 6667.058],
        matrix: None,
        acceleration: Some([4.86, 10.12]),
        ..MEMBRANE
    },
    Body { name: "membrane, nu = 0.33", poisson: 0.33, matrix: None, ..MEMBRANE },
    Body {
        name: "membrane, nu = 0.43",
        poisson: 0.43,
        stiffness: &[5658.309, 5856.511],
        matrix: None,
        acceleration: Some([10.74, 17.28]),
        ..MEMBRANE
    },
];

/// A row of table 5.6: displacement against matrix approach under an isogeometric reference of degree two.
pub struct Spline {
    /// The shape.
    pub shape: &'static str,
    /// The held face.
    pub face: &'static str,
    /// Force on every free control point, N.
    pub force: &'static str,
    /// Gamma of the grouping by length.
    pub gamma: f64,
    /// Errors of the displacement approach, percent.
    pub displacement: [f64; 2],
    /// Errors of the matrix approach, percent.
    pub matrix: [f64; 2],
}

/// Table 5.6.
pub const SPLINES: &[Spline] = &[
    Spline {
        shape: "square",
        face: "y-",
        force: "[200.0, -200.0]",
        gamma: 0.1,
        displacement: [1.14, 2.79],
        matrix: [47.57, 68.82],
    },
    Spline {
        shape: "ellipse",
        face: "y-",
        force: "[1600.0, 200.0]",
        gamma: 0.001,
        displacement: [4.49, 12.35],
        matrix: [39.0, 80.74],
    },
    Spline {
        shape: "cube",
        face: "z-",
        force: "[80.0, -40.0, 40.0]",
        gamma: 0.1,
        displacement: [1.73, 7.44],
        matrix: [93.25, 190.79],
    },
    Spline {
        shape: "torus",
        face: "y-",
        force: "[60.0, -30.0, 30.0]",
        gamma: 0.5,
        displacement: [14.28, 31.37],
        matrix: [337.87, 706.02],
    },
];

/// What experiment 4.I prints: the stiffness that annealing found for edges and diagonals of (500, 400), and the errors.
pub const RELEASE: ([f64; 2], [f64; 2]) = ([459.13, 406.514], [0.69, 1.2]);

/// The ways a body of chapter 4 is calibrated: a name, and `[calibration]` of its scene.
pub struct Approach {
    /// Its name.
    pub name: &'static str,
    /// Lines of `[calibration]`.
    pub calibration: &'static str,
    /// Which of the printed errors it stands beside.
    pub kind: Kind,
}

/// The kinds of approach that the thesis compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// (3.17).
    Matrix,
    /// (4.5).
    Acceleration,
    /// (5.7).
    Displacement,
}

/// All of them, the best possible fit of the displacements last.
pub const APPROACHES: &[Approach] = &[
    Approach { name: "matrix, full", calibration: "objective = \"matrix\"", kind: Kind::Matrix },
    Approach {
        name: "matrix, off-diagonal",
        calibration: "objective = \"matrix\"\nmatrix = { reading = \"off_diagonal\" }",
        kind: Kind::Matrix,
    },
    Approach {
        name: "acceleration, y by 10 %",
        calibration: "objective = \"acceleration\"\nacceleration = { snapshots = [{ stretch = STRETCH_Y }] }",
        kind: Kind::Acceleration,
    },
    Approach {
        name: "acceleration, each axis by 10 %",
        calibration: "objective = \"acceleration\"",
        kind: Kind::Acceleration,
    },
    Approach { name: "displacement, best fit", calibration: "", kind: Kind::Displacement },
];

impl Body {
    /// The scene of this body with one approach.
    pub fn scene(&self, approach: &Approach) -> String {
        let stretch = if self.force.matches(',').count() == 1 { "[0.0, 0.1]" } else { "[0.0, 0.1, 0.0]" };
        let (grouping, gamma) = self.grouping;
        format!(
            "name = \"{}\"\n[geometry]\n{}\n[material]\nyoung = 14630.0\npoisson = {:?}\n[support]\nfaces = [\"y-\"]\n\
             [[load]]\nforce_per_node = {}\n[springs]\nweighting = \"springs\"\ngrouping = \"{grouping}\"\n\
             [calibration]\ngamma = {gamma:?}\n{}\n",
            self.name,
            self.geometry,
            self.poisson,
            self.force,
            approach.calibration.replace("STRETCH_Y", stretch)
        )
    }
}

impl Spline {
    /// The scene of this row: `objective` is displacement or matrix.
    pub fn scene(&self, weighting: &str, objective: &str) -> String {
        format!(
            "name = \"{shape}\"\n[geometry]\nshape = \"{shape}\"\n[material]\nyoung = 15e3\n\
             poisson = 0.3333333333333333\n[support]\nfaces = [\"{}\"]\n[[load]]\nforce_per_node = {}\n[springs]\n\
             weighting = \"{weighting}\"\n[calibration]\ngamma = {:?}\nobjective = \"{objective}\"\n",
            self.face,
            self.force,
            self.gamma,
            shape = self.shape,
        )
    }
}
