//! PLY, the Stanford polygon format (Turk 1994): text, and binary in both byte orders.
//!
//! Vertices with properties of any order and type, faces of any number of corners, triangle strips, and the `range_grid` of
//! Stanford's range scans. Elements and properties of other names are passed over. The numbers of things in the header are
//! promises, not sizes to allocate: memory grows with the bytes that are there.

mod body;
mod cloud;
mod header;
mod mesh;
#[cfg(test)]
mod tests;
mod write;

pub(crate) use cloud::parse;
pub use cloud::read_ply_cloud;
pub use mesh::{PlyMesh, read_ply_mesh};
pub use write::write_ply_cloud;

/// The most bytes of a file.
const MOST_BYTES: u64 = 4 << 30;
