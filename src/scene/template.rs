//! A commented scene to start from, for every shape: `springfit new NAME`.
//!
//! Nothing of it is written by hand: the values are a [`Scene`] with its defaults, the comments the descriptions in the
//! JSON Schema, that is, the doc comments of the settings. So it names every key there is, and it is always valid.

use serde_json::Value as Json;
use toml_edit::{DocumentMut, Item, Table};

use crate::error::Result;
use crate::geometry::meshes;
use crate::geometry::shapes;
use crate::reference::methods::{METHODS, default_for};

use super::choices::{known, names};
use super::{Calibration, Geometry, Load, Material, Reference, Scene, Solver, Springs, Support, resolve, schema};

/// Force on every free node of a mesh, N: gravity-like, so that every body bends.
const MESH_FORCE: [f64; 3] = [0.0, -10.0, -10.0];

/// The commented scene of a shape, as text.
///
/// # Errors
/// [`crate::error::Error::Input`] when there is no shape of this name.
pub fn template(name: &str) -> Result<String> {
    known("NAME", name, &names("geometry.shape"))?;
    let Some((doc, scene)) = resolved(name)? else { return Ok(String::new()) };
    let text = toml::to_string(&scene).unwrap_or_default();
    let mut document: DocumentMut = text.parse().unwrap_or_default();
    let schema = schema();
    comment_table(document.as_table_mut(), &schema, &schema);
    Ok(format!("# {name}: {doc}.\n# A line \"# key: ...\" names a key that may be added.\n\n{document}"))
}

/// What a shape is, and its example with every default written out; none when there is no such shape.
fn resolved(name: &str) -> Result<Option<(&'static str, Scene)>> {
    if let Some(shape) = shapes::find(name) {
        let scene = example(name, shape.fixed_face, &shape.default_force[..shape.dimension]);
        return Ok(Some((shape.doc, resolve(&scene, shape.dimension, &METHODS[0]))));
    }
    let Some(shape) = meshes::find(name) else { return Ok(None) };
    let scene = example(name, shape.fixed_face, &MESH_FORCE[..shape.dimension]);
    let method = default_for(&shape.mesh(&shape.default_request())?);
    Ok(Some((shape.doc, resolve(&scene, shape.dimension, method))))
}

/// A scene of the shape with its usual support and load, and the material of the method, section 8.
fn example(name: &str, fixed_face: &str, force: &[f64]) -> Scene {
    Scene {
        name: name.into(),
        geometry: Geometry { shape: Some(name.into()), ..Geometry::default() },
        material: Material { young: 15e3, poisson: 1.0 / 3.0, density: Some(1143.0) },
        support: Support { faces: vec![fixed_face.into()], ..Support::default() }.into(),
        load: vec![Load::force_per_node(force.to_vec())],
        reference: Reference::default(),
        converged: None,
        springs: Springs::default(),
        calibration: Calibration::default(),
        solver: Solver::default(),
        budget: None,
        dynamics: None,
    }
}

/// Puts the description of each key above it, and behind the last key those of the keys that are not there.
fn comment_table(table: &mut Table, own: &Json, root: &Json) {
    let keys: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
    for key in &keys {
        let property = &own["properties"][key];
        let inner = referred(property, root);
        let description = format!("# {}\n", describe(property, inner));
        if inner["anyOf"].is_array() {
            // a number or a table: one line shows it better
            table[key].make_value();
        }
        match &mut table[key] {
            Item::Table(child) => {
                child.decor_mut().set_prefix(format!("\n{description}"));
                comment_table(child, inner, root);
            }
            Item::ArrayOfTables(tables) => {
                for child in tables.iter_mut() {
                    child.decor_mut().set_prefix(format!("\n{description}"));
                    comment_table(child, referred(&inner["items"], root), root);
                }
            }
            _ => {
                if let Some(mut name) = table.key_mut(key) {
                    name.leaf_decor_mut().set_prefix(description);
                    name.leaf_decor_mut().set_suffix(" ");
                }
            }
        }
    }
    comment_absent(table, &keys, own, root);
}

/// Lines for the keys that are not there, above the first key of the table.
fn comment_absent(table: &mut Table, keys: &[String], own: &Json, root: &Json) {
    let mut lines = String::new();
    for (key, property) in own["properties"].as_object().into_iter().flatten() {
        if !keys.contains(key) {
            lines += &format!("# {key}: {}\n", describe(property, referred(property, root)));
        }
    }
    let first = keys.iter().find(|key| table.get(key).is_some_and(Item::is_value));
    if let Some(mut name) = first.and_then(|key| table.key_mut(key)) {
        let prefix = name.leaf_decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default().to_owned();
        name.leaf_decor_mut().set_prefix(lines + &prefix);
    }
}

/// The description of a property, and the names it may have.
fn describe(property: &Json, inner: &Json) -> String {
    // a description may be broken over lines in the source; a comment is one line
    let text = property["description"].as_str().unwrap_or_default().replace('\n', " ");
    let listed = property["enum"].as_array().into_iter().flatten();
    let named = inner["oneOf"].as_array().into_iter().flatten().map(|one| &one["const"]);
    let names: Vec<&str> = listed.chain(named).filter_map(Json::as_str).collect();
    match names.is_empty() {
        true => text,
        false => format!("{} One of: {}.", text, names.join(", ")),
    }
}

/// The schema that a property refers to, itself if it is written out.
fn referred<'a>(property: &'a Json, root: &'a Json) -> &'a Json {
    let target =
        property["$ref"].as_str().or_else(|| property["anyOf"].as_array()?.iter().find_map(|one| one["$ref"].as_str()));
    target.and_then(|target| root.pointer(target.trim_start_matches('#'))).unwrap_or(property)
}

#[cfg(test)]
mod tests {
    use super::super::{Source, check, parse};
    use super::*;

    #[test]
    fn every_template_parses_to_its_example() {
        for name in names("geometry.shape") {
            let source = Source { name: "new".into(), text: template(name).unwrap() };
            let scene = parse(&source).unwrap();
            check(&scene).unwrap();
            assert_eq!(Some(scene), resolved(name).unwrap().map(|(_, scene)| scene), "{}", source.text);
            for comment in ["# dynamics: ", "\n# distortion: ", "\n# The control points that are held", "\n[support]"] {
                assert!(source.text.contains(comment), "{comment} {}", source.text);
            }
        }
        assert!(template("cub").unwrap_err().help().unwrap().contains("did you mean \"cube\""));
    }

    #[test]
    fn every_key_of_the_schema_is_described() {
        let schema = schema();
        let tables = schema["$defs"].as_object().unwrap().values().chain([&schema]);
        for (key, property) in tables.filter_map(|table| table["properties"].as_object()).flatten() {
            let described = property["description"].as_str().is_some_and(|text| text.len() > 4);
            assert!(described, "{key} has no description");
        }
    }
}
