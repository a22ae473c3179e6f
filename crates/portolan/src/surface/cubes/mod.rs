//! Marching cubes: triangles with the topology of the trilinear level set, brick by brick.
//!
//! The method of *(Lorensen & Cline 1987)*, with a table generated from rules instead of a published one.
//!
//! | file | step |
//! |---|---|
//! | `signs` | the signs of a brick as bits; cubes and edges with surface by shifts |
//! | `numbering`, `loops`, `patch`, `tunnel`, `table` | what one cube looks like |
//! | `samples`, `vertex`, `numbers`, `piece` | the vertices and triangles of one brick |
//! | `assemble`, `normals` | pieces joined into a mesh |
//! | `extract`, `incremental`, `dense` | from bricks of distances, from changes of them, from arrays |
//! | `whole`, `writer`, `edges` | arrays without holes: counted, then written into place |

mod assemble;
mod dense;
mod edges;
mod extract;
mod incremental;
mod loops;
mod normals;
mod numbering;
mod numbers;
mod patch;
mod piece;
mod samples;
mod signs;
mod table;
#[cfg(test)]
mod testing;
mod tunnel;
mod vertex;
mod whole;
mod writer;

pub use dense::{Inside, Isosurface, IsosurfaceSettings, isosurface};
pub use extract::{MeshSettings, marching_cubes};
pub use incremental::IncrementalMesh;
pub(crate) use numbering::edge_start;

pub(crate) use table::cube_patch;
pub(crate) use vertex::crossing_place;
