//! `map.portolan` of either dimension.

use std::path::Path;

use anyhow::bail;
use portolan_io::{AnyMapFile, IoError, MapFile, MapHeader, SpaceMapFile};

use crate::dimension::Dimension;

/// Reads a map to go on with.
///
/// # Errors
/// A file that is not a map or needs more than `memory` bytes, and a map of another dimension.
pub(crate) fn read(path: &Path, memory: u64, log: Dimension) -> anyhow::Result<AnyMapFile> {
    let file = AnyMapFile::read_within(path, memory)?;
    if matches!(file, AnyMapFile::Plane(_)) != (log == Dimension::Two) {
        bail!("{}: the map is not {} like the log; write to another folder", path.display(), log.word());
    }
    Ok(file)
}

pub(crate) fn in_2d(file: AnyMapFile) -> Option<Box<MapFile>> {
    if let AnyMapFile::Plane(file) = file { Some(file) } else { None }
}

pub(crate) fn in_3d(file: AnyMapFile) -> Option<Box<SpaceMapFile>> {
    if let AnyMapFile::Space(file) = file { Some(file) } else { None }
}

pub(crate) fn header(file: &AnyMapFile) -> &MapHeader {
    match file {
        AnyMapFile::Plane(file) => &file.header,
        AnyMapFile::Space(file) => &file.header,
    }
}

pub(crate) fn header_mut(file: &mut AnyMapFile) -> &mut MapHeader {
    match file {
        AnyMapFile::Plane(file) => &mut file.header,
        AnyMapFile::Space(file) => &mut file.header,
    }
}

pub(crate) fn write(file: &AnyMapFile, path: &Path) -> Result<(), IoError> {
    match file {
        AnyMapFile::Plane(file) => file.write(path),
        AnyMapFile::Space(file) => file.write(path),
    }
}
