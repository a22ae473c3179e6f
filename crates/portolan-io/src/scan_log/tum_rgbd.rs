//! TUM RGB-D *(Sturm et al. 2012)*, which ETH3D SLAM follows: pictures with times.
//!
//! `depth.txt` and `rgb.txt` list `time file`, `groundtruth.txt` has the poses of the depth camera at its own times, far
//! denser. Each depth image takes the color picture that is nearest in time, and the pose at its time, interpolated between
//! the two beside it; both within [`ScanLogOptions::time_tolerance`]. Depth is in units of 1/5000 m.
//!
//! The camera is in no file of TUM's: it is published for the three sensors, and the folder's name decides which. ETH3D puts
//! it in `calibration.txt`. What is published of the distortion of TUM's lenses is not
//! applied unless the caller gives it.

use std::path::{Path, PathBuf};

use super::depth_frames::{DepthFrame, DepthFrames};
use super::files::name_of;
use super::intrinsics::{color_camera, find_camera};
use super::matching::nearest_in_time;
use super::parts::{LayoutPoses, Parts, ScanId};
use super::{ScanLogOptions, ScanLogStats};
use crate::bytes::{Lines, open as open_input, parse_f64};
use crate::error::shown;
use crate::poses3::read_poses_3d;
use crate::{IoError, Result};

const DEPTH: &str = "depth.txt";
const COLOR: &str = "rgb.txt";
const POSES: &str = "groundtruth.txt";
const CAMERA_FILES: [&str; 3] = ["calibration.txt", "camera-intrinsics.txt", "intrinsics.txt"];
const UNITS_PER_METRE: f64 = 5000.0;

/// The most pictures of a list.
const MOST_PICTURES: usize = 1 << 21;

pub(super) fn is_it(path: &Path) -> bool {
    path.join(DEPTH).is_file() && (path.join(POSES).is_file() || path.join("depth").is_dir())
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let mut stats = ScanLogStats::default();
    let mut depths = read_list(&path.join(DEPTH))?;
    let listed = depths.len();
    depths.retain(|(_, file)| file.is_file());
    stats.missing_files = (listed - depths.len()) as u64;
    if depths.is_empty() {
        let value = format!("0 of {listed}");
        let advice = "name the folder that holds the pictures beside depth.txt";
        let field = "the number of pictures that are there";
        return Err(IoError::layout(&path.join(DEPTH), field, value, advice));
    }
    let colors = path.join(COLOR);
    let colors = if options.color && colors.is_file() { read_list(&colors)? } else { Vec::new() };
    let mut camera = find_camera(path, &CAMERA_FILES, published_camera(&name_of(path)), options)?;
    let color = |time| nearest_in_time(&colors, time, options.time_tolerance).filter(|file| file.is_file());
    camera.color = color_camera(&camera, None, options)?;
    let frames =
        depths.iter().map(|(time, file)| DepthFrame::of(&camera, file.clone(), color(*time).cloned()));
    let frames = frames.collect();
    let poses = path.join(POSES);
    let poses = match &options.poses {
        None if poses.is_file() => LayoutPoses::File(read_poses_3d(poses)?),
        _ => LayoutPoses::Missing(POSES.into()),
    };
    let source = DepthFrames::new(frames, &mut camera, UNITS_PER_METRE, options, &mut stats)?;
    let scans = depths.into_iter().map(|(t, path)| ScanId { path, number: None, time: Some(t) }).collect();
    Ok(Parts { camera: Some(camera), stats, ..Parts::new(path, source, scans, poses) })
}

/// What TUM publishes for the color cameras, to which its depth images are registered.
fn published_camera(name: &str) -> Option<(&'static str, [f64; 4])> {
    let name = name.to_ascii_lowercase();
    let is = |long: &str, short: &str| name.contains(long) || name.contains(short);
    if is("freiburg1", "fr1") {
        Some(("TUM freiburg1", [517.3, 516.5, 318.6, 255.3]))
    } else if is("freiburg2", "fr2") {
        Some(("TUM freiburg2", [520.9, 521.0, 325.1, 249.7]))
    } else if is("freiburg3", "fr3") {
        Some(("TUM freiburg3", [535.4, 539.2, 320.1, 247.6]))
    } else {
        None
    }
}

/// The pictures of a list, in order of time.
fn read_list(path: &Path) -> Result<Vec<(f64, PathBuf)>> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut lines = Lines::of(open_input(path)?);
    let mut pictures = Vec::new();
    while let Some((number, line)) = lines.next_numbered()? {
        let line = line.trim_ascii();
        if line.is_empty() || line.starts_with(b"#") {
            continue;
        }
        // A comma separates where no white space comes before it: "1,5 rgb/1.png" has a decimal comma.
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let comma = line[..end].iter().position(|b| *b == b',');
        let end = comma.filter(|at| end == line.len() || *at + 1 == end).unwrap_or(end);
        let (time, file) = line.split_at(end);
        let Some(time) = parse_f64(time).filter(|t| t.is_finite()) else {
            return Err(IoError::text(path, number, "the time", shown(time), "write seconds, then a file"));
        };
        let file = file.trim_ascii_start().strip_prefix(b",").unwrap_or(file).trim_ascii();
        let file = std::str::from_utf8(file).unwrap_or("");
        if file.is_empty() || file.contains('\0') {
            return Err(IoError::text(path, number, "the file", shown(line), "write seconds, then a file"));
        }
        IoError::unless_full(path, number, pictures.len(), MOST_PICTURES, "pictures", "list")?;
        pictures.push((time, folder.join(file)));
    }
    pictures.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(pictures)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::*;
    use crate::scan_log::{CameraFrom, ScanLog, ScanLogKind};
    use crate::testing::{bad_bytes, says, temporary};

    const START: f64 = 1_305_031_453.25;

    /// Depth at 0, 0.25 s ..., poses 8 ms before and 8 ms after each, colors 5 ms later.
    fn folder_of(pictures: usize) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let (mut depths, mut colors, mut poses) =
            ("# depth maps\n".to_owned(), String::new(), "# timestamp tx ty tz qx qy qz qw\n".to_owned());
        for i in (0..pictures).rev() {
            let time = START + 0.25 * i as f64;
            depths += &format!("{time:.6} depth/{time:.6}.png\n");
            write_depth(&folder.path().join(format!("depth/{time:.6}.png")), i, 5000.0);
            let later = time + 0.005;
            colors += &format!("{later:.6} rgb/{later:.6}.png\n");
            write_color(&folder.path().join(format!("rgb/{later:.6}.png")), [i as u8, 0, 0]);
            // Moved apart, so that only their middle is right.
            let [x, y, z] = camera_pose(i).translation;
            let turn = quaternion_text(i).splitn(4, ' ').last().unwrap().to_owned();
            poses += &format!("{:.4} {} {y} {z} {turn}\n", time - 0.008, x - 0.04);
            poses += &format!("{:.4} {} {y} {z} {turn}\n", time + 0.008, x + 0.04);
        }
        write(&folder.path().join("depth.txt"), depths);
        write(&folder.path().join("rgb.txt"), colors);
        write(&folder.path().join("groundtruth.txt"), poses);
        write(&folder.path().join("calibration.txt"), SMALL_CAMERA.map(|v| v.to_string()).join(" "));
        folder
    }

    #[test]
    fn pictures_take_the_pose_and_the_color_of_their_time() {
        let folder = folder_of(5);
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!((log.kind(), log.len()), (ScanLogKind::TumRgbd, 5));
        assert_eq!(log.time_span(), Some((START, START + 1.0)));
        assert!(matches!(&log.camera().unwrap().from, CameraFrom::File(f) if f.ends_with("calibration.txt")));
        for i in 0..5 {
            assert_is_picture(&log, i, i);
            assert_eq!(image(&log, i).colors[7], [i as u8, 0, 0]);
        }
        assert_eq!((log.stats().unmatched_times, log.stats().scans_without_color), (0, 0));
    }

    #[test]
    fn what_has_no_partner_in_time_is_left_out_and_counted() {
        let folder = folder_of(5);
        let edit = |name: &str, change: &dyn Fn(&str) -> String| {
            let path = folder.path().join(name);
            let text = std::fs::read_to_string(&path).unwrap();
            std::fs::write(path, change(&text)).unwrap();
        };
        // The poses of the first picture come too late, the picture of the second is lost, the color of the third too, and
        // the poses of the last are no poses.
        let times = [-0.008, 0.008].map(|d| format!("{:.4}", START + d));
        edit("groundtruth.txt", &|text| {
            let text = text.replace(&times[0], &format!("{:.4}", START + 0.03));
            text.replace(&times[1], &format!("{:.4}", START + 0.04))
        });
        std::fs::remove_file(folder.path().join(format!("depth/{:.6}.png", START + 0.25))).unwrap();
        std::fs::remove_file(folder.path().join(format!("rgb/{:.6}.png", START + 0.505))).unwrap();
        let last = format!("{:.4}", START + 0.992);
        let after = format!("{:.4}", START + 1.008);
        edit("groundtruth.txt", &|text| {
            let keep = text.lines().filter(|l| !l.starts_with(&last) && !l.starts_with(&after));
            keep.collect::<Vec<_>>().join("\n")
                + &format!("\n{last} 0 0 0 0 0 0 0\n{after} 0 0 0 nan 0 0 1\n")
        });
        let log = ScanLog::open(folder.path(), &ScanLogOptions::default()).unwrap();
        assert_eq!(log.len(), 2);
        assert_is_picture(&log, 0, 2);
        assert_is_picture(&log, 1, 3);
        let stats = log.stats();
        assert_eq!((stats.scans, stats.missing_files, stats.unmatched_times), (4, 1, 2));
        assert_eq!((stats.poses, stats.refused_poses.len(), stats.scans_without_color), (10, 2, 1));
        assert!(image(&log, 0).colors.is_empty() && image(&log, 1).colors.len() == 48);
        // A wider tolerance finds the late poses.
        let options = ScanLogOptions { time_tolerance: 0.05, ..ScanLogOptions::default() };
        assert_eq!(ScanLog::open(folder.path(), &options).unwrap().stats().unmatched_times, 1);
    }

    #[test]
    fn other_clocks_and_unknown_cameras_are_errors() {
        let folder = folder_of(3);
        let open = |path: &Path| ScanLog::open(path, &ScanLogOptions::default());
        let truth = folder.path().join("groundtruth.txt");
        let text = std::fs::read_to_string(&truth).unwrap();
        std::fs::write(&truth, text.replace("130503", "140503")).unwrap();
        says(open(folder.path()), "groundtruth.txt: the time of the poses is 1405031453.242 to");
        std::fs::write(&truth, text).unwrap();
        std::fs::remove_file(folder.path().join("calibration.txt")).unwrap();
        says(open(folder.path()), "the camera is unknown; give fx,fy,cx,cy or a file with --intrinsics");
        std::fs::remove_file(&truth).unwrap();
        write(&folder.path().join("calibration.txt"), "10 12 3.5 2.5");
        says(open(folder.path()), "the pose file is missing; looked for groundtruth.txt; name a file");
        assert_eq!(published_camera("rgbd_dataset_freiburg2_desk").unwrap().1[0], 520.9);
        assert_eq!(published_camera("fr3_office").unwrap().0, "TUM freiburg3");
        assert_eq!(published_camera("kitchen"), None);
    }

    #[test]
    fn lists_are_read_whatever_they_are() {
        let (folder, path) = temporary("depth.txt");
        let good = "# c\n2.5 depth/b c.png\n1.5,depth/a.png\n\n";
        write(&path, good);
        let list = read_list(&path).unwrap();
        assert_eq!(list[0], (1.5, folder.path().join("depth/a.png")));
        assert_eq!(list[1], (2.5, folder.path().join("depth/b c.png")));
        for (text, part) in [("x y", "line 1: the time is \"x\""), ("\n1.5", "line 2: the file is \"1.5\"")] {
            write(&path, text);
            says(read_list(&path), part);
        }
        for bytes in bad_bytes(good.as_bytes(), 9, 100) {
            write(&path, bytes);
            let _ = read_list(&path);
        }
    }
}
