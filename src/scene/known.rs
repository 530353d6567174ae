//! `calibration.stiffness`: the stiffness of groups that are not fitted.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// The stiffness of every group, in the unit of the profile: N/m where it is constant.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Known {
    /// One number for all.
    All(f64),
    /// One for each group, in their order.
    InOrder(Vec<f64>),
    /// One for each group, by its name.
    ByName(BTreeMap<String, f64>),
}

impl Known {
    /// The numbers, each with what comes after `calibration.stiffness` in its key.
    pub fn keyed(&self) -> Vec<(String, f64)> {
        match self {
            Self::All(value) => vec![(String::new(), *value)],
            Self::InOrder(values) => values.iter().enumerate().map(|(i, value)| (format!("[{i}]"), *value)).collect(),
            Self::ByName(values) => values.iter().map(|(name, value)| (format!(".{name}"), *value)).collect(),
        }
    }
}

impl<'de> Deserialize<'de> for Known {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(KnownVisitor)
    }
}

/// Reads one of the three; serde's own untagged reading would lose the place and the reason of an error.
struct KnownVisitor;

impl<'de> Visitor<'de> for KnownVisitor {
    type Value = Known;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, one for each group as [1e3, 500.0], or by their names as { edge = 1e3, ... }")
    }

    fn visit_f64<E>(self, value: f64) -> std::result::Result<Known, E> {
        Ok(Known::All(value))
    }

    fn visit_i64<E>(self, value: i64) -> std::result::Result<Known, E> {
        Ok(Known::All(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> std::result::Result<Known, E> {
        Ok(Known::All(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, values: A) -> std::result::Result<Known, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(values)).map(Known::InOrder)
    }

    fn visit_map<A: MapAccess<'de>>(self, values: A) -> std::result::Result<Known, A::Error> {
        BTreeMap::deserialize(MapAccessDeserializer::new(values)).map(Known::ByName)
    }
}
