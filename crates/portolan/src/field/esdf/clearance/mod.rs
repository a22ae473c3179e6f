//! Certified clearance: an interval that holds the distance to the surface, at any point.
//!
//! | file | what |
//! |---|---|
//! | `around` | the point between its `2^D` nodes, what they hold, and the bounds that follow from it |
//! | `search` | the exact distance, where bounds are too far apart |
//! | `points` | the distance to obstacles that are points |
//! | `interval` | all together: [`crate::field::ClearanceField`] of a field in bricks |
//! | `noise` | less what the surface itself is uncertain by |

mod around;
mod interval;
mod noise;
mod points;
mod search;

pub use noise::{LessNoise, SurfaceNoise};
