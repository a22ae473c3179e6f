//! Nothing that was seen is thrown away: fewer points never give more map, and one view shows what it saw.

use portolan::geom::Pose;
use portolan::map::CARVE_WEIGHT;
use portolan::map::{PointSweep, Tsdf3, TsdfConfig};
use portolan::scan::{Frame, Pinhole, PointScan, RangeImage, ScanStats, Way, WhyRays};
use portolan::surface::{MeshSettings, marching_cubes};
use std::f64::consts::TAU;

/// Numbers in `[0, 1)`, from a seed.
fn random(mut seed: u64) -> impl FnMut() -> f64 {
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A room of 10 x 8 x 3 m with a pillar, seen by a lidar of 64 rings and 1024 columns at zero.
fn room() -> Vec<[f32; 3]> {
    let beam = |i: usize| {
        let e = 0.39 - 0.78 * (i / 1024) as f64 / 63.0;
        let a = TAU * (i % 1024) as f64 / 1024.0;
        let d = [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()];
        let wall = (0..3).map(|k| [5.0, 4.0, 1.5][k] / d[k].abs()).fold(f64::INFINITY, f64::min);
        let pillar = if (a - 1.0).abs() < 0.1 { 2.0 } else { f64::INFINITY };
        d.map(|v| (v * wall.min(pillar)) as f32)
    };
    (0..64 * 1024).map(beam).collect()
}

/// Area of the surface (square meters) that one scan shows, and how it was read.
fn shown(frame: &Frame, resolution: f64, points: PointSweep) -> (f64, ScanStats) {
    let truncation = 3.0 * resolution;
    let how = TsdfConfig { resolution, truncation, points, carve_weight: CARVE_WEIGHT, ..Default::default() };
    let mut map = Tsdf3::new(how).unwrap();
    let stats = map.integrate(&Pose::IDENTITY, frame).unwrap();
    (marching_cubes(&map, None, &MeshSettings::default()).area(), stats)
}

fn both(points: &[[f32; 3]], resolution: f64) -> [(f64, ScanStats); 2] {
    let frame = Frame::Points(PointScan::new(points.iter().copied(), [0.0; 3]));
    [PointSweep::Projective, PointSweep::Rays].map(|sweep| shown(&frame, resolution, sweep))
}

#[test]
fn more_points_never_give_less_map() {
    let whole = room();
    for resolution in [0.05, 0.1, 0.2] {
        let mut before = f64::INFINITY;
        for share in [1.0, 0.9, 0.7, 0.5, 0.4, 0.3, 0.1] {
            let mut random = random(5);
            let points: Vec<_> = whole.iter().copied().filter(|_| random() < share).collect();
            let [(auto, stats), (exact, _)] = both(&points, resolution);
            println!("{resolution} m, {share}: auto {auto:.1} m2, exact {exact:.1} m2");
            assert!(
                auto >= 0.85 * exact,
                "{resolution} m, {share}: {auto} against {exact}, {:?}",
                stats.ways
            );
            assert!(
                auto <= 1.1 * before,
                "{resolution} m, {share}: {auto} of fewer points, {before} of more"
            );
            before = auto;
        }
    }
}

/// Points of no sensor with rows: none is lost, and the statistics say why they were followed ray by ray.
#[test]
fn grids_and_merged_clouds_are_followed_ray_by_ray() {
    let wall =
        |x: f32| (0..861).map(move |i| [x, 0.05 * (i % 41) as f32 - 1.0, 0.05 * (i / 41) as f32 - 0.5]);
    let mut merged = room();
    // The same sensor half a meter aside.
    merged.extend(room().iter().map(|p| [p[0] + 0.5, p[1] + 0.2, p[2] + 0.1]));
    for points in [wall(2.03).collect(), wall(2.07).collect(), merged] {
        let [(auto, stats), (exact, asked)] = both(&points, 0.1);
        assert_eq!((auto, stats.beams), (exact, asked.beams));
        assert_eq!(
            stats.ways.count(Way::Found) + stats.ways.count(Way::Rays(WhyRays::Asked)),
            0,
            "{:?}",
            stats.ways
        );
        assert_eq!(asked.ways.count(Way::Rays(WhyRays::Asked)), 1);
    }
}

/// A ring or a pixel that misses a few readings costs their surface at most.
#[test]
fn missing_readings_cost_no_more_than_what_they_saw() {
    let whole = both(&room(), 0.1)[0].0;
    let mut random = random(3);
    let nine_tenths: Vec<_> = room().into_iter().filter(|_| random() < 0.9).collect();
    let [(area, stats), _] = both(&nine_tenths, 0.1);
    assert!(area > 0.9 * whole, "{area} of {whole}");
    // Bridges are no readings.
    assert_eq!((stats.beams.hit, stats.beams.dropped), (nine_tenths.len() as u64, 0));
    assert_eq!(stats.ways.count(Way::Found), 1);
}

/// One view of a floor and a wall behind it, at up to 80 degrees of incidence: all of it is in the mesh, and nothing else.
#[test]
fn one_view_shows_what_it_meets_at_a_slant() {
    let camera = Pinhole { fx: 260.0, fy: 260.0, cx: 159.5, cy: 119.5 };
    // The floor is 0.5 m below the camera (y down), the wall 1.6 m ahead; noise of up to 2 mm.
    let mut random = random(9);
    let depth = |i: usize, noise: f64| {
        let y = ((i / 320) as f64 - camera.cy) / camera.fy;
        let floor = if y > 0.0 { 0.5 / y } else { f64::INFINITY };
        (floor.min(1.6) + noise) as f32
    };
    let depths: Vec<f32> = (0..320 * 240).map(|i| depth(i, 0.004 * (random() - 0.5))).collect();
    let image = RangeImage::from_depth(camera, 320, 240, depths);
    // Of the wall what is above the floor, of the floor what is in the lower part of the image.
    let (width, bottom) = (320.0 / 260.0, 120.0 / 260.0);
    let wall = 1.6 * width * (1.6 * bottom + 0.5);
    let near = 0.5 / bottom;
    let floor = width * (1.6 * 1.6 - near * near) / 2.0;
    for turned in [0.0, 0.4] {
        let (area, _) = {
            let mut map = Tsdf3::new(TsdfConfig {
                resolution: 0.01,
                truncation: 0.03,
                carve_weight: CARVE_WEIGHT,
                ..Default::default()
            })
            .unwrap();
            let pose = Pose::from_quaternion([0.0; 3], [turned, 0.5 * turned, 0.0, 1.0]).unwrap();
            let stats = map.integrate(&pose, &Frame::Image(image.clone())).unwrap();
            (marching_cubes(&map, None, &MeshSettings::default()).area(), stats)
        };
        println!("turned {turned}: {area:.3} of {:.3} m2", wall + floor);
        assert!((0.9..1.1).contains(&(area / (wall + floor))), "{turned}: {area} of {}", wall + floor);
    }
}
