//! Meshes made from a few numbers: boxes, balls and cylinders of tetrahedra, grids of quadrilaterals and hexahedra.

pub mod kuhn;
