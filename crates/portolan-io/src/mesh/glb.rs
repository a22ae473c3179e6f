//! Meshes as binary glTF 2.0.

use std::io::{self, Write};
use std::path::Path;

use portolan::surface::Mesh;
use serde_json::{Value, json};

use super::check;
use crate::{IoError, Result, write_atomic};

/// Types of components in glTF.
const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_INT: u32 = 5125;
/// What a buffer view is for.
const ARRAY: u32 = 34962;
const ELEMENTS: u32 = 34963;

/// Writes a mesh as GLB: one node, one mesh, `POSITION` (with its bounds), `NORMAL` and `COLOR_0` where the mesh has
/// them, indices as u32.
///
/// Positions are relative to the mesh's origin, as glTF has only f32. The origin is the node's translation, which
/// viewers round to f32 too: at UTM coordinates the mesh as a whole is placed to half a meter, its shape stays exact. The
/// exact origin stands in the node's `extras.origin`. glTF has y up: the node's rotation, -90 degrees about x, turns
/// the map's z up.
///
/// A mesh without triangles becomes an empty scene; its vertices, which no viewer would show, are not written.
///
/// # Errors
/// As [`write_ply_mesh`](super::write_ply_mesh), and where the file would be longer than the 4 GiB that the format holds.
pub fn write_glb(path: impl AsRef<Path>, mesh: &Mesh) -> Result<()> {
    let path = path.as_ref();
    let (layout, text, total) = prepared(path, mesh)?;
    write_atomic(path, |w| write_to(w, mesh, &layout, &text, total))
}

/// The same as bytes in memory.
///
/// # Errors
/// [`IoError::Unwritable`] as [`write_glb`].
pub fn glb_to_bytes(mesh: &Mesh) -> Result<Vec<u8>> {
    let name = Path::new("mesh.glb");
    let (layout, text, total) = prepared(name, mesh)?;
    let mut bytes = Vec::with_capacity(total as usize);
    write_to(&mut bytes, mesh, &layout, &text, total).map_err(|e| IoError::os(name, "write it", e))?;
    Ok(bytes)
}

/// Where everything goes, the padded document, and the length of the file.
fn prepared(path: &Path, mesh: &Mesh) -> Result<(Layout, Vec<u8>, u32)> {
    check(path, mesh)?;
    let layout = if mesh.triangles.is_empty() { Layout::EMPTY } else { Layout::of(mesh) };
    let mut text = document(mesh, &layout).to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() as u64 + if layout.end > 0 { 8 + layout.end } else { 0 };
    let Ok(total) = u32::try_from(total) else {
        let advice = "write PLY, or mesh at a coarser resolution";
        return Err(IoError::unwritable(path, "the file's length (bytes)", total, advice));
    };
    Ok((layout, text, total))
}

/// Where the arrays lie in the binary chunk (bytes); each starts at a multiple of four.
struct Layout {
    normals: u64,
    colors: u64,
    indices: u64,
    end: u64,
}

impl Layout {
    /// Without binary chunk.
    const EMPTY: Self = Self { normals: 0, colors: 0, indices: 0, end: 0 };

    fn of(mesh: &Mesh) -> Self {
        let normals = 12 * mesh.vertices.len() as u64;
        let colors = normals + 12 * mesh.normals.len() as u64;
        // Colors have a fourth byte: elements must start at multiples of four.
        let indices = colors + 4 * mesh.colors.len() as u64;
        Self { normals, colors, indices, end: indices + 12 * mesh.triangles.len() as u64 }
    }
}

fn document(mesh: &Mesh, layout: &Layout) -> Value {
    let asset = json!({ "version": "2.0", "generator": "portolan" });
    if mesh.triangles.is_empty() {
        // Accessors of no elements are not allowed, nor are lists of no nodes or meshes.
        return json!({ "asset": asset, "scene": 0, "scenes": [{}] });
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for v in &mesh.vertices {
        for k in 0..3 {
            low[k] = low[k].min(v[k]);
            high[k] = high[k].max(v[k]);
        }
    }
    let count = mesh.vertices.len();
    let view = |from: u64, to: u64, target: u32| json!({ "buffer": 0, "byteOffset": from, "byteLength": to - from, "target": target });
    let mut views = vec![view(0, layout.normals, ARRAY)];
    let mut accessors = vec![json!({
        "bufferView": 0, "componentType": FLOAT, "count": count, "type": "VEC3", "min": low, "max": high,
    })];
    let mut attributes = json!({ "POSITION": 0 });
    if !mesh.normals.is_empty() {
        attributes["NORMAL"] = json!(views.len());
        accessors.push(
            json!({ "bufferView": views.len(), "componentType": FLOAT, "count": count, "type": "VEC3" }),
        );
        views.push(view(layout.normals, layout.colors, ARRAY));
    }
    if !mesh.colors.is_empty() {
        attributes["COLOR_0"] = json!(views.len());
        accessors.push(json!({
            "bufferView": views.len(), "componentType": UNSIGNED_BYTE, "normalized": true, "count": count, "type": "VEC4",
        }));
        let mut colors = view(layout.colors, layout.indices, ARRAY);
        colors["byteStride"] = json!(4);
        views.push(colors);
    }
    let indices = views.len();
    accessors.push(json!({
        "bufferView": indices, "componentType": UNSIGNED_INT, "count": 3 * mesh.triangles.len(), "type": "SCALAR",
    }));
    views.push(view(layout.indices, layout.end, ELEMENTS));
    // -90 degrees about x takes (x, y, z) to (x, z, -y).
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let [x, y, z] = mesh.origin;
    json!({
        "asset": asset,
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{
            "mesh": 0, "rotation": [-half, 0.0, 0.0, half], "translation": [x, z, -y], "extras": { "origin": mesh.origin },
        }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": indices, "material": 0 }] }],
        "materials": [{
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 }, "doubleSided": true,
        }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": layout.end }],
    })
}

fn write_to(w: &mut impl Write, mesh: &Mesh, layout: &Layout, text: &[u8], total: u32) -> io::Result<()> {
    w.write_all(b"glTF")?;
    w.write_all(&2u32.to_le_bytes())?;
    w.write_all(&total.to_le_bytes())?;
    w.write_all(&(text.len() as u32).to_le_bytes())?;
    w.write_all(b"JSON")?;
    w.write_all(text)?;
    // A chunk that no buffer names is not allowed.
    if layout.end == 0 {
        return Ok(());
    }
    w.write_all(&(layout.end as u32).to_le_bytes())?;
    w.write_all(b"BIN\0")?;
    for v in mesh.vertices.iter().chain(&mesh.normals).flatten() {
        w.write_all(&v.to_le_bytes())?;
    }
    for [r, g, b] in &mesh.colors {
        w.write_all(&[linear(*r), linear(*g), linear(*b), 255])?;
    }
    for v in mesh.triangles.iter().flatten() {
        w.write_all(&v.to_le_bytes())?;
    }
    Ok(())
}

/// Colors of cameras are sRGB, vertex colors of glTF are linear.
fn linear(byte: u8) -> u8 {
    let v = f32::from(byte) / 255.0;
    let linear = if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    (linear * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Bytes, tetrahedron};
    use super::*;

    fn written(mesh: &Mesh) -> (Value, Vec<u8>) {
        let file = crate::testing::written(|path| write_glb(path, mesh));
        assert_eq!(file, glb_to_bytes(mesh).unwrap());
        let mut bytes = Bytes(&file);
        assert_eq!((bytes.take(), bytes.u32(), bytes.u32()), (*b"glTF", 2, file.len() as u32));
        let text = bytes.u32() as usize;
        assert_eq!((bytes.take(), text % 4), (*b"JSON", 0));
        let document: Value = serde_json::from_slice(&bytes.0[..text]).unwrap();
        bytes.0 = &bytes.0[text..];
        if bytes.0.is_empty() {
            return (document, Vec::new());
        }
        let binary = bytes.u32() as usize;
        assert_eq!((bytes.take(), binary), (*b"BIN\0", bytes.0.len()));
        (document, bytes.0.to_vec())
    }

    #[test]
    fn chunks_views_and_bounds_agree() {
        let mesh = tetrahedron([500_000.0, 4_000_000.0, 7.0]);
        let (document, binary) = written(&mesh);
        assert_eq!(binary.len(), 4 * (12 + 12 + 4) + 4 * 12);
        assert_eq!(document["buffers"][0]["byteLength"], binary.len());
        let views = document["bufferViews"].as_array().unwrap();
        let mut at = 0;
        for view in views {
            assert_eq!(view["byteOffset"], at);
            at += view["byteLength"].as_u64().unwrap();
        }
        assert_eq!(at as usize, binary.len());
        assert_eq!(document["accessors"][0]["min"], json!([0.5, 0.25, 0.125]));
        assert_eq!(document["accessors"][0]["max"], json!([1.5, 1.25, 3.125]));
        assert_eq!(document["accessors"][3]["count"], 12);
        assert_eq!(document["nodes"][0]["translation"], json!([500_000.0, 7.0, -4_000_000.0]));
        let mut bytes = Bytes(&binary);
        mesh.vertices.iter().chain(&mesh.normals).for_each(|v| assert_eq!(bytes.f32s(), *v));
        assert_eq!(bytes.take(), [255, 0, 0, 255]);
        bytes.take::<12>();
        mesh.triangles.iter().flatten().for_each(|&v| assert_eq!(bytes.u32(), v));
    }

    #[test]
    fn attributes_that_are_not_there_are_not_named() {
        let mesh = Mesh { normals: vec![], colors: vec![], ..tetrahedron([0.0; 3]) };
        let (document, binary) = written(&mesh);
        let primitive = &document["meshes"][0]["primitives"][0];
        assert_eq!((&primitive["attributes"], &primitive["indices"]), (&json!({ "POSITION": 0 }), &json!(1)));
        assert_eq!(binary.len(), 4 * 12 + 4 * 12);
    }

    /// By the schema of glTF 2.0: arrays have one element at least, `scene` is an index of `scenes`, a chunk needs a buffer.
    #[test]
    fn a_mesh_of_nothing_is_a_valid_scene() {
        let loose = Mesh { triangles: vec![], ..tetrahedron([500_000.0, 4_000_000.0, 7.0]) };
        for mesh in [Mesh::default(), loose] {
            let (document, binary) = written(&mesh);
            assert!(binary.is_empty());
            assert_eq!(
                document,
                json!({ "asset": { "version": "2.0", "generator": "portolan" }, "scene": 0, "scenes": [{}] })
            );
        }
    }
}
