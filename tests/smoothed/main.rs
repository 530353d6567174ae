//! The acceptance list of smoothed finite elements, against numbers of an independent implementation
//! (`smoothed_fem.json`), against exact states of stress, and against themselves by differences.

mod algebra;
mod bodies;
mod corotational;
mod linear;
mod motion;
mod push;
mod scenes;
