//! g2o text files: `VERTEX_SE2`, `EDGE_SE2`, `VERTEX_SE3:QUAT`, `EDGE_SE3:QUAT`, `FIX` (Kümmerle et al. 2011).
//!
//! ```text
//! VERTEX_SE2 id x y theta
//! EDGE_SE2 i j x y theta  + upper triangle of the information, 6 numbers
//! VERTEX_SE3:QUAT id x y z qx qy qz qw
//! EDGE_SE3:QUAT i j x y z qx qy qz qw  + upper triangle of the information, 21 numbers
//! FIX id ...
//! ```

mod fields;
mod read;
mod write;

pub use fields::G2oError;
pub use read::{AnyGraph, G2oFile, read_g2o};
pub use write::write_g2o;
