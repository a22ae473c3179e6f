//! OctoMap's trees *(Hornung et al. 2013, doi:10.1007/s10514-012-9321-0)*, as OctoMap 1.x writes them.
//!
//! A header of lines, ended by `data`:
//!
//! ```text
//! # Octomap OcTree binary file      (.bt; in an .ot: # Octomap OcTree file)
//! # ...                             comments
//! id OcTree                         class of the tree
//! size 532566                       inner nodes and leaves
//! res 0.08                          metres per cell
//! data
//! ```
//!
//! Then the nodes, depth first, children in the order of their index (bit 0: upper half along x, bit 1: y, bit 2: z):
//!
//! - **.bt**: two bytes for each inner node, little-endian; bits `2c` and `2c + 1` tell of child `c`: 0 never observed,
//!   1 a free leaf, 2 an occupied leaf, 3 an inner node.
//! - **.ot**: for each node its log odds (f32, little-endian; of an inner node the largest of its children's), in a
//!   ColorOcTree three bytes of colour, and a byte whose bit `c` tells that there is a child `c`.
//!
//! The depth is always 16 and the world's zero the corner in the middle, so that a file holds cells -32,768 to 32,767.

mod file;
mod header;
mod place;
mod read;
mod stored;
#[cfg(test)]
mod tests;
mod write;

pub use file::OctomapTree;
pub use write::{write_octomap_bt, write_octomap_ot};

/// Levels below the root.
const DEPTH: u32 = 16;
/// Cells from the root's lower corner to the world's zero.
const HALF: i32 = 1 << (DEPTH - 1);
/// The most nodes of a file.
const MOST_NODES: u64 = 1 << 30;

/// Log odds of a free leaf of a `.bt`: OctoMap's lower clamp, P = 0.1192.
pub const OCTOMAP_FREE: f32 = -2.000_028;
/// Log odds of an occupied leaf of a `.bt`: OctoMap's upper clamp, P = 0.971.
pub const OCTOMAP_OCCUPIED: f32 = 3.511_030_7;
