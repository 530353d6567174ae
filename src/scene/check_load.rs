//! Checks of `[[load]]`: one kind a table, vectors that are not zero, names that are not given twice.

use crate::error::{Error, Result};

use super::check::{check_box, length, positive};
use super::choices::{FACES, known};
use super::load::LOAD_KINDS;
use super::{Load, Place};

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
        for (name, place) in load.places() {
            let key = format!("load[{i}].{name}");
            place.face.map_or(Ok(()), |face| known(&format!("{key}.face"), face, faces))?;
            length(&format!("{key}.box.min"), place.region.map(|region| region.min.len()), dimension)?;
            length(&format!("{key}.box.max"), place.region.map(|region| region.max.len()), dimension)?;
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
    for (name, place) in load.places() {
        check_place(place, &format!("{key}.{name}"))?;
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

/// A load acts at one place, a set of springs lies at one.
pub(super) fn check_place(place: Place, key: &str) -> Result<()> {
    match (place.face, place.set, place.region) {
        (Some(face), None, None) => known(&format!("{key}.face"), face, &FACES),
        (None, Some(_), None) => Ok(()),
        (None, None, Some(region)) => check_box(&format!("{key}.box"), region),
        (None, None, None) => Err(Error::input(key, "no place is given", "add one of face, set, box")),
        _ => Err(Error::input(key, "several places are given", "keep one of face, set, box")),
    }
}
