//! Chunks.

use mcap::records::op;

use super::super::reader::FileReader;
use super::super::unpack::{Packing, UNPACKED_LIMIT};
use super::record::{u32_at, u64_at};
use crate::Result;

/// What stands before the bytes of a chunk.
struct ChunkHead {
    packing: Option<Packing>,
    /// Unpacked bytes.
    size: u64,
    /// Checksum of the unpacked bytes; 0: there is none.
    crc: u32,
    packed_at: u64,
    packed_size: u64,
}

fn chunk_head(reader: &mut FileReader, place: u64) -> Result<ChunkHead> {
    let mut head = [0; 9 + 32];
    reader.read_at(place, &mut head, "a chunk")?;
    let (record_length, size) = (u64_at(&head, 1), u64_at(&head, 9 + 16));
    let (crc, name_length) = (u32_at(&head, 9 + 24), u32_at(&head, 9 + 28));
    if head[0] != op::CHUNK {
        return Err(reader.damaged(place, "the code of a chunk", head[0]));
    }
    if name_length > 64 {
        return Err(reader.damaged(place, "the length of a chunk's compression", name_length));
    }
    let mut bytes = Vec::new();
    let (name_at, name_length) = (place + head.len() as u64, u64::from(name_length));
    reader.bytes_at(name_at, name_length + 8, &mut bytes, "a chunk")?;
    let (name, packed_size) = (&bytes[..name_length as usize], u64_at(&bytes, name_length as usize));
    if record_length.checked_sub(32 + name_length + 8).is_none_or(|rest| packed_size > rest) {
        return Err(reader.damaged(place, "the packed size of a chunk", packed_size));
    }
    let packing = match name {
        b"" | b"none" => None,
        b"zstd" => Some(Packing::Zstd),
        b"lz4" => Some(Packing::Lz4),
        name => {
            let (value, advice) = (format!("{:?}", String::from_utf8_lossy(name)), "pack it by zstd or lz4");
            return Err(reader.wrong(place, "the compression of a chunk", value, advice));
        }
    };
    if packing.is_none() && size != packed_size {
        return Err(reader.damaged(place, "the size of a chunk", format!("{size} and {packed_size}")));
    }
    if size > UNPACKED_LIMIT {
        let advice = "such chunks are not read: write the bag with smaller ones";
        return Err(reader.wrong(place, "the size of a chunk", format!("{size} bytes"), advice));
    }
    Ok(ChunkHead { packing, size, crc, packed_at: name_at + name_length + 8, packed_size })
}

/// How the chunk at `place` is compressed.
pub(crate) fn packing_of(reader: &mut FileReader, place: u64) -> Result<Option<Packing>> {
    Ok(chunk_head(reader, place)?.packing)
}

/// Reads, unpacks and checks the chunk at `place`.
pub(crate) fn load_chunk(reader: &mut FileReader, place: u64) -> Result<Vec<u8>> {
    let head = chunk_head(reader, place)?;
    let mut bytes = Vec::new();
    reader.bytes_at(head.packed_at, head.packed_size, &mut bytes, "a chunk")?;
    let chunk = match head.packing {
        None => bytes,
        Some(packing) => {
            packing.unpack(&bytes, head.size).map_err(|reason| reader.damaged(place, "a chunk", reason))?
        }
    };
    if head.crc != 0 {
        let found = crc32fast::hash(&chunk);
        if found != head.crc {
            let value = format!("{found:08x} instead of {:08x}", head.crc);
            return Err(reader.damaged(place, "the checksum of a chunk", value));
        }
    }
    Ok(chunk)
}
