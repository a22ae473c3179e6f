//! A `map.portolan` whose dimension the file tells.

use std::path::Path;

use super::reading::{MEMORY, dimension};
use super::{MapFile, SpaceMapFile};
use crate::{Container, IoError};

/// The content of a `map.portolan` of either dimension.
#[derive(Clone, Debug)]
pub enum AnyMapFile {
    /// Maps of the plane.
    Plane(Box<MapFile>),
    /// Maps of space.
    Space(Box<SpaceMapFile>),
}

impl AnyMapFile {
    /// Reads a file whose maps need at most 4 GiB.
    ///
    /// # Errors
    /// As [`AnyMapFile::read_within`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, IoError> {
        Self::read_within(path, MEMORY)
    }

    /// Reads a file whose maps need at most `memory` bytes.
    ///
    /// # Errors
    /// As [`MapFile::read_within`] and [`SpaceMapFile::read_within`].
    pub fn read_within(path: impl AsRef<Path>, memory: u64) -> Result<Self, IoError> {
        let path = path.as_ref();
        Self::of_container(&Container::read(path)?, path, memory)
    }

    /// Reads a file that is in memory, under the name that errors shall give.
    ///
    /// # Errors
    /// As [`AnyMapFile::read_within`].
    pub fn parse(bytes: Vec<u8>, name: &Path) -> Result<Self, IoError> {
        Self::of_container(&Container::parse(bytes, name)?, name, MEMORY)
    }

    fn of_container(container: &Container, path: &Path, memory: u64) -> Result<Self, IoError> {
        match dimension(container, path)? {
            3 => SpaceMapFile::of_container(container, path, memory).map(|file| Self::Space(Box::new(file))),
            // Every other number is refused there.
            _ => MapFile::of_container(container, path, memory).map(|file| Self::Plane(Box::new(file))),
        }
    }
}
