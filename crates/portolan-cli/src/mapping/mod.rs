//! From scans to files: what `map` is made of.

mod artefacts;
mod extent;
mod fuse;
mod grow;
mod settings;
mod words;

pub(crate) use artefacts::{
    Artefacts, Derived, cells_for_map_server, polylines, seen_by_tree, write_contour,
};
pub(crate) use extent::{check_memory, grid_over, seen, with_outlier};
pub(crate) use fuse::{FusionReport, Maps, fuse};
pub(crate) use grow::grown;
pub(crate) use settings::{MapKind, Settings, map_word};
pub(crate) use words::{Summary, report};
