//! Writing a `map.portolan`.

use std::path::Path;

use serde_json::{Value, json};

use super::header::{Entry, LOG_ODDS, Model, Place, SIGNED_DISTANCE};
use super::{MapFile, VERSION, part_name, sweep_word, weights_word};
use crate::{ContainerWriter, IoError};

/// A plane is cut into chunks of this many bytes.
const CHUNK: usize = 1 << 30;

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
        let mut writer = ContainerWriter::new();
        writer.chunk("HEAD", "", self.header_json()?.as_bytes())?;
        if let Some(grid) = &self.grid {
            let plane: Vec<u8> = grid.store().planes().iter().map(|v| v.0 as u8).collect();
            write_plane(&mut writer, "GRID", "occupancy", &plane)?;
        }
        if let Some(tree) = &self.tree {
            let records = tree.tree().records();
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
        if !self.poses.is_empty() {
            let numbers = self.poses.iter().flat_map(|p| {
                let [[a, b], [c, d]] = p.rotation;
                [a, b, c, d, p.translation[0], p.translation[1]]
            });
            let content: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
            write_plane(&mut writer, "POSES", "sensor", &content)?;
        }
        for chunk in &self.unknown_chunks {
            writer.chunk(&chunk.tag, &chunk.name, &chunk.content)?;
        }
        Ok(writer)
    }

    fn header_json(&self) -> Result<String, IoError> {
        let failed = |e: serde_json::Error| {
            IoError::unwritable("map.portolan".as_ref(), "the header", e.to_string(), "give finite numbers")
        };
        let mut maps = Vec::new();
        for entry in self.entries() {
            maps.push(serde_json::to_value(entry).map_err(failed)?);
        }
        maps.extend(self.unknown_maps.iter().cloned());
        let mut header = serde_json::to_value(&self.header).map_err(failed)?;
        header["version"] = json!(VERSION);
        header["dimension"] = json!(2);
        header["maps"] = Value::Array(maps);
        serde_json::to_string(&header).map_err(failed)
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
            let root = tree.tree().grid();
            entries.push(Entry::Quadtree {
                cell: LOG_ODDS.into(),
                chunk: "TREE".into(),
                origin: root.lattice.origin,
                resolution: root.lattice.resolution,
                depth: tree.tree().depth(),
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
                sweep: sweep_word(config.sweep).into(),
                weights: weights_word(config.weights).into(),
            });
        }
        entries
    }
}

fn floats_to_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn write_plane(writer: &mut ContainerWriter, tag: &str, name: &str, bytes: &[u8]) -> Result<(), IoError> {
    if bytes.is_empty() {
        return writer.chunk(tag, name, bytes);
    }
    bytes.chunks(CHUNK).enumerate().try_for_each(|(i, part)| writer.chunk(tag, &part_name(name, i), part))
}
