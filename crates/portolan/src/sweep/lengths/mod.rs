//! Hits and lengths of beams: how many ended in each cell, and how far they went inside of it.

mod beams;
mod hit_length_sweep;
mod rays;

pub use beams::BeamLengths;
pub use hit_length_sweep::HitLengthSweep;
