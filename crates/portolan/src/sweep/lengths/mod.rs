//! Hits and lengths of beams: how many ended in each cell, and how far they went inside of it.

mod beams;
mod blocks;
mod hit_length_sweep;
mod part;
mod rays;

pub use beams::BeamLengths;
pub(crate) use blocks::{HitBlocks, KnowsHits};
pub use hit_length_sweep::HitLengthSweep;
