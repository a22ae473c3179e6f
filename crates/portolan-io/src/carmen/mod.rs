//! CARMEN text logs of 2-D lasers (`.log`, `.clf`, `.gfs.log`; plain, gzip, bzip2).
//!
//! | message | what becomes of it |
//! |---|---|
//! | `FLASER n r1..rn x y theta odom_x odom_y odom_theta ipc_time host logger_time` | a scan; the first triple is the pose of the **laser** |
//! | `ROBOTLASER1 type start_angle fov resolution max_range accuracy remission_mode n r1..rn m e1..em laser_x laser_y laser_theta robot_x ...` | a scan with its own fan, unless the log has usable `FLASER` lines |
//! | everything else, comments included | counted by name |
//!
//! `FLASER` lines have no bearings: `-pi/2 + i pi/n` for even `n` (180, 360) and `-pi/2 + i pi/(n - 1)` for
//! odd `n` (181, 361) is what the SICK scanners of these logs do.
//!
//! Nor does a log define which readings mean "no echo": [`crate::detect_no_return`] finds them. Time stamps are
//! kept as they are given (they may be zero, relative, or wrap) and nothing depends on them.

mod message;
mod reading;
mod stats;

pub use stats::{CarmenStats, RefusedScan, RefusedScans, ScanFault, ScanMessage};
