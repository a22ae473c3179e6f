//! Reads at a place that never take more memory than the file has bytes.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

use super::source::{ReadSeek, Source};
use crate::{BagError, Result};

/// What to do about damage.
pub(crate) const CUT: &str =
    "the file is cut off or damaged: record or copy it again, or map what could be read by --allow-truncated";

/// Text of a file as part of a line.
pub(crate) fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}

/// A reader of one file of a bag.
pub(crate) struct FileReader {
    name: String,
    inner: BufReader<Box<dyn ReadSeek + Send>>,
    position: u64,
    size: u64,
}

impl FileReader {
    /// Opens the source.
    pub(crate) fn open(source: &dyn Source) -> Result<Self> {
        let failed = |action| move |cause| BagError::Os { name: source.name().to_owned(), action, cause };
        let mut inner = source.open().map_err(failed("open it"))?;
        let size = inner.seek(SeekFrom::End(0)).map_err(failed("find its size"))?;
        inner.seek(SeekFrom::Start(0)).map_err(failed("read it"))?;
        let inner = BufReader::with_capacity(1 << 16, inner);
        Ok(Self { name: source.name().to_owned(), inner, position: 0, size })
    }

    /// Bytes of the file.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// The file's name.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The error of a value that is wrong.
    pub(crate) fn wrong(
        &self,
        offset: u64,
        field: impl Into<String>,
        value: impl ToString,
        advice: impl Into<String>,
    ) -> BagError {
        let (name, value) = (self.name.clone(), one_line(&value.to_string()));
        BagError::Damaged { name, offset, field: one_line(&field.into()), value, advice: advice.into() }
    }

    /// The error of a value that can only come from damage.
    pub(crate) fn damaged(&self, offset: u64, field: impl Into<String>, value: impl ToString) -> BagError {
        self.wrong(offset, field, value, CUT)
    }

    /// Fills `buffer` from `offset` on.
    pub(crate) fn read_at(&mut self, offset: u64, buffer: &mut [u8], field: &str) -> Result<()> {
        self.check(offset, buffer.len() as u64, field)?;
        self.fill(offset, buffer).map_err(|cause| BagError::Os {
            name: self.name.clone(),
            action: "read it",
            cause,
        })
    }

    /// `length` bytes from `offset` on, as the only content of `buffer`.
    pub(crate) fn bytes_at(
        &mut self,
        offset: u64,
        length: u64,
        buffer: &mut Vec<u8>,
        field: &str,
    ) -> Result<()> {
        self.check(offset, length, field)?;
        buffer.clear();
        buffer.resize(length as usize, 0);
        self.read_at(offset, buffer, field)
    }

    /// Refuses what is past the end.
    pub(crate) fn check(&self, offset: u64, length: u64, field: &str) -> Result<()> {
        let rest = self.size.saturating_sub(offset);
        if length > rest {
            let value = format!("{length} bytes long where the file ends after {rest}");
            return Err(self.damaged(offset, field, value));
        }
        Ok(())
    }

    fn fill(&mut self, offset: u64, buffer: &mut [u8]) -> io::Result<()> {
        if offset != self.position {
            match i64::try_from(i128::from(offset) - i128::from(self.position)) {
                // Within what is buffered nothing is read again.
                Ok(step) => self.inner.seek_relative(step)?,
                Err(_) => drop(self.inner.seek(SeekFrom::Start(offset))?),
            }
            self.position = offset;
        }
        let read = self.inner.read_exact(buffer);
        match read {
            Ok(()) => self.position += buffer.len() as u64,
            // Where the reader stands now is not known.
            Err(_) => self.position = self.inner.stream_position()?,
        }
        read
    }
}
