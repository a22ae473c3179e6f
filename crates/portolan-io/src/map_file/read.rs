//! Reading a `map.portolan`.

use std::path::Path;

use portolan::cell::{
    AttenuationRule, Cell, ColorBrick, DistanceBrick, DistancePlanes, HitLengthBrick, HitLengthPlanes,
    LENGTH_UNITS, LogOdds8, LogOddsValue, Planes, SignedDistance, TsdfRule,
};
use portolan::geom::Grid;
use portolan::map::{DenseTsdf, OccupancyGrid, OccupancyTree, TsdfConfig};
use portolan::store::{Dense, Tree, TreeRecords};
use serde_json::Value;

use super::header::Entry;
use super::kind::Kind;
use super::reading::{AGAIN, MEMORY, Reading};
use super::settings::{AttenuationSettings, ColorSettings, OccupancySettings, SWEEP, TsdfSettings};
use super::{AttenuationBricks, ColorBricks, MapFile, OccupancyBricks, TsdfBricks, sweep_of, weights_of};
use crate::error::shown;
use crate::{Container, Result};

/// The dimension of a `map.portolan`: which [`MapFile`] reads it.
///
/// # Errors
/// [`crate::IoError::Binary`] where the header is missing or damaged, or the dimension neither 2 nor 3.
pub fn map_dimension(container: &Container) -> Result<usize> {
    Reading::new(container, MEMORY)?.dimension()
}

impl<const D: usize> MapFile<D> {
    /// Reads a file whose maps need at most 4 GiB.
    ///
    /// # Errors
    /// As [`MapFile::from_container`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::read_within(path, MEMORY)
    }

    /// Reads a file whose maps need at most `memory` bytes.
    ///
    /// # Errors
    /// As [`MapFile::from_container`].
    pub fn read_within(path: impl AsRef<Path>, memory: u64) -> Result<Self> {
        Self::from_container(&Container::read(path)?, memory)
    }

    /// Reads a file in memory whose maps need at most 4 GiB; errors name it `name`.
    ///
    /// # Errors
    /// As [`MapFile::from_container`].
    pub fn parse(bytes: Vec<u8>, name: &Path) -> Result<Self> {
        Self::from_container(&Container::parse(bytes, name)?, MEMORY)
    }

    /// Reads maps that need at most `memory` bytes. [`Container::from_reader`] makes a container of any source.
    ///
    /// # Errors
    /// [`crate::IoError::Binary`] where the container or a map in it is damaged, claims what cannot be, has another
    /// dimension, or needs more memory; the claim is checked before memory is taken.
    pub fn from_container(container: &Container, memory: u64) -> Result<Self> {
        let mut reading = Reading::new(container, memory)?;
        let mut file = Self::default();
        let mut kinds = Vec::new();
        for map in reading.maps(D)? {
            match Kind::of::<D>(&map) {
                Some(kind) if kinds.contains(&kind) => {
                    return Err(reading.bad(format!("map {}", kind.names::<D>().map), "there twice", AGAIN));
                }
                Some(kind) => {
                    kinds.push(kind);
                    reading.map(kind, map, &mut file)?;
                }
                None => file.unknown_maps.push(map),
            }
        }
        let field = reading.field(super::ledger::FIELD);
        file.ledger = reading.ledger(field)?;
        file.poses = match &file.ledger {
            Some(ledger) => ledger.scans().iter().map(|(_, _, record)| record.world_from_sensor).collect(),
            None => reading.poses()?,
        };
        (file.header, file.unknown_chunks) = reading.finish()?;
        Ok(file)
    }
}

impl Reading<'_> {
    fn map<const D: usize>(&mut self, kind: Kind, map: Value, file: &mut MapFile<D>) -> Result<()> {
        let mut entry: Entry = self.typed(kind.names::<D>().map, map)?;
        let settings = Value::Object(std::mem::take(&mut entry.settings));
        let map = &*entry.map;
        match kind {
            Kind::Grid => {
                let settings: OccupancySettings = self.typed(map, settings)?;
                let store = self.dense_occupancy(&entry)?;
                file.grid = Some(self.possible(map, OccupancyGrid::from_store(store, settings.model))?);
            }
            Kind::Tree => {
                let settings: OccupancySettings = self.typed(map, settings)?;
                let store = self.tree(&entry)?;
                file.tree = Some(self.possible(map, OccupancyTree::from_store(store, settings.model))?);
            }
            Kind::Tsdf => {
                let settings: TsdfSettings = self.typed(map, settings)?;
                let weights = self.chosen(map, "weight model", &settings.weights, weights_of)?;
                let sweep = settings.more.get(SWEEP).and_then(Value::as_str).unwrap_or_default();
                let beams = self.chosen(map, SWEEP, sweep, sweep_of)?;
                let store = self.dense_distances(&entry)?;
                let TsdfSettings { truncation, w_max, carve_weight, .. } = settings;
                let w_max = w_max.unwrap_or(f32::INFINITY);
                let rest = TsdfConfig::default();
                let config = TsdfConfig { truncation, w_max, carve_weight, beams, weights, ..rest };
                file.tsdf = Some(self.possible(map, DenseTsdf::from_stores(store, None, config))?);
            }
            Kind::OccupancyBricks => {
                let OccupancySettings { model, more } = self.typed(map, settings)?;
                self.possible(map, model.validate())?;
                let store = self.bricks(&entry, [("occupancy", 1)], |[cells]| Some(log_odds_brick(cells)))?;
                file.occupancy_bricks = Some(OccupancyBricks { store, model, more });
            }
            Kind::TsdfBricks => {
                let settings: TsdfSettings = self.typed(map, settings)?;
                let weights = self.chosen(map, "weight model", &settings.weights, weights_of)?;
                let TsdfSettings { truncation, w_max, carve_weight, more, .. } = settings;
                let w_max = w_max.unwrap_or(f32::INFINITY);
                self.possible(map, TsdfRule { truncation: truncation as f32, w_max }.validate())?;
                self.finite(map, "carve_weight", carve_weight, carve_weight >= 0.0)?;
                let store = self.bricks(&entry, [("distance", 4), ("weight", 4)], |[distance, weight]| {
                    DistanceBrick::from_parts(&floats(distance), &floats(weight))
                })?;
                let tsdf = TsdfBricks { store, truncation, w_max, carve_weight, weights, more };
                file.tsdf_bricks = Some(tsdf);
            }
            Kind::ColorBricks => {
                let ColorSettings { w_max, more } = self.typed(map, settings)?;
                self.finite(map, "w_max", w_max, w_max > 0.0)?;
                let store = self.bricks(&entry, [("color", 8)], |[cells]| Some(color_brick(cells)))?;
                file.color_bricks = Some(ColorBricks { store, w_max, more });
            }
            Kind::Attenuation => {
                let AttenuationSettings { half_life, length_units, more } = self.typed(map, settings)?;
                self.possible(map, AttenuationRule { half_life }.validate())?;
                if length_units != LENGTH_UNITS {
                    let field = format!("the length_units of map {map}");
                    return Err(self.bad(field, length_units, format!("this program reads {LENGTH_UNITS}")));
                }
                let planes = [("hits", 4), ("length", 4), ("looks", 2)];
                let store = self.bricks(&entry, planes, |[hits, length, looks]| {
                    let planes = HitLengthPlanes::from_parts(counts(hits), counts(length), looks_of(looks));
                    planes.map(HitLengthBrick::of)
                })?;
                file.attenuation =
                    Some(AttenuationBricks { store, rule: AttenuationRule { half_life }, more });
            }
        }
        Ok(())
    }

    /// The setting that a word chooses.
    pub(super) fn chosen<T>(
        &self,
        map: &str,
        setting: &str,
        word: &str,
        of: impl Fn(&str) -> Option<T>,
    ) -> Result<T> {
        let field = || format!("the {setting} of map {map}");
        of(word).ok_or_else(|| self.bad(field(), shown(word), "use a newer program"))
    }

    fn finite(&self, map: &str, field: &str, value: f32, fits: bool) -> Result<()> {
        let fits = fits && value.is_finite();
        self.possible(map, if fits { Ok(()) } else { Err(format!("{field} is {value}")) })
    }

    /// The grid of a dense map, with a number of cells that fits the file's limits.
    fn grid<const D: usize>(&self, entry: &Entry) -> Result<Grid<D>> {
        let shape = entry.place.shape.as_deref().unwrap_or_default();
        let cells = shape.iter().try_fold(1u64, |n, &s| n.checked_mul(s));
        match <[u64; D]>::try_from(shape) {
            Ok(shape) if cells.is_some_and(|n| (1..=1 << 31).contains(&n)) => {
                Ok(Grid { lattice: self.lattice(entry)?, shape: shape.map(|s| s as usize) })
            }
            _ => {
                let advice = format!("give the cells along {D} axes, in all from 1 to 2^31");
                Err(self.bad("the shape", format!("{shape:?}"), advice))
            }
        }
    }

    fn dense_occupancy<const D: usize>(&mut self, entry: &Entry) -> Result<Dense<LogOdds8, D>> {
        let grid = self.grid(entry)?;
        let plane = self.plane(&entry.chunk, "occupancy", grid.len() as u64)?;
        self.as_long_as_its_shape(entry, Dense::from_planes(grid, log_odds(plane)))
    }

    fn dense_distances<const D: usize>(&mut self, entry: &Entry) -> Result<Dense<SignedDistance, D>> {
        let grid = self.grid(entry)?;
        let bytes = 4 * grid.len() as u64;
        let distance = floats(&self.plane(&entry.chunk, "distance", bytes)?);
        let weight = floats(&self.plane(&entry.chunk, "weight", bytes)?);
        let planes = DistancePlanes::from_parts(distance, weight)
            .ok_or_else(|| self.bad("a distance or weight", "not finite or negative", AGAIN))?;
        self.as_long_as_its_shape(entry, Dense::from_planes(grid, planes))
    }

    fn as_long_as_its_shape<T>(&self, entry: &Entry, store: Option<T>) -> Result<T> {
        store.ok_or_else(|| self.bad(format!("map {}", entry.map), "not as long as its shape", AGAIN))
    }

    fn tree<const D: usize>(&mut self, entry: &Entry) -> Result<Tree<LogOdds8, D>> {
        let lattice = self.lattice(entry)?;
        let length = self.length(&entry.chunk, "occupancy");
        let content = self.plane(&entry.chunk, "occupancy", length)?;
        let Some((&root, rest)) = content.split_first() else {
            return Err(self.bad(format!("map {}", entry.map), "empty", AGAIN));
        };
        // A record is a mask and a value for each child.
        let (masks, values) = rest.split_at(rest.len() / (1 + (1 << D)));
        let (root_value, masks) = (LogOdds8(root as i8), masks.to_vec());
        let records = TreeRecords { root_value, masks, values: log_odds(values.to_vec()) };
        let depth = entry.place.depth.unwrap_or(0);
        self.possible(&entry.map, Tree::from_records(lattice.origin, lattice.resolution, depth, &records))
    }
}

fn log_odds_brick(bytes: &[u8]) -> <LogOdds8 as Cell>::Brick {
    let mut brick = <LogOdds8 as Cell>::Brick::unobserved(bytes.len());
    for (i, &byte) in bytes.iter().enumerate() {
        let cell = LogOdds8(byte as i8);
        brick.set(i, (!cell.is_unobserved()).then_some(cell));
    }
    brick
}

fn color_brick(bytes: &[u8]) -> ColorBrick {
    let word = |b: &[u8], k: usize| u16::from_le_bytes([b[2 * k], b[2 * k + 1]]);
    let words = bytes.chunks_exact(8).map(|b| std::array::from_fn(|k| word(b, k)));
    ColorBrick::from_words(&words.collect::<Vec<_>>())
}

/// The same bytes as cells, in the same memory.
fn log_odds(bytes: Vec<u8>) -> Vec<LogOdds8> {
    bytes.into_iter().map(|b| LogOdds8(b as i8)).collect()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn counts(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn looks_of(bytes: &[u8]) -> Vec<u16> {
    bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
}
