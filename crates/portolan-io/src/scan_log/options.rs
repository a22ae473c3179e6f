//! What a caller may specify about a log.

use std::path::PathBuf;

use portolan::geom::Pose;

use super::{Distortion, Intrinsics, ScanLogKind};
use crate::BagChoice;
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
    /// Whether a camera of pictures of another size is scaled to those that are there, where its own size is known. Default: no, it
    /// is refused.
    pub scale_intrinsics: bool,
    /// The distortion of the depth camera's lens instead of what the layout has.
    pub distortion: Option<Distortion>,
    /// The color camera, where it is not the depth camera; default: the format's, else colors are pixels of the depth image.
    pub color_intrinsics: Option<Intrinsics>,
    /// The distortion of the color camera's lens; default: none.
    pub color_distortion: Option<Distortion>,
    /// Where the color camera is: `color_from_depth`; default: where the depth camera is.
    pub color_from_depth: Option<Pose<3>>,
    /// Units of a depth image per meter (1000: millimeters); default: the format's.
    pub depth_scale: Option<f64>,
    /// Whether the caller uses points without rays ([`Frame::without_rays`](portolan::scan::Frame::without_rays)): nothing is
    /// said then of where they may have been seen from. Default: no.
    pub points_only: bool,
    /// Whether colors are read where the log has them. Default: yes.
    pub color: bool,
    /// Whether the motion of the sensor within a scan is taken out, where points have times and poses cover them. Default: yes.
    pub deskew: bool,
    /// How far a pose's time may lie from a scan's (seconds). Default 0.02, as in TUM's tools.
    pub time_tolerance: f64,
    /// Bags: topics and frames.
    pub bag: BagChoice,
}

impl Default for ScanLogOptions {
    fn default() -> Self {
        Self {
            format: None,
            poses: None,
            pose_convention: None,
            origin: None,
            intrinsics: None,
            scale_intrinsics: false,
            distortion: None,
            color_intrinsics: None,
            color_distortion: None,
            color_from_depth: None,
            depth_scale: None,
            points_only: false,
            color: true,
            deskew: true,
            time_tolerance: 0.02,
            bag: BagChoice::default(),
        }
    }
}
