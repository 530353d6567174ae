//! Floor 1: the body. Knots, bases, patches, refinement, shapes, grids of nodes and degrees of freedom.

pub mod basis;
pub mod dofs;
pub mod file;
pub mod gauss;
pub mod grid;
pub mod grid_mesh;
pub mod knots;
pub mod loose;
pub mod measure;
pub mod mesh;
pub mod mesh_files;
pub mod meshes;
pub mod patch;
pub mod refine;
pub mod rows;
pub mod selection;
pub mod shapes;
