//! `preview.png`: the mesh from sensible views, so that a person sees at once whether the map is good.

use portolan::cell::SignedDistance;
use portolan::geom::Pose;
use portolan::geom::vector::sub;
use portolan::store::Bricks;
use portolan::surface::Mesh;
use portolan::uncertainty::SurfaceSigma;
use portolan_draw::{Color, MeshView, Preview, Sensor, preview};

use super::picture::{MOVED, millimeters, sigma_color};

/// Sensors that the views are chosen from: more add nothing new.
const MOST_SENSORS: usize = 200;
/// Points that are drawn of those that moved.
const MOST_POINTS: usize = 30_000;

/// What is drawn on a mesh.
#[derive(Clone, Copy)]
pub(crate) enum Over<'a> {
    /// Points of what moved (world, meters) beside it, with this edge (meters).
    Movers(&'a [[f64; 3]], f64),
    /// How sure it is, by the map that it is of.
    Sigma(&'a SurfaceSigma, &'a Bricks<SignedDistance, 3>),
}

/// The sheet as PNG bytes; `None`: the mesh is empty. `camera`: sensors look along z with y down, else along x with z up. `up`
/// in the world; `None`: that of the sensors, put right by the floor.
pub(crate) fn of_mesh(
    mesh: &Mesh,
    poses: &[Pose<3>],
    camera: bool,
    up: Option<[f64; 3]>,
    over: Option<Over<'_>>,
    title: &str,
) -> Option<Vec<u8>> {
    if mesh.triangles.is_empty() {
        return None;
    }
    let (ahead, above) =
        if camera { ([0.0, 0.0, 1.0], [0.0, -1.0, 0.0]) } else { ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]) };
    let sensor = |pose: &Pose<3>| Sensor {
        position: sub(pose.translation, mesh.origin).map(|v| v as f32),
        forward: pose.rotate(ahead).map(|v| v as f32),
        up: pose.rotate(above).map(|v| v as f32),
    };
    let sensors: Vec<Sensor> =
        poses.iter().step_by(poses.len().div_ceil(MOST_SENSORS).max(1)).map(sensor).collect();
    let mut subtitle = format!("{} triangles, {:.2} m²", mesh.triangles.len(), mesh.area());
    let drawn = match over {
        Some(Over::Movers(points, edge)) if !points.is_empty() => {
            subtitle += &format!(" · {} returns of what moved, not in the map, in pink", points.len());
            Some(with_points(mesh, points, edge))
        }
        Some(Over::Sigma(sigma, map)) => {
            let [least, most] = sigma.ends();
            subtitle += &format!(
                " · standard deviation of the surface, from {} (pale) to {} (dark)",
                millimeters(least),
                millimeters(most)
            );
            Some(colored(mesh, |p| sigma_color(sigma, sigma.of_distance(map, p, 0.0, [0.0; 3]))))
        }
        _ => None,
    };
    let mesh = drawn.as_ref().unwrap_or(mesh);
    let view = MeshView {
        vertices: &mesh.vertices,
        triangles: &mesh.triangles,
        normals: &mesh.normals,
        colors: &mesh.colors,
    };
    Some(
        preview(&Preview {
            mesh: view,
            sensors: &sensors,
            up: up.map(|up| up.map(|v| v as f32)),
            title,
            subtitle: &subtitle,
        })
        .encode_png(),
    )
}

/// The mesh with these colors (of points in the world).
fn colored(mesh: &Mesh, color: impl Fn([f64; 3]) -> Color) -> Mesh {
    let world = |v: &[f32; 3]| std::array::from_fn(|k| mesh.origin[k] + f64::from(v[k]));
    let bytes = |c: Color| [c.r, c.g, c.b];
    let colors = mesh.vertices.iter().map(|v| bytes(color(world(v)))).collect();
    Mesh { colors, ..mesh.clone() }
}

/// The mesh with a small octahedron at each of these points, or at evenly chosen ones of them.
fn with_points(mesh: &Mesh, points: &[[f64; 3]], edge: f64) -> Mesh {
    const CORNERS: [[f32; 3]; 6] = [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    const FACES: [[u32; 3]; 8] =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let plain = Color::hex(0xB9C0C7);
    let mut all = if mesh.colors.is_empty() { colored(mesh, |_| plain) } else { mesh.clone() };
    let radius = 0.35 * edge as f32;
    for p in points.iter().step_by(points.len().div_ceil(MOST_POINTS).max(1)) {
        let first = all.vertices.len() as u32;
        let center = sub(*p, all.origin).map(|v| v as f32);
        for corner in CORNERS {
            all.vertices.push(std::array::from_fn(|k| center[k] + radius * corner[k]));
            if !all.normals.is_empty() {
                all.normals.push(corner);
            }
            all.colors.push([MOVED.r, MOVED.g, MOVED.b]);
        }
        all.triangles.extend(FACES.map(|face| face.map(|corner| first + corner)));
    }
    all
}
