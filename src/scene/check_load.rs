//! Checks of `[[load]]`: one kind a table, vectors that are not zero, names that are not given twice.

use crate::error::{Error, Result};

use super::check::{length, positive};
use super::choices::{FACES, known};
use super::load::LOAD_KINDS;
use super::{BoxRegion, Load, PatchForce};

/// Most load cases.
const MOST_LOADS: usize = 1000;

/// Checks the load cases without a body.
///
/// # Errors
/// [`Error::Input`] at the key of the first value that cannot be used.
pub(super) fn check(loads: &[Load]) -> Result<()> {
    if loads.is_empty() {
        let help = format!("add a [[load]] table with one of {}", LOAD_KINDS.join(", "));
        return Err(Error::input("load", "no load case is given", help));
    }
    if loads.len() > MOST_LOADS {
        return Err(Error::input("load", format!("{} load cases", loads.len()), format!("at most {MOST_LOADS}")));
    }
    for (i, load) in loads.iter().enumerate() {
        check_one(load, &format!("load[{i}]"))?;
        let twice = load.name.is_some() && loads[..i].iter().any(|other| other.name == load.name);
        if let (true, Some(name)) = (twice, &load.name) {
            let message = format!("\"{name}\" is the name of another load case");
            return Err(Error::input(format!("load[{i}].name"), message, "give every load case its own name"));
        }
    }
    if loads.iter().all(|load| !load.fit) {
        let help = "leave fit out, or set it to true, in at least one [[load]]";
        return Err(Error::input("load[0].fit", "every load case is held out: there is nothing to fit to", help));
    }
    Ok(())
}

/// Checks the load cases against the directions of the body, 2 or 3.
///
/// # Errors
/// [`Error::Input`] at a vector of another length, a face or an axis that the body does not have.
pub(super) fn check_dimension(loads: &[Load], dimension: usize) -> Result<()> {
    let faces = &FACES[..2 * dimension];
    for (i, load) in loads.iter().enumerate() {
        if let Some((name, vector)) = load.vector() {
            length(&format!("load[{i}].{name}"), Some(vector.len()), dimension)?;
        }
        if let Some(traction) = &load.traction {
            known(&format!("load[{i}].traction.face"), &traction.face, faces)?;
        }
        if let Some(PatchForce { face, r#box, .. }) = &load.patch {
            face.iter().try_for_each(|face| known(&format!("load[{i}].patch.face"), face, faces))?;
            let region = r#box.as_ref();
            length(&format!("load[{i}].patch.box.min"), region.map(|region| region.min.len()), dimension)?;
            length(&format!("load[{i}].patch.box.max"), region.map(|region| region.max.len()), dimension)?;
        }
        // a torsion in the plane turns about z, which the body does not have as a component
        let planar = |&(name, axis): &(&str, super::Axis)| name != "torsion.axis" && axis.index() >= dimension;
        if let Some((name, _)) = load.axes().into_iter().find(planar) {
            return Err(Error::input(
                format!("load[{i}].{name}"),
                "the body has no axis z",
                "a body in 2D has x and y",
            ));
        }
        if dimension == 2 && load.torsion.as_ref().is_some_and(|torsion| torsion.axis != super::Axis::Z) {
            let message = "a body in 2D cannot turn about an axis in its plane";
            return Err(Error::input(format!("load[{i}].torsion.axis"), message, "leave it out, or give \"z\""));
        }
    }
    Ok(())
}

fn check_one(load: &Load, key: &str) -> Result<()> {
    let kinds = load.kinds();
    if kinds.len() > 1 {
        let message = format!("{} are given together", kinds.join(" and "));
        return Err(Error::input(format!("{key}.{}", kinds[1]), message, "one [[load]] table has one kind of load"));
    }
    if kinds.is_empty() {
        let help = format!("add one of {}", LOAD_KINDS.join(", "));
        return Err(Error::input(key, "no kind of load is given", help));
    }
    for (name, given) in [("body", &load.body), ("case", &load.case)] {
        if given.is_some() && load.file.is_none() {
            let message = format!("{name} is given without a file");
            return Err(Error::input(format!("{key}.{name}"), message, "it says which forces of load.file are meant"));
        }
    }
    if let Some(traction) = &load.traction {
        known(&format!("{key}.traction.face"), &traction.face, &FACES)?;
    }
    if let Some(patch) = &load.patch {
        check_patch(patch, &format!("{key}.patch"))?;
    }
    load.max_displacement.map_or(Ok(()), |largest| positive(&format!("{key}.max_displacement"), largest))?;
    check_size(load, key)
}

/// A load of nothing, or forces along the axis that they grow along by stretching only, is a slip.
fn check_size(load: &Load, key: &str) -> Result<()> {
    let help = "an error relative to no motion has no value";
    if let Some((name, vector)) = load.vector()
        && vector.iter().all(|&component| component == 0.0)
    {
        let help = format!("give at least one component that is not zero: {help}");
        return Err(Error::input(format!("{key}.{name}"), format!("{vector:?} is no load"), help));
    }
    if let Some((name, strength)) = load.strength()
        && strength == 0.0
    {
        let help = format!("give a force that is not zero: {help}");
        return Err(Error::input(format!("{key}.{name}"), "0 is no load", help));
    }
    match &load.bending {
        Some(bending) if bending.along == bending.direction => {
            let message = "the force would stretch the body, not bend it";
            Err(Error::input(format!("{key}.bending.direction"), message, "give another axis than bending.along"))
        }
        _ => Ok(()),
    }
}

fn check_patch(patch: &PatchForce, key: &str) -> Result<()> {
    match (&patch.face, &patch.r#box) {
        (Some(face), None) => known(&format!("{key}.face"), face, &FACES),
        (None, Some(BoxRegion { min, max })) => {
            let inverted = min.iter().zip(max).position(|(low, high)| low > high);
            inverted.map_or(Ok(()), |a| {
                let message = format!("{} is below the minimum {}", max[a], min[a]);
                let help = "give the smaller corner as min and the larger as max";
                Err(Error::input(format!("{key}.box.max[{a}]"), message, help))
            })
        }
        (Some(_), Some(_)) => {
            Err(Error::input(format!("{key}.box"), "both face and box are given", "keep one of the two"))
        }
        (None, None) => Err(Error::input(key, "has no place", "add face or box")),
    }
}
