//! From scans of space to files: what `map` is made of where the log has three dimensions.

mod artefacts;
mod derived;
mod extent;
mod files;
mod fuse;
mod maps;
mod memory;
mod preview;
mod settings;
mod words;

pub(crate) use artefacts::Artefacts;
pub(crate) use derived::{Derived, esdf_settings, mesh_settings};
pub(crate) use extent::brick_extent;
pub(crate) use files::{dense_esdf, write_mesh};
pub(crate) use fuse::{Fusion, fuse};
pub(crate) use maps::SpaceMaps;
pub(crate) use memory::{available_memory, peak_memory};
pub(crate) use settings::{Settings, sweep_of};
pub(crate) use words::{Summary, report};
