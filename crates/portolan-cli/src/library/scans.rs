//! Logs, opened by the options of `portolan map`.

use std::ffi::OsString;
use std::path::Path;

use clap::Parser;
use portolan::geom::Pose;
use portolan::scan::{BeamCounts, Frame, FrameFilter, RangeLimits, Scan};

use crate::arguments::body;
use crate::dimension::{Dimension, Given};
use crate::error::{bad_call, in_words};
use crate::log::{self, LimitArgs, Log, LogArgs, Wanted};

/// The options of `portolan map` that say which log it is and how its readings become beams.
#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Options {
    #[command(flatten)]
    given: Given<()>,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    limits: LimitArgs,
    /// As for `portolan map`
    #[arg(long = "no-color", action = clap::ArgAction::SetFalse)]
    color: bool,
    /// As for `portolan map`
    #[arg(long = "no-deskew", action = clap::ArgAction::SetFalse)]
    deskew: bool,
    /// As for `portolan map`
    #[arg(long)]
    points_only: bool,
    /// As for `portolan map`
    #[arg(long, value_name = "BOX|SPHERE", value_parser = body, allow_hyphen_values = true)]
    self_filter: Vec<portolan::scan::Body>,
    /// Use only every N-th scan of the log
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
}

/// A log of either dimension, with what the options made of its readings.
pub struct OpenLog {
    log: Log,
    limits: RangeLimits,
    filter: FrameFilter,
    points_only: bool,
    indices: Vec<usize>,
}

/// A scan of a planar laser.
pub struct StampedScan {
    /// Seconds of the log's clock, where it has one.
    pub time: Option<f64>,
    /// Pose of the sensor.
    pub world_from_sensor: Pose<2>,
    /// Its beams.
    pub scan: Scan<2>,
}

/// A 3-D scan.
pub struct StampedFrame {
    /// Seconds of the log's clock, where it has one.
    pub time: Option<f64>,
    /// Pose of the sensor.
    pub world_from_sensor: Pose<3>,
    /// Its readings.
    pub frame: Frame,
    /// What the limits of range left out.
    pub counts: BeamCounts,
}

impl OpenLog {
    /// Opens a log. `options` are words as after `portolan map LOG`: `--max-range 20`.
    ///
    /// # Errors
    /// A log that cannot be read, and options that do not fit it.
    pub fn open(path: &Path, options: &[OsString]) -> anyhow::Result<Self> {
        let options = Options::try_parse_from(options).map_err(|error| bad_call(in_words(&error)))?;
        let dimension = options.source.dimension(path)?;
        dimension.check::<Options, ()>(&options.given, "the log")?;
        let log = match dimension {
            Dimension::Two => Log::Two(Box::new(log::read_2d(path, &options.source, options.deskew)?)),
            Dimension::Three => {
                let Options { color, deskew, points_only, .. } = options;
                let log = log::read_3d(path, &options.source, Wanted { color, deskew, points_only })?;
                options.source.check_sensor(&log)?;
                Log::Three(Box::new(log))
            }
        };
        let limits = match &log {
            Log::Two(log) => options.limits.limits(log),
            Log::Three(_) => RangeLimits::default(),
        };
        let points_only = options.points_only || matches!(&log, Log::Three(log) if !log.knows_origins());
        let filter = options.limits.range.filter(options.self_filter)?;
        let every = usize::try_from(options.every.unwrap_or(1)).unwrap_or(usize::MAX);
        let indices = (0..log.len()).step_by(every).collect();
        Ok(Self { log, limits, filter, points_only, indices })
    }

    /// 2 or 3.
    pub fn dimension(&self) -> usize {
        if matches!(self.log, Log::Two(_)) { 2 } else { 3 }
    }

    /// Number of scans, with the option `--every` that many.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Whether there are no scans.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// The name that maps of it keep.
    pub fn name(&self) -> String {
        self.log.name()
    }

    /// The number of a scan in the log: another one with the option `--every`.
    pub fn number(&self, i: usize) -> usize {
        self.indices.get(i).copied().unwrap_or(i)
    }

    /// The word for its format.
    pub fn format(&self) -> &'static str {
        self.log.format()
    }

    /// Whether its points are used without rays, because it was asked for or because they do not say where they were seen
    /// from: they make an occupancy map alone, and free nothing.
    pub fn points_only(&self) -> bool {
        self.points_only
    }

    /// What was chosen, what was taken for granted, and what reading brought up, a sentence each.
    pub fn remarks(&self) -> Vec<String> {
        let mut all = self.log.choices();
        all.extend(self.log.notes().iter().cloned());
        all.extend(self.log.warnings());
        all
    }

    /// A scan of a planar laser; `None` where the log is 3-D, or beyond its end.
    pub fn scan_2d(&self, i: usize) -> Option<StampedScan> {
        let (Log::Two(log), Some(&i)) = (&self.log, self.indices.get(i)) else { return None };
        let raw = log.raw(i);
        let scan = log.scan(i, &self.limits);
        Some(StampedScan { time: raw.time, world_from_sensor: raw.world_from_laser, scan })
    }

    /// A 3-D scan; `None` where the log is 2-D, or beyond its end.
    ///
    /// # Errors
    /// A scan that cannot be read.
    pub fn scan_3d(&self, i: usize) -> Option<anyhow::Result<StampedFrame>> {
        let (Log::Three(log), Some(&i)) = (&self.log, self.indices.get(i)) else { return None };
        let read = log.filtered_frame(i, &self.filter).map(|(frame, counts)| StampedFrame {
            time: log.time(i),
            world_from_sensor: *log.pose(i),
            frame: if self.points_only { frame.without_rays() } else { frame },
            counts,
        });
        Some(read.map_err(Into::into))
    }
}
