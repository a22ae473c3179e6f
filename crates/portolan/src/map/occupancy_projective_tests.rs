//! The projective sweep against its definition and against truth.

use super::Occupancy;
use crate::cell::{LogOdds8, OccupancyModel, Planes};
use crate::geom::vector::{norm, sub};
use crate::geom::{BlockKey, Lattice, Pose};
use crate::scan::{Bridges, Frame, Orthographic, Pinhole, PointScan, Projection, RangeImage, Spherical};
use crate::store::Store;
use crate::sweep::OccupancySweep;
use crate::testing::with_threads;
use std::f64::consts::TAU;

type Map = Occupancy<3>;

const LATTICE: Lattice<3> = Lattice { origin: [0.0; 3], resolution: 0.1 };

fn map(sweep: OccupancySweep) -> Map {
    Map::new(LATTICE, OccupancyModel::default()).unwrap().with_sweep(sweep)
}

/// Distance to the walls of a room of 8 m x 6 m x 2.6 m about the origin with a table and a pillar in it.
fn room(o: [f64; 3], d: [f64; 3]) -> f64 {
    let slab = |low: [f64; 3], high: [f64; 3]| {
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            let (a, b) = ((low[k] - o[k]) / d[k], (high[k] - o[k]) / d[k]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near, far)
    };
    let inside = slab([-4.0, -3.0, -1.3], [4.0, 3.0, 1.3]).1;
    [([1.0, 0.7, -0.6], [2.1, 1.9, -0.55]), ([-2.0, -1.6, -1.3], [-1.7, -1.3, 1.3])]
        .into_iter()
        .map(|(low, high)| slab(low, high))
        .filter(|(near, far)| near <= far && *near > 0.0)
        .fold(inside, |t, (near, _)| t.min(near))
}

fn spherical() -> Spherical {
    let elevations = (0..48).map(|i| 0.42 - 0.84 * i as f32 / 47.0).collect();
    Spherical { elevations, first_azimuth: 0.3, azimuth_step: -TAU / 700.0 }
}

fn image(projection: Projection, columns: usize, rows: usize) -> RangeImage {
    RangeImage::new(projection, columns, rows, vec![0.0; columns * rows])
}

/// What a sensor at `pose` sees of the room.
fn look(mut image: RangeImage, pose: &Pose<3>) -> RangeImage {
    for i in 0..image.values.len() {
        let ray = image.ray((i % image.columns) as f64, i / image.columns);
        image.values[i] = room(pose.translation, pose.rotate(ray)) as f32;
    }
    image
}

fn poses() -> Vec<Pose<3>> {
    (0..6)
        .map(|i| {
            let (a, t) = (0.4 * f64::from(i), f64::from(i));
            let (tilt, yaw) = (about_x(0.05 * a), a);
            let turn = [[yaw.cos(), -yaw.sin(), 0.0], [yaw.sin(), yaw.cos(), 0.0], [0.0, 0.0, 1.0]];
            let rotation = (Pose { rotation: turn, translation: [0.0; 3] } * tilt).rotation;
            Pose { rotation, translation: [0.41 * t - 1.0, 0.13 * t, 0.05 * a] }
        })
        .collect()
}

/// A turn about x.
fn about_x(a: f64) -> Pose<3> {
    let rotation = [[1.0, 0.0, 0.0], [0.0, a.cos(), -a.sin()], [0.0, a.sin(), a.cos()]];
    Pose { rotation, translation: [0.0; 3] }
}

fn observed(map: &Map) -> Vec<([i32; 3], LogOdds8)> {
    let mut all = Vec::new();
    for key in map.store().keys() {
        let brick = map.store().brick(key).unwrap();
        all.extend((0..512).filter_map(|i| Some((key.cell(i), brick.get(i)?))));
    }
    all
}

/// What the four readings around a pixel coordinate have there: 1 / value is linear on a plane, values are where rays are
/// parallel. `None` where one has no reading.
fn between_readings(image: &RangeImage, column: f64, row: f64) -> Option<f64> {
    let closed = matches!(image.projection, Projection::Spherical(_)) && image.is_full_turn();
    let linear = |v: f64| if image.has_parallel_rays() { v } else { 1.0 / v };
    let mut sum = 0.0;
    for k in 0..4 {
        let (c, r) = (column.floor() as i64 + k % 2, row.floor() as i64 + k / 2);
        let weight = (1.0 - (column - c as f64).abs()) * (1.0 - (row - r as f64).abs());
        let c = if closed { c.rem_euclid(image.columns as i64) } else { c };
        if !(0..image.columns as i64).contains(&c) || !(0..image.rows as i64).contains(&r) {
            return None;
        }
        let v = f64::from(image.values[r as usize * image.columns + c as usize]);
        sum += weight * (v > 0.0).then(|| linear(v))?;
    }
    Some(linear(sum))
}

/// Each cell that was lowered is seen past by every beam within its width that has a reading, and by at least one; or it is half a
/// cell before what the four readings around it have there.
fn frees_only_what_was_seen(image: &RangeImage, pose: &Pose<3>) {
    let mut map = map(OccupancySweep::Auto);
    map.integrate(pose, &Frame::Image(image.clone())).unwrap();
    let sensor_from_world = pose.inverse();
    // Single pixels without a reading between two of one surface have what is between those.
    let mut bridged = image.clone();
    if let Projection::Spherical(rays) = &image.projection {
        Bridges::of(rays, image.is_full_turn()).fill(&mut bridged.values, image.columns);
    }
    let mut freed = 0;
    for (cell, value) in observed(&map).into_iter().filter(|c| c.1.0 < 0) {
        let p = sensor_from_world.transform_point(LATTICE.center(cell));
        let (column, row, depth, half) = pixel(image, p);
        let closed = matches!(image.projection, Projection::Spherical(_));
        let (mut seen, mut nearest) = (0, f64::INFINITY);
        // The four beams about the center and all within half a cell, less a hundredth of a pixel for rounding.
        let reach = |at: f64, half: f64| {
            let low = (at - half + 0.02).ceil().min((at + 0.02).floor());
            low as i64..=(at + half - 0.02).floor().max((at - 0.02).ceil()) as i64
        };
        for r in reach(row, half[1]) {
            for c in reach(column, half[0]) {
                let c = if closed { c.rem_euclid(image.columns as i64) } else { c };
                if (0..image.rows as i64).contains(&r) && (0..image.columns as i64).contains(&c) {
                    let v = f64::from(image.values[r as usize * image.columns + c as usize].abs());
                    if v > 0.0 {
                        seen += 1;
                        nearest = nearest.min(v);
                    }
                }
            }
        }
        assert!(seen > 0, "{cell:?} was freed by no beam");
        // Pixel coordinates are rounded to a hundredth: at a pixel's middle either square may count.
        let aside = [-0.02, 0.0, 0.02];
        let before_surface = aside
            .into_iter()
            .flat_map(|u| aside.map(|v| (column + u, row + v)))
            .any(|(c, r)| between_readings(&bridged, c, r).is_some_and(|v| v > depth + 0.05 - 1e-2));
        let is_before = nearest > depth + 0.05 - 1e-4 || before_surface;
        assert!(is_before, "{cell:?} at {depth} was freed through {nearest}: {value:?}");
        freed += 1;
    }
    assert!(freed > 300, "{freed}");
}

/// Pixel coordinates, depth, and pixels in half a cell.
fn pixel(image: &RangeImage, p: [f64; 3]) -> (f64, f64, f64, [f64; 2]) {
    match &image.projection {
        Projection::Spherical(s) => {
            let (depth, across) = (norm(p), p[0].hypot(p[1]));
            let e: Vec<f64> = s.elevations.iter().map(|&e| f64::from(e)).collect();
            let (step, turn) = (e[0] - e[1], TAU / s.azimuth_step.abs());
            let column = ((p[1].atan2(p[0]) - s.first_azimuth) / s.azimuth_step).rem_euclid(turn);
            let row = (e[0] - (p[2] / depth).asin()) / step;
            (column, row, depth, [0.05 / across / s.azimuth_step.abs(), 0.05 / depth / step])
        }
        Projection::Pinhole(c) => {
            let half = [c.fx * 0.05 / p[2], c.fy * 0.05 / p[2]];
            (c.fx * p[0] / p[2] + c.cx, c.fy * p[1] / p[2] + c.cy, p[2], half)
        }
        Projection::Orthographic { rays, top } => {
            let at = |k: usize| (p[k] - rays.first[k]) / rays.step[k];
            (at(0), at(1), top - p[2], [0.05 / rays.step[0].abs(), 0.05 / rays.step[1].abs()])
        }
    }
}

fn camera() -> Projection {
    Projection::Pinhole(Pinhole { fx: 130.0, fy: 130.0, cx: 79.5, cy: 59.5 })
}

#[test]
fn frees_only_what_beams_saw() {
    for pose in poses() {
        let mut lidar = look(image(Projection::Spherical(spherical()), 700, 48), &pose);
        frees_only_what_was_seen(&lidar, &pose);
        let mut depth = look(image(camera(), 160, 120), &pose);
        frees_only_what_was_seen(&depth, &pose);
        // Holes, and pixels without a surface.
        for (image, last) in [(&mut lidar, 400), (&mut depth, 100)] {
            for (i, v) in image.values.iter_mut().enumerate() {
                let kept = [-1.0, 1.0, 1.0, 1.0, 1.0][i % 5];
                *v *= if i % image.columns > last || i % 7 == 0 { 0.0 } else { kept };
            }
        }
        frees_only_what_was_seen(&lidar, &pose);
        frees_only_what_was_seen(&depth, &pose);
    }
}

#[test]
fn parallel_rays_free_what_is_above_the_surface() {
    let rays = Orthographic { first: [-2.0, -2.0], step: [0.04, 0.04] };
    let mut scanner = image(Projection::Orthographic { rays, top: 3.0 }, 100, 100);
    scanner.values.iter_mut().enumerate().for_each(|(i, v)| *v = if i % 100 < 70 { 2.5 } else { 1.5 });
    frees_only_what_was_seen(&scanner, &Pose::IDENTITY);
    let mut map = map(OccupancySweep::Auto);
    map.integrate(&Pose::IDENTITY, &Frame::Image(scanner)).unwrap();
    assert_eq!(map.is_occupied([-10, 0, 5]), Some(true));
    assert_eq!(map.is_occupied([-10, 0, 20]), Some(false));
    assert_eq!(map.is_occupied([15, 0, 10]), None);
}

/// No cell in which a beam ends is ever lowered, and nothing is hit but those.
#[test]
fn cells_with_a_return_are_raised() {
    let (mut map, mut exact) = (map(OccupancySweep::Auto), map(OccupancySweep::Exact));
    for pose in poses() {
        let seen = look(image(Projection::Spherical(spherical()), 700, 48), &pose);
        let points = seen.points().map(|(_, p)| p.map(|v| v as f32));
        let frame = Frame::Points(PointScan::new(points, [0.0; 3]));
        let before = map.clone();
        map.integrate(&pose, &frame).unwrap();
        exact.integrate(&pose, &frame).unwrap();
        let Frame::Points(scan) = &frame else { unreachable!() };
        let mut hit = std::collections::HashSet::new();
        for p in &scan.points {
            hit.insert(LATTICE.cell_of(pose.transform_point(p.map(f64::from))).unwrap());
        }
        for (cell, after) in observed(&map) {
            let was = before.store().cell(cell).map_or(0, |v| v.0);
            let is_hit = hit.contains(&cell);
            assert!(if is_hit { after.0 > was || was == 127 } else { after.0 <= was }, "{cell:?}");
        }
    }
    // Nearly all that exact rays free is freed here, too.
    let free = |map: &Map| observed(map).iter().filter(|c| c.1.0 < 0).map(|c| c.0).collect::<Vec<_>>();
    let by_rays = free(&exact);
    let both = by_rays.iter().filter(|c| map.is_occupied(**c) == Some(false)).count();
    assert!(both * 100 >= by_rays.len() * 93, "{both} of {}", by_rays.len());
}

/// True free space is free and true surfaces are not, at 5 cm with a noise of 1 cm.
#[test]
fn truth() {
    let lattice = Lattice { origin: [0.0; 3], resolution: 0.05 };
    let mut map = Map::new(lattice, OccupancyModel::default()).unwrap();
    let mut seed = 7u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    for _ in 0..3 {
        for pose in poses() {
            let mut seen = look(image(Projection::Spherical(spherical()), 700, 48), &pose);
            let noise = |u: f64, v: f64| (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos() * 0.01;
            seen.values.iter_mut().for_each(|v| *v += noise(random(), random()) as f32);
            map.integrate(&pose, &Frame::Image(seen)).unwrap();
        }
    }
    let (mut free, mut free_free, mut surface, mut surface_free) = (0, 0, 0, 0);
    let sensors = poses();
    while surface < 20_000 {
        let pose = &sensors[(random() * 6.0) as usize];
        let (e, a) = (0.8 * (random() - 0.5), TAU * random());
        let d = pose.rotate([e.cos() * a.cos(), e.cos() * a.sin(), e.sin()]);
        let t = room(pose.translation, d);
        let at = |s: f64| std::array::from_fn::<f64, 3, _>(|k| pose.translation[k] + s * d[k]);
        let cell = lattice.cell_of(at(t)).unwrap();
        let mut around = vec![cell];
        for k in 0..3 {
            for side in [-1, 1] {
                let mut c = cell;
                c[k] += side;
                around.push(c);
            }
        }
        surface += 1;
        let raised = around.iter().any(|c| map.is_occupied(*c) == Some(true));
        surface_free += usize::from(!raised && map.is_occupied(cell) == Some(false));
        let s = random() * (t - 0.3);
        if s > 0.1 {
            free += 1;
            free_free += usize::from(map.probability(at(s)).known().is_some_and(|p| p < 0.5));
        }
    }
    assert!(surface_free * 5000 <= surface, "{surface_free} of {surface} surfaces are called free");
    assert!(free_free * 100 >= free * 97, "{free_free} of {free} free points are called free");
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    for sweep in [OccupancySweep::Exact, OccupancySweep::Auto] {
        let run = |threads: usize| {
            with_threads(threads, || {
                let mut map = map(sweep);
                for pose in poses() {
                    let seen = look(image(Projection::Spherical(spherical()), 700, 48), &pose);
                    let points = seen.points().map(|(_, p)| p.map(|v| v as f32));
                    let scan = PointScan::new(points, [0.0; 3]);
                    map.integrate(&pose, &Frame::Points(scan)).unwrap();
                }
                map
            })
        };
        let one = run(1);
        for threads in [2, 8] {
            let other = run(threads);
            assert!(one.store().bricks_by_age().eq(other.store().bricks_by_age()), "{sweep:?} {threads}");
        }
    }
}

#[test]
fn near_walls_and_odd_values_do_no_harm() {
    let mut near = image(Projection::Spherical(spherical()), 700, 48);
    near.values.fill(0.15);
    near.values[77] = f32::NAN;
    near.values[78] = f32::INFINITY;
    near.values[79] = 1e30;
    let mut map = map(OccupancySweep::Auto);
    let stats = map.integrate(&Pose::IDENTITY, &Frame::Image(near)).unwrap();
    assert!(stats.refused.not_finite > 0);
    for (cell, value) in observed(&map).into_iter().filter(|c| c.1.0 < 0) {
        assert!(norm(sub(LATTICE.center(cell), [0.0; 3])) < 0.15, "{cell:?} {value:?}");
    }
    assert!(map.store().brick(BlockKey([0; 3])).is_some());
}
