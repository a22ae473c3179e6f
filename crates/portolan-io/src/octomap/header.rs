//! The lines before the nodes.

use std::io::{BufRead, Read};
use std::path::Path;

use super::MOST_NODES;
use crate::bytes::{Compression, fields, parse_f64, read_failed};
use crate::error::shown;
use crate::{IoError, Result};

/// The most bytes of a header; comments are part of it.
const LONGEST: u64 = 1 << 20;
/// What OctoMap writes below the first line.
const COMMENT: &str = "# (feel free to add / change comments, but leave the first line as it is!)\n#\n";

/// Which of the two formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Bt,
    Ot,
}

impl Kind {
    pub(super) fn first_line(self) -> &'static str {
        match self {
            Self::Bt => "# Octomap OcTree binary file",
            Self::Ot => "# Octomap OcTree file",
        }
    }
}

/// A header as it was read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub kind: Kind,
    /// Name of the tree's class.
    pub class: String,
    /// Inner nodes and leaves.
    pub size: u64,
    /// Meters per cell.
    pub resolution: f64,
    /// All lines, the one with `data` included.
    lines: Vec<u8>,
}

impl Header {
    /// The header that OctoMap writes.
    pub(super) fn new(kind: Kind, size: u64, resolution: f64) -> Self {
        let first = kind.first_line();
        let lines = format!("{first}\n{COMMENT}id OcTree\nsize {size}\nres {resolution}\ndata\n").into();
        Self { kind, class: "OcTree".into(), size, resolution, lines }
    }

    /// Reads the lines; what follows them is left in the reader.
    pub(super) fn read(reader: &mut impl BufRead, packed: Compression, path: &Path) -> Result<Self> {
        let mut header =
            Self { kind: Kind::Bt, class: String::new(), size: 0, resolution: 0.0, lines: Vec::new() };
        let (mut size, mut resolution) = (None, None);
        for number in 1.. {
            let start = header.lines.len();
            let left = LONGEST - start as u64;
            let read = reader.by_ref().take(left).read_until(b'\n', &mut header.lines);
            read.map_err(|e| read_failed(path, packed, header.lines.len() as u64, e))?;
            let line = &header.lines[start..];
            let bad = |field: &str, value: &[u8], advice: &str| {
                Err(IoError::text(path, number, field, shown(value), advice))
            };
            if line.is_empty() {
                let advice = "give an OctoMap file: its header ends with a line \"data\"";
                return bad("the header", b"", advice);
            }
            if number == 1 {
                header.kind = match [Kind::Bt, Kind::Ot].iter().find(|k| starts_with(line, k.first_line())) {
                    Some(&kind) => kind,
                    None => {
                        return bad("the first line", line.trim_ascii_end(), "give an OctoMap .bt or .ot");
                    }
                };
                continue;
            }
            let mut words = fields(line);
            let (key, value) = (words.next().unwrap_or(b"#"), words.next().unwrap_or(b""));
            match key {
                b"id" if value.is_empty() => {
                    return bad("the class (id)", value, "name it, as in: id OcTree");
                }
                // Old files have the number.
                b"id" if value == b"1" => header.class = "OcTree".into(),
                b"id" => header.class = String::from_utf8_lossy(value).into_owned(),
                b"size" => match std::str::from_utf8(value).ok().and_then(|v| v.parse().ok()) {
                    Some(n) if n <= MOST_NODES => size = Some(n),
                    _ => return bad("the size", value, &format!("give at most {MOST_NODES} nodes")),
                },
                b"res" => match parse_f64(value) {
                    Some(r) if (1e-9..=1e9).contains(&r) => resolution = Some(r),
                    _ => return bad("the resolution (res)", value, "give metres per cell, above zero"),
                },
                b"data" => {
                    for (field, there) in [
                        ("the class (id)", !header.class.is_empty()),
                        ("the size", size.is_some()),
                        ("the resolution (res)", resolution.is_some()),
                    ] {
                        if !there {
                            return bad(field, b"", "it has to stand before the line \"data\"");
                        }
                    }
                    header.size = size.unwrap_or(0);
                    header.resolution = resolution.unwrap_or(1.0);
                    break;
                }
                // Comments and, as OctoMap does it, words that are not known.
                _ => {}
            }
        }
        Ok(header)
    }

    /// Number of bytes.
    pub(super) fn len(&self) -> u64 {
        self.lines.len() as u64
    }

    /// The bytes.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.lines
    }

    /// The same header, comments and all, for another file: what does not change stays to the byte.
    pub(super) fn changed(&self, kind: Kind, class: &str, size: u64) -> Self {
        let mut lines = Vec::with_capacity(self.lines.len());
        for (i, line) in self.lines.split_inclusive(|&b| b == b'\n').enumerate() {
            match fields(line).next() {
                _ if i == 0 && kind != self.kind => lines.extend(format!("{}\n", kind.first_line()).bytes()),
                Some(b"id") if class != self.class => lines.extend(format!("id {class}\n").bytes()),
                Some(b"size") if size != self.size => lines.extend(format!("size {size}\n").bytes()),
                _ => lines.extend(line),
            }
        }
        Self { kind, class: class.into(), size, resolution: self.resolution, lines }
    }
}

fn starts_with(line: &[u8], text: &str) -> bool {
    line.starts_with(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::says;

    fn read(text: &str) -> Result<Header> {
        Header::read(&mut text.as_bytes(), Compression::Plain, Path::new("a.bt"))
    }

    #[test]
    fn comments_and_unknown_words_are_kept() {
        let text =
            "# Octomap OcTree binary file\n# mine\n\nframe map\nres 0.05\nid SemanticOcTree\nsize 17\ndata\n";
        let header = read(&format!("{text}\u{1}\u{2}")).unwrap();
        assert_eq!(
            (header.class.as_str(), header.size, header.resolution, header.kind),
            ("SemanticOcTree", 17, 0.05, Kind::Bt)
        );
        assert_eq!((header.bytes(), header.len()), (text.as_bytes(), text.len() as u64));
        assert_eq!(header.changed(Kind::Bt, "SemanticOcTree", 17), header);
        let changed = String::from_utf8(header.changed(Kind::Ot, "OcTree", 9).lines).unwrap();
        assert_eq!(
            changed,
            "# Octomap OcTree file\n# mine\n\nframe map\nres 0.05\nid OcTree\nsize 9\ndata\n"
        );
        let own = Header::new(Kind::Ot, 5, 0.1);
        assert_eq!(Header::read(&mut own.bytes(), Compression::Plain, Path::new("a")).unwrap(), own);
    }

    #[test]
    fn wrong_fields_are_named() {
        let first = "# Octomap OcTree binary file\n";
        for (text, part) in [
            ("", "a.bt: line 1: the header is missing"),
            ("# Octomap\n", "line 1: the first line is \"# Octomap\""),
            ("# Octomap OcTree binary file", "line 2: the header is missing"),
            ("id OcTree\nsize 1\nres 0.1\n", "line 5: the header is missing"),
            ("id\nsize 1\nres 0.1\ndata\n", "line 2: the class (id) is missing"),
            ("size 1\nres 0.1\ndata\n", "line 4: the class (id) is missing"),
            ("id A\nres 0.1\ndata\n", "line 4: the size is missing"),
            ("id A\nsize 1\ndata\n", "line 4: the resolution (res) is missing"),
            ("id A\nsize -1\n", "line 3: the size is \"-1\""),
            ("id A\nsize 4294967296\n", "line 3: the size is \"4294967296\""),
            ("id A\nsize 1\nres 0\n", "line 4: the resolution (res) is \"0\""),
            ("id A\nsize 1\nres nan\n", "line 4: the resolution (res) is \"nan\""),
        ] {
            let whole =
                if text.starts_with('#') || text.is_empty() { text.into() } else { format!("{first}{text}") };
            says(read(&whole), part);
        }
        let endless = format!("{first}{}", "# x\n".repeat(1 << 19));
        says(read(&endless), "the header is missing");
    }
}
