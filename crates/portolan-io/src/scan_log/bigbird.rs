//! BigBIRD *(Singh et al. 2014)* as the tools of GPIS mapping store it: five depth cameras around a turntable.
//!
//! `masked_depth/frameF_camC.png` in units of 0.1 mm, 0 outside of the object; F is the table's angle in degrees. The rows
//! of `pose/poses.txt` belong to the pictures in the order of their angles, which begins at 93 and goes on over 360. Their
//! rotations are transposed, their translations are not.

use std::path::Path;

use portolan::scan::Pinhole;

use super::depth_frames::{DepthFrame, DepthFrames};
use super::files::{has_name, names_in};
use super::intrinsics::find_camera;
use super::parts::{LayoutPoses, Parts, ScanId};
use super::{Camera, CameraFrom, ScanLogOptions, ScanLogStats};
use crate::Result;
use crate::poses3::{PoseConvention, read_poses_3d};

const FOLDER: &str = "masked_depth";
const POSES: &str = "pose/poses.txt";
const UNITS_PER_METRE: f64 = 1e4;
const FIRST_ANGLE: u64 = 93;

/// Focal lengths and principal points of the cameras 1 to 5.
const CAMERAS: [[f64; 4]; 5] = [
    [570.9361, 570.9376, 306.8789, 238.8476],
    [572.3318, 572.3316, 309.9968, 230.6296],
    [568.9403, 568.9419, 308.4583, 225.8232],
    [567.9881, 567.9995, 310.5243, 223.9443],
    [572.7638, 572.7567, 310.4192, 214.8762],
];

/// Angle and camera of a picture's name.
fn angle_and_camera(name: &str) -> Option<(u64, usize)> {
    let (angle, camera) = name.strip_prefix("frame")?.strip_suffix(".png")?.split_once("_cam")?;
    let (angle, camera) = (angle.parse().ok()?, camera.parse().ok()?);
    (angle <= 360 && (1..=CAMERAS.len()).contains(&camera)).then_some((angle, camera))
}

pub(super) fn is_it(path: &Path) -> bool {
    has_name(&path.join(FOLDER), |name| angle_and_camera(name).is_some())
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let folder = path.join(FOLDER);
    let mut names = names_in(&folder, |name| angle_and_camera(name).is_some())?;
    names.sort_by_key(|name| {
        angle_and_camera(name).map(|(angle, camera)| ((angle + 360 - FIRST_ANGLE) % 360, camera))
    });
    let mut camera = find_camera(path, &["camera-intrinsics.txt"], Some(("BigBIRD", CAMERAS[0])), options)?;
    let one_for_all = !matches!(camera.from, CameraFrom::DataSet(_));
    let mut stats = ScanLogStats::default();
    let mut frames = Vec::with_capacity(names.len());
    for (name, (_, c)) in names.iter().filter_map(|name| Some((name, angle_and_camera(name)?))) {
        let [fx, fy, cx, cy] = CAMERAS[c - 1];
        let pinhole = if one_for_all { camera.pinhole } else { Pinhole { fx, fy, cx, cy } };
        let own = Camera { pinhole, ..camera.clone() };
        frames.push(DepthFrame::of(&own, folder.join(name), None));
    }
    let scans = frames.iter().map(|f| ScanId { path: f.depth.clone(), number: None, time: None }).collect();
    let poses = path.join(POSES);
    let poses = match &options.poses {
        None if poses.is_file() => LayoutPoses::File(read_poses_3d(poses)?),
        _ => LayoutPoses::Missing(POSES.into()),
    };
    let source = DepthFrames::new(frames, &mut camera, UNITS_PER_METRE, options, &mut stats)?;
    let (camera, convention) = (Some(camera), PoseConvention::TransposedRotation);
    Ok(Parts { convention, camera, stats, ..Parts::new(path, source, scans, poses) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::{
        SIZE, camera_pose, gray_png, image, matrix_text, median_distance, with_convention, write,
    };
    use crate::scan_log::{Intrinsics, ScanLog, ScanLogKind};
    use crate::testing::real_data;

    #[test]
    fn pictures_are_in_the_order_of_their_angles_from_93() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["frame93_cam1", "frame354_cam2", "frame6_cam3", "frame84_cam2"];
        let mut poses = String::new();
        for (i, name) in names.iter().enumerate() {
            let path = folder.path().join(format!("masked_depth/{name}.png"));
            write(&path, gray_png(SIZE, &[1000 * (i as u16 + 1); SIZE[0] * SIZE[1]]));
            let mut pose = camera_pose(i);
            pose.rotation = pose.inverse().rotation;
            poses += &(matrix_text(&pose).replace('\n', " ") + "\n");
        }
        write(&folder.path().join("pose/poses.txt"), poses);
        let pinhole = Pinhole { fx: 10.0, fy: 10.0, cx: 3.5, cy: 2.5 };
        let options =
            ScanLogOptions { intrinsics: Some(Intrinsics::Pinhole(pinhole)), ..ScanLogOptions::default() };
        let log = ScanLog::open(folder.path(), &options).unwrap();
        assert_eq!((log.kind(), log.len()), (ScanLogKind::BigBird, 4));
        for i in 0..4 {
            assert_eq!(image(&log, i).values[0], 0.1 * (i + 1) as f32);
            let (found, expected) = (log.pose(i), camera_pose(i));
            let p = [0.3, -0.4, 0.5];
            let off = portolan::geom::vector::distance(found.transform_point(p), expected.transform_point(p));
            assert!(off < 1e-6);
        }
    }

    /// Median distance (meters) of some points of a view to the nearest point of the view beside it.
    fn disagreement(log: &ScanLog, a: usize, b: usize) -> f64 {
        let world = |i: usize| -> Vec<[f64; 3]> {
            image(log, i).points().map(|(_, p)| log.pose(i).transform_point(p)).collect()
        };
        let (one, other) = (world(a), world(b));
        median_distance(&one, &other, one.len() / 300 + 1)
    }

    #[test]
    fn views_of_the_real_detergent_agree() {
        let Some(path) = real_data("rgbd_bigbird_detergent") else { return };
        let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
        assert_eq!((log.len(), log.stats().refused_poses.len()), (40, 0));
        let options = with_convention(PoseConvention::WorldFromSensor);
        let other = ScanLog::open(&path, &options).unwrap();
        // Every view is 9 degrees from the next, the last from the first.
        for (a, b) in [(0, 1), (10, 11), (30, 31), (39, 0)] {
            let (right, wrong) = (disagreement(&log, a, b), disagreement(&other, a, b));
            assert!(right < 0.003, "{a}: {right}");
            assert!(wrong > 2.0 * right, "{a}: {wrong} against {right}");
        }
    }
}
