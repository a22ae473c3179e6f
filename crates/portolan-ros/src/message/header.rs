//! Stamps and frames.

use super::values::Record;
use crate::Result;

/// When and in which frame a message was measured.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// The time (nanoseconds since 1970, or of a simulation). Zero: drivers that set none leave it so.
    pub stamp: i64,
    /// The frame, without the leading slash of ROS 1.
    pub frame: String,
}

impl Header {
    /// The header of a message.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) where it has none, or one of other fields.
    pub fn of(message: &Record<'_>) -> Result<Self> {
        let header = message.record("header")?;
        let frame = frame_name(&header.text("frame_id")?).to_owned();
        Ok(Self { stamp: stamp(header.record("stamp")?)?, frame })
    }
}

/// Nanoseconds of a time: `secs` and `nsecs` of ROS 1, `sec` and `nanosec` of ROS 2.
pub(super) fn stamp(time: &Record<'_>) -> Result<i64> {
    let names = if time.has("sec") { ["sec", "nanosec"] } else { ["secs", "nsecs"] };
    let [seconds, nanoseconds] = names.map(|name| time.integer(name));
    let all = seconds? * 1_000_000_000 + nanoseconds?;
    i64::try_from(all).map_err(|_| time.fault(names[0], all, "a time is at most some hundred years"))
}

/// The name of a frame: `/laser` of ROS 1 and `laser` are one.
pub fn frame_name(name: &str) -> &str {
    name.trim().trim_start_matches('/')
}
