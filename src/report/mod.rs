//! Floor 6: a study as a document, as tables, and beside the tables of the sources.
//!
//! | file | idea |
//! |---|---|
//! | [`result`] | result.json |
//! | [`motion`] | its part about masses, steps and motions |
//! | [`summary`] | what a person reads after a run or a check |
//! | [`reproduce`] | tables of the thesis, theirs beside ours |
//! | [`reproduce_motion`] | experiments of the thesis in motion, theirs beside ours |
//! | [`smoothed`] | smoothed finite elements on good and bad meshes |
//! | [`mod@bench`] | speed against error on this machine |

pub mod bench;
pub mod motion;
pub mod reproduce;
pub mod reproduce_motion;
pub mod result;
pub mod smoothed;
pub mod summary;
mod thesis;
