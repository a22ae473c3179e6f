//! Lighting of the visible triangles.

use super::camera::{Camera, Projection};
use super::mesh::MeshView;
use super::occlusion::{Surface, openness, outline};
use super::parallel;
use super::raster::{NOTHING, Visible, rasterize};
use super::vector::{along, cross, dot, sub, unit_or};
use crate::{Canvas, color};

/// Samples along each side of a pixel.
const SUPER: usize = 2;
/// Paint of surfaces seen from behind (linear).
const BEHIND: [f32; 3] = [0.36, 0.19, 0.14];

/// Renders a mesh on white: a light from the upper left and a weaker one from the right, ambient light from above, ambient
/// occlusion and outlines. Back faces are brownish. Pixels do not depend on the number of threads.
///
/// O(triangles + pixels); a million triangles on 1600 x 1000 pixels take about half a second on two cores.
pub fn render_mesh(mesh: &MeshView<'_>, camera: &Camera, width: u32, height: u32) -> Canvas {
    let mesh = &mesh.without_constant_color();
    let mut canvas = Canvas::new(width, height);
    let (columns, rows) = (canvas.width() as usize, canvas.height() as usize);
    let smooth = if mesh.normals.len() == mesh.vertices.len() { Vec::new() } else { mesh.smooth_normals() };
    let normals = if smooth.is_empty() { mesh.normals } else { &smooth };
    let projection = Projection::new(camera, SUPER * columns, SUPER * rows);
    let visible = rasterize(mesh, camera, &projection, SUPER * columns, SUPER * rows);
    let shading = Shading { mesh, normals, projection, tint: Tint::of(mesh, camera), up: camera.upwards() };
    let open = openness(&shading.surface(&visible, columns, rows), &Projection::new(camera, columns, rows));
    let paper = [color::PAPER.r, color::PAPER.g, color::PAPER.b].map(to_linear);
    let mut pixels = vec![[0u8; 3]; columns * rows];
    parallel::chunks(&mut pixels, columns, |row, out| {
        for (column, pixel) in out.iter_mut().enumerate() {
            let mut sum = [0.0; 3];
            for sub in 0..SUPER * SUPER {
                let (x, y) = (SUPER * column + sub % SUPER, SUPER * row + sub / SUPER);
                let light = match visible.triangles[y * visible.width + x] {
                    NOTHING => paper,
                    t => {
                        let dark = 1.0 - 0.45 * outline(&visible, x, y);
                        shading.light(t as usize, x, y, open[row * columns + column]).map(|v| v * dark)
                    }
                };
                sum = along(sum, light, 1.0 / (SUPER * SUPER) as f32);
            }
            *pixel = sum.map(to_srgb);
        }
    });
    canvas.paste(0, 0, columns, &pixels);
    canvas
}

struct Shading<'a> {
    mesh: &'a MeshView<'a>,
    normals: &'a [[f32; 3]],
    projection: Projection,
    tint: Tint,
    up: [f32; 3],
}

/// The hit of a ray on a triangle.
struct Hit {
    /// Barycentric coordinates.
    shares: [f32; 3],
    /// Unit normal toward the viewer.
    normal: [f32; 3],
    behind: bool,
    ray: [f32; 3],
}

impl Shading<'_> {
    /// The intersection of the ray of a sample with the plane of a triangle (Moeller & Trumbore 1997).
    fn meet(&self, triangle: usize, x: usize, y: usize) -> Option<Hit> {
        let [a, b, c] = self.mesh.corners(triangle)?;
        let ray = self.projection.ray([x as f32 + 0.5, y as f32 + 0.5]);
        let (ab, ac, to) = (sub(b, a), sub(c, a), sub(self.projection.eye, a));
        let h = cross(ray, ac);
        let scale = dot(ab, h);
        let q = cross(to, ab);
        let (u, v) = (dot(to, h) / scale, dot(ray, q) / scale);
        // Rounding puts samples on an edge a little outside.
        let (u, v) = if u.is_finite() && v.is_finite() {
            (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))
        } else {
            (1.0 / 3.0, 1.0 / 3.0)
        };
        let shares = [(1.0 - u - v).max(0.0), u, v];
        let face = cross(ab, ac);
        let behind = dot(face, ray) > 0.0;
        let corners = self.mesh.triangles[triangle].map(|i| self.normals[i as usize]);
        let normal = unit_or(mix(corners, shares), face);
        let normal = if behind { normal.map(|v| -v) } else { normal };
        // A smooth normal may turn away from the viewer where the face does not.
        let ray = unit_or(ray, [1.0, 0.0, 0.0]);
        let away = dot(normal, ray).max(0.0);
        Some(Hit { shares, normal: unit_or(along(normal, ray, -1.02 * away), face), behind, ray })
    }

    fn surface(&self, visible: &Visible, width: usize, height: usize) -> Surface {
        let nearest = parallel::map(height, |row| {
            let of = |column: usize| {
                let (x, y) = (0..SUPER * SUPER)
                    .map(|s| (SUPER * column + s % SUPER, SUPER * row + s / SUPER))
                    .max_by(|a, b| {
                        let w = |p: &(usize, usize)| visible.nearness[p.1 * visible.width + p.0];
                        w(a).total_cmp(&w(b))
                    })
                    .unwrap_or_default();
                let at = y * visible.width + x;
                let normal = match visible.triangles[at] {
                    NOTHING => None,
                    t => self.meet(t as usize, x, y),
                };
                let normal =
                    normal.map_or([0.0, 0.0, -1.0], |m| self.projection.axes.map(|a| dot(a, m.normal)));
                (visible.nearness[at], normal)
            };
            (0..width).map(of).collect::<Vec<_>>()
        });
        let (nearness, normals) = nearest.into_iter().flatten().unzip();
        Surface { width, height, nearness, normals }
    }

    /// Linear light from a sample.
    fn light(&self, triangle: usize, x: usize, y: usize, open: f32) -> [f32; 3] {
        let Some(hit) = self.meet(triangle, x, y) else { return [0.0; 3] };
        let [right, down, _] = self.projection.axes;
        let to_eye = hit.ray.map(|v| -v);
        let lamp = |aside: f32, above: f32| unit_or(along(along(to_eye, right, aside), down, -above), to_eye);
        let key = dot(hit.normal, lamp(-0.55, 0.65)).max(0.0);
        let fill = dot(hit.normal, lamp(0.9, 0.1)).max(0.0);
        let sky = 0.5 + 0.5 * dot(hit.normal, self.up);
        let strength = open * (0.24 + 0.20 * sky) + (0.4 + 0.6 * open) * (0.50 * key + 0.16 * fill);
        let paint = if hit.behind { BEHIND } else { self.paint(triangle, hit.shares) };
        paint.map(|v| v * strength)
    }

    fn paint(&self, triangle: usize, shares: [f32; 3]) -> [f32; 3] {
        let corners = self.mesh.triangles[triangle];
        if !self.mesh.colors.is_empty() {
            return mix(corners.map(|i| self.mesh.colors[i as usize].map(to_linear)), shares);
        }
        let height = corners.map(|i| dot(self.mesh.vertices[i as usize], self.up));
        self.tint.at((0..3).map(|k| height[k] * shares[k]).sum())
    }
}

/// Paint by height: sand below, sage in the middle, slate above.
struct Tint {
    low: f32,
    high: f32,
}

impl Tint {
    /// Between the heights that only a fiftieth of all vertices lie below or above.
    fn of(mesh: &MeshView<'_>, camera: &Camera) -> Self {
        let up = camera.upwards();
        let every = (mesh.vertices.len() / 20_000).max(1);
        let mut heights: Vec<f32> = mesh.vertices.iter().step_by(every).map(|v| dot(*v, up)).collect();
        heights.retain(|h| h.is_finite() && camera.cut.is_none_or(|cut| *h < cut));
        heights.sort_by(f32::total_cmp);
        let last = heights.len().saturating_sub(1);
        let at = |share: f32| heights.get((share * last as f32) as usize).copied().unwrap_or(0.0);
        Self { low: at(0.02), high: at(0.98) }
    }

    fn at(&self, height: f32) -> [f32; 3] {
        const STOPS: [[f32; 3]; 4] =
            [[0.80, 0.71, 0.57], [0.74, 0.74, 0.62], [0.50, 0.66, 0.64], [0.36, 0.50, 0.66]];
        let t = ((height - self.low) / (self.high - self.low).max(1e-6)).clamp(0.0, 1.0) * 3.0;
        let stop = (t as usize).min(2);
        let rest = t - stop as f32;
        std::array::from_fn(|k| STOPS[stop][k] + rest * (STOPS[stop + 1][k] - STOPS[stop][k]))
    }
}

fn mix(corners: [[f32; 3]; 3], shares: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|k| (0..3).map(|i| shares[i] * corners[i][k]).sum())
}

/// Squares and roots stand in for the curves of sRGB: nobody sees the difference here.
fn to_linear(v: u8) -> f32 {
    let v = f32::from(v) / 255.0;
    v * v
}

fn to_srgb(v: f32) -> u8 {
    (255.0 * v.clamp(0.0, 1.0).sqrt()).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::testing::{ball, room};

    #[test]
    fn pixels_do_not_depend_on_threads() {
        let (vertices, triangles) = ball(60, 40);
        let mesh = MeshView { vertices: &vertices, triangles: &triangles, normals: &[], colors: &[] };
        let camera = Camera::new([3.0, -2.0, 1.5], [0.0; 3]);
        #[cfg(feature = "parallel")]
        {
            let on = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| render_mesh(&mesh, &camera, 200, 150).encode_png())
            };
            assert!(on(1) == on(4));
        }
        assert_eq!(render_mesh(&mesh, &camera, 200, 150).width(), 200);
    }

    #[test]
    fn light_comes_from_the_upper_left_and_colours_stay() {
        let (vertices, triangles) = ball(60, 40);
        // Not all the same: a constant color is ignored.
        let red: Vec<_> = (0..vertices.len()).map(|i| [200 + (i % 2) as u8, 40, 40]).collect();
        let mesh = MeshView { vertices: &vertices, triangles: &triangles, normals: &[], colors: &red };
        let picture = render_mesh(&mesh, &Camera::new([0.0, -4.0, 0.0], [0.0; 3]), 100, 100);
        let (lit, shaded) = (picture.pixel(40, 40), picture.pixel(60, 60));
        assert!(lit.r > shaded.r && lit.r > 2 * lit.g && shaded.r > 2 * shaded.g, "{lit:?} {shaded:?}");
        assert_eq!(picture.pixel(2, 2), color::PAPER);
    }

    #[test]
    fn surfaces_from_behind_are_told_apart_or_left_out() {
        let (vertices, triangles) = room([4.0, 3.0, 2.5]);
        let mesh = MeshView { vertices: &vertices, triangles: &triangles, normals: &[], colors: &[] };
        let outside = Camera::new([2.0, -6.0, 5.0], [2.0, 1.5, 1.2]);
        let behind = render_mesh(&mesh, &outside, 80, 60).pixel(40, 30);
        assert!(f64::from(behind.r) > 1.25 * f64::from(behind.b), "{behind:?}");
        let open = render_mesh(&mesh, &Camera { cull_back: true, ..outside }, 80, 60).pixel(40, 30);
        assert!(open != color::PAPER && open != behind);
        // Everything above the floor is cut: only the floor is left.
        let cut = Camera { cut: Some(-1.0), ..outside };
        assert_eq!(render_mesh(&mesh, &cut, 80, 60).pixel(40, 30), color::PAPER);
    }

    #[test]
    fn nothing_and_nonsense_are_drawn_as_paper() {
        let camera = Camera::new([0.0, -4.0, 0.0], [0.0; 3]);
        let empty = MeshView { vertices: &[], triangles: &[], normals: &[], colors: &[] };
        assert_eq!(render_mesh(&empty, &camera, 9, 7).pixel(4, 3), color::PAPER);
        let vertices =
            [[f32::NAN; 3], [1e38, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, f32::INFINITY, 0.0], [0.0; 3]];
        let triangles = [[0, 1, 2], [2, 3, 4], [4, 4, 4], [0, 9, u32::MAX], [1, 2, 4]];
        let colors = [[9; 3]; 2];
        let mesh =
            MeshView { vertices: &vertices, triangles: &triangles, normals: &[[0.0; 3]], colors: &colors };
        for camera in [
            camera,
            Camera { eye: [f32::NAN; 3], ..camera },
            Camera { target: camera.eye, ..camera },
            Camera { up: [0.0; 3], field_of_view: 0.0, near: -1.0, cut: Some(f32::NAN), ..camera },
        ] {
            render_mesh(&mesh, &camera, 33, 65);
        }
    }
}
