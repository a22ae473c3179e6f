//! Legend and scale bar.

use crate::{Anchor, Canvas, Color, Font, Pen, PixelRect, View, color};

/// The symbol of a legend entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Swatch {
    /// A short line.
    Line(Pen),
    /// A dot.
    Dot(Color),
    /// A filled box: cells, areas, ramps.
    Area(Color),
}

/// One line of a legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The symbol.
    pub swatch: Swatch,
    /// The text.
    pub label: String,
}

impl Entry {
    /// An entry.
    pub fn new(swatch: Swatch, label: impl Into<String>) -> Self {
        Self { swatch, label: label.into() }
    }
}

const SWATCH: f64 = 26.0;
const GAP: f64 = 22.0;

impl Canvas {
    /// Draws entries in rows from the top left of `rect`, wrapped at its right edge; returns the height used.
    pub fn legend(&mut self, rect: PixelRect, entries: &[Entry], font: Font) -> f64 {
        let places = legend_places(rect.width, entries, font);
        for (entry, place) in entries.iter().zip(&places) {
            let (x, y) = (rect.x + place[0], rect.y + place[1]);
            let middle = y + 0.5 * font.height();
            match entry.swatch {
                Swatch::Line(pen) => self.pixel_line([x, middle], [x + SWATCH - 6.0, middle], pen),
                Swatch::Dot(color) => {
                    let dot =
                        View::stretch([0.0, 0.0], [1.0, 1.0], PixelRect::new(x, y, 20.0, font.height()));
                    self.dots(&dot, &[[0.5, 0.5]], 4.0, color);
                }
                Swatch::Area(color) => {
                    let area = PixelRect::new(x + 2.0, middle - 6.0, 16.0, 12.0);
                    self.fill_rect(area, color);
                    self.stroke_rect(area, Pen::new(color::GRID, 1.0));
                }
            }
            self.text([x + SWATCH, y], &entry.label, font, Anchor::Left);
        }
        legend_height(rect.width, entries, font)
    }

    /// Draws a bar of a round number of meters at the lower right of the view, with its length above it.
    pub fn scale_bar(&mut self, view: &View) {
        let rect = view.rect();
        let metres = round_down(0.25 * rect.width / view.scale()[0]);
        let length = metres * view.scale()[0];
        if !(length.is_finite() && length > 4.0) {
            return;
        }
        let label =
            if metres >= 1.0 { format!("{metres} m") } else { format!("{} cm", (metres * 100.0).round()) };
        let font = Font::new(16);
        let width = length.max(font.width(&label));
        let (right, bottom) = (rect.right() - 12.0, rect.bottom() - 12.0);
        let backing = PixelRect::new(
            right - 0.5 * (width + length) - 6.0,
            bottom - font.height() - 8.0,
            width + 12.0,
            font.height() + 14.0,
        );
        self.fill_rect(backing, color::PAPER.with_alpha(0.8));
        self.pixel_line([right - length, bottom], [right, bottom], Pen::new(color::INK, 3.0));
        self.text([right - 0.5 * length, bottom - font.height() - 5.0], &label, font, Anchor::Centre);
    }
}

/// Height that a legend of this width needs.
pub(crate) fn legend_height(width: f64, entries: &[Entry], font: Font) -> f64 {
    legend_places(width, entries, font).last().map_or(0.0, |place| place[1] + font.height() + 4.0)
}

/// Upper left corner of each entry relative to that of the legend.
fn legend_places(width: f64, entries: &[Entry], font: Font) -> Vec<[f64; 2]> {
    let (mut x, mut y) = (0.0, 0.0);
    entries
        .iter()
        .map(|entry| {
            let own = SWATCH + font.width(&entry.label);
            if x > 0.0 && x + own > width {
                (x, y) = (0.0, y + font.height() + 4.0);
            }
            let place = [x, y];
            x += own + GAP;
            place
        })
        .collect()
}

/// The largest 1, 2 or 5 times a power of ten that is not above `value`.
fn round_down(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let factor = [5.0, 2.0].into_iter().find(|f| f * power <= value * (1.0 + 1e-9)).unwrap_or(1.0);
    factor * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legends_wrap_inside_their_width() {
        let font = Font::new(16);
        let entries: Vec<_> = (0..9)
            .map(|i| Entry::new(Swatch::Area(color::SERIES[i % 6]), "a label of some length"))
            .collect();
        for place in legend_places(600.0, &entries, font) {
            assert!(place[0] + SWATCH + font.width("a label of some length") <= 600.0);
        }
        let mut canvas = Canvas::new(600, 200);
        let height = canvas.legend(canvas.bounds(), &entries, font);
        assert_eq!(height, legend_height(600.0, &entries, font));
        assert_eq!(canvas.legend(canvas.bounds(), &[], font), 0.0);
    }

    #[test]
    fn bars_have_round_lengths() {
        assert_eq!(round_down(3.7), 2.0);
        assert_eq!(round_down(5.0), 5.0);
        assert!((round_down(0.09) - 0.05).abs() < 1e-12);
        let mut canvas = Canvas::new(200, 100);
        let view = View::fit([0.0, 0.0], [10.0, 5.0], canvas.bounds());
        canvas.scale_bar(&view);
        assert_eq!(canvas.pixel(170, 88), color::INK);
    }
}
