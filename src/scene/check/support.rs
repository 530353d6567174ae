//! Checks of `[support]`: every table holds something, in components and at places that there are.

use crate::error::{Error, Result};

use super::super::Supports;
use super::super::choices::{FACES, known};
use super::{check_box, length};

/// What needs no body.
pub(super) fn check(supports: &Supports) -> Result<()> {
    if supports.tables().is_empty() {
        let help = "add a [[support]] table: a free body has no answer";
        return Err(Error::input("support", "the list is empty", help));
    }
    for (key, support) in supports.keyed() {
        if support.faces.is_empty() && support.nodes.is_empty() && support.sets.is_empty() && support.r#box.is_none() {
            let help = format!("add {key}.faces such as [\"z-\"], {key}.nodes or {key}.box: a free body has no answer");
            return Err(Error::input(key, "nothing is held", help));
        }
        if support.components.as_ref().is_some_and(Vec::is_empty) {
            let help = "leave it out to hold all components, or name some of x, y, z";
            return Err(Error::input(format!("{key}.components"), "no component is held", help));
        }
        for (i, face) in support.faces.iter().enumerate() {
            known(&format!("{key}.faces[{i}]"), face, &FACES)?;
        }
        support.r#box.as_ref().map_or(Ok(()), |region| check_box(&format!("{key}.box"), region))?;
    }
    Ok(())
}

/// Faces, boxes and components against the directions of the body, 2 or 3.
pub(super) fn check_dimension(supports: &Supports, dimension: usize) -> Result<()> {
    for (key, support) in supports.keyed() {
        let region = support.r#box.as_ref();
        length(&format!("{key}.box.min"), region.map(|region| region.min.len()), dimension)?;
        length(&format!("{key}.box.max"), region.map(|region| region.max.len()), dimension)?;
        for (i, face) in support.faces.iter().enumerate() {
            known(&format!("{key}.faces[{i}]"), face, &FACES[..2 * dimension])?;
        }
        for (i, axis) in support.components.iter().flatten().enumerate() {
            if axis.index() >= dimension {
                let key = format!("{key}.components[{i}]");
                return Err(Error::input(key, "the body has no component z", "a body in 2D has x and y"));
            }
        }
    }
    Ok(())
}
