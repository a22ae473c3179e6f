//! Which log, and how its readings become beams.

use std::path::{Path, PathBuf};

use anyhow::bail;
use portolan::geom::Pose;
use portolan::scan::{Body, FrameFilter, RangeLimits};
use portolan_io::poses3::PoseConvention;
use portolan_io::scan_log::{Distortion, Intrinsics, ScanLog, ScanLogKind, ScanLogOptions};
use portolan_io::{BagChoice, FileKind, LaserLog, bag_dimension, detect, detect_no_return};
use serde::{Deserialize, Serialize};

use crate::arguments::{finite, length, length_or_off, length_or_zero, or_zero, point3, pose3, seconds};
use crate::dimension::{Dimension, ONLY_2D, ONLY_3D};
use crate::error::bad_call;

/// Kinds of logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LogFormat {
    /// CARMEN text logs (.log, .clf; plain, gzip, bzip2)
    Carmen,
    /// Bags of ROS 1 and ROS 2
    Bag,
    /// Logs of 3-D scans
    Space(ScanLogKind),
}

/// The kind of a word of `--format`.
fn log_format(word: &str) -> Result<LogFormat, String> {
    match ScanLogKind::from_word(word) {
        _ if word == "carmen" => Ok(LogFormat::Carmen),
        _ if word == ScanLogKind::Bag.word() => Ok(LogFormat::Bag),
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
    /// Format of LOG, where it is not recognized: carmen (2-D); bag (2-D or 3-D); seven-scenes, tum, redwood, bigbird, kitti, stanford,
    /// scan-graph, transforms, colmap, clouds (3-D)
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
    /// Depth images: scale the camera to the pictures, where it is one of pictures of another size
    #[arg(long, help_heading = ONLY_3D)]
    pub(crate) scale_intrinsics: bool,
    /// Depth images: distortion of the lens, as model:k1,k2,p1,p2[,k3[,k4,k5,k6]] with the model plumb_bob, rational or
    /// fisheye (OpenCV's order) [default: none]
    #[arg(long, value_name = "LENS", help_heading = ONLY_3D)]
    pub(crate) distortion: Option<String>,
    /// Depth images: intrinsics of a color camera that is not the depth camera, as fx,fy,cx,cy (pixels) or a file
    /// [default: colors are registered to depth; 7-Scenes: 525,525,320,240]
    #[arg(long, value_name = "CAMERA", help_heading = ONLY_3D)]
    pub(crate) color_intrinsics: Option<String>,
    /// Depth images: distortion of the color camera's lens, as for --distortion
    #[arg(long, value_name = "LENS", help_heading = ONLY_3D)]
    pub(crate) color_distortion: Option<String>,
    /// Depth images: pose of the depth camera in the frame of the color camera, x,y,z or x,y,z,qx,qy,qz,qw (meters)
    /// [default: both are at one place]
    #[arg(long, value_name = "POSE", value_parser = pose3, allow_hyphen_values = true, help_heading = ONLY_3D)]
    pub(crate) color_from_depth: Option<Pose<3>>,
    /// Depth images: units per meter, 1000 for millimeters
    #[arg(long, value_name = "N", value_parser = length, allow_negative_numbers = true, help_heading = ONLY_3D)]
    pub(crate) depth_scale: Option<f64>,
    /// Largest difference in time between a scan and its pose (seconds) [default: 0.02]
    #[arg(long, value_name = "S", value_parser = length_or_zero, allow_negative_numbers = true)]
    pub(crate) time_tolerance: Option<f64>,
    #[command(flatten)]
    pub(crate) bag: BagArgs,
}

/// Topics and frames of a bag.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct BagArgs {
    /// Bags: topic with scans; may be given several times, for several sensors [default: the one with the most messages, of
    /// clouds before planar lasers before depth images]
    #[arg(long = "topic", value_name = "NAME")]
    pub(crate) topics: Vec<String>,
    /// Bags: topic with poses [default: the tree of transforms, where it has the sensor's frame]
    #[arg(long, value_name = "NAME", conflicts_with = "poses")]
    pub(crate) pose_topic: Option<String>,
    /// Bags: frame of the map [default: map, else the root of the tree, else the frame of the poses]
    #[arg(long, value_name = "FRAME", conflicts_with = "poses")]
    pub(crate) fixed_frame: Option<String>,
    /// Bags: frame that --pose-topic poses [default: what its messages say, else base_link or base_footprint, else the sensor]
    #[arg(long, value_name = "FRAME", conflicts_with = "poses")]
    pub(crate) base_frame: Option<String>,
    /// Bags: added to the stamps of scans before their poses are looked up (seconds) [default: 0; half a turn back for lasers
    /// whose stamps are of the end of a turn, which is told]
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub(crate) time_offset: Option<f64>,
    /// Bags: use what can be read of a bag that is cut or damaged
    #[arg(long)]
    pub(crate) allow_truncated: bool,
}

impl BagArgs {
    /// As the reader takes it.
    pub(crate) fn choice(&self) -> BagChoice {
        let Self { topics, pose_topic, fixed_frame, base_frame, time_offset, allow_truncated } = self.clone();
        BagChoice { topics, pose_topic, fixed_frame, base_frame, time_offset, allow_truncated }
    }

    /// The first option that was given.
    fn given(&self) -> Option<&'static str> {
        [
            (!self.topics.is_empty(), "--topic"),
            (self.pose_topic.is_some(), "--pose-topic"),
            (self.fixed_frame.is_some(), "--fixed-frame"),
            (self.base_frame.is_some(), "--base-frame"),
            (self.time_offset.is_some(), "--time-offset"),
            (self.allow_truncated, "--allow-truncated"),
        ]
        .into_iter()
        .find_map(|(given, option)| given.then_some(option))
    }
}

impl LogArgs {
    /// The dimension of the log's scans. What is not recognized counts as 2-D: that reader reports what is wrong.
    pub(crate) fn dimension(&self, path: &Path) -> anyhow::Result<Dimension> {
        Ok(match self.format {
            Some(LogFormat::Space(_)) => Dimension::Three,
            _ if self.is_bag(path)? => match bag_dimension(path, &self.bag.choice())? {
                2 => Dimension::Two,
                _ => Dimension::Three,
            },
            Some(_) => Dimension::Two,
            None => match detect(path)? {
                FileKind::ScanLog(_) => Dimension::Three,
                FileKind::Unknown(what) if path.is_dir() => bail!("{}: {what}", path.display()),
                _ => Dimension::Two,
            },
        })
    }

    /// Whether the log is a bag. Options of bags are refused where it is not.
    pub(crate) fn is_bag(&self, path: &Path) -> anyhow::Result<bool> {
        let bag = match self.format {
            Some(format) => format == LogFormat::Bag,
            None => detect(path)? == FileKind::Bag,
        };
        match self.bag.given() {
            Some(option) if !bag => {
                Err(bad_call(format!("{option} is only for bags; {} is none", path.display())))
            }
            _ => Ok(bag),
        }
    }

    /// Refuses options that the sensor of a 3-D log has no use for.
    pub(crate) fn check_sensor(&self, log: &ScanLog) -> anyhow::Result<()> {
        let (camera, kind) = (log.camera().is_some(), log.kind().word());
        let given = [
            (self.intrinsics.is_some(), "--intrinsics"),
            (self.depth_scale.is_some(), "--depth-scale"),
            (self.scale_intrinsics, "--scale-intrinsics"),
            (self.distortion.is_some(), "--distortion"),
            (self.color_intrinsics.is_some(), "--color-intrinsics"),
            (self.color_distortion.is_some(), "--color-distortion"),
            (self.color_from_depth.is_some(), "--color-from-depth"),
        ];
        if let Some((_, option)) = given.iter().find(|(given, _)| *given && !camera) {
            return Err(bad_call(format!("{option} is for depth images; the log is {kind}")));
        }
        if camera && self.origin.is_some() {
            return Err(bad_call(format!("--origin is for point clouds; the log is {kind}")));
        }
        Ok(())
    }

    /// How a log of 3-D scans is opened.
    pub(super) fn options(&self, color: bool, deskew: bool) -> anyhow::Result<ScanLogOptions> {
        let default = ScanLogOptions::default();
        let lens = |word: &Option<String>, option: &str| {
            word.as_deref().map(|word| Distortion::from_word(word, option)).transpose()
        };
        Ok(ScanLogOptions {
            format: match self.format {
                Some(LogFormat::Space(kind)) => Some(kind),
                Some(LogFormat::Bag) => Some(ScanLogKind::Bag),
                Some(LogFormat::Carmen) | None => None,
            },
            poses: self.poses.clone(),
            pose_convention: self.pose_convention,
            origin: self.origin,
            intrinsics: self.intrinsics.as_deref().map(Intrinsics::from_word),
            scale_intrinsics: self.scale_intrinsics,
            distortion: lens(&self.distortion, "--distortion")?,
            color_intrinsics: self.color_intrinsics.as_deref().map(Intrinsics::from_word),
            color_distortion: lens(&self.color_distortion, "--color-distortion")?,
            color_from_depth: self.color_from_depth,
            depth_scale: self.depth_scale,
            points_only: false,
            color,
            deskew,
            time_tolerance: self.time_tolerance.unwrap_or(default.time_tolerance),
            bag: self.bag.choice(),
        })
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
    /// Readings of this range or more mean "no echo" (meters); off: none but those that the log declares [default: detected from
    /// the readings of the log]
    #[arg(long, value_name = "M|off", value_parser = length_or_off, allow_negative_numbers = true, help_heading = ONLY_2D)]
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
    pub(crate) fn limits(&self, log: &LaserLog) -> RangeLimits {
        let open = RangeLimits::default();
        RangeLimits {
            min: self.range.min_range.unwrap_or(open.min),
            max: self.range.max_range.unwrap_or(open.max),
            no_return: self.no_return.no_return.or_else(|| detect_no_return(log)).unwrap_or(open.no_return),
            no_return_free: self.no_return.no_return_free.unwrap_or(open.no_return_free),
        }
    }
}
