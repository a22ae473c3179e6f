//! `map.portolan`: a lossless container of named chunks.
//!
//! Little-endian:
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | 8 bytes | `PORTOLAN` |
//! | 8 | u32 | version = 1 |
//! | 12 | u32 | number of chunks |
//! | 16 | u64 | position of the index |
//! | 24 | u32 | CRC32C of the index |
//! | 28 | u32 | CRC32C of bytes 0 to 27 |
//! | 32 | bytes | the chunks one after the other, each one zstd frame |
//! | index | entries | to the end of the file |
//!
//! An entry of the index:
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | 8 bytes | tag: 4 to 8 ASCII letters, digits or `_`, filled up with zeros |
//! | 8 | u64 | position in the file: right after the previous chunk, the first at 32 |
//! | 16 | u64 | stored length |
//! | 24 | u64 | length when unpacked, at most 1 GiB: longer data goes into several chunks |
//! | 32 | u32 | CRC32C of the stored bytes |
//! | 36 | u32 | length of the name, at most 255 |
//! | 40 | bytes | name in UTF-8, may be empty; tag and name together are unique |
//!
//! The same chunks in the same order make the same bytes. Chunks with unknown tags are kept, so that an older
//! program does not lose what a newer one wrote.

mod read;
mod write;

pub use read::{Chunk, Container};
pub use write::ContainerWriter;

/// The first eight bytes.
pub(crate) const MAGIC: &[u8; 8] = b"PORTOLAN";
const VERSION: u32 = 1;
const HEADER: usize = 32;
const ENTRY: usize = 40;
/// The longest chunk, unpacked (bytes).
const LONGEST_CHUNK: u64 = 1 << 30;
const LONGEST_NAME: usize = 255;
const MOST_CHUNKS: usize = 1 << 20;

/// The eight bytes of a tag; `None` for a word that cannot be one.
fn tag_bytes(tag: &str) -> Option<[u8; 8]> {
    let fits = (4..=8).contains(&tag.len()) && tag.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    fits.then(|| std::array::from_fn(|k| tag.as_bytes().get(k).copied().unwrap_or(0)))
}

/// The tag in eight bytes; `None` where they hold no tag.
fn tag_of(bytes: [u8; 8]) -> Option<String> {
    let end = bytes.iter().position(|&b| b == 0).unwrap_or(8);
    let tag = std::str::from_utf8(&bytes[..end]).ok()?;
    (tag_bytes(tag) == Some(bytes)).then(|| tag.to_owned())
}
