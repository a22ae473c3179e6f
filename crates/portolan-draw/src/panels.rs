//! Maps side by side: a grid of views of the same box of the world, each with its title.

use crate::{Anchor, Canvas, Entry, Font, Pen, PixelRect, View, color, legend::legend_height};

/// Heading of one panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// The title.
    pub title: String,
    /// Lines of detail below the title: memory, time, error.
    pub lines: Vec<String>,
}

/// A grid of panels, laid out for a given box of the world.
///
/// ```
/// use portolan_draw::{Panels, Pen, color};
/// let sheet = Panels::new("One lap, two maps").panel("TSDF", ["346 kB"]).panel("ESDF", ["173 kB"]);
/// let (mut canvas, views) = sheet.layout([0.0, 0.0], [12.0, 9.0], 360.0);
/// for view in &views {
///     canvas.polyline(view, &[[1.0, 1.0], [11.0, 8.0]], Pen::new(color::SURFACE, 2.0));
/// }
/// assert_eq!(views.len(), 2);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panels {
    title: String,
    subtitle: String,
    columns: usize,
    panels: Vec<Panel>,
    legend: Vec<Entry>,
    large: bool,
}

const MARGIN: f64 = 24.0;
const GAP: f64 = 22.0;

impl Panels {
    /// A sheet with a title (may be empty) and no panels.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// A line below the title, wrapped as needed.
    pub fn subtitle(mut self, text: impl Into<String>) -> Self {
        self.subtitle = text.into();
        self
    }

    /// Number of panels in a row; by default the sheet is nearly square.
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = columns;
        self
    }

    /// Larger text, for wide panels that are shown reduced.
    pub fn large(mut self) -> Self {
        self.large = true;
        self
    }

    /// Adds a panel; panels fill the sheet row by row.
    pub fn panel<L: Into<String>>(
        mut self,
        title: impl Into<String>,
        lines: impl IntoIterator<Item = L>,
    ) -> Self {
        self.panels.push(Panel { title: title.into(), lines: lines.into_iter().map(Into::into).collect() });
        self
    }

    /// A legend for all panels, below the grid.
    pub fn legend(mut self, entries: impl IntoIterator<Item = Entry>) -> Self {
        self.legend = entries.into_iter().collect();
        self
    }

    /// A canvas with headings, frames and legend drawn, and one view of the world box per panel, each
    /// `panel_width` pixels wide and as high as the box demands (at most three times as high).
    pub fn layout(&self, world_min: [f64; 2], world_max: [f64; 2], panel_width: f64) -> (Canvas, Vec<View>) {
        let aspect = (world_max[1] - world_min[1]) / (world_max[0] - world_min[0]);
        let aspect = if aspect.is_finite() && aspect > 0.0 { aspect.clamp(0.05, 3.0) } else { 1.0 };
        let (canvas, rects) = self.layout_rects(panel_width, panel_width * aspect);
        let views = rects.into_iter().map(|rect| View::fit(world_min, world_max, rect)).collect();
        (canvas, views)
    }

    /// [`Panels::layout`] with rectangles of `width × height` pixels instead of views: for charts or mixed content.
    pub fn layout_rects(&self, width: f64, height: f64) -> (Canvas, Vec<PixelRect>) {
        let count = self.panels.len().max(1);
        let columns =
            if self.columns > 0 { self.columns.min(count) } else { square_columns(count, width, height) };
        let rows = count.div_ceil(columns);
        let [detail, small] = if self.large { [24, 20] } else { [20, 16] };
        let (heading, detail, small) = (Font::new(24).bold(), Font::new(detail).bold(), Font::new(small));
        let inner = columns as f64 * width + (columns - 1) as f64 * GAP;

        let subtitle = small.wrap(&self.subtitle, inner);
        let title_height = if self.title.is_empty() { 0.0 } else { heading.height() + 6.0 };
        let top = MARGIN
            + title_height
            + subtitle.len() as f64 * small.height()
            + if subtitle.is_empty() { 0.0 } else { 8.0 };
        let lines = self.panels.iter().map(|p| p.lines.len()).max().unwrap_or(0);
        let header = detail.height() + lines as f64 * small.height() + 6.0;
        let legend = legend_height(inner, &self.legend, small);
        let grid = rows as f64 * (header + height) + (rows - 1) as f64 * GAP;
        let bottom = if legend > 0.0 { legend + 14.0 } else { 0.0 };

        let mut canvas =
            Canvas::new((inner + 2.0 * MARGIN).ceil() as u32, (top + grid + bottom + MARGIN).ceil() as u32);
        canvas.text([MARGIN, MARGIN - 6.0], &heading.fit(&self.title, inner), heading, Anchor::Left);
        for (i, line) in subtitle.iter().enumerate() {
            let y = MARGIN + title_height - 4.0 + i as f64 * small.height();
            canvas.text([MARGIN, y], line, small.color(color::MUTED), Anchor::Left);
        }
        let mut rects = Vec::with_capacity(self.panels.len());
        for (i, panel) in self.panels.iter().enumerate() {
            let x = MARGIN + (i % columns) as f64 * (width + GAP);
            let y = top + (i / columns) as f64 * (header + height + GAP);
            canvas.text([x, y], &detail.fit(&panel.title, width), detail, Anchor::Left);
            for (n, line) in panel.lines.iter().enumerate() {
                let below = y + detail.height() + n as f64 * small.height();
                canvas.text([x, below], &small.fit(line, width), small.color(color::MUTED), Anchor::Left);
            }
            let rect = PixelRect::new(x, y + header, width, height);
            canvas.stroke_rect(rect.inset(-0.5, -0.5, -0.5, -0.5), Pen::new(color::GRID, 1.0));
            rects.push(rect);
        }
        canvas.legend(PixelRect::new(MARGIN, top + grid + 14.0, inner, legend), &self.legend, small);
        (canvas, rects)
    }
}

/// Columns for which the sheet is nearest to 3 : 2.
fn square_columns(count: usize, width: f64, height: f64) -> usize {
    let ratio = |columns: usize| {
        let rows = count.div_ceil(columns) as f64;
        ((columns as f64 * width) / (rows * height) / 1.5).ln().abs()
    };
    (1..=count).min_by(|a, b| ratio(*a).total_cmp(&ratio(*b))).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_share_the_world_box_and_do_not_overlap() {
        let mut sheet = Panels::new("title").subtitle("words ".repeat(60));
        for i in 0..5 {
            sheet = sheet.panel(format!("panel {i}"), ["first", "second"]);
        }
        let (canvas, views) = sheet.columns(3).layout([0.0, 0.0], [4.0, 3.0], 200.0);
        assert_eq!(views.len(), 5);
        for (i, a) in views.iter().enumerate() {
            assert!((a.rect().width - 200.0).abs() < 1e-9 && (a.rect().height - 150.0).abs() < 1e-9);
            assert!(a.rect().right() <= f64::from(canvas.width()));
            assert!(a.rect().bottom() <= f64::from(canvas.height()));
            for b in &views[i + 1..] {
                assert!(a.rect().right() <= b.rect().x || a.rect().bottom() <= b.rect().y);
            }
        }
    }

    #[test]
    fn no_panels_and_bad_boxes_are_a_sheet_too() {
        let (canvas, views) = Panels::default().layout([0.0, 0.0], [f64::NAN, 0.0], 100.0);
        assert!(views.is_empty() && canvas.width() > 100);
    }
}
