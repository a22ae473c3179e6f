//! What answers the page: one [`Session`] per tab, a view of it per folder.

mod about;
mod clearance;
mod clock;
mod exports;
mod fusion;
mod gallery;
mod logs;
mod protocol;
mod radiance;
mod recipe;
mod session;
mod view3d;

pub use clock::Clock;
pub use logs::{BesideMap, Logs, Source2d, Source3d};
pub use protocol::{Array, Refusal, Reply, Values, Wire};
pub use session::{Limits, Session, check};
