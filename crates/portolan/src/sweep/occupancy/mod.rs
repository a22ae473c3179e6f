//! Hits and misses of whole 3-D scans, block by block.
//!
//! [`super::Rays`] is the textbook's sweep in any dimension, with its depth of walls. This is the fast one for bricks:
//! exact rays with the meaning that OctoMap gave them (what is passed is missed once a scan, the cell of the end
//! point is hit, a hit overrules misses), and misses through a range image for scans of rows and columns.

mod exact;
mod hit_miss_sweep;
mod masks;
mod trace;

pub use hit_miss_sweep::{HitMissSweep, OccupancySweep};

pub(super) use exact::Tally;
pub(super) use hit_miss_sweep::stats;
