//! LAS and LAZ (ASPRS), and COPC, which is a LAZ: clouds of surveys.
//!
//! Intensity, GPS times and colors are read. Points that are marked as withheld are left out, as the format asks, and
//! counted as without a reading. No file says where its points were seen from.

use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

use las::crs::GeoTiffData;

use crate::bytes::{Input, open_file, u32_at, u64_at};
use crate::points::{CloudBuilder, PointCloudFile, most_bytes};
use crate::{IoError, Result};

/// The first bytes of every file.
pub(crate) const MAGIC: &[u8] = b"LASF";
/// Points that are read at once.
const TOGETHER: u64 = 1 << 14;
/// The shortest header.
const SHORTEST: usize = 227;
/// The GeoTIFF key of the unit of projected coordinates.
const LINEAR_UNITS: u16 = 3076;
/// The bit that packing sets in the number of the point format.
const PACKED: u8 = 0x80;

pub(crate) fn parse(mut input: Input) -> Result<PointCloudFile> {
    let bytes = input.read_all(most_bytes(&input))?;
    let path = input.path().to_owned();
    check(&bytes, &path)?;
    let not_read = |why: String| {
        let advice = "the file is damaged, cut off or of a kind that is not read: copy or export it again";
        let why: String = why.chars().map(|c| if c.is_control() { ' ' } else { c }).take(400).collect();
        IoError::layout(&path, "the LAS data", format!("not readable: {why}"), advice)
    };
    // The library is not written for hostile bytes: where it breaks, that is the file's fault, not the end of a run.
    std::panic::catch_unwind(move || read(bytes))
        .unwrap_or_else(|_| Err("it contradicts itself".to_owned()))
        .map_err(not_read)
        .and_then(|cloud| {
            if cloud.points.is_empty() {
                let refused = cloud.refused.too_far + cloud.refused.no_reading;
                let advice = format!("{refused} points were refused; give a file with points");
                return Err(IoError::layout(&path, "the number of points", 0, advice));
            }
            Ok(cloud)
        })
}

/// Lengths that the library would take memory for.
fn check(bytes: &[u8], path: &Path) -> Result<()> {
    if bytes.len() < SHORTEST || !bytes.starts_with(MAGIC) {
        let (value, advice) = (format!("{} bytes", bytes.len()), "give a whole LAS or LAZ file");
        return Err(IoError::binary(path, 0, "the header", value, advice));
    }
    let begins = u64::from(u32_at(bytes, 96));
    let wrong = |at: u64, field: &str, value: String| {
        let advice = format!("the file has {} bytes: it is cut off or damaged, copy it again", bytes.len());
        Err(IoError::binary(path, at, field, value, advice))
    };
    if begins > bytes.len() as u64 {
        return wrong(96, "the place of the points", begins.to_string());
    }
    let stride = u64::from(u16::from_le_bytes([bytes[105], bytes[106]]));
    if bytes[104] & PACKED == 0 {
        // A file of more points than it announces is read as far as it announces.
        let announced = match (bytes[25], bytes.len() >= 255) {
            (4.., true) => u64_at(bytes, 247),
            _ => u64::from(u32_at(bytes, 107)),
        };
        let room = (bytes.len() as u64 - begins).checked_div(stride).unwrap_or(0);
        if announced > room {
            return wrong(107, "the number of points", format!("{announced}, with room for {room}"));
        }
        return Ok(());
    }
    // The table of chunks of a packed file: its place, and in it a number of chunks.
    let at = begins as usize;
    let Some(place) = bytes.get(at..at + 8).map(|_| u64_at(bytes, at)) else {
        return wrong(begins, "the place of the chunk table", "missing".into());
    };
    let place = match place {
        // Written by what could not jump back: it stands in the last bytes.
        u64::MAX => u64_at(bytes, bytes.len() - 8),
        place => place,
    };
    let Some(count) =
        usize::try_from(place).ok().filter(|p| p.checked_add(8).is_some_and(|end| end <= bytes.len()))
    else {
        return wrong(begins, "the place of the chunk table", place.to_string());
    };
    let chunks = u32_at(bytes, count + 4);
    if u64::from(chunks) > bytes.len() as u64 {
        return wrong(place + 4, "the number of chunks", chunks.to_string());
    }
    Ok(())
}

/// Whether a file says that its coordinates are feet: portolan takes every length for meters. `false` where it says nothing,
/// and where it cannot be read.
pub(crate) fn is_in_feet(path: &Path) -> bool {
    let unit = |reader: las::Reader| {
        let header = reader.header();
        let wkt = header.get_wkt_crs_bytes().map(|b| String::from_utf8_lossy(b).to_ascii_lowercase());
        // Of the projected coordinates: international and US survey feet.
        let keys = header.get_geotiff_crs().ok().flatten();
        let key = keys.is_some_and(|crs| {
            let is_feet = |data: &GeoTiffData| matches!(data, GeoTiffData::U16(9002 | 9003));
            crs.entries.iter().any(|e| e.id == LINEAR_UNITS && is_feet(&e.data))
        });
        key || wkt.is_some_and(|text| text.contains("foot") || text.contains("\"ft"))
    };
    let found = std::panic::catch_unwind(|| {
        let mut head = [0; SHORTEST];
        let mut file = open_file(path).ok()?;
        file.read_exact(&mut head).ok()?;
        file.rewind().ok()?;
        // Packed by gzip or damaged: the reader of the points says what is wrong.
        if !head.starts_with(MAGIC) {
            return None;
        }
        las::Reader::new(BufReader::new(file)).ok().map(unit)
    });
    found.ok().flatten().unwrap_or(false)
}

fn read(bytes: Vec<u8>) -> Result<PointCloudFile, String> {
    let words = |e: las::Error| e.to_string();
    let mut reader = las::Reader::new(Cursor::new(bytes)).map_err(words)?;
    let mut builder = CloudBuilder::new(true);
    builder.in_seconds = true;
    let mut wide = Vec::new();
    let mut points = las::PointDataBuilder::new().for_header(reader.header()).build();
    let announced = reader.header().number_of_points();
    let mut left = announced;
    while left > 0 {
        let count = reader.fill_points(left.min(TOGETHER), &mut points).map_err(words)?;
        if count == 0 {
            return Err(format!("{left} of {announced} points are missing"));
        }
        left = left.saturating_sub(count);
        for point in points.points() {
            let point = point.map_err(words)?;
            if point.is_withheld {
                builder.cloud.refused.no_reading += 1;
                continue;
            }
            if builder.push(0, [point.x, point.y, point.z]) {
                builder.cloud.intensity.push(f32::from(point.intensity));
                builder.times.extend(point.gps_time);
                wide.extend(point.color.map(|c| [c.red, c.green, c.blue]));
            }
        }
    }
    // Many writers store bytes where the format has 16 bits.
    let bytes = wide.iter().flatten().all(|v| *v <= 255);
    let byte = |v: u16| if bytes { v as u8 } else { (f32::from(v) / 257.0).round() as u8 };
    builder.cloud.colors = wide.into_iter().map(|c| c.map(byte)).collect();
    Ok(builder.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{bad_bytes, real_data, says};
    use las::{Builder, Color, Point, Writer};

    fn read_bytes(bytes: Vec<u8>) -> Result<PointCloudFile> {
        parse(Input::from_reader(Cursor::new(bytes), "a.las".as_ref())?)
    }

    fn bytes(packed: bool, count: usize) -> Vec<u8> {
        let mut builder = Builder::from((1, 2));
        builder.point_format = las::point::Format::new(3).unwrap();
        builder.point_format.is_compressed = packed;
        let transform = las::Transform { scale: 0.001, offset: 500_000.0 };
        builder.transforms = las::Vector { x: transform, y: transform, z: transform };
        let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
        for i in 0..count {
            let v = i as f64;
            let point = Point {
                x: 500_000.0 + 0.001 * v,
                y: 500_100.5,
                z: 500_000.0 - v,
                intensity: 7 * i as u16,
                gps_time: Some(1e6 * v),
                color: Some(Color::new(257 * (i % 256) as u16, 0, 65535)),
                is_withheld: i == 3,
                ..Point::default()
            };
            writer.write_point(point).unwrap();
        }
        writer.close().unwrap();
        writer.into_inner().unwrap().into_inner()
    }

    #[test]
    fn points_come_back_packed_or_not() {
        for packed in [false, true] {
            let cloud = read_bytes(bytes(packed, 100)).unwrap();
            assert_eq!((cloud.points.len(), cloud.refused.no_reading), (99, 1));
            let p = cloud.position(50);
            assert!((p[0] - 500_000.051).abs() < 1e-5 && (p[2] - 499_949.0).abs() < 1e-5, "{p:?}");
            assert_eq!((cloud.intensity[50], cloud.colors[50]), (357.0, [51, 0, 255]));
            // Months apart, and still seconds.
            assert_eq!((cloud.times[50], cloud.start_time), (51e6, 0.0));
        }
    }

    #[test]
    fn cut_and_hostile_files_are_refused_in_one_line() {
        says(read_bytes(Vec::new()), "the header is 0 bytes; give a whole LAS");
        says(read_bytes(bytes(false, 0)), "the number of points is 0");
        let plain = bytes(false, 50);
        says(read_bytes(plain[..plain.len() - 40].to_vec()), "the number of points is 50, with room for");
        for packed in [false, true] {
            let good = bytes(packed, 50);
            for bytes in bad_bytes(&good, 31, 300) {
                if let Err(e) = read_bytes(bytes) {
                    assert!(!e.to_string().contains('\n'), "{e}");
                }
            }
            for cut in [230, good.len() / 2, good.len() - 1] {
                assert!(read_bytes(good[..cut].to_vec()).is_err(), "{packed} {cut}");
            }
        }
    }

    #[test]
    fn files_of_others() {
        // By laspy: number, least and largest coordinates, span of times.
        let utm = ([493_994.870, 4_877_429.62, 123.93], [494_993.680, 4_878_817.02, 178.73]);
        let feet = ([635_619.85, 848_899.70, 406.59], [638_982.55, 853_535.43, 586.38]);
        let trim = ([636_001.76, 848_935.20, 406.26], [637_179.22, 849_497.90, 520.51]);
        for (name, points, (low, high), span) in [
            ("autzen-utm.las", 1065, utm, 4412.7461),
            ("simple.las", 1065, feet, 4412.7461),
            ("1.2-with-color.copc.laz", 1065, feet, 4412.7461),
            ("autzen_trim.laz", 110_000, trim, 6.5126),
        ] {
            let Some(path) = real_data(&format!("e57_las_ptx/{name}")) else { continue };
            let cloud = crate::read_points(path).unwrap();
            assert_eq!(cloud.points.len(), points, "{name}");
            for k in 0..3 {
                let along = || (0..points).map(|i| cloud.position(i)[k]);
                let (least, most) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::MIN, f64::max));
                assert!(
                    (least - low[k]).abs() < 6e-3 && (most - high[k]).abs() < 6e-3,
                    "{name} {least} {most}"
                );
            }
            let last = cloud.times.iter().copied().fold(0.0, f32::max);
            assert!((f64::from(last) - span).abs() < 1e-2, "{name}: {last}");
        }
    }
}
