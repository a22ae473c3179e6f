//! Reading a `map.portolan`.

use std::collections::HashMap;
use std::path::Path;

use portolan::cell::{DistancePlanes, LogOdds8};
use portolan::geom::{Grid, Pose};
use portolan::map::{OccupancyGrid, Quadtree, Tsdf, TsdfConfig};
use portolan::store::{Dense, Tree, TreeRecords};
use serde_json::{Map, Value};

use super::content::UnknownChunk;
use super::header::{Entry, LOG_ODDS, Place, SIGNED_DISTANCE};
use super::{MapFile, VERSION, part_name, sweep_of, weights_of};
use crate::error::shown;
use crate::{Container, IoError};

/// The longest header (bytes of JSON).
const LONGEST_HEADER: u64 = 64 << 20;
/// Memory that [`MapFile::read`] allows for the planes of all maps (bytes).
const MEMORY: u64 = 4 << 30;

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
    /// [`IoError::Binary`] where the container or a map in it is damaged, claims what cannot be, or needs more
    /// memory; the claim is checked before memory is taken.
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

    fn of_container(container: &Container, path: &Path, memory: u64) -> Result<Self, IoError> {
        let chunks = container.chunks();
        let places = chunks.iter().enumerate().map(|(i, c)| ((c.tag.as_str(), c.name.as_str()), i)).collect();
        let mut reading = Reading { container, path, memory, used: vec![false; chunks.len()], places };
        let (mut fields, maps) = reading.header()?;
        let mut file = Self::default();
        for map in maps {
            reading.map(map, &mut file)?;
        }
        file.poses = reading.poses()?;
        for (i, chunk) in container.chunks().iter().enumerate() {
            if !reading.used[i] {
                let content = reading.unpack(chunk.length, |c| c.unpack(chunk))?;
                let (tag, name) = (chunk.tag.clone(), chunk.name.clone());
                file.unknown_chunks.push(UnknownChunk { tag, name, content });
            }
        }
        fields.retain(|key, _| !["version", "dimension", "maps"].contains(&key.as_str()));
        file.header = serde_json::from_value(Value::Object(fields)).map_err(|e| {
            reading.bad("the header", shown(e.to_string().as_bytes()), "write the file again")
        })?;
        Ok(file)
    }
}

/// The state of reading a file.
struct Reading<'a> {
    container: &'a Container,
    path: &'a Path,
    /// What may still be taken (bytes).
    memory: u64,
    /// Which chunks were read.
    used: Vec<bool>,
    /// Where each chunk stands, by tag and name.
    places: HashMap<(&'a str, &'a str), usize>,
}

impl Reading<'_> {
    /// An error about the header, which is the first chunk.
    fn bad(&self, field: impl Into<String>, value: impl Into<String>, advice: &str) -> IoError {
        IoError::binary(self.path, 32, field, value, advice)
    }

    /// Takes `length` bytes of the allowed memory, then unpacks.
    fn unpack<T>(
        &mut self,
        length: u64,
        unpack: impl FnOnce(&Container) -> Result<T, IoError>,
    ) -> Result<T, IoError> {
        match self.memory.checked_sub(length) {
            Some(left) => self.memory = left,
            None => {
                let advice = format!("only {} bytes of memory are left for it: allow more", self.memory);
                return Err(self.bad("a length of map data", length.to_string(), &advice));
            }
        }
        unpack(self.container)
    }

    fn header(&mut self) -> Result<(Map<String, Value>, Vec<Value>), IoError> {
        let Some(at) = self.container.chunks().iter().position(|c| c.tag == "HEAD" && c.name.is_empty())
        else {
            return Err(self.bad("chunk HEAD", "missing", "give a map.portolan that `map` wrote"));
        };
        let chunk = &self.container.chunks()[at];
        if chunk.length > LONGEST_HEADER {
            return Err(self.bad("the header length", chunk.length.to_string(), "write the file again"));
        }
        self.used[at] = true;
        let bytes = self.unpack(chunk.length, |c| c.unpack(chunk))?;
        let header: Value = serde_json::from_slice(&bytes)
            .map_err(|e| self.bad("the header", shown(e.to_string().as_bytes()), "write the file again"))?;
        let Value::Object(mut header) = header else {
            return Err(self.bad("the header", "no object", "write the file again"));
        };
        if header.get("version").and_then(Value::as_u64) != Some(VERSION) {
            let value = header.get("version").map_or("missing".into(), Value::to_string);
            return Err(self.bad(
                "the version of the header",
                value,
                "this program knows 1; use a newer one",
            ));
        }
        if header.get("dimension").and_then(Value::as_u64) != Some(2) {
            let value = header.get("dimension").map_or("missing".into(), Value::to_string);
            return Err(self.bad("the dimension", value, "this program reads maps of the plane (2)"));
        }
        match header.remove("maps") {
            Some(Value::Array(maps)) => Ok((header, maps)),
            _ => Err(self.bad("the list of maps", "missing", "write the file again")),
        }
    }

    fn map(&mut self, map: Value, file: &mut MapFile) -> Result<(), IoError> {
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
            return Err(self.bad(format!("map {kind}"), "there twice", "write the file again"));
        }
        let entry = serde_json::from_value(map).map_err(|e| {
            self.bad(format!("map {kind}"), shown(e.to_string().as_bytes()), "write the file again")
        })?;
        match entry {
            Entry::OccupancyGrid { chunk, place, model, .. } => {
                let grid = self.grid_of(&place)?;
                let plane = self.plane(&chunk, "occupancy", grid.len() as u64)?;
                let cells = plane.into_iter().map(|b| LogOdds8(b as i8)).collect();
                let store = self.dense(&kind, Dense::from_planes(grid, cells))?;
                let map = OccupancyGrid::from_store(store, model.model());
                file.grid = Some(self.made(&kind, map)?);
            }
            Entry::Quadtree { chunk, origin, resolution, depth, model, .. } => {
                self.check_place(origin, resolution)?;
                let length = self.parts(&chunk, "occupancy").map(|i| self.container.chunks()[i].length).sum();
                let content = self.plane(&chunk, "occupancy", length)?;
                let Some((&root, rest)) = content.split_first() else {
                    return Err(self.bad(format!("map {kind}"), "empty", "write the file again"));
                };
                let (masks, values) = rest.split_at(rest.len() / 5);
                let records = TreeRecords {
                    root_value: LogOdds8(root as i8),
                    masks: masks.to_vec(),
                    values: values.iter().map(|&b| LogOdds8(b as i8)).collect(),
                };
                let tree = Tree::from_records(origin, resolution, depth, &records);
                let tree = self.made(&kind, tree)?;
                file.tree = Some(self.made(&kind, Quadtree::from_tree(tree, model.model()))?);
            }
            Entry::Tsdf { chunk, place, truncation, w_max, carve_weight, sweep, weights, .. } => {
                let grid = self.grid_of(&place)?;
                let bytes = 4 * grid.len() as u64;
                let distance = floats(&self.plane(&chunk, "distance", bytes)?);
                let weight = floats(&self.plane(&chunk, "weight", bytes)?);
                let planes = DistancePlanes::from_parts(distance, weight).ok_or_else(|| {
                    self.bad("a distance or weight", "not finite or negative", "write the file again")
                })?;
                let word = |field: &str, value: &str| {
                    self.bad(field, shown(value.as_bytes()), "use a newer program")
                };
                let config = TsdfConfig {
                    truncation,
                    w_max: w_max.unwrap_or(f32::INFINITY),
                    carve_weight,
                    sweep: sweep_of(&sweep).ok_or_else(|| word("the sweep", &sweep))?,
                    weights: weights_of(&weights).ok_or_else(|| word("the weights", &weights))?,
                    ..TsdfConfig::default()
                };
                let store = self.dense(&kind, Dense::from_planes(grid, planes))?;
                file.tsdf = Some(self.made(&kind, Tsdf::from_store(store, config))?);
            }
        }
        Ok(())
    }

    fn made<T>(&self, kind: &str, map: Result<T, impl std::fmt::Display>) -> Result<T, IoError> {
        map.map_err(|e| {
            self.bad(format!("map {kind}"), format!("not possible ({e})"), "write the file again")
        })
    }

    fn dense<T>(&self, kind: &str, store: Option<T>) -> Result<T, IoError> {
        store.ok_or_else(|| {
            self.bad(format!("map {kind}"), "not as long as its shape", "write the file again")
        })
    }

    /// The grid of a dense map, with a number of cells that fits the file's limits.
    fn grid_of(&self, place: &Place) -> Result<Grid<2>, IoError> {
        let cells = place.shape.iter().try_fold(1u64, |n, &s| n.checked_mul(s));
        let sane = cells.is_some_and(|n| (1..=1 << 31).contains(&n));
        if !sane {
            let advice = "a dense map has from 1 to 2^31 cells";
            return Err(self.bad("the shape", format!("{:?}", place.shape), advice));
        }
        self.check_place(place.origin, place.resolution)?;
        Ok(Grid::new(place.origin, place.resolution, place.shape.map(|s| s as usize)))
    }

    /// Refuses an origin whose cell index is no whole number any more.
    fn check_place(&self, origin: [f64; 2], resolution: f64) -> Result<(), IoError> {
        const LARGEST_INDEX: f64 = (1u64 << 45) as f64;
        // A resolution that is none is refused, with its own words, by the map.
        if !(resolution > 0.0) || origin.iter().all(|v| (v / resolution).abs() < LARGEST_INDEX) {
            return Ok(());
        }
        let advice = "a map lies within 2^45 cells of zero";
        Err(self.bad("the origin", format!("{origin:?} at {resolution} m"), advice))
    }

    /// The chunks of a plane, in order.
    fn parts(&self, tag: &str, name: &str) -> impl Iterator<Item = usize> + '_ {
        let (tag, name) = (tag.to_owned(), name.to_owned());
        (0..).map_while(move |part| {
            let name = part_name(&name, part);
            self.places.get(&(tag.as_str(), name.as_str())).copied()
        })
    }

    fn plane(&mut self, tag: &str, name: &str, length: u64) -> Result<Vec<u8>, IoError> {
        let parts: Vec<usize> = self.parts(tag, name).collect();
        let there = parts.iter().map(|&i| self.container.chunks()[i].length).sum::<u64>();
        if parts.is_empty() || there != length {
            let field = format!("the length of chunk {} {name}", shown(tag.as_bytes()));
            let advice = format!("the header announces {length} bytes: write the file again");
            return Err(self.bad(field, there.to_string(), &advice));
        }
        let mut plane = Vec::new();
        for i in parts {
            self.used[i] = true;
            let chunk = &self.container.chunks()[i];
            let part = self.unpack(chunk.length, |c| c.unpack(chunk))?;
            if plane.is_empty() {
                plane = part;
            } else {
                plane.extend(part);
            }
        }
        Ok(plane)
    }

    fn poses(&mut self) -> Result<Vec<Pose<2>>, IoError> {
        if self.parts("POSES", "sensor").next().is_none() {
            return Ok(Vec::new());
        }
        let length = self.parts("POSES", "sensor").map(|i| self.container.chunks()[i].length).sum();
        let bytes = self.plane("POSES", "sensor", length)?;
        const POSE: usize = 6 * size_of::<f64>();
        if bytes.len() % POSE != 0 {
            let advice = "give 48 bytes for each pose";
            return Err(self.bad("the length of chunk POSES sensor", bytes.len().to_string(), advice));
        }
        let number = |bytes: &[u8], i: usize| f64::from_le_bytes(std::array::from_fn(|k| bytes[8 * i + k]));
        let poses: Vec<_> = bytes
            .chunks_exact(POSE)
            .map(|b| Pose {
                rotation: [[number(b, 0), number(b, 1)], [number(b, 2), number(b, 3)]],
                translation: [number(b, 4), number(b, 5)],
            })
            .collect();
        match poses.iter().position(|p| !p.is_rigid()) {
            Some(i) => Err(self.bad(format!("pose {i}"), "not rigid", "write the file again")),
            None => Ok(poses),
        }
    }
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}
