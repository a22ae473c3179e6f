//! What answers the page: one [`Session`] per tab, a view of it per folder.

mod clearance;
mod clock;
mod exports;
mod fusion;
mod logs;
mod protocol;
mod radiance;
mod session;

pub use clock::Clock;
pub use logs::{Logs, PlaneLog, SpaceSource};
pub use protocol::{Array, Refusal, Reply, Values, Wire};
pub use session::{Limits, Session, check};
