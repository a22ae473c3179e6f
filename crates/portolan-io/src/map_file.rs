//! `map.portolan`: the maps of a run in one lossless file.
//!
//! A [`Container`] with these chunks; further kinds of maps come as further chunks:
//!
//! | tag | name | content, little-endian |
//! |---|---|---|
//! | `HEAD` | | JSON: version, dimension, one entry per map (kind, kind of its cells, where its chunks are, place, settings), and what the writer says of itself (log, settings, statistics) |
//! | `GRID` | `occupancy` | i8 log odds, x fastest, -128 never observed |
//! | `TREE` | `occupancy` | i8 value of the root; per inner record, depth first, a mask of children; then `2^D` i8 values per record |
//! | `TSDF` | `distance`, `weight` | f32 each, x fastest; weight 0: never observed |
//! | `POSES` | `sensor` | per scan that was fused: f64 rows of the rotation, then the translation (`world_from_sensor`) |
//!
//! Planes of more than a gigabyte go on in chunks of the same name with `.1`, `.2`, .. behind it. Maps of unknown
//! kinds, unknown chunks and unknown fields of the header are kept when a file is read and written again.

use std::path::Path;

use portolan::cell::{DistancePlanes, LogOdds8, OccupancyModel};
use portolan::geom::{Grid, Pose};
use portolan::map::{OccupancyGrid, Quadtree, SweepKind, Tsdf, TsdfConfig};
use portolan::store::{Dense, Tree, TreeRecords};
use portolan::sweep::WeightModel;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::error::shown;
use crate::{Container, ContainerWriter, IoError};

const VERSION: u64 = 1;
/// The longest header (bytes of JSON).
const LONGEST_HEADER: u64 = 64 << 20;
/// A plane is cut into chunks of this many bytes.
const CHUNK: usize = 1 << 30;
/// Memory that [`MapFile::read`] allows for the planes of all maps (bytes).
const MEMORY: u64 = 4 << 30;

/// What the writer of a map says about it, in its own words: nothing here is needed to read the maps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapHeader {
    /// Names of the logs that were fused, in order.
    #[serde(default)]
    pub logs: Vec<String>,
    /// Scans that were fused.
    #[serde(default)]
    pub scans: u64,
    /// Every so many-th scan was left out of fusion, for evaluation.
    #[serde(default)]
    pub hold_out: Option<u64>,
    /// Only every so many-th scan of the log was looked at.
    #[serde(default)]
    pub every: Option<u64>,
    /// How the maps were made.
    #[serde(default)]
    pub settings: Map<String, Value>,
    /// Counts of beams and scans.
    #[serde(default)]
    pub statistics: Map<String, Value>,
    /// Everything else.
    #[serde(flatten)]
    pub more: Map<String, Value>,
}

/// The content of a `map.portolan`.
#[derive(Clone, Debug, Default)]
pub struct MapFile {
    /// What the writer says about it.
    pub header: MapHeader,
    /// The occupancy grid.
    pub grid: Option<OccupancyGrid<2>>,
    /// The quadtree.
    pub tree: Option<Quadtree>,
    /// The truncated signed distance field.
    pub tsdf: Option<Tsdf<2>>,
    /// Poses of the sensor at the scans that were fused, `world_from_sensor`.
    pub poses: Vec<Pose<2>>,
    unknown_maps: Vec<Value>,
    unknown_chunks: Vec<UnknownChunk>,
}

#[derive(Clone, Debug, PartialEq)]
struct UnknownChunk {
    tag: String,
    name: String,
    content: Vec<u8>,
}

/// Place and shape of a dense map.
#[derive(Serialize, Deserialize)]
struct Place {
    origin: [f64; 2],
    resolution: f64,
    shape: [u64; 2],
}

#[derive(Serialize, Deserialize)]
struct Model {
    p_hit: f64,
    p_miss: f64,
    p_min: f64,
    p_max: f64,
    p_prior: f64,
    wall_depth: Option<f64>,
}

/// The maps that this program knows, as the header describes them.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum Entry {
    OccupancyGrid {
        cell: String,
        chunk: String,
        #[serde(flatten)]
        place: Place,
        model: Model,
    },
    Quadtree {
        cell: String,
        chunk: String,
        origin: [f64; 2],
        resolution: f64,
        depth: u32,
        model: Model,
    },
    Tsdf {
        cell: String,
        chunk: String,
        #[serde(flatten)]
        place: Place,
        truncation: f64,
        /// `null`: never forget.
        w_max: Option<f32>,
        sweep: String,
        weights: String,
    },
}

const LOG_ODDS: &str = "log-odds-i8";
const SIGNED_DISTANCE: &str = "signed-distance-f32";

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
        let mut reading = Reading { container, path, memory, used: vec![false; container.chunks().len()] };
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
                sweep: sweep_word(config.sweep).into(),
                weights: weights_word(config.weights).into(),
            });
        }
        entries
    }
}

/// The word for a sweep in files and on the command line.
pub fn sweep_word(sweep: SweepKind) -> &'static str {
    match sweep {
        SweepKind::CellCentre => "cell-centre",
        SweepKind::March => "march",
    }
}

/// The sweep of a word.
pub fn sweep_of(word: &str) -> Option<SweepKind> {
    [SweepKind::CellCentre, SweepKind::March].into_iter().find(|&s| sweep_word(s) == word)
}

/// The word for a weight model in files and on the command line.
pub fn weights_word(weights: WeightModel) -> &'static str {
    match weights {
        WeightModel::Constant => "constant",
        WeightModel::InverseSquare => "range",
        WeightModel::CosIncidence => "incidence",
        WeightModel::InverseSquareCosIncidence => "range-incidence",
    }
}

/// The weight model of a word.
pub fn weights_of(word: &str) -> Option<WeightModel> {
    use WeightModel::*;
    let all = [Constant, InverseSquare, CosIncidence, InverseSquareCosIncidence];
    all.into_iter().find(|&w| weights_word(w) == word)
}

impl Place {
    fn of(grid: &Grid<2>) -> Self {
        let Grid { lattice, shape } = grid;
        Self { origin: lattice.origin, resolution: lattice.resolution, shape: shape.map(|s| s as u64) }
    }
}

impl Model {
    fn of(model: &OccupancyModel) -> Self {
        let OccupancyModel { p_hit, p_miss, p_min, p_max, p_prior, wall_depth } = *model;
        Self { p_hit, p_miss, p_min, p_max, p_prior, wall_depth }
    }

    fn model(&self) -> OccupancyModel {
        let Self { p_hit, p_miss, p_min, p_max, p_prior, wall_depth } = *self;
        OccupancyModel { p_hit, p_miss, p_min, p_max, p_prior, wall_depth }
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

fn part_name(name: &str, part: usize) -> String {
    if part == 0 { name.to_owned() } else { format!("{name}.{part}") }
}

/// The state of reading a file.
struct Reading<'a> {
    container: &'a Container,
    path: &'a Path,
    /// What may still be taken (bytes).
    memory: u64,
    /// Which chunks were read.
    used: Vec<bool>,
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
            Entry::Tsdf { chunk, place, truncation, w_max, sweep, weights, .. } => {
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
        Ok(Grid::new(place.origin, place.resolution, place.shape.map(|s| s as usize)))
    }

    /// The chunks of a plane, in order.
    fn parts(&self, tag: &str, name: &str) -> impl Iterator<Item = usize> + '_ {
        let (tag, name) = (tag.to_owned(), name.to_owned());
        (0..).map_while(move |part| {
            let name = part_name(&name, part);
            self.container.chunks().iter().position(|c| c.tag == tag && c.name == name)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::bad_bytes;
    use portolan::map::MapRepr;
    use portolan::scan::{RangeLimits, Scan};

    fn full() -> MapFile {
        let grid = Grid::new([-2.0, -1.5], 0.1, [57, 43]);
        let mut file = MapFile {
            header: MapHeader {
                logs: vec!["a.log".into()],
                scans: 3,
                hold_out: Some(10),
                more: [("studio".to_owned(), json!({"colour": 0.1}))].into_iter().collect(),
                ..Default::default()
            },
            grid: Some(OccupancyGrid::new(grid, OccupancyModel::default()).unwrap()),
            tree: Some(Quadtree::covering(&grid, OccupancyModel::default()).unwrap()),
            tsdf: Some(
                Tsdf::new(TsdfConfig { truncation: 0.3, ..Default::default() }.with_grid(&grid)).unwrap(),
            ),
            ..Default::default()
        };
        let bearings: Vec<f64> = (0..180).map(|i| f64::from(i) * 0.0349).collect();
        let ranges: Vec<f64> = bearings.iter().map(|b| 1.0 + 0.4 * (3.0 * b).sin()).collect();
        let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
        for k in 0..3 {
            let pose = Pose::<2>::new(0.1 * f64::from(k), 0.0, 0.3);
            file.grid.as_mut().unwrap().integrate_scan(&pose, &scan);
            file.tree.as_mut().unwrap().integrate_scan(&pose, &scan);
            file.tsdf.as_mut().unwrap().integrate_scan(&pose, &scan);
            file.poses.push(pose);
        }
        file.unknown_maps.push(json!({"kind": "wavelets", "cell": "i16", "chunk": "WAVE"}));
        let content = vec![1, 2, 3];
        file.unknown_chunks.push(UnknownChunk { tag: "WAVE".into(), name: "x".into(), content });
        file
    }

    #[test]
    fn saved_again_the_bytes_are_the_same() {
        let file = full();
        let bytes = file.to_bytes().unwrap();
        let back = MapFile::parse(bytes.clone(), "m".as_ref()).unwrap();
        assert_eq!(back.to_bytes().unwrap(), bytes);
        assert_eq!(back.header, file.header);
        assert_eq!(back.poses, file.poses);
        assert_eq!(back.grid.unwrap().store(), file.grid.unwrap().store());
        assert_eq!(back.tsdf.as_ref().unwrap().store(), file.tsdf.as_ref().unwrap().store());
        assert_eq!(back.tsdf.unwrap().config(), file.tsdf.unwrap().config());
        assert_eq!(back.tree.unwrap().tree().records(), file.tree.unwrap().tree().records());
        let empty = MapFile::default().to_bytes().unwrap();
        assert_eq!(MapFile::parse(empty.clone(), "m".as_ref()).unwrap().to_bytes().unwrap(), empty);
    }

    #[test]
    fn never_forgetting_survives() {
        let config = TsdfConfig { cells: [4, 4], w_max: f32::INFINITY, ..Default::default() };
        let file = MapFile { tsdf: Some(Tsdf::new(config).unwrap()), ..Default::default() };
        let back = MapFile::parse(file.to_bytes().unwrap(), "m".as_ref()).unwrap();
        assert_eq!(back.tsdf.unwrap().config(), &config);
    }

    /// The file with another header and the same other chunks.
    fn with_header(edit: impl FnOnce(&mut Value)) -> String {
        let container = Container::parse(full().to_bytes().unwrap(), "m".as_ref()).unwrap();
        let mut header: Value = serde_json::from_slice(&container.get("HEAD", "").unwrap().unwrap()).unwrap();
        edit(&mut header);
        let mut writer = container.writer(|c| c.tag != "HEAD").unwrap();
        writer.chunk("HEAD", "", header.to_string().as_bytes()).unwrap();
        match MapFile::parse(writer.to_bytes(), "m".as_ref()) {
            Ok(_) => "read".to_owned(),
            Err(e) => e.to_string(),
        }
    }

    #[test]
    fn claims_are_checked_before_memory_is_taken() {
        assert_eq!(with_header(|_| {}), "read");
        for (part, edit) in [
            ("the shape is [1152921504606846976, 43]", ("/maps/0/shape/0", json!(1u64 << 60))),
            ("the shape is [0, 43]", ("/maps/2/shape/0", json!(0))),
            ("the length of chunk \"GRID\" occupancy is 2451", ("/maps/0/shape/0", json!(58))),
            ("the length of chunk \"HOLE\" occupancy is 0", ("/maps/0/chunk", json!("HOLE"))),
            ("map quadtree is not possible (tree depth 60", ("/maps/1/depth", json!(60))),
            ("map quadtree is not possible", ("/maps/1/depth", json!(4))),
            ("map tsdf is not possible (truncation", ("/maps/2/truncation", json!(-1))),
            ("map tsdf is not possible (resolution", ("/maps/2/resolution", json!(0))),
            ("the sweep is \"zigzag\"", ("/maps/2/sweep", json!("zigzag"))),
            ("map occupancy-grid is not possible", ("/maps/0/model/p_hit", json!(2))),
            ("the dimension is 3", ("/dimension", json!(3))),
            ("the version of the header is 2", ("/version", json!(2))),
            ("the list of maps is missing", ("/maps", json!(7))),
            ("the header is", ("/logs", json!(7))),
        ] {
            let error = with_header(|header| *header.pointer_mut(edit.0).unwrap() = edit.1);
            assert!(error.contains(part) && !error.contains('\n'), "{error}");
        }
        let error = with_header(|header| header["maps"][1] = header["maps"][0].clone());
        assert!(error.contains("there twice"), "{error}");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m");
        full().write(&path).unwrap();
        let error = MapFile::read_within(&path, 3000).unwrap_err().to_string();
        assert!(error.contains("a length of map data") && error.contains("allow more"), "{error}");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let good = full().to_bytes().unwrap();
        for bytes in bad_bytes(&good, 33, 400) {
            let _ = MapFile::parse(bytes, "m".as_ref());
        }
        // The checksums stop nearly all of these; a bad header or tree behind good ones must be stopped, too.
        let container = Container::parse(good, "m".as_ref()).unwrap();
        for tag in ["HEAD", "TREE", "POSES"] {
            let chunk = container.tagged(tag).next().unwrap();
            let content = container.unpack(chunk).unwrap();
            for bytes in bad_bytes(&content, 34, 300) {
                let mut writer = container.writer(|c| c.tag != tag).unwrap();
                writer.chunk(tag, &chunk.name, &bytes).unwrap();
                let _ = MapFile::parse(writer.to_bytes(), "m".as_ref());
            }
        }
    }
}
