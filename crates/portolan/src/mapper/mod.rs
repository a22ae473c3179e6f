//! The recipe: the maps that are asked for, made so that they fit each other, and what is derived from them.
//!
//! [`Mapper`] holds an occupancy map, a field of distances and hits per meter, fuses scans into all, and derives surface and Euclidean
//! distances with thresholds that follow from the weights of its own cells. Everything below it can be used by itself.

mod derived;
mod maps;
mod settings;
#[cfg(test)]
mod tests;

pub(crate) use maps::timed;
pub use maps::{Fused, Mapper, MapperMaps};
pub use settings::{MapperSettings, THIN};
