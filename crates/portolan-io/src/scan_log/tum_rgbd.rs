//! TUM RGB-D *(Sturm et al. 2012)*, which ETH3D SLAM follows: pictures with times.
//!
//! `depth.txt` and `rgb.txt` list `time file`, `groundtruth.txt` has the poses of the depth camera at its own times, far
//! denser. Each depth image takes the color picture that is nearest in time, and the pose at its time, interpolated between
//! the two beside it; both within [`ScanLogOptions::time_tolerance`]. Depth is in units of 1/5000 m.
//!
//! Where these lists are missing, a file of any name that pairs pictures line by line (`association.rs`) says the same, perhaps with
//! poses. Several such files, of which none is the only one with poses, are an error: one of them is named instead of the folder.
//!
//! The camera is in no file of TUM's: it is published for the three sensors, and the folder's name decides which. ETH3D puts
//! it in `calibration.txt`. What is published of the distortion of TUM's lenses is not
//! applied unless the caller gives it.

use std::path::{Path, PathBuf};

use super::association::{Association, Pair};
use super::depth_frames::{DepthFrame, DepthFrames};
use super::files::name_of;
use super::intrinsics::{color_camera, find_camera};
use super::matching::nearest_in_time;
use super::parts::{LayoutPoses, Parts, ScanId};
use super::{ScanLogOptions, ScanLogStats, colmap, redwood, transforms};
use crate::bytes::{Lines, open as open_input, parse_f64};
use crate::error::shown;
use crate::poses3::{PoseFile, PoseLayout, read_poses_3d};
use crate::{IoError, Result};

const DEPTH: &str = "depth.txt";
const COLOR: &str = "rgb.txt";
const POSES: &str = "groundtruth.txt";
const CAMERA_FILES: [&str; 3] = ["calibration.txt", "camera-intrinsics.txt", "intrinsics.txt"];
const UNITS_PER_METRE: f64 = 5000.0;

/// The most pictures of a list.
const MOST_PICTURES: usize = 1 << 21;

fn has_lists(folder: &Path) -> bool {
    folder.join(DEPTH).is_file() && (folder.join(POSES).is_file() || folder.join("depth").is_dir())
}

/// Lists under TUM's names; an association file; a folder with one, unless it has the poses of another kind of log and none of this.
pub(super) fn is_it(path: &Path) -> bool {
    if path.is_file() {
        return Association::in_file(path).is_some();
    }
    let has_poses =
        |all: &[Association]| all.iter().any(Association::has_poses) || path.join(POSES).is_file();
    let is_of_association = || {
        let all = Association::all_in(path);
        !all.is_empty() && (has_poses(&all) || !has_poses_of_others(path))
    };
    path.is_dir() && (has_lists(path) || is_of_association())
}

/// Whether a folder is a log with poses by itself, whatever pairs its pictures.
fn has_poses_of_others(path: &Path) -> bool {
    redwood::is_it(path) || transforms::is_it(path) || colmap::is_it(path)
}

/// The pictures of a log, in order of time where they have times, and what the file that pairs them knows of poses.
#[derive(Default)]
struct Pictures {
    scans: Vec<ScanId>,
    colors: Vec<Option<PathBuf>>,
    poses: Option<LayoutPoses>,
    notes: Vec<String>,
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let folder = if path.is_file() { path.parent().unwrap_or(Path::new(".")) } else { path };
    let (list, mut pictures) = pictures_of(path, options)?;
    let mut stats = ScanLogStats::default();
    let listed = pictures.scans.len();
    pictures.keep_those_that_are_there();
    stats.missing_files = (listed - pictures.scans.len()) as u64;
    if pictures.scans.is_empty() {
        let value = format!("0 of {listed}");
        let advice = format!("name the folder that holds the pictures beside {}", name_of(&list));
        let field = "the number of pictures that are there";
        return Err(IoError::layout(&list, field, value, advice));
    }
    stats.notes = pictures.notes;
    let mut camera = find_camera(folder, &CAMERA_FILES, published_camera(&name_of(folder)), options)?;
    camera.color = color_camera(&camera, None, options)?;
    let depths = pictures.scans.iter().map(|scan| scan.path.clone());
    let frames = depths.zip(pictures.colors).map(|(depth, color)| {
        let color = color.filter(|file| options.color && file.is_file());
        DepthFrame::of(&camera, depth, color)
    });
    let frames = frames.collect();
    let truth = folder.join(POSES);
    let poses = match (&options.poses, pictures.poses) {
        (None, Some(poses)) => poses,
        (None, None) if truth.is_file() => LayoutPoses::File(read_poses_3d(truth)?),
        _ => LayoutPoses::Missing(POSES.into()),
    };
    let source = DepthFrames::new(frames, &mut camera, UNITS_PER_METRE, options, &mut stats)?;
    Ok(Parts { camera: Some(camera), stats, ..Parts::new(path, source, pictures.scans, poses) })
}

/// What pairs the pictures, and the pictures.
fn pictures_of(path: &Path, options: &ScanLogOptions) -> Result<(PathBuf, Pictures)> {
    if path.is_file() {
        let Some(association) = Association::in_file(path) else {
            let advice = "write t rgb/a.png t depth/b.png in each line, perhaps with tx ty tz qx qy qz qw";
            return Err(IoError::layout(path, "the first line", "no pair of pictures", advice));
        };
        return Ok((path.into(), Pictures::of_pairs(&association)?));
    }
    let all = Association::all_in(path);
    let names = || all.iter().map(|a| name_of(&a.path)).collect::<Vec<_>>().join(", ");
    if has_lists(path) {
        let mut pictures = Pictures::of_lists(path, options)?;
        if !all.is_empty() {
            let names = names();
            pictures.notes.push(format!(
                "{names}: pairs pictures, too, and was not used, as {DEPTH} is there; name the file instead of the folder to use it"
            ));
        }
        return Ok((path.join(DEPTH), pictures));
    }
    // One with poses is worth more than one without, where nothing else has any.
    let wants_poses = options.poses.is_none() && !path.join(POSES).is_file();
    let with_poses: Vec<_> = all.iter().filter(|a| a.has_poses()).collect();
    let chosen = match (all.as_slice(), with_poses.as_slice()) {
        ([one], _) => one,
        (_, [one]) if wants_poses => one,
        ([], _) => {
            let advice =
                format!("looked for {DEPTH} and for files that pair pictures (t rgb/a.png t depth/b.png)");
            return Err(IoError::layout(path, "the list of pictures", "missing", advice));
        }
        _ => {
            let value = format!("not clear ({})", names());
            let advice = "several files pair pictures: name one of them instead of the folder";
            return Err(IoError::layout(path, "the list of pictures", value, advice));
        }
    };
    let mut pictures = Pictures::of_pairs(chosen)?;
    if all.len() > 1 {
        let (names, chosen) = (names(), name_of(&chosen.path));
        pictures.notes.push(format!("of {names}, {chosen} was used: it alone has poses"));
    }
    Ok((chosen.path.clone(), pictures))
}

impl Pictures {
    fn of_lists(folder: &Path, options: &ScanLogOptions) -> Result<Self> {
        let depths = read_list(&folder.join(DEPTH))?;
        let colors = folder.join(COLOR);
        let colors = if options.color && colors.is_file() { read_list(&colors)? } else { Vec::new() };
        let color =
            |time| nearest_in_time(&colors, time, options.time_tolerance).filter(|file| file.is_file());
        let colors = depths.iter().map(|(time, _)| color(*time).cloned()).collect();
        let scan = |(t, path)| ScanId { path, number: None, time: Some(t) };
        Ok(Self { scans: depths.into_iter().map(scan).collect(), colors, ..Self::default() })
    }

    fn of_pairs(association: &Association) -> Result<Self> {
        let mut pairs = association.read()?;
        if pairs.iter().all(|pair| pair.time.is_some()) {
            let time = |pair: &Pair| pair.time.unwrap_or_default();
            pairs.sort_by(|a, b| time(a).total_cmp(&time(b)));
        }
        let path = &association.path;
        let mut notes = vec![format!(
            "{} pairs the pictures; depth is taken in units of 1/5000 m, as TUM has it (--depth-scale says otherwise)",
            name_of(path)
        )];
        let has_poses = association.has_poses();
        if has_poses && path.with_file_name(POSES).is_file() {
            notes.push(format!("the poses are those of {}, not of {POSES}", name_of(path)));
        }
        // Poses at times of their own are a trajectory; else each is that of its picture.
        let poses = pairs.iter().map(|pair| pair.pose.clone());
        let has_times = pairs.iter().all(|pair| pair.time.is_some());
        let poses = match has_poses {
            true if association.has_times_of_poses() && has_times => LayoutPoses::File(PoseFile {
                path: path.clone(),
                layout: PoseLayout::Tum,
                poses: poses.flatten().collect(),
            }),
            _ => LayoutPoses::PerScan(poses.map(|pose| Some((path.clone(), pose?))).collect()),
        };
        let scan = |pair: &Pair| ScanId { path: pair.depth.clone(), number: None, time: pair.time };
        Ok(Self {
            scans: pairs.iter().map(scan).collect(),
            colors: pairs.into_iter().map(|pair| Some(pair.color)).collect(),
            poses: has_poses.then_some(poses),
            notes,
        })
    }

    /// Leaves out pictures without a file, with their colors and the poses that are theirs alone.
    fn keep_those_that_are_there(&mut self) {
        let is_there: Vec<bool> = self.scans.iter().map(|scan| scan.path.is_file()).collect();
        let mut keep = is_there.iter();
        self.scans.retain(|_| keep.next().is_some_and(|k| *k));
        let mut keep = is_there.iter();
        self.colors.retain(|_| keep.next().is_some_and(|k| *k));
        if let Some(LayoutPoses::PerScan(poses)) = &mut self.poses {
            let mut keep = is_there.iter();
            poses.retain(|_| keep.next().is_some_and(|k| *k));
        }
    }
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
        // Zero has no sign.
        pictures.push((time + 0.0, folder.join(file)));
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
