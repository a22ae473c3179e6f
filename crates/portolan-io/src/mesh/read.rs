//! Meshes of any format as one kind of data.

use std::io::BufRead;
use std::path::Path;

use super::format::mesh_format;
use super::{MeshFormat, glb_read, obj_read};
use crate::bytes::{Input, open};
use crate::ply::PlyMesh;
use crate::points::most_bytes;
use crate::{IoError, Result, ply};

/// Reads a mesh of triangles: PLY, OBJ or GLB, plain or packed by gzip or bzip2; the content decides which.
///
/// Coordinates are those of the file, but for GLB, whose y axis points up: they are turned back to z up, and moved by the
/// nodes and by the origin that portolan writes beside them.
///
/// # Errors
/// Those of the format's reader; [`IoError::Binary`] for any other file, also for a PLY without faces.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<PlyMesh> {
    let path = path.as_ref();
    let mut input = open(path)?;
    // A failure to read will come again, with its place.
    let head = input.fill_buf().map(<[u8]>::to_vec).unwrap_or_default();
    let by_name = || {
        let name = path.to_string_lossy().to_ascii_lowercase();
        let name = [".gz", ".bz2"].iter().find_map(|e| name.strip_suffix(e)).unwrap_or(&name).to_owned();
        name.ends_with(".obj").then_some(MeshFormat::Obj)
    };
    let is_ply = head.starts_with(b"ply\n") || head.starts_with(b"ply\r");
    let format = if is_ply { Some(MeshFormat::Ply) } else { mesh_format(path, &head).or_else(by_name) };
    parse_mesh(input, format, &head)
}

fn parse_mesh(mut input: Input, format: Option<MeshFormat>, head: &[u8]) -> Result<PlyMesh> {
    match format {
        Some(MeshFormat::Ply) => ply::parse_ply_mesh(input),
        Some(MeshFormat::Obj) => obj_read::parse(input),
        Some(MeshFormat::Glb) => {
            let bytes = input.read_all(most_bytes(&input))?;
            glb_read::parse(&bytes, input.path())
        }
        None => {
            let value = crate::error::shown(&head[..head.len().min(16)]);
            let advice = "give a mesh as PLY, OBJ or GLB";
            Err(IoError::binary(input.path(), 0, "the start of the file", value, advice))
        }
    }
}

/// The area of the triangles of a mesh (m²).
pub fn mesh_area(mesh: &PlyMesh) -> f64 {
    let corner = |i: u32| mesh.vertices[i as usize];
    let one = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        let (u, v): ([f64; 3], [f64; 3]) =
            (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - a[k]));
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        0.5 * n.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    mesh.triangles.iter().map(one).sum()
}
