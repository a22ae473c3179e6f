//! Worlds, robots and sensors, deterministic from a seed.
//!
//! | question | start at |
//! |---|---|
//! | what is there, what does the robot see | [`apartment`], [`lap`], [`scan_at`] |
//! | where do the wheels say that it is | [`measure_motions`], [`dead_reckon`] |
//! | how far off are answers | [`Truth`], [`ErrorSummary`] |
//! | the same in 3-D: a building, a lidar, a depth camera, truth | [`building`], [`building_log`] |
//!
//! Every transcendental function comes from `libm` and every random number from one small generator, so that a
//! seed gives the same bytes on every platform and for any number of threads.
//!
//! ```
//! use portolan_sim::{LapConfig, apartment, lap};
//!
//! let world = apartment().world;
//! let lap = lap(&world, &LapConfig { scans: 4, ..Default::default() });
//! assert_eq!(lap.len(), 4);
//! let (world_from_sensor, scan) = &lap[0];
//! assert!(world.signed_distance(world_from_sensor.translation) > 0.25);
//! assert_eq!(scan.len(), 360);
//! ```

mod accuracy;
mod apartment;
pub mod building;
mod drive;
mod lidar;
mod odometry;
mod random;
mod solid;
mod world;

pub use accuracy::{ErrorSummary, Truth};
pub use apartment::{Apartment, CHAIR_MOVE, apartment};
pub use building::building_log;
pub use drive::{Lap, LapConfig, SEED, lap, lap_poses};
pub use lidar::{Lidar, scan_at, scan_while_moving};
pub use odometry::{OdometryNoise, dead_reckon, heading, measure_motions, planar};
pub use random::Random;
pub use solid::{Solid, SolidKind};
pub use world::{BoundarySegment, RayHit, World};
