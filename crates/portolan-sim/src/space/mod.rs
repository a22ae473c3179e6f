//! Space: a building of bodies known in closed form, a lidar and a depth camera in it, and the truth to judge maps by.
//!
//! | question | start at |
//! |---|---|
//! | scans with poses, in one call | [`building`] |
//! | what is there | [`building_world`], [`SpaceWorld`], [`Body`], [`Shape`] |
//! | what does a sensor see, and with which noise | [`SpaceLidar`], [`DepthCamera`] |
//! | is a map right | [`surface_points`], [`free_points`]; [`score_free`], [`score_surface`], [`surface_errors`] |

mod camera;
mod furniture;
mod lidar;
mod log;
mod plan;
mod shape;
mod tree;
mod truth;
mod walk;
mod world;

pub use camera::{DepthCamera, camera_frame};
pub use lidar::{SpaceLidar, lidar_frame};
pub use log::{BuildingConfig, BuildingLog, SpaceSensor, building, building_poses};
pub use plan::{Building, building_world};
pub use shape::Shape;
pub use truth::{
    Labels, SurfacePoint, free_points, score_free, score_surface, seen_surface, surface_errors,
    surface_points,
};
pub use world::{Body, CHECKER, DEPTH_TOLERANCE, SpaceHit, SpaceWorld};
