//! rosbag2's sqlite3 databases, read from the pages of the file *(sqlite.org/fileformat2)*: tables only, never written,
//! over any source of bytes, which the library in C does not allow.
//!
//! | file | holds |
//! |---|---|
//! | `pages` | the header, b-trees of tables, payloads with their overflow pages |
//! | `record` | rows: varints, serial types, values |
//! | `schema` | the tables and the order of their columns |
//! | `rosbag2` | topics, definitions and the index of messages; the bytes of a message |

mod pages;
mod record;
mod rosbag2;
mod schema;

pub(crate) use pages::{Leaf, MAGIC};
pub(crate) use rosbag2::{Layout, index};
