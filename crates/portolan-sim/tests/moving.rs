//! Lidars that drive at 2 m/s and turn at 90 degrees/s, at 10 Hz: with their motion taken out their maps are as good as those of
//! lidars that stand still for every scan.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests are tests too")]

use portolan::geom::{Pose, Trajectory};
use portolan::map::{Tsdf, Tsdf3, TsdfConfig};
use portolan::scan::{Frame, Scan};
use portolan::surface::{ContourSettings, MeshSettings, marching_cubes, marching_squares};
use portolan_sim::building::{Body, Shape, SpinningLidar, World3, lidar_frame, moving_lidar_frame};
use portolan_sim::{ErrorSummary, Lidar, Solid, SolidKind, World, scan_at, scan_while_moving};
use std::f64::consts::FRAC_PI_2;

/// Seconds of a scan.
const TURN: f64 = 0.1;
const SCANS: usize = 40;

/// A body on a circle: 2 m/s, 90 degrees/s. The stamp of scan `i` is `0.1 i` seconds.
fn planar(time: f64) -> Pose<2> {
    let (speed, turn) = (2.0, FRAC_PI_2);
    let (sin, cos) = (turn * time).sin_cos();
    let radius = speed / turn;
    Pose::from_cos_sin(radius * sin, -radius * cos, cos, sin)
}

/// The same at 1.2 m, leaning.
fn spatial(time: f64) -> Pose<3> {
    let [[a, b], [c, d]] = planar(time).rotation;
    let [x, y] = planar(time).translation;
    let level = Pose { rotation: [[a, b, 0.0], [c, d, 0.0], [0.0, 0.0, 1.0]], translation: [x, y, 1.2] };
    level * Pose::<3>::from_quaternion([0.0; 3], [0.03, -0.05, 0.0, 1.0]).unwrap()
}

/// A hall of 12 by 10 by 4 m with four pillars and a box.
fn hall() -> World3 {
    let body = |(i, shape): (usize, Shape)| Body { name: format!("body {i}"), shape, color: [128; 3] };
    let pillar = |x: f64, y: f64| Shape::between([x - 0.2, y - 0.2, -0.1], [x + 0.2, y + 0.2, 4.1]);
    let shapes = [
        Shape::between([-6.3, -5.3, -0.3], [6.3, 5.3, 0.0]),
        Shape::between([-6.3, -5.3, 4.0], [6.3, 5.3, 4.3]),
        Shape::between([-6.3, -5.3, -0.3], [-6.0, 5.3, 4.3]),
        Shape::between([6.0, -5.3, -0.3], [6.3, 5.3, 4.3]),
        Shape::between([-6.3, -5.3, -0.3], [6.3, -5.0, 4.3]),
        Shape::between([-6.3, 5.0, -0.3], [6.3, 5.3, 4.3]),
        pillar(-3.0, -2.5),
        pillar(3.0, -2.5),
        pillar(-3.0, 2.5),
        pillar(3.0, 2.5),
        Shape::between([4.0, -0.8, -0.1], [5.0, 0.8, 0.9]),
    ];
    World3::new(shapes.into_iter().enumerate().map(body).collect())
}

fn mesh_errors(world: &World3, frames: impl Iterator<Item = Frame>) -> ErrorSummary {
    let config = TsdfConfig { resolution: 0.1, truncation: 0.3, ..TsdfConfig::default() };
    let mut map = Tsdf3::new(config).unwrap();
    let mut seconds = 0.0;
    for (i, frame) in frames.enumerate() {
        let start = std::time::Instant::now();
        map.integrate(&spatial(TURN * i as f64), &frame).unwrap();
        seconds += start.elapsed().as_secs_f64();
    }
    println!("{:.1} ms a scan", 1e3 * seconds / SCANS as f64);
    let mesh = marching_cubes(map.store(), None, &MeshSettings::default());
    let errors = (0..mesh.vertices.len()).map(|i| world.signed_distance(mesh.vertex_world(i)));
    ErrorSummary::of(errors.collect()).unwrap()
}

/// What is compared.
fn figures(errors: &ErrorSummary) -> [f64; 2] {
    [errors.median, errors.p95]
}

#[test]
fn the_mesh_of_a_moving_lidar_is_that_of_one_at_rest() {
    let world = hall();
    // No misses: the hall is closed. No image: it would be of the lidar at rest.
    let lidar = SpinningLidar { organized: false, ..SpinningLidar::default() };
    let directions = lidar.directions();
    // Poses as a SLAM leaves them: one a scan, at its stamp.
    let poses = (0..SCANS).map(|i| TURN * i as f64).map(|t| (t, spatial(t)));
    let trajectory = Trajectory::new(poses).unwrap();
    let moving = |i: usize, deskew: bool| {
        let start = TURN * i as f64;
        let pose = |t: f64| spatial(start + t);
        let frame = moving_lidar_frame(&world, pose, &lidar, &directions, TURN, (1, i as u64));
        let Frame::Points(mut scan) = frame else { panic!("a lidar delivers points") };
        if deskew {
            scan.deskew(&spatial(start), &mut trajectory.motion(0.25), start).unwrap();
        }
        Frame::Points(scan)
    };
    let rest = |i: usize| lidar_frame(&world, &spatial(TURN * i as f64), &lidar, &directions, (1, i as u64));
    let still = mesh_errors(&world, (0..SCANS).map(rest));
    let with = mesh_errors(&world, (0..SCANS).map(|i| moving(i, true)));
    let without = mesh_errors(&world, (0..SCANS).map(|i| moving(i, false)));
    println!("at rest {still:?}\nwith {with:?}\nwithout {without:?}");
    let [still, with, without] = [still, with, without].map(|e| figures(&e));
    for k in 0..2 {
        assert!(with[k] <= 1.15 * still[k], "{k}: {with:?} {still:?}");
        assert!(with[k] <= 0.5 * without[k], "{k}: {with:?} {without:?}");
    }
}

/// A room of 9 by 8 m with four pillars.
fn room() -> World {
    let solid = |(i, (min, max)): (usize, ([f64; 2], [f64; 2]))| {
        Solid::rectangle(format!("solid {i}"), SolidKind::Wall, min, max)
    };
    let boxes = [
        ([-4.7, -4.2], [4.7, -4.0]),
        ([-4.7, 4.0], [4.7, 4.2]),
        ([-4.7, -4.0], [-4.5, 4.0]),
        ([4.5, -4.0], [4.7, 4.0]),
        ([-3.2, -2.7], [-2.8, -2.3]),
        ([2.8, -2.7], [3.2, -2.3]),
        ([-3.2, 2.3], [-2.8, 2.7]),
        ([2.8, 2.3], [3.2, 2.7]),
    ];
    World::new(boxes.into_iter().enumerate().map(solid).collect())
}

fn contour_errors(world: &World, scans: impl Iterator<Item = Scan<2>>) -> ErrorSummary {
    let config = TsdfConfig { resolution: 0.05, truncation: 0.15, ..TsdfConfig::default() };
    let mut map = Tsdf::<2>::new(config).unwrap();
    for (i, scan) in scans.enumerate() {
        map.integrate(&planar(TURN * i as f64), &scan).unwrap();
    }
    let contour = marching_squares(&map, &ContourSettings::default());
    ErrorSummary::of(contour.vertices.iter().map(|v| world.signed_distance(*v)).collect()).unwrap()
}

#[test]
fn the_walls_of_a_moving_laser_are_those_of_one_at_rest() {
    let world = room();
    let lidar = Lidar { beams: 720, ..Lidar::default() };
    let times: Vec<f32> = (0..lidar.beams).map(|i| (TURN * i as f64 / lidar.beams as f64) as f32).collect();
    let poses = (0..SCANS).map(|i| TURN * i as f64).map(|t| (t, planar(t)));
    let trajectory = Trajectory::new(poses).unwrap();
    let moving = |i: usize, deskew: bool| {
        let start = TURN * i as f64;
        let pose = |beam: usize| planar(start + f64::from(times[beam]));
        let mut scan = scan_while_moving(&world, pose, &lidar, 1, i as u64);
        if deskew {
            scan.deskew(&times, &planar(start), &mut trajectory.motion(0.25), start).unwrap();
        }
        scan
    };
    let still = contour_errors(
        &world,
        (0..SCANS).map(|i| scan_at(&world, &planar(TURN * i as f64), &lidar, 1, i as u64)),
    );
    let with = contour_errors(&world, (0..SCANS).map(|i| moving(i, true)));
    let without = contour_errors(&world, (0..SCANS).map(|i| moving(i, false)));
    println!("at rest {still:?}\nwith {with:?}\nwithout {without:?}");
    let [still, with, without] = [still, with, without].map(|e| figures(&e));
    for k in 0..2 {
        assert!(with[k] <= 1.15 * still[k], "{k}: {with:?} {still:?}");
        assert!(with[k] <= 0.5 * without[k], "{k}: {with:?} {without:?}");
    }
}
