//! From scans to files, in 2-D and 3-D: the parts of `map`.
//!
//! | step | file |
//! |---|---|
//! | options and saved settings | `settings.rs`, `choices.rs` |
//! | numbers that fit the maps to each other | `recipe.rs` |
//! | scans and empty or saved maps | `mapper.rs`, `extent.rs`, `grow.rs` |
//! | one scan into every map | `maps.rs`, `fuse.rs` |
//! | surface, distance field, octree | `derived.rs` |
//! | files | `artifacts.rs`, `files.rs`, `map_server.rs`, `picture.rs`, `preview.rs` |
//! | the report | `summary.rs` |

mod artifacts;
mod choices;
mod derived;
mod extent;
mod files;
mod fuse;
mod grow;
mod map_server;
mod mapper;
mod maps;
mod memory;
mod picture;
mod preview;
mod recipe;
mod settings;
mod summary;

pub(crate) use artifacts::{Artifacts, title};
pub(crate) use choices::MapKind;
pub(crate) use derived::{Derived, DistanceField};
pub(crate) use extent::{brick_extent, check_memory, grid_over, seen, with_outlier};
pub(crate) use files::{dense_esdf, polylines, write_contour, write_mesh};
pub(crate) use fuse::{FusionReport, fuse_2d};
pub(crate) use map_server::cells_for_map_server;
pub(crate) use mapper::{Limits, Mapper};
pub(crate) use maps::{Maps, Maps2, Maps3};
pub(crate) use memory::available_memory;
pub(crate) use recipe::{esdf_settings, free_weight, mesh_settings};
pub(crate) use settings::Settings;
pub(crate) use summary::{Summary, report};
