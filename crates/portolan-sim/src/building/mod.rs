//! The simulator in 3-D: a building of solids known in closed form, a lidar and a depth camera in it, and ground truth to
//! evaluate maps with.
//!
//! | question | start at |
//! |---|---|
//! | scans with poses, in one call | [`building_log`] |
//! | the same while people walk about, point by point | [`walkers_log`] |
//! | the world | [`building_world`], [`World3`], [`Body`], [`Shape`] |
//! | sensors and their noise | [`SpinningLidar`], [`DepthCamera`] |

mod camera;
mod floor_plan;
mod furniture;
mod lidar;
mod log;
mod shape;
mod tree;
mod walk;
mod walkers;
mod world;

pub use camera::{DepthCamera, camera_frame};
pub use floor_plan::{Building, building_world};
pub use lidar::{SpinningLidar, lidar_frame, moving_lidar_frame};
pub use log::{BuildingConfig, BuildingLog, BuildingSensor, building_log, building_poses};
pub use shape::Shape;
pub use walkers::{WalkersConfig, WalkersScan, walkers_log};
pub use world::{Body, CHECKER, DEPTH_TOLERANCE, RayHit3, World3};
