//! The exact distance from the nodes of a brick to the surface around what the transform found.
//!
//! | file | what |
//! |---|---|
//! | `groups` | the crossings that the brick's nodes found, and the elements around each |
//! | `simplices` | distances to eight elements side by side |
//! | `brick` | the distance of every node to the elements beside it and to those of its groups |

mod brick;
mod groups;
mod simplices;

pub(super) use brick::NodeDistances;
