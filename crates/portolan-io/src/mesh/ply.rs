//! Meshes as PLY.

use std::io::{self, Write};
use std::path::Path;

use portolan::surface::Mesh;

use super::check;
use crate::{IoError, Result, write_atomic};

/// World coordinates beyond this (meters) are written as `double`: up to it an f32 is no coarser than 0.06 mm.
pub(crate) const NEAR: f64 = 1000.0;

/// Writes a mesh as binary little-endian PLY: `x y z`, then `nx ny nz` and `red green blue` where the mesh has them,
/// faces as `list uchar uint vertex_indices`.
///
/// Coordinates are the world's (meters). They are `float` where all of the mesh lies within 1 km of the world's zero,
/// else `double`, so that a mesh at UTM coordinates loses nothing.
///
/// # Errors
/// [`IoError::Unwritable`] where the mesh's arrays do not fit together or a coordinate is not finite, else as
/// [`write_atomic`].
pub fn write_ply_mesh(path: impl AsRef<Path>, mesh: &Mesh) -> Result<()> {
    let path = path.as_ref();
    check(path, mesh)?;
    write_atomic(path, |w| write_to(w, mesh))
}

/// The same as bytes in memory.
///
/// # Errors
/// [`IoError::Unwritable`] as [`write_ply_mesh`].
pub fn ply_mesh_to_bytes(mesh: &Mesh) -> Result<Vec<u8>> {
    let name = Path::new("mesh.ply");
    check(name, mesh)?;
    let mut bytes = Vec::new();
    write_to(&mut bytes, mesh).map_err(|e| IoError::os(name, "write it", e))?;
    Ok(bytes)
}

fn write_to(w: &mut impl Write, mesh: &Mesh) -> io::Result<()> {
    let bounds = mesh.bounds();
    let far = bounds.min.iter().chain(&bounds.max).any(|c| c.abs() > NEAR) && !mesh.vertices.is_empty();
    let kind = if far { "double" } else { "float" };
    write!(w, "ply\nformat binary_little_endian 1.0\ncomment written by portolan, metres\n")?;
    writeln!(w, "element vertex {}", mesh.vertices.len())?;
    ["x", "y", "z"].iter().try_for_each(|axis| writeln!(w, "property {kind} {axis}"))?;
    if !mesh.normals.is_empty() {
        ["nx", "ny", "nz"].iter().try_for_each(|axis| writeln!(w, "property float {axis}"))?;
    }
    if !mesh.colors.is_empty() {
        ["red", "green", "blue"].iter().try_for_each(|c| writeln!(w, "property uchar {c}"))?;
    }
    writeln!(w, "element face {}", mesh.triangles.len())?;
    write!(w, "property list uchar uint vertex_indices\nend_header\n")?;
    for i in 0..mesh.vertices.len() {
        let p = mesh.vertex_world(i);
        if far {
            p.iter().try_for_each(|c| w.write_all(&c.to_le_bytes()))?;
        } else {
            p.iter().try_for_each(|c| w.write_all(&(*c as f32).to_le_bytes()))?;
        }
        if let Some(normal) = mesh.normals.get(i) {
            normal.iter().try_for_each(|c| w.write_all(&c.to_le_bytes()))?;
        }
        if let Some(color) = mesh.colors.get(i) {
            w.write_all(color)?;
        }
    }
    for t in &mesh.triangles {
        let mut face = [3; 13];
        for (k, v) in t.iter().enumerate() {
            face[1 + 4 * k..][..4].copy_from_slice(&v.to_le_bytes());
        }
        w.write_all(&face)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Bytes, tetrahedron};
    use super::*;

    fn written(mesh: &Mesh) -> (String, Vec<u8>) {
        let bytes = crate::testing::written(|path| write_ply_mesh(path, mesh));
        assert_eq!(bytes, ply_mesh_to_bytes(mesh).unwrap());
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        (String::from_utf8(bytes[..end].to_vec()).unwrap(), bytes[end..].to_vec())
    }

    #[test]
    fn near_zero_vertices_are_floats() {
        let mesh = tetrahedron([10.0, 0.0, -1.0]);
        let (header, body) = written(&mesh);
        assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"));
        assert!(
            header.contains("element vertex 4\nproperty float x\n") && header.contains("element face 4\n")
        );
        assert_eq!(body.len(), 4 * (12 + 12 + 3) + 4 * 13);
        let mut bytes = Bytes(&body);
        for i in 0..4 {
            assert_eq!(bytes.f32s().map(f64::from), mesh.vertex_world(i));
            assert_eq!(bytes.f32s(), mesh.normals[i]);
            assert_eq!(bytes.take(), mesh.colors[i]);
        }
        for t in &mesh.triangles {
            assert_eq!(bytes.take(), [3u8]);
            assert_eq!([bytes.u32(), bytes.u32(), bytes.u32()], *t);
        }
        assert!(bytes.0.is_empty());
    }

    #[test]
    fn far_from_zero_they_are_doubles() {
        let mut mesh = tetrahedron([500_000.0, 4_000_000.0, 0.0]);
        mesh.normals.clear();
        mesh.colors.clear();
        let (header, body) = written(&mesh);
        assert!(header.contains("property double z\nelement face 4\n"));
        let mut bytes = Bytes(&body);
        for i in 0..4 {
            assert_eq!([0; 3].map(|_| f64::from_le_bytes(bytes.take())), mesh.vertex_world(i));
        }
    }

    #[test]
    fn an_empty_mesh_is_a_file() {
        let (header, body) = written(&Mesh::default());
        assert!(header.contains("element vertex 0\n") && body.is_empty());
    }
}
