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

/// How a spring lies in the cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Along an edge: stretch.
    Edge,
    /// Across a face of a cell: shear.
    FaceDiagonal,
    /// Through the inside of a cell: shear in three directions.
    BodyDiagonal,
    /// To a node two steps away, through more than one cell.
    SecondRing,
    /// Further, or between nodes without a grid: a spring that the user named.
    Other,
}

impl Kind {
    /// All kinds, from the shortest springs of a regular grid to the longest.
    pub const ALL: [Self; 5] = [Self::Edge, Self::FaceDiagonal, Self::BodyDiagonal, Self::SecondRing, Self::Other];

    /// The kind of a spring with this offset in the grid: by how far it goes, and by the number of directions it changes.
    pub fn of(offset: [i8; 3]) -> Self {
        let (reach, directions) = (reach(offset), offset.iter().filter(|&&step| step != 0).count());
        match (reach, directions) {
            (0 | 1, 0 | 1) => Self::Edge,
            (1, 2) => Self::FaceDiagonal,
            (0 | 1, _) => Self::BodyDiagonal,
            (2, _) => Self::SecondRing,
            _ => Self::Other,
        }
    }

    /// Its name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::FaceDiagonal => "face_diagonal",
            Self::BodyDiagonal => "body_diagonal",
            Self::SecondRing => "second_ring",
            Self::Other => "other",
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
    /// Step from a to b in the grid, the first that is not zero being positive; zero where there is no grid.
    pub offset: [i8; 3],
    /// Cells that contain it; for a spring that goes further than a cell the boxes of cells that it crosses from corner to
    /// corner.
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

impl Network {
    /// Most steps of a spring along a grid direction; none where a spring has no step in a grid.
    pub fn reach(&self) -> Option<usize> {
        let steps = self.springs.iter().map(|spring| usize::from(reach(spring.offset)));
        steps.map(|steps| (steps > 0).then_some(steps)).try_fold(1, |most, steps| Some(most.max(steps?)))
    }
}

/// Most steps along a grid direction.
fn reach(offset: [i8; 3]) -> u8 {
    offset.iter().map(|step| step.unsigned_abs()).max().unwrap_or(0)
}

/// Length and unit direction from `a` to `b`, in metres; none when they are not further apart than `tolerance`.
pub(super) fn rest(a: [f64; 3], b: [f64; 3], tolerance: f64) -> Option<(f64, [f64; 3])> {
    let step = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let length = (step[0] * step[0] + step[1] * step[1] + step[2] * step[2]).sqrt();
    (length > tolerance).then(|| (length, step.map(|x| x / length)))
}
