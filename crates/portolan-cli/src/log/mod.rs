//! A log as the command line sees it: opened, given other poses, its readings made beams.

mod arguments;
mod selection;

use std::path::Path;

use anyhow::bail;
use portolan::geom::Pose;
use portolan::geom::vector::distance;
use portolan::scan::{RangeLimits, Scan};
use portolan_io::scan_log::{ScanLog, ScanLogOptions};
use portolan_io::{CarmenLog, FileKind, detect, read_poses_2d};
use serde_json::{Value, json};

use crate::json;

pub(crate) use arguments::{LimitArgs, LogArgs, NoReturnArgs, RangeArgs};
pub(crate) use selection::Selection;

/// A log of either dimension.
pub(crate) enum Log {
    /// Scans of a laser.
    Two(Box<CarmenLog>),
    /// Depth images or clouds.
    Three(Box<ScanLog>),
}

impl Log {
    /// Number of scans.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Two(log) => log.len(),
            Self::Three(log) => log.len(),
        }
    }

    /// The name that maps of it keep.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Two(log) => {
                log.path().file_name().unwrap_or(log.path().as_os_str()).to_string_lossy().into_owned()
            }
            Self::Three(log) => log.name().to_owned(),
        }
    }

    /// The word for its format.
    pub(crate) fn format(&self) -> &'static str {
        match self {
            Self::Two(_) => "carmen",
            Self::Three(log) => log.kind().word(),
        }
    }

    /// Whether the sensor is a camera, which looks along z.
    pub(crate) fn is_of_camera(&self) -> bool {
        matches!(self, Self::Three(log) if log.camera().is_some())
    }

    /// What `summary.json` keeps of it.
    pub(crate) fn to_json(&self) -> Value {
        let mut value = match self {
            Self::Two(log) => {
                let mut value = json::log_stats(log.stats());
                value["path"] = json!(log.path().display().to_string());
                value["path_length"] = json!(path_length(log));
                value
            }
            Self::Three(log) => json!({
                "name": log.name(),
                "path_length": log.path_length(),
                "poses": json::space_log_stats(log.stats()),
            }),
        };
        value["format"] = json!(self.format());
        value["scans"] = json!(self.len());
        value
    }

    /// What reading it brought up.
    pub(crate) fn warnings(&self) -> Vec<String> {
        match self {
            Self::Two(log) => warnings_2d(log),
            Self::Three(log) => warnings_3d(log),
        }
    }
}

fn warnings_2d(log: &CarmenLog) -> Vec<String> {
    let stats = log.stats();
    let mut warnings = Vec::new();
    if let Some(first) = &stats.refused.first {
        warnings.push(format!("{} scan lines could not be used (first: {first})", stats.refused.total()));
    }
    if stats.skipped_scans > 0 {
        let n = stats.skipped_scans;
        warnings.push(format!("{n} ROBOTLASER1 scans were left out: the log has FLASER scans"));
    }
    warnings
}

fn warnings_3d(log: &ScanLog) -> Vec<String> {
    let stats = log.stats();
    let counts = [
        (stats.missing_files, "files of scans that the log names are missing"),
        (stats.poses_without_scan, "poses belong to no scan"),
        (stats.scans_without_pose, "scans have no pose and were left out"),
        (stats.unmatched_times, "scans have no pose near in time and were left out"),
        (stats.scans_without_color, "scans have no color picture"),
    ];
    let mut warnings: Vec<_> =
        counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    if let Some(first) = stats.refused_poses.first() {
        warnings.push(format!("{} poses could not be used (first: {first})", stats.refused_poses.len()));
    }
    warnings.extend(stats.notes.iter().cloned());
    if let Some(why) = &stats.colors_left_out {
        warnings.push(format!("colors were left out: {why}"));
    }
    if let Some(lost) = log.unread_colors() {
        warnings.push(format!("{} color pictures could not be read (first: {})", lost.pictures, lost.first));
    }
    warnings
}

/// Opens a log of 3-D scans. `points_only`: their rays are not used.
pub(crate) fn read_3d(
    path: &Path,
    args: &LogArgs,
    color: bool,
    points_only: bool,
) -> anyhow::Result<ScanLog> {
    Ok(ScanLog::open(path, &ScanLogOptions { points_only, ..args.options(color) })?)
}

/// Reads a 2-D log.
pub(crate) fn read_2d(path: &Path, args: &LogArgs) -> anyhow::Result<CarmenLog> {
    if args.format.is_none() {
        match detect(path)? {
            FileKind::CarmenLog => {}
            // The reader's own error is about folders.
            FileKind::Unknown(_) | FileKind::PortolanFolder if path.is_dir() => {}
            FileKind::Unknown(what) => {
                bail!("{}: not a log: {what}; or force it with --format carmen", path.display())
            }
            kind => bail!("{}: is {}, not a log of 2-D scans", path.display(), describe(&kind)),
        }
    }
    let log = CarmenLog::read(path)?;
    let Some(file) = &args.poses else { return Ok(log) };
    let poses: Vec<_> = read_poses_2d(file)?.iter().map(|p| p.pose).collect();
    if poses.len() != log.len() {
        let (poses, scans) = (poses.len(), log.len());
        bail!(
            "{}: the number of poses is {poses}; give one for each of the {scans} scans of {}",
            file.display(),
            path.display()
        );
    }
    Ok(log.with_poses(&poses)?)
}

/// What a file is.
pub(crate) fn describe(kind: &FileKind) -> String {
    match kind {
        FileKind::CarmenLog => "a CARMEN log".into(),
        FileKind::ScanLog(kind) => kind.label().into(),
        FileKind::Mesh(format) => format!("a mesh ({})", format.label()),
        FileKind::Portolan => "a portolan map".into(),
        FileKind::PortolanFolder => "a folder with a portolan map".into(),
        FileKind::EsdfBin => "a distance field (esdf.bin)".into(),
        FileKind::Pgm => "a PGM image".into(),
        FileKind::MapServerYaml => "a map_server map".into(),
        FileKind::GeoJson => "GeoJSON".into(),
        FileKind::Svg => "an SVG picture".into(),
        FileKind::OctomapBt | FileKind::OctomapOt => "an OctoMap tree".into(),
        FileKind::Unknown(what) => what.clone(),
        _ => "a file of another kind".into(),
    }
}

/// These scans of the log, with their poses.
pub(crate) fn scans(log: &CarmenLog, indices: &[usize], limits: &RangeLimits) -> Vec<(Pose<2>, Scan<2>)> {
    indices.iter().map(|&i| (log.raw(i).world_from_laser, log.raw(i).to_scan(limits))).collect()
}

/// Length of the sensor's path over all scans (meters).
pub(crate) fn path_length(log: &CarmenLog) -> f64 {
    let at = |i: usize| log.raw(i).world_from_laser.translation;
    (1..log.len()).map(|i| distance(at(i - 1), at(i))).sum()
}
