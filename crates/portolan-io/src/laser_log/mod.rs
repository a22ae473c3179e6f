//! Logs of planar lasers: poses and raw readings in memory, whatever file they come from.
//!
//! [`LaserLog`] is filled by `carmen` and by `ros_log`. Readings are as the sensor gave them; limits are applied when a scan is made
//! of them. Where a log declares the sensor's range, that is believed; where it does not, [`detect_no_return`] looks for readings
//! that mean "no echo".

mod fans;
mod log;
mod no_return;
mod times;

pub(crate) use fans::{FanShape, Fans};
pub(crate) use log::{Entry, MOST_READINGS, MOST_SCANS};
pub use log::{LaserLog, LaserLogStats, RawLaserScan};
pub use no_return::detect_no_return;
pub use times::TimeOrder;
pub(crate) use times::time_order;
