//! Frontiers, and the information gain of views, for exploration with a map in bricks.
//!
//! A cell of a field of signed distances is *free* where it was observed with a positive distance, *occupied* where it was
//! observed with another one, and *unknown* elsewhere, including where no brick exists. With a map of hits per meter at hand, the
//! gain of a view looks past what stops only a part of the beams ([`expected_gain_through`]).

mod cells;
mod faces;
mod follow;
mod frontier;
mod frontier_map;
mod gain;
mod rays;
#[cfg(test)]
mod testing;
mod through;

pub use frontier::Frontier;
pub use frontier_map::{FrontierMap, FrontierSettings};
pub use gain::{GainSettings, ViewGain, expected_gain, expected_gains};
pub use rays::{fan, pinhole, spherical};
pub use through::{GainThrough, expected_gain_through, expected_gains_through};
