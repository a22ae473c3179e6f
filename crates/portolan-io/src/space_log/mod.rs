//! Logs of scans of space with the pose of every scan: one interface for depth cameras and lidars.
//!
//! | kind | layout | poses |
//! |---|---|---|
//! | [`SevenScenes`](SpaceLogKind::SevenScenes) | `frame-NNNNNN.depth.png`, `.color.jpg` or `.color.png` | `frame-NNNNNN.pose.txt` |
//! | [`Kitti`](SpaceLogKind::Kitti) | `velodyne/*.bin`, `times.txt` | `poses.txt` of the camera, `Tr` of `calib.txt` |
//! | [`Stanford`](SpaceLogKind::Stanford) | PLY files with a `range_grid` | `.conf`: conjugated quaternions |
//! | [`ScanGraph`](SpaceLogKind::ScanGraph) | a `.graph` file | in the file |
//! | [`Clouds`](SpaceLogKind::Clouds) | `*.pcd`, `*.ply`, `*.bin` or `*.xyz`; one such file | a file like `*pose*.csv`, or none: PCD viewpoints |
//! | [`TumRgbd`](SpaceLogKind::TumRgbd) | `depth.txt` and `rgb.txt` list pictures with times | `groundtruth.txt`, by time |
//! | [`Redwood`](SpaceLogKind::Redwood) | `depth/*.png`, `color/*` (`image`, `rgb`) | `trajectory.log`, or `pose/*.txt` (ScanNet) |
//! | [`BigBird`](SpaceLogKind::BigBird) | `masked_depth/frameF_camC.png` | `pose/poses.txt` |
//!
//! Poses that the caller names ([`SpaceLogOptions::poses`]) are those of the sensor itself: KITTI's `Tr` is not applied to
//! them.
//!
//! [`SpaceLog::open`] finds the files, reads the poses and says in [`SpaceLogStats`] what does not fit together; the scans
//! themselves are read when they are asked for, by index and from any thread.
//!
//! To add a format: a file here with a function `fn(&Path, &SpaceLogOptions) -> Result<Parts, IoError>`, which finds the
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
mod seven_scenes;
mod stanford;
mod stats;
#[cfg(test)]
mod testing;
mod tum_rgbd;

pub use intrinsics::{Camera, CameraFrom, Intrinsics};
pub use kind::SpaceLogKind;
pub use log::SpaceLog;
pub use options::SpaceLogOptions;
pub use stats::{RefusedPose, SpaceLogStats, UnreadColors};
