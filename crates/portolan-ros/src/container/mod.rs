//! MCAP, sqlite3 and ROS 1 bags as one thing: topics, an index, messages as bytes.
//!
//! | file | holds |
//! |---|---|
//! | `bag`, `open` | [`Bag`]: the index, reading by place and in one pass; opening |
//! | `summary` | what a bag holds, for people: rates, gaps, clocks, compression |
//! | `topic` | [`Topic`] and [`MessageRef`] |
//! | `source`, `reader` | where bytes come from; bounded reads at a place |
//! | `kind`, `folder` | what a file is by its first bytes; the files of a folder |
//! | `mcap`, `ros1`, `sqlite` | an index and the reading of messages for each container |
//! | `unpack`, `cache` | compressed chunks and files; the chunks that were unpacked last |
//!
//! Nothing is loaded whole: memory is that of the index (32 bytes a message), of the chunks in the cache and of the
//! largest message. A length in a file is checked against the bytes that are there before memory is taken for it.

mod bag;
mod cache;
mod folder;
mod index;
mod kind;
mod mcap;
mod open;
mod reader;
mod ros1;
mod source;
mod sqlite;
mod summary;
#[cfg(test)]
mod tests;
mod topic;
mod unpack;

pub use bag::{Bag, TopicCount};
pub use folder::holds_bags;
pub use kind::ContainerKind;
pub use open::BagOptions;
pub use source::{BytesSource, FileSource, ReadSeek, Source};
pub use summary::{BagSummary, TopicSummary};
pub use topic::{DefinitionFormat, Encoding, MessageRef, Topic};
