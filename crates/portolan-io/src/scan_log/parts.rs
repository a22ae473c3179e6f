//! What a format delivers: scans to be read, and where their poses are.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use portolan::geom::Pose;
use portolan::scan::Frame;

use super::files::{name_of, names_in};
use super::{Camera, ScanLogStats, UnreadColors};
use crate::poses3::{PoseConvention, PoseFile, RawPose, read_poses_3d};
use crate::{BagLogStats, IoError, Result};

/// Reads scans by index, in any order, from any thread.
pub(crate) trait FrameSource: Send + Sync {
    /// Scan `i` of those that the format found.
    fn frame(&self, i: usize) -> Result<Frame>;

    /// Where the sensor stood in the frame of scan `i` (meters): not in its zero where clouds are in the world's frame.
    fn origin(&self, _i: usize) -> [f64; 3] {
        [0.0; 3]
    }

    /// Whether all scans say where they were seen from. Else points are all that can be used.
    fn knows_origins(&self) -> bool {
        true
    }

    /// Color pictures that could not be read so far.
    fn unread_colors(&self) -> Option<UnreadColors> {
        None
    }
}

/// A scan that was found but not read.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ScanId {
    /// Its file, for messages.
    pub(crate) path: PathBuf,
    /// The number in its name, which may be its place in a file of poses.
    pub(crate) number: Option<u64>,
    /// Its stamp (seconds).
    pub(crate) time: Option<f64>,
}

/// Where the poses of a layout are.
pub(crate) enum LayoutPoses {
    /// Not found: the text lists what was looked for. `--poses` must name them.
    Missing(String),
    /// One per scan, with the file that holds it.
    PerScan(Vec<Option<(PathBuf, RawPose)>>),
    /// In one file, to be matched with the scans.
    File(PoseFile),
}

/// A log before its poses are matched.
pub(crate) struct Parts {
    /// The log's name, for people.
    pub(crate) name: String,
    /// Reads the scans.
    pub(crate) source: Box<dyn FrameSource>,
    /// All scans, in order.
    pub(crate) scans: Vec<ScanId>,
    /// Where their poses are.
    pub(crate) poses: LayoutPoses,
    /// What the numbers of these poses mean.
    pub(crate) convention: PoseConvention,
    /// What is posed may be another body than the sensor: `world_from_sensor = world_from_posed * posed_from_sensor`.
    pub(crate) posed_from_sensor: Option<Pose<3>>,
    /// The camera, if it is one.
    pub(crate) camera: Option<Camera>,
    /// What the format counted by itself.
    pub(crate) stats: ScanLogStats,
    /// What was chosen and left out of a bag.
    pub(crate) bag: Option<Box<BagLogStats>>,
    /// The poses that the caller named are in the source already: they are those of a scanner that moved while it scanned.
    pub(crate) uses_named_poses: bool,
}

impl Parts {
    /// Scans of sensors whose poses are their own, `world_from_sensor`.
    pub(crate) fn new(
        path: &Path,
        source: impl FrameSource + 'static,
        scans: Vec<ScanId>,
        poses: LayoutPoses,
    ) -> Self {
        let (source, convention, stats) =
            (Box::new(source), PoseConvention::default(), ScanLogStats::default());
        Self {
            name: name_of(path),
            source,
            scans,
            poses,
            convention,
            posed_from_sensor: None,
            camera: None,
            stats,
            bag: None,
            uses_named_poses: false,
        }
    }
}

/// The pose in a file of its own; `None` where the file is missing.
pub(super) fn pose_beside(path: &Path) -> Result<Option<(PathBuf, RawPose)>> {
    if !path.exists() {
        return Ok(None);
    }
    let mut file = read_poses_3d(path)?;
    if file.poses.len() != 1 {
        let value = file.poses.len().to_string();
        return Err(IoError::layout(path, "the number of poses", value, "give one pose per scan"));
    }
    Ok(file.poses.pop().map(|pose| (file.path, pose)))
}

/// How many files of poses, one each, lie in a folder beside no scan. `name_of_scan` makes the name of a scan of that of a
/// pose, and is `None` for other files.
pub(super) fn poses_beside_nothing(
    folder: &Path,
    scans: &[String],
    name_of_scan: impl Fn(&str) -> Option<String>,
) -> Result<u64> {
    let scans: HashSet<&str> = scans.iter().map(String::as_str).collect();
    let alone = |name: &str| name_of_scan(name).is_some_and(|scan| !scans.contains(&*scan));
    Ok(names_in(folder, alone)?.len() as u64)
}
