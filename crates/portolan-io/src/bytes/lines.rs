//! Lines of bounded length.

use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};

use super::{Compression, Input, read_failed};
use crate::{IoError, Result};

/// The longest line that any text format here may have (bytes).
const LONGEST_LINE: usize = 4 << 20;

/// Reads lines one after the other into one buffer that never grows beyond [`LONGEST_LINE`].
pub(crate) struct Lines<R> {
    path: PathBuf,
    compression: Compression,
    reader: R,
    line: Vec<u8>,
    number: u64,
    offset: u64,
}

impl Lines<Input> {
    pub(crate) fn of(input: Input) -> Self {
        let (path, compression) = (input.path().to_owned(), input.compression());
        Self { path, compression, reader: input, line: Vec::new(), number: 0, offset: 0 }
    }
}

impl<R: BufRead> Lines<R> {
    #[cfg(test)]
    pub(crate) fn plain(reader: R, name: &Path) -> Self {
        let compression = Compression::Plain;
        Self { path: name.into(), compression, reader, line: Vec::new(), number: 0, offset: 0 }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Number of the line that was read last, from 1.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// The number of the next line, and the line.
    pub(crate) fn next_numbered(&mut self) -> Result<Option<(u64, &[u8])>> {
        let number = self.number + 1;
        Ok(self.next_line()?.map(|line| (number, line)))
    }

    /// The next line without its end, `None` at the end of the file.
    pub(crate) fn next_line(&mut self) -> Result<Option<&[u8]>> {
        self.line.clear();
        let limit = LONGEST_LINE as u64 + 2;
        let read = self.reader.by_ref().take(limit).read_until(b'\n', &mut self.line);
        self.offset += self.line.len() as u64;
        if let Err(e) = read {
            return Err(read_failed(&self.path, self.compression, self.offset, e));
        }
        if self.line.is_empty() {
            return Ok(None);
        }
        self.number += 1;
        // A byte order mark, as spreadsheets and editors write it.
        if self.number == 1 && self.line.starts_with(b"\xef\xbb\xbf") {
            self.line.drain(..3);
        }
        for end in [b'\n', b'\r'] {
            self.line.pop_if(|last| *last == end);
        }
        if self.line.len() > LONGEST_LINE {
            let value = format!("longer than {LONGEST_LINE} bytes");
            let advice = "check that this is a text file";
            return Err(IoError::text(&self.path, self.number, "the line", value, advice));
        }
        Ok(Some(&self.line))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::says;

    #[test]
    fn ends_of_lines_are_dropped_and_long_lines_refused() {
        let mut lines = Lines::plain(&b"\xef\xbb\xbfa\r\n\nb"[..], Path::new("x"));
        assert_eq!(lines.next_line().unwrap(), Some(&b"a"[..]));
        assert_eq!(lines.next_line().unwrap(), Some(&b""[..]));
        assert_eq!(lines.next_line().unwrap(), Some(&b"b"[..]));
        assert_eq!(lines.next_line().unwrap(), None);
        assert_eq!(lines.number(), 3);
        let long = vec![b'z'; 3 * LONGEST_LINE];
        let mut lines = Lines::plain(&long[..], Path::new("x"));
        says(lines.next_line(), "x: line 1: the line is longer than");
    }
}
