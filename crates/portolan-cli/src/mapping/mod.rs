//! From scans to files, in 2-D and 3-D: the parts of `map`.
//!
//! | step | file |
//! |---|---|
//! | what is asked for | `settings.rs`, `choices.rs` |
//! | the library's recipe for it | `recipe.rs` |
//! | scans and empty or saved maps | `mapper.rs`, `extent.rs` |
//! | one scan after the other | `fuse.rs`, `agreement.rs`, `movers.rs`; into sums `ledger.rs`, `aside.rs` |
//! | surface, distance field, octree | `derived.rs` |
//! | how sure the surface is | `sigma.rs` |
//! | files | `artifacts.rs`, `files.rs`, `octomap.rs`, `map_server.rs`, `picture.rs`, `preview.rs` |
//! | the report | `summary.rs` |

mod agreement;
mod artifacts;
mod aside;
mod choices;
mod derived;
mod extent;
mod files;
mod fuse;
mod ledger;
mod map_server;
mod mapper;
mod memory;
mod movers;
mod octomap;
pub(crate) mod picture;
pub(crate) mod preview;
mod recipe;
mod settings;
mod sigma;
mod summary;

pub(crate) use artifacts::{ARTIFACTS, Artifacts, Written, title};
pub(crate) use aside::Aside;
pub(crate) use choices::MapKind;
pub(crate) use derived::{Derived, DistanceField};
pub(crate) use extent::{brick_extent, check_memory, grid_over, seen, with_outlier};
pub use files::polylines;
pub(crate) use files::{dense_esdf, write_contour, write_mesh};
pub(crate) use fuse::{FusionReport, fuse_2d};
pub(crate) use ledger::{LedgerRun, in_file_2d, in_file_3d};
pub(crate) use map_server::{cells_for_map_server, grid_of};
pub(crate) use mapper::{
    Limits, OccupancyKinds, Run, mapper_2d, mapper_3d, store_2d, store_3d, unbounded_mapper_2d,
};
pub(crate) use memory::{TOO_LARGE, available_memory, is_about_memory, peak_memory};
pub(crate) use movers::{FoundMovers, Looking, MOVERS_FILE};
pub(crate) use octomap::Octree;
pub(crate) use settings::Settings;
pub(crate) use sigma::{Calibration, SIGMA_FILE, read_sigma};
pub(crate) use summary::{Summary, report};
