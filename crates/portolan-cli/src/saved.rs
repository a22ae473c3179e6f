//! `map.portolan` of either dimension.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{anyhow, bail};
use portolan::store::Store;
use portolan_io::{Container, IoError, MapFile, MapHeader, map_dimension};

use crate::dimension::Dimension;
use crate::esdf::is_of_points;
use crate::mapping::{Settings, in_file_2d, in_file_3d};

/// A saved map.
pub(crate) enum SavedMap {
    Two(Box<MapFile<2>>),
    Three(Box<MapFile<3>>),
}

impl SavedMap {
    /// Reads a map that may take `memory` bytes.
    ///
    /// # Errors
    /// A file that is not a map, or needs more, or holds maps that no command would look at.
    pub(crate) fn read(path: &Path, memory: u64) -> anyhow::Result<Self> {
        let container = Container::read(path)?;
        let map = match map_dimension(&container)? {
            3 => Self::Three(Box::new(MapFile::from_container(&container, memory)?)),
            _ => Self::Two(Box::new(MapFile::from_container(&container, memory)?)),
        };
        drop(container);
        let map = map.with_maps_of_sums()?;
        let (held, has, wanted) = match &map {
            Self::Two(file) => ("2-D", file.has_bricks(), "an array (Dense::of_bricks)"),
            Self::Three(file) => ("3-D", file.has_arrays(), "bricks (Bricks::of_dense)"),
        };
        if has {
            bail!(
                "{}: a {held} map of a kind that only the library works with; save its cells in {wanted}",
                path.display()
            );
        }
        Ok(map)
    }

    /// With the maps that follow from sums, where it holds sums.
    pub(crate) fn with_maps_of_sums(self) -> anyhow::Result<Self> {
        Ok(match self {
            Self::Two(mut file) => match file.ledger.take() {
                Some(ledger) => {
                    let settings = Settings::of_saved(&file.header.settings).resolved(Dimension::Two);
                    in_file_2d(ledger, file, &settings)?.0
                }
                None => Self::Two(file),
            },
            Self::Three(mut file) => match file.ledger.take() {
                Some(ledger) => in_file_3d(ledger, file)?.0,
                None => Self::Three(file),
            },
        })
    }

    /// That scans are in it under two names, where they are.
    pub(crate) fn copies(&self) -> Option<String> {
        let copies = match self {
            Self::Two(file) => file.ledger.as_ref().map_or(0, |ledger| ledger.scans().copies()),
            Self::Three(file) => file.ledger.as_ref().map_or(0, |ledger| ledger.scans().copies()),
        };
        in_words_of_copies(copies)
    }

    /// Whether it holds sums.
    pub(crate) fn is_ledger(&self) -> bool {
        match self {
            Self::Two(file) => file.ledger.is_some(),
            Self::Three(file) => file.ledger.is_some(),
        }
    }

    /// Reads a map to go on with.
    ///
    /// # Errors
    /// As [`SavedMap::read`], and a map of another dimension.
    pub(crate) fn read_to_append(path: &Path, memory: u64, log: Dimension) -> anyhow::Result<Self> {
        let file = Self::read(path, memory)?;
        if matches!(file, Self::Two(_)) != (log == Dimension::Two) {
            bail!("{}: the map is not {} like the log; write to another folder", path.display(), log.word());
        }
        Ok(file)
    }

    pub(crate) fn in_2d(self) -> Option<Box<MapFile<2>>> {
        if let Self::Two(file) = self { Some(file) } else { None }
    }

    pub(crate) fn in_3d(self) -> Option<Box<MapFile<3>>> {
        if let Self::Three(file) = self { Some(file) } else { None }
    }

    pub(crate) fn header(&self) -> &MapHeader {
        match self {
            Self::Two(file) => &file.header,
            Self::Three(file) => &file.header,
        }
    }

    pub(crate) fn header_mut(&mut self) -> &mut MapHeader {
        match self {
            Self::Two(file) => &mut file.header,
            Self::Three(file) => &mut file.header,
        }
    }

    pub(crate) fn write(&self, path: &Path) -> Result<(), IoError> {
        match self {
            Self::Two(file) => file.write(path),
            Self::Three(file) => file.write(path),
        }
    }

    /// Bytes of each map, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let named = match self {
            Self::Two(file) => [
                ("grid", file.grid.as_ref().map(|map| map.memory_bytes())),
                ("tree", file.tree.as_ref().map(|map| map.memory_bytes())),
                ("tsdf", file.tsdf.as_ref().map(|map| map.memory_bytes())),
                ("attenuation", file.attenuation.as_ref().map(|map| map.store.memory_bytes())),
            ],
            Self::Three(file) => {
                let colors = file.color_bricks.as_ref().map_or(0, |map| map.store.memory_bytes());
                [
                    ("grid", None),
                    ("tree", file.occupancy_bricks.as_ref().map(|map| map.store.memory_bytes())),
                    ("tsdf", file.tsdf_bricks.as_ref().map(|map| map.store.memory_bytes() + colors)),
                    ("attenuation", file.attenuation.as_ref().map(|map| map.store.memory_bytes())),
                ]
            }
        };
        let sums = match self {
            Self::Two(file) => file.ledger.as_ref().map(|ledger| ledger.memory_bytes()),
            Self::Three(file) => file.ledger.as_ref().map(|ledger| ledger.memory_bytes()),
        };
        named.into_iter().chain([("sums", sums)]).filter_map(|(name, bytes)| Some((name, bytes?))).collect()
    }
}

/// What is to be said of scans that are in a map under two names.
pub(crate) fn in_words_of_copies(copies: usize) -> Option<String> {
    (copies > 0).then(|| {
        format!(
            "{copies} scans have the readings and poses of scans of another log: is one log there under two names? They count \
             twice; take one out with merge --without"
        )
    })
}

/// That a map has no signed distances, and what to do.
pub(crate) fn no_tsdf(map: &Path, header: &MapHeader) -> anyhow::Error {
    if is_of_points(&header.settings) {
        return anyhow!(
            "{}: the map is of points without rays, which have no surface; map scans that say where they were seen from",
            map.display()
        );
    }
    anyhow!("{}: the map has no tsdf; make it with --maps tsdf", map.display())
}
