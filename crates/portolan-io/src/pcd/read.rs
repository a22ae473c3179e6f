//! From bytes to a cloud.

use std::path::Path;

use super::columns::{Column, rgb};
use super::header::{self, Data, Field, Header};
use super::lzf;
use crate::bytes::{Input, Scalar, check_padding, fields, open, parse_f64};
use crate::error::shown;
use crate::points::{CloudBuilder, PointCloudFile, PointFields, Viewpoint, is_time, most_bytes};
use crate::{IoError, Result};

/// A header is no longer than this (bytes).
const LONGEST_HEADER: u64 = 64 << 10;

/// Reads a PCD file, plain or packed by gzip or bzip2. Points are in the file's frame: the viewpoint is reported, not applied.
/// NaN points of an organized cloud are pixels without a reading; in other clouds they are refused.
///
/// # Errors
/// [`IoError::Text`] for a wrong header or a wrong line, [`IoError::Binary`] for a body that is too short or damaged.
pub fn read_pcd(path: impl AsRef<Path>) -> Result<PointCloudFile> {
    parse(open(path)?)
}

/// The viewpoint in a file's header.
pub(crate) fn read_viewpoint(path: &Path) -> Result<Option<Viewpoint>> {
    let head = open(path)?.read_up_to(LONGEST_HEADER)?;
    Ok(header::parse(&head, path)?.viewpoint)
}

pub(crate) fn parse(mut input: Input) -> Result<PointCloudFile> {
    let bytes = input.read_all(most_bytes(&input))?;
    parse_bytes(&bytes, input.path())
}

fn parse_bytes(bytes: &[u8], path: &Path) -> Result<PointCloudFile> {
    let header = header::parse(bytes, path)?;
    let body = &bytes[header.body..];
    match header.data {
        Data::Ascii => {
            // Text is turned into the columns that the header describes, so that all three layouts are read by one piece
            // of code.
            let packed = text_to_binary(body, &header, path)?;
            cloud(&packed, &header, path)
        }
        Data::Binary => {
            let size = size_of(&header, path)?;
            if body.len() < size {
                let advice = format!("the header announces {size}: the file is cut off");
                let value = format!("{} bytes", body.len());
                return Err(IoError::binary(path, header.body as u64, "the data", value, advice));
            }
            let behind = header.body as u64 + size as u64;
            check_padding(&body[size..], behind, &format!("{} points", header.points()), path)?;
            cloud(&body[..size], &header, path)
        }
        Data::Compressed => cloud(&unpack(body, &header, path)?, &header, path),
    }
}

/// Bytes of all points.
fn size_of(header: &Header, path: &Path) -> Result<usize> {
    header.points().checked_mul(header.stride).ok_or_else(|| {
        let value = format!("{} points of {} bytes", header.points(), header.stride);
        IoError::binary(path, header.body as u64, "the size of the data", value, "split the file")
    })
}

fn unpack(body: &[u8], header: &Header, path: &Path) -> Result<Vec<u8>> {
    let at = header.body as u64;
    let size = size_of(header, path)?;
    let word = |k: usize| {
        body.get(4 * k..4 * k + 4).map(|b| Scalar::U32.read(b, crate::bytes::Endian::Little) as usize)
    };
    let (Some(packed_size), Some(unpacked_size)) = (word(0), word(1)) else {
        let value = format!("{} bytes", body.len());
        return Err(IoError::binary(path, at, "the packed data", value, "the file is cut off"));
    };
    if unpacked_size != size {
        let advice = format!("{} points of {} bytes need {size}", header.points(), header.stride);
        return Err(IoError::binary(path, at + 4, "the unpacked size", unpacked_size, advice));
    }
    let Some(packed) = body[8..].get(..packed_size) else {
        let value = format!("{} bytes", body.len() - 8);
        let advice = format!("the header announces {packed_size}: the file is cut off");
        return Err(IoError::binary(path, at, "the packed data", value, advice));
    };
    check_padding(&body[8 + packed_size..], at + 8 + packed_size as u64, "the packed data", path)?;
    lzf::unpack(packed, size).or_else(|k| {
        // Where packing does not pay some writers leave the data as it is.
        if packed_size == size {
            return Ok(packed.to_vec());
        }
        let advice = "copy or download the file again";
        Err(IoError::binary(path, at + 8 + k as u64, "the packed data", "damaged", advice))
    })
}

/// The text body as the binary body would be.
fn text_to_binary(body: &[u8], header: &Header, path: &Path) -> Result<Vec<u8>> {
    let kinds: Vec<(Scalar, bool)> = (header.fields.iter())
        .flat_map(|f| std::iter::repeat_n((f.scalar, f.name == "rgb" || f.name == "rgba"), f.count))
        .collect();
    let mut out = Vec::new();
    let mut points = 0;
    for (line, number) in body.split(|b| *b == b'\n').zip(header.body_line..) {
        let mut words = fields(line).peekable();
        if words.peek().is_none() {
            continue;
        }
        if points == header.points() {
            let advice = format!("the header announces {points} points");
            return Err(IoError::text(path, number, "a line behind the last point", shown(line), advice));
        }
        for (k, &(scalar, color)) in kinds.iter().enumerate() {
            let word = words.next().unwrap_or_default();
            let Some(value) = parse_f64(word) else {
                let field = format!("column {}", k + 1);
                let advice = format!("write {} numbers per line", header.words);
                return Err(IoError::text(path, number, field, shown(word), advice));
            };
            put(&mut out, value, scalar, color);
        }
        if words.next().is_some() {
            let advice = format!("write {} numbers per line", header.words);
            return Err(IoError::text(path, number, "the number of columns", "too large", advice));
        }
        points += 1;
    }
    if points < header.points() {
        let advice = format!("the header announces {}: the file is cut off", header.points());
        return Err(IoError::text(path, header.body_line, "the number of points", points, advice));
    }
    Ok(out)
}

fn put(out: &mut Vec<u8>, value: f64, scalar: Scalar, color: bool) {
    match scalar {
        Scalar::I8 => out.extend((value as i8).to_le_bytes()),
        Scalar::U8 => out.extend((value as u8).to_le_bytes()),
        Scalar::I16 => out.extend((value as i16).to_le_bytes()),
        Scalar::U16 => out.extend((value as u16).to_le_bytes()),
        Scalar::I32 => out.extend((value as i32).to_le_bytes()),
        Scalar::U32 => out.extend((value as u32).to_le_bytes()),
        Scalar::I64 => out.extend((value as i64).to_le_bytes()),
        Scalar::U64 => out.extend((value as u64).to_le_bytes()),
        // A color called a float is often written as the whole number that it is.
        Scalar::F32 if color && (1.0..=f64::from(u32::MAX)).contains(&value) => {
            out.extend((value as u32).to_le_bytes())
        }
        Scalar::F32 => out.extend((value as f32).to_le_bytes()),
        Scalar::F64 => out.extend(value.to_le_bytes()),
    }
}

/// The columns that a cloud is made of.
fn cloud(body: &[u8], header: &Header, path: &Path) -> Result<PointCloudFile> {
    let column = |field: &Field| Column::of(field, header, body);
    let named = |names: &[&str]| header.field(names).and_then(column);
    let three = |a, b, c| Some([named(&[a])?, named(&[b])?, named(&[c])?]);
    let Some(position) = three("x", "y", "z") else {
        let names: Vec<_> = header.fields.iter().map(|f| f.name.as_str()).collect();
        let advice = "give a cloud with fields x, y and z";
        return Err(IoError::text(path, 1, "FIELDS", shown(names.join(" ")), advice));
    };
    let packed = named(&["rgb", "rgba"]);
    let channels = three("r", "g", "b").or_else(|| three("red", "green", "blue"));
    let fields = PointFields {
        position,
        intensity: named(&["intensity", "i", "reflectivity", "reflectance"]),
        color: channels.filter(|_| packed.is_none()),
        normal: three("normal_x", "normal_y", "normal_z"),
        ring: named(&["ring", "channel"]),
        time: header.fields.iter().find(|f| is_time(&f.name)).and_then(column),
    };
    let mut builder = CloudBuilder::new(true);
    builder.cloud.viewpoint = header.viewpoint;
    if header.height > 1 {
        builder.organize(header.width, header.height);
    }
    for i in 0..header.points() {
        let kept = builder.push_fields(i, &fields, |column| (column.get(i), column.scalar));
        builder.cloud.colors.extend(packed.filter(|_| kept).map(|column| rgb(column.bits(i))));
    }
    Ok(builder.finish())
}
