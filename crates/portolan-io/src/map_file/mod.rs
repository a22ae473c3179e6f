//! `map.portolan`: the maps of a run in one lossless file, 2-D or 3-D.
//!
//! A [`Container`](crate::Container) with these chunks; further kinds of maps come as further chunks:
//!
//! | tag | name | content, little-endian |
//! |---|---|---|
//! | `HEAD` | | JSON: version, dimension, one entry per map (kind, kind of its cells, where its chunks are, place, settings), and what the writer noted (log, settings, statistics) |
//! | `GRID` | `occupancy` | dense: i8 log odds, x fastest, -128 never observed |
//! | `TREE` | `occupancy` | i8 value of the root; per inner record, depth first, a mask of children; then `2^D` i8 values per record |
//! | `TSDF` | `distance`, `weight` | dense: f32 each, x fastest; weight 0: never observed |
//! | `OBRICKS`, `TBRICKS`, `CBRICKS`, `ABRICKS` | `keys` | i32 x, y (and z) of each brick of 8 cells along each axis: index of its first cell, divided by 8; ascending, the last index first |
//! | `OBRICKS` | `occupancy` | in the order of the keys, the cells of each brick, x fastest: i8 log odds, -128 never observed |
//! | `TBRICKS` | `distance`, `weight` | in the order of the keys: f32 each; weight 0: never observed |
//! | `CBRICKS` | `color` | in the order of the keys: u16 red, green, blue, weight of each cell; weight 0: never observed, else `w`: 2^(w / 2048 - 24) * (1 + w % 2048 / 2048) |
//! | `ABRICKS` | `hits`, `length`, `looks` | in the order of the keys: u32 beams that ended in each cell; u32 length of all beams inside of it, `length_units` to a cell's edge; u16 scans that looked, 0: never observed |
//! | `POSES` | `sensor` | per fused scan: f64 rows of the rotation, then the translation (`world_from_sensor`) |
//!
//! Long planes go on in chunks of the same name followed by `.1`, `.2`, ..; each part of a plane of bricks holds whole
//! bricks, and as many as that part of the map's other planes. Maps of unknown kinds, unknown chunks and unknown fields
//! of the header are kept when a file is read and written again.

mod bricks;
mod content;
mod header;
mod kind;
mod read;
mod reading;
mod settings;

#[cfg(test)]
mod tests;
mod write;

pub use content::{AttenuationBricks, ColorBricks, MapFile, OccupancyBricks, TsdfBricks};
pub use header::MapHeader;
pub use read::map_dimension;
pub use settings::{sweep_of, sweep_word, weights_of, weights_word};

/// The version of the header.
const VERSION: u64 = 1;

/// A chunk of a kind that this version does not read.
#[derive(Clone, Debug, PartialEq)]
struct UnknownChunk {
    tag: String,
    name: String,
    content: Vec<u8>,
}

/// Name of the chunk that holds part `part` of a plane.
fn part_name(name: &str, part: usize) -> String {
    if part == 0 { name.to_owned() } else { format!("{name}.{part}") }
}
