//! Binary glTF 2.0: the triangles of all nodes of the scene.

use std::path::Path;

use serde_json::Value;

use crate::bytes::{Endian, Scalar, u32_at};
use crate::ply::PlyMesh;
use crate::{IoError, Result};

/// Nodes below nodes; more are a circle.
const DEEPEST: usize = 64;
/// Vertices and triangles for each byte of data: many nodes may show one mesh, but more of them are a trap.
const MOST_A_BYTE: usize = 64;
/// Kinds of chunks.
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;
/// The mode of primitives of triangles.
const TRIANGLES: u64 = 4;

/// Rows of a 3x4 matrix.
type Affine = [[f64; 4]; 3];

const UNMOVED: Affine = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Reads a mesh, z up.
///
/// # Errors
/// [`IoError::Binary`] for wrong bytes, [`IoError::Layout`] for a document that names what is not there, is compressed, or
/// keeps its arrays in other files.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<PlyMesh> {
    let (document, data) = chunks(bytes, path)?;
    let document: Value = serde_json::from_slice(document).map_err(|e| {
        let advice = "the file is damaged: copy or export it again";
        IoError::layout(path, "the JSON chunk", crate::error::shown(e.to_string()), advice)
    })?;
    if let Some(name) = document["extensionsRequired"].as_array().and_then(|all| all.first()) {
        let name = name.as_str().unwrap_or("unknown").to_owned();
        let quantized = name == "KHR_mesh_quantization";
        if !quantized {
            let advice = "export the mesh without extensions (uncompressed)";
            return Err(IoError::layout(path, "a required extension", name, advice));
        }
    }
    let mut reader = Reader { document: &document, data, path, mesh: PlyMesh::default(), visited: 0 };
    let scene = document["scene"].as_u64().unwrap_or(0) as usize;
    let roots = &document["scenes"][scene]["nodes"];
    for root in roots.as_array().into_iter().flatten() {
        reader.node(root, &UNMOVED, 0)?;
    }
    // y up to z up: x, y, z of the file are x, -z, y.
    let mut mesh = reader.mesh;
    mesh.vertices.iter_mut().for_each(|v| *v = [v[0], -v[2], v[1]]);
    if mesh.colors.len() != mesh.vertices.len() {
        mesh.colors.clear();
    }
    Ok(mesh)
}

/// The JSON and the binary chunk.
fn chunks<'a>(bytes: &'a [u8], path: &Path) -> Result<(&'a [u8], &'a [u8])> {
    let wrong = |at: usize, field: &str, value: String| {
        let advice = "give a whole GLB file (glTF 2.0)";
        Err(IoError::binary(path, at as u64, field, value, advice))
    };
    if bytes.len() < 20 || !bytes.starts_with(b"glTF") {
        return wrong(0, "the header", format!("{} bytes", bytes.len()));
    }
    if u32_at(bytes, 4) != 2 {
        return wrong(4, "the version", u32_at(bytes, 4).to_string());
    }
    let (mut at, mut document, mut data) = (12, None, &[][..]);
    while at + 8 <= bytes.len() {
        let (length, kind) = (u32_at(bytes, at) as usize, u32_at(bytes, at + 4));
        let Some(content) = bytes.get(at + 8..).and_then(|rest| rest.get(..length)) else {
            return wrong(at, "the length of a chunk", format!("{length} of {}", bytes.len() - at - 8));
        };
        match kind {
            JSON => document = Some(content),
            BIN => data = content,
            _ => {}
        }
        at += 8 + length;
    }
    match document {
        Some(document) => Ok((document, data)),
        None => wrong(12, "the JSON chunk", "missing".into()),
    }
}

struct Reader<'a> {
    document: &'a Value,
    data: &'a [u8],
    path: &'a Path,
    mesh: PlyMesh,
    visited: usize,
}

impl Reader<'_> {
    /// A node's mesh and what hangs below it. The origin that portolan writes beside an `f32`'s place (z up, meters) is
    /// taken for that.
    fn node(&mut self, index: &Value, parent: &Affine, depth: usize) -> Result<()> {
        self.visited += 1;
        let document = self.document;
        // Each has one parent.
        let nodes = document["nodes"].as_array().map_or(0, Vec::len);
        if depth > DEEPEST || self.visited > nodes {
            return Err(self.wrong("the nodes", "in a circle, or too many"));
        }
        let node = at(&document["nodes"], index).ok_or_else(|| self.wrong("a node", "missing"))?;
        let mut own = affine(node);
        let given = numbers::<3>(&node["extras"]["origin"]);
        // The exact place instead of the rounded one: z up to y up.
        let exact = given.filter(|o| {
            let rounded = [o[0], o[2], -o[1]];
            (0..3).all(|k| (own[k][3] - rounded[k]).abs() <= 1e-6 * rounded[k].abs() + 1e-6)
        });
        if let Some(o) = exact {
            let place = [o[0], o[2], -o[1]];
            (0..3).for_each(|k| own[k][3] = place[k]);
        }
        let world = product(parent, &own);
        if let Some(mesh) = at(&document["meshes"], &node["mesh"]) {
            for primitive in mesh["primitives"].as_array().into_iter().flatten() {
                self.primitive(primitive, &world)?;
            }
        }
        for child in node["children"].as_array().into_iter().flatten() {
            self.node(child, &world, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Value, world: &Affine) -> Result<()> {
        if primitive["mode"].as_u64().unwrap_or(TRIANGLES) != TRIANGLES {
            // Points and lines are no surface; strips and fans are not written by anybody.
            self.mesh.refused_faces += 1;
            return Ok(());
        }
        let first = self.mesh.vertices.len();
        let positions = self.accessor(&primitive["attributes"]["POSITION"], "VEC3")?;
        let count = positions.len() / 3;
        let most = (MOST_A_BYTE * self.data.len()).min(u32::MAX as usize);
        if first + count > most || self.mesh.triangles.len() > most {
            return Err(self.wrong("the number of vertices", format!("more than {most}")));
        }
        for p in positions.chunks_exact(3) {
            self.mesh
                .vertices
                .push(std::array::from_fn(|k| (0..3).map(|c| world[k][c] * p[c]).sum::<f64>() + world[k][3]));
        }
        let indices = match &primitive["indices"] {
            Value::Null => (0..count).map(|i| i as f64).collect(),
            index => self.accessor(index, "SCALAR")?,
        };
        for corners in indices.chunks_exact(3) {
            if let Some(wrong) = corners.iter().find(|c| !(**c < count as f64)) {
                return Err(self.wrong("a corner of a face", format!("{wrong} of {count}")));
            }
            self.mesh.add_polygon(&[0, 1, 2].map(|k| (first + corners[k] as usize) as u32));
        }
        Ok(())
    }

    /// The numbers of an accessor, of so many as its type has.
    fn accessor(&self, index: &Value, kind: &str) -> Result<Vec<f64>> {
        let document = self.document;
        let accessor =
            at(&document["accessors"], index).ok_or_else(|| self.wrong("an accessor", "missing"))?;
        if accessor["type"].as_str() != Some(kind) {
            return Err(self.wrong("the type of an accessor", format!("not {kind}")));
        }
        if !accessor["sparse"].is_null() {
            return Err(self.wrong("an accessor", "sparse, which is not read"));
        }
        let scalar = match accessor["componentType"].as_u64() {
            Some(5120) => Scalar::I8,
            Some(5121) => Scalar::U8,
            Some(5122) => Scalar::I16,
            Some(5123) => Scalar::U16,
            Some(5125) => Scalar::U32,
            Some(5126) => Scalar::F32,
            _ => return Err(self.wrong("the kind of numbers of an accessor", "unknown")),
        };
        let view = at(&document["bufferViews"], &accessor["bufferView"])
            .ok_or_else(|| self.wrong("a buffer view", "missing"))?;
        if view["buffer"].as_u64() != Some(0) || !document["buffers"][0]["uri"].is_null() {
            return Err(self.wrong("a buffer", "in another file: give a GLB with all in one"));
        }
        let number = |value: &Value, or: u64| value.as_u64().unwrap_or(or) as usize;
        let width = if kind == "VEC3" { 3 } else { 1 };
        let stride = number(&view["byteStride"], (width * scalar.size()) as u64);
        let begins = number(&view["byteOffset"], 0).checked_add(number(&accessor["byteOffset"], 0));
        let count = number(&accessor["count"], 0);
        let size = width * scalar.size();
        let end = begins.and_then(|b| {
            let last = count.checked_sub(1)?.checked_mul(stride)?;
            b.checked_add(last)?.checked_add(size)
        });
        let (Some(begins), true) = (begins, count == 0 || end.is_some_and(|end| end <= self.data.len()))
        else {
            let value = format!("{count} items in {} bytes", self.data.len());
            return Err(self.wrong("an accessor", value));
        };
        // A stride of less than an item would make few bytes many numbers.
        if count > 0 && stride < size {
            return Err(self.wrong("the stride of a buffer view", stride.to_string()));
        }
        let mut values = Vec::with_capacity(count * width);
        for i in 0..count {
            for k in 0..width {
                let at = begins + i * stride + k * scalar.size();
                values.push(scalar.read(&self.data[at..], Endian::Little));
            }
        }
        Ok(values)
    }

    fn wrong(&self, field: &str, value: impl std::fmt::Display) -> IoError {
        IoError::layout(
            self.path,
            field,
            value,
            "the file is damaged or of a kind that is not read: export it again",
        )
    }
}

/// The entry of a list that an index names.
fn at<'a>(list: &'a Value, index: &Value) -> Option<&'a Value> {
    list.get(usize::try_from(index.as_u64()?).ok()?)
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let list = value.as_array().filter(|list| list.len() == N)?;
    let mut all = [0.0; N];
    for (out, value) in all.iter_mut().zip(list) {
        *out = value.as_f64()?;
    }
    Some(all)
}

/// The transform of a node: its matrix (column by column), else translation, rotation (x, y, z, w) and scale.
fn affine(node: &Value) -> Affine {
    if let Some(m) = numbers::<16>(&node["matrix"]) {
        return std::array::from_fn(|row| std::array::from_fn(|column| m[4 * column + row]));
    }
    let t = numbers::<3>(&node["translation"]).unwrap_or([0.0; 3]);
    let [x, y, z, w] = numbers::<4>(&node["rotation"]).unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let s = numbers::<3>(&node["scale"]).unwrap_or([1.0; 3]);
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    std::array::from_fn(|k| [r[k][0] * s[0], r[k][1] * s[1], r[k][2] * s[2], t[k]])
}

fn product(a: &Affine, b: &Affine) -> Affine {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let moved = if column == 3 { a[row][3] } else { 0.0 };
            (0..3).map(|k| a[row][k] * b[k][column]).sum::<f64>() + moved
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::tetrahedron;
    use super::super::{glb_to_bytes, read_mesh, write_glb};
    use super::*;
    use crate::testing::{no_panic, says, temporary};

    fn read(bytes: Vec<u8>) -> Result<PlyMesh> {
        parse(&bytes, "a.glb".as_ref())
    }

    #[test]
    fn what_is_written_comes_back_also_at_large_coordinates() {
        for origin in [[0.0; 3], [500_000.125, 4_000_000.25, 12.0]] {
            let mesh = tetrahedron(origin);
            let (_folder, path) = temporary("mesh.glb");
            write_glb(&path, &mesh).unwrap();
            let back = read_mesh(&path).unwrap();
            assert_eq!(back.triangles, mesh.triangles);
            for i in 0..4 {
                let want = mesh.vertex_world(i);
                assert!(
                    (0..3).all(|k| (back.vertices[i][k] - want[k]).abs() < 1e-6),
                    "{:?} {want:?}",
                    back.vertices[i]
                );
            }
        }
    }

    #[test]
    fn nodes_hang_below_nodes() {
        let text = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[
            {"children":[1],"translation":[1,0,0]},{"mesh":0,"scale":[2,2,2],"rotation":[0,0,0,1]}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],
            "bufferViews":[{"buffer":0,"byteLength":36}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]}"#;
        let positions = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let data: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
        let glb = |text: &str| {
            let mut bytes = b"glTF".to_vec();
            let text = format!("{text}{}", " ".repeat((4 - text.len() % 4) % 4));
            bytes.extend([2, 0, 0, 0]);
            bytes.extend((28 + text.len() as u32 + data.len() as u32).to_le_bytes());
            bytes.extend((text.len() as u32).to_le_bytes());
            bytes.extend(b"JSON");
            bytes.extend(text.as_bytes());
            bytes.extend((data.len() as u32).to_le_bytes());
            bytes.extend(b"BIN\0");
            bytes.extend(&data);
            bytes
        };
        let mesh = read(glb(text)).unwrap();
        // y up to z up.
        assert_eq!(mesh.vertices, [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 0.0, 2.0]]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        for (a, b, part) in [
            (r#""count":3"#, r#""count":4"#, "an accessor is 4 items in 36 bytes"),
            (r#""children":[1]"#, r#""children":[0]"#, "the nodes is in a circle"),
            (r#""count":3"#, r#""count":3,"sparse":{}"#, "sparse"),
            (r#"{"byteLength":36}"#, r#"{"byteLength":36,"uri":"a.bin"}"#, "in another file"),
            ("5126", "5130", "the kind of numbers"),
        ] {
            says(read(glb(&text.replacen(a, b, 1))), part);
        }
    }

    #[test]
    fn no_bytes_make_it_panic() {
        says(read(b"glTF".to_vec()), "a.glb: byte 0: the header is 4 bytes");
        let good = glb_to_bytes(&tetrahedron([0.0; 3])).unwrap();
        says(read(good[..good.len() - 4].to_vec()), "the length of a chunk");
        no_panic(&good, 9, 3000, read);
    }
}
