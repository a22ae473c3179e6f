//! The picture: an opaque sheet of pixels and the shapes that go on it.

use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform,
};

use crate::{Color, PixelRect, View, color};

/// The style of a line: color, width in pixels, dashes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pen {
    /// Color of the line.
    pub color: Color,
    /// Width in pixels.
    pub width: f64,
    /// Lengths of dash and gap in pixels; `None` is a solid line.
    pub dash: Option<[f64; 2]>,
}

impl Pen {
    /// A solid line.
    pub fn new(color: Color, width: f64) -> Self {
        Self { color, width, dash: None }
    }

    /// The same line, dashed in proportion to its width.
    pub fn dashed(self) -> Self {
        Self { dash: Some([3.5 * self.width.max(1.0), 2.5 * self.width.max(1.0)]), ..self }
    }
}

/// An opaque picture, at first all [`color::PAPER`].
pub struct Canvas {
    pixels: Pixmap,
}

impl Canvas {
    /// Largest width and height of a picture.
    pub const MAX_SIZE: u32 = 16_384;

    /// A blank picture; each side is clamped to 1 ..= [`Canvas::MAX_SIZE`].
    ///
    /// # Panics
    /// Where the memory for the pixels cannot be allocated.
    pub fn new(width: u32, height: u32) -> Self {
        let (width, height) = (width.clamp(1, Self::MAX_SIZE), height.clamp(1, Self::MAX_SIZE));
        let mut pixels = Pixmap::new(width, height).expect("sizes are within the limits of the pixel buffer");
        pixels.fill(skia(color::PAPER));
        Self { pixels }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.pixels.width()
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.pixels.height()
    }

    /// The whole picture as a rectangle.
    pub fn bounds(&self) -> PixelRect {
        PixelRect::new(0.0, 0.0, f64::from(self.width()), f64::from(self.height()))
    }

    /// The color of a pixel; [`color::PAPER`] outside the picture.
    pub fn pixel(&self, x: u32, y: u32) -> Color {
        self.pixels.pixel(x, y).map_or(color::PAPER, |p| Color {
            r: p.red(),
            g: p.green(),
            b: p.blue(),
            a: p.alpha(),
        })
    }

    /// Blends `color` over one pixel; no effect outside the picture.
    pub(crate) fn blend(&mut self, x: i64, y: i64, color: Color) {
        if x < 0 || y < 0 || x >= i64::from(self.width()) || y >= i64::from(self.height()) {
            return;
        }
        let at = 4 * (y as usize * self.width() as usize + x as usize);
        let data = &mut self.pixels.data_mut()[at..at + 4];
        let mixed = color.over(Color { r: data[0], g: data[1], b: data[2], a: 255 });
        data[..3].copy_from_slice(&[mixed.r, mixed.g, mixed.b]);
    }

    /// Copies rows of pixels, `width` each, with their upper left corner at `(x, y)`, clipped to the picture.
    pub(crate) fn paste(&mut self, x: usize, y: usize, width: usize, pixels: &[[u8; 3]]) {
        let (columns, rows) = (self.width() as usize, self.height() as usize);
        let fits = width.min(columns.saturating_sub(x));
        let data = self.pixels.data_mut();
        for (row, pixels) in pixels.chunks_exact(width.max(1)).take(rows.saturating_sub(y)).enumerate() {
            for (column, &[r, g, b]) in pixels.iter().take(fits).enumerate() {
                let at = 4 * ((y + row) * columns + x + column);
                data[at..at + 4].copy_from_slice(&[r, g, b, 255]);
            }
        }
    }

    /// Copies another picture, with its upper left corner at `(x, y)`.
    pub fn paste_canvas(&mut self, x: usize, y: usize, other: &Self) {
        let pixels: Vec<[u8; 3]> = other.pixels.data().chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        self.paste(x, y, other.width() as usize, &pixels);
    }

    /// A raster of `shape[0] × shape[1]` cells of `resolution` meters whose cell (0, 0) has its lower left
    /// corner at `origin`; `color` returns the color of a cell by index, which is blended over the picture.
    ///
    /// Every pixel looks up the cell under it at any scale: enlarged cells are crisp squares, and of cells smaller than a
    /// pixel up to 4 × 4 are averaged. O(pixels of the view).
    pub fn raster(
        &mut self,
        view: &View,
        shape: [usize; 2],
        origin: [f64; 2],
        resolution: f64,
        color: impl Fn([usize; 2]) -> Color,
    ) {
        let cells_per_pixel = 1.0 / (resolution * view.scale()[0].min(view.scale()[1]));
        if !(cells_per_pixel.is_finite() && cells_per_pixel > 0.0) {
            return;
        }
        let samples = cells_per_pixel.ceil().clamp(1.0, 4.0) as usize;
        let rect = view.rect();
        let (left, right) = (rect.x.max(0.0) as i64, rect.right().min(f64::from(self.width())).ceil() as i64);
        let (top, bottom) =
            (rect.y.max(0.0) as i64, rect.bottom().min(f64::from(self.height())).ceil() as i64);
        for y in top..bottom {
            for x in left..right {
                let mean = mean_color(samples, |offset| {
                    let world = view.world_from_pixel([x as f64 + offset[0], y as f64 + offset[1]]);
                    let cell = [0, 1].map(|a| ((world[a] - origin[a]) / resolution).floor());
                    let inside = (0..2).all(|a| cell[a] >= 0.0 && cell[a] < shape[a] as f64);
                    inside.then(|| color([cell[0] as usize, cell[1] as usize]))
                });
                if let Some(mean) = mean {
                    self.blend(x, y, mean);
                }
            }
        }
    }

    /// A line through `points` (world); it breaks at points that are not finite and is clipped to the view.
    pub fn polyline(&mut self, view: &View, points: &[[f64; 2]], pen: Pen) {
        let mut path = PathBuilder::new();
        let mut last: Option<[f64; 2]> = None;
        for pair in points.windows(2) {
            let Some([a, b]) = view.clip(pair[0], pair[1]) else {
                last = None;
                continue;
            };
            if last != Some(a) {
                path.move_to(a[0] as f32, a[1] as f32);
            }
            path.line_to(b[0] as f32, b[1] as f32);
            last = Some(b);
        }
        self.stroke(path.finish(), pen);
    }

    /// Separate segments (world), clipped to the view.
    pub fn segments(&mut self, view: &View, segments: &[[[f64; 2]; 2]], pen: Pen) {
        let mut path = PathBuilder::new();
        for [a, b] in segments.iter().filter_map(|[a, b]| view.clip(*a, *b)) {
            path.move_to(a[0] as f32, a[1] as f32);
            path.line_to(b[0] as f32, b[1] as f32);
        }
        self.stroke(path.finish(), pen);
    }

    /// A dashed line through `points` (world): ground truth.
    pub fn dashed(&mut self, view: &View, points: &[[f64; 2]], color: Color, width: f64) {
        self.polyline(view, points, Pen::new(color, width).dashed());
    }

    /// Discs of `radius` pixels at the `points` (world) inside the view.
    pub fn dots(&mut self, view: &View, points: &[[f64; 2]], radius: f64, color: Color) {
        let mut path = PathBuilder::new();
        for p in points.iter().filter_map(|p| view.inside(*p)) {
            path.push_circle(p[0] as f32, p[1] as f32, radius as f32);
        }
        self.fill(path.finish(), color);
    }

    /// A line from `from` to `to` (world) with a head at `to`; not drawn when either end lies outside the view.
    pub fn arrow(&mut self, view: &View, from: [f64; 2], to: [f64; 2], pen: Pen) {
        let (Some(a), Some(b)) = (view.inside(from), view.inside(to)) else { return };
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = dx.hypot(dy);
        if length == 0.0 {
            return;
        }
        let (ux, uy) = (dx / length, dy / length);
        let head = (3.0 * pen.width + 4.0).min(length);
        let base = [b[0] - ux * head, b[1] - uy * head];
        self.pixel_line(a, base, pen);
        let mut path = PathBuilder::new();
        path.move_to(b[0] as f32, b[1] as f32);
        for side in [-0.45 * head, 0.45 * head] {
            path.line_to((base[0] - uy * side) as f32, (base[1] + ux * side) as f32);
        }
        path.close();
        self.fill(path.finish(), pen.color);
    }

    /// The box from `min` to `max` (world), clipped to the view: filled, outlined, or both.
    pub fn rect(&mut self, view: &View, min: [f64; 2], max: [f64; 2], fill: Option<Color>, pen: Option<Pen>) {
        let (low, high) = (view.pixel_from_world(min), view.pixel_from_world(max));
        let frame = view.rect();
        let x = low[0].clamp(frame.x, frame.right());
        let y = high[1].clamp(frame.y, frame.bottom());
        let right = high[0].clamp(frame.x, frame.right());
        let bottom = low[1].clamp(frame.y, frame.bottom());
        if let Some(color) = fill {
            self.fill_rect(PixelRect::new(x, y, right - x, bottom - y), color);
        }
        if let Some(pen) = pen {
            let corners = [min, [max[0], min[1]], max, [min[0], max[1]], min];
            self.polyline(view, &corners, pen);
        }
    }

    /// The area between the lower and the upper line over `[x, lower, upper]` (world), clipped to the view.
    pub fn band(&mut self, view: &View, band: &[[f64; 3]], color: Color) {
        let frame = view.rect();
        let mut path = PathBuilder::new();
        for part in band.split(|p| p.iter().any(|v| !v.is_finite())).filter(|part| part.len() > 1) {
            let place = |x: f64, y: f64| {
                let p = view.pixel_from_world([x, y]);
                (p[0].clamp(frame.x, frame.right()) as f32, p[1].clamp(frame.y, frame.bottom()) as f32)
            };
            let there = part.iter().map(|p| place(p[0], p[1]));
            let back = part.iter().rev().map(|p| place(p[0], p[2]));
            for (i, (x, y)) in there.chain(back).enumerate() {
                if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
            }
            path.close();
        }
        self.fill(path.finish(), color);
    }

    /// A filled rectangle of pixels.
    pub fn fill_rect(&mut self, rect: PixelRect, color: Color) {
        let shape =
            tiny_skia::Rect::from_xywh(rect.x as f32, rect.y as f32, rect.width as f32, rect.height as f32);
        if let Some(shape) = shape {
            self.pixels.fill_rect(shape, &paint(color), Transform::identity(), None);
        }
    }

    /// The outline of a rectangle, snapped to pixel centers, so that thin lines are crisp.
    pub fn stroke_rect(&mut self, rect: PixelRect, pen: Pen) {
        let snap = |v: f64| v.round() + 0.5;
        let (x, y) = (snap(rect.x - 0.5), snap(rect.y - 0.5));
        let rect = PixelRect::new(x, y, snap(rect.right() - 0.5) - x, snap(rect.bottom() - 0.5) - y);
        let mut path = PathBuilder::new();
        path.move_to(rect.x as f32, rect.y as f32);
        path.line_to(rect.right() as f32, rect.y as f32);
        path.line_to(rect.right() as f32, rect.bottom() as f32);
        path.line_to(rect.x as f32, rect.bottom() as f32);
        path.close();
        self.stroke(path.finish(), pen);
    }

    /// A line between two pixel coordinates.
    pub fn pixel_line(&mut self, a: [f64; 2], b: [f64; 2], pen: Pen) {
        let mut path = PathBuilder::new();
        path.move_to(a[0] as f32, a[1] as f32);
        path.line_to(b[0] as f32, b[1] as f32);
        self.stroke(path.finish(), pen);
    }

    /// The picture as the bytes of a PNG file (8-bit RGB).
    ///
    /// # Panics
    /// Never in practice: encoding to memory does not fail.
    pub fn encode_png(&self) -> Vec<u8> {
        let rgb: Vec<u8> = self.pixels.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width(), self.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().expect("a PNG header in memory");
        writer.write_image_data(&rgb).expect("PNG data in memory");
        writer.finish().expect("the end of a PNG in memory");
        bytes
    }

    fn stroke(&mut self, path: Option<Path>, pen: Pen) {
        let Some(path) = path else { return };
        let dash = pen.dash.and_then(|[on, off]| StrokeDash::new(vec![on as f32, off as f32], 0.0));
        // Round caps would close the gaps of a dashed line.
        let line_cap = if dash.is_some() { LineCap::Butt } else { LineCap::Round };
        let stroke =
            Stroke { width: pen.width as f32, dash, line_cap, line_join: LineJoin::Round, miter_limit: 4.0 };
        self.pixels.stroke_path(&path, &paint(pen.color), &stroke, Transform::identity(), None);
    }

    fn fill(&mut self, path: Option<Path>, color: Color) {
        if let Some(path) = path {
            self.pixels.fill_path(&path, &paint(color), FillRule::Winding, Transform::identity(), None);
        }
    }
}

/// The mean of `samples * samples` colors in a pixel, weighted by opacity; `color` takes offsets within the pixel. `None`
/// where all are transparent or missing.
fn mean_color(samples: usize, color: impl Fn([f64; 2]) -> Option<Color>) -> Option<Color> {
    let mut sum = [0.0; 4];
    for sub in 0..samples * samples {
        let fraction = |i: usize| (i as f64 + 0.5) / samples as f64;
        let Some(c) = color([fraction(sub % samples), fraction(sub / samples)]) else { continue };
        let alpha = f64::from(c.a);
        for (total, channel) in sum.iter_mut().zip([c.r, c.g, c.b]) {
            *total += alpha * f64::from(channel);
        }
        sum[3] += alpha;
    }
    let channel = |i: usize| (sum[i] / sum[3]).round() as u8;
    let mean = || Color { r: channel(0), g: channel(1), b: channel(2), a: 255 };
    (sum[3] > 0.0).then(|| mean().with_alpha(sum[3] / (255 * samples * samples) as f64))
}

fn skia(color: Color) -> tiny_skia::Color {
    tiny_skia::Color::from_rgba8(color.r, color.g, color.b, color.a)
}

fn paint(color: Color) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(skia(color));
    paint.anti_alias = true;
    paint
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_view(canvas: &Canvas) -> View {
        View::fit([0.0, 0.0], [1.0, 1.0], canvas.bounds())
    }

    #[test]
    fn a_raster_puts_cell_zero_at_the_lower_left() {
        let mut canvas = Canvas::new(40, 40);
        let view = unit_view(&canvas);
        canvas.raster(&view, [2, 2], [0.0, 0.0], 0.5, |cell| match cell {
            [0, 0] => color::NEGATIVE,
            [1, 1] => color::POSITIVE,
            _ => color::TRANSPARENT,
        });
        assert_eq!(canvas.pixel(1, 38), color::NEGATIVE);
        assert_eq!(canvas.pixel(19, 20), color::NEGATIVE);
        assert_eq!(canvas.pixel(20, 19), color::POSITIVE);
        assert_eq!(canvas.pixel(1, 1), color::PAPER);
    }

    #[test]
    fn small_cells_are_averaged() {
        let mut canvas = Canvas::new(10, 10);
        let view = unit_view(&canvas);
        let checker = |[x, y]: [usize; 2]| if (x + y) % 2 == 0 { color::INK } else { color::PAPER };
        canvas.raster(&view, [20, 20], [0.0, 0.0], 0.05, checker);
        assert_eq!(canvas.pixel(5, 5), color::INK.mix(color::PAPER, 0.5));
        canvas.raster(&view, [20, 20], [0.0, 0.0], 0.0, checker);
    }

    #[test]
    fn shapes_land_where_the_view_says() {
        let mut canvas = Canvas::new(100, 100);
        let view = unit_view(&canvas);
        canvas.polyline(&view, &[[-5.0, 0.5], [5.0, 0.5]], Pen::new(color::SURFACE, 4.0));
        assert_eq!(canvas.pixel(50, 50), color::SURFACE);
        canvas.dots(&view, &[[0.5, 0.9], [f64::NAN, 0.0], [9.0, 9.0]], 4.0, color::MEASUREMENT);
        assert_eq!(canvas.pixel(50, 10), color::MEASUREMENT);
        canvas.rect(&view, [0.0, 0.0], [0.2, 0.2], Some(color::TRUTH), None);
        assert_eq!(canvas.pixel(10, 90), color::TRUTH);
        canvas.arrow(&view, [0.8, 0.1], [0.8, 0.3], Pen::new(color::INK, 2.0));
        assert_eq!(canvas.pixel(80, 75), color::INK);
        canvas.dashed(&view, &[[0.0, 0.75], [1.0, 0.75]], color::INK, 3.0);
        let dark = (0..100).filter(|x| canvas.pixel(*x, 25) == color::INK).count();
        assert!((30..80).contains(&dark), "dashes and gaps: {dark}");
    }

    #[test]
    fn the_png_decodes_to_the_same_pixels() {
        let mut canvas = Canvas::new(3, 2);
        canvas.blend(1, 1, color::POSITIVE);
        let bytes = canvas.encode_png();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut data).unwrap();
        let p = color::POSITIVE;
        assert_eq!(data[12..15], [p.r, p.g, p.b]);
        assert_eq!(data[..3], [255, 255, 255]);
    }

    #[test]
    fn nothing_panics_on_nothing() {
        let mut canvas = Canvas::new(0, 0);
        let view = View::fit([0.0, 0.0], [0.0, 0.0], PixelRect::new(0.0, 0.0, 0.0, 0.0));
        canvas.polyline(&view, &[], Pen::new(color::INK, 1.0));
        canvas.polyline(&view, &[[f64::INFINITY, f64::NAN]; 3], Pen::new(color::INK, 1.0));
        canvas.segments(&view, &[], Pen::new(color::INK, f64::NAN));
        canvas.raster(&view, [0, 0], [0.0, 0.0], 1.0, |_| color::INK);
        canvas.band(&view, &[[0.0, f64::NAN, 1.0]], color::INK);
        canvas.arrow(&view, [0.0, 0.0], [0.0, 0.0], Pen::new(color::INK, 1.0));
        assert!(!canvas.encode_png().is_empty());
    }
}
