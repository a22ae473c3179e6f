//! Meshes as a reference to compare with.

use std::path::Path;

use super::body::Body;
use super::header::{self, Element};
use crate::bytes::{Input, open};
use crate::points::{channel, most_bytes};
use crate::{IoError, Result};

/// A mesh of triangles. `normals` and `colors` have one entry per vertex, or are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlyMesh {
    /// Corners (meters), as the file has them.
    pub vertices: Vec<[f64; 3]>,
    /// Corners of each triangle; polygons are fans about their first corner, strips are taken apart.
    pub triangles: Vec<[u32; 3]>,
    /// Normals of vertices, not made unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Red, green, blue of vertices.
    pub colors: Vec<[u8; 3]>,
    /// Faces that were left out: fewer than three corners, or a corner that is not finite. Such corners stay in `vertices`,
    /// so that indices keep their meaning.
    pub refused_faces: u64,
}

/// Reads a mesh. A file without faces is a mesh without triangles.
///
/// # Errors
/// [`IoError::Text`] for a wrong header or text, [`IoError::Binary`] for wrong binary data, both for a face whose corners are
/// not there.
pub fn read_ply_mesh(path: impl AsRef<Path>) -> Result<PlyMesh> {
    parse_ply_mesh(open(path)?)
}

/// [`read_ply_mesh`] from any input.
///
/// # Errors
/// As [`read_ply_mesh`].
pub fn parse_ply_mesh(mut input: Input) -> Result<PlyMesh> {
    let bytes = input.read_all(most_bytes(&input))?;
    parse_bytes(&bytes, input.path())
}

pub(super) fn parse_bytes(bytes: &[u8], path: &Path) -> Result<PlyMesh> {
    let header = header::parse(bytes, path)?;
    let mut mesh = PlyMesh::default();
    // Faces may come before the vertices that they name: then the file is gone through twice.
    let place = |names: &[&str]| header.elements.iter().position(|e| names.contains(&e.name.as_str()));
    let vertices = place(&["vertex"]);
    let is_twice = place(&["face", "tristrips"]) < vertices && place(&["face", "tristrips"]).is_some();
    if let (true, Some(last)) = (is_twice, vertices) {
        let mut body = Body::of(&header, bytes, path);
        for element in &header.elements[..last] {
            skip(&mut body, element)?;
        }
        read_vertices(&mut body, &header.elements[last], &mut mesh)?;
    }
    let mut body = Body::of(&header, bytes, path);
    for (i, element) in header.elements.iter().enumerate() {
        match element.name.as_str() {
            "vertex" if Some(i) == vertices && !is_twice => read_vertices(&mut body, element, &mut mesh)?,
            "face" => {
                for _ in 0..element.count {
                    body.row(element, element.indices())?;
                    let corners = corners(&body, mesh.vertices.len())?;
                    mesh.add_polygon(&corners);
                }
            }
            "tristrips" => {
                for _ in 0..element.count {
                    body.row(element, element.indices())?;
                    let strips = std::mem::take(&mut body.list);
                    for strip in strips.split(|v| *v == -1.0) {
                        body.list = strip.to_vec();
                        let corners = corners(&body, mesh.vertices.len())?;
                        mesh.add_strip(&corners);
                    }
                }
            }
            _ => skip(&mut body, element)?,
        }
    }
    body.check_end()?;
    if mesh.vertices.is_empty() {
        let advice = "give a file with vertices x, y, z";
        return Err(IoError::text(path, 1, "the number of vertices", "0", advice));
    }
    Ok(mesh)
}

fn skip(body: &mut Body, element: &Element) -> Result<()> {
    for _ in 0..element.count {
        body.row(element, None)?;
    }
    Ok(())
}

fn read_vertices(body: &mut Body, element: &Element, mesh: &mut PlyMesh) -> Result<()> {
    let Some(position) = element.three([&["x"], &["y"], &["z"]]) else {
        let (field, value) = ("the properties of vertices", "without x, y, z");
        return Err(body.error(field, value, "give a file with points"));
    };
    let normal = element.three([&["nx"], &["ny"], &["nz"]]);
    let color =
        element.three([&["red", "diffuse_red"], &["green", "diffuse_green"], &["blue", "diffuse_blue"]]);
    for _ in 0..element.count {
        body.row(element, None)?;
        mesh.vertices.push(position.map(|(k, _)| body.values[k]));
        if let Some(n) = normal {
            mesh.normals.push(n.map(|(k, _)| body.values[k] as f32));
        }
        if let Some(c) = color {
            mesh.colors.push(c.map(|(k, scalar)| channel(body.values[k], scalar)));
        }
    }
    Ok(())
}

/// The corners that the last row names.
fn corners(body: &Body, vertices: usize) -> Result<Vec<u32>> {
    let corner = |&v: &f64| {
        let there = v >= 0.0 && v < vertices as f64 && v.fract() == 0.0;
        there
            .then_some(v as u32)
            .ok_or_else(|| body.error("a corner of a face", v, format!("the file has {vertices} vertices")))
    };
    body.list.iter().map(corner).collect()
}

impl PlyMesh {
    pub(crate) fn add_polygon(&mut self, corners: &[u32]) {
        let finite = |c: &u32| self.vertices[*c as usize].iter().all(|v| v.is_finite());
        match corners {
            [first, rest @ ..] if rest.len() >= 2 && corners.iter().all(finite) => {
                self.triangles.extend(rest.windows(2).map(|w| [*first, w[0], w[1]]));
            }
            _ => self.refused_faces += 1,
        }
    }

    /// Every corner after the second makes a triangle with the two before it, turned about each time. Triangles with equal
    /// corners only turn the strip.
    fn add_strip(&mut self, corners: &[u32]) {
        for (i, w) in corners.windows(3).enumerate() {
            let [a, b, c] = if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
            if a != b && b != c && c != a {
                self.add_polygon(&[a, b, c]);
            }
        }
    }
}
