//! What a caller may say about a log that its files do not say.

use std::path::PathBuf;

use super::{Intrinsics, ScanLogKind};
use crate::poses3::PoseConvention;

/// Settings of reading; the default leaves everything to the files.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanLogOptions {
    /// The kind of log; default: recognised.
    pub format: Option<ScanLogKind>,
    /// A pose file instead of what the layout has; its layout is told by the number of columns. Its poses are those of the
    /// sensor itself: where a layout poses another body (KITTI: a camera beside the lidar, with `Tr` between them), that is
    /// not applied to them.
    pub poses: Option<PathBuf>,
    /// What the numbers of the poses mean; default: what the format says, and world from sensor for `poses`.
    pub pose_convention: Option<PoseConvention>,
    /// Where rays begin in the frame of a cloud's points (metres), for lidars whose zero is not the sensor and for single clouds
    /// in the world's frame; default: the viewpoint of a PCD file where points are in the world's frame, else zero.
    pub origin: Option<[f64; 3]>,
    /// The camera instead of what the layout has.
    pub intrinsics: Option<Intrinsics>,
    /// Units of a depth image per metre (1000: millimetres); default: what the format says.
    pub depth_scale: Option<f64>,
    /// Whether colours are read where there are some. Default: yes.
    pub color: bool,
    /// How far a pose's time may lie from a scan's (seconds). Default 0.02, as in TUM's tools.
    pub time_tolerance: f64,
}

impl Default for ScanLogOptions {
    fn default() -> Self {
        Self {
            format: None,
            poses: None,
            pose_convention: None,
            origin: None,
            intrinsics: None,
            depth_scale: None,
            color: true,
            time_tolerance: 0.02,
        }
    }
}
