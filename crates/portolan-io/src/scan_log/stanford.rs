//! Range scans of the Stanford 3-D Scanning Repository: a `.conf` file that poses PLY files.
//!
//! Lines `bmesh FILE tx ty tz qx qy qz qw` (or `mesh`); others (`camera`) are passed over. The quaternion is that of the
//! inverse rotation while the translation is not inverted: `p_world = R(q)^T p + t`, which is
//! [`PoseConvention::TransposedRotation`] and was checked on the bunny (scans agree to 0.3 mm; 8 to 108 mm with `R(q)`).
//!
//! The scanners look along -z of each scan's own frame, from so far away that no origin is given: rays are parallel. A frame
//! has the points of the file, each with its own origin above it, and beside them the image that [`orthographic_image`](portolan::scan::orthographic_image)
//! makes of the file's `range_grid`.

use std::path::{Path, PathBuf};

use super::cloud_frames::{CloudFrames, Rays};
use super::files::{has_extension, names_in, number_in};
use super::parts::{LayoutPoses, Parts, ScanId};
use super::{ScanLogOptions, ScanLogStats};
use crate::bytes::{Lines, fields, open as open_input, parse_f64};
use crate::error::shown;
use crate::points::PointFormat;
use crate::poses3::{PoseConvention, RawPose};
use crate::{IoError, Result};

/// The most scans of a log.
const MOST_SCANS: usize = 1 << 16;

/// A line of a `.conf`.
struct Line {
    file: PathBuf,
    pose: RawPose,
}

pub(super) fn is_it(path: &Path) -> bool {
    conf_of(path).is_some_and(|file| read(&file).is_ok_and(|lines| !lines.is_empty()))
}

/// The `.conf` file: this one, or the only one of a folder or of its `data`.
fn conf_of(path: &Path) -> Option<PathBuf> {
    let is_conf = |name: &str| has_extension(name, "conf");
    if path.is_file() {
        return path.file_name()?.to_str().filter(|name| is_conf(name)).map(|_| path.into());
    }
    [path.to_owned(), path.join("data")].into_iter().find_map(|folder| {
        let names = names_in(&folder, is_conf).ok()?;
        let [name] = &names[..] else { return None };
        Some(folder.join(name))
    })
}

pub(super) fn open(path: &Path, _options: &ScanLogOptions) -> Result<Parts> {
    let Some(conf) = conf_of(path) else {
        return Err(IoError::layout(path, "the .conf file", "missing or not the only one", "name it"));
    };
    let lines = read(&conf)?;
    let folder = conf.parent().unwrap_or(Path::new("."));
    let mut stats = ScanLogStats::default();
    let (mut files, mut scans, mut poses) = (Vec::new(), Vec::new(), Vec::new());
    for Line { file, pose } in lines {
        let file = folder.join(file);
        if !file.is_file() {
            stats.missing_files += 1;
            continue;
        }
        let number = file.file_name().and_then(|n| number_in(n.to_str()?));
        scans.push(ScanId { path: file.clone(), number, time: None });
        poses.push(Some((conf.clone(), pose)));
        files.push(file);
    }
    let source = CloudFrames::new(files, Some(PointFormat::Ply), Rays::Parallel)?;
    let (convention, posed_from_sensor) = (PoseConvention::TransposedRotation, source.files_from_frames());
    let parts = Parts::new(path, source, scans, LayoutPoses::PerScan(poses));
    Ok(Parts { convention, posed_from_sensor, stats, ..parts })
}

fn read(path: &Path) -> Result<Vec<Line>> {
    let mut lines = Lines::of(open_input(path)?);
    let mut all = Vec::new();
    while let Some((number, line)) = lines.next_numbered()? {
        let mut words = fields(line);
        if !matches!(words.next(), Some(b"bmesh" | b"mesh")) {
            continue;
        }
        let bad = || {
            let advice = "write bmesh FILE tx ty tz qx qy qz qw";
            IoError::text(path, number, "a scan", shown(line), advice)
        };
        let file = words.next().and_then(|w| std::str::from_utf8(w).ok()).ok_or_else(bad)?;
        let values: Option<Vec<f64>> = words.map(parse_f64).collect();
        let [x, y, z, qx, qy, qz, qw] = *values.unwrap_or_default() else { return Err(bad()) };
        IoError::unless_full(path, number, all.len(), MOST_SCANS, "scans", "file")?;
        all.push(Line {
            file: file.into(),
            pose: RawPose::from_quaternion([x, y, z], [qx, qy, qz, qw], number),
        });
    }
    Ok(all)
}
