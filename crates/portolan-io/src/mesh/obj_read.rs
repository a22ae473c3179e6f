//! Wavefront OBJ: corners and faces; what else there is is passed over.

use crate::bytes::{Input, Lines, fields, parse_f64};
use crate::error::shown;
use crate::ply::PlyMesh;
use crate::{IoError, Result};

/// The most vertices and corners of a file.
const MOST: usize = 1 << 30;

/// Reads a mesh: `v x y z [r g b]` and `f` of any number of corners (`1`, `1/2`, `1//3`, `1/2/3`, or counted backwards from
/// the last vertex before the line). Faces are fans about their first corner.
///
/// # Errors
/// [`IoError::Text`] for a wrong number, and for a corner that is not there.
pub(super) fn parse(input: Input) -> Result<PlyMesh> {
    let mut lines = Lines::of(input);
    let path = lines.path().to_owned();
    let mut mesh = PlyMesh::default();
    // Corners may come behind the faces that name them.
    let (mut faces, mut corners) = (Vec::new(), Vec::<i64>::new());
    while let Some((number, line)) = lines.next_numbered()? {
        let mut words = fields(line);
        match words.next() {
            Some(b"v") => {
                let mut values = [0.0; 6];
                let mut count = 0;
                for word in words.take(6) {
                    values[count] = parse_f64(word).ok_or_else(|| {
                        IoError::text(&path, number, "a coordinate", shown(word), "write v x y z")
                    })?;
                    count += 1;
                }
                if count < 3 {
                    let advice = "write v x y z";
                    return Err(IoError::text(&path, number, "a vertex", shown(line), advice));
                }
                IoError::unless_full(&path, number, mesh.vertices.len(), MOST, "vertices", "mesh")?;
                mesh.vertices.push([values[0], values[1], values[2]]);
                if count == 6 {
                    let byte = |v: f64| (255.0 * v).round() as u8;
                    mesh.colors.push([byte(values[3]), byte(values[4]), byte(values[5])]);
                }
            }
            Some(b"f") => {
                let first = corners.len();
                IoError::unless_full(&path, number, first, MOST, "corners", "mesh")?;
                for word in words {
                    let index = word.split(|b| *b == b'/').next().unwrap_or_default();
                    let index = std::str::from_utf8(index).ok().and_then(|w| w.parse::<i64>().ok());
                    let known = mesh.vertices.len() as i64;
                    let corner = match index {
                        Some(i @ 1..) => i - 1,
                        Some(i) if i < 0 && i >= -known => known + i,
                        _ => {
                            let advice = "write the number of a vertex, from 1";
                            return Err(IoError::text(&path, number, "a corner", shown(word), advice));
                        }
                    };
                    corners.push(corner);
                }
                faces.push((number, first));
            }
            _ => {}
        }
    }
    let vertices = mesh.vertices.len();
    for (i, &(number, first)) in faces.iter().enumerate() {
        let end = faces.get(i + 1).map_or(corners.len(), |next| next.1);
        let of_face = &corners[first..end];
        if let Some(corner) = of_face.iter().find(|c| **c >= vertices as i64) {
            let advice = format!("the file has {vertices} vertices");
            return Err(IoError::text(&path, number, "a corner", corner + 1, advice));
        }
        let of_face: Vec<u32> = of_face.iter().map(|c| *c as u32).collect();
        mesh.add_polygon(&of_face);
    }
    if mesh.colors.len() != vertices {
        mesh.colors.clear();
    }
    if vertices == 0 {
        let advice = "give a file with vertices: v x y z";
        return Err(IoError::text(&path, lines.number(), "the number of vertices", "0", advice));
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::super::testing::tetrahedron;
    use super::super::write_obj;
    use super::*;
    use crate::testing::{no_panic, says, written};

    fn read(text: impl Into<Vec<u8>>) -> Result<PlyMesh> {
        parse(Input::from_reader(std::io::Cursor::new(text.into()), "a.obj".as_ref())?)
    }

    #[test]
    fn faces_of_every_notation() {
        let corners = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\n";
        for face in
            ["f 1 2 3 4", "f 1/9 2/9 3/9 4/9", "f 1//1 2//1 3//1 4//1", "f -4 -3 -2 -1", "g a\nf 1/2/3 2 3 4"]
        {
            let mesh = read(format!("{corners}{face}\n")).unwrap();
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{face}");
            assert_eq!((mesh.vertices[2], mesh.colors[1]), ([1.0, 1.0, 0.0], [0, 255, 0]));
        }
        assert_eq!(read(format!("f 1 2 3\n{corners}")).unwrap().triangles, [[0, 1, 2]]);
        assert_eq!(read(format!("{corners}f 1 2\n")).unwrap().refused_faces, 1);
    }

    #[test]
    fn what_is_written_comes_back() {
        let mesh = tetrahedron([500_000.0, 0.0, 7.0]);
        let back = read(written(|path| write_obj(path, &mesh))).unwrap();
        assert_eq!((back.triangles, back.vertices.len()), (mesh.triangles.clone(), 4));
        for i in 0..4 {
            let want = mesh.vertex_world(i);
            assert!((0..3).all(|k| (back.vertices[i][k] - want[k]).abs() < 1e-4));
        }
    }

    #[test]
    fn errors_name_the_line_and_no_bytes_make_it_panic() {
        for (text, part) in [
            ("v 1 2\n", "a.obj: line 1: a vertex is \"v 1 2\"; write v x y z"),
            ("v 1 2 x\n", "line 1: a coordinate is \"x\""),
            ("v 1 2 3\nf 1 1 2\n", "line 2: a corner is 2; the file has 1 vertices"),
            ("v 1 2 3\nf 1 1 0\n", "line 2: a corner is \"0\""),
            ("v 1 2 3\nf 1 1 -2\n", "line 2: a corner is \"-2\""),
            ("# nothing\n", "the number of vertices is 0"),
        ] {
            says(read(text), part);
        }
        no_panic("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf -1 -2 -3\n", 3, 2000, read);
    }
}
