//! What is simulated, written in the layouts of data sets, and read again.

#![allow(clippy::unwrap_used, reason = "helpers of tests are tests too")]

use portolan::geom::Pose;
use portolan::geom::vector::distance;
use portolan::scan::{Frame, RangeImage};
use portolan_io::poses3::{PoseConvention, PoseLayout, read_poses_3d};
use portolan_io::scan_log::{ScanLog, ScanLogKind, ScanLogOptions};
use portolan_io::{LogLayout, LogWriter};
use portolan_sim::building::{
    BuildingConfig, BuildingLog, BuildingSensor, DepthCamera, SpinningLidar, building_log,
};
use std::path::Path;

fn log(sensor: BuildingSensor) -> BuildingLog {
    building_log(&BuildingConfig { scans: 4, sensor, ..Default::default() })
}

fn write(log: &BuildingLog, folder: &Path, layout: LogLayout) {
    let mut writer = LogWriter::create(folder, layout).unwrap();
    for ((pose, frame), time) in log.scans.iter().zip(&log.times) {
        writer.push(pose, *time, frame).unwrap();
    }
    assert_eq!(writer.finish().unwrap(), log.scans.len());
}

fn assert_same_pose(a: &Pose<3>, b: &Pose<3>, tolerance: f64) {
    assert!(distance(a.translation, b.translation) < tolerance);
    for (a, b) in a.rotation.iter().flatten().zip(b.rotation.iter().flatten()) {
        assert!((a - b).abs() < tolerance, "{a} {b}");
    }
}

/// Half a unit of the file, and the rounding of `f32`.
fn assert_same_image(wrote: &RangeImage, read: &RangeImage, unit: f64) {
    assert_eq!((wrote.columns, wrote.rows), (read.columns, read.rows));
    for (a, b) in wrote.values.iter().zip(&read.values) {
        assert!((f64::from(*a) - f64::from(*b)).abs() <= 0.5 * unit + 1e-6, "{a} {b}");
        assert_eq!(*a > 0.0, *b > 0.0);
    }
    assert_eq!(wrote.colors, read.colors);
    assert_eq!(wrote.projection, read.projection);
}

fn assert_same_images(log: &BuildingLog, folder: &Path, kind: ScanLogKind, unit: f64) {
    let read = ScanLog::open(folder, &ScanLogOptions::default()).unwrap();
    assert_eq!((read.kind(), read.len()), (kind, log.scans.len()));
    for (i, (pose, frame)) in log.scans.iter().enumerate() {
        assert_same_pose(pose, read.pose(i), 1e-8);
        let (Frame::Image(wrote), Frame::Image(back)) = (frame, read.frame(i).unwrap()) else {
            panic!("cameras deliver images");
        };
        assert_same_image(wrote, &back, unit);
    }
}

#[test]
fn seven_scenes_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let log = log(BuildingSensor::Camera(DepthCamera::default()));
    write(&log, folder.path(), LogLayout::SevenScenes);
    assert_same_images(&log, folder.path(), ScanLogKind::SevenScenes, 1e-3);
}

/// KITTI's numbers as numpy would read them.
#[test]
fn kitti_holds_points_and_poses_of_the_camera() {
    let folder = tempfile::tempdir().unwrap();
    let lidar = SpinningLidar { rings: 16, columns: 64, ..Default::default() };
    let log = log(BuildingSensor::Lidar(lidar));
    // As on the car: the camera looks along the lidar's x.
    let rotation = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];
    let camera_from_lidar = Pose { rotation, translation: [0.0, -0.08, -0.27] };
    write(&log, folder.path(), LogLayout::Kitti { camera_from_lidar });
    let poses = read_poses_3d(folder.path().join("poses.txt")).unwrap();
    assert_eq!(poses.layout, PoseLayout::Kitti);
    for (i, (pose, frame)) in log.scans.iter().enumerate() {
        let bytes = std::fs::read(folder.path().join(format!("velodyne/{i:06}.bin"))).unwrap();
        let numbers: Vec<f32> =
            bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let Frame::Points(scan) = frame else { panic!("a lidar delivers points") };
        assert_eq!(numbers.len(), 4 * scan.points.len());
        for (row, p) in numbers.chunks_exact(4).zip(&scan.points) {
            assert_eq!(row, [p[0], p[1], p[2], 0.0]);
        }
        let (world_from_camera, _) = poses.poses[i].resolve(PoseConvention::WorldFromSensor).unwrap();
        assert_same_pose(pose, &(world_from_camera * camera_from_lidar), 1e-10);
    }
    let read = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
    assert_eq!((read.kind(), read.len()), (ScanLogKind::Kitti, log.scans.len()));
    for (i, (pose, frame)) in log.scans.iter().enumerate() {
        assert_same_pose(pose, read.pose(i), 1e-9);
        assert!((read.time(i).unwrap() - log.times[i]).abs() < 1e-6);
        let (Frame::Points(wrote), Frame::Points(back)) = (frame, read.frame(i).unwrap()) else {
            panic!("lidars deliver points");
        };
        assert_eq!((&wrote.points, &wrote.origin), (&back.points, &back.origin));
    }
    let calib = std::fs::read_to_string(folder.path().join("calib.txt")).unwrap();
    assert!(calib.lines().last().unwrap().starts_with("Tr: "));
    let times = std::fs::read_to_string(folder.path().join("times.txt")).unwrap();
    for (text, time) in times.lines().zip(&log.times) {
        assert!((text.parse::<f64>().unwrap() - time).abs() < 1e-6);
    }
}

#[test]
fn tum_has_a_trajectory_and_lists() {
    let folder = tempfile::tempdir().unwrap();
    let log = log(BuildingSensor::Camera(DepthCamera::default()));
    write(&log, folder.path(), LogLayout::TumRgbd);
    assert_same_images(&log, folder.path(), ScanLogKind::TumRgbd, 1.0 / 5000.0);
    let track = read_poses_3d(folder.path().join("groundtruth.txt")).unwrap();
    assert_eq!(track.layout, PoseLayout::Tum);
    for (raw, (pose, _)) in track.poses.iter().zip(&log.scans) {
        let (back, _) = raw.resolve(PoseConvention::WorldFromSensor).unwrap();
        assert_same_pose(pose, &back, 1e-8);
    }
    let list = std::fs::read_to_string(folder.path().join("depth.txt")).unwrap();
    for line in list.lines().filter(|l| !l.starts_with('#')) {
        assert!(folder.path().join(line.split_once(' ').unwrap().1).exists(), "{line}");
    }
}

#[test]
fn what_a_layout_cannot_hold_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let lidar = SpinningLidar { rings: 4, columns: 16, ..Default::default() };
    let log = log(BuildingSensor::Lidar(lidar));
    let (pose, frame) = &log.scans[0];
    for layout in [LogLayout::TumRgbd, LogLayout::SevenScenes] {
        let error = LogWriter::create(folder.path(), layout).unwrap().push(pose, 0.0, frame).unwrap_err();
        assert!(error.to_string().contains("KITTI"), "{error}");
    }
}
