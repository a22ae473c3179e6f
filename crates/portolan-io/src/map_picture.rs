//! The picture of a map_server map: a gray map or a PNG.

use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Transformations};

use crate::bytes::open;
use crate::scan_log::{damaged, read_picture, size_within_limits};
use crate::{IoError, Pgm, Result};

/// Reads a picture by its first bytes. Colors and palettes become the mean of red, green and blue, as in map_server.
///
/// # Errors
/// Those of [`Pgm::read`]; [`IoError::Layout`] for a PNG that is damaged or has pixels that can be seen through, of which nobody says
/// whether they are free.
pub(crate) fn read_map_picture(path: &Path) -> Result<Pgm> {
    if open(path)?.read_up_to(4)? == b"\x89PNG" {
        decode_png(path, &read_picture(path)?)
    } else {
        Pgm::read(path)
    }
}

fn decode_png(path: &Path, bytes: &[u8]) -> Result<Pgm> {
    let error = |e: png::DecodingError| damaged(path, &e.to_string());
    let mut decoder = Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_ignore_text_chunk(true);
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(error)?;
    let info = reader.info();
    let holds = bytes.len().saturating_mul(8) / info.bits_per_pixel().max(1);
    let [width, height] = size_within_limits(path, info.width, info.height, holds, 1)?;
    let (color, depth) = reader.output_color_type();
    let size = if depth == BitDepth::Sixteen { 2 } else { 1 };
    let channels = color.samples();
    let mut raw = vec![0; width * height * channels * size];
    reader.next_frame(&mut raw).map_err(error)?;
    let max_value = if size == 2 { u16::MAX } else { 255 };
    let samples: Vec<u16> = match size {
        2 => raw.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect(),
        _ => raw.into_iter().map(u16::from).collect(),
    };
    let has_alpha = matches!(color, ColorType::GrayscaleAlpha | ColorType::Rgba);
    let colors = channels - usize::from(has_alpha);
    if has_alpha && samples.chunks_exact(channels).any(|pixel| pixel[colors] != max_value) {
        let advice = "flatten it: whether what is seen through is free is not said";
        return Err(IoError::layout(path, "the picture", "partly transparent", advice));
    }
    let gray = |pixel: &[u16]| {
        let sum: u32 = pixel[..colors].iter().map(|&v| u32::from(v)).sum();
        ((sum + colors as u32 / 2) / colors as u32) as u16
    };
    Ok(Pgm { width, height, max_value, pixels: samples.chunks_exact(channels).map(gray).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::png_of;
    use crate::testing::{no_panic, says};

    #[test]
    fn pictures_of_all_kinds_are_gray() {
        let path = Path::new("m.png");
        let read = |color, depth, bytes: &[u8]| decode_png(path, &png_of([2, 1], color, depth, bytes));
        let eight = BitDepth::Eight;
        let gray = read(ColorType::Grayscale, eight, &[0, 254]).unwrap();
        assert_eq!(gray, Pgm { width: 2, height: 1, max_value: 255, pixels: vec![0, 254] });
        let rgb = read(ColorType::Rgb, eight, &[0, 0, 0, 254, 253, 255]).unwrap();
        assert_eq!(rgb.pixels, [0, 254]);
        let wide = read(ColorType::Grayscale, BitDepth::Sixteen, &[1, 2, 255, 255]).unwrap();
        assert_eq!((wide.max_value, wide.pixels), (u16::MAX, vec![258, u16::MAX]));
        let one = read(ColorType::Grayscale, BitDepth::One, &[0b0100_0000]).unwrap();
        assert_eq!(one.pixels, [0, 255]);
        assert_eq!(read(ColorType::GrayscaleAlpha, eight, &[7, 255, 8, 255]).unwrap().pixels, [7, 8]);
        says(read(ColorType::GrayscaleAlpha, eight, &[7, 255, 8, 0]), "the picture is partly transparent");
        let whole = png_of([9, 9], ColorType::Rgb, eight, &[7; 243]);
        no_panic(&whole, 8, 2000, |bytes| decode_png(path, &bytes));
    }
}
