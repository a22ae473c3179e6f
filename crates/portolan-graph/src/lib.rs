//! Pose graphs in the plane and in space: what was measured between poses, and the poses that agree with it best.
//!
//! ```text
//!   odometry   o--o--o--o          o--o--o
//!              |         \    ->   |      |      the lap closes: every pose moves a little
//!   closure    o - - - - -o        o--o--o
//! ```
//!
//! A [`PoseGraph`] holds vertices (poses) and edges (relative poses with information matrices);
//! [`PoseGraph::optimise`] minimises `sum r^T Omega r` by sparse Levenberg-Marquardt, with a robust [`Kernel`] where
//! closures may be false. A minimum is only as good as the start: [`PoseGraph::start_from_chordal`] for graphs
//! that can be trusted, [`PoseGraph::start_from_tree`] with [`Chain::Odometry`] for others. [`read_g2o`] and
//! [`write_g2o`] speak the format of the community's benchmark graphs.
//!
//! The crate opens no files, prints nothing, and gives the same bytes on every machine.

#![allow(clippy::needless_range_loop, reason = "formulas over rows and columns read best with their indices")]

mod components;
mod error;
mod g2o;
mod graph;
mod information;
mod kernel;
mod optimise;
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
