//! Drawing of charts: space for text first, then grid, marks, series, axes.

use crate::chart::{Axis, Chart, Line, Mark, Scale, Series};
use crate::legend::legend_height;
use crate::{Anchor, Canvas, Entry, Font, Pen, PixelRect, Swatch, View, color};
use crate::{linear_ticks, log_ticks, tick_label};

impl Chart {
    /// Draws the chart into a rectangle of the canvas and returns the view of its plot area, in the units
    /// of the axes (on a logarithmic axis: in decades).
    pub fn draw(&self, canvas: &mut Canvas, rect: PixelRect) -> View {
        let (title, small) = (Font::new(20).bold(), Font::new(16));
        let mut top = rect.y;
        if !self.title.is_empty() {
            canvas.text([rect.x, top], &title.fit(&self.title, rect.width), title, Anchor::Left);
            top += title.height() + 2.0;
        }
        for line in small.wrap(&self.subtitle, rect.width) {
            canvas.text([rect.x, top], &line, small.color(color::MUTED), Anchor::Left);
            top += small.height() + 1.0;
        }
        let entries = self.entries();
        let legend = legend_height(rect.width, &entries, small);
        if legend > 0.0 {
            top += 5.0;
            canvas.legend(PixelRect::new(rect.x, top, rect.width, legend), &entries, small);
            top += legend;
        }
        top += 8.0;

        let (x, y) = (self.limits(0), self.limits(1));
        let x_label_height = if self.x.label.is_empty() { 0.0 } else { small.height() + 4.0 };
        let bottom = rect.bottom() - small.height() - 6.0 - x_label_height;
        let y_ticks = ticks(&self.y, y, ((bottom - top) / 36.0) as usize);
        let widest = y_ticks.iter().map(|(_, label)| small.width(label)).fold(0.0, f64::max);
        let y_label_width = if self.y.label.is_empty() { 0.0 } else { small.height() + 6.0 };
        let left = rect.x + y_label_width + widest + 7.0;
        let width = rect.right() - left;
        let x_ticks = ticks(&self.x, x, (width / 90.0) as usize);
        // The last label is centerd below its tick, which may be the end of the axis.
        let overhang = x_ticks.last().map_or(0.0, |(value, label)| {
            let room = (x[1] - value) / (x[1] - x[0]) * width;
            (0.5 * small.width(label) - room).max(0.0)
        });
        let plot = PixelRect::new(left, top, width - overhang, bottom - top);
        let view = View::stretch([x[0], y[0]], [x[1], y[1]], plot);

        let grid = Pen::new(color::GRID, 1.0);
        for (value, label) in &y_ticks {
            let at = view.pixel_from_world([x[0], *value])[1];
            canvas.pixel_line([plot.x, snap(at)], [plot.right(), snap(at)], grid);
            canvas.text([plot.x - 6.0, at - 0.5 * small.height()], label, small, Anchor::Right);
        }
        let mut free_from = f64::NEG_INFINITY;
        for (value, label) in &x_ticks {
            let at = view.pixel_from_world([*value, y[0]])[0];
            canvas.pixel_line([snap(at), plot.y], [snap(at), plot.bottom()], grid);
            let half = 0.5 * small.width(label);
            if at - half >= free_from {
                canvas.text([at, plot.bottom() + 5.0], label, small, Anchor::Centre);
                free_from = at + half + 8.0;
            }
        }
        for mark in &self.marks {
            self.draw_mark(canvas, &view, mark);
        }
        for series in &self.series {
            self.draw_series(canvas, &view, series);
        }
        let axis = Pen::new(color::MUTED, 1.0);
        canvas.pixel_line([snap(plot.x), plot.y], [snap(plot.x), snap(plot.bottom())], axis);
        canvas.pixel_line([snap(plot.x), snap(plot.bottom())], [plot.right(), snap(plot.bottom())], axis);
        let label = small.color(color::MUTED);
        let x_label = label.fit(&self.x.label, plot.width);
        let centre = plot.x + 0.5 * plot.width;
        canvas.text([centre, rect.bottom() - small.height()], &x_label, label, Anchor::Centre);
        let y_label = label.fit(&self.y.label, plot.height);
        canvas.text_upward([rect.x, plot.y + 0.5 * plot.height], &y_label, label, Anchor::Centre);
        view
    }

    fn entries(&self) -> Vec<Entry> {
        let series = self.series.iter().map(|s| {
            let swatch = match s.line {
                Line::Scatter => Swatch::Dot(s.color),
                Line::FilledStep => Swatch::Area(s.color.with_alpha(0.45)),
                Line::Straight | Line::Step => Swatch::Line(pen(s)),
            };
            Entry::new(swatch, s.name.as_str())
        });
        let marks = self.marks.iter().map(|mark| match mark {
            Mark::Vertical(_, label, c) | Mark::Horizontal(_, label, c) => {
                Entry::new(Swatch::Line(Pen::new(*c, 1.5).dashed()), label.as_str())
            }
            Mark::Span(_, label, c) | Mark::Band(_, label, c) => {
                Entry::new(Swatch::Area(c.with_alpha(SHADE)), label.as_str())
            }
        });
        series.chain(marks).filter(|entry| !entry.label.is_empty()).collect()
    }

    /// Limits of an axis in its own units (decades on a log axis): as set, or those of the data with a margin.
    fn limits(&self, which: usize) -> [f64; 2] {
        let axis = [&self.x, &self.y][which];
        let set = axis.range.map(|[low, high]| [axis.place(low), axis.place(high)]);
        if let Some([low, high]) = set.filter(|[low, high]| low.is_finite() && high.is_finite() && low < high)
        {
            return [low, high];
        }
        let points = self.series.iter().flat_map(|s| &s.points).map(|p| p[which]);
        let marks = self.marks.iter().flat_map(|mark| match (mark, which) {
            (Mark::Vertical(x, ..), 0) => vec![*x],
            (Mark::Horizontal(y, ..), 1) => vec![*y],
            (Mark::Span(ends, ..), 0) => ends.to_vec(),
            (Mark::Band(points, ..), 0) => points.iter().map(|p| p[0]).collect(),
            (Mark::Band(points, ..), _) => points.iter().flat_map(|p| [p[1], p[2]]).collect(),
            _ => Vec::new(),
        });
        let [low, high] = points
            .chain(marks)
            .map(|value| axis.place(value))
            .filter(|value| value.is_finite())
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        if low > high {
            return [0.0, 1.0];
        }
        if high - low <= 1e-12 * high.abs().max(low.abs()) {
            let half = if axis.scale == Scale::Log { 1.0 } else { (0.1 * high.abs()).max(0.5) };
            return [low - half, high + half];
        }
        let air = if which == 0 { 0.0 } else { 0.06 * (high - low) };
        // Zero is a better lower limit than a little below it.
        let from_zero = axis.scale == Scale::Linear && low >= 0.0 && low < 0.25 * high && which == 1;
        [if from_zero { 0.0 } else { low - air }, high + air]
    }

    fn draw_mark(&self, canvas: &mut Canvas, view: &View, mark: &Mark) {
        let (low, high) = view.world_box();
        match mark {
            Mark::Vertical(x, _, c) => {
                let x = self.x.place(*x);
                canvas.polyline(view, &[[x, low[1]], [x, high[1]]], Pen::new(*c, 1.5).dashed());
            }
            Mark::Horizontal(y, _, c) => {
                let y = self.y.place(*y);
                canvas.polyline(view, &[[low[0], y], [high[0], y]], Pen::new(*c, 1.5).dashed());
            }
            Mark::Span(ends, _, c) => {
                let ends = ends.map(|x| self.x.place(x));
                let area = ends.map(|x| [x, low[1], high[1]]);
                canvas.band(view, &area, c.with_alpha(SHADE));
            }
            Mark::Band(points, _, c) => {
                let place = |p: &[f64; 3]| [self.x.place(p[0]), self.y.place(p[1]), self.y.place(p[2])];
                let points: Vec<_> = points.iter().map(place).collect();
                canvas.band(view, &points, c.with_alpha(SHADE));
            }
        }
    }

    fn draw_series(&self, canvas: &mut Canvas, view: &View, series: &Series) {
        let placed: Vec<[f64; 2]> =
            series.points.iter().map(|p| [self.x.place(p[0]), self.y.place(p[1])]).collect();
        match series.line {
            Line::Scatter => canvas.dots(view, &placed, series.width, series.color),
            Line::Straight => canvas.polyline(view, &placed, pen(series)),
            Line::Step => canvas.polyline(view, &staircase(&placed), pen(series)),
            Line::FilledStep => {
                let steps = staircase(&placed);
                let floor = view.world_box().0[1];
                let floor = if self.y.scale == Scale::Log { floor } else { floor.max(0.0) };
                let area: Vec<_> = steps.iter().map(|p| [p[0], floor, p[1]]).collect();
                canvas.band(view, &area, series.color.with_alpha(0.22));
                canvas.polyline(view, &steps, pen(series));
            }
        }
    }
}

/// Opacity of shaded areas.
const SHADE: f64 = 0.16;

impl Axis {
    /// A value in the units in which the axis is even; NaN where it has no place.
    fn place(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log if value > 0.0 => value.log10(),
            Scale::Log => f64::NAN,
        }
    }
}

fn pen(series: &Series) -> Pen {
    let pen = Pen::new(series.color, series.width);
    if series.dashed { pen.dashed() } else { pen }
}

fn staircase(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let corners = points.windows(2).flat_map(|pair| [pair[0], [pair[1][0], pair[0][1]]]);
    corners.chain(points.last().copied()).collect()
}

/// Places (in the even units of the axis) and labels of its ticks.
fn ticks(axis: &Axis, limits: [f64; 2], count: usize) -> Vec<(f64, String)> {
    let count = count.clamp(2, 12);
    let values = match axis.scale {
        Scale::Linear => linear_ticks(limits[0], limits[1], count),
        Scale::Log => log_ticks(10_f64.powf(limits[0]), 10_f64.powf(limits[1]), count),
    };
    let step = values.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let label = |value: f64| match axis.scale {
        Scale::Linear => tick_label(value, step),
        Scale::Log => tick_label(value, value),
    };
    values.into_iter().map(|value| (axis.place(value), label(value))).collect()
}

/// The middle of the pixel, so that lines of one pixel are crisp.
fn snap(at: f64) -> f64 {
    at.floor() + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(chart: &Chart) -> (Canvas, View) {
        let mut canvas = Canvas::new(400, 300);
        let rect = canvas.bounds();
        let view = chart.draw(&mut canvas, rect);
        (canvas, view)
    }

    #[test]
    fn values_land_at_their_place() {
        let flat = [[0.0, 5.0], [10.0, 5.0]];
        let chart =
            Chart::new("").y_range(0.0, 10.0).series(Series::line("", flat, color::SURFACE).width(3.0));
        let (canvas, view) = drawn(&chart);
        let [x, y] = view.pixel_from_world([5.5, 5.0]);
        assert_eq!(canvas.pixel(x as u32, y as u32), color::SURFACE);
        assert_eq!(view.world_box().1, [10.0, 10.0]);
    }

    #[test]
    fn log_axes_are_even_in_decades() {
        let points = [[1.0, 1e-3], [1000.0, 1e3], [10.0, -1.0]];
        let chart = Chart::new("").log_x().log_y().series(Series::scatter("", points, color::INK));
        let (_, view) = drawn(&chart);
        let (low, high) = view.world_box();
        assert!((low[0] - 0.0).abs() < 1e-9 && (high[0] - 3.0).abs() < 1e-9);
        assert!(low[1] < -3.0 && high[1] > 3.0);
    }

    #[test]
    fn empty_constant_and_broken_data_draw() {
        let nan = f64::NAN;
        let data: [&[[f64; 2]]; 5] = [
            &[],
            &[[1.0, 1.0]],
            &[[nan, 1.0], [2.0, nan]],
            &[[0.0, 7.0], [1.0, 7.0]],
            &[[0.0, f64::INFINITY]],
        ];
        for points in data {
            let points = points.to_vec();
            let base = Chart::new("title").x("x").y("y").subtitle("sub");
            for chart in [base.clone(), base.clone().log_x().log_y(), base.y_range(2.0, 1.0)] {
                let chart = chart
                    .series(Series::line("a", points.clone(), color::INK))
                    .series(Series::filled("b", points.clone(), color::INK))
                    .series(Series::step("c", points.clone(), color::INK).dashed())
                    .series(Series::scatter("d", points.clone(), color::INK))
                    .vertical(nan, "v", color::INK)
                    .span(0.0, nan, "s", color::INK)
                    .band([[0.0, nan, 1.0]], "b", color::INK);
                drawn(&chart);
                chart.encode_png(1, 1);
            }
        }
    }

    #[test]
    fn staircases_hold_their_value() {
        let steps = staircase(&[[0.0, 1.0], [1.0, 3.0], [2.0, 3.0]]);
        assert_eq!(steps, [[0.0, 1.0], [1.0, 1.0], [1.0, 3.0], [2.0, 3.0], [2.0, 3.0]]);
        assert!(staircase(&[]).is_empty());
    }
}
