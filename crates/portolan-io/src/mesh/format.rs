//! The format of a mesh file and its counts, by its first bytes.

use std::path::Path;

use crate::bytes::{Input, fields, open, parse_f64};
use crate::{Result, ply};

/// How much of a file is read (unpacked bytes).
const HEAD: u64 = 64 << 10;

/// The formats of meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MeshFormat {
    /// PLY with faces.
    Ply,
    /// Binary glTF 2.0.
    Glb,
    /// Wavefront OBJ.
    Obj,
}

impl MeshFormat {
    /// The format in words.
    pub fn label(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Glb => "GLB (binary glTF)",
            Self::Obj => "OBJ",
        }
    }
}

/// The counts in the header of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshCounts {
    /// Vertices.
    pub vertices: u64,
    /// Faces: triangles in what portolan writes, any polygons in files of others. `None` for triangle strips, whose number
    /// differs from that of the triangles.
    pub faces: Option<u64>,
}

/// How many vertices and faces a mesh has, by its header alone. `None` for files that are not PLY meshes:
/// OBJ has no header, and that of GLB is not read.
///
/// # Errors
/// [`crate::IoError`] where the file cannot be opened or read.
pub fn mesh_counts(path: impl AsRef<Path>) -> Result<Option<MeshCounts>> {
    parse_mesh_counts(&mut open(path)?)
}

/// [`mesh_counts`] from any input, of which it reads at most 64 KiB.
///
/// # Errors
/// [`crate::IoError`] where the input cannot be read.
pub fn parse_mesh_counts(input: &mut Input) -> Result<Option<MeshCounts>> {
    let head = input.read_up_to(HEAD)?;
    Ok(ply::mesh_counts(&head, input.path()).map(|(vertices, faces)| MeshCounts { vertices, faces }))
}

/// The format of a mesh by its first bytes; `None` for other files.
pub(crate) fn mesh_format(path: &Path, head: &[u8]) -> Option<MeshFormat> {
    if head.starts_with(b"glTF") {
        return Some(MeshFormat::Glb);
    }
    if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
        return ply::mesh_counts(head, path).map(|_| MeshFormat::Ply);
    }
    is_obj(head).then_some(MeshFormat::Obj)
}

/// First words of lines of OBJ files.
const OBJ_WORDS: [&[u8]; 11] =
    [b"v", b"vn", b"vt", b"vp", b"f", b"l", b"g", b"o", b"s", b"mtllib", b"usemtl"];

/// Whether all lines start with words of OBJ, and one of them is a vertex of three numbers at least.
fn is_obj(head: &[u8]) -> bool {
    // The last line may be cut off.
    let whole = head.iter().rposition(|b| *b == b'\n').map_or(&[][..], |end| &head[..end]);
    let mut has_vertex = false;
    for line in whole.split(|b| *b == b'\n') {
        let mut words = fields(line);
        let Some(first) = words.next().filter(|w| !w.starts_with(b"#")) else { continue };
        if !OBJ_WORDS.contains(&first) {
            return false;
        }
        has_vertex |= first == b"v" && words.take(3).filter(|w| parse_f64(w).is_some()).count() == 3;
    }
    has_vertex
}

#[cfg(test)]
mod tests {
    use super::super::testing::tetrahedron;
    use super::super::{write_glb, write_obj, write_ply_mesh};
    use super::*;
    use crate::testing::{bad_bytes, real_data, temporary};
    use portolan::surface::Mesh;

    #[test]
    fn headers_tell_how_much_there_is() {
        let (folder, path) = temporary("mesh");
        let mesh = tetrahedron([0.0; 3]);
        write_ply_mesh(&path, &mesh).unwrap();
        assert_eq!(mesh_counts(&path).unwrap(), Some(MeshCounts { vertices: 4, faces: Some(4) }));
        write_ply_mesh(&path, &Mesh::default()).unwrap();
        assert_eq!(mesh_counts(&path).unwrap(), Some(MeshCounts { vertices: 0, faces: Some(0) }));
        write_glb(&path, &mesh).unwrap();
        assert_eq!(mesh_counts(&path).unwrap(), None);
        write_obj(&path, &mesh).unwrap();
        assert_eq!(mesh_counts(&path).unwrap(), None);
        assert!(mesh_counts(folder.path().join("missing")).is_err());
        let strips = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nelement tristrips 1\n\
                      property list int int vertex_indices\nend_header\n";
        std::fs::write(&path, strips).unwrap();
        assert_eq!(mesh_counts(&path).unwrap(), Some(MeshCounts { vertices: 3, faces: None }));
        let Some(path) = real_data("rangescan_stanford_bunny/reconstruction/bun_zipper.ply") else { return };
        assert_eq!(mesh_counts(path).unwrap(), Some(MeshCounts { vertices: 35_947, faces: Some(69_451) }));
    }

    #[test]
    fn lines_of_obj_are_told_from_other_text() {
        let format = |text: &str| mesh_format("a".as_ref(), text.as_bytes());
        let obj = Some(MeshFormat::Obj);
        assert_eq!(format("# made by hand\r\n\r\nmtllib a.mtl\r\no a b\r\nv 1 2 3\r\nf 1 2 3\r\n"), obj);
        assert_eq!(format("v 1 2 3 0.5 0.5 0.5\nvn 0 0 1\nand what was cut off"), obj);
        for text in ["", "v 1 2 3", "v 1 2\n", "v a b c\n", "f 1 2 3\n", "v 1 2 3\n1 2 3\n", "# v 1 2 3\n"] {
            assert_eq!(format(text), None, "{text}");
        }
        for good in
            ["ply\nformat ascii 1.0\nelement vertex 0\nelement face 0\nend_header\n", "v 1 2 3\nf 1 1 1\n"]
        {
            for bytes in bad_bytes(good.as_bytes(), 8, 1000) {
                let _ = mesh_format("a".as_ref(), &bytes);
            }
        }
    }
}
