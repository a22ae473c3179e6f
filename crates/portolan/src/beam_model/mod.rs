//! What a sensor would read: the distribution of ranges along a ray through a map of hits per meter, and how well it
//! foretells scans that were not fused.

mod distribution;
mod foretold;

pub use distribution::RangeDistribution;
pub use foretold::{ForetoldRanges, ForetoldScore, RangeFloor};
