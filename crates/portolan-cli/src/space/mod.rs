//! From scans of space to files: what `map` is made of where the log has three dimensions.

mod artefacts;
mod derived;
mod fuse;
mod settings;
mod words;

pub(crate) use artefacts::Artefacts;
pub(crate) use derived::Derived;
pub(crate) use fuse::{Fusion, SpaceMaps, fuse};
pub(crate) use settings::Settings;
pub(crate) use words::{Summary, report};
