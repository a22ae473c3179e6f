//! The kind of scene that a mesh shows, and informative views of it.

use super::camera::{Camera, Projection};
use super::mesh::MeshView;
use super::vector::{along, cross, dot, sub, unit_or};

/// The pose of a sensor. Of a camera with x right, y down, z forward: forward is z, up is -y. Of a spinning lidar: forward is
/// x, up is z. Of a scanner with parallel rays along -z: forward is -z, up is y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Position (coordinates of the mesh, meters).
    pub position: [f32; 3],
    /// Viewing direction.
    pub forward: [f32; 3],
    /// Up direction.
    pub up: [f32; 3],
}

/// A mesh as a scene: its up direction, whether it surrounds the sensors, its extent.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeshScene {
    /// Unit vector upward.
    pub(super) up: [f32; 3],
    /// Whether surfaces surround the sensors, as in rooms, and not the sensors an object.
    pub(super) inside: bool,
    /// Height of the ceiling above the sensors along `up` (meters); `None` without a ceiling.
    pub(super) ceiling: Option<f32>,
    /// A subset of the vertices, without outliers: what a view should contain.
    sample: Vec<[f32; 3]>,
    /// Centers, normals and areas of a subset of the triangles.
    faces: Vec<Face>,
    sensors: Vec<Sensor>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Face {
    middle: [f32; 3],
    normal: [f32; 3],
    area: f32,
}

/// Size of the subsets of triangles and vertices.
const THINNED: usize = 60_000;
/// Share of vertices at either end of every axis that a view need not contain, such as surfaces seen through windows.
const STRAYS: f32 = 0.015;

impl MeshScene {
    /// Analyzes a mesh and the poses of its sensors. O(size of the subsets + sensors).
    pub(super) fn of(mesh: &MeshView<'_>, sensors: &[Sensor], up: Option<[f32; 3]>) -> Self {
        let every = mesh.triangles.len().div_ceil(THINNED).max(1);
        let faces: Vec<Face> = (0..mesh.triangles.len())
            .step_by(every)
            .filter_map(|t| {
                let [a, b, c] = mesh.corners(t)?;
                let n = cross(sub(b, a), sub(c, a));
                let area = dot(n, n).sqrt();
                let middle = along(along(along([0.0; 3], a, 1.0 / 3.0), b, 1.0 / 3.0), c, 1.0 / 3.0);
                (area > 0.0 && area.is_finite()).then(|| Face { middle, normal: n.map(|v| v / area), area })
            })
            .collect();
        let up = up.unwrap_or_else(|| upwards(&faces, sensors));
        let mut scene =
            Self { up, inside: false, ceiling: None, sample: Vec::new(), faces, sensors: sensors.to_vec() };
        scene.sample = scene.without_strays();
        scene.inside = scene.is_inside();
        scene.ceiling = if scene.inside { scene.find_ceiling() } else { None };
        scene
    }

    /// Axes of the scene: two level ones, the first along its length, and up.
    fn axes(&self) -> [[f32; 3]; 3] {
        let aside = if self.up[0].abs() < 0.8 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let x = unit_or(cross(aside, self.up), [0.0, 1.0, 0.0]);
        let y = cross(self.up, x);
        // Walls come in pairs at right angles: four times their angle is the same for all of them.
        let (mut c, mut s) = (0.0f32, 0.0f32);
        for f in self.faces.iter().filter(|f| dot(f.normal, self.up).abs() < 0.3) {
            let (u, v) = (dot(f.normal, x), dot(f.normal, y));
            let four = 4.0 * v.atan2(u);
            c += f.area * four.cos();
            s += f.area * four.sin();
        }
        let angle = 0.25 * s.atan2(c);
        let (sin, cos) = angle.sin_cos();
        let mut length = along(x.map(|v| v * cos), y, sin);
        let mut width = cross(self.up, length);
        let extent = |axis: [f32; 3]| {
            let (low, high) = range(self.sample.iter().map(|p| dot(*p, axis)));
            high - low
        };
        if extent(width) > extent(length) {
            (length, width) = (width, length.map(|v| -v));
        }
        [length, width, self.up]
    }

    fn without_strays(&self) -> Vec<[f32; 3]> {
        let mut keep = vec![true; self.faces.len()];
        let [x, y] = {
            let aside = if self.up[0].abs() < 0.8 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            let x = unit_or(cross(aside, self.up), [0.0, 1.0, 0.0]);
            [x, cross(self.up, x)]
        };
        for axis in [x, y, self.up] {
            let mut along: Vec<f32> = self.faces.iter().map(|f| dot(f.middle, axis)).collect();
            let places = along.clone();
            along.sort_by(f32::total_cmp);
            let strays = (STRAYS * along.len() as f32) as usize;
            let Some((&low, &high)) = along.get(strays).zip(along.iter().rev().nth(strays)) else { continue };
            // A margin for surfaces only slightly farther out.
            let room = 0.06 * (high - low);
            for (k, v) in keep.iter_mut().zip(places) {
                *k &= low - room <= v && v <= high + room;
            }
        }
        self.faces.iter().zip(keep).filter(|(_, k)| *k).map(|(f, _)| f.middle).collect()
    }

    /// Most sensors have surfaces on every side, and not only before them.
    fn is_inside(&self) -> bool {
        let among = |s: &&Sensor| {
            (0..3).all(|k| {
                let beyond = self.sample.iter().filter(|p| p[k] > s.position[k]).count() as f32;
                let share = beyond / self.sample.len().max(1) as f32;
                (0.02..0.98).contains(&share)
            })
        };
        let some: Vec<&Sensor> =
            self.sensors.iter().step_by(self.sensors.len().div_ceil(50).max(1)).collect();
        2 * some.iter().filter(|s| among(s)).count() > some.len()
    }

    /// The height of most of the surface that faces down above the sensors.
    fn find_ceiling(&self) -> Option<f32> {
        let (_, sensors_high) = range(self.sensors.iter().map(|s| dot(s.position, self.up)));
        let mut down: Vec<(f32, f32)> = Vec::new();
        let mut floor = 0.0;
        for f in &self.faces {
            let (tilt, height) = (dot(f.normal, self.up), dot(f.middle, self.up));
            if tilt < -0.8 && height > sensors_high {
                down.push((height, f.area));
            } else if tilt > 0.8 && height < sensors_high {
                floor += f.area;
            }
        }
        down.sort_by(|a, b| a.0.total_cmp(&b.0));
        let whole: f32 = down.iter().map(|d| d.1).sum();
        if whole < 0.15 * floor || down.is_empty() {
            return None;
        }
        // The lowest tenth of it: beams hang below ceilings.
        let mut sum = 0.0;
        down.iter()
            .find(|d| {
                sum += d.1;
                sum > 0.1 * whole
            })
            .map(|d| d.0)
    }

    /// Of rooms: from above at about 45 degrees, along the longer side, with the ceiling removed. Of an object: from the side
    /// of its sensors. `aspect` is the width of the picture over its height.
    pub(super) fn overview(&self, aspect: f32) -> Camera {
        let back = if self.inside {
            // The side from which more of the surfaces face the viewer.
            let shown = |from: [f32; 3]| -> f32 {
                self.faces.iter().map(|f| f.area * dot(f.normal, from).max(0.0)).sum()
            };
            let sides = [-28.0, 28.0, 152.0, 208.0].map(|turn| self.direction(turn, 48.0));
            sides.into_iter().fold(sides[0], |a, b| if shown(b) > 1.0001 * shown(a) { b } else { a })
        } else {
            self.sensors_side()
        };
        self.seen_from(back, aspect)
    }

    /// Of an object: from its opposite side if that was observed, else from the pose of a sensor; and from above.
    pub(super) fn other_sides(&self, aspect: f32) -> Vec<Camera> {
        let front = self.sensors_side();
        let rise = dot(front, self.up);
        let other = along(front.map(|v| -v), self.up, 2.0 * rise);
        let above = unit_or(along(self.up, front, 0.15), self.up);
        // Of the surface that would be seen from there, so much faces the viewer.
        let (facing, all) = self.faces.iter().fold((0.0, 0.0), |(facing, all), f| {
            let shown = f.area * dot(f.normal, other);
            (facing + shown.max(0.0), all + shown.abs())
        });
        let second = match self.sensors.get(self.sensors.len() / 2) {
            Some(s) if facing < 0.35 * all => {
                Camera { up: self.up, ..Camera::new(s.position, along(s.position, s.forward, 1.0)) }
            }
            _ => self.seen_from(other, aspect),
        };
        vec![second, self.seen_from(above, aspect)]
    }

    /// Toward a viewer, from turn and rise (degrees) from straight before the longer side.
    fn direction(&self, turn: f32, rise: f32) -> [f32; 3] {
        let [length, width, up] = self.axes();
        let (sin, cos) = turn.to_radians().sin_cos();
        let level = along(width.map(|v| -v * cos), length, sin);
        let (sin, cos) = rise.to_radians().sin_cos();
        unit_or(along(level.map(|v| v * cos), up, sin), up)
    }

    /// Toward the sensors around an object, slightly from above.
    fn sensors_side(&self) -> [f32; 3] {
        let share = -1.0 / self.sensors.len().max(1) as f32;
        let mean = self.sensors.iter().fold([0.0; 3], |m, s| along(m, s.forward, share));
        let level = along(mean, self.up, -dot(mean, self.up));
        // Sensors all around have no side.
        if dot(level, level) < 0.1 {
            return self.direction(30.0, 25.0);
        }
        let rise = dot(unit_or(mean, self.up), self.up).clamp(0.25, 0.8);
        let level = unit_or(level, self.up).map(|v| v * (1.0 - rise * rise).sqrt());
        unit_or(along(level, self.up, rise), self.up)
    }

    fn seen_from(&self, back: [f32; 3], aspect: f32) -> Camera {
        let camera = Camera {
            up: self.up,
            field_of_view: 26f32.to_radians(),
            cut: self.ceiling.map(|c| c - 0.06 * (c - self.lowest()).abs()),
            cull_back: self.inside,
            ..Camera::new(back, [0.0; 3])
        };
        self.fitted(camera, back, aspect)
    }

    fn lowest(&self) -> f32 {
        range(self.sample.iter().map(|p| dot(*p, self.up))).0
    }

    /// Moves a camera back along its view until the scene fits the picture.
    fn fitted(&self, camera: Camera, back: [f32; 3], aspect: f32) -> Camera {
        let shown: Vec<[f32; 3]> = self
            .sample
            .iter()
            .filter(|p| camera.cut.is_none_or(|cut| dot(**p, self.up) <= cut))
            .copied()
            .collect();
        let axes = Camera { eye: back, target: [0.0; 3], ..camera }.axes();
        let tan = (0.5 * camera.field_of_view).tan() * 0.97;
        let spread = shown.iter().map(|p| axes.map(|a| dot(*p, a))).collect::<Vec<_>>();
        // For the picture's x and y: the planes through its edges are as far out as the outermost point.
        let limits = [tan * aspect, tan];
        let mut eye = [0.0f32; 3];
        let mut depth = f32::INFINITY;
        for k in 0..2 {
            let (_, high) = range(spread.iter().map(|p| p[k] - limits[k] * p[2]));
            let (_, low) = range(spread.iter().map(|p| -p[k] - limits[k] * p[2]));
            // x - t z <= high' and -x - t z <= low' for all points: the eye is where both edges meet.
            eye[k] = 0.5 * (high - low);
            depth = depth.min(-(high + low) / (2.0 * limits[k]));
        }
        if !depth.is_finite() {
            return Camera { eye: back, ..camera };
        }
        // Where the other axis asked for more room, the middle stays in the middle.
        let (nearest, farthest) = range(spread.iter().map(|p| p[2]));
        let middle_depth = 0.5 * (nearest + farthest);
        let place =
            |z: f32| std::array::from_fn(|k| eye[0] * axes[0][k] + eye[1] * axes[1][k] + z * axes[2][k]);
        let near = (0.5 * (nearest - depth)).max(1e-3);
        Camera { eye: place(depth), target: place(middle_depth), near, ..camera }
    }

    /// Of rooms: up to `count` views from sensors, far from each other, that show most of the surface. Empty for objects.
    pub(super) fn inside_views(&self, count: usize) -> Vec<Camera> {
        let mut scored: Vec<(f32, Camera)> = Vec::new();
        if !self.inside {
            return Vec::new();
        }
        let every = self.sensors.len().div_ceil(40).max(1);
        for s in self.sensors.iter().step_by(every) {
            for quarter in 0..4 {
                let level = unit_or(along(s.forward, self.up, -dot(s.forward, self.up)), [1.0, 0.0, 0.0]);
                let aside = cross(self.up, level);
                let (sin, cos) = (0.4 + quarter as f32 * std::f32::consts::FRAC_PI_2).sin_cos();
                let ahead = along(level.map(|v| v * cos), aside, sin);
                let target = along(along(s.position, ahead, 3.0), self.up, -0.55);
                let camera = Camera {
                    up: self.up,
                    field_of_view: 62f32.to_radians(),
                    cull_back: true,
                    ..Camera::new(s.position, target)
                };
                scored.push((self.worth(&camera), camera));
            }
        }
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut chosen: Vec<Camera> = Vec::new();
        let apart = |a: &Camera, b: &Camera| {
            let gap = sub(a.eye, b.eye);
            let turned = dot(a.axes()[2], b.axes()[2]);
            dot(gap, gap).sqrt() > 2.0 || turned < 0.0
        };
        for (_, camera) in &scored {
            if chosen.len() < count && chosen.iter().all(|c| apart(c, camera)) {
                chosen.push(*camera);
            }
        }
        chosen
    }

    /// A score of a view: the share of a coarse picture with surfaces that face it, near ones with less weight.
    fn worth(&self, camera: &Camera) -> f32 {
        const SIZE: [usize; 2] = [32, 22];
        let projection = Projection::new(camera, SIZE[0], SIZE[1]);
        let mut cells = vec![(f32::INFINITY, 0.0f32); SIZE[0] * SIZE[1]];
        for f in &self.faces {
            let p = projection.view(f.middle);
            if p[2] < 0.1 {
                continue;
            }
            let [x, y] = projection.pixel(p);
            if x < 0.0 || y < 0.0 || x >= SIZE[0] as f32 || y >= SIZE[1] as f32 {
                continue;
            }
            let cell = &mut cells[y as usize * SIZE[0] + x as usize];
            if p[2] < cell.0 {
                let facing = dot(f.normal, sub(camera.eye, f.middle)) > 0.0;
                *cell = (p[2], if facing { (p[2] / 3.0).min(1.0) } else { 0.0 });
            }
        }
        cells.iter().map(|c| c.1).sum()
    }
}

/// The up direction of the sensors, corrected by the floor: the mean normal of surfaces level within 35 degrees.
fn upwards(faces: &[Face], sensors: &[Sensor]) -> [f32; 3] {
    let sum = sensors.iter().fold([0.0; 3], |m, s| along(m, s.up, 1.0));
    let mut up = unit_or(sum, [0.0, 0.0, 1.0]);
    // Of a ball, which has no floor, 9, 3 and 1 % of the area lie so near to level.
    for (cone, least) in [(0.82f32, 0.13), (0.94, 0.09), (0.98, 0.06), (0.99, 0.05)] {
        let level = faces.iter().filter(|f| dot(f.normal, up) > cone);
        let (mean, area) = level.fold(([0.0; 3], 0.0), |(m, a), f| (along(m, f.normal, f.area), a + f.area));
        let whole: f32 = faces.iter().map(|f| f.area).sum();
        if area < least * whole {
            break;
        }
        up = unit_or(mean, up);
    }
    up
}

fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::testing::{ball, room};

    fn sensor(position: [f32; 3], forward: [f32; 3]) -> Sensor {
        Sensor { position, forward, up: [0.1, -0.05, 1.0] }
    }

    #[test]
    fn a_room_is_seen_from_above_without_its_ceiling() {
        let (vertices, triangles) = room([4.0, 7.0, 2.5]);
        let mesh = MeshView { vertices: &vertices, triangles: &triangles, normals: &[], colors: &[] };
        let sensors = [sensor([1.0, 2.0, 1.2], [0.0, 1.0, 0.0]), sensor([2.0, 4.0, 1.4], [0.0, 1.0, 0.0])];
        let scene = MeshScene::of(&mesh, &sensors, None);
        assert!(scene.inside);
        assert!(scene.up[2] > 0.9999, "{:?}", scene.up);
        assert!((scene.ceiling.unwrap() - 2.5).abs() < 0.01);
        let [length, ..] = scene.axes();
        assert!(length[1].abs() > 0.999, "{length:?}");
        let camera = scene.overview(1.5);
        assert!(camera.cull_back && camera.cut.unwrap() < 2.5 && camera.eye[2] > 5.0);
        // All of it is in the picture, which it fills from one side to the other.
        let projection = Projection::new(&camera, 300, 200);
        let pixels: Vec<_> = vertices
            .iter()
            .filter(|v| v[2] < camera.cut.unwrap())
            .map(|v| projection.pixel(projection.view(*v)))
            .collect();
        let (left, right) = range(pixels.iter().map(|p| p[0]));
        let (top, bottom) = range(pixels.iter().map(|p| p[1]));
        assert!(left > 0.0 && right < 300.0 && top > 0.0 && bottom < 200.0);
        assert!(right - left > 270.0 || bottom - top > 180.0, "{left} {right} {top} {bottom}");
        let views = scene.inside_views(2);
        assert_eq!(views.len(), 2);
        assert!(views.iter().all(|v| sensors.iter().any(|s| s.position == v.eye)));
    }

    #[test]
    fn an_object_is_seen_from_its_sensors_side() {
        let (vertices, triangles) = ball(60, 40);
        let mesh = MeshView { vertices: &vertices, triangles: &triangles, normals: &[], colors: &[] };
        let sensors: Vec<_> = (0..9)
            .map(|i| 0.2 * i as f32 - 0.8)
            .map(|a| sensor([4.0 * a.cos(), 4.0 * a.sin(), 1.0], [-a.cos(), -a.sin(), -0.2]))
            .collect();
        let scene = MeshScene::of(&mesh, &sensors, None);
        assert!(!scene.inside && scene.ceiling.is_none());
        let camera = scene.overview(1.0);
        assert!(camera.eye[0] > 2.0 && camera.eye[1].abs() < 1.0 && camera.eye[2] > 0.5, "{camera:?}");
        assert!(!camera.cull_back && scene.inside_views(2).is_empty());
        assert_eq!(scene.other_sides(1.0).len(), 2);
        // Without any sensor too.
        assert!(!MeshScene::of(&mesh, &[], None).inside);
    }

    #[test]
    fn an_empty_mesh_has_views_too() {
        let empty = MeshView { vertices: &[], triangles: &[], normals: &[], colors: &[] };
        let scene = MeshScene::of(&empty, &[sensor([0.0; 3], [1.0, 0.0, 0.0])], None);
        assert!(scene.overview(1.0).eye.iter().all(|v| v.is_finite()));
    }
}
