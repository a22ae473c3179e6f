//! Depth images: PNG pictures of 16-bit grey.

use std::io::Cursor;
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Info, Reader};

use crate::IoError;
use crate::bytes::open_file;

/// The most pixels of a picture.
pub(super) const MOST_PIXELS: u64 = 1 << 25;

/// The most bytes of a picture's file.
const MOST_BYTES: u64 = 256 << 20;

/// Deflate packs at most so many bytes into one.
const TIGHTEST: u64 = 1032;

/// A depth image in metres; 0 where there is no reading.
pub(super) struct Depth {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Row by row.
    pub(super) values: Vec<f32>,
}

/// Reads a depth image of so many units per metre. The values 0 and 65535 are no reading.
pub(super) fn read_depth(path: &Path, units_per_metre: f64) -> Result<Depth, IoError> {
    let bytes = read_picture(path)?;
    let mut reader = png_reader(path, &bytes)?;
    let [columns, rows] = depth_size(path, reader.info(), bytes.len())?;
    let mut raw = vec![0; columns * rows * 2];
    reader.next_frame(&mut raw).map_err(|e| damaged(path, &e.to_string()))?;
    let scale = units_per_metre as f32;
    let value = |pair: &[u8]| match u16::from_be_bytes([pair[0], pair[1]]) {
        u16::MAX => 0.0,
        units => f32::from(units) / scale,
    };
    Ok(Depth { columns, rows, values: raw.chunks_exact(2).map(value).collect() })
}

/// Columns and rows of a depth image; its pixels are not read.
pub(super) fn depth_image_size(path: &Path) -> Result<[usize; 2], IoError> {
    let bytes = read_picture(path)?;
    depth_size(path, png_reader(path, &bytes)?.info(), bytes.len())
}

/// The bytes of a picture's file.
pub(super) fn read_picture(path: &Path) -> Result<Vec<u8>, IoError> {
    use std::io::Read;
    let file = open_file(path)?;
    let size = file.metadata().map_or(0, |m| m.len()).min(MOST_BYTES);
    let mut bytes = Vec::with_capacity(size as usize + 1);
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(|e| IoError::os(path, "read it", e))?;
    if bytes.len() as u64 > MOST_BYTES {
        let value = format!("more than {MOST_BYTES} bytes");
        return Err(IoError::layout(path, "the picture", value, "give a smaller picture"));
    }
    Ok(bytes)
}

pub(super) fn png_reader<'a>(path: &Path, bytes: &'a [u8]) -> Result<Reader<Cursor<&'a [u8]>>, IoError> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_ignore_text_chunk(true);
    decoder.read_info().map_err(|e| damaged(path, &e.to_string()))
}

pub(super) fn damaged(path: &Path, why: &str) -> IoError {
    IoError::layout(path, "the picture", format!("damaged ({why})"), "copy or download the file again")
}

fn depth_size(path: &Path, info: &Info<'_>, file_bytes: usize) -> Result<[usize; 2], IoError> {
    if (info.color_type, info.bit_depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
        let value = format!("{:?} of {} bits", info.color_type, info.bit_depth as u8);
        return Err(IoError::layout(path, "the depth image", value, "give 16-bit grey"));
    }
    size_within_limits(path, info.width, info.height, file_bytes, 2)
}

/// Columns and rows, where the file can hold so many pixels.
pub(super) fn size_within_limits(
    path: &Path,
    width: u32,
    height: u32,
    file_bytes: usize,
    bytes_per_pixel: u64,
) -> Result<[usize; 2], IoError> {
    let pixels = u64::from(width) * u64::from(height);
    let holds = (file_bytes as u64).saturating_mul(TIGHTEST) / bytes_per_pixel;
    if pixels == 0 || pixels > MOST_PIXELS.min(holds) {
        let value = format!("{width} x {height} in {file_bytes} bytes");
        let advice = format!("give a picture of at most {MOST_PIXELS} pixels that is whole");
        return Err(IoError::layout(path, "the size of the picture", value, advice));
    }
    Ok([width as usize, height as usize])
}
