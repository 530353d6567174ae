//! Floor 1: the body. Knots, bases, patches, refinement, shapes, grids of nodes and degrees of freedom.

pub mod dofs;
pub mod grid;
