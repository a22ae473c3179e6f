//! Rows: varints, serial types, values.

use std::ops::Range;

use super::super::reader::FileReader;
use super::pages::{Cell, Leaf, Pages, TextEncoding};
use crate::Result;

/// A value of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Null,
    Integer(i64),
    Text(String),
    /// A real number or bytes: nothing that is asked for here.
    Other,
}

/// Where a column is in the payload, and its kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Column {
    serial: i64,
    pub(super) bytes: Range<u64>,
}

impl Column {
    /// Whether it holds bytes or text.
    pub(super) fn is_data(&self) -> bool {
        self.serial >= 12
    }

    fn is_text(&self) -> bool {
        self.serial >= 13 && self.serial % 2 == 1
    }
}

/// A number of one to nine bytes, and how many; `None`: the bytes end first.
pub(super) fn varint(bytes: &[u8]) -> Option<(i64, usize)> {
    let mut value = 0u64;
    for i in 0..8 {
        let byte = *bytes.get(i)?;
        value = value << 7 | u64::from(byte & 0x7f);
        if byte < 0x80 {
            return Some((value as i64, i + 1));
        }
    }
    Some(((value << 8 | u64::from(*bytes.get(8)?)) as i64, 9))
}

/// The columns of a row, as many as the row has: a column that was added to the table later is missing in older rows.
pub(super) fn columns(
    pages: &Pages,
    reader: &mut FileReader,
    leaf: &Leaf,
    cell: &Cell,
) -> Result<Vec<Column>> {
    let mut head = Vec::new();
    let wrong =
        |reader: &FileReader| reader.damaged(pages.place(leaf.number()), "the header of a row", "damaged");
    pages.payload(reader, leaf, cell, 0..cell.payload.min(9), &mut head)?;
    let (size, first) = varint(&head).ok_or_else(|| wrong(reader))?;
    let size = u64::try_from(size).ok().filter(|s| *s <= cell.payload).ok_or_else(|| wrong(reader))?;
    pages.payload(reader, leaf, cell, 0..size, &mut head)?;
    let mut rest = head.get(first..).ok_or_else(|| wrong(reader))?;
    let (mut columns, mut at) = (Vec::new(), size);
    while !rest.is_empty() {
        let (serial, length) = varint(rest).ok_or_else(|| wrong(reader))?;
        rest = &rest[length..];
        let width = match serial {
            0 | 8 | 9 => 0,
            1..=4 => serial as u64,
            5 => 6,
            6 | 7 => 8,
            12.. => (serial as u64 - 12) / 2,
            _ => return Err(wrong(reader)),
        };
        let end = at.checked_add(width).filter(|e| *e <= cell.payload).ok_or_else(|| wrong(reader))?;
        columns.push(Column { serial, bytes: at..end });
        at = end;
    }
    Ok(columns)
}

/// The value of a column; null where the row has none.
pub(super) fn value(
    pages: &Pages,
    reader: &mut FileReader,
    leaf: &Leaf,
    cell: &Cell,
    column: Option<&Column>,
) -> Result<Value> {
    let Some(column) = column else { return Ok(Value::Null) };
    match column.serial {
        0 => return Ok(Value::Null),
        8 | 9 => return Ok(Value::Integer(column.serial - 8)),
        1..=6 => {}
        _ if column.is_text() => {}
        _ => return Ok(Value::Other),
    }
    let mut bytes = Vec::new();
    pages.payload(reader, leaf, cell, column.bytes.clone(), &mut bytes)?;
    if column.is_text() {
        return Ok(Value::Text(text(&bytes, pages.text)));
    }
    let negative = bytes.first().is_some_and(|b| *b >= 0x80);
    let start = if negative { -1 } else { 0 };
    Ok(Value::Integer(bytes.iter().fold(start, |value, byte| value << 8 | i64::from(*byte))))
}

fn text(bytes: &[u8], encoding: TextEncoding) -> String {
    let pairs = bytes.as_chunks::<2>().0.iter();
    match encoding {
        TextEncoding::Utf8 => String::from_utf8_lossy(bytes).into_owned(),
        TextEncoding::Utf16Le => {
            String::from_utf16_lossy(&pairs.map(|p| u16::from_le_bytes(*p)).collect::<Vec<_>>())
        }
        TextEncoding::Utf16Be => {
            String::from_utf16_lossy(&pairs.map(|p| u16::from_be_bytes(*p)).collect::<Vec<_>>())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn varints_of_every_length() {
        for (bytes, value) in [
            (&[0x7f][..], 127),
            (&[0x81, 0x00], 128),
            (&[0x82, 0x80, 0x01], 32769),
            (&[0xff; 9], -1),
            (&[0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 5], 5),
        ] {
            assert_eq!(varint(bytes), Some((value, bytes.len())));
            assert_eq!(varint(&bytes[..bytes.len() - 1]), None);
        }
    }
}
