//! Writing a `map.portolan` of the plane.

use std::path::Path;

use super::header::{Entry, LOG_ODDS, Model, Place, SIGNED_DISTANCE};
use super::writing::{begin, finish, floats_to_bytes, write_plane};
use super::{MapFile, sweep_word, weights_word};
use crate::{ContainerWriter, IoError};

impl MapFile {
    /// Writes the file. The same maps make the same bytes.
    ///
    /// # Errors
    /// As [`crate::write_atomic`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), IoError> {
        self.writer()?.write(path)
    }

    /// The file in memory.
    ///
    /// # Errors
    /// [`IoError::Unwritable`] where a map does not fit the format.
    pub fn to_bytes(&self) -> Result<Vec<u8>, IoError> {
        Ok(self.writer()?.to_bytes())
    }

    fn writer(&self) -> Result<ContainerWriter, IoError> {
        let mut writer = begin(&self.header, 2, self.entries(), &self.unknown_maps)?;
        if let Some(grid) = &self.grid {
            let plane: Vec<u8> = grid.store().planes().iter().map(|v| v.0 as u8).collect();
            write_plane(&mut writer, "GRID", "occupancy", &plane)?;
        }
        if let Some(tree) = &self.tree {
            let records = tree.store().records();
            let mut content = vec![records.root_value.0 as u8];
            content.extend(&records.masks);
            content.extend(records.values.iter().map(|v| v.0 as u8));
            write_plane(&mut writer, "TREE", "occupancy", &content)?;
        }
        if let Some(tsdf) = &self.tsdf {
            let planes = tsdf.store().planes();
            write_plane(&mut writer, "TSDF", "distance", &floats_to_bytes(planes.distances()))?;
            write_plane(&mut writer, "TSDF", "weight", &floats_to_bytes(planes.weights()))?;
        }
        finish(&mut writer, &self.poses, &self.unknown_chunks)?;
        Ok(writer)
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries = Vec::new();
        if let Some(grid) = &self.grid {
            entries.push(Entry::OccupancyGrid {
                cell: LOG_ODDS.into(),
                chunk: "GRID".into(),
                place: Place::of(grid.store().grid()),
                model: Model::of(grid.model()),
            });
        }
        if let Some(tree) = &self.tree {
            let root = tree.store().grid();
            entries.push(Entry::Quadtree {
                cell: LOG_ODDS.into(),
                chunk: "TREE".into(),
                origin: root.lattice.origin,
                resolution: root.lattice.resolution,
                depth: tree.store().depth(),
                model: Model::of(tree.model()),
            });
        }
        if let Some(tsdf) = &self.tsdf {
            let config = tsdf.config();
            entries.push(Entry::Tsdf {
                cell: SIGNED_DISTANCE.into(),
                chunk: "TSDF".into(),
                place: Place::of(tsdf.grid()),
                truncation: config.truncation,
                w_max: config.w_max.is_finite().then_some(config.w_max),
                carve_weight: config.carve_weight,
                sweep: sweep_word(config.beams).into(),
                weights: weights_word(config.weights).into(),
            });
        }
        entries
    }
}
