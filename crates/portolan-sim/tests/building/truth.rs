//! True surface and true free space, and scores of maps against them.
//!
//! The scores take closures, so that they work with any map.

use portolan::geom::vector::{along, distance, dot, norm, scale, sub};
use portolan::geom::{Aabb, Pose};
use portolan::scan::Frame;
use portolan_sim::building::{
    Body, BuildingConfig, BuildingSensor, Shape, SpinningLidar, World3, building_log,
};
use portolan_sim::{ErrorSummary, Random};

/// A point of the true surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfacePoint {
    /// The point (world, meters).
    pub(crate) point: [f64; 3],
    /// Unit normal, toward free space.
    pub(crate) normal: [f64; 3],
    /// Index of the body.
    pub(crate) body: usize,
}

/// Points of the surface of the union of all bodies within a box, uniform by area. O(tries): points inside other bodies and
/// outside the box are rejected; at most `1000 * count` are drawn.
pub(crate) fn surface_points(world: &World3, within: &Aabb<3>, count: usize, seed: u64) -> Vec<SurfacePoint> {
    let mut random = Random::stream(seed, 0x5u64);
    let mut sums = Vec::new();
    let mut whole = 0.0;
    for body in world.bodies() {
        whole += area(&body.shape);
        sums.push(whole);
    }
    let mut points = Vec::with_capacity(count);
    for _ in 0..count.saturating_mul(1000) {
        if points.len() == count {
            break;
        }
        let pick = whole * random.uniform();
        let body = sums.partition_point(|s| *s <= pick);
        let Some(b) = world.bodies().get(body) else { continue };
        let (point, normal) = surface_point(&b.shape, &mut random);
        // A step off the face lies in free space, unless another body covers it.
        if within.contains(point) && !world.is_inside(along(point, normal, 1e-6)) {
            points.push(SurfacePoint { point, normal, body });
        }
    }
    points
}

/// The surface points observed by at least one scan: a ray ended within `reach` meters, no body occludes the point from the
/// sensor, and the cosine of the angle of incidence is at least `least_cos`.
///
/// Points that no scan observed are unknown to any map. Surfaces at grazing incidence can be lost in maps updated ray by
/// ray, where rays that end beyond pass through the same cells. O(points x scans + end points).
pub(crate) fn seen_surface(
    world: &World3,
    points: &[SurfacePoint],
    scans: &[(Pose<3>, Frame)],
    reach: f64,
    least_cos: f64,
) -> Vec<SurfacePoint> {
    let cell = |p: [f64; 3]| p.map(|v| (v / reach).floor() as i64);
    let mut seen = vec![false; points.len()];
    for (pose, frame) in scans {
        let mut ends: Vec<_> =
            end_points(frame).map(|p| pose.transform_point(p)).map(|p| (cell(p), p)).collect();
        ends.sort_by_key(|e| e.0);
        let near = |p: [f64; 3]| {
            let c = cell(p);
            (0..27).any(|k: i64| {
                let there = [c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1];
                let first = ends.partition_point(|e| e.0 < there);
                ends[first..].iter().take_while(|e| e.0 == there).any(|e| distance(e.1, p) <= reach)
            })
        };
        for (s, seen) in points.iter().zip(&mut seen).filter(|(_, seen)| !**seen) {
            let way = sub(s.point, pose.translation);
            let length = norm(way);
            let direction = scale(way, 1.0 / length);
            if -dot(direction, s.normal) < least_cos {
                continue;
            }
            let open = world.cast_ray(pose.translation, direction).is_none_or(|h| h.range > length - 1e-6);
            *seen = open && near(s.point);
        }
    }
    points.iter().zip(seen).filter(|(_, seen)| *seen).map(|(s, _)| *s).collect()
}

/// The hits of a frame, in the sensor's frame.
fn end_points(frame: &Frame) -> Box<dyn Iterator<Item = [f64; 3]> + '_> {
    match frame {
        Frame::Points(scan) => Box::new(scan.points.iter().map(|p| p.map(f64::from))),
        Frame::Image(image) => Box::new(image.points().map(|(_, p)| p)),
    }
}

/// Points of free space crossed by at least one ray: each lies on a ray with a hit, at least `margin` meters before its true
/// end and from every surface. Fewer than `count` where too few are found.
///
/// Scans and rays are drawn uniformly, the position on a ray with the square of the range, as for a uniform density in
/// volume.
pub(crate) fn free_points(
    world: &World3,
    scans: &[(Pose<3>, Frame)],
    margin: f64,
    count: usize,
    seed: u64,
) -> Vec<[f64; 3]> {
    let mut random = Random::stream(seed, 0xF2EE);
    let rays: Vec<(usize, Vec<[f64; 3]>)> =
        scans.iter().enumerate().map(|(i, s)| (i, end_points(&s.1).collect())).collect();
    let longest = 12.0f64;
    let mut points = Vec::with_capacity(count);
    if rays.is_empty() {
        return points;
    }
    for _ in 0..count.saturating_mul(1000) {
        if points.len() == count {
            break;
        }
        let (scan, ends) = &rays[(random.uniform() * rays.len() as f64) as usize];
        let (pick, reach) = (random.uniform(), longest * libm::cbrt(random.uniform()));
        if ends.is_empty() {
            continue;
        }
        let pose = &scans[*scan].0;
        let end = pose.transform_point(ends[(pick * ends.len() as f64) as usize]);
        let length = distance(end, pose.translation);
        if reach > length - margin {
            continue;
        }
        let direction = scale(sub(end, pose.translation), 1.0 / length);
        // The noisy end may lie behind the surface; the ray ended at the true one.
        let true_length = world.cast_ray(pose.translation, direction).map_or(0.0, |h| h.range);
        let p = along(pose.translation, direction, reach);
        if reach <= true_length - margin && world.signed_distance(p) >= margin {
            points.push(p);
        }
    }
    points
}

/// Counts of the labels that a map gives to points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Labels {
    /// Number of free points.
    pub(crate) free: usize,
    /// Number of occupied points.
    pub(crate) occupied: usize,
    /// Number of unknown points.
    pub(crate) unknown: usize,
}

impl Labels {
    /// Share of free points.
    pub(crate) fn free_share(&self) -> f64 {
        self.free as f64 / (self.free + self.occupied + self.unknown).max(1) as f64
    }

    /// Share of occupied points.
    pub(crate) fn occupied_share(&self) -> f64 {
        self.occupied as f64 / (self.free + self.occupied + self.unknown).max(1) as f64
    }
}

/// Labels of points of true free space. `is_free` returns `None` where the map is unknown.
pub(crate) fn score_free(points: &[[f64; 3]], mut is_free: impl FnMut([f64; 3]) -> Option<bool>) -> Labels {
    let mut labels = Labels::default();
    points.iter().for_each(|&p| count(&mut labels, is_free(p)));
    labels
}

/// Labels of points of the true surface: occupied where the map is occupied at the point or one `voxel` (meters) beside it
/// along an axis, because noise puts hits of a surface into either of two cells; free where the point is free and all of
/// those are not occupied.
pub(crate) fn score_surface(
    points: &[SurfacePoint],
    voxel: f64,
    mut is_free: impl FnMut([f64; 3]) -> Option<bool>,
) -> Labels {
    let mut labels = Labels::default();
    for s in points {
        let beside = |k: usize| {
            let mut p = s.point;
            p[k % 3] += if k < 3 { voxel } else { -voxel };
            p
        };
        let here = is_free(s.point);
        let found = here == Some(false) || (0..6).any(|k| is_free(beside(k)) == Some(false));
        count(&mut labels, if found { Some(false) } else { here });
    }
    labels
}

fn count(labels: &mut Labels, is_free: Option<bool>) {
    match is_free {
        Some(true) => labels.free += 1,
        Some(false) => labels.occupied += 1,
        None => labels.unknown += 1,
    }
}

/// The error of a reconstructed surface: signed distances of its points to the true surface (meters), positive in free
/// space. `None` without points.
pub(crate) fn surface_errors(world: &World3, points: impl Iterator<Item = [f64; 3]>) -> Option<ErrorSummary> {
    ErrorSummary::of(points.map(|p| world.signed_distance(p)).collect())
}

/// Area of the surface (square meters).
fn area(shape: &Shape) -> f64 {
    let tau = std::f64::consts::TAU;
    match *shape {
        Shape::Box { half: [a, b, c], .. } => 8.0 * (a * b + b * c + c * a),
        Shape::Cylinder { radius, half_height, .. } => tau * radius * (2.0 * half_height + radius),
        Shape::Sphere { radius, .. } => 2.0 * tau * radius * radius,
    }
}

/// A random point of the surface, uniform by area, with its outward unit normal.
fn surface_point(shape: &Shape, random: &mut Random) -> ([f64; 3], [f64; 3]) {
    let turn = |random: &mut Random| {
        let angle = std::f64::consts::TAU * random.uniform();
        [libm::cos(angle), libm::sin(angle)]
    };
    match *shape {
        Shape::Box { world_from_box, half: [a, b, c] } => {
            // Pairs of faces across x, y, z.
            let areas = [b * c, c * a, a * b];
            let pick = random.uniform() * areas.iter().sum::<f64>();
            let axis = usize::from(pick >= areas[0]) + usize::from(pick >= areas[0] + areas[1]);
            let mut p = [a, b, c].map(|h| h * (2.0 * random.uniform() - 1.0));
            let mut normal = [0.0; 3];
            normal[axis] = if p[axis] < 0.0 { -1.0 } else { 1.0 };
            p[axis] = normal[axis] * [a, b, c][axis];
            (world_from_box.transform_point(p), world_from_box.rotate(normal))
        }
        Shape::Cylinder { centre, radius, half_height } => {
            let [x, y] = turn(random);
            let pick = (2.0 * half_height + radius) * random.uniform();
            if pick < 2.0 * half_height {
                ([0, 1, 2].map(|k| centre[k] + [radius * x, radius * y, pick - half_height][k]), [x, y, 0.0])
            } else {
                let r = radius * random.uniform().sqrt();
                let up = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
                ([0, 1, 2].map(|k| centre[k] + [r * x, r * y, up * half_height][k]), [0.0, 0.0, up])
            }
        }
        Shape::Sphere { centre, radius } => {
            let z = 2.0 * random.uniform() - 1.0;
            let [x, y] = turn(random);
            let r = (1.0 - z * z).max(0.0).sqrt();
            let normal = [r * x, r * y, z];
            (along(centre, normal, radius), normal)
        }
    }
}

#[test]
fn samples_are_where_they_say() {
    let lidar = SpinningLidar { rings: 32, columns: 360, ..Default::default() };
    let log = building_log(&BuildingConfig {
        scans: 8,
        sensor: BuildingSensor::Lidar(lidar),
        ..Default::default()
    });
    let world = &log.world;
    let inner = world.aabb().grown(-0.1);
    let surface = surface_points(world, &inner, 4000, 1);
    assert_eq!(surface.len(), 4000);
    for s in &surface {
        assert!(world.signed_distance(s.point).abs() < 1e-9 && inner.contains(s.point));
        assert!(world.signed_distance(along(s.point, s.normal, 1e-3)) > 0.0);
    }
    let seen = seen_surface(world, &surface, &log.scans, 0.1, 0.1);
    println!("{} of {} surface points seen", seen.len(), surface.len());
    assert!(seen.len() > 1000 && seen.len() < 4000);
    let free = free_points(world, &log.scans, 0.2, 3000, 1);
    assert_eq!(free.len(), 3000);
    assert!(free.iter().all(|&p| world.signed_distance(p) >= 0.2));
    // A perfect map scores perfectly, an empty map is unknown everywhere.
    let truth = |p| Some(world.signed_distance(p) > 0.05);
    assert_eq!(score_free(&free, truth).free_share(), 1.0);
    assert_eq!(score_surface(&surface, 0.1, truth).occupied_share(), 1.0);
    assert_eq!(score_free(&free, |_| None).unknown, 3000);
    assert_eq!(score_surface(&surface, 0.1, |_| Some(true)).free_share(), 1.0);
    let shifted = surface.iter().map(|s| along(s.point, s.normal, 2e-3));
    let errors = surface_errors(world, shifted).unwrap();
    assert!((errors.median - 2e-3).abs() < 1e-9 && errors.bias > 0.0);
}

#[test]
fn area_is_drawn_evenly() {
    // Half of a box is buried in another one: its points are those of what is left.
    let shape = |min, max| Body { name: String::new(), shape: Shape::between(min, max), color: [0; 3] };
    let world =
        World3::new(vec![shape([0.0; 3], [2.0, 1.0, 1.0]), shape([1.0, -1.0, -1.0], [4.0, 2.0, 2.0])]);
    let points = surface_points(&world, &world.aabb(), 40_000, 3);
    // 1 m of a bar of 1 m x 1 m with one end, and a block without the bar's end.
    let (bar, block) = (4.0 + 1.0, 2.0 * 9.0 + 4.0 * 9.0 - 1.0);
    let share = points.iter().filter(|s| s.body == 0).count() as f64 / points.len() as f64;
    assert!((share - bar / (bar + block)).abs() < 0.006, "{share}");
}
