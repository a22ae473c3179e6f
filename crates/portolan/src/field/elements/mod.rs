//! The elements of the surface, cell by cell: what exact distances near it are measured to.
//!
//! | file | what |
//! |---|---|
//! | `cube` | the simplices between the `2^D` nodes of one cell, and how far each crossing answers for the surface |
//! | `nodes`, `brick` | the cells of one brick |
//! | `around` | the cells whose elements a crossing stands for
//! | `lanes`, `refine` | the exact distance from the nodes of a brick to the elements around what the transform found
//! | `nearest` | the distance from any point |
//! | `surface_elements` | all bricks, kept up to date with the map |

mod around;
mod brick;
mod cube;
mod lanes;
mod nearest;
mod nodes;
mod refine;
mod surface_elements;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub(crate) use around::cells_around;
pub(crate) use nearest::simplex_distance_sq;
pub(crate) use refine::Refine;
pub(crate) use surface_elements::SurfaceElements;
