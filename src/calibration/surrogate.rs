//! A surrogate of the displacement objective: a reduced basis with an error bound.
//!
//! For all phi in a region the displacements u(phi) lie close to a space of few dimensions. Exact solutions and their
//! derivatives span it (a reduced basis; J. S. Hesthaven, G. Rozza, B. Stamm, Certified Reduced Basis Methods, Springer
//! 2016); K(phi) restricted to it is a sum of small matrices, so an error costs microseconds whatever the mesh.
//!
//! | file | idea |
//! |---|---|
//! | [`galerkin`] | the basis V and the problem projected on it |
//! | [`certificate`] | a bound of |u - V y| and of the difference of the errors, without solving for u |
//! | [`walker`] | the surrogate as an [`super::objective::Objective`], inside its trust region |
//! | [`packed`] | small symmetric matrices |
//!
//! The optimiser on it is [`super::optimisers::surrogate`].

pub mod certificate;
pub mod galerkin;
pub mod packed;
pub mod walker;
