//! PLY, the Stanford polygon format (Turk 1994): text, and binary in both byte orders.
//!
//! Vertices with properties of any order and type, faces of any number of corners, triangle strips, and the `range_grid` of
//! Stanford's range scans. Elements and properties of other names are passed over. The numbers of things in the header are
//! promises, not sizes to allocate: memory grows with the bytes that are there.

use std::path::Path;

mod body;
mod cloud;
mod header;
mod mesh;
#[cfg(test)]
mod tests;
mod write;

pub(crate) use cloud::parse;
pub use cloud::read_ply_cloud;
pub use mesh::{PlyMesh, parse_ply_mesh, read_ply_mesh};
pub use write::write_ply_cloud;

/// The counts in the header of a mesh. Faces are `None` for triangle strips.
pub(crate) type Counts = (u64, Option<u64>);

/// The counts of a PLY with faces, by its first bytes; `None` for other files and for clouds: many writers give those an
/// element of no faces, so that without faces it takes a lack of vertices, too, to be a mesh (an empty one).
pub(crate) fn mesh_counts(head: &[u8], path: &Path) -> Option<Counts> {
    let header = header::parse(head, path).ok()?;
    let count = |name: &str| {
        let mut of_name = header.elements.iter().filter(|e| e.name == name);
        of_name.next().map(|e| e.count)
    };
    let vertices = count("vertex")?;
    match (count("face"), count("tristrips")) {
        (faces, Some(strips)) if strips > 0 || faces.is_some_and(|n| n > 0) => Some((vertices, None)),
        (Some(faces), _) if faces > 0 || vertices == 0 => Some((vertices, Some(faces))),
        _ => None,
    }
}

/// Whether a file is a PLY with faces: a mesh.
pub(crate) fn has_faces(path: &Path) -> bool {
    let head = crate::bytes::open(path).and_then(|mut input| input.read_up_to(64 << 10));
    head.is_ok_and(|head| mesh_counts(&head, path).is_some())
}
