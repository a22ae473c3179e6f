//! Rasterization: the visible triangle at every pixel.
//!
//! Corners are rounded to 1/256 of a pixel, and edges are tested in whole numbers (Pineda 1988) with the rule that a pixel
//! on the edge between two triangles belongs to exactly one of them: no cracks, nothing drawn twice. Bands of rows are
//! filled independently of each other, triangles in their order, so that the picture does not depend on the threads.

use super::camera::{Camera, Projection};
use super::clip::Polygon;
use super::mesh::MeshView;
use super::parallel;
use super::vector::dot;

/// No triangle.
pub(super) const NOTHING: u32 = u32::MAX;

/// Rows of a band.
const BAND: usize = 32;
/// Triangles sorted into bands in one task.
const CHUNK: usize = 1 << 15;
/// Parts of a pixel.
const PARTS: f32 = 256.0;
/// Coordinates are clamped to this (pixels), so that their products fit into 64 bits.
const FAR_OUT: f32 = 4e6;

/// The visible triangles, row by row.
pub(super) struct Visible {
    pub(super) width: usize,
    pub(super) height: usize,
    /// The triangle's index, or [`NOTHING`].
    pub(super) triangles: Vec<u32>,
    /// One over the depth; 0 where there is nothing.
    pub(super) nearness: Vec<f32>,
}

/// A corner in the picture: 1/256 pixel, and one over the depth.
#[derive(Clone, Copy)]
struct Corner {
    x: i32,
    y: i32,
    w: f32,
}

/// A triangle to draw, counter-clockwise or clockwise in the picture, whose y axis points down.
struct Piece {
    corners: [Corner; 3],
    triangle: u32,
}

/// Triangles of one chunk: those of each band as indices into `pieces`.
struct Sorted {
    pieces: Vec<Piece>,
    bands: Vec<Vec<u32>>,
}

pub(super) fn rasterize(
    mesh: &MeshView<'_>,
    camera: &Camera,
    projection: &Projection,
    width: usize,
    height: usize,
) -> Visible {
    let bands = height.div_ceil(BAND);
    let sorted = parallel::map(mesh.triangles.len().div_ceil(CHUNK), |chunk| {
        let from = chunk * CHUNK;
        let to = (from + CHUNK).min(mesh.triangles.len());
        let mut sorted = Sorted { pieces: Vec::new(), bands: vec![Vec::new(); bands] };
        for triangle in from..to {
            place(mesh, camera, projection, triangle, [width, height], &mut sorted);
        }
        sorted
    });
    let mut cells = vec![(NOTHING, 0.0f32); width * height];
    parallel::chunks(&mut cells, BAND * width, |band, cells| {
        for chunk in &sorted {
            for &piece in &chunk.bands[band] {
                fill(&chunk.pieces[piece as usize], cells, width, band * BAND);
            }
        }
    });
    let (triangles, nearness) = cells.into_iter().unzip();
    Visible { width, height, triangles, nearness }
}

/// Sorts a triangle, or what planes leave of it, into the bands that it touches.
fn place(
    mesh: &MeshView<'_>,
    camera: &Camera,
    projection: &Projection,
    triangle: usize,
    size: [usize; 2],
    sorted: &mut Sorted,
) {
    let Some(corners) = mesh.corners(triangle) else { return };
    let view = corners.map(|p| projection.view(p));
    if !view.iter().flatten().all(|v| v.is_finite()) {
        return;
    }
    let below = |p: [f32; 3]| match camera.cut {
        // Height above the eye in the camera's axes, of which `up` has a component along each.
        Some(cut) => {
            let up = camera.upwards();
            let height =
                (0..3).map(|k| p[k] * dot(projection.axes[k], up)).sum::<f32>() + dot(projection.eye, up);
            cut - height
        }
        None => 1.0,
    };
    let in_front = |p: [f32; 3]| p[2] - projection.near;
    let keep = view.map(|p| below(p) >= 0.0 && in_front(p) >= 0.0);
    if keep == [true; 3] {
        push(view, triangle, camera, projection, size, sorted);
    } else if view.iter().any(|p| below(*p) >= 0.0) && view.iter().any(|p| in_front(*p) >= 0.0) {
        for part in Polygon::new(view).cut(in_front).cut(below).triangles() {
            push(part, triangle, camera, projection, size, sorted);
        }
    }
}

fn push(
    view: [[f32; 3]; 3],
    triangle: usize,
    camera: &Camera,
    projection: &Projection,
    [width, height]: [usize; 2],
    sorted: &mut Sorted,
) {
    let corners = view.map(|p| {
        let [x, y] = projection.pixel(p).map(|v| (v.clamp(-FAR_OUT, FAR_OUT) * PARTS).round() as i32);
        Corner { x, y, w: 1.0 / p[2] }
    });
    let [a, b, c] = corners;
    let turn = edge(a, b, c.x, c.y);
    // y points down, so that counter-clockwise triangles are clockwise here: the edge function is negative.
    if turn == 0 || (turn > 0 && camera.cull_back) {
        return;
    }
    let corners = if turn > 0 { corners } else { [a, c, b] };
    let (low, high) = (
        |v: [i32; 3]| first_centre(v[0].min(v[1]).min(v[2])),
        |v: [i32; 3]| last_centre(v[0].max(v[1]).max(v[2])),
    );
    let (xs, ys) = (corners.map(|c| c.x), corners.map(|c| c.y));
    let (left, right) = (low(xs).max(0), high(xs).min(width as i32 - 1));
    let (top, bottom) = (low(ys).max(0), high(ys).min(height as i32 - 1));
    // Most triangles of a fine mesh lie between the centers of pixels.
    if left > right || top > bottom {
        return;
    }
    let at = sorted.pieces.len() as u32;
    sorted.pieces.push(Piece { corners, triangle: triangle as u32 });
    for band in top as usize / BAND..=bottom as usize / BAND {
        sorted.bands[band].push(at);
    }
}

/// The first pixel whose center is not left of a coordinate.
fn first_centre(v: i32) -> i32 {
    (v + 127) >> 8
}

/// The last pixel whose center is not right of a coordinate.
fn last_centre(v: i32) -> i32 {
    (v - 128) >> 8
}

/// Twice the area of the triangle `a`, `b`, `(x, y)`: positive where the point lies to the right of a descending edge.
fn edge(a: Corner, b: Corner, x: i32, y: i32) -> i64 {
    let d = |u: i32, v: i32| i64::from(u) - i64::from(v);
    d(b.x, a.x) * d(y, a.y) - d(b.y, a.y) * d(x, a.x)
}

/// Whether pixels exactly on an edge belong to the triangle on its positive side.
fn owns(a: Corner, b: Corner) -> bool {
    a.y > b.y || (a.y == b.y && a.x < b.x)
}

fn fill(piece: &Piece, cells: &mut [(u32, f32)], width: usize, first_row: usize) {
    let [a, b, c] = piece.corners;
    let area = edge(a, b, c.x, c.y) as f32;
    let rows = cells.len() / width;
    let (min_x, max_x) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
    let (min_y, max_y) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
    let (left, right) = (first_centre(min_x).max(0), last_centre(max_x).min(width as i32 - 1));
    let top = first_centre(min_y).max(first_row as i32);
    let bottom = last_centre(max_y).min((first_row + rows) as i32 - 1);
    let (nearest, farthest) = (a.w.max(b.w).max(c.w), a.w.min(b.w).min(c.w));
    let edges = [(b, c), (c, a), (a, b)];
    let bias = edges.map(|(p, q)| i64::from(!owns(p, q)));
    let step = edges.map(|(p, q)| -256 * (i64::from(q.y) - i64::from(p.y)));
    for y in top..=bottom {
        let mut e: [i64; 3] =
            std::array::from_fn(|k| edge(edges[k].0, edges[k].1, left * 256 + 128, y * 256 + 128));
        let row = (y as usize - first_row) * width;
        for x in left..=right {
            if (0..3).all(|k| e[k] >= bias[k]) {
                // 1 / z is linear in the picture.
                let w = (e[0] as f32 * a.w + e[1] as f32 * b.w + e[2] as f32 * c.w) / area;
                let w = w.clamp(farthest, nearest);
                let cell = &mut cells[row + x as usize];
                if w > cell.1 {
                    *cell = (piece.triangle, w);
                }
            }
            (0..3).for_each(|k| e[k] += step[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::testing::{ball, room};
    use crate::render::vector::{along, cross, sub};

    /// The nearest triangle along a ray, by trying all: index and depth. `None` too where it is a matter of rounding.
    fn oracle(
        mesh: &MeshView<'_>,
        camera: &Camera,
        eye: [f32; 3],
        ray: [f32; 3],
    ) -> Option<Option<(u32, f32)>> {
        let mut best: Option<(u32, f32)> = None;
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(t).unwrap();
            let (ab, ac, to) = (sub(b, a), sub(c, a), sub(eye, a));
            let h = cross(ray, ac);
            let scale = dot(ab, h);
            let q = cross(to, ab);
            let (u, v, depth) = (dot(to, h) / scale, dot(ray, q) / scale, dot(ac, q) / scale);
            if scale.abs() < 1e-9 || (camera.cull_back && scale <= 0.0) || depth < camera.near {
                continue;
            }
            let inside = u.min(v).min(1.0 - u - v);
            if inside > -0.1 && inside < 0.02 {
                return None;
            }
            let cut = camera.cut.is_some_and(|cut| along(eye, ray, depth)[2] > cut);
            if inside > 0.0 && !cut && best.is_none_or(|b| depth < b.1) {
                best = Some((t as u32, depth));
            }
        }
        Some(best)
    }

    #[test]
    fn the_nearest_triangle_is_seen() {
        let (vertices, triangles) = ball(24, 14);
        let (walls, faces) = room([3.0, 4.0, 2.5]);
        let outside = Camera::new([2.5, -3.0, 1.0], [0.3, 0.0, 0.1]);
        let inside = Camera { near: 0.3, ..Camera::new([1.5, 0.4, 1.6], [0.5, 3.0, 0.9]) };
        for (vertices, triangles, camera) in [
            (&vertices, &triangles, outside),
            (&walls, &faces, inside),
            (
                &walls,
                &faces,
                Camera { cull_back: true, cut: Some(1.7), ..Camera::new([1.0, -3.0, 5.0], [1.5, 2.0, 1.0]) },
            ),
        ] {
            let mesh = MeshView { vertices, triangles, normals: &[], colors: &[] };
            let (width, height) = (120, 90);
            let projection = Projection::new(&camera, width, height);
            let visible = rasterize(&mesh, &camera, &projection, width, height);
            let mut compared = 0;
            for y in 0..height {
                for x in 0..width {
                    let ray = projection.ray([x as f32 + 0.5, y as f32 + 0.5]);
                    let Some(want) = oracle(&mesh, &camera, camera.eye, ray) else { continue };
                    compared += 1;
                    let at = y * width + x;
                    match want {
                        None => assert_eq!(visible.triangles[at], NOTHING, "{x} {y}"),
                        Some((t, depth)) => {
                            assert_eq!(visible.triangles[at], t, "{x} {y}");
                            let off = visible.nearness[at] * depth - 1.0;
                            assert!(off.abs() < 0.02, "{x} {y} {off}");
                        }
                    }
                }
            }
            assert!(compared > 4000, "{compared}");
        }
    }

    #[test]
    fn a_surface_has_no_cracks_and_no_pixel_twice() {
        // From inside every pixel is covered; and each by exactly one triangle, wherever edges run.
        let (vertices, triangles) = ball(60, 40);
        let mesh = MeshView { vertices: &vertices, triangles: &triangles, normals: &[], colors: &[] };
        let camera = Camera::new([0.1, 0.0, 0.05], [1.0, 0.3, 0.2]);
        let (width, height) = (317, 211);
        let projection = Projection::new(&camera, width, height);
        let mut sorted = Sorted { pieces: Vec::new(), bands: vec![Vec::new(); height.div_ceil(BAND)] };
        for t in 0..triangles.len() {
            place(&mesh, &camera, &projection, t, [width, height], &mut sorted);
        }
        let mut count = vec![0; width * height];
        for piece in &sorted.pieces {
            let mut cells = vec![(NOTHING, 0.0); width * height];
            fill(piece, &mut cells, width, 0);
            count.iter_mut().zip(&cells).for_each(|(n, c)| *n += i32::from(c.0 != NOTHING));
        }
        assert!(count.iter().all(|n| *n == 1), "{:?}", count.iter().filter(|n| **n != 1).count());
    }
}
