//! Frontiers, and the information gain of views, for exploration with a map in bricks.
//!
//! A cell of a field of signed distances is *free* where it was observed with a positive distance, *occupied* where it was
//! observed with another one, and *unknown* elsewhere, including where no brick exists.

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
