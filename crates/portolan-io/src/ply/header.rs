//! The lines before the data.

use std::path::Path;

use crate::bytes::{Endian, Scalar, fields, header_line, whole};
use crate::error::shown;
use crate::{IoError, Result};

/// The most elements, and the most properties of one.
const MOST: usize = 256;

/// How the data is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    Binary(Endian),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Value(Scalar),
    List { length: Scalar, item: Scalar },
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// The place and type of the first value property with one of these names.
    pub(super) fn value(&self, names: &[&str]) -> Option<(usize, Scalar)> {
        names.iter().find_map(|n| {
            self.properties.iter().enumerate().find_map(|(i, p)| match p.kind {
                Kind::Value(scalar) if p.name == *n => Some((i, scalar)),
                _ => None,
            })
        })
    }

    /// The places and types of three value properties.
    pub(super) fn three(&self, names: [&[&str]; 3]) -> Option<[(usize, Scalar); 3]> {
        Some([self.value(names[0])?, self.value(names[1])?, self.value(names[2])?])
    }

    /// The place of the list of vertices.
    pub(super) fn indices(&self) -> Option<usize> {
        let named = |p: &Property| p.name == "vertex_indices" || p.name == "vertex_index";
        self.properties.iter().position(|p| named(p) && matches!(p.kind, Kind::List { .. }))
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) format: Format,
    pub(super) elements: Vec<Element>,
    /// `obj_info num_cols` and `num_rows`.
    pub(super) columns: Option<u64>,
    pub(super) rows: Option<u64>,
    /// Where the data begins: byte and number of the line.
    pub(super) body: usize,
    pub(super) body_line: u64,
}

pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Header> {
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    let (mut columns, mut rows) = (None, None);
    let (mut at, mut number) = (0, 0);
    loop {
        number += 1;
        let error = |field: &str, value: &[u8], advice: &str| {
            IoError::text(path, number, field, shown(value), advice)
        };
        let Some(line) = header_line(bytes, &mut at) else {
            let value = &bytes[at..bytes.len().min(at + 48)];
            return Err(error("the header", value, "give a PLY file, whose header ends with end_header"));
        };
        let words: Vec<&[u8]> = fields(line).take(8).collect();
        match words[..] {
            [b"ply"] if number == 1 => {}
            _ if number == 1 => {
                return Err(error("the first line", line, "give a PLY file, which starts with ply"));
            }
            [] | [b"comment", ..] => {}
            [b"obj_info", b"num_cols", n] => columns = whole(n),
            [b"obj_info", b"num_rows", n] => rows = whole(n),
            [b"obj_info", ..] => {}
            [b"format", b"ascii", ..] => format = Some(Format::Ascii),
            [b"format", b"binary_little_endian", ..] => format = Some(Format::Binary(Endian::Little)),
            [b"format", b"binary_big_endian", ..] => format = Some(Format::Binary(Endian::Big)),
            [b"element", name, count] if elements.len() < MOST => {
                let count = whole(count)
                    .ok_or_else(|| error("the number of an element", count, "write a whole number"))?;
                let name = String::from_utf8_lossy(name).into_owned();
                elements.push(Element { name, count, properties: Vec::new() });
            }
            [b"property", ..] => {
                let advice = "write property TYPE NAME or property list TYPE TYPE NAME below an element";
                let property = property(&words).ok_or_else(|| error("a property", line, advice))?;
                let element = elements.last_mut().filter(|e| e.properties.len() < MOST);
                element.ok_or_else(|| error("a property", line, advice))?.properties.push(property);
            }
            [b"end_header"] => break,
            _ => {
                let advice = "write format, element, property, comment, obj_info or end_header";
                return Err(error("a line of the header", line, advice));
            }
        }
    }
    let Some(format) = format else {
        let advice = "write format ascii 1.0, binary_little_endian 1.0 or binary_big_endian 1.0";
        return Err(IoError::text(path, number, "the format", "missing", advice));
    };
    if let Some(empty) = elements.iter().find(|e| e.properties.is_empty() && e.count > 0) {
        let field = format!("the number of properties of {}", shown(&empty.name));
        return Err(IoError::text(path, number, field, "0", "write its properties below the element"));
    }
    Ok(Header { format, elements, columns, rows, body: at, body_line: number + 1 })
}

fn property(words: &[&[u8]]) -> Option<Property> {
    let (kind, name) = match words {
        [_, b"list", length, item, name] => {
            let length = scalar(length).filter(|s| s.is_integer())?;
            (Kind::List { length, item: scalar(item)? }, name)
        }
        [_, kind, name] => (Kind::Value(scalar(kind)?), name),
        _ => return None,
    };
    Some(Property { name: String::from_utf8_lossy(name).to_ascii_lowercase(), kind })
}

fn scalar(word: &[u8]) -> Option<Scalar> {
    Some(match word {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => return None,
    })
}
