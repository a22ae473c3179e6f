//! Reading a `map.portolan` of space.

use std::path::Path;

use portolan::cell::{Cell, Color, ColorBrick, DistanceBrick, LogOdds8, LogOddsValue, Planes, TsdfRule};
use portolan::geom::{BlockKey, Lattice, block_cells};
use portolan::store::Bricks;
use serde_json::Value;

use super::super::reading::{AGAIN, MEMORY, Reading, floats};
use super::super::weights_of;
use super::entry::{Entry, Place, cell_of};
use super::{ColorBricks, KEY_BYTES, OccupancyBricks, SpaceMapFile, TsdfBricks};
use crate::error::shown;
use crate::{Container, IoError};

/// What a brick takes beside its planes: its slot, its place in the hash table, the planes' counters (bytes).
const BRICK_OVERHEAD: u64 = 96;
/// Keys beyond this would leave the range of cell indices.
const LARGEST_KEY: i32 = 1 << 27;

impl SpaceMapFile {
    /// Reads a file whose maps need at most 4 GiB.
    ///
    /// # Errors
    /// As [`SpaceMapFile::read_within`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, IoError> {
        Self::read_within(path, MEMORY)
    }

    /// Reads a file whose maps need at most `memory` bytes.
    ///
    /// # Errors
    /// [`IoError::Binary`] where the container or a map in it is damaged, claims what cannot be, is not of space,
    /// or needs more memory; the claim is checked before memory is taken.
    pub fn read_within(path: impl AsRef<Path>, memory: u64) -> Result<Self, IoError> {
        let path = path.as_ref();
        Self::of_container(&Container::read(path)?, path, memory)
    }

    /// Reads a file that is in memory, under the name that errors shall give.
    ///
    /// # Errors
    /// As [`SpaceMapFile::read_within`].
    pub fn parse(bytes: Vec<u8>, name: &Path) -> Result<Self, IoError> {
        Self::of_container(&Container::parse(bytes, name)?, name, MEMORY)
    }

    pub(in super::super) fn of_container(
        container: &Container,
        path: &Path,
        memory: u64,
    ) -> Result<Self, IoError> {
        let mut reading = Reading::new(container, path, memory)?;
        let mut file = Self::default();
        for map in reading.maps(3)? {
            reading.space_map(map, &mut file)?;
        }
        file.poses = reading.poses()?;
        (file.header, file.unknown_chunks) = reading.finish()?;
        Ok(file)
    }
}

impl Reading<'_> {
    fn space_map(&mut self, map: Value, file: &mut SpaceMapFile) -> Result<(), IoError> {
        let kind = map["kind"].as_str().unwrap_or_default().to_owned();
        if cell_of(&kind).is_none_or(|cell| map["cell"] != cell) {
            file.unknown_maps.push(map);
            return Ok(());
        }
        let taken = match kind.as_str() {
            "occupancy-bricks" => file.occupancy.is_some(),
            "tsdf-bricks" => file.tsdf.is_some(),
            _ => file.colors.is_some(),
        };
        if taken {
            return Err(self.bad(format!("map {kind}"), "there twice", AGAIN));
        }
        match self.entry(&kind, map)? {
            Entry::Occupancy { chunk, place, model, more, .. } => {
                let (model, lattice) = (model.model(), self.place(&kind, &place)?);
                self.made(&kind, model.validate())?;
                let store = self.bricks(lattice, &chunk, [("occupancy", 1)], |[bytes]| {
                    let mut brick = <LogOdds8 as Cell>::Brick::unobserved(bytes.len());
                    for (i, &byte) in bytes.iter().enumerate() {
                        let cell = LogOdds8(byte as i8);
                        brick.set(i, (!cell.is_unobserved()).then_some(cell));
                    }
                    Some(brick)
                })?;
                file.occupancy = Some(OccupancyBricks { store, model, more });
            }
            Entry::Tsdf { chunk, place, truncation, w_max, carve_weight, weights, more, .. } => {
                let lattice = self.place(&kind, &place)?;
                let w_max = w_max.unwrap_or(f32::INFINITY);
                self.made(&kind, TsdfRule { truncation: truncation as f32, w_max }.validate())?;
                self.finite(&kind, "carve_weight", carve_weight, carve_weight >= 0.0)?;
                let weights = weights_of(&weights).ok_or_else(|| {
                    self.bad("the weights", shown(weights.as_bytes()), "use a newer program")
                })?;
                let planes = [("distance", 4), ("weight", 4)];
                let store = self.bricks(lattice, &chunk, planes, |[distance, weight]| {
                    DistanceBrick::from_parts(&floats(distance), &floats(weight))
                })?;
                file.tsdf = Some(TsdfBricks { store, truncation, w_max, carve_weight, weights, more });
            }
            Entry::Color { chunk, place, w_max, more, .. } => {
                let lattice = self.place(&kind, &place)?;
                self.finite(&kind, "w_max", w_max, w_max > 0.0)?;
                let store = self.bricks::<Color, 1>(lattice, &chunk, [("color", 8)], |[bytes]| {
                    let word = |b: &[u8], k: usize| u16::from_le_bytes([b[2 * k], b[2 * k + 1]]);
                    let words = bytes.chunks_exact(8).map(|b| std::array::from_fn(|k| word(b, k)));
                    Some(ColorBrick::from_words(&words.collect::<Vec<_>>()))
                })?;
                file.colors = Some(ColorBricks { store, w_max, more });
            }
        }
        Ok(())
    }

    fn place(&self, kind: &str, place: &Place) -> Result<Lattice<3>, IoError> {
        let r = place.resolution;
        if r > 0.0 && r.is_finite() {
            return self.lattice(place.origin, r);
        }
        self.made(kind, Err(format!("resolution is {r}: give metres, above zero")))
    }

    fn finite(&self, kind: &str, field: &str, value: f32, fits: bool) -> Result<(), IoError> {
        let fits = fits && value.is_finite();
        self.made(kind, if fits { Ok(()) } else { Err(format!("{field} is {value}")) })
    }

    /// The bricks of a chunk: keys, and one plane of so many bytes a cell per name.
    fn bricks<C: Cell, const N: usize>(
        &mut self,
        lattice: Lattice<3>,
        tag: &str,
        planes: [(&str, usize); N],
        brick: impl Fn([&[u8]; N]) -> Option<C::Brick>,
    ) -> Result<Bricks<C, 3>, IoError> {
        let keys = self.keys(tag)?;
        let lengths = planes.map(|(_, cell_bytes)| cell_bytes * block_cells::<3>());
        let mut parts = Vec::new();
        for ((name, _), length) in planes.iter().zip(lengths) {
            parts.push(self.parts_of_length(tag, name, (keys.len() * length) as u64)?);
        }
        let mut store = Bricks::new(lattice);
        let mut keys = keys.into_iter();
        for part in 0..parts[0].len() {
            let mut contents = Vec::with_capacity(N);
            for of_plane in &parts {
                let Some(&i) = of_plane.get(part) else { return Err(self.uneven(tag)) };
                contents.push(self.unpack(i)?);
            }
            let bricks = contents[0].len() / lengths[0];
            if contents.iter().zip(lengths).any(|(c, length)| c.len() != bricks * length) {
                return Err(self.uneven(tag));
            }
            for (i, key) in keys.by_ref().take(bricks).enumerate() {
                let of_brick = std::array::from_fn(|k| &contents[k][i * lengths[k]..][..lengths[k]]);
                let Some(brick) = brick(of_brick) else {
                    let field = format!("a cell of brick {:?} in chunk {}", key.0, shown(tag.as_bytes()));
                    return Err(self.bad(field, "not finite or negative", AGAIN));
                };
                self.made(tag, store.insert(key, brick))?;
            }
        }
        Ok(store)
    }

    fn uneven(&self, tag: &str) -> IoError {
        let advice = "every part of a plane holds whole bricks, and as many as that of the other planes";
        self.bad(format!("the parts of chunk {}", shown(tag.as_bytes())), "uneven", advice)
    }

    /// The keys of a chunk's bricks, in ascending order and within the range of cell indices.
    fn keys(&mut self, tag: &str) -> Result<Vec<BlockKey<3>>, IoError> {
        let field = format!("the length of chunk {} keys", shown(tag.as_bytes()));
        if self.parts(tag, "keys").is_empty() {
            return Err(self.bad(field, "missing", AGAIN));
        }
        let length = self.length(tag, "keys");
        if !length.is_multiple_of(KEY_BYTES as u64) {
            return Err(self.bad(field, format!("{length} bytes"), "give 12 bytes for each key"));
        }
        self.take(length / KEY_BYTES as u64 * BRICK_OVERHEAD)?;
        let bytes = self.plane(tag, "keys", length)?;
        let number = |b: &[u8], k: usize| i32::from_le_bytes(std::array::from_fn(|i| b[4 * k + i]));
        let keys: Vec<BlockKey<3>> =
            bytes.chunks_exact(KEY_BYTES).map(|b| BlockKey(std::array::from_fn(|k| number(b, k)))).collect();
        let held = |key: &BlockKey<3>| key.0.iter().all(|&k| (-LARGEST_KEY..LARGEST_KEY).contains(&k));
        let bad = (0..keys.len()).find(|&i| !held(&keys[i]) || i > 0 && keys[i - 1] >= keys[i]);
        match bad {
            Some(i) => {
                let field = format!("a key of chunk {}", shown(tag.as_bytes()));
                let advice = "keys ascend, the last index first, and lie within 2^27";
                Err(self.bad(field, format!("{:?}", keys[i].0), advice))
            }
            None => Ok(keys),
        }
    }
}
