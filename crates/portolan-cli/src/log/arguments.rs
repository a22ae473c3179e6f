//! Which log, and how its readings become beams.

use std::path::{Path, PathBuf};

use portolan::scan::{Body, FrameFilter, RangeLimits};
use portolan_io::poses3::PoseConvention;
use portolan_io::scan_log::{Intrinsics, ScanLog, ScanLogKind, ScanLogOptions};
use portolan_io::{CarmenLog, FileKind, detect, detect_no_return};
use serde::{Deserialize, Serialize};

use crate::arguments::{finite, length, length_or_zero, or_zero, point3};
use crate::dimension::{Dimension, ONLY_2D, ONLY_3D};
use crate::error::bad_call;

/// Kinds of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LogFormat {
    /// CARMEN text logs (.log, .clf; plain, gzip, bzip2)
    Carmen,
    /// Logs of 3-D scans
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
    /// File with poses of the sensor, used instead of the log's own. 2-D: one per scan, as x y theta, t x y theta, or
    /// TUM. 3-D: KITTI rows, TUM lines, 4x4 matrices or a Redwood trajectory; with a KITTI log these are poses of the
    /// lidar (the Tr of calib.txt is not applied); with a LAS these are poses of the scanner at GPS times, where the rays
    /// of its points begin
    #[arg(long, value_name = "FILE")]
    pub(crate) poses: Option<PathBuf>,
    /// Format of LOG, where it is not recognized: carmen (2-D); seven-scenes, tum, redwood, bigbird, kitti, stanford,
    /// scan-graph, clouds (3-D)
    #[arg(long, value_name = "KIND", value_parser = log_format)]
    pub(crate) format: Option<LogFormat>,
    /// How to read the poses, where the format's own convention does not apply: world-from-sensor, sensor-from-world,
    /// transposed-rotation (Stanford, BigBIRD), column-major, opengl-camera
    #[arg(long, value_name = "WORD", value_parser = pose_convention, help_heading = ONLY_3D)]
    pub(crate) pose_convention: Option<PoseConvention>,
    /// Point clouds: origin of the rays in the frame of the points, x,y,z (meters) [default: the file's viewpoint, else
    /// 0,0,0]
    #[arg(long, value_name = "POINT", value_parser = point3, allow_hyphen_values = true, help_heading = ONLY_3D)]
    pub(crate) origin: Option<[f64; 3]>,
    /// Depth images: intrinsics of the camera, as fx,fy,cx,cy (pixels) or a file
    #[arg(long, value_name = "CAMERA", help_heading = ONLY_3D)]
    pub(crate) intrinsics: Option<String>,
    /// Depth images: units per meter, 1000 for millimeters
    #[arg(long, value_name = "N", value_parser = length, allow_negative_numbers = true, help_heading = ONLY_3D)]
    pub(crate) depth_scale: Option<f64>,
    /// Largest difference in time between a scan and its pose (seconds) [default: 0.02]
    #[arg(long, value_name = "S", value_parser = length_or_zero, allow_negative_numbers = true, help_heading = ONLY_3D)]
    pub(crate) time_tolerance: Option<f64>,
}

impl LogArgs {
    /// The dimension of the log's scans. What is not recognized counts as 2-D: that reader reports what is wrong.
    pub(crate) fn dimension(&self, path: &Path) -> anyhow::Result<Dimension> {
        Ok(match self.format {
            Some(LogFormat::Carmen) => Dimension::Two,
            Some(LogFormat::Space(_)) => Dimension::Three,
            None if matches!(detect(path)?, FileKind::ScanLog(_)) => Dimension::Three,
            None => Dimension::Two,
        })
    }

    /// Refuses options that the sensor of a 3-D log has no use for.
    pub(crate) fn check_sensor(&self, log: &ScanLog) -> anyhow::Result<()> {
        let (camera, kind) = (log.camera().is_some(), log.kind().word());
        if !camera && (self.intrinsics.is_some() || self.depth_scale.is_some()) {
            return Err(bad_call(format!(
                "--intrinsics and --depth-scale are for depth images; the log is {kind}"
            )));
        }
        if camera && self.origin.is_some() {
            return Err(bad_call(format!("--origin is for point clouds; the log is {kind}")));
        }
        Ok(())
    }

    /// How a log of 3-D scans is opened.
    pub(super) fn options(&self, color: bool) -> ScanLogOptions {
        let default = ScanLogOptions::default();
        ScanLogOptions {
            format: self.format.and_then(|f| if let LogFormat::Space(kind) = f { Some(kind) } else { None }),
            poses: self.poses.clone(),
            pose_convention: self.pose_convention,
            origin: self.origin,
            intrinsics: self.intrinsics.as_deref().map(Intrinsics::from_word),
            depth_scale: self.depth_scale,
            points_only: false,
            color,
            time_tolerance: self.time_tolerance.unwrap_or(default.time_tolerance),
        }
    }
}

/// Limits of range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default)]
pub(crate) struct RangeArgs {
    /// Readings up to this range are refused (meters) [default: 0]
    #[arg(long, value_name = "M", value_parser = length_or_zero, allow_negative_numbers = true)]
    #[serde(serialize_with = "or_zero")]
    pub(crate) min_range: Option<f64>,
    /// Returns beyond this range do not count as surfaces; the beam is free up to here (meters) [default: no limit]
    #[arg(long, value_name = "M", value_parser = length, allow_negative_numbers = true)]
    #[serde(serialize_with = "finite")]
    pub(crate) max_range: Option<f64>,
}

/// Beams of 2-D scans that came back without an echo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default)]
pub(crate) struct NoReturnArgs {
    /// Readings of this range or more mean "no echo" (meters) [default: detected from the readings of the log]
    #[arg(long, value_name = "M", value_parser = length, allow_negative_numbers = true, help_heading = ONLY_2D)]
    #[serde(serialize_with = "finite", skip_deserializing)]
    pub(crate) no_return: Option<f64>,
    /// Range up to which a beam without echo counts as free (meters) [default: 0, nothing]
    #[arg(long, value_name = "M", value_parser = length_or_zero, allow_negative_numbers = true)]
    #[arg(help_heading = ONLY_2D)]
    #[serde(serialize_with = "or_zero")]
    pub(crate) no_return_free: Option<f64>,
}

/// How readings become beams.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct LimitArgs {
    #[command(flatten)]
    pub(crate) range: RangeArgs,
    #[command(flatten)]
    pub(crate) no_return: NoReturnArgs,
}

impl RangeArgs {
    /// The filter for 3-D scans.
    ///
    /// # Errors
    /// A lower limit that is not below the upper one.
    pub(crate) fn filter(&self, body: Vec<Body>) -> anyhow::Result<FrameFilter> {
        let open = FrameFilter::default();
        let filter = FrameFilter {
            min_range: self.min_range.unwrap_or(open.min_range),
            max_range: self.max_range.unwrap_or(open.max_range),
            body,
        };
        if filter.min_range >= filter.max_range {
            return Err(bad_call("--min-range must be smaller than --max-range"));
        }
        Ok(filter)
    }
}

impl LimitArgs {
    /// The limits for a 2-D log; the range of "no echo" is detected where it was not given.
    pub(crate) fn limits(&self, log: &CarmenLog) -> RangeLimits {
        let open = RangeLimits::default();
        RangeLimits {
            min: self.range.min_range.unwrap_or(open.min),
            max: self.range.max_range.unwrap_or(open.max),
            no_return: self.no_return.no_return.or_else(|| detect_no_return(log)).unwrap_or(open.no_return),
            no_return_free: self.no_return.no_return_free.unwrap_or(open.no_return_free),
        }
    }
}
