//! What reading a `map.portolan` is made of, whatever the dimension.

use std::collections::HashMap;
use std::path::Path;

use portolan::geom::{Lattice, Pose};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::{MapHeader, UnknownChunk, VERSION, part_name};
use crate::error::shown;
use crate::{Container, IoError};

/// The longest header (bytes of JSON).
const LONGEST_HEADER: u64 = 64 << 20;
/// Memory that reading allows for the planes of all maps where nothing else is said (bytes).
pub(super) const MEMORY: u64 = 4 << 30;
/// What the advice is wherever the file contradicts itself.
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
    /// The header's fields, but for what is read already.
    fields: Map<String, Value>,
}

/// The dimension that the header of a file announces.
///
/// # Errors
/// [`IoError::Binary`] where there is no header that can be read.
pub(super) fn dimension(container: &Container, path: &Path) -> Result<u64, IoError> {
    let reading = Reading::new(container, path, MEMORY)?;
    reading.dimension().ok_or_else(|| reading.bad_dimension("a whole number, 2 or 3"))
}

impl<'a> Reading<'a> {
    /// Reads the header; `memory` is what all content may take (bytes).
    pub(super) fn new(container: &'a Container, path: &'a Path, memory: u64) -> Result<Self, IoError> {
        let chunks = container.chunks();
        let places = chunks.iter().enumerate().map(|(i, c)| ((c.tag.as_str(), c.name.as_str()), i)).collect();
        let used = vec![false; chunks.len()];
        let mut reading = Self { container, path, memory, used, places, fields: Map::new() };
        reading.fields = reading.header()?;
        Ok(reading)
    }

    /// The entries of the maps of a file of this dimension.
    pub(super) fn maps(&mut self, dimension: u64) -> Result<Vec<Value>, IoError> {
        if self.dimension() != Some(dimension) {
            return Err(self.bad_dimension(match dimension {
                2 => "a map of the plane (2) is asked for",
                _ => "a map of space (3) is asked for",
            }));
        }
        match self.fields.remove("maps") {
            Some(Value::Array(maps)) => Ok(maps),
            _ => Err(self.bad("the list of maps", "missing", AGAIN)),
        }
    }

    /// What the writer said, and the chunks that nobody asked for.
    pub(super) fn finish(mut self) -> Result<(MapHeader, Vec<UnknownChunk>), IoError> {
        let mut unknown = Vec::new();
        for (i, chunk) in self.container.chunks().iter().enumerate() {
            if !self.used[i] {
                let content = self.unpack(i)?;
                unknown.push(UnknownChunk { tag: chunk.tag.clone(), name: chunk.name.clone(), content });
            }
        }
        self.fields.retain(|key, _| !["version", "dimension", "maps"].contains(&key.as_str()));
        let fields = std::mem::take(&mut self.fields);
        let header = serde_json::from_value(Value::Object(fields));
        let header = header.map_err(|e| self.bad("the header", shown(e.to_string().as_bytes()), AGAIN))?;
        Ok((header, unknown))
    }

    fn dimension(&self) -> Option<u64> {
        self.fields.get("dimension").and_then(Value::as_u64)
    }

    fn bad_dimension(&self, advice: &str) -> IoError {
        let value = self.fields.get("dimension").map_or("missing".into(), Value::to_string);
        self.bad("the dimension", value, advice)
    }

    /// An error about the header, which is the first chunk.
    pub(super) fn bad(&self, field: impl Into<String>, value: impl Into<String>, advice: &str) -> IoError {
        IoError::binary(self.path, 32, field, value, advice)
    }

    /// A map's entry in the header, typed.
    pub(super) fn entry<T: DeserializeOwned>(&self, kind: &str, entry: Value) -> Result<T, IoError> {
        serde_json::from_value(entry)
            .map_err(|e| self.bad(format!("map {kind}"), shown(e.to_string().as_bytes()), AGAIN))
    }

    /// The map, or that it is not possible.
    pub(super) fn made<T, E: std::fmt::Display>(&self, kind: &str, map: Result<T, E>) -> Result<T, IoError> {
        map.map_err(|e| self.bad(format!("map {kind}"), format!("not possible ({e})"), AGAIN))
    }

    /// A lattice whose cell indices are whole numbers.
    pub(super) fn lattice<const D: usize>(
        &self,
        origin: [f64; D],
        resolution: f64,
    ) -> Result<Lattice<D>, IoError> {
        const LARGEST_INDEX: f64 = (1u64 << 45) as f64;
        // A resolution that is none is refused, with its own words, by the map.
        if !(resolution > 0.0) || origin.iter().all(|v| (v / resolution).abs() < LARGEST_INDEX) {
            return Ok(Lattice::new(origin, resolution));
        }
        let advice = "a map lies within 2^45 cells of zero";
        Err(self.bad("the origin", format!("{origin:?} at {resolution} m"), advice))
    }

    /// Takes `bytes` of the allowed memory.
    pub(super) fn take(&mut self, bytes: u64) -> Result<(), IoError> {
        match self.memory.checked_sub(bytes) {
            Some(left) => self.memory = left,
            None => {
                let advice = format!("only {} bytes of memory are left for it: allow more", self.memory);
                return Err(self.bad("a length of map data", bytes.to_string(), &advice));
            }
        }
        Ok(())
    }

    /// The content of chunk `i`, out of the allowed memory.
    pub(super) fn unpack(&mut self, i: usize) -> Result<Vec<u8>, IoError> {
        let chunk = &self.container.chunks()[i];
        self.take(chunk.length)?;
        self.used[i] = true;
        self.container.unpack(chunk)
    }

    fn header(&mut self) -> Result<Map<String, Value>, IoError> {
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
            .map_err(|e| self.bad("the header", shown(e.to_string().as_bytes()), AGAIN))?;
        let Value::Object(header) = header else {
            return Err(self.bad("the header", "no object", AGAIN));
        };
        if header.get("version").and_then(Value::as_u64) != Some(VERSION) {
            let value = header.get("version").map_or("missing".into(), Value::to_string);
            let advice = "this program knows 1; use a newer one";
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
    pub(super) fn parts_of_length(&self, tag: &str, name: &str, length: u64) -> Result<Vec<usize>, IoError> {
        let (parts, there) = (self.parts(tag, name), self.length(tag, name));
        if parts.is_empty() || there != length {
            let field = format!("the length of chunk {} {name}", shown(tag.as_bytes()));
            let advice = format!("the header announces {length} bytes: write the file again");
            return Err(self.bad(field, there.to_string(), &advice));
        }
        Ok(parts)
    }

    /// A plane of `length` bytes.
    pub(super) fn plane(&mut self, tag: &str, name: &str, length: u64) -> Result<Vec<u8>, IoError> {
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

    /// The poses of the sensor; none where there is no such chunk.
    pub(super) fn poses<const D: usize>(&mut self) -> Result<Vec<Pose<D>>, IoError> {
        if self.parts("POSES", "sensor").is_empty() {
            return Ok(Vec::new());
        }
        let bytes = self.plane("POSES", "sensor", self.length("POSES", "sensor"))?;
        let pose_bytes = (D * D + D) * size_of::<f64>();
        if bytes.len() % pose_bytes != 0 {
            let advice = format!("give {pose_bytes} bytes for each pose");
            return Err(self.bad("the length of chunk POSES sensor", bytes.len().to_string(), &advice));
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

pub(super) fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}
