//! Where the bytes of a bag come from.

use std::fs::File;
use std::io::{self, Cursor, Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes that can be read from any place.
pub trait ReadSeek: Read + Seek {}

impl<T: Read + Seek> ReadSeek for T {}

/// Something that can be opened several times, from any thread, and has the same bytes each time.
pub trait Source: Send + Sync {
    /// The name that errors give.
    fn name(&self) -> &str;

    /// A reader of its own, at the start.
    ///
    /// # Errors
    /// Those of the system.
    fn open(&self) -> io::Result<Box<dyn ReadSeek + Send>>;
}

/// A file of the system.
#[derive(Clone, Debug)]
pub struct FileSource {
    path: PathBuf,
    name: String,
}

impl FileSource {
    /// The file at `path`; it is opened later.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        let name = path.display().to_string();
        Self { path, name }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Source for FileSource {
    fn name(&self) -> &str {
        &self.name
    }

    fn open(&self) -> io::Result<Box<dyn ReadSeek + Send>> {
        Ok(Box::new(File::open(&self.path)?))
    }
}

/// Bytes in memory.
#[derive(Clone, Debug)]
pub struct BytesSource {
    name: String,
    bytes: Arc<Vec<u8>>,
}

impl BytesSource {
    /// Bytes under the name that errors shall give.
    pub fn new(name: impl Into<String>, bytes: impl Into<Arc<Vec<u8>>>) -> Self {
        Self { name: name.into(), bytes: bytes.into() }
    }
}

/// Shared bytes as a slice, for a cursor.
struct Shared(Arc<Vec<u8>>);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl Source for BytesSource {
    fn name(&self) -> &str {
        &self.name
    }

    fn open(&self) -> io::Result<Box<dyn ReadSeek + Send>> {
        Ok(Box::new(Cursor::new(Shared(Arc::clone(&self.bytes)))))
    }
}
