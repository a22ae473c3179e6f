//! `preview.png`: the mesh from sensible views, so that a person sees at once whether the map is good.

use portolan::geom::Pose;
use portolan::geom::vector::sub;
use portolan::surface::Mesh;
use portolan_draw::{MeshView, Preview, Sensor, preview};

/// Sensors that the views are chosen from: more add nothing new.
const MOST_SENSORS: usize = 200;

/// The sheet as PNG bytes; `None`: the mesh is empty. `camera`: sensors look along z with y down, else along x with z up.
pub(crate) fn of_mesh(mesh: &Mesh, poses: &[Pose<3>], camera: bool, title: &str) -> Option<Vec<u8>> {
    if mesh.triangles.is_empty() {
        return None;
    }
    let (ahead, up) =
        if camera { ([0.0, 0.0, 1.0], [0.0, -1.0, 0.0]) } else { ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]) };
    let sensor = |pose: &Pose<3>| Sensor {
        position: sub(pose.translation, mesh.origin).map(|v| v as f32),
        forward: pose.rotate(ahead).map(|v| v as f32),
        up: pose.rotate(up).map(|v| v as f32),
    };
    let sensors: Vec<Sensor> =
        poses.iter().step_by(poses.len().div_ceil(MOST_SENSORS).max(1)).map(sensor).collect();
    let view = MeshView {
        vertices: &mesh.vertices,
        triangles: &mesh.triangles,
        normals: &mesh.normals,
        colors: &mesh.colors,
    };
    let subtitle = format!("{} triangles, {:.2} m²", mesh.triangles.len(), mesh.area());
    Some(preview(&Preview { mesh: view, sensors: &sensors, title, subtitle: &subtitle }).encode_png())
}
