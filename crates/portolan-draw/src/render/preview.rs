//! One sheet to judge a map at a glance.

use super::mesh::MeshView;
use super::scene::{MeshScene, Sensor};
use super::shade::render_mesh;
use crate::{Anchor, Canvas, Font, color};

/// The content of the sheet.
#[derive(Clone, Copy, Debug)]
pub struct Preview<'a> {
    /// The surface.
    pub mesh: MeshView<'a>,
    /// The poses of its sensors; may be empty.
    pub sensors: &'a [Sensor],
    /// Unit vector upward; `None`: that of the sensors, put right by the floor.
    pub up: Option<[f32; 3]>,
    /// First line.
    pub title: &'a str,
    /// Second line.
    pub subtitle: &'a str,
}

const MARGIN: usize = 24;
const HEAD: usize = 64;
const LARGE: [u32; 2] = [1200, 900];
const SMALL: [u32; 2] = [592, 438];
const GAP: usize = 24;

/// The sheet: a large view, and beside it two smaller ones. Of rooms: from above with the ceiling removed, and from poses
/// of the sensor. Of an object: from the side of the sensors, from the opposite side, and from above.
pub fn preview(what: &Preview<'_>) -> Canvas {
    let normals = if what.mesh.normals.is_empty() { what.mesh.smooth_normals() } else { Vec::new() };
    let mesh = if normals.is_empty() { what.mesh } else { MeshView { normals: &normals, ..what.mesh } };
    let scene = MeshScene::of(&mesh, what.sensors, what.up);
    let aspect = |[width, height]: [u32; 2]| width as f32 / height as f32;
    let mut small = scene.inside_views(2);
    if small.is_empty() {
        small = scene.other_sides(aspect(SMALL));
    }
    let width = 2 * MARGIN + LARGE[0] as usize + GAP + SMALL[0] as usize;
    let height = HEAD + LARGE[1] as usize + MARGIN;
    let mut sheet = Canvas::new(width as u32, height as u32);
    sheet.text([MARGIN as f64, 10.0], what.title, Font::new(24).bold(), Anchor::Left);
    sheet.text([MARGIN as f64, 38.0], what.subtitle, Font::new(16).color(color::MUTED), Anchor::Left);
    let large = render_mesh(&mesh, &scene.overview(aspect(LARGE)), LARGE[0], LARGE[1]);
    sheet.paste_canvas(MARGIN, HEAD, &large);
    for (i, camera) in small.iter().take(2).enumerate() {
        let picture = render_mesh(&mesh, camera, SMALL[0], SMALL[1]);
        let y = HEAD + i * (SMALL[1] as usize + GAP);
        sheet.paste_canvas(MARGIN + LARGE[0] as usize + GAP, y, &picture);
    }
    sheet
}
