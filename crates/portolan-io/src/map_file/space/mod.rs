//! `map.portolan` of space: maps in bricks.

mod content;
mod entry;
mod read;
mod write;

pub use content::{ColorBricks, OccupancyBricks, SpaceMapFile, TsdfBricks};

/// Bytes of a brick's key.
const KEY_BYTES: usize = 3 * size_of::<i32>();
