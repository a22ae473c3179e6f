//! The content of a chart: axes, series, marks. It is drawn in `plot`.

use crate::{Canvas, Color};

/// The scale of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Linear.
    #[default]
    Linear,
    /// Logarithmic; values that are not positive are omitted.
    Log,
}

/// One axis of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// The quantity, with its unit.
    pub label: String,
    /// Linear or logarithmic.
    pub scale: Scale,
    /// Lower and upper limit; `None` for the range of the data.
    pub range: Option<[f64; 2]>,
}

/// The style of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// Straight lines between the points; breaks at points that are not finite.
    Straight,
    /// A staircase: each value holds until the next x.
    Step,
    /// As `Step`, filled down to zero (on a log axis: to the lower limit).
    FilledStep,
    /// Separate dots.
    Scatter,
}

/// Named data of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<[f64; 2]>,
    pub(crate) line: Line,
    pub(crate) color: Color,
    pub(crate) width: f64,
    pub(crate) dashed: bool,
}

impl Series {
    /// Points `[x, y]` joined by straight lines. A series with an empty name has no legend entry.
    pub fn line(name: impl Into<String>, points: impl IntoIterator<Item = [f64; 2]>, color: Color) -> Self {
        let points = points.into_iter().collect();
        Self { name: name.into(), points, line: Line::Straight, color, width: 2.0, dashed: false }
    }

    /// A staircase: each value holds from its x to that of the next point.
    pub fn step(name: impl Into<String>, points: impl IntoIterator<Item = [f64; 2]>, color: Color) -> Self {
        Self { line: Line::Step, ..Self::line(name, points, color) }
    }

    /// A staircase with the area below it filled.
    pub fn filled(name: impl Into<String>, points: impl IntoIterator<Item = [f64; 2]>, color: Color) -> Self {
        Self { line: Line::FilledStep, ..Self::line(name, points, color) }
    }

    /// Separate dots.
    pub fn scatter(
        name: impl Into<String>,
        points: impl IntoIterator<Item = [f64; 2]>,
        color: Color,
    ) -> Self {
        Self { line: Line::Scatter, width: 3.5, ..Self::line(name, points, color) }
    }

    /// The same series, dashed.
    pub fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }

    /// The same series with lines of `width` pixels, or dots of that radius.
    pub fn width(self, width: f64) -> Self {
        Self { width, ..self }
    }
}

/// A mark at a fixed place of the axes.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A dashed line at this x.
    Vertical(f64, String, Color),
    /// A dashed line at this y.
    Horizontal(f64, String, Color),
    /// A shaded stretch of the x axis.
    Span([f64; 2], String, Color),
    /// A shaded area `[x, lower, upper]`: an interval of confidence.
    Band(Vec<[f64; 3]>, String, Color),
}

/// A chart with two axes.
///
/// ```
/// use portolan_draw::{Chart, Series, color};
/// let residual = (1..100).map(|i| [i as f64, 1.0 / i as f64]);
/// let png = Chart::new("Residual")
///     .x("step").y("meters").log_y()
///     .series(Series::line("training", residual, color::POSITIVE))
///     .horizontal(0.02, "noise", color::TRUTH)
///     .encode_png(640, 400);
/// assert_eq!(&png[1..4], b"PNG");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    pub(crate) title: String,
    pub(crate) subtitle: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
    pub(crate) marks: Vec<Mark>,
}

impl Chart {
    /// An empty chart; an empty title takes no space.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Text below the title, wrapped as needed.
    pub fn subtitle(mut self, text: impl Into<String>) -> Self {
        self.subtitle = text.into();
        self
    }

    /// Label of the x axis.
    pub fn x(mut self, label: impl Into<String>) -> Self {
        self.x.label = label.into();
        self
    }

    /// Label of the y axis.
    pub fn y(mut self, label: impl Into<String>) -> Self {
        self.y.label = label.into();
        self
    }

    /// A logarithmic x axis.
    pub fn log_x(mut self) -> Self {
        self.x.scale = Scale::Log;
        self
    }

    /// A logarithmic y axis.
    pub fn log_y(mut self) -> Self {
        self.y.scale = Scale::Log;
        self
    }

    /// Fixed limits of the x axis; ignored when not finite or not in order.
    pub fn x_range(mut self, low: f64, high: f64) -> Self {
        self.x.range = Some([low, high]);
        self
    }

    /// Fixed limits of the y axis; ignored when not finite or not in order.
    pub fn y_range(mut self, low: f64, high: f64) -> Self {
        self.y.range = Some([low, high]);
        self
    }

    /// Adds a series; later ones are drawn over earlier ones.
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a dashed vertical line with a legend entry (none when the label is empty).
    pub fn vertical(self, x: f64, label: impl Into<String>, color: Color) -> Self {
        self.mark(Mark::Vertical(x, label.into(), color))
    }

    /// Adds a dashed horizontal line with a legend entry (none when the label is empty).
    pub fn horizontal(self, y: f64, label: impl Into<String>, color: Color) -> Self {
        self.mark(Mark::Horizontal(y, label.into(), color))
    }

    /// Shades the x axis from `low` to `high`.
    pub fn span(self, low: f64, high: f64, label: impl Into<String>, color: Color) -> Self {
        self.mark(Mark::Span([low, high], label.into(), color))
    }

    /// Shades the area between two lines given as `[x, lower, upper]`.
    pub fn band(
        self,
        points: impl IntoIterator<Item = [f64; 3]>,
        label: impl Into<String>,
        color: Color,
    ) -> Self {
        self.mark(Mark::Band(points.into_iter().collect(), label.into(), color))
    }

    /// Adds a mark.
    pub fn mark(mut self, mark: Mark) -> Self {
        self.marks.push(mark);
        self
    }

    /// The chart alone as the bytes of a PNG file.
    pub fn encode_png(&self, width: u32, height: u32) -> Vec<u8> {
        let mut canvas = Canvas::new(width, height);
        let rect = canvas.bounds().inset(18.0, 16.0, 22.0, 14.0);
        self.draw(&mut canvas, rect);
        canvas.encode_png()
    }
}
