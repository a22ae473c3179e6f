//! The data, one row after the other.

use std::fmt::Display;
use std::path::Path;

use super::header::{Element, Format, Header, Kind};
use crate::bytes::{Endian, Scalar, check_padding, parse_f64};
use crate::error::shown;
use crate::{IoError, Result};

/// Reads rows in the order of the file.
pub(super) struct Body<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    line: u64,
    format: Format,
    /// The values of the last row, by place of the property; the length of a list.
    pub(super) values: Vec<f64>,
    /// The items of the list that was asked for.
    pub(super) list: Vec<f64>,
}

impl<'a> Body<'a> {
    pub(super) fn of(header: &Header, bytes: &'a [u8], path: &'a Path) -> Self {
        let (at, line) = (header.body, header.body_line);
        Self { path, bytes, at, line, format: header.format, values: Vec::new(), list: Vec::new() }
    }

    /// Reads one row of an element into `values`, and the items of the list property `wanted` into `list`.
    pub(super) fn row(&mut self, element: &Element, wanted: Option<usize>) -> Result<()> {
        self.values.clear();
        self.list.clear();
        for (i, property) in element.properties.iter().enumerate() {
            let value = match property.kind {
                Kind::Value(scalar) => self.number(scalar, &property.name)?,
                Kind::List { length, item } => {
                    let count = self.number(length, &property.name)?;
                    if !(count >= 0.0 && count.fract() == 0.0) {
                        let advice = "a list starts with the number of its items";
                        return Err(self.error(shown(&property.name), count, advice));
                    }
                    self.items(count as u64, item, &property.name, wanted == Some(i))?;
                    count
                }
            };
            self.values.push(value);
        }
        Ok(())
    }

    /// Refuses data behind the last row.
    ///
    /// # Errors
    /// [`IoError::Binary`] for bytes that are no padding.
    pub(super) fn check_end(&self) -> Result<()> {
        check_padding(self.bytes.get(self.at..).unwrap_or(&[]), self.at as u64, "its elements", self.path)
    }

    fn items(&mut self, count: u64, item: Scalar, name: &str, keep: bool) -> Result<()> {
        // Each item takes bytes, so that a wrong length ends at the end of the file.
        for _ in 0..count {
            let value = self.number(item, name)?;
            if keep {
                self.list.push(value);
            }
        }
        Ok(())
    }

    fn number(&mut self, scalar: Scalar, name: &str) -> Result<f64> {
        match self.format {
            Format::Ascii => self.word(name),
            Format::Binary(endian) => self.binary(scalar, endian, name),
        }
    }

    #[inline]
    fn binary(&mut self, scalar: Scalar, endian: Endian, name: &str) -> Result<f64> {
        let end = self.at + scalar.size();
        let Some(bytes) = self.bytes.get(self.at..end) else {
            return Err(self.missing(name));
        };
        self.at = end;
        Ok(scalar.read(bytes, endian))
    }

    fn word(&mut self, name: &str) -> Result<f64> {
        while let Some(b) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += u64::from(*b == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|b| b.is_ascii_whitespace()).unwrap_or(rest.len());
        let word = &rest[..length];
        if word.is_empty() {
            return Err(self.missing(name));
        }
        let Some(value) = parse_f64(word) else {
            return Err(self.error(shown(name), shown(word), "write a number"));
        };
        self.at += length;
        Ok(value)
    }

    #[cold]
    fn missing(&self, name: &str) -> IoError {
        self.error(shown(name), "missing", "the header announces more: the file is cut off")
    }

    /// An error at the place where reading stands.
    #[cold]
    pub(super) fn error(&self, field: impl Display, value: impl Display, advice: impl Display) -> IoError {
        match self.format {
            Format::Ascii => IoError::text(self.path, self.line, field, value, advice),
            Format::Binary(_) => IoError::binary(self.path, self.at as u64, field, value, advice),
        }
    }
}
