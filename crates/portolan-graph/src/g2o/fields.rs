//! The lines of a g2o file and their fields, and the errors in them.

use std::io::BufRead;

use crate::error::GraphError;

/// Longest line accepted (bytes); the longest 3-D edge takes about 700.
pub(super) const LONGEST_LINE: usize = 1 << 16;

/// Why a g2o file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum G2oError {
    /// The file could not be read.
    #[error("{name}, line {line}: {source}")]
    Io {
        /// The file.
        name: String,
        /// The line, from 1.
        line: usize,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The file holds no vertex and no edge.
    #[error("{name}: no pose graph ({lines} lines without a vertex or an edge)")]
    Empty {
        /// The file.
        name: String,
        /// Lines in it.
        lines: usize,
    },
    /// A line is too long.
    #[error("{name}, line {line}: longer than {LONGEST_LINE} bytes")]
    LineTooLong {
        /// The file.
        name: String,
        /// The line, from 1.
        line: usize,
    },
    /// A line ends before its fields do.
    #[error("{name}, line {line}: {tag} ends before its field {field}")]
    Missing {
        /// The file.
        name: String,
        /// The line, from 1.
        line: usize,
        /// First word of the line.
        tag: &'static str,
        /// The field.
        field: String,
    },
    /// A line goes on after its last field.
    #[error("{name}, line {line}: {tag} goes on with {value:?} after its last field")]
    Surplus {
        /// The file.
        name: String,
        /// The line, from 1.
        line: usize,
        /// First word of the line.
        tag: &'static str,
        /// What stands there.
        value: String,
    },
    /// A field holds a value of the wrong kind.
    #[error("{name}, line {line}: {tag} has {value:?} in its field {field}, not {expected}")]
    Value {
        /// The file.
        name: String,
        /// The line, from 1.
        line: usize,
        /// First word of the line.
        tag: &'static str,
        /// The field.
        field: String,
        /// The text of the field.
        value: String,
        /// What the field must hold.
        expected: &'static str,
    },
    /// One file holds 2-D and 3-D poses.
    #[error("{name}, line {line}: {tag} in a file that began with the other dimension")]
    MixedDimensions {
        /// The file.
        name: String,
        /// The line, from 1.
        line: usize,
        /// First word of the line.
        tag: &'static str,
    },
    /// The graph refuses the line: a second vertex with the same id, an edge to a vertex that is missing from a file
    /// with vertices, information that is not positive definite.
    #[error("{name}, line {line}: {source}")]
    Graph {
        /// The file.
        name: String,
        /// The line, from 1.
        line: usize,
        /// The reason.
        source: GraphError,
    },
}

/// Reads a line without its end into `buffer`, never more than [`LONGEST_LINE`] bytes; `false` at the end.
pub(super) fn next_line(
    input: &mut impl BufRead,
    buffer: &mut Vec<u8>,
    name: &str,
    line: usize,
) -> Result<bool, G2oError> {
    buffer.clear();
    let limit = LONGEST_LINE as u64 + 1;
    let read = std::io::Read::take(&mut *input, limit)
        .read_until(b'\n', buffer)
        .map_err(|source| G2oError::Io { name: name.into(), line, source })?;
    if read > LONGEST_LINE {
        return Err(G2oError::LineTooLong { name: name.into(), line });
    }
    Ok(read > 0)
}

/// The fields of one line after its tag.
pub(super) struct Fields<'a> {
    pub(super) name: &'a str,
    pub(super) line: usize,
    pub(super) tag: &'static str,
    words: std::str::SplitAsciiWhitespace<'a>,
}

impl<'a> Fields<'a> {
    pub(super) fn new(name: &'a str, line: usize, tag: &'static str, rest: &'a str) -> Self {
        Self { name, line, tag, words: rest.split_ascii_whitespace() }
    }

    /// The next word, if there is one.
    pub(super) fn more(&mut self) -> Option<&'a str> {
        self.words.next()
    }

    fn word(&mut self, field: &str) -> Result<&'a str, G2oError> {
        let (name, line, tag) = (self.name, self.line, self.tag);
        self.more().ok_or_else(|| G2oError::Missing { name: name.into(), line, tag, field: field.into() })
    }

    pub(super) fn wrong(&self, field: &str, value: &str, expected: &'static str) -> G2oError {
        G2oError::Value {
            name: self.name.into(),
            line: self.line,
            tag: self.tag,
            field: field.into(),
            value: shortened(value),
            expected,
        }
    }

    pub(super) fn refused(&self, source: GraphError) -> G2oError {
        G2oError::Graph { name: self.name.into(), line: self.line, source }
    }

    pub(super) fn parse_id(&self, field: &str, word: &str) -> Result<u64, G2oError> {
        word.parse().map_err(|_| self.wrong(field, word, "a whole number from 0 to 2^64 - 1"))
    }

    pub(super) fn id(&mut self, field: &str) -> Result<u64, G2oError> {
        let word = self.word(field)?;
        self.parse_id(field, word)
    }

    pub(super) fn number(&mut self, field: &str) -> Result<f64, G2oError> {
        let word = self.word(field)?;
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.wrong(field, word, "a finite number")),
        }
    }

    pub(super) fn numbers<const N: usize>(&mut self, fields: [&str; N]) -> Result<[f64; N], G2oError> {
        let mut values = [0.0; N];
        for (value, field) in values.iter_mut().zip(fields) {
            *value = self.number(field)?;
        }
        Ok(values)
    }

    pub(super) fn end(&mut self) -> Result<(), G2oError> {
        match self.more() {
            None => Ok(()),
            Some(word) => Err(G2oError::Surplus {
                name: self.name.into(),
                line: self.line,
                tag: self.tag,
                value: shortened(word),
            }),
        }
    }
}

/// The first 40 characters: error messages quote files that may hold anything.
pub(super) fn shortened(word: &str) -> String {
    let mut short: String = word.chars().take(40).collect();
    if short.len() < word.len() {
        short.push_str("...");
    }
    short
}
