//! The maps: named combinations of sweep, cell and store, and the thin view that compares them.

mod attenuation;
mod cloud;
mod error;
mod integrate;
mod occupancy;
mod occupancy_3d;
#[cfg(test)]
mod occupancy_projective_tests;
mod occupancy_rings;
#[cfg(test)]
mod occupancy_tests;
mod occupancy_tree;
mod scan_kind;
mod thresholds;
mod tsdf;
mod tsdf_3d;
mod tsdf_config;
#[cfg(test)]
mod tsdf_tests;
mod watch;

pub use attenuation::Attenuation;
pub(crate) use attenuation::hits_per_cell;
pub use cloud::Cloud;
pub use error::MapError;
pub use integrate::integrate;
pub use occupancy::Occupancy;
pub use occupancy_tree::CoarseOccupancy;
pub use scan_kind::ScanKind;
pub use thresholds::{DistanceMap, least_weight};
pub use tsdf::Tsdf;
pub use tsdf_config::{BeamSweep, CARVE_WEIGHT, PointSweep, TsdfConfig, W_MAX};

use crate::cell::{LogOdds8, SignedDistance};
use crate::store::{Dense, Tree};

/// A TSDF over all cells of a grid.
pub type DenseTsdf<const D: usize> = Tsdf<D, Dense<SignedDistance, D>>;
/// A 2-D TSDF over all cells of a grid.
pub type Tsdf2 = DenseTsdf<2>;
/// A 3-D TSDF in bricks.
pub type Tsdf3 = Tsdf<3>;
/// An occupancy map over all cells of a grid, one byte each.
pub type OccupancyGrid<const D: usize> = Occupancy<D, LogOdds8, Dense<LogOdds8, D>>;
/// An occupancy map in a pruned tree, one byte a cell.
pub type OccupancyTree<const D: usize> = Occupancy<D, LogOdds8, Tree<LogOdds8, D>>;
/// A 2-D occupancy map in a pruned tree.
pub type Quadtree = OccupancyTree<2>;
/// A 3-D occupancy map in a pruned tree.
pub type Octree = OccupancyTree<3>;
