//! Writes a picture of a mesh: `mesh VERTICES.f32 TRIANGLES.u32 OUT.png [x y z ...]`, raw little-endian arrays of
//! three numbers a row; further numbers are positions of sensors inside.

#![allow(clippy::print_stderr, reason = "an example prints its time")]

use portolan_draw::{MeshView, Preview, Sensor, preview};

type Error = Box<dyn std::error::Error>;

fn rows<T>(path: &str, number: impl Fn([u8; 4]) -> T) -> Result<Vec<[T; 3]>, Error> {
    let bytes = std::fs::read(path)?;
    let word = |b: &[u8], i: usize| number([b[i], b[i + 1], b[i + 2], b[i + 3]]);
    Ok(bytes.chunks_exact(12).map(|b| [word(b, 0), word(b, 4), word(b, 8)]).collect())
}

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [vertices, triangles, out, places @ ..] = arguments.as_slice() else {
        return Err("call it as: mesh VERTICES.f32 TRIANGLES.u32 OUT.png [x y z ...]".into());
    };
    let vertices = rows(vertices, f32::from_le_bytes)?;
    let triangles = rows(triangles, u32::from_le_bytes)?;
    let places: Vec<f32> = places.iter().map(|p| p.parse()).collect::<Result<_, _>>()?;
    let sensor =
        |p: &[f32]| Sensor { position: [p[0], p[1], p[2]], forward: [1.0, 0.0, 0.0], up: [0.0, 0.0, 1.0] };
    let sensors: Vec<Sensor> = places.chunks_exact(3).map(sensor).collect();
    let mesh = MeshView { vertices: &vertices, triangles: &triangles, normals: &[], colors: &[] };
    let subtitle = format!("{} triangles", triangles.len());
    let start = std::time::Instant::now();
    let sheet = preview(&Preview { mesh, sensors: &sensors, up: None, title: "A mesh", subtitle: &subtitle });
    let took = start.elapsed();
    std::fs::write(out, sheet.encode_png())?;
    eprintln!("{subtitle}: drawn in {took:.2?}");
    Ok(())
}
