//! `[calibration.matrix]` and `[calibration.acceleration]`: what the linear objectives compare, and in which states.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::calibration::objectives::matrix::Reading;

/// `[calibration.matrix]`: the distance of the stiffness matrices (3.17).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MatrixDistance {
    /// Which blocks are compared; default: full.
    pub reading: Reading,
}

/// `[calibration.acceleration]`: the difference of the accelerations (4.5).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Acceleration {
    /// True: the forces of the springs are linearised at rest; false: they are those of the displaced springs (3.2).
    pub linear: bool,
    /// States that network and continuum are released from; default: a stretch by 10 % along each axis in turn.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub snapshots: Vec<Snapshot>,
}

/// One state, or the states of a load history: one of stretch, gradient and loads.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Snapshot {
    /// Strain along x, y (, z): u = (stretch_x x, stretch_y y, ...); 0.1 is 10 %.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stretch: Option<Vec<f64>>,
    /// Displacement gradient G, row by row: u = G x; [[0, 0.1], [0, 0]] shears x along y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gradient: Option<Vec<Vec<f64>>>,
    /// The static states of every fitted load case at these fractions of its load, such as [0.5, 1.0].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loads: Option<Vec<f64>>,
}

/// The keys of a [`Snapshot`].
pub(super) const SNAPSHOT_KINDS: [&str; 3] = ["stretch", "gradient", "loads"];

impl Snapshot {
    /// The keys that are given.
    pub(super) fn kinds(&self) -> Vec<&'static str> {
        let given = [self.stretch.is_some(), self.gradient.is_some(), self.loads.is_some()];
        SNAPSHOT_KINDS.into_iter().zip(given).filter(|(_, given)| *given).map(|(name, _)| name).collect()
    }

    /// A stretch along one axis of a body in `dimension` directions.
    fn along(axis: usize, dimension: usize) -> Self {
        let stretch = (0..dimension).map(|a| if a == axis { STRETCH } else { 0.0 }).collect();
        Self { stretch: Some(stretch), ..Self::default() }
    }
}

/// Strain of the states that are taken when none is given.
const STRETCH: f64 = 0.1;

impl Acceleration {
    /// These settings with the usual states of a body in `dimension` directions where none is given.
    pub(super) fn resolved(mut self, dimension: usize) -> Self {
        if self.snapshots.is_empty() {
            self.snapshots = (0..dimension).map(|axis| Snapshot::along(axis, dimension)).collect();
        }
        self
    }
}
