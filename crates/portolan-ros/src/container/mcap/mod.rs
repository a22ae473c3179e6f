//! MCAP *(mcap.dev/spec)*: records, some of them in compressed chunks, and a summary at the end.
//!
//! | file | holds |
//! |---|---|
//! | `open` | the index, by the summary or by reading everything |
//! | `summary`, `scan` | the two ways |
//! | `channels` | schemas and channels as topics |
//! | `chunk`, `record` | chunks; records and messages |

mod channels;
mod chunk;
mod open;
mod record;
mod scan;
mod summary;

pub(crate) use chunk::{load_chunk, packing_of};
pub(crate) use open::index;
pub(crate) use record::{message_at, message_in};

/// What the file starts and ends with.
pub(crate) const MAGIC: &[u8] = mcap::MAGIC;
