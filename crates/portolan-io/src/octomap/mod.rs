//! OctoMap's trees *(Hornung et al. 2013, doi:10.1007/s10514-012-9321-0)*, as OctoMap 1.x writes them.
//!
//! A header of lines, ended by `data`:
//!
//! ```text
//! # Octomap OcTree binary file      (.bt; in an .ot: # Octomap OcTree file)
//! # ...                             comments
//! id OcTree                         class of the tree
//! size 532566                       inner nodes and leaves
//! res 0.08                          meters per cell
//! data
//! ```
//!
//! Then the nodes, depth first, children in the order of their index (bit 0: upper half along x, bit 1: y, bit 2: z):
//!
//! - **.bt**: two bytes for each inner node, little-endian; bits `2c` and `2c + 1` are the state of child `c`: 0 never observed,
//!   1 a free leaf, 2 an occupied leaf, 3 an inner node.
//! - **.ot**: for each node its log odds (f32, little-endian; of an inner node the largest of its children's), in a
//!   ColorOcTree three bytes of color, and a byte whose bit `c` is set where child `c` exists.
//!
//! A byte of a file becomes many in memory (an inner node of a `.bt` has two there and 70 here, twice that while it is
//! read), and a packed file has fewer still: reading takes at most 4 GiB for a packed file, some 33 million inner nodes, and
//! 16 GiB for a plain one. Beyond that it is an error.
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
pub use write::{octomap_bt_to_bytes, write_octomap_bt, write_octomap_ot};

/// Levels below the root.
const DEPTH: u32 = 16;
/// Cells from the root's lower corner to the world's zero.
const HALF: i32 = 1 << (DEPTH - 1);
/// The most nodes of a file.
const MOST_NODES: u64 = 1 << 30;

/// The memory that the nodes of a packed file may take (bytes): what few bytes unpack to is kept within a small machine.
const MOST_MEMORY_PACKED: u64 = 4 << 30;
/// The memory that the nodes of a plain file may take (bytes).
const MOST_MEMORY_PLAIN: u64 = 16 << 30;
/// Memory of an inner node while a file is read (bytes): 33 in the list of records, 37 in the tree that is made of it, and
/// what growing lists have in reserve.
const NODE_MEMORY: u64 = 128;
/// Memory of what is kept beside the tree of an inner node that is not as the tree has it (bytes), with the same reserve.
const STORED_MEMORY: u64 = 16;

/// Log odds of a free leaf of a `.bt`: OctoMap's lower clamp, P = 0.1192.
pub const OCTOMAP_FREE: f32 = -2.000_028;
/// Log odds of an occupied leaf of a `.bt`: OctoMap's upper clamp, P = 0.971.
pub const OCTOMAP_OCCUPIED: f32 = 3.511_030_7;
