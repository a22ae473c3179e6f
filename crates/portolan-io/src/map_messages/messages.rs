//! The bytes of each message.

use portolan::geom::Grid;
use portolan::surface::Mesh;

use super::cdr::Cdr;
use crate::map_server::MapCell;
use crate::mesh::NEAR;

/// The frame of all messages.
const FRAME: &str = "map";
/// A light gray with a touch of blue, for surfaces without colors.
const SURFACE: [f32; 3] = [0.72, 0.74, 0.78];
/// A blue that is seen on light and on dark backgrounds.
const LINE: [f32; 3] = [0.1, 0.5, 1.0];

/// Kinds of markers *(visualization_msgs/Marker)*.
const LINE_LIST: i32 = 5;
const TRIANGLE_LIST: i32 = 11;

/// Kinds of fields *(sensor_msgs/PointField)*.
const FLOAT32: u8 = 7;
const FLOAT64: u8 = 8;

/// `nav_msgs/OccupancyGrid` of cells, x fastest, y up, turned by `yaw` about the origin corner.
pub(super) fn occupancy_grid(grid: &Grid<2>, yaw: f64, cells: &[MapCell]) -> Vec<u8> {
    let value = |cell: &MapCell| match cell {
        MapCell::Unknown => -1i8 as u8,
        MapCell::Free => 0,
        MapCell::Occupied => 100,
    };
    let [x, y] = grid.lattice.origin;
    let mut message = Cdr::with_room(cells.len() + 200);
    header(&mut message);
    // The time at which the map was loaded.
    message.i32(0);
    message.u32(0);
    message.f32(grid.lattice.resolution as f32);
    grid.shape.iter().for_each(|n| message.u32(*n as u32));
    [x, y, 0.0].iter().for_each(|v| message.f64(*v));
    let (sin, cos) = (0.5 * yaw).sin_cos();
    [0.0, 0.0, sin, cos].iter().for_each(|v| message.f64(*v));
    message.bytes(cells.len() as u32, cells.iter().map(value));
    message.into_bytes()
}

/// Whether points need more than `f32`: as for PLY.
pub(super) fn is_far(points: &[[f64; 3]]) -> bool {
    points.iter().flatten().any(|c| c.abs() > NEAR)
}

/// `sensor_msgs/PointCloud2` with fields x, y and z: `float32`, or `float64` where [`is_far`].
pub(super) fn point_cloud(points: &[[f64; 3]]) -> Vec<u8> {
    let far = is_far(points);
    let (datatype, width) = if far { (FLOAT64, 8) } else { (FLOAT32, 4) };
    let (count, step) = (points.len() as u32, 3 * width);
    let mut message = Cdr::with_room(points.len() * step as usize + 200);
    header(&mut message);
    message.u32(1);
    message.u32(count);
    message.u32(3);
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        message.string(name);
        message.u32(i as u32 * width);
        message.u8(datatype);
        message.u32(1);
    }
    message.bool(false);
    message.u32(step);
    message.u32(step * count);
    if far {
        message.bytes(step * count, points.iter().flatten().flat_map(|c| c.to_le_bytes()));
    } else {
        message.bytes(step * count, points.iter().flatten().flat_map(|c| (*c as f32).to_le_bytes()));
    }
    message.bool(true);
    message.into_bytes()
}

/// `visualization_msgs/Marker` of a mesh: each triangle has its own corners, relative to the mesh's origin, which is the
/// marker's position.
pub(super) fn mesh_marker(mesh: &Mesh) -> Vec<u8> {
    let corners = || mesh.triangles.iter().flatten().map(|v| *v as usize);
    let point = |v: usize| mesh.vertices[v].map(f64::from);
    let about =
        About { space: "mesh", kind: TRIANGLE_LIST, position: mesh.origin, width: 1.0, color: SURFACE };
    let colors = corners().filter_map(|v| mesh.colors.get(v)).map(|c| c.map(|v| f32::from(v) / 255.0));
    marker(&about, 3 * mesh.triangles.len(), corners().map(point), colors)
}

/// `visualization_msgs/Marker` of the segments of lines.
pub(super) fn contour_marker(lines: &[crate::Polyline], width: f64) -> Vec<u8> {
    let segments = lines.iter().flat_map(|line| line.windows(2));
    let points = segments.flatten().map(|[x, y]| [*x, *y, 0.0]);
    let about = About { space: "contour", kind: LINE_LIST, position: [0.0; 3], width, color: LINE };
    marker(&about, points.clone().count(), points, std::iter::empty())
}

struct About {
    /// The marker's namespace.
    space: &'static str,
    kind: i32,
    position: [f64; 3],
    width: f64,
    color: [f32; 3],
}

fn marker(
    about: &About,
    count: usize,
    points: impl Iterator<Item = [f64; 3]>,
    colors: impl Iterator<Item = [f32; 3]> + Clone,
) -> Vec<u8> {
    let colored = colors.clone().count();
    let mut message = Cdr::with_room(count * 24 + colored * 16 + 400);
    header(&mut message);
    message.string(about.space);
    // Number, kind, action: add.
    [0, about.kind, 0].into_iter().for_each(|v| message.i32(v));
    about.position.iter().chain(&[0.0, 0.0, 0.0, 1.0]).for_each(|v| message.f64(*v));
    // The width of lines is the first; none may be zero.
    [about.width, 1.0, 1.0].iter().for_each(|v| message.f64(*v));
    about.color.iter().chain(&[1.0]).for_each(|v| message.f32(*v));
    // It lasts until it is replaced, and does not follow its frame.
    message.i32(0);
    message.u32(0);
    message.bool(false);
    message.u32(count as u32);
    points.flatten().for_each(|v| message.f64(v));
    message.u32(colored as u32);
    colors.for_each(|color| color.iter().chain(&[1.0]).for_each(|v| message.f32(*v)));
    // No texture: a name, an image and places in it.
    message.string("");
    header_of(&mut message, "");
    message.string("");
    message.u32(0);
    message.u32(0);
    // No text, no mesh of a file.
    ["", "", ""].into_iter().for_each(|v| message.string(v));
    message.u32(0);
    message.bool(false);
    message.into_bytes()
}

fn header(message: &mut Cdr) {
    header_of(message, FRAME);
}

/// Time 0, which asks for the newest transform.
fn header_of(message: &mut Cdr, frame: &str) {
    message.i32(0);
    message.u32(0);
    message.string(frame);
}
