//! 7-Scenes *(Shotton et al. 2013)* and what was laid out after it (3DMatch, tsdf-fusion): all files in one folder.
//!
//! `frame-NNNNNN.depth.png` in millimeters, `frame-NNNNNN.pose.txt` (4x4, world from camera), `frame-NNNNNN.color.jpg` or
//! `.png`, and the camera in `camera-intrinsics.txt` (3x3) there or in the folder above. The data set itself comes without
//! that file; its camera is published as 585, 585, 320, 240. Colors are not registered to depth: where the depth camera is that one,
//! colors are looked up through a color camera of 525, 525, 320, 240, unless the caller gives another.

use std::path::Path;

use super::depth_frames::{DepthFrame, DepthFrames, color_beside};
use super::files::{has_name, names_in, number_in};
use super::intrinsics::{color_camera, find_camera, pinhole};
use super::parts::{LayoutPoses, Parts, ScanId, pose_beside, poses_beside_nothing};
use super::{CameraFrom, Distortion, ScanLogOptions, ScanLogStats};
use crate::Result;

const DEPTH: &str = ".depth.png";
const POSE: &str = ".pose.txt";
const UNITS_PER_METRE: f64 = 1000.0;
const CAMERA: [f64; 4] = [585.0, 585.0, 320.0, 240.0];
/// With the depth camera's focal length colors held out are foretold 1.7 dB worse. Where the two stand apart is not published; 25
/// mm, as far as they are in a Kinect, foretells them no better than none.
const COLOR_CAMERA: [f64; 4] = [525.0, 525.0, 320.0, 240.0];

fn is_depth(name: &str) -> bool {
    name.starts_with("frame-") && name.ends_with(DEPTH)
}

pub(super) fn is_it(path: &Path) -> bool {
    has_name(path, is_depth)
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let names = names_in(path, is_depth)?;
    let files = ["camera-intrinsics.txt", "../camera-intrinsics.txt"];
    let mut camera = find_camera(path, &files, Some(("7-Scenes", CAMERA)), options)?;
    // Its makers registered nothing: the color camera is another one, of a focal length that they publish for no file.
    let theirs = camera.pinhole == pinhole(CAMERA) && camera.distortion == Distortion::None;
    camera.color = color_camera(&camera, theirs.then_some(("7-Scenes (color)", COLOR_CAMERA)), options)?;
    let mut scans = Vec::with_capacity(names.len());
    let mut poses = Vec::with_capacity(names.len());
    let mut frames = Vec::with_capacity(names.len());
    for name in &names {
        let stem = name.strip_suffix(DEPTH).unwrap_or(name);
        let depth = path.join(name);
        scans.push(ScanId { path: depth.clone(), number: number_in(name), time: None });
        let color = color_beside(path, &format!("{stem}.color"));
        frames.push(DepthFrame::of(&camera, depth, color));
        // A file of poses makes those beside the scans unneeded, however broken they may be.
        if options.poses.is_none() {
            poses.push(pose_beside(&path.join(format!("{stem}{POSE}")))?);
        }
    }
    let mut stats = ScanLogStats::default();
    if options.poses.is_none() {
        let name_of_scan = |pose: &str| Some(format!("{}{DEPTH}", pose.strip_suffix(POSE)?));
        stats.poses_without_scan = poses_beside_nothing(path, &names, name_of_scan)?;
    }
    let has_colors = options.color && frames.iter().any(|f| f.color.is_some());
    if let Some(CameraFrom::DataSet(name)) = camera.color.as_ref().map(|c| &c.from).filter(|_| has_colors) {
        stats.notes.push(format!(
            "colors are looked up through the camera that is published for {name}; --color-intrinsics names another, the depth \
             camera's if colors are registered to depth"
        ));
    }
    let source = DepthFrames::new(frames, &mut camera, UNITS_PER_METRE, options, &mut stats)?;
    let poses = LayoutPoses::PerScan(poses);
    Ok(Parts { camera: Some(camera), stats, ..Parts::new(path, source, scans, poses) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poses3::PoseConvention;
    use crate::scan_log::color::read_color;
    use crate::scan_log::testing::*;
    use crate::scan_log::{ScanLog, ScanLogKind};
    use crate::testing::{bad_bytes, real_data, says};
    use portolan::geom::vector::distance;

    /// Median distance (meters) along the ray between two frames at the same points: pixels of one, moved into the
    /// other and looked up there.
    fn disagreement(log: &ScanLog, a: usize, b: usize) -> f64 {
        let [one, other] = [a, b].map(|i| image(log, i));
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

    fn write_frame(folder: &Path, number: usize, i: usize) {
        let file = |end: &str| folder.join(format!("frame-{number:06}.{end}"));
        write_depth(&file("depth.png"), i, 1000.0);
        write(&file("pose.txt"), matrix_text(&camera_pose(i)));
    }

    fn folder_of(frames: usize) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        (0..frames).for_each(|i| write_frame(folder.path(), 3 * i, i));
        let [fx, fy, cx, cy] = SMALL_CAMERA;
        write(&folder.path().join("camera-intrinsics.txt"), format!("{fx} 0 {cx}\n0 {fy} {cy}\n0 0 1\n"));
        folder
    }

    #[test]
    fn a_folder_with_everything() {
        let folder = folder_of(12);
        for i in 0..12 {
            write_color(&folder.path().join(format!("frame-{:06}.color.png", 3 * i)), [i as u8, 2, 3]);
        }
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!((log.kind(), log.len(), log.time_span()), (ScanLogKind::SevenScenes, 12, None));
        for i in 0..12 {
            assert_is_picture(&log, i, i);
            assert_eq!(image(&log, i).colors, [[i as u8, 2, 3]; 48]);
        }
        assert!((log.path_length() - 11.0 * 0.1f64.hypot(0.25)).abs() < 1e-9);
        assert!((log.extent().extent()[2] - 11.0 * 0.25).abs() < 1e-9);
        let stats = ScanLogStats { scans: 12, poses: 12, ..ScanLogStats::default() };
        assert_eq!(ScanLogStats { worst_pose: 0.0, ..log.stats().clone() }, stats);
        let options = ScanLogOptions { color: false, ..ScanLogOptions::default() };
        assert!(image(&ScanLog::open(folder.path(), &options).unwrap(), 0).colors.is_empty());
    }

    #[test]
    fn what_is_missing_or_broken_is_left_out_and_counted() {
        let folder = folder_of(6);
        let file = |name: &str| folder.path().join(name);
        std::fs::remove_file(file("frame-000003.pose.txt")).unwrap();
        std::fs::remove_file(file("frame-000006.depth.png")).unwrap();
        write(&file("frame-000009.pose.txt"), "-inf -inf -inf -inf\n".repeat(4));
        let stretched = matrix_text(&camera_pose(4)).replacen("0.", "0.7", 1);
        write(&file("frame-000012.pose.txt"), stretched);
        let slightly = camera_pose(5);
        let mut off = slightly;
        off.rotation[2][2] += 1e-3;
        write(&file("frame-000015.pose.txt"), matrix_text(&off));
        write_color(&file("frame-000000.color.png"), [1, 2, 3]);
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!(log.len(), 2);
        assert_is_picture(&log, 0, 0);
        assert_is_picture(&log, 1, 5);
        let stats = log.stats();
        assert_eq!((stats.scans, stats.poses, stats.scans_without_pose), (5, 4, 1));
        assert_eq!((stats.mended_poses, stats.scans_without_color, stats.poses_without_scan), (1, 4, 1));
        assert!((stats.worst_pose - 2e-3).abs() < 1e-5);
        let refused: Vec<String> = stats.refused_poses.iter().map(ToString::to_string).collect();
        assert!(
            refused[0].ends_with("frame-000009.pose.txt: line 1: the pose has an entry that is not finite")
        );
        assert!(refused[1].contains("frame-000012.pose.txt: line 1: the pose is not rigid"), "{refused:?}");
        assert_eq!(refused.len(), 2);
    }

    #[test]
    fn colors_of_another_size_are_left_out_and_said() {
        let folder = folder_of(2);
        write(&folder.path().join("frame-000003.color.jpg"), bytes_of(RED_JPEG));
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        let why = log.stats().colors_left_out.as_deref().unwrap();
        assert!(
            why.starts_with("they are 8 x 8 while the depth images are 8 x 6 (--color-intrinsics"),
            "{why}"
        );
        assert!(image(&log, 1).colors.is_empty());
    }

    #[test]
    fn depth_stays_where_colors_cannot_be_read() {
        let folder = folder_of(4);
        let color = |i: usize| folder.path().join(format!("frame-{:06}.color.png", 3 * i));
        [1, 3].into_iter().for_each(|i| write_color(&color(i), [1, 2, 3]));
        // No picture, one of another size, one cut off; the first that can be read decides the size.
        let whole = std::fs::read(color(3)).unwrap();
        write(&color(0), "no picture");
        write(&color(2).with_extension("jpg"), bytes_of(RED_JPEG));
        write(&color(3), &whole[..whole.len() - 20]);
        let open = || ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        let log = open();
        assert_eq!((&log.stats().colors_left_out, log.unread_colors()), (&None, None));
        // In any order, and again: each picture counts once, the first is that of the log.
        for i in [3, 2, 1, 0, 2] {
            assert_is_picture(&log, i, i);
            assert_eq!(image(&log, i).colors.len(), if i == 1 { 48 } else { 0 }, "{i}");
        }
        let unread = log.unread_colors().unwrap();
        assert_eq!(unread.pictures, 3);
        let part =
            "frame-000000.color.png: the format of the color picture is \"no pictu\"; give JPEG or PNG";
        assert!(unread.first.contains(part), "{}", unread.first);
        // The one of another size alone.
        write_color(&color(0), [1, 2, 3]);
        write_color(&color(3), [1, 2, 3]);
        let log = open();
        (0..4).for_each(|i| assert_is_picture(&log, i, i));
        let unread = log.unread_colors().unwrap();
        assert!(
            unread.pictures == 1
                && unread.first.contains("000006.color.jpg: the size of the picture is 8 x 8; the depth")
        );
        // None that can be read.
        std::fs::remove_file(color(2).with_extension("jpg")).unwrap();
        (0..4).for_each(|i| write(&color(i), "no picture"));
        let log = open();
        let why = log.stats().colors_left_out.as_deref().unwrap();
        assert!(
            why.starts_with("the first of them cannot be read: ") && why.contains("frame-000000.color.png"),
            "{why}"
        );
        assert_is_picture(&log, 2, 2);
    }

    #[test]
    fn a_file_of_poses_overrides_those_beside_the_frames() {
        let folder = folder_of(4);
        let poses = folder.path().join("other.txt");
        let open = |text: String, convention| {
            write(&poses, text);
            let options = ScanLogOptions {
                poses: Some(poses.clone()),
                pose_convention: convention,
                ..ScanLogOptions::default()
            };
            ScanLog::open(folder.path(), &options)
        };
        // As many as frames: in order. More: by the number of the frame.
        let backwards: String = [0, 1, 2, 3].map(|i| matrix_text(&camera_pose(i).inverse())).concat();
        let log = open(backwards, Some(PoseConvention::SensorFromWorld)).unwrap();
        (0..4).for_each(|i| assert_is_picture(&log, i, i));
        let dense = (0..12).map(|i| quaternion_text(i / 3) + "\n").collect();
        let log = open(dense, None).unwrap();
        (0..4).for_each(|i| assert_is_picture(&log, i, i));
        assert_eq!(log.stats().poses_without_scan, 8);
        let few = quaternion_text(0) + "\n" + &quaternion_text(1);
        says(open(few, None), "other.txt: the number of poses is 2; give one pose for each of the 4");
    }

    #[test]
    fn no_bytes_of_any_file_make_it_panic() {
        let folder = folder_of(2);
        for name in ["frame-000003.pose.txt", "frame-000000.depth.png", "camera-intrinsics.txt"] {
            let path = folder.path().join(name);
            let good = std::fs::read(&path).unwrap();
            for bytes in bad_bytes(&good, 7, 60) {
                std::fs::write(&path, bytes).unwrap();
                let log = ScanLog::open(folder.path(), &ScanLogOptions::default());
                let all =
                    log.and_then(|log| (0..log.len()).map(|i| log.frame(i)).collect::<Result<Vec<_>, _>>());
                if let Err(e) = all {
                    let text = e.to_string();
                    assert!(text.contains(folder.path().to_str().unwrap()) && !text.contains('\n'), "{text}");
                }
            }
            std::fs::write(&path, good).unwrap();
        }
    }

    #[test]
    fn what_is_no_log_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let open = |path: &Path, format| {
            let options = ScanLogOptions { format, ..ScanLogOptions::default() };
            ScanLog::open(path, &options).unwrap_err().to_string()
        };
        let error = open(folder.path(), None);
        assert!(
            error.contains("the kind of log is not recognized; the kinds are seven-scenes, tum"),
            "{error}"
        );
        let error = open(&folder.path().join("none"), None);
        assert!(error.contains("none: cannot open it"), "{error}");
        let error = open(folder.path(), Some(ScanLogKind::SevenScenes));
        assert!(error.contains("the number of scans is 0"), "{error}");
        write_frame(folder.path(), 0, 0);
        write(&folder.path().join("camera-intrinsics.txt"), "10 12 3.5 2.5");
        write(&folder.path().join("frame-000000.pose.txt"), "nan 0 0 0\n".repeat(4));
        let error = open(folder.path(), None);
        assert!(error.contains("with a usable pose is 0 of 1; the first refused pose: "), "{error}");
        assert!(error.contains("frame-000000.pose.txt: line 1: the pose has an entry that"), "{error}");
    }

    #[test]
    fn a_camera_of_other_pictures_is_refused() {
        let folder = folder_of(1);
        std::fs::remove_file(folder.path().join("camera-intrinsics.txt")).unwrap();
        says(
            ScanLog::open(folder.path(), &ScanLogOptions::default()),
            "the size of the picture is 8 x 6; the camera is for 640 x 480",
        );
    }

    #[test]
    fn frames_of_the_real_kitchen_agree_in_the_world() {
        let Some(path) = real_data("rgbd_redkitchen") else { return };
        let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
        assert_eq!((log.kind(), log.len()), (ScanLogKind::SevenScenes, 200));
        assert_eq!(log.name(), "rgbd_redkitchen");
        assert!(log.stats().refused_poses.is_empty() && log.stats().mended_poses > 0);
        assert!(log.stats().worst_pose < 1e-3, "{}", log.stats().worst_pose);
        // Sums and pixels of frame 300 as another library reads them.
        let frame = image(&log, 100);
        assert_eq!((frame.columns, frame.rows, frame.hits()), (640, 480, 640 * 480 - 34_407));
        let sum: f64 = frame.values.iter().map(|v| f64::from(*v)).sum();
        assert!((sum - 487_329.342).abs() < 0.05, "{sum}");
        assert_eq!((frame.values[240 * 640 + 320], frame.values[100 * 640 + 200]), (2.335, 2.367));
        let colors = read_color(&path.join("frame-000300.color.jpg"), [640, 480]).unwrap();
        let mean = |k: usize| colors.iter().map(|c| f64::from(c[k])).sum::<f64>() / 307_200.0;
        for (k, theirs) in [143.988, 126.797, 115.368].into_iter().enumerate() {
            assert!((mean(k) - theirs).abs() < 0.5, "channel {k}: {}", mean(k));
        }
        for (at, theirs) in [(100 * 640 + 200, [75, 59, 88]), (400 * 640 + 50, [206, 180, 163])] {
            assert!((0..3).all(|k| colors[at][k].abs_diff(theirs[k]) <= 4), "{:?}", colors[at]);
        }
        let from_threads: Vec<_> = std::thread::scope(|scope| {
            let threads = [100, 20, 100].map(|i| {
                scope.spawn({
                    let log = &log;
                    move || image(log, i)
                })
            });
            threads.into_iter().map(|t| t.join().unwrap()).collect()
        });
        assert!(from_threads[0] == frame && from_threads[2] == frame && from_threads[1] != frame);
        // Half a pixel at 2 m is 1.7 mm, the depth's own step there 3 mm.
        let right = disagreement(&log, 10, 11);
        assert!(right < 0.006, "{right}");
        let options = with_convention(PoseConvention::SensorFromWorld);
        let wrong = disagreement(&ScanLog::open(&path, &options).unwrap(), 10, 11);
        assert!(wrong > 2.0 * right, "{wrong} against {right}");
    }
}
