//! What a planner asks of a field that certifies clearance: is this path free, this body at this pose, this motion; and
//! where is the nearest place that is.
//!
//! Everything here rests on [`ClearanceField`](crate::field::ClearanceField) alone: a place is *certified* where the
//! lower bound of its clearance is as large as demanded, and a path where every point of it is. What is not certified is
//! refused with its [`Cause`], and never passed over: a check says where and why. Distances are those to the surface that
//! the map extracts; what the map gets wrong is not seen here.

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
pub use path::{PathCheck, PathClearance, PathViolation, check_path};
pub use pose_check::{BodyCheck, BodyClearance, check_pose};
pub use profile::{ProfileSample, clearance_profile};
pub use spline::Spline;
pub use waypoints::Waypoints;
