//! 3-D poses of sensors: the layouts that files have, and the conventions of their numbers.
//!
//! | columns | layout |
//! |---|---|
//! | 4 | rows of 4x4 matrices, one block after the other; a file of three rows is one 3x4 matrix |
//! | 3, then 4 | Redwood `.log` (Open3D): a line of three integers, then a 4x4 matrix |
//! | 7 | `tx ty tz qx qy qz qw` |
//! | 8 | `t tx ty tz qx qy qz qw` (TUM), in any order of time |
//! | 12 | the first three rows of a matrix (KITTI) |
//! | 16 | a 4x4 matrix, row by row |
//!
//! Separated by spaces, tabs, commas or semicolons; a separator at the end of a line is tolerated, `#` starts a comment,
//! empty lines are skipped.
//!
//! Traps, each of which was met in a published data set:
//! - Element `[3][3]` holds a time stamp instead of 1. It is taken for one only where it differs between the matrices of a
//!   file (at least two) and never descends from one to the next; any other value than 1 is a [`PoseFault::LastRow`].
//! - Rotations are orthonormal only to the digits of the text, or to what a tracker let slip: see [`RawPose::resolve`].
//! - A matrix of NaN or infinity stands for "tracking was lost": that pose is refused, not the file.
//! - The same twelve numbers mean different poses: see [`PoseConvention`].

mod convention;
mod raw;
mod read;
mod track;

pub use convention::PoseConvention;
pub use raw::{MENDED_FROM, PoseFault, RawPose};
pub use read::{PoseFile, PoseLayout, parse_poses_3d, read_poses_3d};

pub(crate) use track::{TimedPoses, TrackPose};
