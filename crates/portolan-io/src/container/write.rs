//! Writing a container.

use std::collections::HashSet;
use std::fmt::Display;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use super::{HEADER, LONGEST_CHUNK, LONGEST_NAME, MAGIC, MOST_CHUNKS, VERSION, tag_bytes};
use crate::{IoError, Result, write_durable};

/// zstd's own default: small gains above it, at several times the cost.
const LEVEL: i32 = 3;

/// Collects chunks, packed as they come, and writes them all at once.
///
/// ```
/// # fn main() -> Result<(), portolan_io::IoError> {
/// use portolan_io::{Container, ContainerWriter};
/// let mut writer = ContainerWriter::new();
/// writer.chunk("GRID", "occupancy", &[1, 2, 3])?;
/// let container = Container::parse(writer.to_bytes(), "memory".as_ref())?;
/// assert_eq!(container.get("GRID", "occupancy")?, Some(vec![1, 2, 3]));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Default)]
pub struct ContainerWriter {
    entries: Vec<u8>,
    /// The chunks, unless they are in a file.
    blocks: Vec<u8>,
    /// A file without a name that holds the chunks.
    spooled: Option<File>,
    /// Bytes of all chunks.
    length: u64,
    names: HashSet<([u8; 8], String)>,
    count: u32,
}

impl ContainerWriter {
    /// A container without chunks.
    pub fn new() -> Self {
        Self::default()
    }

    /// A container without chunks that keeps them in a file without a name in `folder` until it is written: it may be larger than
    /// memory.
    ///
    /// # Errors
    /// [`IoError::Os`] where there can be no file.
    pub fn spooled(folder: &Path) -> Result<Self> {
        let file = tempfile::tempfile_in(folder).map_err(|e| IoError::os(folder, "write to it", e))?;
        Ok(Self { spooled: Some(file), ..Self::default() })
    }

    /// Adds a chunk: a tag of 4 to 8 ASCII letters, digits or `_`, a name of at most 255 bytes (may be empty),
    /// at most 1 GiB of content.
    ///
    /// # Errors
    /// [`IoError::Unwritable`] where one of these does not hold or tag and name were used before.
    pub fn chunk(&mut self, tag: &str, name: &str, content: &[u8]) -> Result<()> {
        if content.len() as u64 > LONGEST_CHUNK {
            return unfit("the chunk length", content.len(), "spread it over chunks of at most 1 GiB");
        }
        match zstd::bulk::compress(content, LEVEL) {
            Ok(stored) => self.stored_chunk(tag, name, content.len() as u64, &stored),
            Err(e) => unfit("the chunk", e, "free some memory"),
        }
    }

    /// Adds a chunk that is packed already.
    pub(super) fn stored_chunk(&mut self, tag: &str, name: &str, length: u64, stored: &[u8]) -> Result<()> {
        let Some(tag8) = tag_bytes(tag) else {
            return unfit("the chunk tag", tag, "use 4 to 8 ASCII letters, digits or _");
        };
        if name.len() > LONGEST_NAME {
            return unfit("the chunk name", name, "use at most 255 bytes");
        }
        if self.count as usize == MOST_CHUNKS {
            return unfit("the number of chunks", "2^20", "join some chunks");
        }
        if !self.names.insert((tag8, name.to_owned())) {
            let value = format!("{tag} {name}, used twice");
            return unfit("the chunk name", value, "give every chunk its own name");
        }
        let position = HEADER as u64 + self.length;
        self.entries.extend(tag8);
        for value in [position, stored.len() as u64, length] {
            self.entries.extend(value.to_le_bytes());
        }
        self.entries.extend(crc32c::crc32c(stored).to_le_bytes());
        self.entries.extend((name.len() as u32).to_le_bytes());
        self.entries.extend(name.as_bytes());
        self.length += stored.len() as u64;
        self.count += 1;
        match &mut self.spooled {
            Some(file) => {
                file.write_all(stored).map_err(|e| IoError::os(Path::new("container"), "write it", e))
            }
            None => {
                self.blocks.extend(stored);
                Ok(())
            }
        }
    }

    fn header(&self) -> [u8; HEADER] {
        let mut header = Vec::with_capacity(HEADER);
        header.extend(MAGIC);
        header.extend(VERSION.to_le_bytes());
        header.extend(self.count.to_le_bytes());
        header.extend((HEADER as u64 + self.length).to_le_bytes());
        header.extend(crc32c::crc32c(&self.entries).to_le_bytes());
        let crc = crc32c::crc32c(&header);
        header.extend(crc.to_le_bytes());
        std::array::from_fn(|k| header[k])
    }

    /// The file. Of a spooled container only what is not spooled.
    pub fn to_bytes(&self) -> Vec<u8> {
        [&self.header()[..], &self.blocks, &self.entries].concat()
    }

    /// Writes the file, and it is on the disk when this returns: what follows from a map can be made again, the map cannot.
    ///
    /// # Errors
    /// As [`write_durable`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        write_durable(path, |w| {
            w.write_all(&self.header())?;
            w.write_all(&self.blocks)?;
            if let Some(mut file) = self.spooled.as_ref() {
                file.seek(SeekFrom::Start(0))?;
                let copied = io::copy(&mut file, w)?;
                if copied != self.length {
                    return Err(io::Error::other("the file that held the chunks was cut off"));
                }
            }
            w.write_all(&self.entries)
        })
    }
}

/// Chunks are checked before the file has a name.
fn unfit(field: &str, value: impl Display, advice: &str) -> Result<()> {
    Err(IoError::unwritable(Path::new("container"), field, value, advice))
}
