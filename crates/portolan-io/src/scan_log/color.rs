//! Color pictures beside depth images: JPEG and PNG.

use std::path::Path;

use png::{ColorType, Decoder, Reader, Transformations};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::depth_png::{damaged, read_picture, size_within_limits};
use crate::{IoError, Result};

/// Reads a color picture, row by row. It must have `size` (columns and rows).
pub(super) fn read_color(path: &Path, size: [usize; 2]) -> Result<Vec<[u8; 3]>> {
    decode_color(path, &read_picture(path)?, size)
}

/// Reads a color picture whatever its size, which is columns and rows.
pub(super) fn read_color_of_any_size(path: &Path) -> Result<([usize; 2], Vec<[u8; 3]>)> {
    let bytes = read_picture(path)?;
    let size = match Picture::open(path, &bytes)? {
        Picture::Jpeg(decoder) => jpeg_size(path, &decoder)?,
        Picture::Png(reader) => png_size(path, &reader, bytes.len())?,
    };
    Ok((size, decode_color(path, &bytes, size)?))
}

/// Reads a color picture from its bytes.
pub(crate) fn decode_color(path: &Path, bytes: &[u8], size: [usize; 2]) -> Result<Vec<[u8; 3]>> {
    match Picture::open(path, bytes)? {
        Picture::Jpeg(mut decoder) => {
            check_size(path, jpeg_size(path, &decoder)?, size)?;
            read_jpeg(path, &mut decoder, size)
        }
        Picture::Png(mut reader) => {
            check_size(path, png_size(path, &reader, bytes.len())?, size)?;
            read_png(path, &mut reader, size)
        }
    }
}

/// Columns and rows of a color picture; its pixels are not read.
pub(super) fn color_size(path: &Path) -> Result<[usize; 2]> {
    let bytes = read_picture(path)?;
    match Picture::open(path, &bytes)? {
        Picture::Jpeg(decoder) => jpeg_size(path, &decoder),
        Picture::Png(reader) => png_size(path, &reader, bytes.len()),
    }
}

type Jpeg<'a> = JpegDecoder<ZCursor<&'a [u8]>>;
type Png<'a> = Reader<std::io::Cursor<&'a [u8]>>;

enum Picture<'a> {
    Jpeg(Box<Jpeg<'a>>),
    Png(Box<Png<'a>>),
}

impl<'a> Picture<'a> {
    /// Reads the head of a picture; its first bytes decide its kind.
    fn open(path: &Path, bytes: &'a [u8]) -> Result<Self> {
        match bytes {
            [0xff, 0xd8, ..] => {
                // The decoder paints what is missing gray.
                if !has_end(bytes) {
                    return Err(damaged(path, "it ends early"));
                }
                let options = DecoderOptions::default()
                    .jpeg_set_out_colorspace(ColorSpace::RGB)
                    .set_max_width(1 << 15)
                    .set_max_height(1 << 15);
                let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
                decoder.decode_headers().map_err(|e| damaged(path, &one_line(&e)))?;
                Ok(Self::Jpeg(Box::new(decoder)))
            }
            [0x89, b'P', b'N', b'G', ..] => {
                let mut decoder = Decoder::new(std::io::Cursor::new(bytes));
                decoder.set_transformations(Transformations::normalize_to_color8());
                decoder.set_ignore_text_chunk(true);
                let reader = decoder.read_info().map_err(|e| damaged(path, &one_line(&e)))?;
                Ok(Self::Png(Box::new(reader)))
            }
            _ => {
                let value = crate::error::shown(&bytes[..bytes.len().min(8)]);
                Err(IoError::layout(path, "the format of the color picture", value, "give JPEG or PNG"))
            }
        }
    }
}

/// Whether a JPEG has its end marker after its last scan. Neither marker's bytes occur within a scan.
fn has_end(bytes: &[u8]) -> bool {
    let marker = bytes.windows(2).rev().find(|w| w[0] == 0xff && matches!(w[1], 0xd9 | 0xda));
    marker.is_some_and(|w| w[1] == 0xd9)
}

fn one_line(error: &impl std::fmt::Debug) -> String {
    let text = format!("{error:?}");
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(120).collect()
}

fn check_size(path: &Path, found: [usize; 2], expected: [usize; 2]) -> Result<()> {
    if found == expected {
        return Ok(());
    }
    let advice = format!(
        "the depth image is {} x {}; register the colors to it, or map with --no-color",
        expected[0], expected[1]
    );
    Err(IoError::layout(path, "the size of the picture", format!("{} x {}", found[0], found[1]), advice))
}

fn jpeg_size(path: &Path, decoder: &Jpeg) -> Result<[usize; 2]> {
    let (w, h) = decoder.dimensions().ok_or_else(|| damaged(path, "it has no size"))?;
    // How far a JPEG packs has no bound, so its length does not limit its size.
    size_within_limits(path, w as u32, h as u32, usize::MAX, 1)
}

fn png_size(path: &Path, reader: &Png, file_bytes: usize) -> Result<[usize; 2]> {
    let info = reader.info();
    let bits = info.bits_per_pixel() as u64;
    // Pixels of fewer than eight bits share a byte.
    let holds = (file_bytes as u64).saturating_mul(8) / bits.max(1);
    size_within_limits(path, info.width, info.height, usize::try_from(holds).unwrap_or(usize::MAX), 1)
}

fn read_jpeg(path: &Path, decoder: &mut Jpeg, [columns, rows]: [usize; 2]) -> Result<Vec<[u8; 3]>> {
    let pixels = columns * rows;
    if decoder.output_buffer_size() != Some(3 * pixels) {
        let channels = decoder.output_buffer_size().unwrap_or(0) / pixels;
        return Err(IoError::layout(path, "the number of channels", channels, "give color"));
    }
    let mut colors = vec![[0; 3]; pixels];
    decoder.decode_into(colors.as_flattened_mut()).map_err(|e| damaged(path, &one_line(&e)))?;
    Ok(colors)
}

fn read_png(path: &Path, reader: &mut Png, [columns, rows]: [usize; 2]) -> Result<Vec<[u8; 3]>> {
    let pixels = columns * rows;
    let bytes = reader.output_buffer_size().filter(|n| *n <= pixels.saturating_mul(4));
    let mut raw = vec![0; bytes.ok_or_else(|| damaged(path, "its size does not fit"))?];
    let about = reader.next_frame(&mut raw).map_err(|e| damaged(path, &one_line(&e)))?;
    let colors: Vec<[u8; 3]> = match about.color_type {
        ColorType::Rgb => raw.as_chunks::<3>().0.to_vec(),
        ColorType::Rgba => raw.as_chunks::<4>().0.iter().map(|p| [p[0], p[1], p[2]]).collect(),
        ColorType::Grayscale => raw.iter().map(|v| [*v; 3]).collect(),
        ColorType::GrayscaleAlpha => raw.as_chunks::<2>().0.iter().map(|p| [p[0]; 3]).collect(),
        ColorType::Indexed => Vec::new(),
    };
    if colors.len() != pixels {
        return Err(damaged(path, "its size does not fit"));
    }
    Ok(colors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::{GREY_JPEG, RED_JPEG, bytes_of, png_of};
    use crate::testing::{no_panic, says};
    use png::BitDepth;

    fn read(bytes: &[u8], size: [usize; 2]) -> Result<Vec<[u8; 3]>> {
        decode_color("c".as_ref(), bytes, size)
    }

    #[test]
    fn every_kind_of_picture_becomes_red_green_blue() {
        let near = |colors: Vec<[u8; 3]>, expected: [u8; 3]| {
            assert!(colors.iter().all(|c| (0..3).all(|k| c[k].abs_diff(expected[k]) <= 2)), "{colors:?}");
        };
        near(read(&bytes_of(RED_JPEG), [8, 8]).unwrap(), [201, 40, 90]);
        near(read(&bytes_of(GREY_JPEG), [8, 8]).unwrap(), [94; 3]);
        let pixels = [10, 20, 30, 200, 40, 50, 60, 100];
        let png = |color, depth, n: usize| png_of([2, 1], color, depth, &pixels[..n]);
        for (bytes, expected) in [
            (png(ColorType::Rgb, BitDepth::Eight, 6), [[10, 20, 30], [200, 40, 50]]),
            (png(ColorType::Rgba, BitDepth::Eight, 8), [[10, 20, 30], [40, 50, 60]]),
            (png(ColorType::Grayscale, BitDepth::Eight, 2), [[10; 3], [20; 3]]),
            (png(ColorType::Grayscale, BitDepth::Sixteen, 4), [[10; 3], [30; 3]]),
            (png(ColorType::GrayscaleAlpha, BitDepth::Eight, 4), [[10; 3], [30; 3]]),
            (png(ColorType::Grayscale, BitDepth::One, 1), [[0; 3], [0; 3]]),
        ] {
            assert_eq!(read(&bytes, [2, 1]).unwrap(), expected);
        }
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        let red = bytes_of(RED_JPEG);
        for (bytes, part) in [
            (&b"GIF89a"[..], "the format of the color picture is \"GIF89a\"; give JPEG or PNG"),
            (&[0xff, 0xd8, 0xff, 0xd9], "the picture is damaged ("),
            (b"", "the format of the color picture is missing"),
            (&red[..red.len() - 2], "the picture is damaged (it ends early); copy"),
            (&red, "the size of the picture is 8 x 8; the depth image is 4 x 4"),
        ] {
            says(read(bytes, [4, 4]), part);
        }
        no_panic(&red, 4, 2000, |bytes| read(&bytes, [8, 8]));
        let png = png_of([8, 8], ColorType::Rgb, BitDepth::Eight, &[7; 192]);
        no_panic(png, 5, 1000, |bytes| read(&bytes, [8, 8]));
    }
}
