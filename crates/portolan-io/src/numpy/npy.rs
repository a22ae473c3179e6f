//! `.npy`, version 1.0 of the format *(numpy/lib/format.py)*.

use std::io::{self, Read, Write};
use std::path::Path;

use super::{NpyArray, NpyValues};
use crate::bytes::{open, write_atomic};
use crate::error::shown;
use crate::{IoError, Result};

pub(super) const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// No header of an array of numbers is longer.
const LONGEST_HEADER: u64 = 1 << 16;

/// Writes one array.
///
/// # Errors
/// [`IoError::Unwritable`] where the number of values is not that of the shape, else as [`write_atomic`].
pub fn write_npy(path: impl AsRef<Path>, array: &NpyArray) -> Result<()> {
    let path = path.as_ref();
    check(path, array)?;
    write_atomic(path, |w| write(w, array))
}

/// Reads one array of a type that [`NpyValues`] has, little-endian.
///
/// # Errors
/// [`IoError::Binary`] where it is not such an array, or shorter or longer than its header announces.
pub fn read_npy(path: impl AsRef<Path>) -> Result<NpyArray> {
    let path = path.as_ref();
    parse_npy(open(path)?, path)
}

pub(super) fn check(path: &Path, array: &NpyArray) -> Result<()> {
    if NpyArray::cells(&array.shape) == Some(array.values.len()) {
        return Ok(());
    }
    let value = format!("{:?} for {} values", array.shape, array.values.len());
    Err(IoError::unwritable(path, "the shape", value, "give one value per cell"))
}

pub(super) fn write(w: &mut impl Write, array: &NpyArray) -> io::Result<()> {
    let axes: String = array.shape.iter().map(|n| format!("{n}, ")).collect();
    let axes = if array.shape.len() == 1 { axes.trim_end() } else { axes.trim_end_matches(", ") };
    let order = if array.fortran { "True" } else { "False" };
    let mut header = format!(
        "{{'descr': '{}', 'fortran_order': {order}, 'shape': ({axes}), }}",
        array.values.description()
    );
    // The values begin at a multiple of 64 bytes.
    while !(MAGIC.len() + 4 + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    w.write_all(MAGIC)?;
    w.write_all(&[1, 0])?;
    w.write_all(&(header.len() as u16).to_le_bytes())?;
    w.write_all(header.as_bytes())?;
    match &array.values {
        NpyValues::U8(v) => w.write_all(v),
        NpyValues::F16(v) => in_chunks(w, v, |v| v.to_le_bytes()),
        NpyValues::F32(v) => in_chunks(w, v, |v| v.to_le_bytes()),
        NpyValues::F64(v) => in_chunks(w, v, |v| v.to_le_bytes()),
        NpyValues::I64(v) => in_chunks(w, v, |v| v.to_le_bytes()),
        NpyValues::Text(text) => {
            let letters: Vec<u32> = text.chars().map(u32::from).collect();
            in_chunks(w, if letters.is_empty() { &[0] } else { &letters[..] }, |v| v.to_le_bytes())
        }
    }
}

fn in_chunks<T: Copy, const N: usize>(
    w: &mut impl Write,
    values: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> io::Result<()> {
    for chunk in values.chunks(1 << 13) {
        let packed: Vec<u8> = chunk.iter().flat_map(|v| bytes(*v)).collect();
        w.write_all(&packed)?;
    }
    Ok(())
}

/// [`read_npy`] from a stream that ends with the array; errors name it `path`.
///
/// # Errors
/// As [`read_npy`].
pub fn parse_npy(mut from: impl Read, path: &Path) -> Result<NpyArray> {
    let mut at = 0;
    let bad =
        |at: u64, field: &str, value: String, advice: &str| IoError::binary(path, at, field, value, advice);
    let mut take = |count: u64, field: &str| {
        let mut bytes = Vec::new();
        let read = from.by_ref().take(count).read_to_end(&mut bytes);
        read.map_err(|e| IoError::os(path, "read it", e))?;
        if bytes.len() as u64 != count {
            let value = format!("{} bytes", bytes.len());
            return Err(bad(at, field, value, &format!("the header announces {count}: the file is cut off")));
        }
        at += count;
        Ok(bytes)
    };
    let start = take(8, "the magic")?;
    if &start[..6] != MAGIC {
        return Err(bad(0, "the magic", shown(&start[..6]), "give a .npy file of numpy"));
    }
    let length = match start[6] {
        1 => u64::from(u16::from_le_bytes([take(1, "the header")?[0], take(1, "the header")?[0]])),
        2 | 3 => {
            let b = take(4, "the header")?;
            u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        }
        v => return Err(bad(6, "the version", v.to_string(), "it must be 1, 2 or 3")),
    };
    if length > LONGEST_HEADER {
        return Err(bad(8, "the header length", length.to_string(), "give an array of numbers"));
    }
    let header = take(length, "the header")?;
    let header = String::from_utf8_lossy(&header).into_owned();
    let wrong = |what: &str| bad(10, what, shown(&header), "give a little-endian array of numbers");
    let Some((kind, fortran, shape)) = parse(&header) else { return Err(wrong("the header")) };
    let width = width(&kind).ok_or_else(|| wrong("the type"))?;
    let cells = NpyArray::cells(&shape).map(|n| n as u64);
    let size = cells.and_then(|n| n.checked_mul(width)).ok_or_else(|| wrong("the shape"))?;
    let data = take(size, "the array")?;
    let mut rest = [0];
    let more = from.read(&mut rest).map_err(|e| IoError::os(path, "read it", e))?;
    if more > 0 {
        return Err(bad(at, "the file length", "longer".into(), "the header announces an end here"));
    }
    let values = match kind.as_str() {
        "|u1" => NpyValues::U8(data),
        "<f2" => NpyValues::F16(unpacked(&data, u16::from_le_bytes)),
        "<f4" => NpyValues::F32(unpacked(&data, f32::from_le_bytes)),
        "<f8" => NpyValues::F64(unpacked(&data, f64::from_le_bytes)),
        "<i8" => NpyValues::I64(unpacked(&data, i64::from_le_bytes)),
        _ if shape.is_empty() => {
            let letters = unpacked(&data, u32::from_le_bytes);
            let text: Option<String> = letters.iter().map(|c| char::from_u32(*c)).collect();
            NpyValues::Text(text.ok_or_else(|| wrong("the text"))?.trim_end_matches('\0').to_owned())
        }
        _ => return Err(wrong("the type")),
    };
    Ok(NpyArray { shape, fortran, values })
}

fn unpacked<T, const N: usize>(data: &[u8], value: impl Fn([u8; N]) -> T) -> Vec<T> {
    data.as_chunks::<N>().0.iter().map(|b| value(*b)).collect()
}

/// Bytes of a value.
fn width(kind: &str) -> Option<u64> {
    match kind {
        "|u1" => Some(1),
        "<f2" => Some(2),
        "<f4" => Some(4),
        "<f8" | "<i8" => Some(8),
        text => text.strip_prefix("<U")?.parse().ok().filter(|n| (1..=4096u64).contains(n)).map(|n| 4 * n),
    }
}

/// Type, order and shape of `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`.
fn parse(header: &str) -> Option<(String, bool, Vec<usize>)> {
    let after = |key: &str| Some(header.split_once(key)?.1.trim_start_matches([' ', ':']));
    let kind = after("'descr'")?.strip_prefix('\'')?.split_once('\'')?.0.to_owned();
    let order = after("'fortran_order'")?;
    let fortran = order.starts_with("True");
    if !fortran && !order.starts_with("False") {
        return None;
    }
    let axes = after("'shape'")?.strip_prefix('(')?.split_once(')')?.0;
    let axes = axes.split(',').map(str::trim).filter(|a| !a.is_empty());
    let shape = axes.map(|a| a.parse::<usize>().ok()).collect::<Option<Vec<_>>>()?;
    (shape.len() <= 32).then_some((kind, fortran, shape))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{no_panic, says, temporary};

    fn bytes_of(array: &NpyArray) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(&mut bytes, array).unwrap();
        bytes
    }

    #[test]
    fn round_trips() {
        for array in [
            NpyArray::c([2, 3], NpyValues::U8(vec![0, 1, 2, 3, 4, 255])),
            NpyArray::fortran([1, 2, 2], NpyValues::F32(vec![0.5, -1e30, f32::INFINITY, 2.0])),
            NpyArray::c([3], NpyValues::F16(vec![0x3c00, 0, 0xffff])),
            NpyArray::vector(&[1.0, -2.5]),
            NpyArray::number(0.05),
            NpyArray::c([2], NpyValues::I64(vec![-1, i64::MAX])),
            NpyArray::text("gpmp2 Ω"),
            NpyArray::text(""),
            NpyArray::c([0, 7], NpyValues::F64(vec![])),
        ] {
            let bytes = bytes_of(&array);
            assert_eq!(parse_npy(&bytes[..], "a.npy".as_ref()).unwrap(), array);
            let values = bytes.iter().position(|b| *b == b'\n').unwrap() + 1;
            assert_eq!(values % 64, 0);
        }
        let (_folder, path) = temporary("a.npy");
        write_npy(&path, &NpyArray::vector(&[4.0])).unwrap();
        assert_eq!(read_npy(&path).unwrap(), NpyArray::vector(&[4.0]));
    }

    /// What `numpy.save` writes, byte for byte.
    #[test]
    fn the_bytes_are_numpys() {
        let mut expected =
            b"\x93NUMPY\x01\0v\0{'descr': '<f4', 'fortran_order': True, 'shape': (2, 1), }".to_vec();
        expected.resize(127, b' ');
        expected.push(b'\n');
        expected.extend(b"\0\0\x80\x3f\0\0\0\xc0");
        assert_eq!(bytes_of(&NpyArray::fortran([2, 1], NpyValues::F32(vec![1.0, -2.0]))), expected);
        let scalar = bytes_of(&NpyArray::number(1.0));
        assert!(String::from_utf8_lossy(&scalar).contains("'shape': (), }"));
        let one = bytes_of(&NpyArray::vector(&[1.0]));
        assert!(String::from_utf8_lossy(&one).contains("'shape': (1,), }"));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let good = bytes_of(&NpyArray::vector(&[1.0, 2.0]));
        let error = |bytes: &[u8]| parse_npy(bytes, "a.npy".as_ref()).unwrap_err().to_string();
        assert!(error(&good[..good.len() - 1]).contains("the array is 15 bytes; the header announces 16"));
        assert!(error(&[&good[..], b"x"].concat()).contains("the file length is longer"));
        assert!(error(b"PK\x03\x04abcd").contains("the magic"));
        let with = |from: &str, to: &str| {
            let at = good.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
            let mut bytes = good.clone();
            bytes[at..at + from.len()].copy_from_slice(to.as_bytes());
            bytes
        };
        assert!(error(&with("<f8", ">f8")).contains("the type"));
        assert!(error(&with("<f8", "|O8")).contains("the type"));
        assert!(error(&with("(2,), }     ", "(2, -3), }  ")).contains("the header"));
        let huge = format!("({}, 9)", u64::MAX);
        assert!(
            error(&with(&format!("(2,), }}{}", " ".repeat(huge.len() - 7)), &huge)).contains("the shape")
        );
        let wrong = NpyArray::c([2], NpyValues::U8(vec![1]));
        says(write_npy("never.npy", &wrong), "the shape");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let good = bytes_of(&NpyArray::fortran([2, 2], NpyValues::F32(vec![1.0; 4])));
        no_panic(&good, 21, 3000, |bytes| parse_npy(&bytes[..], "a.npy".as_ref()));
    }
}
