//! The lines before the points.

use std::path::Path;

use crate::bytes::{Scalar, fields, header_line, parse_f64, whole};
use crate::error::shown;
use crate::points::Viewpoint;
use crate::{IoError, Result};

/// The most fields, and the most values of a point.
const MOST_FIELDS: usize = 256;
const MOST_COUNT: usize = 1 << 14;
/// The most points that a cloud may have.
const MOST_POINTS: usize = 1 << 30;

/// How points follow the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Data {
    Ascii,
    Binary,
    Compressed,
}

/// One field of a point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) scalar: Scalar,
    /// Values per point.
    pub(super) count: usize,
    /// Bytes before it in a point.
    pub(super) offset: usize,
    /// Words before it in a line.
    pub(super) word: usize,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) viewpoint: Option<Viewpoint>,
    pub(super) data: Data,
    /// Bytes of a point.
    pub(super) stride: usize,
    /// Words of a point.
    pub(super) words: usize,
    /// Where the points begin: byte and number of the line.
    pub(super) body: usize,
    pub(super) body_line: u64,
}

impl Header {
    pub(super) fn points(&self) -> usize {
        self.width * self.height
    }

    pub(super) fn field(&self, names: &[&str]) -> Option<&Field> {
        names.iter().find_map(|n| self.fields.iter().find(|f| f.name == *n))
    }
}

/// The words of each line of the header that is known.
#[derive(Default)]
struct Lines<'a> {
    names: Vec<&'a [u8]>,
    sizes: Vec<&'a [u8]>,
    types: Vec<&'a [u8]>,
    counts: Vec<&'a [u8]>,
    width: Option<usize>,
    height: Option<usize>,
    points: Option<usize>,
    viewpoint: Option<Viewpoint>,
}

pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Header> {
    let mut lines = Lines::default();
    let (mut at, mut number) = (0, 0);
    let data = loop {
        number += 1;
        let Some(line) = header_line(bytes, &mut at) else {
            let advice = "give a PCD file, whose header ends with a line DATA";
            let value = shown(&bytes[at..bytes.len().min(at + 48)]);
            return Err(IoError::text(path, number, "the header", value, advice));
        };
        let mut words = fields(line);
        let Some(key) = words.next() else { continue };
        let words: Vec<&[u8]> = words.take(MOST_FIELDS + 1).collect();
        let first = words.first().copied().unwrap_or_default();
        let size = || whole(first).ok_or_else(|| bad(path, number, key, first, "write a whole number"));
        match key {
            b"VERSION" => {}
            b"FIELDS" | b"COLUMNS" => lines.names = words,
            b"SIZE" => lines.sizes = words,
            b"TYPE" => lines.types = words,
            b"COUNT" => lines.counts = words,
            b"WIDTH" => lines.width = Some(size()?),
            b"HEIGHT" => lines.height = Some(size()?),
            b"POINTS" => lines.points = Some(size()?),
            b"VIEWPOINT" => {
                let viewpoint = viewpoint(&words);
                let advice = "write seven numbers: x y z qw qx qy qz";
                lines.viewpoint = Some(viewpoint.ok_or_else(|| bad(path, number, key, line, advice))?);
            }
            b"DATA" => match first {
                b"ascii" => break Data::Ascii,
                b"binary" => break Data::Binary,
                b"binary_compressed" => break Data::Compressed,
                _ => {
                    let advice = "write ascii, binary or binary_compressed";
                    return Err(bad(path, number, key, first, advice));
                }
            },
            [b'#', ..] => {}
            _ => {
                let advice =
                    "write VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS or DATA";
                return Err(IoError::text(path, number, "the first word", shown(key), advice));
            }
        }
    };
    let fields = lines.fields(data, path)?;
    let (width, height) = lines.shape(path)?;
    let last = fields.last().map_or((0, 0), |f| (f.offset + f.count * f.scalar.size(), f.word + f.count));
    let viewpoint = lines.viewpoint;
    let (stride, words) = last;
    Ok(Header { fields, width, height, viewpoint, data, stride, words, body: at, body_line: number + 1 })
}

impl Lines<'_> {
    fn fields(&self, data: Data, path: &Path) -> Result<Vec<Field>> {
        let n = self.names.len();
        let wrong =
            |what: &str, value: String, advice: &str| Err(IoError::text(path, 1, what, value, advice));
        if n == 0 || n > MOST_FIELDS {
            return wrong("the number of FIELDS", n.to_string(), "write a line FIELDS x y z");
        }
        let same = |list: &[&[u8]], optional: bool| list.len() == n || (optional && list.is_empty());
        if !same(&self.sizes, false) || !same(&self.types, false) || !same(&self.counts, true) {
            let value =
                format!("{} SIZE, {} TYPE, {} COUNT", self.sizes.len(), self.types.len(), self.counts.len());
            return wrong("the description of fields", value, &format!("write {n} of each, as FIELDS has"));
        }
        let (mut offset, mut word) = (0, 0);
        let mut fields = Vec::with_capacity(n);
        for i in 0..n {
            let name = String::from_utf8_lossy(self.names[i]).to_ascii_lowercase();
            let Some(scalar) = scalar(self.types[i], self.sizes[i]) else {
                let value = format!("{} of size {}", shown(self.types[i]), shown(self.sizes[i]));
                return wrong("a TYPE", value, "write I or U of 1, 2, 4, 8 bytes, or F of 4 or 8");
            };
            let count = self.counts.get(i).map_or(Some(1), |w| whole(w)).filter(|c| *c <= MOST_COUNT - word);
            let Some(count) = count else {
                return wrong(
                    "a COUNT",
                    shown(self.counts[i]),
                    &format!("write at most {MOST_COUNT} in all"),
                );
            };
            // Text may hold more digits than the float that the header speaks of.
            let coordinate = ["x", "y", "z"].contains(&name.as_str());
            let text = data == Data::Ascii && scalar == Scalar::F32 && coordinate;
            let scalar = if text { Scalar::F64 } else { scalar };
            fields.push(Field { name, scalar, count, offset, word });
            offset += count * scalar.size();
            word += count;
        }
        Ok(fields)
    }

    /// Columns and rows.
    fn shape(&self, path: &Path) -> Result<(usize, usize)> {
        let (width, height) = match (self.width, self.height, self.points) {
            (Some(width), height, _) => (width, height.unwrap_or(1)),
            (None, _, Some(points)) => (points, 1),
            (None, _, None) => {
                return Err(IoError::text(path, 1, "WIDTH", "missing", "write WIDTH, HEIGHT and POINTS"));
            }
        };
        let count = width.checked_mul(height).filter(|n| *n <= MOST_POINTS);
        if count.is_none() || self.points.is_some_and(|p| Some(p) != count) {
            let points = self.points.map_or("no POINTS".to_owned(), |p| format!("{p} POINTS"));
            let value = format!("{width} x {height} with {points}");
            let advice = format!("write WIDTH x HEIGHT = POINTS, at most {MOST_POINTS}");
            return Err(IoError::text(path, 1, "the size of the cloud", value, advice));
        }
        Ok((width, height))
    }
}

fn bad(path: &Path, number: u64, key: &[u8], value: &[u8], advice: &str) -> IoError {
    IoError::text(path, number, String::from_utf8_lossy(key), shown(value), advice)
}

fn scalar(kind: &[u8], size: &[u8]) -> Option<Scalar> {
    Some(match (kind, size) {
        (b"I", b"1") => Scalar::I8,
        (b"I", b"2") => Scalar::I16,
        (b"I", b"4") => Scalar::I32,
        (b"I", b"8") => Scalar::I64,
        (b"U", b"1") => Scalar::U8,
        (b"U", b"2") => Scalar::U16,
        (b"U", b"4") => Scalar::U32,
        (b"U", b"8") => Scalar::U64,
        (b"F", b"4") => Scalar::F32,
        (b"F", b"8") => Scalar::F64,
        _ => return None,
    })
}

fn viewpoint(words: &[&[u8]]) -> Option<Viewpoint> {
    let numbers: Option<Vec<f64>> = words.iter().map(|w| parse_f64(w).filter(|v| v.is_finite())).collect();
    let [x, y, z, qw, qx, qy, qz] = *numbers? else { return None };
    Some(Viewpoint { position: [x, y, z], quaternion: [qx, qy, qz, qw] })
}
