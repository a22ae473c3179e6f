//! The textbook's own: its experiments on one simulated lap, its report, its renderer on a line.

pub mod experiment;
pub mod gallery;
pub mod ghost;
pub mod memory;
pub mod pictures;
pub mod poses;
pub mod radiance;
pub mod radiance_report;
pub mod report;
mod repr;

pub use repr::{Abilities, MapRepr};
