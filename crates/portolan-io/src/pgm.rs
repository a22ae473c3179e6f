//! Netpbm gray maps: `P5` (binary) and `P2` (text), 8 and 16 bits.

use std::io::{self, Read, Write};
use std::path::Path;

use crate::bytes::{Input, Prepared, check_padding, open, parse_f64, prepare, read_failed};
use crate::error::shown;
use crate::{IoError, Result};

/// The most pixels of an image.
const MOST_PIXELS: u64 = 1 << 27;
/// So many bytes behind the pixels are looked at.
const MOST_BEHIND: u64 = 1 << 16;

/// A gray image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pgm {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The value of white, at least 1.
    pub max_value: u16,
    /// Gray values, at most `max_value`, row by row; the first row is the **top** of the picture.
    pub pixels: Vec<u16>,
}

impl Pgm {
    /// Reads an image file, plain or packed.
    ///
    /// # Errors
    /// As [`Pgm::parse`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::parse(open(path)?)
    }

    /// Reads an image. Memory grows with the bytes that are there, not with what the header claims.
    ///
    /// # Errors
    /// [`IoError::Binary`] for a wrong header, for too few pixels, and for bytes behind them that are no padding.
    pub fn parse(mut input: Input) -> Result<Self> {
        let mut header = Header { input: &mut input, offset: 0, last: 0 };
        let magic = [header.byte()?, header.byte()?].map(|b| b.unwrap_or(b' '));
        let text = match &magic {
            b"P5" => false,
            b"P2" => true,
            other => {
                let advice = "give a gray map (P5 or P2)";
                return Err(IoError::binary(header.input.path(), 0, "the magic", shown(other), advice));
            }
        };
        let width = header.number("the width", 1..=1 << 30)?;
        let height = header.number("the height", 1..=1 << 30)?;
        let max_value = header.number("the largest gray value", 1..=65_535)?;
        let count = width * height;
        if count > MOST_PIXELS {
            let value = format!("{width} x {height}");
            let advice = format!("give an image of at most {MOST_PIXELS} pixels");
            return Err(IoError::binary(header.input.path(), 2, "the image size", value, advice));
        }
        let pixels = if text {
            let mut pixels = Vec::new();
            for _ in 0..count {
                pixels.push(header.number("a pixel", 0..=max_value)? as u16);
            }
            let at = header.offset;
            let rest = input.read_up_to(MOST_BEHIND)?;
            check_padding(&rest, at, &format!("{count} pixels"), input.path())?;
            pixels
        } else {
            let (offset, after_return) = (header.offset, header.last == b'\r');
            binary_pixels(&mut input, (offset, after_return), count, max_value)?
        };
        Ok(Self { width: width as usize, height: height as usize, max_value: max_value as u16, pixels })
    }

    /// Writes a `P5` file: one byte a pixel up to 255, else two.
    ///
    /// # Errors
    /// [`IoError::Unwritable`] where the size does not fit the pixels, else as [`crate::write_atomic`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        self.prepare(path.as_ref())?.publish()
    }

    /// Writes it, and leaves it without its name.
    pub(crate) fn prepare<'a>(&self, path: &'a Path) -> Result<Prepared<'a>> {
        if self.width.checked_mul(self.height) != Some(self.pixels.len()) || self.max_value == 0 {
            let value = format!("{} x {} for {} pixels", self.width, self.height, self.pixels.len());
            return Err(IoError::unwritable(path, "the image size", value, "make width x height pixels"));
        }
        prepare(path, |w| self.write_to(w))
    }

    fn write_to(&self, w: &mut impl Write) -> io::Result<()> {
        write!(w, "P5\n{} {}\n{}\n", self.width, self.height, self.max_value)?;
        for row in self.pixels.chunks(self.width.max(1)) {
            let bytes: Vec<u8> = if self.max_value < 256 {
                row.iter().map(|&v| v as u8).collect()
            } else {
                row.iter().flat_map(|v| v.to_be_bytes()).collect()
            };
            w.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// The pixels from `offset` on. `after_return`: the header ended in a carriage return. One byte is all that separates header and
/// pixels, so a line feed behind it is a pixel, unless the file is longer than announced by just that byte.
fn binary_pixels(
    input: &mut Input,
    (mut offset, after_return): (u64, bool),
    count: u64,
    max_value: u64,
) -> Result<Vec<u16>> {
    let width = if max_value < 256 { 1 } else { 2 };
    let mut bytes = input.read_up_to(count * width)?;
    if bytes.len() as u64 == count * width {
        let rest = input.read_up_to(MOST_BEHIND)?;
        if let (true, Some(b'\n'), [last]) = (after_return, bytes.first(), &rest[..]) {
            bytes.push(*last);
            bytes.remove(0);
            offset += 1;
        } else {
            check_padding(&rest, offset + count * width, &format!("{count} pixels"), input.path())?;
        }
    }
    if bytes.len() as u64 != count * width {
        let value = format!("{} bytes", bytes.len());
        let advice = format!("the header announces {}: the file is cut off", count * width);
        return Err(IoError::binary(input.path(), offset, "the pixel data", value, advice));
    }
    let pixels: Vec<u16> = match width {
        1 => bytes.iter().map(|&b| u16::from(b)).collect(),
        _ => bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect(),
    };
    if let Some(i) = pixels.iter().position(|&v| u64::from(v) > max_value) {
        let advice = format!("the header announces at most {max_value}");
        let at = offset + i as u64 * width;
        return Err(IoError::binary(input.path(), at, "a pixel", pixels[i], advice));
    }
    Ok(pixels)
}

struct Header<'a> {
    input: &'a mut Input,
    offset: u64,
    /// The byte that was read last.
    last: u8,
}

impl Header<'_> {
    fn byte(&mut self) -> Result<Option<u8>> {
        let mut byte = [0];
        match self.input.read(&mut byte) {
            Ok(0) => Ok(None),
            Ok(_) => {
                self.offset += 1;
                self.last = byte[0];
                Ok(Some(byte[0]))
            }
            Err(e) => Err(read_failed(self.input.path(), self.input.compression(), self.offset, e)),
        }
    }

    /// The next number; exactly one byte behind it is consumed as well.
    fn number(&mut self, field: &str, allowed: std::ops::RangeInclusive<u64>) -> Result<u64> {
        let mut word = Vec::new();
        let mut at = self.offset;
        loop {
            let byte = self.byte()?;
            match byte {
                Some(b'#') if word.is_empty() => self.skip_comment()?,
                Some(b) if !b.is_ascii_whitespace() && word.len() < 20 => word.push(b),
                Some(b) if b.is_ascii_whitespace() && word.is_empty() => at = self.offset,
                _ => break,
            }
        }
        let value = parse_f64(&word).filter(|v| v.fract() == 0.0 && *v >= 0.0 && *v < 1e15).map(|v| v as u64);
        value.filter(|v| allowed.contains(v)).ok_or_else(|| {
            let advice = format!("write a whole number from {} to {}", allowed.start(), allowed.end());
            IoError::binary(self.input.path(), at, field, shown(&word), advice)
        })
    }

    fn skip_comment(&mut self) -> Result<()> {
        while self.byte()?.is_some_and(|b| b != b'\n') {}
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, no_panic, says, temporary};

    fn parse(bytes: impl Into<Vec<u8>>) -> Result<Pgm> {
        Pgm::parse(Input::from_reader(io::Cursor::new(bytes.into()), "m.pgm".as_ref())?)
    }

    #[test]
    fn text_and_binary_with_comments() {
        let p2 = parse("P2 # c\n# 7 8\n3 2\n#x\n15\n0 1 2\n13 14 15").unwrap();
        assert_eq!(p2, Pgm { width: 3, height: 2, max_value: 15, pixels: vec![0, 1, 2, 13, 14, 15] });
        let p5 = parse(*b"P5\n# made by hand\n2 2\n255\n\n#\x00\xff").unwrap();
        assert_eq!(p5.pixels, [10, 35, 0, 255]);
        assert_eq!(parse(*b"P5 1 1 1000 \x01\x02").unwrap().pixels, [258]);
        // Headers of two bytes at the end of a line, and files that end in one.
        assert_eq!(parse(*b"P5\r\n2 1\r\n255\r\nab").unwrap().pixels, [97, 98]);
        assert_eq!(parse(*b"P5\r2 1\r255\r\nb").unwrap().pixels, [10, 98]);
        assert_eq!(parse(*b"P5 2 1 255\nab\n").unwrap().pixels, [97, 98]);
    }

    #[test]
    fn round_trips() {
        let (_folder, path) = temporary("m.pgm");
        let mut random = Random(1);
        for max_value in [1, 255, 256, 65_535] {
            let pixels = (0..35).map(|_| random.below(max_value as usize + 1) as u16).collect();
            let image = Pgm { width: 7, height: 5, max_value, pixels };
            image.write(&path).unwrap();
            assert_eq!(Pgm::read(&path).unwrap(), image);
        }
        assert!(Pgm { width: 7, height: 5, max_value: 1, pixels: vec![] }.write(&path).is_err());
    }

    #[test]
    fn claims_are_checked_against_the_bytes() {
        for (bytes, part) in [
            (
                &b"P5 1000 1000 255\nabc"[..],
                "m.pgm: byte 17: the pixel data is 3 bytes; the header announces 1000000",
            ),
            (b"P5 1000000000 1000000000 255\n", "the image size is 1000000000 x 1000000000"),
            (b"P5 1152921504606846976 1 255\n", "the width is \"1152921504606846976\""),
            (b"P5 0 1 255\n", "the width is \"0\""),
            (b"P5 1 1 0\n", "the largest gray value is \"0\""),
            (b"P6 1 1 255\nabc", "the magic is \"P6\""),
            (b"P5 1 1 7\n\x08", "a pixel is 8; the header announces at most 7"),
            (b"P2 1 1 7\n8", "a pixel is \"8\""),
            (b"P5 2 1 255\nabc", "byte 13: the rest of the file is 1 bytes; the header announces 2 pixels"),
            (b"P5\r\n2 1\r\n255\r\nabc", "byte 15: the rest of the file is 2 bytes"),
            (b"P2 2 1 9\n1 2 3", "the rest of the file"),
            (b"", "the magic is"),
        ] {
            says(parse(bytes), part);
        }
    }

    #[test]
    fn no_bytes_make_it_panic() {
        for good in [&b"P5 # c\n4 3\n255\nabcdefghijkl"[..], b"P2\n2 2 9\n1 2 3 4\n"] {
            no_panic(good, 9, 3000, parse);
        }
    }
}
