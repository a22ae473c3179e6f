//! Redwood *(Choi, Zhou, Koltun 2015)* and Open3D, and ScanNet *(Dai et al. 2017)*, which differs in its poses: pictures in
//! folders.
//!
//! `depth/*.png` in millimeters, colors in `color`, `image` or `rgb`. Poses in `trajectory.log` (else in the only other
//! `.log` that is there), or one per picture in `pose/*.txt`. The camera in Open3D's json or in ScanNet's
//! `intrinsic/intrinsic_depth.txt`, else Open3D's default for this kind of sensor: 525, 525, 319.5, 239.5.
//!
//! Redwood names a picture `number-microseconds`. Its colors are numbered by themselves, so that they are matched by time.

use std::path::{Path, PathBuf};

use super::association::Association;
use super::depth_frames::{DepthFrame, DepthFrames, color_beside};
use super::files::{has_extension, has_name, name_of, names_in, number_in};
use super::intrinsics::{color_camera, find_camera};
use super::matching::nearest_in_time;
use super::parts::{LayoutPoses, Parts, ScanId, pose_beside, poses_beside_nothing};
use super::{ScanLogOptions, ScanLogStats};
use crate::Result;
use crate::poses3::read_poses_3d;

const DEPTH: &str = "depth";
const POSES: &str = "trajectory.log";
const POSE_FOLDER: &str = "pose";
const COLOR_FOLDERS: [&str; 3] = ["color", "image", "rgb"];
const CAMERA_FILES: [&str; 7] = [
    "camera_intrinsic.json",
    "intrinsic.json",
    "intrinsics.json",
    "camera.json",
    "camera_primesense.json",
    "camera-intrinsics.txt",
    "intrinsic/intrinsic_depth.txt",
];
const UNITS_PER_METRE: f64 = 1000.0;
const CAMERA: [f64; 4] = [525.0, 525.0, 319.5, 239.5];

fn is_png(name: &str) -> bool {
    has_extension(name, "png")
}

pub(super) fn is_it(path: &Path) -> bool {
    let has_poses = || path.join(POSE_FOLDER).is_dir() || has_name(path, |name| has_extension(name, "log"));
    path.join(DEPTH).is_dir() && has_name(&path.join(DEPTH), is_png) && has_poses()
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let folder = path.join(DEPTH);
    let names = names_in(&folder, is_png)?;
    let mut camera = find_camera(path, &CAMERA_FILES, Some(("Open3D's PrimeSense", CAMERA)), options)?;
    camera.color = color_camera(&camera, None, options)?;
    let colors = colors_of(path, &names, options)?;
    let mut stats = ScanLogStats::default();
    stats.notes.extend(Association::all_in(path).first().map(|a| {
        let name = name_of(&a.path);
        format!("{name} pairs pictures, too, and was not used; name it instead of the folder to use it")
    }));
    let frames = names.iter().zip(colors);
    let frames = frames.map(|(name, color)| DepthFrame::of(&camera, folder.join(name), color)).collect();
    let poses = poses_of(path, &names, options)?;
    if matches!(poses, LayoutPoses::PerScan(_)) {
        let name_of_scan = |pose: &str| Some(format!("{}.png", pose.strip_suffix(".txt")?));
        stats.poses_without_scan = poses_beside_nothing(&path.join(POSE_FOLDER), &names, name_of_scan)?;
    }
    let scan = |name: &String| {
        let (number, time) = number_and_time(name);
        ScanId { path: folder.join(name), number, time }
    };
    let source = DepthFrames::new(frames, &mut camera, UNITS_PER_METRE, options, &mut stats)?;
    let scans = names.iter().map(scan).collect();
    Ok(Parts { camera: Some(camera), stats, ..Parts::new(path, source, scans, poses) })
}

/// Number and time (seconds) of a picture's name.
fn number_and_time(name: &str) -> (Option<u64>, Option<f64>) {
    let all_digits = |w: &str| !w.is_empty() && w.bytes().all(|b| b.is_ascii_digit());
    match name.rsplit_once('.').map_or(name, |(stem, _)| stem).split_once('-') {
        Some((number, micros)) if all_digits(number) && all_digits(micros) => {
            (number.parse().ok(), micros.parse().ok().map(|t: f64| t * 1e-6))
        }
        _ => (number_in(name), None),
    }
}

fn poses_of(path: &Path, names: &[String], options: &ScanLogOptions) -> Result<LayoutPoses> {
    let missing = || Ok(LayoutPoses::Missing(format!("{POSES}, one other .log, or a folder {POSE_FOLDER}")));
    if options.poses.is_some() {
        return missing();
    }
    let trajectory = path.join(POSES);
    if trajectory.is_file() {
        return Ok(LayoutPoses::File(read_poses_3d(trajectory)?));
    }
    let folder = path.join(POSE_FOLDER);
    if folder.is_dir() {
        let beside = |name: &String| {
            let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem);
            pose_beside(&folder.join(format!("{stem}.txt")))
        };
        return Ok(LayoutPoses::PerScan(names.iter().map(beside).collect::<Result<_, _>>()?));
    }
    match &*names_in(path, |name| has_extension(name, "log"))? {
        [one] => Ok(LayoutPoses::File(read_poses_3d(path.join(one))?)),
        _ => missing(),
    }
}

/// The color pictures: of the same name, else of the nearest time, else in order where there are as many.
fn colors_of(path: &Path, depths: &[String], options: &ScanLogOptions) -> Result<Vec<Option<PathBuf>>> {
    let without_colors = vec![None; depths.len()];
    let folder = COLOR_FOLDERS.iter().map(|name| path.join(name)).find(|folder| folder.is_dir());
    let Some(folder) = folder.filter(|_| options.color) else { return Ok(without_colors) };
    let stem = |name: &str| name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned();
    let same: Vec<_> = depths.iter().map(|name| color_beside(&folder, &stem(name))).collect();
    let is_picture = |name: &str| ["jpg", "jpeg", "png"].iter().any(|e| has_extension(name, e));
    let names = names_in(&folder, is_picture)?;
    let times_of =
        |all: &[String]| all.iter().map(|name| number_and_time(name).1).collect::<Option<Vec<_>>>();
    if let (Some(depth_times), Some(times)) = (times_of(depths), times_of(&names)) {
        let mut sorted: Vec<(f64, &String)> = times.into_iter().zip(&names).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = |t: &f64| nearest_in_time(&sorted, *t, options.time_tolerance);
        return Ok(depth_times.iter().map(|t| nearest(t).map(|name| folder.join(name))).collect());
    }
    if same.iter().all(Option::is_none) && names.len() == depths.len() {
        return Ok(names.iter().map(|name| Some(folder.join(name))).collect());
    }
    Ok(same)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::*;
    use crate::scan_log::{CameraFrom, ScanLog, ScanLogKind};
    use crate::testing::says;

    fn trajectory(poses: impl Iterator<Item = usize>) -> String {
        poses.map(|i| format!("{i} {i} {}\n{}", i + 1, matrix_text(&camera_pose(i)))).collect()
    }

    fn json() -> String {
        let [fx, fy, cx, cy] = SMALL_CAMERA;
        let [w, h] = SIZE;
        format!(
            "{{\"width\": {w}, \"height\": {h}, \"intrinsic_matrix\": [{fx}, 0, 0, 0, {fy}, 0, {cx}, {cy}, 1]}}"
        )
    }

    #[test]
    fn a_folder_of_open3d() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        for i in 0..11 {
            write_depth(&file(&format!("depth/{i}.png")), i, 1000.0);
            write_color(&file(&format!("color/{i}.png")), [0, i as u8, 0]);
        }
        write(&file("camera_intrinsic.json"), json());
        write(&file("odometry.log"), trajectory(0..11));
        // The index line assigns a pose to its picture, and two are missing.
        write(&file("trajectory.log"), trajectory((0..11).rev().filter(|i| *i != 4 && *i != 7)));
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!((log.kind(), log.len(), log.time(0)), (ScanLogKind::Redwood, 9, None));
        assert!(matches!(log.camera().unwrap().from, CameraFrom::File(_)));
        assert_eq!((log.stats().scans_without_pose, log.stats().poses_without_scan), (2, 0));
        for (k, i) in [0, 1, 2, 3, 5, 6, 8, 9, 10].into_iter().enumerate() {
            assert_is_picture(&log, k, i);
            assert_eq!(image(&log, k).colors[0], [0, i as u8, 0]);
        }
    }

    #[test]
    fn redwood_names_tell_times_and_colors_are_the_nearest() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        for i in 0..4 {
            write_depth(&file(&format!("depth/{:07}-{:012}.png", i + 1, 33_000 * i)), i, 1000.0);
        }
        // Twice as many colors, from 10 ms on.
        for i in 0..8 {
            let name = format!("image/{:07}-{:012}.png", i + 1, 10_000 + 16_500 * i);
            write_color(&file(&name), [i as u8, 0, 0]);
        }
        write(&file("camera.json"), json());
        write(&file("scene.log"), trajectory(0..4));
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!(log.len(), 4);
        assert!((log.time(3).unwrap() - 0.099).abs() < 1e-12);
        (0..4).for_each(|i| assert_is_picture(&log, i, i));
        assert_eq!([0, 1, 2, 3].map(|i| image(&log, i).colors[0][0]), [0, 1, 3, 5]);
    }

    #[test]
    fn a_folder_of_scannet() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        for i in 0..11 {
            write_depth(&file(&format!("depth/{i}.png")), i, 1000.0);
            write(&file(&format!("pose/{i}.txt")), matrix_text(&camera_pose(i)));
        }
        write(&file("pose/11.txt"), matrix_text(&camera_pose(11)));
        write(&file("pose/5.txt"), "-inf -inf -inf -inf\n".repeat(4));
        let [fx, fy, cx, cy] = SMALL_CAMERA;
        let matrix = format!("{fx} 0 {cx} 0\n0 {fy} {cy} 0\n0 0 1 0\n0 0 0 1\n");
        write(&file("intrinsic/intrinsic_depth.txt"), matrix);
        write(&file("color/0.jpg"), bytes_of(RED_JPEG));
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!((log.len(), log.stats().refused_poses.len(), log.stats().poses_without_scan), (10, 1, 1));
        assert_is_picture(&log, 9, 10);
        assert!(log.stats().colors_left_out.is_some());
    }

    #[test]
    fn two_trajectories_are_one_too_many() {
        let folder = tempfile::tempdir().unwrap();
        write_depth(&folder.path().join("depth/0.png"), 0, 1000.0);
        write(&folder.path().join("camera.json"), json());
        write(&folder.path().join("a.log"), trajectory(0..1));
        write(&folder.path().join("b.log"), trajectory(0..1));
        says(
            ScanLog::open(folder.path(), &ScanLogOptions::default()),
            "the pose file is missing; looked for trajectory.log, one other .log",
        );
    }
}
