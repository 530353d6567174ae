//! Springs between nodes, at rest.
//!
//! A spring s joins the nodes a and b. At rest it has the length l0 = |x_b - x_a| and the direction
//! d = (x_b - x_a) / l0. For small displacements u its energy is
//!
//! ```text
//! E_s = k_s/2 (d . (u_b - u_a))^2,     so that     K = sum_s k_s b_s b_s^T,   b_s = (-d, d)
//! ```
//!
//! which is the energy (3.1) of the thesis to second order. Two nodes on one place have no direction: such a spring is
//! never made, only counted. Lengths in metres.

/// How a spring lies in its cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Along an edge: stretch.
    Edge,
    /// Across a face of a cell: shear.
    FaceDiagonal,
    /// Through the inside of a cell: shear in three directions.
    BodyDiagonal,
}

impl Kind {
    /// All kinds, from the shortest springs of a regular grid to the longest.
    pub const ALL: [Self; 3] = [Self::Edge, Self::FaceDiagonal, Self::BodyDiagonal];

    /// The kind of a spring with this offset in the grid: by the number of directions it changes.
    pub fn of(offset: [i8; 3]) -> Self {
        match offset.iter().filter(|&&step| step != 0).count() {
            0 | 1 => Self::Edge,
            2 => Self::FaceDiagonal,
            _ => Self::BodyDiagonal,
        }
    }

    /// Its name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::FaceDiagonal => "face_diagonal",
            Self::BodyDiagonal => "body_diagonal",
        }
    }
}

/// One spring at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// Its ends a and b: nodes that stand for themselves (masters, where nodes are tied).
    pub nodes: [u32; 2],
    /// Length at rest, m.
    pub length: f64,
    /// Unit vector from a to b.
    pub direction: [f64; 3],
    /// Edge or diagonal.
    pub kind: Kind,
    /// Step from a to b in the grid, the first step that is not zero being +1; zero where there is no grid.
    pub offset: [i8; 3],
    /// Cells that contain it.
    pub cells: u32,
}

/// Nodes and the springs between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Directions of space, 2 or 3.
    pub dimension: usize,
    /// Where the nodes are at rest, m; z = 0 in two dimensions.
    pub positions: Vec<[f64; 3]>,
    /// The springs, no pair of nodes twice.
    pub springs: Vec<Spring>,
    /// Springs that were left out because their ends lie on one place.
    pub zero_length: usize,
}

/// Length and unit direction from `a` to `b`, in metres; none when they are not further apart than `tolerance`.
pub(super) fn rest(a: [f64; 3], b: [f64; 3], tolerance: f64) -> Option<(f64, [f64; 3])> {
    let step = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let length = (step[0] * step[0] + step[1] * step[1] + step[2] * step[2]).sqrt();
    (length > tolerance).then(|| (length, step.map(|x| x / length)))
}
