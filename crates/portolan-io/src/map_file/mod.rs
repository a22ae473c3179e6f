//! `map.portolan`: the maps of a run in one lossless file.
//!
//! A [`Container`] with these chunks; further kinds of maps come as further chunks:
//!
//! | tag | name | content, little-endian |
//! |---|---|---|
//! | `HEAD` | | JSON: version, dimension, one entry per map (kind, kind of its cells, where its chunks are, place, settings), and what the writer says of itself (log, settings, statistics) |
//! | `GRID` | `occupancy` | i8 log odds, x fastest, -128 never observed |
//! | `TREE` | `occupancy` | i8 value of the root; per inner record, depth first, a mask of children; then `2^D` i8 values per record |
//! | `TSDF` | `distance`, `weight` | f32 each, x fastest; weight 0: never observed |
//! | `POSES` | `sensor` | per scan that was fused: f64 rows of the rotation, then the translation (`world_from_sensor`) |
//!
//! Planes of more than a gigabyte go on in chunks of the same name with `.1`, `.2`, .. behind it. Maps of unknown
//! kinds, unknown chunks and unknown fields of the header are kept when a file is read and written again.

mod content;
mod header;
mod read;
mod write;

pub use content::MapFile;
pub use header::{MapHeader, sweep_of, sweep_word, weights_of, weights_word};

/// The version of the header.
const VERSION: u64 = 1;

/// Name of the chunk that holds part `part` of a plane.
fn part_name(name: &str, part: usize) -> String {
    if part == 0 { name.to_owned() } else { format!("{name}.{part}") }
}
