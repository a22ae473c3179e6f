//! KITTI odometry *(Geiger, Lenz, Urtasun 2012)* and what was laid out after it (SemanticKITTI): a folder with
//! `velodyne/NNNNNN.bin`, `poses.txt` (rows of 12 numbers), `calib.txt`, `times.txt`.
//!
//! The poses are those of the **left camera** in the frame of the first one (x right, y down, z forward). The line `Tr` of
//! `calib.txt` leads from the lidar to the camera: `world_from_lidar = world_from_camera * Tr`. The benchmark keeps poses
//! apart, as `poses/00.txt` beside `sequences/00`: they are looked for there too. Times are seconds since the first scan.
//!
//! Poses that the caller names (`--poses`) are the lidar's own, as those of SLAM and odometry are, and so are all poses
//! where the caller gives a convention (`--pose-convention`): then `Tr` is not applied, whether `calib.txt` is there or not.

use std::path::{Path, PathBuf};

use portolan::geom::Pose;

use super::ScanLogOptions;
use super::cloud_frames::{CloudFrames, Rays};
use super::files::{has_extension, has_name, names_in, number_in};
use super::parts::{LayoutPoses, Parts, ScanId};
use crate::bytes::{Lines, fields, open as open_input, parse_f64};
use crate::error::shown;
use crate::points::PointFormat;
use crate::poses3::{PoseConvention, RawPose, read_poses_3d};
use crate::{IoError, Result};

/// The most scans of a log.
const MOST_TIMES: usize = 1 << 21;

fn is_scan(name: &str) -> bool {
    has_extension(name, "bin")
}

pub(super) fn is_it(path: &Path) -> bool {
    has_name(&path.join("velodyne"), is_scan)
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let folder = path.join("velodyne");
    let names = names_in(&folder, is_scan)?;
    let files: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    let times = match path.join("times.txt") {
        file if file.is_file() => Some(read_times(&file)?),
        _ => None,
    };
    let mut scans = Vec::with_capacity(files.len());
    for (i, (file, name)) in files.iter().zip(&names).enumerate() {
        let number = number_in(name);
        // The name is the place in the lists, so that some scans may be missing.
        let place = number.and_then(|n| usize::try_from(n).ok()).unwrap_or(i);
        let time = times.as_ref().and_then(|t| t.get(place)).copied();
        scans.push(ScanId { path: file.clone(), number, time });
    }
    let poses = match (&options.poses, pose_file(path)) {
        (Some(_), _) | (None, None) => {
            LayoutPoses::Missing("poses.txt there and poses/NN.txt beside sequences/NN".into())
        }
        (None, Some(file)) => LayoutPoses::File(read_poses_3d(file)?),
    };
    let origins = vec![options.origin.unwrap_or([0.0; 3]); files.len()];
    let source = CloudFrames::new(files, Some(PointFormat::KittiBin), Rays::From(origins))?;
    let posed_from_sensor = camera_from_lidar(path, options)?;
    Ok(Parts { posed_from_sensor, ..Parts::new(path, source, scans, poses) })
}

fn pose_file(path: &Path) -> Option<PathBuf> {
    let absolute = std::path::absolute(path).ok()?;
    let apart = absolute.file_name().map(|name| {
        let mut file = name.to_owned();
        file.push(".txt");
        absolute.join("../../poses").join(file)
    });
    std::iter::once(path.join("poses.txt")).chain(apart).find(|file| file.is_file())
}

/// `Tr`; `None` where poses are the lidar's own.
fn camera_from_lidar(path: &Path, options: &ScanLogOptions) -> Result<Option<Pose<3>>> {
    if options.pose_convention.is_some() || options.poses.is_some() {
        return Ok(None);
    }
    let file = path.join("calib.txt");
    if !file.is_file() {
        // A camera does not look where the lidar does.
        let advice = "put calib.txt (with a line Tr) there, or give --pose-convention world-from-sensor where poses are the lidar's own";
        return Err(IoError::layout(path, "calib.txt", "missing", advice));
    }
    read_transform(&file).map(Some)
}

/// How the line of the transform begins.
const TRANSFORM_WORDS: [&[u8]; 5] = [b"Tr:", b"Tr", b"Tr_velo_to_cam:", b"Tr_velo_cam", b"Tr_velo_cam:"];

/// The twelve numbers of the line `Tr` (`Tr_velo_to_cam` in KITTI's other benchmarks).
fn read_transform(path: &Path) -> Result<Pose<3>> {
    let mut lines = Lines::of(open_input(path)?);
    while let Some((number, line)) = lines.next_numbered()? {
        let mut words = fields(line);
        if !words.next().is_some_and(|word| TRANSFORM_WORDS.contains(&word)) {
            continue;
        }
        let bad = |advice: &str| IoError::text(path, number, "Tr", shown(line), advice);
        let values: Option<Vec<f64>> = words.map(parse_f64).collect();
        let [a, b, c, x, d, e, f, y, g, h, i, z] = *values.unwrap_or_default() else {
            return Err(bad("write twelve numbers, the rows of a 3x4 matrix"));
        };
        let raw = RawPose::new([[a, b, c], [d, e, f], [g, h, i]], [x, y, z], number);
        let resolved = raw.resolve(PoseConvention::WorldFromSensor);
        return resolved.map(|(pose, _)| pose).map_err(|fault| bad(&fault.to_string()));
    }
    let advice = "write a line Tr: with twelve numbers, or give --pose-convention world-from-sensor where poses are the lidar's own";
    Err(IoError::text(path, lines.number(), "Tr", "missing", advice))
}

/// One time a line (seconds).
fn read_times(path: &Path) -> Result<Vec<f64>> {
    let mut lines = Lines::of(open_input(path)?);
    let mut times = Vec::new();
    while let Some((number, line)) = lines.next_numbered()? {
        let Some(word) = fields(line).next() else { continue };
        let Some(time) = parse_f64(word).filter(|t| t.is_finite()) else {
            let advice = "write seconds, one line per scan";
            return Err(IoError::text(path, number, "a time", shown(word), advice));
        };
        IoError::unless_full(path, number, times.len(), MOST_TIMES, "times", "log")?;
        times.push(time);
    }
    Ok(times)
}
