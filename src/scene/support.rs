//! `[support]`: which nodes are held, once or in several parts.
//!
//! One table holds what it names in the components that it names. Symmetry planes ask for several, each with its own
//! component; then they are a list, `[[support]]`, and a node is held in all components that any of them holds.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::body::{Axis, BoxRegion};

/// `[support]`: the held control points are all that a face, a number or the box names.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Support {
    /// Faces of the control grid: "x-" has the first index of the first direction, "x+" the last; y and z likewise. On a shape
    /// that is a mesh they are its sides.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faces: Vec<String>,
    /// Numbers of control points, from 0 in C order of the control grid (last index fastest).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<usize>,
    /// Named sets of nodes: those in the file of a mesh, such as Gmsh's physical groups, or the sides of a shape that is a mesh.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sets: Vec<String>,
    /// All control points inside an axis-parallel box.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r#box: Option<BoxRegion>,
    /// Components that are held; default: all that the body has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub components: Option<Vec<Axis>>,
}

/// `[support]` or `[[support]]`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Supports {
    /// One table.
    One(Support),
    /// A list of tables.
    Many(Vec<Support>),
}

impl Default for Supports {
    fn default() -> Self {
        Self::One(Support::default())
    }
}

impl From<Support> for Supports {
    fn from(support: Support) -> Self {
        Self::One(support)
    }
}

impl Supports {
    /// The tables.
    pub fn tables(&self) -> &[Support] {
        match self {
            Self::One(support) => std::slice::from_ref(support),
            Self::Many(supports) => supports,
        }
    }

    /// The tables, to be changed.
    pub fn tables_mut(&mut self) -> &mut [Support] {
        match self {
            Self::One(support) => std::slice::from_mut(support),
            Self::Many(supports) => supports,
        }
    }

    /// The tables with their keys: `support`, or `support[0]`, `support[1]`, ...
    pub fn keyed(&self) -> impl Iterator<Item = (String, &Support)> {
        let key = |i: usize| match self {
            Self::One(_) => "support".to_owned(),
            Self::Many(_) => format!("support[{i}]"),
        };
        self.tables().iter().enumerate().map(move |(i, support)| (key(i), support))
    }
}

impl<'de> Deserialize<'de> for Supports {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(SupportsVisitor)
    }
}

/// Reads a table or a list of tables; serde's own untagged reading would lose the place and the reason of an error.
struct SupportsVisitor;

impl<'de> Visitor<'de> for SupportsVisitor {
    type Value = Supports;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a table [support], or several [[support]]")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Supports, A::Error> {
        Support::deserialize(MapAccessDeserializer::new(map)).map(Supports::One)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Supports, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(Supports::Many)
    }
}

impl JsonSchema for Supports {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Supports".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<Support>();
        let many = generator.subschema_for::<Vec<Support>>();
        json_schema!({ "anyOf": [one, many] })
    }
}
