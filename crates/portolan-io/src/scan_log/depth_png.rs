//! Depth images: PNG pictures of 16-bit gray.

use std::io::Cursor;
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Info, Reader};

use crate::bytes::open_file;
use crate::{IoError, Result};

/// The most pixels of a picture.
pub(super) const MOST_PIXELS: u64 = 1 << 25;

/// The most bytes of a picture's file.
const MOST_BYTES: u64 = 256 << 20;

/// Deflate packs at most so many bytes into one.
const TIGHTEST: u64 = 1032;

/// A depth image in meters; 0 for pixels without a reading.
pub(crate) struct Depth {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// Row by row.
    pub(crate) values: Vec<f32>,
}

/// Reads a depth image of so many units per meter. The values 0 and 65535 are no reading.
pub(super) fn read_depth(path: &Path, units_per_metre: f64) -> Result<Depth> {
    decode_depth(path, &read_picture(path)?, units_per_metre)
}

/// [`read_depth`] of the bytes of a picture.
pub(crate) fn decode_depth(path: &Path, bytes: &[u8], units_per_metre: f64) -> Result<Depth> {
    let ([columns, rows], raw) = decode_gray16(path, bytes)?;
    let scale = units_per_metre as f32;
    let value = |units| match units {
        u16::MAX => 0.0,
        units => f32::from(units) / scale,
    };
    Ok(Depth { columns, rows, values: raw.into_iter().map(value).collect() })
}

/// Columns and rows of a picture of 16-bit gray, and its values row by row.
pub(crate) fn decode_gray16(path: &Path, bytes: &[u8]) -> Result<([usize; 2], Vec<u16>)> {
    let mut reader = png_reader(path, bytes)?;
    let [columns, rows] = depth_size(path, reader.info(), bytes.len())?;
    let mut raw = vec![0; columns * rows * 2];
    reader.next_frame(&mut raw).map_err(|e| damaged(path, &e.to_string()))?;
    let values = raw.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
    Ok(([columns, rows], values))
}

/// Columns and rows of a depth image; its pixels are not read.
pub(super) fn depth_image_size(path: &Path) -> Result<[usize; 2]> {
    let bytes = read_picture(path)?;
    depth_size(path, png_reader(path, &bytes)?.info(), bytes.len())
}

/// The bytes of a picture's file.
pub(crate) fn read_picture(path: &Path) -> Result<Vec<u8>> {
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

pub(super) fn png_reader<'a>(path: &Path, bytes: &'a [u8]) -> Result<Reader<Cursor<&'a [u8]>>> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_ignore_text_chunk(true);
    decoder.read_info().map_err(|e| damaged(path, &e.to_string()))
}

pub(crate) fn damaged(path: &Path, why: &str) -> IoError {
    IoError::layout(path, "the picture", format!("damaged ({why})"), "copy or download the file again")
}

fn depth_size(path: &Path, info: &Info<'_>, file_bytes: usize) -> Result<[usize; 2]> {
    if (info.color_type, info.bit_depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
        let value = format!("{:?} of {} bits", info.color_type, info.bit_depth as u8);
        return Err(IoError::layout(path, "the depth image", value, "give 16-bit gray"));
    }
    size_within_limits(path, info.width, info.height, file_bytes, 2)
}

/// Columns and rows, where the file can hold so many pixels.
pub(crate) fn size_within_limits(
    path: &Path,
    width: u32,
    height: u32,
    file_bytes: usize,
    bytes_per_pixel: u64,
) -> Result<[usize; 2]> {
    let pixels = u64::from(width) * u64::from(height);
    let holds = (file_bytes as u64).saturating_mul(TIGHTEST) / bytes_per_pixel;
    if pixels == 0 || pixels > MOST_PIXELS.min(holds) {
        let value = format!("{width} x {height} in {file_bytes} bytes");
        let advice = format!("give a picture of at most {MOST_PIXELS} pixels that is whole");
        return Err(IoError::layout(path, "the size of the picture", value, advice));
    }
    Ok([width as usize, height as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::{gray_png, png_of};
    use crate::testing::no_panic;

    fn read(bytes: &[u8]) -> Result<Depth> {
        decode_depth("d.png".as_ref(), bytes, 1000.0)
    }

    #[test]
    fn units_become_metres_and_what_is_no_reading_is_zero() {
        let depth = read(&gray_png([3, 2], &[0, 1, 1500, u16::MAX, 65534, 40_001])).unwrap();
        assert_eq!((depth.columns, depth.rows), (3, 2));
        assert_eq!(depth.values, [0.0, 0.001, 1.5, 0.0, 65.534, 40.001]);
    }

    #[test]
    fn other_pictures_are_refused() {
        let eight = png_of([2, 1], ColorType::Grayscale, BitDepth::Eight, &[1, 2]);
        let colored = png_of([1, 1], ColorType::Rgb, BitDepth::Sixteen, &[1; 6]);
        let whole = gray_png([9, 9], &[7; 81]);
        // A size that the bytes cannot hold: 30000 x 30000.
        let mut vast = whole.clone();
        vast[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
        let crc = crc_of_header(&vast);
        vast[29..33].copy_from_slice(&crc);
        for (bytes, part) in [
            (&eight[..], "d.png: the depth image is Grayscale of 8 bits; give 16-bit gray"),
            (&colored, "the depth image is Rgb of 16 bits"),
            (&vast, "the size of the picture is 30000 x 30000 in"),
            (b"P5", "the picture is damaged"),
            (&whole[..whole.len() - 20], "the picture is damaged"),
        ] {
            let Err(error) = read(bytes) else { panic!("read what should be: {part}") };
            assert!(error.to_string().contains(part), "{error}");
        }
        no_panic(&whole, 6, 2000, |bytes| read(&bytes));
    }

    /// CRC-32 of the header chunk of a PNG, bit by bit.
    fn crc_of_header(png: &[u8]) -> [u8; 4] {
        let mut crc = u32::MAX;
        for byte in &png[12..29] {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
            }
        }
        (!crc).to_be_bytes()
    }
}
