//! Logs of the simulated Building.

use std::path::PathBuf;

use portolan::geom::Pose;
use portolan_io::{LogLayout, LogWriter};
use portolan_sim::building::{BuildingConfig, BuildingSensor, DepthCamera, SpinningLidar, building_log};
use tempfile::TempDir;

/// A short walk with a small lidar, as KITTI has it.
pub(crate) fn lidar_log() -> (TempDir, PathBuf) {
    lidar_log_in(&Pose::IDENTITY)
}

/// The same in another world, `other_from_world`.
pub(crate) fn lidar_log_in(other: &Pose<3>) -> (TempDir, PathBuf) {
    let lidar = SpinningLidar { rings: 24, columns: 360, ..SpinningLidar::default() };
    written(BuildingSensor::Lidar(lidar), 6, LogLayout::Kitti { camera_from_lidar: Pose::IDENTITY }, other)
}

/// The same with poses of a camera that looks forward beside the lidar, as KITTI's are: x right, y down, z forward.
pub(crate) fn lidar_log_of_camera_poses() -> (TempDir, PathBuf) {
    let rotation = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];
    let camera_from_lidar = Pose { rotation, translation: [0.0, -0.08, -0.27] };
    let lidar = SpinningLidar { rings: 24, columns: 360, ..SpinningLidar::default() };
    written(BuildingSensor::Lidar(lidar), 6, LogLayout::Kitti { camera_from_lidar }, &Pose::IDENTITY)
}

/// A short walk with a small depth camera, as 7-Scenes has it.
pub(crate) fn camera_log() -> (TempDir, PathBuf) {
    written(
        BuildingSensor::Camera(DepthCamera::default().scaled(0.25)),
        5,
        LogLayout::SevenScenes,
        &Pose::IDENTITY,
    )
}

fn written(sensor: BuildingSensor, scans: usize, layout: LogLayout, other: &Pose<3>) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log");
    let log = building_log(&BuildingConfig { scans: 8 * scans, sensor, ..BuildingConfig::default() });
    let mut writer = LogWriter::create(&path, layout).unwrap();
    for ((pose, frame), time) in log.scans.iter().zip(&log.times).take(scans) {
        writer.push(&(*other * *pose), *time, frame).unwrap();
    }
    writer.finish().unwrap();
    (folder, path)
}
