//! The TSDF in bricks on scenes whose surfaces are known, and on bad input.

use portolan::cell::SignedDistance;
use portolan::geom::{Aabb, Pose, vector};
use portolan::map::{MapError, PointSweep, Tsdf3, TsdfConfig};
use portolan::scan::{Frame, Orthographic, Pinhole, PointScan, Projection, RangeImage, Spherical};
use portolan::store::Store;

const CAMERA: Pinhole = Pinhole { fx: 160.0, fy: 160.0, cx: 79.5, cy: 59.5 };

/// An image of a scene, from the range along a unit vector (world) from a point; `None`: nothing there.
fn see(
    projection: Projection,
    [columns, rows]: [usize; 2],
    pose: &Pose<3>,
    range: impl Fn([f64; 3], [f64; 3]) -> Option<f64>,
) -> RangeImage {
    let mut image = RangeImage::new(projection, columns, rows, vec![0.0; columns * rows]);
    for row in 0..rows {
        for column in 0..columns {
            let ray = pose.rotate(image.ray(column as f64, row));
            let length = vector::norm(ray);
            let from = match &image.projection {
                Projection::Orthographic { .. } => pose.transform_point(image.point(column, row, 0.0)),
                _ => pose.translation,
            };
            let found = range(from, vector::scale(ray, 1.0 / length));
            image.values[row * columns + column] = found.map_or(0.0, |z| (z / length) as f32);
        }
    }
    image
}

fn sphere(radius: f64) -> impl Fn([f64; 3], [f64; 3]) -> Option<f64> {
    move |from, along| {
        let b = vector::dot(from, along);
        let root = b * b - vector::dot(from, from) + radius * radius;
        (root > 0.0 && -b - root.sqrt() > 0.0).then(|| -b - root.sqrt())
    }
}

/// A camera at `from` that looks at zero.
fn looking_at_zero(from: [f64; 3]) -> Pose<3> {
    let forward = vector::unit(from.map(|v| -v)).unwrap();
    let up = if forward[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let right = vector::unit(cross(forward, up)).unwrap();
    let down = cross(forward, right);
    Pose { rotation: std::array::from_fn(|k| [right[k], down[k], forward[k]]), translation: from }
}

/// Where the field changes its sign between neighbouring cells, by linear interpolation.
fn crossings(map: &Tsdf3) -> Vec<[f64; 3]> {
    let mut found = Vec::new();
    for (key, brick) in map.store().bricks_by_age() {
        for i in (0..512).filter(|&i| brick.weights()[i] > 0.5) {
            let cell = key.cell(i);
            for k in 0..3 {
                let mut next = cell;
                next[k] += 1;
                let here = f64::from(brick.distances()[i]);
                if let Some(SignedDistance { distance, weight }) = map.store().cell(next) {
                    let there = f64::from(distance);
                    if weight > 0.5 && (here < 0.0) != (there < 0.0) {
                        let mut p = map.lattice().center(cell);
                        p[k] += here / (here - there) * map.lattice().resolution;
                        found.push(p);
                    }
                }
            }
        }
    }
    found
}

/// Median and 95th percentile (meters).
fn quantiles(mut errors: Vec<f64>) -> (f64, f64) {
    errors.sort_by(f64::total_cmp);
    (errors[errors.len() / 2], errors[errors.len() * 95 / 100])
}

fn config(resolution: f64, cells: f64) -> TsdfConfig<3> {
    TsdfConfig { resolution, truncation: cells * resolution, ..TsdfConfig::textbook() }
}

#[test]
fn a_sphere_is_where_it_is_from_all_sides() {
    let mut map = Tsdf3::new(config(0.02, 4.0)).unwrap();
    for k in 0..12 {
        let (a, b) = (f64::from(k) * 0.9, f64::from(k) * 0.5 - 2.7);
        let from = [2.5 * a.cos() * b.cos(), 2.5 * a.sin() * b.cos(), 2.5 * b.sin()];
        let pose = looking_at_zero(from);
        let image = see(Projection::Pinhole(CAMERA), [160, 120], &pose, sphere(0.7));
        map.integrate(&pose, &Frame::Image(image)).unwrap();
    }
    let errors: Vec<f64> = crossings(&map).iter().map(|p| (vector::norm(*p) - 0.7).abs()).collect();
    assert!(errors.len() > 10_000);
    let (median, p95) = quantiles(errors);
    // Distances along rays disagree between views where the surface is met at a slant.
    assert!(median < 0.0012 && p95 < 0.005, "{median} {p95}");
}

#[test]
fn a_sphere_under_parallel_rays() {
    let mut map = Tsdf3::new(config(0.001, 4.0)).unwrap();
    let rays = Orthographic { first: [-0.06, 0.06], step: [0.0008, -0.0008] };
    let pose = Pose::IDENTITY;
    let mut image = see(Projection::Orthographic { rays, top: 0.1 }, [150, 150], &pose, sphere(0.05));
    let seen = image.hits();
    // What is steeper than 80 degrees is torn, on purpose.
    map.integrate(&pose, &Frame::Image(image.clone())).unwrap();
    let errors: Vec<f64> = crossings(&map).iter().map(|p| (vector::norm(*p) - 0.05).abs()).collect();
    let (median, p95) = quantiles(errors);
    assert!(seen > 10_000 && median < 2e-5 && p95 < 3e-4, "{median} {p95}");
    image.values.fill(-0.15);
    map.integrate(&pose, &Frame::Image(image)).unwrap();
    assert!(map.signed_distance([0.0, 0.0, 0.0]).known().is_none(), "free now, by weight");
}

#[test]
fn walls_between_the_rings_of_a_lidar_are_planes() {
    // A corridor 4 m wide, 3 m high; rings 1.4 degrees apart.
    let lidar = Spherical {
        elevations: (0..32u8).map(|r| 0.4 - 0.025 * f32::from(r)).collect(),
        first_azimuth: 0.1,
        azimuth_step: -std::f64::consts::TAU / 512.0,
    };
    let size = [[-9.0, 9.0], [-2.0, 2.0], [-1.5, 1.5]];
    let room = |from: [f64; 3], d: [f64; 3]| {
        let to = |k: usize| (size[k][usize::from(d[k] > 0.0)] - from[k]) / d[k];
        (0..3).map(to).filter(|t| t.is_finite()).min_by(f64::total_cmp)
    };
    let mut map = Tsdf3::new(config(0.05, 4.0)).unwrap();
    for k in 0..3 {
        let pose = Pose::<3> { translation: [0.21 * f64::from(k), 0.1, 0.03], ..Pose::IDENTITY };
        let image = see(Projection::Spherical(lidar.clone()), [512, 32], &pose, room);
        map.integrate(&pose, &Frame::Image(image)).unwrap();
    }
    let off = |p: &[f64; 3]| {
        let walls = (0..3).flat_map(|k| size[k].map(|wall| (p[k] - wall).abs()));
        walls.fold(f64::INFINITY, f64::min)
    };
    // Further along, walls are met at more than 80 degrees and torn; in edges two walls share cells.
    let edge = |p: &[f64; 3]| p[1].abs() > 1.8 && p[2].abs() > 1.3;
    let errors: Vec<f64> = crossings(&map).iter().filter(|p| p[0].abs() < 4.0 && !edge(p)).map(off).collect();
    assert!(errors.len() > 10_000);
    let (median, p95) = quantiles(errors);
    assert!(median < 0.0005 && p95 < 0.004, "{median} {p95}");
}

#[test]
fn a_plate_of_two_centimetres_stays_from_both_sides() {
    let plate = |from: [f64; 3], d: [f64; 3]| {
        let face = if from[0] > 0.0 { 0.01 } else { -0.01 };
        let t = (face - from[0]) / d[0];
        let p = vector::along(from, d, t);
        (t > 0.0 && p[1].abs() < 0.3 && p[2].abs() < 0.3).then_some(t)
    };
    let mut map = Tsdf3::new(config(0.01, 2.5)).unwrap();
    for k in 0..10 {
        let side = if k % 2 == 0 { 1.2 } else { -1.2 };
        let pose = looking_at_zero([side, 0.2 - 0.04 * f64::from(k), 0.1]);
        let image = see(Projection::Pinhole(CAMERA), [160, 120], &pose, plate);
        map.integrate(&pose, &Frame::Image(image)).unwrap();
    }
    for y in -25..25 {
        for z in -25..25 {
            let at = |x: f64| map.occupancy([x, 0.01 * f64::from(y) + 0.005, 0.01 * f64::from(z) + 0.005]);
            assert_eq!((at(-0.005), at(0.005)), (Some(1.0), Some(1.0)), "{y} {z}");
            assert_eq!((at(-0.035), at(0.035)), (Some(0.0), Some(0.0)), "{y} {z}");
        }
    }
}

#[test]
fn what_is_gone_is_carved_and_what_is_behind_is_not_touched() {
    let pose = Pose::<3>::IDENTITY;
    let wall = |z: f64| see(Projection::Pinhole(CAMERA), [160, 120], &pose, move |_, d| Some(z / d[2]));
    let mut map = Tsdf3::new(TsdfConfig { w_max: 4.0, ..config(0.05, 3.0) }).unwrap();
    map.integrate(&pose, &Frame::Image(wall(1.0))).unwrap();
    assert!(map.signed_distance([0.0, 0.0, 0.99]).known().is_some());
    assert_eq!(map.signed_distance([0.0, 0.0, 1.3]), portolan::Answer::Unknown);
    for _ in 0..20 {
        map.integrate(&pose, &Frame::Image(wall(2.0))).unwrap();
    }
    assert_eq!(map.occupancy([0.0, 0.0, 1.02]), Some(0.0));
    let before = map.clone();
    map.integrate(&pose, &Frame::Image(wall(1.0))).unwrap();
    let behind = |m: &Tsdf3| m.signed_distance([0.02, 0.02, 1.98]);
    assert_eq!(behind(&before), behind(&map));
}

fn plain(values: Vec<f32>) -> RangeImage {
    let camera = Pinhole { fx: 8.0, fy: 8.0, cx: 3.5, cy: 3.5 };
    RangeImage::from_depth(camera, 8, 8, values)
}

#[test]
fn what_is_no_scan_is_refused_and_counted() {
    let mut map = Tsdf3::new(TsdfConfig { max_range: 5.0, ..config(0.05, 3.0) }).unwrap();
    let good = Frame::Image(plain(vec![1.0; 64]));
    let bent =
        Pose::<3> { rotation: [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };
    let lost = Pose { translation: [1e12, 0.0, 0.0], ..Pose::IDENTITY };
    let nowhere = Pose { translation: [f64::NAN, 0.0, 0.0], ..Pose::IDENTITY };
    for pose in [bent, lost, nowhere] {
        assert_eq!(map.integrate(&pose, &good).unwrap().refused_poses, 1);
    }
    assert!(map.store().is_empty());

    let mut values = vec![1.0; 64];
    (values[0], values[1], values[2], values[3]) = (f32::NAN, f32::INFINITY, 1e30, -1e30);
    (values[4], values[5], values[6]) = (1e-40, 0.0, f32::NEG_INFINITY);
    let stats = map.integrate(&Pose::IDENTITY, &Frame::Image(plain(values))).unwrap();
    assert_eq!((stats.refused.not_finite, stats.refused.too_near), (3, 1));
    assert_eq!((stats.beams.hit, stats.beams.max_range, stats.beams.dropped), (57, 2, 5));

    let mut short = plain(vec![1.0; 64]);
    short.values.pop();
    let mut flat = plain(vec![1.0; 64]);
    flat.projection = Projection::Pinhole(Pinhole { fx: 0.0, fy: f64::NAN, cx: 0.0, cy: 0.0 });
    let mut rings = plain(vec![1.0; 64]);
    rings.projection =
        Projection::Spherical(Spherical { elevations: vec![0.0; 8], first_azimuth: 0.0, azimuth_step: 0.1 });
    for image in [short, flat, rings] {
        assert!(matches!(map.integrate(&Pose::IDENTITY, &Frame::Image(image)), Err(MapError::Image(_))));
    }
    for bad in [
        TsdfConfig { resolution: 0.0, ..config(0.05, 3.0) },
        TsdfConfig { carve_weight: f32::NAN, ..config(0.05, 3.0) },
        TsdfConfig { truncation: -1.0, ..config(0.05, 3.0) },
        TsdfConfig { max_range: f64::INFINITY, ..config(0.05, 3.0) },
        TsdfConfig { min_range: 5.0, max_range: 4.0, ..config(0.05, 3.0) },
        TsdfConfig { origin: [f64::NAN, 0.0, 0.0], ..config(0.05, 3.0) },
    ] {
        assert!(Tsdf3::new(bad).is_err(), "{bad:?}");
    }
}

#[test]
fn limit_and_bounds_are_kept() {
    let frame = |depth| Frame::Image(plain(vec![depth; 64]));
    let mut map = Tsdf3::new(config(0.05, 3.0)).unwrap();
    map.set_limit(200_000);
    assert!(map.integrate(&Pose::IDENTITY, &frame(1.0)).is_ok());
    let full = map.integrate(&Pose::IDENTITY, &frame(60.0)).unwrap_err();
    assert!(matches!(full, MapError::Full(_)), "{full}");
    assert!(map.memory_bytes() <= 200_000 && map.signed_distance([0.0, 0.0, 0.98]).known().is_some());

    let mut map = Tsdf3::new(config(0.05, 3.0)).unwrap();
    let bounds = Aabb::new([-0.13, -10.0, 0.42], [0.31, 10.0, 0.97]);
    map.set_bounds(Some(bounds));
    for frame in [frame(1.0), Frame::Points(PointScan::new([[0.1, 0.1, 0.9], [0.1, 0.0, 1.2]], [0.0; 3]))] {
        let stats = map.integrate(&Pose::IDENTITY, &frame).unwrap();
        assert!(stats.cells > 0 && stats.hits_outside > 0);
    }
    for (key, brick) in map.store().bricks_by_age() {
        for i in (0..512).filter(|&i| brick.weights()[i] > 0.0) {
            assert!(bounds.contains(map.lattice().center(key.cell(i))));
        }
    }
    assert_eq!(map.signed_distance([0.0, 0.0, 1.0]), portolan::Answer::Outside);
}

#[test]
fn bare_points_get_their_rows_and_columns_back() {
    let lidar = Spherical {
        elevations: (0..16u8).map(|r| 0.3 - 0.04 * f32::from(r)).collect(),
        first_azimuth: 0.0,
        azimuth_step: std::f64::consts::TAU / 360.0,
    };
    let image = see(Projection::Spherical(lidar), [360, 16], &Pose::IDENTITY, |_, d| {
        let t = (0..3).map(|k| 2.0 / d[k].abs()).fold(f64::INFINITY, f64::min);
        Some(t)
    });
    let points: Vec<[f32; 3]> = image.points().map(|(_, p)| p.map(|v| v as f32)).collect();
    let fused = |frame: &Frame, sweep| {
        let mut map = Tsdf3::new(TsdfConfig { points: sweep, ..config(0.05, 3.0) }).unwrap();
        let stats = map.integrate(&Pose::IDENTITY, frame).unwrap();
        (map, stats)
    };
    let scan = Frame::Points(PointScan::new(points.iter().copied(), [0.0; 3]));
    let (by_image, _) = fused(&Frame::Image(image), PointSweep::Projective);
    let (by_points, stats) = fused(&scan, PointSweep::Projective);
    assert_eq!(stats.beams.total(), 360 * 16);
    let same = by_points.observed_cells(0.0) as f64 / by_image.observed_cells(0.0) as f64;
    assert!((same - 1.0).abs() < 0.02, "{same}");
    // Ray by ray cells far from rays are left out, and what is said differs by what lies between rays.
    let (by_rays, _) = fused(&scan, PointSweep::Rays);
    let share = by_rays.observed_cells(0.0) as f64 / by_image.observed_cells(0.0) as f64;
    assert!((0.3..1.0).contains(&share), "{share}");
    let errors: Vec<f64> = crossings(&by_rays)
        .iter()
        .map(|p| (p.iter().map(|v| v.abs()).fold(0.0, f64::max) - 2.0).abs())
        .collect();
    assert!(quantiles(errors).0 < 0.003);
}

#[test]
fn colours_lie_near_the_surface_and_nowhere_else() {
    let pose = Pose::<3>::IDENTITY;
    let color = |i: usize| if i % 160 < 80 { [200, 10, 30] } else { [0, 100, 250] };
    let mut image = see(Projection::Pinhole(CAMERA), [160, 120], &pose, |_, d| Some(1.5 / d[2]));
    image.colors = (0..160 * 120).map(color).collect();
    let mut scan = PointScan::new(image.points().map(|(_, p)| p.map(|v| v as f32)), [0.0; 3]);
    scan.colors = image.colors.clone();
    for frame in [Frame::Image(image), Frame::Points(scan)] {
        let mut map = Tsdf3::new(TsdfConfig { color: true, ..config(0.02, 4.0) }).unwrap();
        for _ in 0..3 {
            map.integrate(&pose, &frame).unwrap();
        }
        assert_eq!(map.color([-0.31, 0.01, 1.49]).unwrap().rgb8(), [200, 10, 30]);
        assert_eq!(map.color([0.31, 0.01, 1.49]).unwrap().rgb8(), [0, 100, 250]);
        assert_eq!(map.color([0.31, 0.01, 1.2]), None);
        assert!(map.signed_distance([0.31, 0.01, 1.2]) != portolan::Answer::Unknown);
        assert!(map.colors().unwrap().len() < map.store().len());
        let bytes = map.memory_bytes();
        assert!(bytes > map.store().memory_bytes());
    }
}

#[test]
fn points_in_one_call_at_utm_coordinates() {
    let far = [500_000.0, 4_000_000.0, 100.0];
    let mut map = Tsdf3::new(TsdfConfig { origin: far, ..config(0.05, 3.0) }).unwrap();
    let points: Vec<[f64; 3]> = (0..1000)
        .map(|i| vector::add(far, [2.0, f64::from(i % 40) * 0.02, f64::from(i / 40) * 0.02]))
        .collect();
    let stats = map.integrate_points(&points, far).unwrap();
    assert_eq!(stats.beams.hit, 1000);
    let d = map.signed_distance(vector::add(far, [1.97, 0.3, 0.3])).known().unwrap();
    // The cell's center lies 2.5 cm before the wall; along the ray it is a little more.
    assert!((d - 0.025).abs() < 0.003, "{d}");
}
