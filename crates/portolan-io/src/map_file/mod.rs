//! `map.portolan`: the maps of a run in one lossless file.
//!
//! A [`Container`](crate::Container) with these chunks; further kinds of maps come as further chunks:
//!
//! | tag | name | content, little-endian |
//! |---|---|---|
//! | `HEAD` | | JSON: version, dimension, one entry per map (kind, kind of its cells, where its chunks are, place, settings), and what the writer says of itself (log, settings, statistics) |
//! | `GRID` | `occupancy` | in the plane: i8 log odds, x fastest, -128 never observed |
//! | `TREE` | `occupancy` | in the plane: i8 value of the root; per inner record, depth first, a mask of children; then `2^D` i8 values per record |
//! | `TSDF` | `distance`, `weight` | in the plane: f32 each, x fastest; weight 0: never observed |
//! | `OBRICKS`, `TBRICKS`, `CBRICKS` | `keys` | in space: i32 x, y, z of each brick of 8 x 8 x 8 cells: index of its first cell, divided by 8; ascending, z first |
//! | `OBRICKS` | `occupancy` | in the order of the keys, 512 cells each, x fastest: i8 log odds, -128 never observed |
//! | `TBRICKS` | `distance`, `weight` | in the order of the keys: f32 each; weight 0: never observed |
//! | `CBRICKS` | `color` | in the order of the keys: u16 red, green, blue, weight of each cell; weight 0: never observed, else `w`: 2^(w / 2048 - 24) * (1 + w % 2048 / 2048) |
//! | `POSES` | `sensor` | per scan that was fused: f64 rows of the rotation, then the translation (`world_from_sensor`) |
//!
//! Long planes go on in chunks of the same name with `.1`, `.2`, .. behind it; each part of a plane of bricks holds
//! whole bricks, and as many as that part of the map's other planes. Maps of unknown kinds, unknown chunks and
//! unknown fields of the header are kept when a file is read and written again.

mod any;
mod content;
mod header;
mod read;
mod reading;
mod space;
mod write;
mod writing;

pub use any::AnyMapFile;
pub use content::MapFile;
pub use header::{MapHeader, sweep_of, sweep_word, weights_of, weights_word};
pub use space::{ColorBricks, OccupancyBricks, SpaceMapFile, TsdfBricks};

/// The version of the header.
const VERSION: u64 = 1;

/// A chunk that this program does not know.
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
