//! ROS 1 bags, version 2.0 *(wiki.ros.org/Bags/Format/2.0)*: records of named fields, messages in chunks, an index at the
//! end that a recorder which was killed has not written.
//!
//! | file | holds |
//! |---|---|
//! | `open` | the index, by that of the file or by reading everything |
//! | `by_index`, `scan` | the two ways |
//! | `connections` | connections as topics |
//! | `chunk`, `record` | chunks; records, their fields, and messages |

mod by_index;
mod chunk;
mod connections;
mod open;
mod record;
mod scan;

pub(crate) use chunk::{load_chunk, packing_of};
pub(crate) use open::index;
pub(crate) use record::{message_at, message_in};
