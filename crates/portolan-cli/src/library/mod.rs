//! What other front ends have in common with the command line: logs opened by the same options, maps in the same file.

mod maps;
mod scans;

pub use maps::{MapperOfFile, read_mapper, save_2d, save_3d};
pub use scans::{OpenLog, StampedFrame, StampedScan};
