//! Checks of `[budget]`: numbers that can be met, and a body that comes at every resolution.

use crate::error::{Error, Result};

use super::super::Scene;
use super::geometry::MOST_CONTROL_POINTS;
use super::{positive, within};

/// What needs no body.
pub(super) fn check(scene: &Scene) -> Result<()> {
    let Some(budget) = &scene.budget else { return Ok(()) };
    positive("budget.max_error", budget.max_error)?;
    budget.step_time.map_or(Ok(()), |seconds| positive("budget.step_time", seconds))?;
    if scene.geometry.known_shape().is_none() {
        let message = match &scene.geometry.shape {
            Some(shape) => format!("the mesh \"{shape}\" has one resolution"),
            None => "a body from a file has one resolution".to_owned(),
        };
        return Err(Error::input("budget", message, "name a shape that is a patch, or remove [budget]"));
    }
    if scene.calibration.springs.is_some() {
        let message = "the network of calibration.springs has one resolution";
        return Err(Error::input("budget", message, "remove [budget], or let the network be built from [springs]"));
    }
    for (i, &count) in budget.finest.iter().flatten().enumerate() {
        within(&format!("budget.finest[{i}]"), count, 2, MOST_CONTROL_POINTS)?;
    }
    Ok(())
}
