//! What a caller may specify about a log.

use std::path::PathBuf;

use super::{Intrinsics, ScanLogKind};
use crate::poses3::PoseConvention;

/// Settings of reading; the default leaves everything to the files.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanLogOptions {
    /// The kind of log; default: recognized.
    pub format: Option<ScanLogKind>,
    /// A pose file instead of what the layout has; the number of columns decides its layout. Its poses are those of the
    /// sensor itself: where a layout poses another body (KITTI: a camera beside the lidar, with `Tr` between them), that is
    /// not applied to them.
    pub poses: Option<PathBuf>,
    /// What the numbers of the poses mean; default: the format's, and world from sensor for `poses`.
    pub pose_convention: Option<PoseConvention>,
    /// Where rays begin in the frame of a cloud's points (meters), for lidars whose zero is not the sensor and for single clouds
    /// in the world's frame; default: the viewpoint of a PCD file where points are in the world's frame, else zero.
    pub origin: Option<[f64; 3]>,
    /// The camera instead of what the layout has.
    pub intrinsics: Option<Intrinsics>,
    /// Units of a depth image per meter (1000: millimeters); default: the format's.
    pub depth_scale: Option<f64>,
    /// Whether the caller uses points without rays ([`Frame::without_rays`](portolan::scan::Frame::without_rays)): nothing is
    /// said then of where they may have been seen from. Default: no.
    pub points_only: bool,
    /// Whether colors are read where the log has them. Default: yes.
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
            points_only: false,
            color: true,
            time_tolerance: 0.02,
        }
    }
}
