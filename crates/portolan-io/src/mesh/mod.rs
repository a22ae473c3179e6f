//! Triangle meshes: writers, readers, and the recognition of their files.

mod format;
mod glb;
mod glb_read;
mod obj;
mod obj_read;
mod ply;
mod read;

pub(crate) use format::mesh_format;
pub use format::{MeshCounts, MeshFormat, mesh_counts, parse_mesh_counts};
pub use glb::{glb_to_bytes, write_glb};
pub use obj::write_obj;
pub(crate) use ply::NEAR;
pub use ply::{ply_mesh_to_bytes, write_ply_mesh};
pub use read::{mesh_area, read_mesh};

use std::path::Path;

use portolan::surface::Mesh;

use crate::{IoError, Result};

/// Refuses a mesh whose arrays do not fit together, or with a coordinate that is not finite.
pub(crate) fn check(path: &Path, mesh: &Mesh) -> Result<()> {
    let vertices = mesh.vertices.len();
    let refuse =
        |field: &str, value: String, advice: &str| Err(IoError::unwritable(path, field, value, advice));
    for (list, length) in [("normals", mesh.normals.len()), ("colors", mesh.colors.len())] {
        if length != 0 && length != vertices {
            let field = format!("the number of {list}");
            return refuse(&field, length.to_string(), "give one per vertex, or an empty list");
        }
    }
    if let Some(t) = mesh.triangles.iter().find(|t| t.iter().any(|&v| v as usize >= vertices)) {
        return refuse("a triangle", format!("{t:?}"), "use indices of existing vertices");
    }
    let finite = |v: &&[f32; 3]| !v.iter().all(|c| c.is_finite());
    if let Some(v) = mesh.vertices.iter().chain(&mesh.normals).find(finite) {
        return refuse("a vertex or normal", format!("{v:?}"), "give finite coordinates");
    }
    if !mesh.origin.iter().all(|c| c.is_finite()) {
        return refuse("the origin", format!("{:?}", mesh.origin), "give finite coordinates");
    }
    Ok(())
}

#[cfg(test)]
mod testing {
    use portolan::surface::Mesh;

    /// A tetrahedron with all attributes.
    pub(super) fn tetrahedron(origin: [f64; 3]) -> Mesh {
        Mesh {
            origin,
            vertices: vec![[0.5, 0.25, 0.125], [1.5, 0.25, 0.125], [0.5, 1.25, 0.125], [0.5, 0.25, 3.125]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            normals: vec![[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            colors: vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [7, 8, 9]],
        }
    }

    /// Reads numbers one after the other from little-endian bytes.
    pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

    impl Bytes<'_> {
        pub(super) fn take<const N: usize>(&mut self) -> [u8; N] {
            let (head, rest) = self.0.split_first_chunk::<N>().unwrap();
            self.0 = rest;
            *head
        }

        pub(super) fn f32s<const N: usize>(&mut self) -> [f32; N] {
            std::array::from_fn(|_| f32::from_le_bytes(self.take()))
        }

        pub(super) fn u32(&mut self) -> u32 {
            u32::from_le_bytes(self.take())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::testing::tetrahedron;
    use super::*;
    use crate::testing::temporary;

    #[test]
    fn what_does_not_fit_together_is_refused() {
        let (_folder, path) = temporary("mesh");
        let refused = |mesh: &Mesh| {
            for written in [write_ply_mesh(&path, mesh), write_glb(&path, mesh), write_obj(&path, mesh)] {
                assert!(matches!(written, Err(IoError::Unwritable { .. })));
            }
            assert!(!path.exists());
        };
        let good = tetrahedron([0.0; 3]);
        refused(&Mesh { triangles: vec![[0, 1, 4]], ..good.clone() });
        refused(&Mesh { colors: vec![[0; 3]], ..good.clone() });
        refused(&Mesh { normals: vec![[0.0; 3]], ..good.clone() });
        refused(&Mesh { origin: [f64::NAN; 3], ..good.clone() });
        let mut bad = good;
        bad.vertices[2][1] = f32::INFINITY;
        refused(&bad);
    }
}
