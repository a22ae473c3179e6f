//! Reading a `map.portolan` of the plane.

use std::path::Path;

use portolan::cell::{DistancePlanes, LogOdds8};
use portolan::geom::Grid;
use portolan::map::{OccupancyGrid, Quadtree, Tsdf2, TsdfConfig};
use portolan::store::{Dense, Tree, TreeRecords};
use serde_json::Value;

use super::header::{Entry, LOG_ODDS, Place, SIGNED_DISTANCE};
use super::reading::{AGAIN, MEMORY, Reading, floats};
use super::{MapFile, sweep_of, weights_of};
use crate::error::shown;
use crate::{Container, IoError};

impl MapFile {
    /// Reads a file whose maps need at most 4 GiB.
    ///
    /// # Errors
    /// As [`MapFile::read_within`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, IoError> {
        Self::read_within(path, MEMORY)
    }

    /// Reads a file whose maps need at most `memory` bytes.
    ///
    /// # Errors
    /// [`IoError::Binary`] where the container or a map in it is damaged, claims what cannot be, is not of the
    /// plane, or needs more memory; the claim is checked before memory is taken.
    pub fn read_within(path: impl AsRef<Path>, memory: u64) -> Result<Self, IoError> {
        let path = path.as_ref();
        Self::of_container(&Container::read(path)?, path, memory)
    }

    /// Reads a file that is in memory, under the name that errors shall give.
    ///
    /// # Errors
    /// As [`MapFile::read_within`].
    pub fn parse(bytes: Vec<u8>, name: &Path) -> Result<Self, IoError> {
        Self::of_container(&Container::parse(bytes, name)?, name, MEMORY)
    }

    pub(super) fn of_container(container: &Container, path: &Path, memory: u64) -> Result<Self, IoError> {
        let mut reading = Reading::new(container, path, memory)?;
        let mut file = Self::default();
        for map in reading.maps(2)? {
            reading.plane_map(map, &mut file)?;
        }
        file.poses = reading.poses()?;
        (file.header, file.unknown_chunks) = reading.finish()?;
        Ok(file)
    }
}

impl Reading<'_> {
    fn plane_map(&mut self, map: Value, file: &mut MapFile) -> Result<(), IoError> {
        let known = match (map["kind"].as_str(), map["cell"].as_str()) {
            (Some("occupancy-grid" | "quadtree"), cell) => cell == Some(LOG_ODDS),
            (Some("tsdf"), cell) => cell == Some(SIGNED_DISTANCE),
            _ => false,
        };
        if !known {
            file.unknown_maps.push(map);
            return Ok(());
        }
        let kind = map["kind"].as_str().unwrap_or_default().to_owned();
        let taken = match kind.as_str() {
            "occupancy-grid" => file.grid.is_some(),
            "quadtree" => file.tree.is_some(),
            _ => file.tsdf.is_some(),
        };
        if taken {
            return Err(self.bad(format!("map {kind}"), "there twice", AGAIN));
        }
        match self.entry(&kind, map)? {
            Entry::OccupancyGrid { chunk, place, model, .. } => {
                let grid = self.grid_of(&place)?;
                let plane = self.plane(&chunk, "occupancy", grid.len() as u64)?;
                let cells = plane.into_iter().map(|b| LogOdds8(b as i8)).collect();
                let store = self.dense(&kind, Dense::from_planes(grid, cells))?;
                let map = OccupancyGrid::from_store(store, model.model());
                file.grid = Some(self.made(&kind, map)?);
            }
            Entry::Quadtree { chunk, origin, resolution, depth, model, .. } => {
                self.lattice(origin, resolution)?;
                let content = self.plane(&chunk, "occupancy", self.length(&chunk, "occupancy"))?;
                let Some((&root, rest)) = content.split_first() else {
                    return Err(self.bad(format!("map {kind}"), "empty", AGAIN));
                };
                let (masks, values) = rest.split_at(rest.len() / 5);
                let records = TreeRecords {
                    root_value: LogOdds8(root as i8),
                    masks: masks.to_vec(),
                    values: values.iter().map(|&b| LogOdds8(b as i8)).collect(),
                };
                let tree = Tree::from_records(origin, resolution, depth, &records);
                let tree = self.made(&kind, tree)?;
                file.tree = Some(self.made(&kind, Quadtree::from_store(tree, model.model()))?);
            }
            Entry::Tsdf { chunk, place, truncation, w_max, carve_weight, sweep, weights, .. } => {
                let grid = self.grid_of(&place)?;
                let bytes = 4 * grid.len() as u64;
                let distance = floats(&self.plane(&chunk, "distance", bytes)?);
                let weight = floats(&self.plane(&chunk, "weight", bytes)?);
                let planes = DistancePlanes::from_parts(distance, weight)
                    .ok_or_else(|| self.bad("a distance or weight", "not finite or negative", AGAIN))?;
                let word = |field: &str, value: &str| {
                    self.bad(field, shown(value.as_bytes()), "use a newer program")
                };
                let config = TsdfConfig {
                    truncation,
                    w_max: w_max.unwrap_or(f32::INFINITY),
                    carve_weight,
                    beams: sweep_of(&sweep).ok_or_else(|| word("the sweep", &sweep))?,
                    weights: weights_of(&weights).ok_or_else(|| word("the weights", &weights))?,
                    ..TsdfConfig::default()
                };
                let store = self.dense(&kind, Dense::from_planes(grid, planes))?;
                file.tsdf = Some(self.made(&kind, Tsdf2::from_stores(store, None, config))?);
            }
        }
        Ok(())
    }

    fn dense<T>(&self, kind: &str, store: Option<T>) -> Result<T, IoError> {
        store.ok_or_else(|| self.bad(format!("map {kind}"), "not as long as its shape", AGAIN))
    }

    /// The grid of a dense map, with a number of cells that fits the file's limits.
    fn grid_of(&self, place: &Place) -> Result<Grid<2>, IoError> {
        let cells = place.shape.iter().try_fold(1u64, |n, &s| n.checked_mul(s));
        let sane = cells.is_some_and(|n| (1..=1 << 31).contains(&n));
        if !sane {
            let advice = "a dense map has from 1 to 2^31 cells";
            return Err(self.bad("the shape", format!("{:?}", place.shape), advice));
        }
        let lattice = self.lattice(place.origin, place.resolution)?;
        Ok(Grid { lattice, shape: place.shape.map(|s| s as usize) })
    }
}
