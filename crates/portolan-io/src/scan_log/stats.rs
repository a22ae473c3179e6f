//! What was found in a log: all that is dropped is counted.

use std::fmt;
use std::path::PathBuf;

use crate::poses3::PoseFault;

/// A pose that was refused, and its scan with it.
#[derive(Clone, Debug, PartialEq)]
pub struct RefusedPose {
    /// The file that holds the pose.
    pub path: PathBuf,
    /// Where it begins: line number, from 1.
    pub line: u64,
    /// Why.
    pub fault: PoseFault,
}

impl fmt::Display for RefusedPose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: line {}: {}", self.path.display(), self.line, self.fault)
    }
}

/// Color pictures of frames that were read without them, as these could not be read or have another size than the depth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnreadColors {
    /// How many, each counted once.
    pub pictures: u64,
    /// What is wrong with the first of them, in the log's order.
    pub first: String,
}

/// Counts of a log of 3-D scans. Scans that are left out are those without pose, those at an unmatched time and those
/// whose pose is refused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanLogStats {
    /// Scans that were found.
    pub scans: u64,
    /// Scans that a list names and whose files are not there; they are not among `scans`.
    pub missing_files: u64,
    /// Poses that were found.
    pub poses: u64,
    /// Scans left out because no pose belongs to them.
    pub scans_without_pose: u64,
    /// Poses without a scan. Not counted where poses are matched by time: trajectories are denser than scans.
    pub poses_without_scan: u64,
    /// Scans left out because no usable pose is near in time.
    pub unmatched_times: u64,
    /// Poses that were not rigid to the digits of their text (off by more than [`crate::poses3::MENDED_FROM`]) and were made
    /// so.
    pub mended_poses: u64,
    /// How far off the worst pose that was used is (see [`portolan::geom::Pose::from_matrix`]).
    pub worst_pose: f64,
    /// Poses that cannot be used; their scans are left out.
    pub refused_poses: Vec<RefusedPose>,
    /// Scans without a color picture, in a log where others have one.
    pub scans_without_color: u64,
    /// What the caller should know of the poses or pictures, in sentences.
    pub notes: Vec<String>,
    /// Pixels of the undistorted first depth image that the lens does not show: they have no reading.
    pub pixels_beyond_lens: u64,
    /// Why the color pictures of the log are not used; `None`: they are, or the log has no pictures.
    pub colors_left_out: Option<String>,
    /// What had to be assumed about the log or was passed over, a sentence each.
    pub warnings: Vec<String>,
}
