//! Laws, scenes and bounds of the library: one program, because each that links it compiles all its generic code again.
#![allow(clippy::unwrap_used, reason = "in a test a panic is the report")]
#![allow(clippy::print_stdout, reason = "tables of errors are part of the report")]

mod accurate_esdf;
mod attenuation;
mod certified_clearance;
mod common;
mod explore;
mod forgetting;
mod laws;
mod ledger;
mod limit_of_search;
mod nothing_lost;
mod obstacles;
mod own_map;
mod plan;
mod points_without_rays;
mod range_images;
mod references;
mod scenes;
mod thin_walls;
mod thresholds;
mod tsdf_3d;
mod tsdf_3d_scenes;
