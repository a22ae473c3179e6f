//! The steps of reading a `map.portolan`: header, chunks, memory, poses.

use std::collections::HashMap;
use std::fmt::Display;
use std::path::Path;

use portolan::geom::{Lattice, Pose};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::header::Entry;
use super::{MapHeader, UnknownChunk, VERSION, part_name};
use crate::error::shown;
use crate::{Container, IoError, Result};

/// The longest header (bytes of JSON).
const LONGEST_HEADER: u64 = 64 << 20;
/// Memory that the planes of all maps may take by default (bytes).
pub(super) const MEMORY: u64 = 4 << 30;
/// The advice where a file contradicts itself.
pub(super) const AGAIN: &str = "write the file again";

/// The state of reading a file.
pub(super) struct Reading<'a> {
    container: &'a Container,
    path: &'a Path,
    /// What may still be taken (bytes).
    memory: u64,
    /// Which chunks were read.
    used: Vec<bool>,
    /// Where each chunk stands, by tag and name.
    places: HashMap<(&'a str, &'a str), usize>,
    /// The fields of the header that were not read yet.
    fields: Map<String, Value>,
}

impl<'a> Reading<'a> {
    /// Reads the header; `memory` is what all content may take (bytes).
    pub(super) fn new(container: &'a Container, memory: u64) -> Result<Self> {
        let (path, chunks) = (container.path(), container.chunks());
        let places = chunks.iter().enumerate().map(|(i, c)| ((c.tag.as_str(), c.name.as_str()), i)).collect();
        let used = vec![false; chunks.len()];
        let mut reading = Self { container, path, memory, used, places, fields: Map::new() };
        reading.fields = reading.header()?;
        Ok(reading)
    }

    /// The dimension that the header announces.
    pub(super) fn dimension(&self) -> Result<usize> {
        match self.fields.get("dimension").and_then(Value::as_u64) {
            Some(2) => Ok(2),
            Some(3) => Ok(3),
            _ => {
                let value = self.fields.get("dimension").map_or("missing".into(), Value::to_string);
                Err(self.bad("the dimension", value, "it must be 2 or 3"))
            }
        }
    }

    /// The entries of the maps of a file that must have this dimension.
    pub(super) fn maps(&mut self, dimension: usize) -> Result<Vec<Value>> {
        let found = self.dimension()?;
        if found != dimension {
            let advice = format!("give a {dimension}-D map");
            return Err(self.bad("the dimension", found, advice));
        }
        match self.fields.remove("maps") {
            Some(Value::Array(maps)) => Ok(maps),
            _ => Err(self.bad("the list of maps", "missing", AGAIN)),
        }
    }

    /// A field of the header, taken out of what is left of it.
    pub(super) fn field(&mut self, name: &str) -> Option<Value> {
        self.fields.remove(name)
    }

    /// What the writer noted, and the chunks that were not read.
    pub(super) fn finish(mut self) -> Result<(MapHeader, Vec<UnknownChunk>)> {
        let mut unknown = Vec::new();
        for (i, chunk) in self.container.chunks().iter().enumerate() {
            if !self.used[i] {
                let content = self.unpack(i)?;
                unknown.push(UnknownChunk { tag: chunk.tag.clone(), name: chunk.name.clone(), content });
            }
        }
        Ok((self.header_alone()?, unknown))
    }

    /// What the writer noted.
    pub(super) fn header_alone(&mut self) -> Result<MapHeader> {
        self.fields.retain(|key, _| !["version", "dimension", "maps"].contains(&key.as_str()));
        let fields = std::mem::take(&mut self.fields);
        let header = serde_json::from_value(Value::Object(fields));
        header.map_err(|e| self.bad("the header", shown(e.to_string()), AGAIN))
    }

    /// An error about the header, which is the first chunk.
    pub(super) fn bad(&self, field: impl Display, value: impl Display, advice: impl Display) -> IoError {
        IoError::binary(self.path, 32, field, value, advice)
    }

    /// A part of a map's entry in the header, typed.
    pub(super) fn typed<T: DeserializeOwned>(&self, map: &str, part: Value) -> Result<T> {
        serde_json::from_value(part).map_err(|e| self.bad(format!("map {map}"), shown(e.to_string()), AGAIN))
    }

    /// The result, or the error that the map is not possible.
    pub(super) fn possible<T, E: Display>(&self, map: &str, result: Result<T, E>) -> Result<T> {
        result.map_err(|e| self.bad(format!("map {map}"), format!("not possible ({e})"), AGAIN))
    }

    /// The lattice of a map, whose cell indices must be exact.
    pub(super) fn lattice<const D: usize>(&self, entry: &Entry) -> Result<Lattice<D>> {
        self.lattice_of(&entry.map, &entry.place.origin, entry.place.resolution)
    }

    /// The lattice with this origin and edge of a cell, whose cell indices must be exact.
    pub(super) fn lattice_of<const D: usize>(&self, map: &str, origin: &[f64], r: f64) -> Result<Lattice<D>> {
        const LARGEST_INDEX: f64 = (1u64 << 45) as f64;
        if !(r > 0.0 && r.is_finite()) {
            return self.possible(map, Err(format!("resolution is {r}: give metres, above zero")));
        }
        match <[f64; D]>::try_from(origin) {
            Ok(origin) if origin.iter().all(|v| (v / r).abs() < LARGEST_INDEX) => Ok(Lattice::new(origin, r)),
            _ => {
                let advice = format!("give {D} numbers within 2^45 cells of zero");
                Err(self.bad("the origin", format!("{origin:?} at {r} m"), advice))
            }
        }
    }

    /// Takes `bytes` of the allowed memory.
    pub(super) fn take(&mut self, bytes: u64) -> Result<()> {
        match self.memory.checked_sub(bytes) {
            Some(left) => self.memory = left,
            None => {
                let advice = format!("only {} bytes of memory are left for it: allow more", self.memory);
                return Err(self.bad("a length of map data", bytes, advice));
            }
        }
        Ok(())
    }

    /// The content of chunk `i`, out of the allowed memory.
    pub(super) fn unpack(&mut self, i: usize) -> Result<Vec<u8>> {
        let chunk = &self.container.chunks()[i];
        self.take(chunk.length)?;
        self.used[i] = true;
        self.container.unpack(chunk)
    }

    fn header(&mut self) -> Result<Map<String, Value>> {
        let Some(at) = self.container.chunks().iter().position(|c| c.tag == "HEAD" && c.name.is_empty())
        else {
            return Err(self.bad("chunk HEAD", "missing", "give a map.portolan that `map` wrote"));
        };
        let length = self.container.chunks()[at].length;
        if length > LONGEST_HEADER {
            return Err(self.bad("the header length", length.to_string(), AGAIN));
        }
        let bytes = self.unpack(at)?;
        let header: Value = serde_json::from_slice(&bytes)
            .map_err(|e| self.bad("the header", shown(e.to_string()), AGAIN))?;
        let Value::Object(header) = header else {
            return Err(self.bad("the header", "not a JSON object", AGAIN));
        };
        if header.get("version").and_then(Value::as_u64) != Some(VERSION) {
            let value = header.get("version").map_or("missing".into(), Value::to_string);
            let advice = "this program reads version 1; use a newer one";
            return Err(self.bad("the version of the header", value, advice));
        }
        Ok(header)
    }

    /// The chunks of a plane, in order.
    pub(super) fn parts(&self, tag: &str, name: &str) -> Vec<usize> {
        let part = |part| self.places.get(&(tag, part_name(name, part).as_str())).copied();
        (0..).map_while(part).collect()
    }

    /// Length of a plane (bytes), as the index announces it.
    pub(super) fn length(&self, tag: &str, name: &str) -> u64 {
        self.parts(tag, name).iter().map(|&i| self.container.chunks()[i].length).sum()
    }

    /// The chunks of a plane that must have `length` bytes, in order.
    pub(super) fn parts_of_length(&self, tag: &str, name: &str, length: u64) -> Result<Vec<usize>> {
        let (parts, there) = (self.parts(tag, name), self.length(tag, name));
        if parts.is_empty() || there != length {
            let field = format!("the length of chunk {} {name}", shown(tag));
            let advice = format!("the header announces {length} bytes: write the file again");
            return Err(self.bad(field, there, advice));
        }
        Ok(parts)
    }

    /// A plane of `length` bytes.
    pub(super) fn plane(&mut self, tag: &str, name: &str, length: u64) -> Result<Vec<u8>> {
        let mut plane = Vec::new();
        for i in self.parts_of_length(tag, name, length)? {
            let part = self.unpack(i)?;
            if plane.is_empty() {
                plane = part;
            } else {
                plane.extend(part);
            }
        }
        Ok(plane)
    }

    /// The poses of the sensor; empty where the file has no such chunk.
    pub(super) fn poses<const D: usize>(&mut self) -> Result<Vec<Pose<D>>> {
        if self.parts("POSES", "sensor").is_empty() {
            return Ok(Vec::new());
        }
        self.poses_of("POSES", self.length("POSES", "sensor"))
    }

    /// The poses in a plane of so many bytes.
    pub(super) fn poses_of<const D: usize>(&mut self, tag: &str, length: u64) -> Result<Vec<Pose<D>>> {
        let bytes = self.plane(tag, "sensor", length)?;
        let pose_bytes = (D * D + D) * size_of::<f64>();
        if bytes.len() % pose_bytes != 0 {
            let advice = format!("give {pose_bytes} bytes for each pose");
            return Err(self.bad(format!("the length of chunk {tag} sensor"), bytes.len(), advice));
        }
        let number = |bytes: &[u8], i: usize| f64::from_le_bytes(std::array::from_fn(|k| bytes[8 * i + k]));
        let poses: Vec<Pose<D>> = bytes
            .chunks_exact(pose_bytes)
            .map(|b| Pose {
                rotation: std::array::from_fn(|i| std::array::from_fn(|j| number(b, D * i + j))),
                translation: std::array::from_fn(|k| number(b, D * D + k)),
            })
            .collect();
        match poses.iter().position(|p| !p.is_rigid()) {
            Some(i) => Err(self.bad(format!("pose {i}"), "not rigid", AGAIN)),
            None => Ok(poses),
        }
    }
}
