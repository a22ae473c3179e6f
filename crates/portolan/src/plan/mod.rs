//! Certified collision checks for planners: of a path, of a body at a pose, of a motion; and the search for the nearest
//! free point or pose.
//!
//! Everything here uses [`ClearanceField`](crate::field::ClearanceField) alone: a point is *certified* where the lower
//! bound of its clearance is at least the demand, a path where all its points are. Whatever is not certified is refused,
//! with the place and the [`Cause`]. Distances are those to the surface extracted from the map: errors of the map are not
//! covered by a certificate.

mod batch;
mod body;
mod curve;
mod demand;
mod error;
mod motion;
mod nearest_free;
mod path;
mod pose_check;
mod profile;
mod spline;
#[cfg(test)]
mod testing;
mod waypoints;

pub use batch::{check_motions, check_poses};
pub use body::{Body, Sphere};
pub use curve::{Curve, SpeedLimited};
pub use demand::{Cause, Demand};
pub use error::PlanError;
pub use motion::{Motion, MotionCheck, check_motion};
pub use nearest_free::{NearestFree, SearchLimits, nearest_free, nearest_free_pose};
pub use path::{PathCheck, PathClearance, PathViolation, check_path, path_violations};
pub use pose_check::{BodyCheck, BodyClearance, check_pose};
pub use profile::{ProfileSample, clearance_profile};
pub use spline::Spline;
pub use waypoints::Waypoints;
