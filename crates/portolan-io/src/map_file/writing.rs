//! What writing a `map.portolan` is made of, whatever the dimension.

use portolan::geom::Pose;
use serde::Serialize;
use serde_json::{Value, json};

use super::{MapHeader, UnknownChunk, VERSION, part_name};
use crate::{ContainerWriter, IoError};

/// A dense plane is cut into chunks of this many bytes.
const CHUNK: usize = 1 << 30;

/// A writer whose first chunk is the header.
pub(super) fn begin(
    header: &MapHeader,
    dimension: usize,
    entries: Vec<impl Serialize>,
    unknown_maps: &[Value],
) -> Result<ContainerWriter, IoError> {
    let failed = |e: serde_json::Error| {
        IoError::unwritable("map.portolan".as_ref(), "the header", e.to_string(), "give finite numbers")
    };
    let mut maps = Vec::new();
    for entry in entries {
        maps.push(serde_json::to_value(entry).map_err(failed)?);
    }
    maps.extend(unknown_maps.iter().cloned());
    let mut header = serde_json::to_value(header).map_err(failed)?;
    header["version"] = json!(VERSION);
    header["dimension"] = json!(dimension);
    header["maps"] = Value::Array(maps);
    let mut writer = ContainerWriter::new();
    writer.chunk("HEAD", "", serde_json::to_string(&header).map_err(failed)?.as_bytes())?;
    Ok(writer)
}

/// Poses and unknown chunks, which come last.
pub(super) fn finish<const D: usize>(
    writer: &mut ContainerWriter,
    poses: &[Pose<D>],
    unknown_chunks: &[UnknownChunk],
) -> Result<(), IoError> {
    if !poses.is_empty() {
        let numbers = poses.iter().flat_map(|p| p.rotation.as_flattened().iter().chain(&p.translation));
        let content: Vec<u8> = numbers.flat_map(|v| v.to_le_bytes()).collect();
        write_plane(writer, "POSES", "sensor", &content)?;
    }
    unknown_chunks.iter().try_for_each(|c| writer.chunk(&c.tag, &c.name, &c.content))
}

pub(super) fn floats_to_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

pub(super) fn write_plane(
    writer: &mut ContainerWriter,
    tag: &str,
    name: &str,
    bytes: &[u8],
) -> Result<(), IoError> {
    if bytes.is_empty() {
        return writer.chunk(tag, name, bytes);
    }
    bytes.chunks(CHUNK).enumerate().try_for_each(|(i, part)| writer.chunk(tag, &part_name(name, i), part))
}
