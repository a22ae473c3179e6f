//! Reading a `map.portolan`.

use std::path::Path;

use portolan::cell::{
    Cell, Color, ColorBrick, DistanceBrick, DistancePlanes, LogOdds8, LogOddsValue, Planes, SignedDistance,
    TsdfRule,
};
use portolan::geom::Grid;
use portolan::store::{Bricks, Dense, Tree, TreeRecords};
use portolan::sweep::WeightModel;
use serde_json::Value;

use super::bricks::Plane;
use super::header::{Entry, Place};
use super::kind::Kind;
use super::maps::{SWEEP, grid_of, tree_of, tsdf_of};
use super::reading::{AGAIN, MEMORY, Reading};
use super::settings::{ColorSettings, OccupancySettings, TsdfSettings};
use super::{ColorBricks, MapFile, OccupancyBricks, TsdfBricks, sweep_of, weights_of};
use crate::error::shown;
use crate::{Container, IoError};

const NEWER: &str = "use a newer program";

/// The dimension of a `map.portolan`: which [`MapFile`] reads it.
///
/// # Errors
/// [`IoError::Binary`] where the header is missing or damaged, or the dimension neither 2 nor 3.
pub fn map_dimension(container: &Container) -> Result<usize, IoError> {
    Reading::new(container, MEMORY)?.dimension()
}

impl<const D: usize> MapFile<D> {
    /// Reads a file whose maps need at most 4 GiB.
    ///
    /// # Errors
    /// As [`MapFile::from_container`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, IoError> {
        Self::read_within(path, MEMORY)
    }

    /// Reads a file whose maps need at most `memory` bytes.
    ///
    /// # Errors
    /// As [`MapFile::from_container`].
    pub fn read_within(path: impl AsRef<Path>, memory: u64) -> Result<Self, IoError> {
        Self::from_container(&Container::read(path)?, memory)
    }

    /// Reads a file in memory whose maps need at most 4 GiB; errors name it `name`.
    ///
    /// # Errors
    /// As [`MapFile::from_container`].
    pub fn parse(bytes: Vec<u8>, name: &Path) -> Result<Self, IoError> {
        Self::from_container(&Container::parse(bytes, name)?, MEMORY)
    }

    /// Reads maps that need at most `memory` bytes. [`Container::from_reader`] makes a container of any source.
    ///
    /// # Errors
    /// [`IoError::Binary`] where the container or a map in it is damaged, claims what cannot be, has another
    /// dimension, or needs more memory; the claim is checked before memory is taken.
    pub fn from_container(container: &Container, memory: u64) -> Result<Self, IoError> {
        let mut reading = Reading::new(container, memory)?;
        let mut file = Self::default();
        for map in reading.maps(D)? {
            reading.map(map, &mut file)?;
        }
        file.poses = reading.poses()?;
        (file.header, file.unknown_chunks) = reading.finish()?;
        Ok(file)
    }

    fn has(&self, kind: Kind) -> bool {
        match kind {
            Kind::Grid => self.grid.is_some(),
            Kind::Tree => self.tree.is_some(),
            Kind::Tsdf => self.tsdf.is_some(),
            Kind::OccupancyBricks => self.occupancy_bricks.is_some(),
            Kind::TsdfBricks => self.tsdf_bricks.is_some(),
            Kind::ColorBricks => self.color_bricks.is_some(),
        }
    }
}

impl Reading<'_> {
    fn map<const D: usize>(&mut self, map: Value, file: &mut MapFile<D>) -> Result<(), IoError> {
        let Some(kind) = Kind::of::<D>(&map) else {
            file.unknown_maps.push(map);
            return Ok(());
        };
        let word = kind.word::<D>();
        if file.has(kind) {
            return Err(self.bad(format!("map {word}"), "there twice", AGAIN));
        }
        let Entry { chunk, place, settings, .. } = self.typed(word, map)?;
        let settings = Value::Object(settings);
        match kind {
            Kind::Grid => {
                let OccupancySettings { model, .. } = self.typed(word, settings)?;
                let grid = self.grid(word, &place)?;
                let plane = self.plane(&chunk, "occupancy", grid.len() as u64)?;
                let store = self.dense(word, Dense::from_planes(grid, log_odds(&plane)))?;
                file.grid = Some(self.possible(word, grid_of(store, model))?);
            }
            Kind::Tree => {
                let OccupancySettings { model, .. } = self.typed(word, settings)?;
                let store = self.tree(word, &chunk, &place)?;
                file.tree = Some(self.possible(word, tree_of(store, model))?);
            }
            Kind::Tsdf => {
                let settings: TsdfSettings = self.typed(word, settings)?;
                let weights = self.weights(word, &settings)?;
                let sweep = settings.more.get(SWEEP).and_then(Value::as_str).unwrap_or_default();
                let Some(sweep) = sweep_of(sweep) else {
                    return Err(self.bad(format!("the sweep of map {word}"), shown(sweep.as_bytes()), NEWER));
                };
                let store = self.dense_distances(word, &chunk, &place)?;
                file.tsdf = Some(self.possible(word, tsdf_of(store, &settings, weights, sweep))?);
            }
            Kind::OccupancyBricks => {
                let OccupancySettings { model, more } = self.typed(word, settings)?;
                self.possible(word, model.validate())?;
                let store = self.occupancy_bricks(word, &chunk, &place)?;
                file.occupancy_bricks = Some(OccupancyBricks { store, model, more });
            }
            Kind::TsdfBricks => {
                let settings: TsdfSettings = self.typed(word, settings)?;
                let (weights, w_max) = (self.weights(word, &settings)?, settings.w_max());
                let TsdfSettings { truncation, carve_weight, more, .. } = settings;
                self.possible(word, TsdfRule { truncation: truncation as f32, w_max }.validate())?;
                self.finite(word, "carve_weight", carve_weight, carve_weight >= 0.0)?;
                let store = self.distance_bricks(word, &chunk, &place)?;
                file.tsdf_bricks = Some(TsdfBricks { store, truncation, w_max, carve_weight, weights, more });
            }
            Kind::ColorBricks => {
                let ColorSettings { w_max, more } = self.typed(word, settings)?;
                self.finite(word, "w_max", w_max, w_max > 0.0)?;
                let store = self.color_bricks(word, &chunk, &place)?;
                file.color_bricks = Some(ColorBricks { store, w_max, more });
            }
        }
        Ok(())
    }

    fn weights(&self, word: &str, settings: &TsdfSettings) -> Result<WeightModel, IoError> {
        let weights = &settings.weights;
        weights_of(weights).ok_or_else(|| {
            self.bad(format!("the weight model of map {word}"), shown(weights.as_bytes()), NEWER)
        })
    }

    fn finite(&self, word: &str, field: &str, value: f32, fits: bool) -> Result<(), IoError> {
        let fits = fits && value.is_finite();
        self.possible(word, if fits { Ok(()) } else { Err(format!("{field} is {value}")) })
    }

    fn dense<T>(&self, word: &str, store: Option<T>) -> Result<T, IoError> {
        store.ok_or_else(|| self.bad(format!("map {word}"), "not as long as its shape", AGAIN))
    }

    /// The grid of a dense map, with a number of cells that fits the file's limits.
    fn grid<const D: usize>(&self, word: &str, place: &Place) -> Result<Grid<D>, IoError> {
        let shape = place.shape.as_deref().unwrap_or_default();
        let cells = shape.iter().try_fold(1u64, |n, &s| n.checked_mul(s));
        let shape: Option<[u64; D]> =
            shape.try_into().ok().filter(|_| cells.is_some_and(|n| (1..=1 << 31).contains(&n)));
        let Some(shape) = shape else {
            let advice = format!("a dense map of dimension {D} has {D} numbers of cells, 2^31 cells at most");
            return Err(self.bad(
                "the shape",
                format!("{:?}", place.shape.as_deref().unwrap_or(&[])),
                &advice,
            ));
        };
        Ok(Grid { lattice: self.lattice(word, place)?, shape: shape.map(|s| s as usize) })
    }

    fn dense_distances<const D: usize>(
        &mut self,
        word: &str,
        tag: &str,
        place: &Place,
    ) -> Result<Dense<SignedDistance, D>, IoError> {
        let grid = self.grid(word, place)?;
        let bytes = 4 * grid.len() as u64;
        let distance = floats(&self.plane(tag, "distance", bytes)?);
        let weight = floats(&self.plane(tag, "weight", bytes)?);
        let planes = DistancePlanes::from_parts(distance, weight)
            .ok_or_else(|| self.bad("a distance or weight", "not finite or negative", AGAIN))?;
        self.dense(word, Dense::from_planes(grid, planes))
    }

    fn tree<const D: usize>(
        &mut self,
        word: &str,
        tag: &str,
        place: &Place,
    ) -> Result<Tree<LogOdds8, D>, IoError> {
        let lattice = self.lattice(word, place)?;
        let content = self.plane(tag, "occupancy", self.length(tag, "occupancy"))?;
        let Some((&root, rest)) = content.split_first() else {
            return Err(self.bad(format!("map {word}"), "empty", AGAIN));
        };
        // A record is a mask and a value for each child.
        let (masks, values) = rest.split_at(rest.len() / (1 + (1 << D)));
        let records =
            TreeRecords { root_value: LogOdds8(root as i8), masks: masks.to_vec(), values: log_odds(values) };
        let depth = place.depth.unwrap_or(0);
        self.possible(word, Tree::from_records(lattice.origin, lattice.resolution, depth, &records))
    }

    fn occupancy_bricks<const D: usize>(
        &mut self,
        word: &str,
        tag: &str,
        place: &Place,
    ) -> Result<Bricks<LogOdds8, D>, IoError> {
        let lattice = self.lattice(word, place)?;
        self.bricks(lattice, tag, [Plane { name: "occupancy", cell_bytes: 1 }], |[bytes]| {
            let mut brick = <LogOdds8 as Cell>::Brick::unobserved(bytes.len());
            for (i, &byte) in bytes.iter().enumerate() {
                let cell = LogOdds8(byte as i8);
                brick.set(i, (!cell.is_unobserved()).then_some(cell));
            }
            Some(brick)
        })
    }

    fn distance_bricks<const D: usize>(
        &mut self,
        word: &str,
        tag: &str,
        place: &Place,
    ) -> Result<Bricks<SignedDistance, D>, IoError> {
        let lattice = self.lattice(word, place)?;
        let planes = ["distance", "weight"].map(|name| Plane { name, cell_bytes: 4 });
        self.bricks(lattice, tag, planes, |[distance, weight]| {
            DistanceBrick::from_parts(&floats(distance), &floats(weight))
        })
    }

    fn color_bricks<const D: usize>(
        &mut self,
        word: &str,
        tag: &str,
        place: &Place,
    ) -> Result<Bricks<Color, D>, IoError> {
        let lattice = self.lattice(word, place)?;
        self.bricks(lattice, tag, [Plane { name: "color", cell_bytes: 8 }], |[bytes]| {
            let word = |b: &[u8], k: usize| u16::from_le_bytes([b[2 * k], b[2 * k + 1]]);
            let words = bytes.chunks_exact(8).map(|b| std::array::from_fn(|k| word(b, k)));
            Some(ColorBrick::from_words(&words.collect::<Vec<_>>()))
        })
    }
}

fn log_odds(bytes: &[u8]) -> Vec<LogOdds8> {
    bytes.iter().map(|&b| LogOdds8(b as i8)).collect()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}
