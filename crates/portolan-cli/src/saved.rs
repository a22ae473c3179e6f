//! `map.portolan` of either dimension.

use std::path::Path;

use anyhow::bail;
use portolan_io::{Container, map_dimension, IoError, MapHeader};

use crate::dimension::Dimension;

/// Reads the map to go on with.
///
/// # Errors
/// A file that is not a map or needs more than `memory` bytes, and a map of the other dimension than the log.
pub(crate) fn read(path: &Path, memory: u64, log: Dimension) -> anyhow::Result<AnyMapFile> {
    let file = AnyMapFile::read_within(path, memory)?;
    let map = dimension(&file);
    if map != log {
        bail!(
            "{}: the map is {} and the log {}; write to another folder",
            path.display(),
            map.word(),
            log.word()
        );
    }
    Ok(file)
}

pub(crate) fn dimension(file: &AnyMapFile) -> Dimension {
    match file {
        AnyMapFile::Plane(_) => Dimension::Two,
        AnyMapFile::Space(_) => Dimension::Three,
    }
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
