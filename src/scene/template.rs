//! A commented scene to start from, for every shape: `springfit new NAME`.
//!
//! Nothing of it is written by hand: the values are a [`Scene`] with its defaults, the comments the descriptions of the
//! JSON Schema, that is, the doc comments of the settings. So it names every key, and it parses.

use serde_json::Value as Json;
use toml_edit::{DocumentMut, Item, Table};

use crate::error::Result;

use super::choices::{known, names};
use super::shapes::{self, Shape};
use super::{Annealing, Calibration, Geometry, Load, Material, Reference, Scene, Springs, Support, resolve, schema};
