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
//! | `SCANS` | `logs`, `index`, `readings`, `sensor` | of a ledger: JSON list of logs and their numbers of scans; then per scan, by log and number: u64 number in its log; u64 that tells its readings from others; f64 pose as in `POSES` |
//! | `OSUMS`, `TSUMS`, `CSUMS`, `ASUMS` | `keys` | of a ledger: as those of bricks |
//! | `OSUMS`, `TSUMS`, `CSUMS`, `ASUMS` | `width` | per brick u8: bytes of each of its numbers, 2, 4 or 8; 0: all cells are alike |
//! | `OSUMS` | `sums` | per brick, whole numbers with a sign, two's complement: scans that hit each cell, then those that passed it; where all are alike one i64 each |
//! | `TSUMS` | `sums` | the same: sum of weight times distance (`weight_units` times `distance_steps` to the truncation), then sum of weights |
//! | `CSUMS` | `sums` | the same: sums of weight (`weight_units`) times red, green, blue (bytes), then sum of weights; in the header `color` |
//! | `ASUMS` | `sums` | the same: beams that ended in each cell; length of all beams (`length_units` to a cell's edge); scans that looked |
//! | `POSES` | `sensor` | per fused scan: f64 rows of the rotation, then the translation (`world_from_sensor`) |
//!
//! Long planes go on in chunks of the same name followed by `.1`, `.2`, ..; each part of a plane of bricks holds whole
//! bricks, and as many as that part of the map's other planes. A ledger is the only map of its file, and everything about it is in the
//! field `ledger` of the header; files of equal ledgers are equal byte for byte. Maps of unknown kinds, unknown chunks and unknown fields
//! of the header are kept when a file is read and written again.

mod bricks;
mod content;
mod header;
mod kind;
mod ledger;
mod ledger_files;
mod read;
mod reading;
mod settings;

#[cfg(test)]
mod ledger_tests;
#[cfg(test)]
mod tests;
mod write;

pub use content::{AttenuationBricks, ColorBricks, MapFile, OccupancyBricks, TsdfBricks};
pub use header::MapHeader;
pub use ledger_files::{LedgerFile, add_ledger_files, scans_of_sum};
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
