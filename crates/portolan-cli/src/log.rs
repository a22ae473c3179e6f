//! A log as the command line sees it: read, given other poses, its readings made beams.

use std::path::{Path, PathBuf};

use anyhow::bail;
use portolan::geom::Pose;
use portolan::geom::vector::distance;
use portolan::scan::{FrameFilter, RangeLimits, Scan};
use portolan_io::poses3::PoseConvention;
use portolan_io::scan_log::{Intrinsics, ScanLog, ScanLogKind, ScanLogOptions};
use portolan_io::{CarmenLog, FileKind, detect, detect_no_return, read_poses_2d};

use crate::arguments::{length, length_or_zero, point3};
use crate::error::bad_call;

/// Kinds of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LogFormat {
    /// CARMEN text logs (.log, .clf; plain, gzip, bzip2)
    Carmen,
    /// Scans of space
    Space(ScanLogKind),
}

/// The kind of a word of `--format`.
fn log_format(word: &str) -> Result<LogFormat, String> {
    match ScanLogKind::from_word(word) {
        _ if word == "carmen" => Ok(LogFormat::Carmen),
        Some(kind) => Ok(LogFormat::Space(kind)),
        None => Err(format!("must be one of carmen, {}", ScanLogKind::ALL.map(ScanLogKind::word).join(", "))),
    }
}

/// The convention of a word of `--pose-convention`.
fn pose_convention(word: &str) -> Result<PoseConvention, String> {
    PoseConvention::from_word(word)
        .ok_or_else(|| format!("must be one of {}", PoseConvention::ALL.map(PoseConvention::word).join(", ")))
}

/// Which log, with which poses.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct LogArgs {
    /// Poses of the sensor itself, instead of the log's own. Planar: one per scan, x y theta, t x y theta, or TUM. In
    /// space: KITTI rows, TUM lines, 4x4 matrices or a Redwood trajectory; with KITTI the lidar's, Tr is not applied
    #[arg(long, value_name = "FILE")]
    pub(crate) poses: Option<PathBuf>,
    /// Kind of LOG, where it is not recognised: carmen; in space seven-scenes, tum, redwood, bigbird, kitti, stanford,
    /// scan-graph, clouds
    #[arg(long, value_name = "KIND", value_parser = log_format)]
    pub(crate) format: Option<LogFormat>,
    /// In space: what the numbers of the poses mean, where it is not what the format says: world-from-sensor,
    /// sensor-from-world, transposed-rotation (Stanford, BigBIRD), column-major, opengl-camera
    #[arg(long, value_name = "WORD", value_parser = pose_convention)]
    pub(crate) pose_convention: Option<PoseConvention>,
    /// Clouds: where rays begin in the frame of the points, x,y,z (metres), where it is not zero or the file's viewpoint
    #[arg(long, value_name = "POINT", value_parser = point3, allow_hyphen_values = true)]
    pub(crate) origin: Option<[f64; 3]>,
    /// Depth images: the camera, fx,fy,cx,cy (pixels) or a file
    #[arg(long, value_name = "CAMERA")]
    pub(crate) intrinsics: Option<String>,
    /// Depth images: units per metre, 1000 for millimetres
    #[arg(long, value_name = "N", value_parser = length, allow_negative_numbers = true)]
    pub(crate) depth_scale: Option<f64>,
    /// How far a pose's time may lie from a scan's (seconds) [default: 0.02]
    #[arg(long, value_name = "S", value_parser = length_or_zero, allow_negative_numbers = true)]
    pub(crate) time_tolerance: Option<f64>,
}

impl LogArgs {
    /// Whether anything is said that only logs of space have.
    pub(crate) fn is_about_space(&self) -> bool {
        self.pose_convention.is_some()
            || self.origin.is_some()
            || self.intrinsics.is_some()
            || self.depth_scale.is_some()
            || self.time_tolerance.is_some()
    }

    /// Whether the log is one of scans of space. What is not recognised counts as planar: that reader says what is wrong.
    pub(crate) fn is_space(&self, path: &Path) -> anyhow::Result<bool> {
        match self.format {
            Some(LogFormat::Carmen) => Ok(false),
            Some(LogFormat::Space(_)) => Ok(true),
            None => Ok(matches!(detect(path)?, FileKind::ScanLog(_))),
        }
    }
}

/// How readings become beams.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct LimitArgs {
    /// Readings up to this are refused (metres)
    #[arg(long, value_name = "M", value_parser = length_or_zero, allow_negative_numbers = true)]
    pub(crate) min_range: Option<f64>,
    /// Returns beyond this are not surfaces; space up to here is free (metres)
    #[arg(long, value_name = "M", value_parser = length, allow_negative_numbers = true)]
    pub(crate) max_range: Option<f64>,
    /// Readings from this on mean "no echo" (metres); default: what the log's readings tell
    #[arg(long, value_name = "M", value_parser = length, allow_negative_numbers = true)]
    pub(crate) no_return: Option<f64>,
    /// What is known to be free along a beam without echo (metres); default 0: nothing
    #[arg(long, value_name = "M", value_parser = length_or_zero, allow_negative_numbers = true)]
    pub(crate) no_return_free: Option<f64>,
}

impl LimitArgs {
    /// Whether any was given.
    pub(crate) fn is_given(&self) -> bool {
        let Self { min_range, max_range, no_return, no_return_free } = self;
        [min_range, max_range, no_return, no_return_free].iter().any(|limit| limit.is_some())
    }

    /// The limits for a log of space.
    ///
    /// # Errors
    /// Names a limit that only planar scans have, and limits between which there is nothing.
    pub(crate) fn filter(&self) -> anyhow::Result<FrameFilter> {
        let planar = [("--no-return", self.no_return), ("--no-return-free", self.no_return_free)];
        if let Some((what, _)) = planar.iter().find(|(_, limit)| limit.is_some()) {
            return Err(bad_call(format!("{what} is for planar scans; the log has three dimensions")));
        }
        let open = FrameFilter::default();
        let filter = FrameFilter {
            min_range: self.min_range.unwrap_or(open.min_range),
            max_range: self.max_range.unwrap_or(open.max_range),
            ..open
        };
        if filter.min_range >= filter.max_range {
            return Err(bad_call("--min-range must be smaller than --max-range"));
        }
        Ok(filter)
    }

    /// The limits for a log; what was not given is found out or left open.
    pub(crate) fn limits(&self, log: &CarmenLog) -> RangeLimits {
        let open = RangeLimits::default();
        RangeLimits {
            min: self.min_range.unwrap_or(open.min),
            max: self.max_range.unwrap_or(open.max),
            no_return: self.no_return.or_else(|| detect_no_return(log)).unwrap_or(open.no_return),
            no_return_free: self.no_return_free.unwrap_or(open.no_return_free),
        }
    }
}

/// Opens a log of scans of space.
pub(crate) fn read_space(path: &Path, args: &LogArgs, color: bool) -> anyhow::Result<ScanLog> {
    let default = ScanLogOptions::default();
    let options = ScanLogOptions {
        format: args.format.and_then(|f| if let LogFormat::Space(kind) = f { Some(kind) } else { None }),
        poses: args.poses.clone(),
        pose_convention: args.pose_convention,
        origin: args.origin,
        intrinsics: args.intrinsics.as_deref().map(Intrinsics::from_word),
        depth_scale: args.depth_scale,
        color,
        time_tolerance: args.time_tolerance.unwrap_or(default.time_tolerance),
    };
    Ok(ScanLog::open(path, &options)?)
}

/// Reads a planar log.
pub(crate) fn read(path: &Path, args: &LogArgs) -> anyhow::Result<CarmenLog> {
    if args.format.is_none() {
        match detect(path)? {
            FileKind::CarmenLog => {}
            // The reader's own error says what a folder is.
            FileKind::Unknown(_) | FileKind::PortolanFolder if path.is_dir() => {}
            FileKind::Unknown(what) => {
                bail!("{}: not a log: {what}; or force it with --format carmen", path.display())
            }
            kind => bail!("{}: is {}, not a log of planar scans", path.display(), describe(&kind)),
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

/// What a file is, in words.
pub(crate) fn describe(kind: &FileKind) -> String {
    match kind {
        FileKind::CarmenLog => "a CARMEN log".into(),
        FileKind::ScanLog(kind) => kind.label().into(),
        FileKind::Mesh(format) => format.label().into(),
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

/// Scans of a log: which are fused and which are left out for evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Selection {
    /// Only every so many-th scan of the log.
    pub(crate) every: Option<u64>,
    /// Of these, every so many-th is left out.
    pub(crate) hold_out: Option<u64>,
}

impl Selection {
    /// Indices of the scans to fuse and of those held out.
    pub(crate) fn split(&self, scans: usize) -> (Vec<usize>, Vec<usize>) {
        let every = self.every.unwrap_or(1).max(1) as usize;
        let taken = (0..scans).step_by(every).enumerate();
        let (mut fused, mut held_out) = (Vec::new(), Vec::new());
        for (nth, i) in taken {
            // The last of each group, so that the first scan of a log is always fused.
            let out = self.hold_out.is_some_and(|n| (nth as u64 + 1).is_multiple_of(n.max(1)));
            if out { held_out.push(i) } else { fused.push(i) }
        }
        (fused, held_out)
    }
}

/// These scans of the log, with their poses.
pub(crate) fn scans(log: &CarmenLog, indices: &[usize], limits: &RangeLimits) -> Vec<(Pose<2>, Scan<2>)> {
    indices.iter().map(|&i| (log.raw(i).world_from_laser, log.raw(i).to_scan(limits))).collect()
}

/// Length of the sensor's way over all scans (metres).
pub(crate) fn path_length(log: &CarmenLog) -> f64 {
    let at = |i: usize| log.raw(i).world_from_laser.translation;
    (1..log.len()).map(|i| distance(at(i - 1), at(i))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tenth_is_held_out() {
        let all = Selection::default();
        assert_eq!(all.split(3), (vec![0, 1, 2], vec![]));
        let some = Selection { every: Some(2), hold_out: Some(3) };
        assert_eq!(some.split(12), (vec![0, 2, 6, 8], vec![4, 10]));
    }
}
