//! A log as the command line sees it: opened, given other poses, its readings made beams.

mod arguments;
mod selection;

use std::path::Path;

use anyhow::bail;
use portolan::geom::Pose;
use portolan::geom::vector::distance;
use portolan::scan::{RangeLimits, Scan};
use portolan_io::scan_log::{MotionStats, PointClock, ScanLog, ScanLogOptions};
use portolan_io::{BagLogStats, FileKind, LaserLog, LaserLogStats, detect, read_poses_2d};
use serde_json::{Value, json};

use crate::error::bad_call;
use crate::json;

pub(crate) use arguments::{LimitArgs, LogArgs, NoReturnArgs, RangeArgs};
pub(crate) use selection::Selection;

/// A log of either dimension.
pub(crate) enum Log {
    /// Scans of a laser.
    Two(Box<LaserLog>),
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
            Self::Two(log) => log.format(),
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
                let mut value = json::laser_log_stats(log);
                value["path"] = json!(log.path().display().to_string());
                value["path_length"] = json!(path_length(log));
                value
            }
            Self::Three(log) => json!({
                "name": log.name(),
                "path_length": log.path_length(),
                "poses": json::space_log_stats(log.stats()),
                "bag": log.bag().map(json::bag_log_stats),
            }),
        };
        value["format"] = json!(self.format());
        value["scans"] = json!(self.len());
        value
    }

    /// What was chosen of a bag, a sentence each.
    pub(crate) fn choices(&self) -> Vec<String> {
        let stats = match self {
            Self::Two(log) => match log.stats() {
                LaserLogStats::Bag(stats) => stats,
                LaserLogStats::Carmen(_) => return Vec::new(),
            },
            Self::Three(log) => match log.bag() {
                Some(stats) => stats,
                None => return Vec::new(),
            },
        };
        let mut all = vec![format!("scans of {}, poses: {}", stats.topics.join(", "), stats.poses)];
        all.extend(stats.point_times.iter().map(|t| format!("times of points: {t}")));
        all.extend(stats.guesses.iter().map(|g| format!("guessed: {g}")));
        all
    }

    /// What was taken for granted of its poses and pictures, in sentences.
    pub(crate) fn notes(&self) -> &[String] {
        match self {
            Self::Two(_) => &[],
            Self::Three(log) => &log.stats().notes,
        }
    }

    /// What became of the motion of the sensor within its scans, for `summary.json`; null where it was left in.
    pub(crate) fn motion_json(&self) -> Value {
        let Some(motion) = self.motion() else { return Value::Null };
        json!({
            "taken_out": motion.deskewed,
            "still": motion.still,
            "not_covered": motion.not_covered.0,
            "largest": motion.largest,
            "times": motion.clock.map(PointClock::words),
        })
    }

    /// The same for people, where there was motion to take out.
    pub(crate) fn motion_words(&self) -> Option<String> {
        let motion = self.motion().filter(|motion| motion.deskewed > 0)?;
        Some(format!(
            "motion taken out of {} scans (points moved by up to {:.2} m; their times are taken to be {}); --no-deskew leaves \
             it in",
            motion.deskewed,
            motion.largest,
            motion.clock.map_or("unknown", PointClock::words)
        ))
    }

    fn motion(&self) -> Option<MotionStats> {
        match self {
            Self::Two(log) => log.motion(),
            Self::Three(log) => log.motion(),
        }
    }

    /// What reading it brought up.
    pub(crate) fn warnings(&self) -> Vec<String> {
        match self {
            Self::Two(log) => warnings_2d(log),
            Self::Three(log) => warnings_3d(log),
        }
    }
}

/// What lowers the trust in what was read of a bag.
fn bag_warnings(stats: &BagLogStats) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(first) = &stats.first_refused {
        let causes: Vec<String> = stats.refused.iter().map(|(cause, n)| format!("{n} {cause}")).collect();
        warnings.push(format!("scans could not be used: {} (first: {first})", causes.join(", ")));
    }
    if let Some(first) = &stats.first_without_pose {
        let missing: Vec<String> =
            stats.without_pose.iter().map(|(what, n)| format!("{n} for {what}")).collect();
        warnings.push(format!(
            "{} of {} scans have no pose at their time and were left out: {} (first: {first})",
            stats.scans_without_pose(),
            stats.messages,
            missing.join(", ")
        ));
    }
    if stats.tilted > 0 {
        warnings.push(format!(
            "{} scans are tilted by up to {:.1} degrees and were used as if level",
            stats.tilted,
            stats.worst_tilt.to_degrees()
        ));
    }
    warnings.extend(stats.notes.iter().cloned());
    warnings
}

fn warnings_2d(log: &LaserLog) -> Vec<String> {
    let stats = match log.stats() {
        LaserLogStats::Carmen(stats) => stats,
        LaserLogStats::Bag(stats) => {
            return bag_warnings(stats).into_iter().chain(left_in(log.motion())).collect();
        }
    };
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
    let mut warnings: Vec<_> = log.bag().map(bag_warnings).unwrap_or_default();
    let counts = [
        (stats.missing_files, "files of scans that the log names are missing"),
        (stats.poses_without_scan, "poses belong to no scan"),
        (stats.scans_without_pose, "scans have no pose and were left out"),
        (stats.unmatched_times, "scans have no pose near in time and were left out"),
        (stats.scans_without_color, "scans have no color picture"),
    ];
    warnings.extend(counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")));
    if let Some(first) = stats.refused_poses.first() {
        warnings.push(format!("{} poses could not be used (first: {first})", stats.refused_poses.len()));
    }
    if stats.pixels_beyond_lens > 0 {
        warnings.push(format!(
            "{} pixels of each undistorted depth image are beyond what the lens shows, and have no reading",
            stats.pixels_beyond_lens
        ));
    }
    warnings.extend(stats.warnings.iter().cloned());
    if let Some(why) = &stats.colors_left_out {
        warnings.push(format!("colors were left out: {why}"));
    }
    warnings.extend(left_in(log.motion()));
    if let Some(lost) = log.unread_colors() {
        warnings.push(format!("{} color pictures could not be read (first: {})", lost.pictures, lost.first));
    }
    warnings
}

/// That motion was left in scans whose points have times.
fn left_in(motion: Option<MotionStats>) -> Option<String> {
    let MotionStats { not_covered: (n @ 1.., Some(first)), .. } = motion? else { return None };
    Some(format!(
        "{n} scans have times of their points, and no poses around these: the motion of the sensor is left in them (first: \
         {first})"
    ))
}

/// What is wanted of a log of 3-D scans.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    /// Colors.
    pub(crate) color: bool,
    /// Scans without the motion of the sensor.
    pub(crate) deskew: bool,
    /// Their rays are not used.
    pub(crate) points_only: bool,
}

/// Opens a log of 3-D scans.
pub(crate) fn read_3d(path: &Path, args: &LogArgs, wanted: Wanted) -> anyhow::Result<ScanLog> {
    let Wanted { color, deskew, points_only } = wanted;
    Ok(ScanLog::open(path, &ScanLogOptions { points_only, ..args.options(color, deskew)? })?)
}

/// Reads a 2-D log.
pub(crate) fn read_2d(path: &Path, args: &LogArgs, deskew: bool) -> anyhow::Result<LaserLog> {
    if args.is_bag(path)? {
        let log = LaserLog::read_bag(path, &args.options(false, deskew)?)?;
        return Ok(if deskew { log } else { log.without_deskew() });
    }
    if args.time_tolerance.is_some() {
        return Err(bad_call(
            "--time-tolerance is for bags and 3-D logs; a CARMEN log has a pose with each scan",
        ));
    }
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
    let log = LaserLog::read_carmen(path)?;
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
        FileKind::Bag => "a bag of ROS".into(),
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
pub(crate) fn scans(log: &LaserLog, indices: &[usize], limits: &RangeLimits) -> Vec<(Pose<2>, Scan<2>)> {
    indices.iter().map(|&i| (log.raw(i).world_from_laser, log.scan(i, limits))).collect()
}

/// Length of the sensor's path over all scans (meters).
pub(crate) fn path_length(log: &LaserLog) -> f64 {
    let at = |i: usize| log.raw(i).world_from_laser.translation;
    (1..log.len()).map(|i| distance(at(i - 1), at(i))).sum()
}
