//! The surface of the map, cell by cell: what distances are measured to.
//!
//! | file | what |
//! |---|---|
//! | `nodes` | the estimates at the corners of a brick's cells |
//! | `cube` | the segments or triangles (elements) between the `2^D` nodes of one cell, and how far each crossing answers for them |
//! | `brick` | the elements of one brick |
//! | `crossings` | where a brick's edges are crossed |
//! | `around` | the cells whose elements a crossing answers for |
//! | `simplex` | the distance from a point to one element |
//! | `elements` | all bricks, kept up to date with the map |

mod around;
mod brick;
mod crossings;
mod cube;
mod elements;
mod nodes;
mod simplex;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub(crate) use around::cells_around;
pub(crate) use crossings::BrickCrossings;
pub(crate) use elements::SurfaceElements;
pub(crate) use simplex::simplex_distance_sq;
