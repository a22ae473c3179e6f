//! Opening plain and compressed files alike.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use crate::{IoError, Result};

/// So many bytes come with the first [`BufRead::fill_buf`] of any input, where it has them: enough to find its format.
const HEAD: u64 = 64;

/// How a file is compressed, by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// Not packed.
    Plain,
    /// gzip, one member or several.
    Gzip,
    /// bzip2, one stream or several.
    Bzip2,
}

impl Compression {
    /// The packing that starts with these bytes; three are enough.
    pub fn of(head: &[u8]) -> Self {
        match head {
            [0x1f, 0x8b, ..] => Self::Gzip,
            [b'B', b'Z', b'h', ..] => Self::Bzip2,
            _ => Self::Plain,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Gzip => "gzip",
            Self::Bzip2 => "bzip2",
        }
    }
}

/// The unpacked content of a file.
pub struct Input {
    path: PathBuf,
    compression: Compression,
    reader: Box<dyn BufRead>,
}

impl Input {
    /// Content that comes from elsewhere than a file (standard input, memory), under the name that errors
    /// shall give. It is unpacked like a file.
    ///
    /// # Errors
    /// [`IoError::Os`] where the first bytes cannot be read.
    pub fn from_reader(reader: impl Read + 'static, name: &Path) -> Result<Self> {
        let mut reader = BufReader::with_capacity(1 << 16, reader);
        let mut head = Vec::with_capacity(HEAD as usize);
        // A pipe may deliver byte by byte, so the magic is read, not peeked.
        reader.by_ref().take(HEAD).read_to_end(&mut head).map_err(|e| IoError::os(name, "read it", e))?;
        let compression = Compression::of(&head);
        let whole = io::Cursor::new(head).chain(reader);
        let reader: Box<dyn BufRead> = match compression {
            Compression::Plain => Box::new(whole),
            Compression::Gzip => {
                Box::new(BufReader::with_capacity(1 << 16, flate2::bufread::MultiGzDecoder::new(whole)))
            }
            Compression::Bzip2 => {
                Box::new(BufReader::with_capacity(1 << 16, bzip2::bufread::MultiBzDecoder::new(whole)))
            }
        };
        Ok(Self { path: name.into(), compression, reader })
    }

    /// The file's name, for errors.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How the file is packed.
    pub fn compression(&self) -> Compression {
        self.compression
    }

    /// At most `limit` unpacked bytes; memory grows as they arrive.
    ///
    /// # Errors
    /// [`IoError::Compression`] or [`IoError::Os`] where reading fails.
    pub fn read_up_to(&mut self, limit: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let result = self.reader.by_ref().take(limit).read_to_end(&mut bytes);
        match result {
            Ok(_) => Ok(bytes),
            Err(e) => Err(read_failed(&self.path, self.compression, bytes.len() as u64, e)),
        }
    }

    /// The whole content.
    ///
    /// # Errors
    /// As [`Input::read_up_to`], and [`IoError::Binary`] for a content of more than `limit` bytes.
    pub fn read_all(&mut self, limit: u64) -> Result<Vec<u8>> {
        let bytes = self.read_up_to(limit.saturating_add(1))?;
        if bytes.len() as u64 > limit {
            let value = format!("more than {limit} bytes");
            return Err(IoError::binary(&self.path, limit, "the content", value, "split the file"));
        }
        Ok(bytes)
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }
}

impl BufRead for Input {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.reader.consume(amount);
    }
}

/// Opens a plain, gzip or bzip2 file; the first bytes decide which, not the name.
///
/// # Errors
/// [`IoError::IsFolder`] for a folder, [`IoError::Os`] where the file cannot be opened or read.
pub fn open(path: impl AsRef<Path>) -> Result<Input> {
    let path = path.as_ref();
    Input::from_reader(open_file(path)?, path)
}

/// Opens a file as it is.
pub(crate) fn open_file(path: &Path) -> Result<File> {
    let file = File::open(path).map_err(|e| IoError::os(path, "open it", e))?;
    let about = file.metadata().map_err(|e| IoError::os(path, "read its metadata", e))?;
    if about.is_dir() {
        return Err(IoError::IsFolder { path: path.into() });
    }
    Ok(file)
}

/// The error of a read that failed after `offset` unpacked bytes.
pub(crate) fn read_failed(path: &Path, compression: Compression, offset: u64, cause: io::Error) -> IoError {
    use io::ErrorKind::{InvalidData, InvalidInput, Other, UnexpectedEof};
    let damaged = matches!(cause.kind(), InvalidData | InvalidInput | Other | UnexpectedEof);
    if compression == Compression::Plain || !damaged {
        return IoError::os(path, "read it", cause);
    }
    let reason = match cause.kind() {
        UnexpectedEof => "ends too early (the file is cut off)".to_owned(),
        _ => format!("is damaged ({cause})"),
    };
    IoError::Compression { path: path.into(), kind: compression.name(), offset, reason }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::says;
    use std::io::Write;

    fn gz(bytes: &[u8]) -> Vec<u8> {
        let mut w = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        w.write_all(bytes).unwrap();
        w.finish().unwrap()
    }

    fn bz(bytes: &[u8]) -> Vec<u8> {
        let mut w = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
        w.write_all(bytes).unwrap();
        w.finish().unwrap()
    }

    fn unpack(bytes: Vec<u8>) -> Result<Vec<u8>> {
        Input::from_reader(io::Cursor::new(bytes), Path::new("x"))?.read_all(1 << 24)
    }

    #[test]
    fn packing_is_found_by_content_and_members_are_joined() {
        let text: Vec<u8> = (0..100_000u32).flat_map(|i| i.to_le_bytes()).collect();
        assert_eq!(unpack(text.clone()).unwrap(), text);
        assert_eq!(unpack([gz(&text), gz(b"tail")].concat()).unwrap(), [&text[..], b"tail"].concat());
        assert_eq!(unpack([bz(&text), bz(b"tail")].concat()).unwrap(), [&text[..], b"tail"].concat());
        for short in [&b""[..], b"B", b"BZ", &[0x1f]] {
            assert_eq!(unpack(short.to_vec()).unwrap(), short);
        }
    }

    #[test]
    fn cut_streams_say_so() {
        let text: Vec<u8> = (0..50_000u32).flat_map(|i| (i * i).to_le_bytes()).collect();
        for whole in [gz(&text), bz(&text)] {
            for cut in [4, 12, whole.len() / 2, whole.len() - 1] {
                let error = unpack(whole[..cut].to_vec()).unwrap_err();
                assert!(matches!(error, IoError::Compression { .. }), "{cut}: {error}");
                assert!(!error.to_string().contains('\n'));
            }
            let mut damaged = whole.clone();
            damaged[whole.len() / 2] ^= 0x55;
            assert!(matches!(unpack(damaged).unwrap_err(), IoError::Compression { .. }));
        }
    }

    #[test]
    fn no_packed_bytes_make_it_panic() {
        let text: Vec<u8> = (0..500u32).flat_map(|i| (i * i).to_le_bytes()).collect();
        for whole in [gz(&text), bz(&text)] {
            for bytes in crate::testing::bad_bytes(&whole, 3, 1000) {
                if let Err(e) = unpack(bytes) {
                    assert!(!e.to_string().contains('\n'), "{e}");
                }
            }
        }
    }

    #[test]
    fn bombs_stop_at_the_limit() {
        let bomb = gz(&vec![b'a'; 20 << 20]);
        let error = Input::from_reader(io::Cursor::new(bomb), Path::new("x")).unwrap().read_all(1 << 20);
        says(error, "more than 1048576 bytes");
    }

    #[test]
    fn folders_and_missing_files_are_named() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(open(folder.path()), Err(IoError::IsFolder { .. })));
        let Err(error) = open(folder.path().join("none.log")) else { panic!("opened a missing file") };
        assert!(error.to_string().contains("none.log: cannot open it"), "{error}");
    }
}
