//! `esdf.bin`: a signed distance field that three lines of numpy read.
//!
//! Little-endian:
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | 8 bytes | `PORTESDF` |
//! | 8 | u32 | version = 1 |
//! | 12 | u32 | D, 2 or 3 |
//! | 16 | u32 x 3 | shape x, y, z (unused = 1) |
//! | 28 | u32 | flags; bit 0: a status plane follows |
//! | 32 | f64 x 3 | origin, the corner of cell 0 (meters; unused = 0) |
//! | 56 | f64 | resolution (meters) |
//! | 64 | f32 x cells | signed distance (meters), x fastest, NaN where unknown |
//! | then, with bit 0 | u8 x cells | 0 unknown, 1 known, 2 saturated |

use std::fs::File;
use std::io::{self, BufReader, Cursor, Read, Seek, SeekFrom, Write};
use std::path::Path;

use portolan::Status;
use portolan::field::EsdfGrid;
use portolan::geom::Grid;

use crate::bytes::{open_file, u32_at, u64_at, write_atomic};
use crate::error::shown;
use crate::{IoError, Result};

/// The first eight bytes.
pub(crate) const MAGIC: &[u8; 8] = b"PORTESDF";
const HEADER: u64 = 64;
/// The most cells of a field: 2 GiB of distances.
const MOST_CELLS: u64 = 1 << 29;

/// A field whose dimension the file tells.
#[derive(Clone, Debug, PartialEq)]
pub enum EsdfFile {
    /// A 2-D field.
    Two(EsdfGrid<2>),
    /// A 3-D field.
    Three(EsdfGrid<3>),
}

/// Writes an `esdf.bin`: distances (meters, x fastest, NaN where unknown), and what each is worth as [`Status::byte`] has it.
///
/// # Errors
/// [`IoError::Unwritable`] where lengths do not fit the grid or the grid does not fit the format, else as
/// [`write_atomic`].
pub fn write_esdf<const D: usize>(
    path: impl AsRef<Path>,
    grid: &Grid<D>,
    distances: &[f32],
    status: Option<&[u8]>,
) -> Result<()> {
    let path = path.as_ref();
    let field = Samples { grid, distances, status };
    field.check(path)?;
    write_atomic(path, |w| field.write_to(w))
}

/// The same as bytes in memory.
///
/// # Errors
/// [`IoError::Unwritable`] as [`write_esdf`].
pub fn esdf_to_bytes<const D: usize>(
    grid: &Grid<D>,
    distances: &[f32],
    status: Option<&[u8]>,
) -> Result<Vec<u8>> {
    let name = Path::new("esdf.bin");
    let field = Samples { grid, distances, status };
    field.check(name)?;
    let mut bytes = Vec::new();
    field.write_to(&mut bytes).map_err(|e| IoError::os(name, "write it", e))?;
    Ok(bytes)
}

/// What a file holds.
struct Samples<'a, const D: usize> {
    grid: &'a Grid<D>,
    distances: &'a [f32],
    status: Option<&'a [u8]>,
}

impl<const D: usize> Samples<'_, D> {
    fn check(&self, path: &Path) -> Result<()> {
        let Self { grid, distances, status } = *self;
        let cells = grid.checked_len().filter(|&n| n as u64 <= MOST_CELLS);
        let fits = cells == Some(distances.len()) && status.is_none_or(|s| s.len() == distances.len());
        if !fits || distances.is_empty() {
            let value = format!(
                "{:?} for {} distances and {:?} states",
                grid.shape,
                distances.len(),
                status.map(<[u8]>::len)
            );
            let advice = format!("give one value per cell, from 1 to {MOST_CELLS} of them");
            return Err(IoError::unwritable(path, "the shape", value, advice));
        }
        if let Some(i) = distances.iter().position(|d| d.is_infinite()) {
            let (field, value) = (format!("the distance of cell {i}"), distances[i]);
            return Err(IoError::unwritable(path, field, value, "give NaN where nothing is known"));
        }
        let (origin, resolution) = (grid.lattice.origin, grid.lattice.resolution);
        if !(resolution > 0.0 && resolution.is_finite() && origin.iter().all(|v| v.is_finite())) {
            let value = format!("{resolution} at {origin:?}");
            return Err(IoError::unwritable(path, "the resolution", value, "give finite values, above zero"));
        }
        Ok(())
    }

    fn write_to(&self, w: &mut impl Write) -> io::Result<()> {
        let Self { grid, distances, status } = *self;
        let (origin, resolution) = (grid.lattice.origin, grid.lattice.resolution);
        w.write_all(MAGIC)?;
        for word in [1, D as u32] {
            w.write_all(&word.to_le_bytes())?;
        }
        for k in 0..3 {
            w.write_all(&(grid.shape.get(k).map_or(1, |&s| s as u32)).to_le_bytes())?;
        }
        w.write_all(&u32::from(status.is_some()).to_le_bytes())?;
        for k in 0..3 {
            w.write_all(&origin.get(k).copied().unwrap_or(0.0).to_le_bytes())?;
        }
        w.write_all(&resolution.to_le_bytes())?;
        for chunk in distances.chunks(1 << 14) {
            let bytes: Vec<u8> = chunk.iter().flat_map(|d| d.to_le_bytes()).collect();
            w.write_all(&bytes)?;
        }
        w.write_all(status.unwrap_or(&[]))
    }
}

impl EsdfFile {
    /// Reads a file.
    ///
    /// # Errors
    /// [`IoError::Binary`] where a field is wrong or the file's length is not what the header announces.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::from_reader(BufReader::<File>::with_capacity(1 << 16, open_file(path)?), path)
    }

    /// Reads a file in memory; errors name it `name`.
    ///
    /// # Errors
    /// As [`EsdfFile::read`].
    pub fn parse(bytes: &[u8], name: &Path) -> Result<Self> {
        Self::from_reader(Cursor::new(bytes), name)
    }

    /// Reads a field from any source; errors name it `path`.
    ///
    /// # Errors
    /// As [`EsdfFile::read`], and [`IoError::Os`] where reading fails.
    pub fn from_reader(mut reader: impl Read + Seek, path: &Path) -> Result<Self> {
        let failed = |e| IoError::os(path, "read it", e);
        let length = reader.seek(SeekFrom::End(0)).map_err(failed)?;
        reader.rewind().map_err(failed)?;
        let mut header = Vec::new();
        reader.by_ref().take(HEADER).read_to_end(&mut header).map_err(failed)?;
        let Ok(h) = <[u8; HEADER as usize]>::try_from(&header[..]) else {
            let value = format!("{} bytes", header.len());
            let advice = "give an esdf.bin: its header has 64 bytes";
            return Err(IoError::binary(path, 0, "the header", value, advice));
        };
        if &h[..8] != MAGIC {
            let advice = "give an esdf.bin: it starts with PORTESDF";
            return Err(IoError::binary(path, 0, "the magic", shown(&h[..8]), advice));
        }
        match u32_at(&h, 12) {
            2 => Ok(Self::Two(body(&h, reader, length, path)?)),
            3 => Ok(Self::Three(body(&h, reader, length, path)?)),
            d => Err(IoError::binary(path, 12, "the dimension", d, "it must be 2 or 3")),
        }
    }
}

fn body<const D: usize>(
    h: &[u8; 64],
    mut reader: impl Read,
    length: u64,
    path: &Path,
) -> Result<EsdfGrid<D>> {
    let bad = |at: u64, field: &str, value: String, advice: &str| {
        Err(IoError::binary(path, at, field, value, advice))
    };
    let (version, flags) = (u32_at(h, 8), u32_at(h, 28));
    if version != 1 {
        return bad(8, "the version", version.to_string(), "this program reads version 1; use a newer one");
    }
    if flags > 1 {
        return bad(28, "the flags", flags.to_string(), "this program reads bit 0 only; use a newer one");
    }
    let shape: [u32; 3] = std::array::from_fn(|k| u32_at(h, 16 + 4 * k));
    let cells = shape.iter().try_fold(1u64, |n, &s| n.checked_mul(u64::from(s)));
    let cells = match cells.filter(|n| (1..=MOST_CELLS).contains(n)) {
        Some(n) if shape[D..].iter().all(|&s| s == 1) => n,
        _ => {
            let advice = "give from 1 to 2^29 cells, 1 along an unused axis";
            return bad(16, "the shape", format!("{shape:?}"), advice);
        }
    };
    let origin: [f64; D] = std::array::from_fn(|k| f64::from_bits(u64_at(h, 32 + 8 * k)));
    let resolution = f64::from_bits(u64_at(h, 56));
    if !origin.iter().all(|v| v.is_finite()) {
        return bad(32, "the origin", format!("{origin:?}"), "give finite numbers (metres)");
    }
    if !(resolution > 0.0 && resolution.is_finite()) {
        return bad(56, "the resolution", resolution.to_string(), "give metres per cell, above zero");
    }
    let expected = HEADER + cells * if flags == 1 { 5 } else { 4 };
    let wrong_length = |length: u64| {
        let advice = format!("the header announces {expected}: the file is cut off or damaged");
        Err(IoError::binary(path, length.min(expected), "the file length", length, advice))
    };
    if length != expected {
        return wrong_length(length);
    }
    let failed = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => {
            IoError::binary(path, expected, "the file length", "changing", "wait until the file is written")
        }
        _ => IoError::os(path, "read it", e),
    };
    // The length was checked against the file's, so these many bytes are there.
    let mut distances = Vec::with_capacity(cells as usize);
    let mut buffer = vec![0u8; 1 << 16];
    let mut left = cells as usize;
    while left > 0 {
        let now = left.min(buffer.len() / 4);
        let bytes = &mut buffer[..4 * now];
        reader.read_exact(bytes).map_err(failed)?;
        distances.extend(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
        left -= now;
    }
    // NaN is what is not known; nothing is infinitely far.
    if let Some(i) = distances.iter().position(|d: &f32| d.is_infinite()) {
        let at = HEADER + 4 * i as u64;
        return bad(at, "a distance", distances[i].to_string(), "give metres, NaN where nothing is known");
    }
    let grid = Grid::new(origin, resolution, std::array::from_fn(|k| shape[k] as usize));
    let field = if flags == 1 {
        let mut plane = vec![0; cells as usize];
        reader.read_exact(&mut plane).map_err(failed)?;
        let of_byte = |&s: &u8| Status::of_byte(s).filter(|s| *s != Status::Outside);
        if let Some(i) = plane.iter().position(|s| of_byte(s).is_none()) {
            let at = HEADER + 4 * cells + i as u64;
            return bad(at, "a status", plane[i].to_string(), "0 unknown, 1 known, 2 saturated");
        }
        EsdfGrid::with_status(grid, distances, plane.iter().filter_map(of_byte).collect())
    } else {
        EsdfGrid::from_samples(grid, distances)
    };
    // One sample and one status a cell were read.
    field.map_err(|e| IoError::binary(path, 16, "the shape", format!("{shape:?}"), e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, bad_bytes, says, temporary};

    fn field<const D: usize>(shape: [usize; D], with_status: bool) -> EsdfGrid<D> {
        let mut random = Random(4);
        let grid = Grid::new(std::array::from_fn(|k| 500_000.0 - 0.1 * k as f64), 0.05, shape);
        let distances = (0..grid.len()).map(|_| random.unit() as f32 - 0.5).collect();
        if !with_status {
            return EsdfGrid::from_samples(grid, distances).unwrap();
        }
        let status = (0..grid.len()).map(|_| Status::of_byte(random.below(3) as u8).unwrap()).collect();
        EsdfGrid::with_status(grid, distances, status).unwrap()
    }

    fn write<const D: usize>(field: &EsdfGrid<D>, path: &Path) {
        let status = field.has_status().then(|| field.status_bytes());
        write_esdf(path, field.grid(), field.samples(), status.as_deref()).unwrap();
    }

    fn bytes_of<const D: usize>(field: &EsdfGrid<D>) -> Vec<u8> {
        let (_folder, path) = temporary("esdf.bin");
        write(field, &path);
        let bytes = std::fs::read(&path).unwrap();
        // As text: NaN does not equal itself.
        let [read, parsed] = [EsdfFile::read(&path), EsdfFile::parse(&bytes, &path)].map(Result::unwrap);
        assert_eq!(format!("{read:?}"), format!("{parsed:?}"));
        bytes
    }

    #[test]
    fn round_trips_in_both_dimensions() {
        let read = |bytes: &[u8]| format!("{:?}", EsdfFile::parse(bytes, "e".as_ref()).unwrap());
        for with_status in [false, true] {
            let two = field([7, 5], with_status);
            assert_eq!(read(&bytes_of(&two)), format!("{:?}", EsdfFile::Two(two)));
            let three = field([30, 50, 30], with_status);
            assert_eq!(read(&bytes_of(&three)), format!("{:?}", EsdfFile::Three(three)));
        }
        let grid = Grid::new([0.0; 2], 0.5, [1, 1]);
        let unknown = EsdfGrid::from_samples(grid, vec![f32::NAN]).unwrap();
        let EsdfFile::Two(read) = EsdfFile::parse(&bytes_of(&unknown), "e".as_ref()).unwrap() else {
            panic!()
        };
        assert!(read.samples()[0].is_nan());
    }

    #[test]
    fn the_header_is_the_documented_one() {
        let grid = Grid::new([-1.0, 2.0], 0.5, [2, 1]);
        let status = vec![Status::Known, Status::Saturated];
        let bytes = bytes_of(&EsdfGrid::with_status(grid, vec![1.0, -2.0], status).unwrap());
        let mut expected = b"PORTESDF\x01\0\0\0\x02\0\0\0\x02\0\0\0\x01\0\0\0\x01\0\0\0\x01\0\0\0".to_vec();
        expected.extend(b"\0\0\0\0\0\0\xf0\xbf\0\0\0\0\0\0\0\x40\0\0\0\0\0\0\0\0\0\0\0\0\0\0\xe0\x3f");
        assert_eq!(expected.len(), 64);
        expected.extend(b"\0\0\x80\x3f\0\0\0\xc0\x01\x02");
        assert_eq!(bytes, expected);
    }

    #[test]
    fn wrong_fields_are_named() {
        let good = bytes_of(&field([7, 5], true));
        for (at, value, part) in [
            (0, 0u8, "byte 0: the magic is"),
            (8, 2, "byte 8: the version is 2"),
            (12, 4, "byte 12: the dimension is 4"),
            (16, 0, "the shape is [0, 5, 1]"),
            (19, 255, "the shape is"),
            (24, 2, "the shape is [7, 5, 2]"),
            (28, 2, "the flags is 2"),
            (39, 0x7f, ""),
            (63, 0xbf, "byte 56: the resolution is -0.05"),
            (64 + 35 * 4, 9, "a status is 9"),
            (16, 8, "the file length is 239; the header announces 264"),
        ] {
            let mut bytes = good.clone();
            bytes[at] = value;
            match EsdfFile::parse(&bytes, "e".as_ref()) {
                Ok(_) => assert!(part.is_empty(), "{at} {value}"),
                Err(e) => assert!(e.to_string().contains(part), "{e}"),
            }
        }
        for infinite in [f32::INFINITY, f32::NEG_INFINITY] {
            let mut bytes = good.clone();
            bytes[64 + 4 * 7..][..4].copy_from_slice(&infinite.to_le_bytes());
            says(EsdfFile::parse(&bytes, "e".as_ref()), "byte 92: a distance is");
        }
        let mut huge = good.clone();
        huge[16..28].fill(0xff);
        says(EsdfFile::parse(&huge, "e".as_ref()), "the shape");
        assert!(EsdfFile::parse(&good[..80], "e".as_ref()).is_err());
    }

    #[test]
    fn what_does_not_fit_is_not_written() {
        let grid = Grid::new([0.0, 0.0], 0.5, [2, 1]);
        assert!(write_esdf("never", &grid, &[1.0], None).is_err());
        assert!(write_esdf("never", &grid, &[1.0, 2.0], Some(&[1])).is_err());
        assert!(write_esdf("never", &Grid::new([0.0, 0.0], f64::NAN, [1, 1]), &[1.0], None).is_err());
        assert!(write_esdf("never", &Grid::new([0.0, 0.0], 1.0, [0, 1]), &[], None).is_err());
        says(write_esdf("never", &grid, &[1.0, f32::INFINITY], None), "the distance of cell 1 is inf");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        for bytes in bad_bytes(&bytes_of(&field([3, 2, 2], true)), 6, 4000) {
            let _ = EsdfFile::parse(&bytes, "e".as_ref());
        }
    }
}
