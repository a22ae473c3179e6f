//! Reading a container.

use std::borrow::Cow;
use std::collections::HashSet;
use std::fmt::Display;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::{
    ContainerWriter, ENTRY, HEADER, LONGEST_CHUNK, LONGEST_NAME, MAGIC, MOST_CHUNKS, VERSION, tag_of,
};
use crate::bytes::{open_file, u32_at, u64_at};
use crate::error::shown;
use crate::{IoError, Result};

/// A chunk as the index lists it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// Kind of content.
    pub tag: String,
    /// Which of this kind; may be empty.
    pub name: String,
    /// Length when unpacked (bytes).
    pub length: u64,
    /// Length in the file (bytes).
    pub stored_length: u64,
    position: usize,
    crc: u32,
}

/// A container whose index was checked; each chunk is checked and unpacked on request.
#[derive(Debug)]
pub struct Container {
    path: PathBuf,
    bytes: Bytes,
    chunks: Vec<Chunk>,
}

/// Where the chunks are.
#[derive(Debug)]
enum Bytes {
    Memory(Vec<u8>),
    /// Read when they are asked for.
    File(Mutex<File>),
}

impl Container {
    /// Reads a file into memory, packed as it is.
    ///
    /// # Errors
    /// As [`Container::from_reader`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::from_reader(open_file(path)?, path)
    }

    /// Reads a source into memory, packed as it is; errors name it `name`.
    ///
    /// # Errors
    /// [`IoError::Os`] where reading fails, and as [`Container::parse`].
    pub fn from_reader(mut reader: impl Read, name: &Path) -> Result<Self> {
        let failed = |e| IoError::os(name, "read it", e);
        let mut bytes = Vec::new();
        // Sources of another kind may be huge: the header is checked first.
        reader.by_ref().take(HEADER as u64).read_to_end(&mut bytes).map_err(failed)?;
        Header::of(&bytes, name)?;
        reader.read_to_end(&mut bytes).map_err(failed)?;
        Self::parse(bytes, name)
    }

    /// Reads a container in memory; errors name it `name`.
    ///
    /// # Errors
    /// [`IoError::Binary`] where header or index are damaged or claim what cannot be.
    pub fn parse(bytes: Vec<u8>, name: &Path) -> Result<Self> {
        let header = Header::of(&bytes, name)?;
        let index = usize::try_from(header.index).ok().filter(|&at| (HEADER..=bytes.len()).contains(&at));
        let Some(index) = index else {
            let advice = format!("the file has {} bytes: it is cut off", bytes.len());
            return Err(IoError::binary(name, 16, "the position of the index", header.index, advice));
        };
        let chunks = header.chunks(&bytes[index..], name)?;
        Ok(Self { path: name.into(), bytes: Bytes::Memory(bytes), chunks })
    }

    /// Opens a file and reads its index alone; chunks are read when they are unpacked, so that files may be larger than memory.
    ///
    /// # Errors
    /// As [`Container::from_reader`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let failed = |e| IoError::os(path, "read it", e);
        let mut file = open_file(path)?;
        let length = file.metadata().map_err(failed)?.len();
        let mut first = Vec::new();
        file.by_ref().take(HEADER as u64).read_to_end(&mut first).map_err(failed)?;
        let header = Header::of(&first, path)?;
        if !(HEADER as u64..=length).contains(&header.index) {
            let advice = format!("the file has {length} bytes: it is cut off");
            return Err(IoError::binary(path, 16, "the position of the index", header.index, advice));
        }
        file.seek(SeekFrom::Start(header.index)).map_err(failed)?;
        let mut index = Vec::new();
        file.by_ref()
            .take(MOST_CHUNKS as u64 * (ENTRY + LONGEST_NAME) as u64)
            .read_to_end(&mut index)
            .map_err(failed)?;
        let chunks = header.chunks(&index, path)?;
        Ok(Self { path: path.into(), bytes: Bytes::File(Mutex::new(file)), chunks })
    }

    /// The file, or the name that was given for it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The chunks in the order of the file.
    pub fn chunks(&self) -> &[Chunk] {
        &self.chunks
    }

    /// The content of the chunk with this tag and name; `None` where the file has no such chunk.
    ///
    /// # Errors
    /// As [`Container::unpack`].
    pub fn get(&self, tag: &str, name: &str) -> Result<Option<Vec<u8>>> {
        let chunk = self.chunks.iter().find(|c| c.tag == tag && c.name == name);
        chunk.map(|c| self.unpack(c)).transpose()
    }

    /// The content of one of [`Container::chunks`]. Memory grows as it is unpacked, and no farther than the
    /// index announces.
    ///
    /// # Errors
    /// [`IoError::Binary`] where the chunk is damaged or not as long as announced.
    pub fn unpack(&self, chunk: &Chunk) -> Result<Vec<u8>> {
        let bad = |value: String, advice: &str| {
            let field = format!("chunk {} {}", chunk.tag, shown(&chunk.name));
            Err(IoError::binary(&self.path, chunk.position as u64, field, value, advice))
        };
        let stored = self.stored(chunk)?;
        if crc32c::crc32c(&stored) != chunk.crc {
            return bad("damaged (its checksum is wrong)".into(), "copy the file again");
        }
        let mut content = Vec::new();
        let unpacked = zstd::stream::read::Decoder::with_buffer(&*stored)
            .and_then(|d| d.take(chunk.length + 1).read_to_end(&mut content));
        match unpacked {
            Err(e) => bad(format!("damaged ({e})"), "write the file again"),
            Ok(_) if content.len() as u64 != chunk.length => {
                let advice = format!("the index announces {}: write the file again", chunk.length);
                bad(format!("{} bytes or more", content.len()), &advice)
            }
            Ok(_) => Ok(content),
        }
    }

    fn stored(&self, chunk: &Chunk) -> Result<Cow<'_, [u8]>> {
        match &self.bytes {
            Bytes::Memory(bytes) => {
                // A chunk of another container may point anywhere.
                let end = chunk.position.saturating_add(chunk.stored_length as usize);
                Ok(Cow::Borrowed(bytes.get(chunk.position..end).unwrap_or(&[])))
            }
            Bytes::File(file) => {
                let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
                let mut stored = Vec::new();
                let read = file
                    .seek(SeekFrom::Start(chunk.position as u64))
                    .and_then(|_| file.by_ref().take(chunk.stored_length).read_to_end(&mut stored));
                read.map_err(|e| IoError::os(&self.path, "read it", e))?;
                Ok(Cow::Owned(stored))
            }
        }
    }

    /// A writer that holds the chunks for which `keep` is true, packed as they are: for programs that replace some
    /// chunks and keep the rest, known or not.
    ///
    /// # Errors
    /// [`IoError::Unwritable`] in principle only: what was read can be written.
    pub fn writer(&self, mut keep: impl FnMut(&Chunk) -> bool) -> Result<ContainerWriter> {
        let mut writer = ContainerWriter::new();
        for chunk in self.chunks.iter().filter(|c| keep(c)) {
            writer.stored_chunk(&chunk.tag, &chunk.name, chunk.length, &self.stored(chunk)?)?;
        }
        Ok(writer)
    }
}

struct Header {
    count: u32,
    index: u64,
    index_crc: u32,
}

impl Header {
    fn of(bytes: &[u8], path: &Path) -> Result<Self> {
        let bad = |at, field: &str, value: &dyn Display, advice: &str| {
            Err(IoError::binary(path, at, field, value, advice))
        };
        let magic = &bytes[..bytes.len().min(8)];
        if magic != MAGIC {
            return bad(0, "the magic", &shown(magic), "give a map.portolan: it starts with PORTOLAN");
        }
        if bytes.len() < HEADER {
            let advice = "the file is cut off: copy it again";
            return bad(8, "the header", &format!("{} bytes", bytes.len()), advice);
        }
        let version = u32_at(bytes, 8);
        if version != VERSION {
            return bad(8, "the version", &version, "this program reads version 1; use a newer one");
        }
        if crc32c::crc32c(&bytes[..28]) != u32_at(bytes, 28) {
            return bad(28, "the checksum of the header", &"wrong", "the file is damaged: copy it again");
        }
        Ok(Self { count: u32_at(bytes, 12), index: u64_at(bytes, 16), index_crc: u32_at(bytes, 24) })
    }

    /// The chunks of the index, whose bytes these are.
    fn chunks(&self, index: &[u8], path: &Path) -> Result<Vec<Chunk>> {
        if crc32c::crc32c(index) != self.index_crc {
            let advice = "the file is cut off or damaged: copy it again";
            return Err(IoError::binary(path, self.index, "the checksum of the index", "wrong", advice));
        }
        chunks(index, self.index as usize, self.count, path)
    }
}

/// The chunks that an index lists, which begins at byte `index` of the file and goes on to its end.
fn chunks(bytes: &[u8], index: usize, count: u32, path: &Path) -> Result<Vec<Chunk>> {
    let mut chunks = Vec::new();
    let mut names = HashSet::new();
    let (mut at, mut position) = (0, HEADER);
    if count as usize > MOST_CHUNKS {
        let advice = "a container has at most 2^20 chunks: the file is damaged";
        return Err(IoError::binary(path, 12, "the number of chunks", count, advice));
    }
    for _ in 0..count {
        let bad = |offset: usize, field: &str, value: &dyn Display, advice: &str| {
            Err(IoError::binary(path, (index + at + offset) as u64, field, value, advice))
        };
        let Some(entry) = bytes.get(at..at + ENTRY) else {
            let advice = "the header announces more: the file is cut off";
            return bad(0, "the index", &format!("{} entries", chunks.len()), advice);
        };
        let Some(tag) = tag_of(std::array::from_fn(|k| entry[k])) else {
            return bad(0, "a chunk tag", &shown(&entry[..8]), "use 4 to 8 ASCII letters, digits or _");
        };
        let [place, stored_length, length] = [8, 16, 24].map(|k| u64_at(entry, k));
        if place != position as u64 {
            let advice = "chunks must follow each other without gaps: the file is damaged";
            return bad(8, "a chunk position", &place, advice);
        }
        if stored_length > (index - position) as u64 {
            let advice = "it reaches beyond the chunks: the file is damaged";
            return bad(16, "a stored length", &stored_length, advice);
        }
        if length > LONGEST_CHUNK {
            return bad(24, "a chunk length", &length, "chunks have at most 2^30 bytes");
        }
        let name_length = u32_at(entry, 36) as usize;
        let name = bytes.get(at + ENTRY..at + ENTRY + name_length.min(LONGEST_NAME + 1));
        let name = name.filter(|n| n.len() <= LONGEST_NAME).and_then(|n| std::str::from_utf8(n).ok());
        let Some(name) = name else {
            let advice = "use at most 255 bytes of UTF-8";
            return bad(36, "a chunk name", &format!("{name_length} bytes"), advice);
        };
        if !names.insert((tag.clone(), name)) {
            let advice = "it is there twice: write the file again";
            return bad(0, "a chunk name", &format!("{tag} {}", shown(name)), advice);
        }
        let crc = u32_at(entry, 32);
        chunks.push(Chunk { tag, name: name.to_owned(), length, stored_length, position, crc });
        position += stored_length as usize;
        at += ENTRY + name_length;
    }
    if at != bytes.len() || position != index {
        let (value, advice) =
            (format!("{} bytes", index + bytes.len()), "bytes are left over: write the file again");
        return Err(IoError::binary(path, (index + at) as u64, "the file length", value, advice));
    }
    Ok(chunks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, bad_bytes, says, temporary};

    fn sample() -> Vec<u8> {
        let mut writer = ContainerWriter::new();
        writer.chunk("META", "", b"{}").unwrap();
        writer.chunk("GRID_I8", "occupancy", &vec![7; 5000]).unwrap();
        writer.chunk("GRID_I8", "empty", &[]).unwrap();
        writer.to_bytes()
    }

    fn parse(bytes: &[u8]) -> Result<Container> {
        Container::parse(bytes.to_vec(), "m.portolan".as_ref())
    }

    /// The sample with the index changed and the checksums made right again.
    fn forged(change: impl FnOnce(&mut [u8])) -> String {
        let mut bytes = sample();
        let index = u64_at(&bytes, 16) as usize;
        change(&mut bytes[index..]);
        let crc = crc32c::crc32c(&bytes[index..]);
        bytes[24..28].copy_from_slice(&crc.to_le_bytes());
        let crc = crc32c::crc32c(&bytes[..28]);
        bytes[28..32].copy_from_slice(&crc.to_le_bytes());
        let container = match parse(&bytes) {
            Ok(container) => container,
            Err(e) => return e.to_string(),
        };
        let contents: Result<Vec<_>, _> = container.chunks().iter().map(|c| container.unpack(c)).collect();
        contents.unwrap_err().to_string()
    }

    #[test]
    fn round_trips_and_is_deterministic() {
        let (_folder, path) = temporary("map.portolan");
        let mut random = Random(1);
        let noise: Vec<u8> = (0..300_000).map(|_| random.next() as u8).collect();
        let mut writer = ContainerWriter::new();
        writer.chunk("NOISE", "a", &noise).unwrap();
        writer.chunk("ZERO", "b", &vec![0; 3 << 20]).unwrap();
        writer.write(&path).unwrap();
        let container = Container::read(&path).unwrap();
        assert_eq!(container.get("NOISE", "a").unwrap().unwrap(), noise);
        assert_eq!(container.get("ZERO", "b").unwrap().unwrap(), vec![0; 3 << 20]);
        assert_eq!(container.get("ZERO", "c").unwrap(), None);
        assert_eq!(
            (container.chunks().iter().filter(|c| c.tag == "ZERO").count(), container.chunks()[1].length),
            (1, 3 << 20)
        );
        assert_eq!(std::fs::read(&path).unwrap(), writer.to_bytes());
        assert_eq!(sample(), sample());
        assert!(parse(&ContainerWriter::new().to_bytes()).unwrap().chunks().is_empty());
    }

    #[test]
    fn unknown_chunks_survive_a_rewrite() {
        let old = parse(&sample()).unwrap();
        assert_eq!(old.writer(|_| true).unwrap().to_bytes(), sample());
        let mut writer = old.writer(|c| c.tag != "META").unwrap();
        writer.chunk("META", "", b"new").unwrap();
        let new = parse(&writer.to_bytes()).unwrap();
        assert_eq!(new.get("META", "").unwrap().unwrap(), b"new");
        assert_eq!(new.get("GRID_I8", "occupancy").unwrap().unwrap(), vec![7; 5000]);
    }

    #[test]
    fn every_flipped_bit_is_found() {
        let good = sample();
        for i in 0..good.len() {
            for bit in 0..8 {
                let mut bytes = good.clone();
                bytes[i] ^= 1 << bit;
                let read =
                    parse(&bytes).and_then(|c| c.chunks().iter().try_for_each(|k| c.unpack(k).map(drop)));
                assert!(read.is_err(), "byte {i} bit {bit}");
            }
        }
        for cut in 0..good.len() {
            assert!(parse(&good[..cut]).is_err());
        }
    }

    #[test]
    fn false_claims_with_right_checksums_are_refused_at_once() {
        let at = |k: usize, value: u64| {
            move |index: &mut [u8]| index[k..k + 8].copy_from_slice(&value.to_le_bytes())
        };
        assert!(
            forged(at(24, 1 << 60)).contains("a chunk length is 1152921504606846976; chunks have at most")
        );
        assert!(forged(at(16, 1 << 60)).contains("a stored length is 1152921504606846976"));
        assert!(forged(at(8, 1 << 60)).contains("a chunk position is 1152921504606846976"));
        assert!(forged(at(24, 1)).contains("the index announces 1:"));
        assert!(forged(at(24, 1 << 29)).contains("the index announces 536870912:"));
        assert!(forged(|i| i[36..40].fill(0xff)).contains("a chunk name is 4294967295 bytes"));
        assert!(forged(|i| i[0] = b' ').contains("a chunk tag is"));
    }

    #[test]
    fn writers_refuse_what_cannot_be_read() {
        let mut writer = ContainerWriter::new();
        for tag in ["", "abc", "too_long_1", "a b c", "äöü"] {
            assert!(writer.chunk(tag, "", &[]).is_err());
        }
        assert!(writer.chunk("GOOD", &"n".repeat(256), &[]).is_err());
        writer.chunk("GOOD", "n", &[]).unwrap();
        says(writer.chunk("GOOD", "n", &[]), "used twice");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        for bytes in bad_bytes(&sample(), 17, 4000) {
            if let Ok(container) = parse(&bytes) {
                container.chunks().iter().for_each(|c| drop(container.unpack(c)));
            }
        }
    }
}
