//! 7-Scenes *(Shotton et al. 2013)* and what was laid out after it (3DMatch, tsdf-fusion): all files in one folder.
//!
//! `frame-NNNNNN.depth.png` in millimetres, `frame-NNNNNN.pose.txt` (4x4, world from camera), `frame-NNNNNN.color.jpg` or
//! `.png`, and the camera in `camera-intrinsics.txt` (3x3) there or in the folder above. The data set itself comes without
//! that file; its camera is published as 585, 585, 320, 240.

use std::path::{Path, PathBuf};

use super::depth_frames::{DepthFrame, DepthFrames};
use super::files::{has_name, name_of, names_in, number_in};
use super::intrinsics::read_intrinsics;
use super::parts::{LayoutPoses, Parts, ScanId};
use super::{Camera, SpaceLogOptions, SpaceLogStats};
use crate::IoError;
use crate::poses3::{PoseConvention, RawPose, read_poses_3d};

const DEPTH: &str = ".depth.png";
const UNITS_PER_METRE: f64 = 1000.0;
const CAMERA: [f64; 4] = [585.0, 585.0, 320.0, 240.0];

fn is_depth(name: &str) -> bool {
    name.starts_with("frame-") && name.ends_with(DEPTH)
}

pub(super) fn is_it(path: &Path) -> bool {
    has_name(path, is_depth)
}

pub(super) fn open(path: &Path, options: &SpaceLogOptions) -> Result<Parts, IoError> {
    let names = names_in(path, is_depth)?;
    let camera = camera(path, options)?;
    let mut scans = Vec::with_capacity(names.len());
    let mut poses = Vec::with_capacity(names.len());
    let mut frames = Vec::with_capacity(names.len());
    for name in &names {
        let stem = name.strip_suffix(DEPTH).unwrap_or(name);
        let depth = path.join(name);
        scans.push(ScanId { path: depth.clone(), number: number_in(name), time: None });
        frames.push(DepthFrame { depth, pinhole: camera.pinhole });
        // A file of poses makes those beside the scans unneeded, however broken they may be.
        if options.poses.is_none() {
            poses.push(pose_beside(&path.join(format!("{stem}.pose.txt")))?);
        }
    }
    let source = DepthFrames::new(frames, &camera, UNITS_PER_METRE, options)?;
    Ok(Parts {
        name: name_of(path),
        source: Box::new(source),
        scans,
        poses: LayoutPoses::PerScan(poses),
        convention: PoseConvention::WorldFromSensor,
        posed_from_sensor: None,
        camera: Some(camera),
        stats: SpaceLogStats::default(),
    })
}

/// The pose in a file of its own; `None` where there is no such file.
fn pose_beside(path: &Path) -> Result<Option<(PathBuf, RawPose)>, IoError> {
    if !path.exists() {
        return Ok(None);
    }
    let mut file = read_poses_3d(path)?;
    if file.poses.len() != 1 {
        let value = file.poses.len().to_string();
        return Err(IoError::layout(path, "the number of poses", value, "give one pose per scan"));
    }
    Ok(file.poses.pop().map(|pose| (file.path, pose)))
}

fn camera(path: &Path, options: &SpaceLogOptions) -> Result<Camera, IoError> {
    if let Some(given) = &options.intrinsics {
        return given.camera();
    }
    let here = path.join("camera-intrinsics.txt");
    let above = path.join("../camera-intrinsics.txt");
    match [here, above].into_iter().find(|file| file.is_file()) {
        Some(file) => read_intrinsics(&file),
        None => Ok(Camera::of_data_set("7-Scenes", CAMERA)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space_log::{SpaceLog, SpaceLogKind};
    use crate::testing::real_data;
    use portolan::geom::vector::distance;
    use portolan::scan::Frame;

    /// Median distance (metres) along the ray between what two frames say of the same points: pixels of one, moved into the
    /// other and looked up there.
    fn disagreement(log: &SpaceLog, a: usize, b: usize) -> f64 {
        let [Frame::Image(one), Frame::Image(other)] = [a, b].map(|i| log.frame(i).unwrap()) else {
            panic!("a depth camera gives images")
        };
        let portolan::scan::Projection::Pinhole(camera) = other.projection else { panic!() };
        let b_from_a = log.pose(b).inverse() * *log.pose(a);
        let mut all: Vec<f64> = Vec::new();
        for (_, p) in one.points() {
            let q = b_from_a.transform_point(p);
            let (u, v) = (camera.fx * q[0] / q[2] + camera.cx, camera.fy * q[1] / q[2] + camera.cy);
            let (u, v) = (u.round(), v.round());
            if q[2] > 0.0 && u >= 0.0 && v >= 0.0 && u < other.columns as f64 && v < other.rows as f64 {
                let value = other.values[v as usize * other.columns + u as usize];
                if value > 0.0 {
                    all.push(distance(q, other.point(u as usize, v as usize, f64::from(value))));
                }
            }
        }
        assert!(all.len() > 50_000, "frames overlap: {}", all.len());
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    }

    #[test]
    fn frames_of_the_real_kitchen_agree_in_the_world() {
        let Some(path) = real_data("rgbd_redkitchen") else { return };
        let log = SpaceLog::open(&path, &SpaceLogOptions::default()).unwrap();
        assert_eq!((log.kind(), log.len()), (SpaceLogKind::SevenScenes, 200));
        assert_eq!(log.name(), "rgbd_redkitchen");
        assert!(log.stats().refused_poses.is_empty() && log.stats().mended_poses > 0);
        assert!(log.stats().worst_pose < 1e-3, "{}", log.stats().worst_pose);
        let Frame::Image(image) = log.frame(0).unwrap() else { panic!() };
        assert_eq!((image.columns, image.rows), (640, 480));
        assert!(image.values.iter().all(|v| *v < 10.0) && image.hits() > 200_000);
        // Half a pixel at 2 m is 1.7 mm, the depth's own step there 3 mm.
        let right = disagreement(&log, 10, 11);
        assert!(right < 0.006, "{right}");
        let options = SpaceLogOptions {
            pose_convention: Some(PoseConvention::SensorFromWorld),
            ..SpaceLogOptions::default()
        };
        let wrong = disagreement(&SpaceLog::open(&path, &options).unwrap(), 10, 11);
        assert!(wrong > 2.0 * right, "{wrong} against {right}");
    }
}
