//! Lattices, boxes, poses and the walk of a ray through cells. Imports no other module of the crate.
//!
//! Conventions of the whole crate:
//!
//! - Meters and radians. World coordinates and poses are `f64`.
//! - Cell `i` of a lattice covers `[i, i + 1) * resolution` from the origin along each axis: a point on
//!   a face belongs to the cell above it (`floor`). The sample of a cell lies at its center,
//!   `(i + 1/2) * resolution`.
//! - x is the fastest axis in memory. Frames are right-handed, angles counter-clockwise.
//! - A pose is named `target_from_source` and maps points of the source frame into the target frame.

mod aabb;
mod block;
mod cell_box;
mod grid;
mod interpolation;
mod lattice;
mod pose;
mod trajectory;
mod twist;
pub mod vector;
mod walk;

pub use aabb::Aabb;
pub use block::{BLOCK_EDGE, BlockKey, block_cells};
pub use cell_box::CellBox;
pub use grid::Grid;
pub use interpolation::interpolate;
pub use lattice::Lattice;
pub use pose::{Pose, PoseError};
pub use trajectory::{Motion, NoPose, Trajectory, TrajectoryError};
pub use walk::RayWalk;
