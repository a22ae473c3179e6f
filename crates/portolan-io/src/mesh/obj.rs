//! Meshes as Wavefront OBJ.

use std::io::{self, Write};
use std::path::Path;

use portolan::surface::Mesh;

use super::check;
use crate::{Result, write_atomic};

/// Writes a mesh as OBJ text: `v x y z`, with `r g b` in `[0, 1]` after it where the mesh has colors (which most
/// readers understand), `vn` where it has normals, `f` counted from 1.
///
/// Coordinates are the world's (meters), with as many digits as an f32 needs.
///
/// # Errors
/// As [`write_ply_mesh`](super::write_ply_mesh).
pub fn write_obj(path: impl AsRef<Path>, mesh: &Mesh) -> Result<()> {
    let path = path.as_ref();
    check(path, mesh)?;
    write_atomic(path, |w| write_to(w, mesh))
}

fn write_to(w: &mut impl Write, mesh: &Mesh) -> io::Result<()> {
    writeln!(w, "# written by portolan, metres")?;
    // Near its origin a vertex has the digits of an f32; the origin adds those in front.
    let digits = |k: usize| if mesh.origin[k] == 0.0 { None } else { Some(7) };
    for i in 0..mesh.vertices.len() {
        write!(w, "v")?;
        for (k, world) in mesh.vertex_world(i).iter().enumerate() {
            match digits(k) {
                Some(digits) => write!(w, " {world:.digits$}")?,
                None => write!(w, " {}", mesh.vertices[i][k])?,
            }
        }
        if let Some(color) = mesh.colors.get(i) {
            color.iter().try_for_each(|c| write!(w, " {:.4}", f32::from(*c) / 255.0))?;
        }
        writeln!(w)?;
    }
    for [x, y, z] in &mesh.normals {
        writeln!(w, "vn {x:.5} {y:.5} {z:.5}")?;
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| u64::from(v) + 1);
        if mesh.normals.is_empty() {
            writeln!(w, "f {a} {b} {c}")?;
        } else {
            writeln!(w, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::testing::tetrahedron;
    use super::*;

    fn written(mesh: &Mesh) -> String {
        String::from_utf8(crate::testing::written(|path| write_obj(path, mesh))).unwrap()
    }

    #[test]
    fn lines_are_counted_from_one() {
        let mesh = tetrahedron([0.0, 4_000_000.0, 0.0]);
        let text = written(&mesh);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 1 + 4 + 4 + 4);
        assert_eq!(lines[1], "v 0.5 4000000.2500000 0.125 1.0000 0.0000 0.0000");
        assert_eq!(lines[5], "vn 0.00000 0.00000 -1.00000");
        assert_eq!(lines[12], "f 2//2 3//3 4//4");
        let plain = written(&Mesh { normals: vec![], colors: vec![], ..mesh });
        assert!(plain.contains("v 1.5 4000000.2500000 0.125\n") && plain.ends_with("f 2 3 4\n"));
    }
}
