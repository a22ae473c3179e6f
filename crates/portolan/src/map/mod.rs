//! The maps: named combinations of sweep, cell and store, and the thin view that compares them.

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
mod tree_map;
mod tsdf;

pub use crate::sweep::OccupancySweep;
pub use cloud::Cloud;
pub use error::MapError;
pub use occupancy_grid::OccupancyGrid;
pub use repr::{Abilities, Derived, DerivedField, MapRepr};
pub use sparse_occupancy::SparseOccupancy;
pub use sparse_tsdf::SparseTsdf;
pub use sparse_tsdf_config::{PointSweep, SparseTsdfConfig};
pub use tree_map::{
    CoarseOccupancy, Octree, Quadtree, TreeMap, crossover_resolution, inner_only_node_bytes, memory_ratio,
};
pub use tsdf::{SweepKind, Tsdf, TsdfConfig};

/// A TSDF of the plane.
pub type Tsdf2 = Tsdf<2>;
/// A TSDF of space.
pub type Tsdf3 = Tsdf<3>;
/// Settings of a TSDF of the plane.
pub type Tsdf2Config = TsdfConfig<2>;
/// Settings of a TSDF of space.
pub type Tsdf3Config = TsdfConfig<3>;
