//! The exact distance from the nodes of a brick to the surface around what the transform found.

mod brick;
mod simplices;

pub(super) use brick::NodeDistances;
