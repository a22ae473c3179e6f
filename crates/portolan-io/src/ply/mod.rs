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

/// Whether a file is a PLY with faces: a mesh.
pub(crate) fn has_faces(path: &std::path::Path) -> bool {
    let head = crate::bytes::open(path).and_then(|mut input| input.read_up_to(64 << 10));
    let header = head.and_then(|head| header::parse(&head, path));
    let is_face = |e: &header::Element| matches!(e.name.as_str(), "face" | "tristrips") && e.count > 0;
    header.is_ok_and(|h| h.elements.iter().any(is_face))
}
