//! Distances as one array, and the textbook's way to make them.

mod envelope;
mod esdf_grid;
mod squared_distance;
mod textbook;

pub use esdf_grid::{EsdfError, EsdfGrid};
pub use squared_distance::squared_distance_transform;
pub use textbook::esdf_from_tsdf;
