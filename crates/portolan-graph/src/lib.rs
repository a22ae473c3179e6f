//! 2-D and 3-D pose graphs: poses, the relative poses measured between them, and the poses that fit these best.
//!
//! ```text
//!   odometry   o--o--o--o          o--o--o
//!              |         \    ->   |      |      the loop closes: every pose moves a little
//!   closure    o - - - - -o        o--o--o
//! ```
//!
//! A [`PoseGraph`] holds vertices (poses) and edges (relative poses with information matrices);
//! [`PoseGraph::optimize`] minimizes `sum r^T Omega r` by sparse Levenberg-Marquardt, with a robust [`Kernel`] where
//! closures may be false. The minimum found depends on the initial poses: use [`PoseGraph::start_from_chordal`] for
//! graphs without outliers, [`PoseGraph::start_from_tree`] with [`Chain::Odometry`] for others. [`read_g2o`] and
//! [`write_g2o`] read and write the format of the public benchmark graphs.
//!
//! The crate opens no files, prints nothing, and computes the same bytes on every machine.

#![allow(clippy::needless_range_loop, reason = "formulas over rows and columns read best with their indices")]

mod components;
mod error;
mod g2o;
mod graph;
mod information;
mod kernel;
mod optimize;
mod settings;
mod sparse;
mod start;
mod system;
mod tangent;

pub use error::GraphError;
pub use g2o::{AnyGraph, G2oError, G2oFile, read_g2o, write_g2o};
pub use graph::{Edge, EdgeKind, PoseGraph, Vertex};
pub use information::Information;
pub use kernel::Kernel;
pub use settings::{Approach, Report, Settings, Stop};
pub use start::Chain;
