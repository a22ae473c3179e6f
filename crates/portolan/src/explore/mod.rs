//! Where the known ends, and what would be seen from somewhere: what exploration asks of a map in bricks.
//!
//! A cell of a field of signed distances is *free* where it was observed and its distance is positive, *occupied* where it
//! was observed and is not free, and unknown elsewhere; also where there is no brick.

mod cells;
mod faces;
mod frontier;
mod frontier_map;
mod gain;
mod rays;
#[cfg(test)]
mod testing;

pub use frontier::Frontier;
pub use frontier_map::{FrontierMap, FrontierSettings};
pub use gain::{GainSettings, ViewGain, expected_gain, expected_gains};
pub use rays::{fan, pinhole, spherical};
