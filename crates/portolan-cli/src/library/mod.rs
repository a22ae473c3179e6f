//! What other front ends have in common with the command line: logs opened by the same options, maps in the same file.

mod maps;
mod pictures;
mod scans;

pub use crate::mapping::polylines;
pub(crate) use maps::grid;
pub use maps::{MapperOfFile, ledger_file, read_mapper, save_2d, save_3d};
pub use pictures::{picture_2d, picture_of_mesh};
pub use scans::{OpenLog, StampedFrame, StampedScan};
