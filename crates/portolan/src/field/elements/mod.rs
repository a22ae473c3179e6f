//! The elements of the surface, cell by cell: what exact distances near it are measured to.
//!
//! | file | what |
//! |---|---|
//! | `cube` | the simplices between the `2^D` nodes of one cell, and how far each crossing answers for the surface |
//! | `nodes`, `brick` | the cells of one brick |
//! | `surface_elements` | all bricks, kept up to date with the map |

mod brick;
mod cube;
mod nodes;
mod surface_elements;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub(crate) use brick::BrickElements;
pub(crate) use surface_elements::SurfaceElements;
