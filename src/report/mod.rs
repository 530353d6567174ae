//! Floor 6: a study as a document, as tables, and beside the tables of the sources.
//!
//! | file | idea |
//! |---|---|
//! | [`result`] | result.json |
//! | [`budget`] | its part about the networks that a budget chose from |
//! | [`converged`] | its part about the error of the mesh |
//! | [`ladder`] | groups that adapt: its part in result.json, table and plot |
//! | [`motion`] | its part about masses, steps and motions |
//! | [`summary`] | what a person reads after a run or a check |
//! | [`compare`] | two finished runs side by side |
//! | [`reproduce`] | tables and experiments of the sources, theirs beside ours |
//! | [`hard_cases`] | the hard cases and what happens in each |
//! | [`mod@bench`] | speed against error on this machine |

pub mod bench;
pub mod budget;
pub mod compare;
pub mod converged;
pub mod hard_cases;
pub mod ladder;
pub mod motion;
pub mod reproduce;
pub mod result;
pub mod summary;
mod thesis;
