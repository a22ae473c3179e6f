//! Compressed chunks, messages and files.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, PoisonError};

use super::source::{ReadSeek, Source};
use crate::{BagError, Result};

/// The first bytes of a zstd frame.
pub(crate) const ZSTD_MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];

/// A chunk, or a message, of more than so many unpacked bytes is refused: a compressed one of a few bytes may claim any
/// size.
pub(crate) const UNPACKED_LIMIT: u64 = 1 << 30;

/// A file that is compressed as a whole may become so many times as large: noise-free depth images reach a hundred, and
/// bytes made for it could fill any disk.
const MOST_TIMES: u64 = 1000;
/// And so many bytes in any case.
const LEAST: u64 = 64 << 20;

/// How a chunk is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    Zstd,
    Lz4,
    Bz2,
}

impl Packing {
    /// Its name in containers.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Zstd => "zstd",
            Self::Lz4 => "lz4",
            Self::Bz2 => "bz2",
        }
    }

    /// Unpacks `packed`, which must give exactly `size` bytes; the reason where it does not. Memory grows as bytes
    /// arrive, so that a size in a file costs nothing.
    pub(crate) fn unpack(self, packed: &[u8], size: u64) -> Result<Vec<u8>, String> {
        if size > UNPACKED_LIMIT {
            return Err(format!("said to unpack to {size} bytes, more than {UNPACKED_LIMIT}"));
        }
        let unpacked = self.unpack_up_to(packed, size, size)?;
        if unpacked.len() as u64 != size {
            return Err(format!("unpacked to {} bytes instead of {size}", unpacked.len()));
        }
        Ok(unpacked)
    }

    /// Unpacks `packed`, which must give at most `limit` bytes.
    pub(crate) fn unpack_up_to(self, packed: &[u8], expected: u64, limit: u64) -> Result<Vec<u8>, String> {
        let likely = expected.min(packed.len() as u64 * 4 + (1 << 16));
        let mut unpacked = Vec::with_capacity(likely as usize);
        let mut read = |reader: &mut dyn Read| reader.take(limit + 1).read_to_end(&mut unpacked);
        let result = match self {
            Self::Zstd => zstd::stream::read::Decoder::with_buffer(packed).and_then(|mut d| read(&mut d)),
            Self::Lz4 => read(&mut lz4_flex::frame::FrameDecoder::new(packed)),
            Self::Bz2 => read(&mut bzip2::bufread::MultiBzDecoder::new(packed)),
        };
        match result {
            Err(e) => Err(format!("damaged {} data ({e})", self.name())),
            Ok(_) if unpacked.len() as u64 > limit => Err(format!("unpacked to more than {limit} bytes")),
            Ok(_) => Ok(unpacked),
        }
    }
}

/// A file that was compressed as a whole, unpacked to a temporary file: messages are read from any place, which zstd
/// does not allow, and the whole of it need not fit into memory. The file has no name and goes with the bag, also when
/// the process is killed.
pub(crate) struct Unpacked {
    name: String,
    file: Arc<Mutex<File>>,
}

impl Unpacked {
    /// Unpacks the whole source. With `keep_part` damage ends it, and the reason is returned.
    pub(crate) fn new(source: &dyn Source, keep_part: bool) -> Result<(Self, Option<String>)> {
        let name = source.name().to_owned();
        let failed = |action| {
            let name = name.clone();
            move |cause| BagError::Os { name, action, cause }
        };
        let mut packed = source.open().map_err(failed("open it"))?;
        let size = packed.seek(SeekFrom::End(0)).map_err(failed("find its size"))?;
        packed.seek(SeekFrom::Start(0)).map_err(failed("read it"))?;
        let limit = size.saturating_mul(MOST_TIMES).max(LEAST);
        let mut decoder = zstd::stream::read::Decoder::new(packed).map_err(failed("unpack it"))?;
        let mut file = tempfile::tempfile().map_err(failed("make a temporary file to unpack it into"))?;
        let mut buffer = vec![0; 1 << 17];
        let mut total = 0;
        let mut reason = None;
        loop {
            match decoder.read(&mut buffer) {
                Ok(0) => break,
                Ok(n) => {
                    total += n as u64;
                    if total > limit {
                        let reason =
                            format!("unpacks to more than {limit} bytes, {MOST_TIMES} times its size");
                        return Err(BagError::Refused {
                            name,
                            reason,
                            advice: "unpack it by `zstd -d`".into(),
                        });
                    }
                    file.write_all(&buffer[..n]).map_err(failed("unpack it to a temporary file"))?;
                }
                Err(e) if keep_part => {
                    reason = Some(format!("{name}: zstd data ends after {total} unpacked bytes ({e})"));
                    break;
                }
                Err(e) => {
                    let field = "the zstd data, after unpacking to here,".to_owned();
                    let advice = super::reader::CUT.to_owned();
                    let value = format!("damaged or cut off ({e})");
                    return Err(BagError::Damaged { name, offset: total, field, value, advice });
                }
            }
        }
        Ok((Self { name, file: Arc::new(Mutex::new(file)) }, reason))
    }
}

impl Source for Unpacked {
    fn name(&self) -> &str {
        &self.name
    }

    fn open(&self) -> io::Result<Box<dyn ReadSeek + Send>> {
        Ok(Box::new(SharedFile { file: Arc::clone(&self.file), position: 0 }))
    }
}

/// A place of its own in a file without a name, which cannot be opened again.
struct SharedFile {
    file: Arc<Mutex<File>>,
    position: u64,
}

impl Read for SharedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(self.position))?;
        let n = file.read(buffer)?;
        self.position += n as u64;
        Ok(n)
    }
}

impl Seek for SharedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        if let SeekFrom::Current(step) = to {
            let place = self.position.checked_add_signed(step);
            self.position = place.ok_or(io::ErrorKind::InvalidInput)?;
        } else {
            self.position = file.seek(to)?;
        }
        Ok(self.position)
    }
}
