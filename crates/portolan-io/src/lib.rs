//! Every file format that portolan reads or writes, one file each.

mod bytes;
mod carmen;
mod error;
#[cfg(test)]
mod testing;

pub use bytes::{Compression, Input, open, write_atomic};
pub use carmen::{
    CarmenLog, CarmenScan, CarmenStats, RefusedScan, RefusedScans, ScanFault, ScanMessage, TimeOrder,
    detect_no_return,
};
pub use error::IoError;
