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
//! | [`Redwood`](ScanLogKind::Redwood) | `depth/*.png`, `color/*` (`image`, `rgb`) | `trajectory.log`, or `pose/*.txt` (ScanNet) |
//! | [`BigBird`](ScanLogKind::BigBird) | `masked_depth/frameF_camC.png` | `pose/poses.txt` |
//!
//! Poses that the caller names ([`ScanLogOptions::poses`]) are those of the sensor itself: KITTI's `Tr` is not applied to
//! them.
//!
//! [`ScanLog::open`] finds the files, reads the poses and counts in [`ScanLogStats`] what does not fit together; the scans
//! themselves are read on request, by index and from any thread.
//!
//! To add a format: a file here with a function `fn(&Path, &ScanLogOptions) -> Result<Parts>`, which finds the
//! scans and where their poses are, and a kind in `kind.rs`. Matching poses with scans, conventions, mending and refusing
//! happen once, in `log.rs`.

mod agreement;
mod bigbird;
mod cloud_frames;
mod clouds;
mod color;
mod depth_frames;
mod depth_png;
mod files;
mod graph;
mod hidden;
mod intrinsics;
mod kind;
mod kitti;
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
mod tum_rgbd;

pub use intrinsics::{Camera, CameraFrom, Intrinsics};
pub use kind::ScanLogKind;
pub use log::ScanLog;
pub use options::ScanLogOptions;
pub use stats::{RefusedPose, ScanLogStats, UnreadColors};
