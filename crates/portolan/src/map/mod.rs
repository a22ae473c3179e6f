//! The maps: named combinations of sweep, cell and store.

mod cloud;
mod error;
mod integrate;
mod occupancy_grid;
mod repr;
mod sparse_occupancy;
#[cfg(test)]
mod sparse_occupancy_tests;
mod sparse_tsdf;
mod sparse_tsdf_config;
mod thresholds;
mod tree_map;
mod tsdf;
mod tsdf_3d;
mod tsdf_config;
#[cfg(test)]
mod tsdf_tests;
mod watch;

pub use crate::sweep::OccupancySweep;
pub use cloud::Cloud;
pub use error::MapError;
pub use occupancy_grid::OccupancyGrid;
pub use repr::{Abilities, Derived, DerivedField, MapRepr};
pub use sparse_occupancy::SparseOccupancy;
pub use sparse_tsdf::SparseTsdf;
pub use sparse_tsdf_config::{PointSweep, SparseTsdfConfig};
pub use thresholds::{DistanceMap, Thresholds};
pub use tree_map::{
    CoarseOccupancy, Octree, Quadtree, TreeMap, crossover_resolution, inner_only_node_bytes, memory_ratio,
};
pub use tsdf::{SweepKind, Tsdf, TsdfConfig};

use crate::cell::{LogOdds8, SignedDistance};
use crate::store::{Dense, Tree};

/// A TSDF over all cells of a grid.
pub type DenseTsdf<const D: usize> = Tsdf<D, Dense<SignedDistance, D>>;
/// A 2-D TSDF over all cells of a grid.
pub type Tsdf2 = DenseTsdf<2>;
/// A 3-D TSDF in bricks.
pub type Tsdf3 = Tsdf<3>;
/// Settings of a TSDF of the plane.
pub type Tsdf2Config = TsdfConfig<2>;
