//! Chunks.

use super::super::reader::FileReader;
use super::super::unpack::{Packing, UNPACKED_LIMIT};
use super::record::{RecordHead, op};
use crate::Result;

/// The record of a chunk, how it is compressed, and its unpacked bytes.
fn chunk_head(reader: &mut FileReader, place: u64) -> Result<(RecordHead, Option<Packing>, u64)> {
    let record = RecordHead::read(reader, place)?;
    let fields = record.fields();
    let (Some(op::CHUNK), Some(size)) = (fields.op(), fields.u32(b"size").map(u64::from)) else {
        return Err(reader.damaged(place, "a chunk", "a record of another kind"));
    };
    let packing = match fields.get(b"compression") {
        Some(b"none") => None,
        Some(b"bz2") => Some(Packing::Bz2),
        Some(b"lz4") => Some(Packing::Lz4),
        name => {
            let value = format!("{:?}", String::from_utf8_lossy(name.unwrap_or_default()));
            let advice = "only none, bz2 and lz4 are read: `rosbag decompress` unpacks it";
            return Err(reader.wrong(place, "the compression of a chunk", value, advice));
        }
    };
    if size > UNPACKED_LIMIT {
        let advice = "such chunks are not read: write the bag with smaller ones";
        return Err(reader.wrong(place, "the size of a chunk", format!("{size} bytes"), advice));
    }
    Ok((record, packing, size))
}

/// How the chunk at `place` is compressed.
pub(crate) fn packing_of(reader: &mut FileReader, place: u64) -> Result<Option<Packing>> {
    Ok(chunk_head(reader, place)?.1)
}

/// Reads and unpacks the chunk at `place`.
pub(crate) fn load_chunk(reader: &mut FileReader, place: u64) -> Result<Vec<u8>> {
    let (record, packing, size) = chunk_head(reader, place)?;
    let mut bytes = Vec::new();
    record.data(reader, &mut bytes)?;
    match packing {
        None if bytes.len() as u64 == size => Ok(bytes),
        None => Err(reader.damaged(place, "the size of a chunk", format!("{size} and {}", bytes.len()))),
        Some(packing) => {
            packing.unpack(&bytes, size).map_err(|reason| reader.damaged(place, "a chunk", reason))
        }
    }
}
