//! Logs of 3-D scans with the pose of every scan: one interface for depth cameras and lidars.
//!
//! | kind | layout | poses |
//! |---|---|---|
//! | [`SevenScenes`](ScanLogKind::SevenScenes) | `frame-NNNNNN.depth.png`, `.color.jpg` or `.color.png` | `frame-NNNNNN.pose.txt` |
//! | [`Kitti`](ScanLogKind::Kitti) | `velodyne/*.bin`, `times.txt` | `poses.txt` of the camera, `Tr` of `calib.txt` |
//! | [`Stanford`](ScanLogKind::Stanford) | PLY files with a `range_grid` | `.conf`: conjugated quaternions |
//! | [`ScanGraph`](ScanLogKind::ScanGraph) | a `.graph` file | in the file |
//! | [`Clouds`](ScanLogKind::Clouds) | `*.pcd`, `*.ply`, `*.bin` or `*.xyz`; one such file | a file like `*pose*.csv`, else PCD viewpoints |
//! | | `*.e57`, `*.ptx` with any number of scans | in the file |
//! | | `*.las`, `*.laz` | none: points without rays |
//! | [`TumRgbd`](ScanLogKind::TumRgbd) | `depth.txt` and `rgb.txt` list pictures with times | `groundtruth.txt`, by time |
//! | | a file of any name that pairs pictures (`t rgb/a.png t depth/b.png`) | in it, or `groundtruth.txt` |
//! | [`Redwood`](ScanLogKind::Redwood) | `depth/*.png`, `color/*` (`image`, `rgb`) | `trajectory.log`, or `pose/*.txt` (ScanNet) |
//! | [`Transforms`](ScanLogKind::Transforms) | `transforms.json` names pictures and depth images | in the file, of an OpenGL camera |
//! | [`Colmap`](ScanLogKind::Colmap) | `sparse/0` a model, `depth/*.png`, `images` | in the model, of any scale |
//! | [`BigBird`](ScanLogKind::BigBird) | `masked_depth/frameF_camC.png` | `pose/poses.txt` |
//!
//! Poses that the caller names ([`ScanLogOptions::poses`]) are those of the sensor itself: KITTI's `Tr` is not applied to
//! them.
//!
//! [`ScanLog::open`] finds the files, reads the poses and counts in [`ScanLogStats`] what does not fit together; the scans
//! themselves are read on request, by index and from any thread.
//!
//! Points with times were measured while the sensor moved: [`ScanLog::filtered_frame`] takes that motion out, after what is found
//! in rows and columns as they are in the file (images, filters), since it leaves none.
//!
//! To add a format: a file here with a function `fn(&Path, &ScanLogOptions) -> Result<Parts>`, which finds the
//! scans and where their poses are, and a kind in `kind.rs`. Matching poses with scans, conventions, mending and refusing
//! happen once, in `log.rs`.

mod agreement;
mod association;
mod bigbird;
mod cloud_frames;
mod clouds;
mod colmap;
mod color;
mod depth_frames;
mod depth_png;
mod deskew;
mod distortion;
mod files;
mod graph;
mod hidden;
mod intrinsics;
mod kind;
mod kitti;
mod lens;
#[cfg(test)]
mod lidar_tests;
mod log;
mod matching;
mod options;
mod parts;
mod redwood;
mod scanner;
mod seven_scenes;
mod stanford;
mod stats;
#[cfg(test)]
mod survey_tests;
#[cfg(test)]
mod testing;
#[cfg(test)]
pub(crate) use testing::png_of;
mod transforms;
mod tum_rgbd;
mod up;
mod views;

pub(crate) use cloud_frames::{about, file_from_frames, scan_from};
pub(crate) use color::decode_color;
pub(crate) use depth_png::{damaged, decode_depth, decode_gray16, read_picture, size_within_limits};
pub(crate) use deskew::{BEYOND, Fate, Fates};
pub use deskew::{MotionStats, PointClock};
pub use distortion::Distortion;
pub(crate) use intrinsics::given_camera;
pub use intrinsics::{Camera, CameraFrom, Intrinsics};
pub use kind::ScanLogKind;
pub use lens::ColorCamera;
pub use log::ScanLog;
pub(crate) use matching::nearest_in_time;
pub use options::ScanLogOptions;
pub(crate) use parts::{FrameSource, LayoutPoses, Parts, ScanId};
pub use stats::{RefusedPose, ScanLogStats, UnreadColors};
