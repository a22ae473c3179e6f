//! Text from pre-rendered glyphs: monospaced, so that widths are known before anything is drawn.
//!
//! Basic Latin and Latin-1 (±, ², ·, ×, °, µ) are available; a few other common characters are replaced by similar ASCII,
//! the rest by a question mark.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use crate::{Canvas, Color, color};

/// The position of the anchor in a line of text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// At its left end.
    #[default]
    Left,
    /// At its middle.
    Centre,
    /// At its right end.
    Right,
}

/// Size, weight and color of text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Font {
    height: RasterHeight,
    weight: FontWeight,
    color: Color,
}

impl Font {
    /// A font with the line height that is nearest to `height` pixels: 16, 20 or 24.
    pub fn new(height: u32) -> Self {
        let height = match height {
            0..=17 => RasterHeight::Size16,
            18..=21 => RasterHeight::Size20,
            _ => RasterHeight::Size24,
        };
        Self { height, weight: FontWeight::Regular, color: color::INK }
    }

    /// The same in bold.
    pub fn bold(self) -> Self {
        Self { weight: FontWeight::Bold, ..self }
    }

    /// The same in another color.
    pub fn color(self, color: Color) -> Self {
        Self { color, ..self }
    }

    /// Height of a line in pixels.
    pub fn height(&self) -> f64 {
        self.height.val() as f64
    }

    /// Width of `text` in pixels.
    pub fn width(&self, text: &str) -> f64 {
        (text.chars().count() * get_raster_width(self.weight, self.height)) as f64
    }

    /// `text` cut to at most `width` pixels, with two dots at the cut.
    pub fn fit(&self, text: &str, width: f64) -> String {
        if self.width(text) <= width {
            return text.to_owned();
        }
        let room = (width / self.width("0")).floor().max(0.0) as usize;
        let mut short: String = text.chars().take(room.saturating_sub(2)).collect();
        short.truncate(short.trim_end().len());
        short + ".."
    }

    /// `text` broken at spaces into lines of at most `width` pixels; a longer word stays whole.
    pub fn wrap(&self, text: &str, width: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split_whitespace() {
            match lines.last_mut() {
                Some(line) if self.width(line) + self.width(" ") + self.width(word) <= width => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines
    }
}

impl Canvas {
    /// One line of text; `at` is the pixel of its anchor on the upper edge of the line.
    pub fn text(&mut self, at: [f64; 2], text: &str, font: Font, anchor: Anchor) {
        let start = at[0] - offset(font.width(text), anchor);
        let (left, top) = (start.round() as i64, at[1].round() as i64);
        self.glyphs(text, font, |along, down| (left + along, top + down));
    }

    /// One line of text that reads upward; `at` is the pixel of its anchor on the left edge of the line.
    pub fn text_upward(&mut self, at: [f64; 2], text: &str, font: Font, anchor: Anchor) {
        let start = at[1] + offset(font.width(text), anchor);
        let (left, bottom) = (at[0].round() as i64, start.round() as i64);
        self.glyphs(text, font, |along, down| (left + down, bottom - 1 - along));
    }

    fn glyphs(&mut self, text: &str, font: Font, pixel: impl Fn(i64, i64) -> (i64, i64)) {
        let advance = get_raster_width(font.weight, font.height);
        for (i, c) in text.chars().enumerate() {
            let c = substitute(c);
            let glyph =
                get_raster(c, font.weight, font.height).or_else(|| get_raster('?', font.weight, font.height));
            for (row, pixels) in glyph.iter().flat_map(|g| g.rows().enumerate()) {
                for (column, &coverage) in pixels.iter().enumerate().filter(|(_, c)| **c > 0) {
                    let (x, y) = pixel((i * advance + column) as i64, row as i64);
                    let alpha = f64::from(coverage) / 255.0 * (f64::from(font.color.a) / 255.0);
                    self.blend(x, y, font.color.with_alpha(alpha));
                }
            }
        }
    }
}

fn offset(width: f64, anchor: Anchor) -> f64 {
    match anchor {
        Anchor::Left => 0.0,
        Anchor::Centre => 0.5 * width,
        Anchor::Right => width,
    }
}

fn substitute(c: char) -> char {
    match c {
        '\u{2010}'..='\u{2015}' | '\u{2212}' => '-',
        '\u{2018}' | '\u{2019}' => '\'',
        '\u{201c}' | '\u{201d}' => '"',
        '\u{03bc}' => 'µ',
        '\u{00a0}' | '\u{2009}' | '\t' => ' ',
        _ => c,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark_columns(canvas: &Canvas) -> Vec<u32> {
        (0..canvas.width()).filter(|x| (0..canvas.height()).any(|y| canvas.pixel(*x, y).r < 200)).collect()
    }

    #[test]
    fn anchors_move_the_line() {
        for (anchor, low, high) in [(Anchor::Left, 50, 70), (Anchor::Centre, 40, 60), (Anchor::Right, 30, 50)]
        {
            let mut canvas = Canvas::new(100, 30);
            canvas.text([50.0, 5.0], "mm", Font::new(20), anchor);
            let columns = dark_columns(&canvas);
            assert!(columns[0] >= low && columns[columns.len() - 1] < high, "{anchor:?}: {columns:?}");
        }
    }

    #[test]
    fn text_is_clipped_and_unknown_characters_are_marked() {
        let mut canvas = Canvas::new(8, 8);
        canvas.text([-20.0, -4.0], "over the edge \u{03c3}\u{4e2d}", Font::new(24), Anchor::Left);
        canvas.text_upward([2.0, 100.0], "over the edge", Font::new(24), Anchor::Right);
    }

    #[test]
    fn wrapping_and_cutting_respect_the_width() {
        let font = Font::new(16);
        let width = font.width("0123456789");
        let lines = font.wrap("one two three four five", width);
        assert!(lines.iter().all(|line| font.width(line) <= width));
        assert_eq!(lines.join(" "), "one two three four five");
        assert_eq!(font.fit("0123456789ab", width), "01234567..");
        assert_eq!(font.fit("short", width), "short");
    }
}
