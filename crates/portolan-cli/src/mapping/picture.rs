//! `map.png`: what was fused, on one picture.

use portolan::cell::{LogOdds8, LogOddsValue};
use portolan::geom::vector::distance;
use portolan::geom::{Aabb, Grid};
use portolan::uncertainty::SurfaceSigma;
use portolan_draw::{Anchor, Canvas, Color, Entry, Font, Pen, PixelRect, Swatch, View, color};
use portolan_io::{MapCell, MapFile};

use super::{Derived, DistanceField, cells_for_map_server};

/// The longer edge of the map on the picture is at most this long (pixels).
const LARGEST: f64 = 2400.0;
/// A cell is at most this large (pixels).
const LARGEST_CELL: f64 = 8.0;
const MARGIN: f64 = 28.0;
const TITLE: f64 = 40.0;
const LEGEND: f64 = 46.0;

/// The picture of a map as PNG bytes; `None` where there is no map to show. `movers`: points of what moved (world, meters).
pub(crate) fn of_map(
    file: &MapFile<2>,
    derived: &Derived,
    movers: &[[f64; 3]],
    title: &str,
) -> Option<Vec<u8>> {
    let mut sheet = Sheet::of(file, true)?;
    let (edge, width) = (sheet.edge, sheet.width);
    let Sheet { canvas, view, legend, .. } = &mut sheet;
    if let Some(contour) = &derived.contour {
        let segments: Vec<_> = contour.contour.ends().collect();
        let pen = Pen::new(color::SURFACE, width);
        canvas.segments(view, &segments, pen);
        legend.push(Entry::new(Swatch::Line(Pen::new(color::SURFACE, 2.5)), "contour"));
    }
    if let Some(DistanceField::Two { points, .. }) = &derived.esdf
        && !points.is_empty()
    {
        for (center, _) in points {
            let corner = |sign: f64| center.map(|v| v + sign * 0.5 * edge);
            canvas.rect(view, corner(-1.0), corner(1.0), Some(color::SURFACE), None);
        }
        legend.push(Entry::new(Swatch::Area(color::SURFACE), "obstacle without a surface"));
    }
    if !movers.is_empty() {
        let points: Vec<_> = movers.iter().map(|&[x, y, _]| [x, y]).collect();
        canvas.dots(view, &points, 0.7 * width, MOVED);
        legend.push(Entry::new(Swatch::Dot(MOVED), "moved, not in the map"));
    }
    draw_path(canvas, view, file, legend);
    Some(sheet.finish(title))
}

/// How sure the contour is: its segments in the color of their standard deviation. `None` where there is none.
pub(crate) fn of_sigma(
    file: &MapFile<2>,
    derived: &Derived,
    sigma: &SurfaceSigma,
    title: &str,
) -> Option<Vec<u8>> {
    let (map, contour) = (file.tsdf.as_ref()?, derived.contour.as_ref()?);
    let mut sheet = Sheet::of(file, false)?;
    let pen = |color| Pen::new(color, 2.0 * sheet.width);
    for [a, b] in contour.contour.ends() {
        let middle = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
        let color = sigma_color(sigma, sigma.of_distance(map.store(), middle, 0.0, [0.0; 2]));
        sheet.canvas.segments(&sheet.view, &[[a, b]], pen(color));
    }
    let [least, most] = sigma.ends();
    let entry = |at: f64| Entry::new(Swatch::Area(sigma_color(sigma, Some(at))), millimeters(at));
    let entries = [least, (least * most).sqrt(), most].map(entry);
    sheet.legend.extend(entries);
    Some(sheet.finish(&format!("{title} · standard deviation of the surface")))
}

/// Returns of what moved.
pub(super) const MOVED: Color = color::SERIES[4];

/// A length in words.
pub(super) fn millimeters(length: f64) -> String {
    format!("{:.1} mm", 1e3 * length)
}

/// The color of a standard deviation, from the surest of a surface to the least sure; of `None`, nothing is known.
pub(super) fn sigma_color(curve: &SurfaceSigma, sigma: Option<f64>) -> Color {
    // The palest tones do not show on paper.
    color::sequential(0.25 + 0.75 * sigma.map_or(f64::NAN, |sigma| curve.share(sigma)))
}

/// A picture of a 2-D map that is being drawn.
struct Sheet {
    canvas: Canvas,
    view: View,
    frame: PixelRect,
    legend: Vec<Entry>,
    /// Of a cell (meters).
    edge: f64,
    /// Of lines (pixels).
    width: f64,
}

impl Sheet {
    /// What is free and occupied, and with `distances` how far surfaces are.
    fn of(file: &MapFile<2>, distances: bool) -> Option<Self> {
        let (grid, shown) = shown_part(file)?;
        let [width, height] = shown.extent();
        let r = grid.lattice.resolution;
        // Whole pixels per cell where that is possible: cells stay squares.
        let fitting = LARGEST / (width.max(height) / r);
        let scale = if fitting >= 2.0 { fitting.floor().min(LARGEST_CELL) } else { fitting } / r;
        let (w, h) = ((width * scale).round(), (height * scale).round());
        let frame = PixelRect::new(MARGIN, MARGIN + TITLE, w.max(640.0), h);
        let mut canvas =
            Canvas::new((frame.right() + MARGIN) as u32, (frame.bottom() + LEGEND + MARGIN) as u32);
        let view = View::fit(shown.min, shown.max, frame);
        canvas.fill_rect(frame, color::UNKNOWN);
        let mut legend = vec![Entry::new(Swatch::Area(color::UNKNOWN), "not observed")];
        let colors = cell_colors(file, &grid, distances, &mut legend);
        let [columns, _] = grid.shape;
        canvas.raster(&view, grid.shape, grid.lattice.origin, r, |[x, y]| colors[y * columns + x]);
        Some(Self { canvas, view, frame, legend, edge: r, width: (0.5 * scale * r).clamp(1.2, 2.5) })
    }

    /// Title, legend and scale, and the bytes of the PNG.
    fn finish(mut self, title: &str) -> Vec<u8> {
        let heading = Font::new(24).bold();
        let frame = self.frame;
        let fitting = heading.fit(title, frame.width);
        self.canvas.text([MARGIN, MARGIN - 4.0], &fitting, heading, Anchor::Left);
        // The scale bar stands beside the legend, not on the map.
        let below = PixelRect::new(MARGIN, frame.bottom() + 10.0, frame.width, LEGEND);
        let [scale_x, scale_y] = self.view.scale();
        let meters = [below.width / scale_x, below.height / scale_y];
        self.canvas.scale_bar(&View::stretch([0.0; 2], meters, below.inset(0.0, 0.0, 0.0, 4.0)));
        self.canvas.legend(below.inset(0.0, 4.0, 0.3 * below.width, 0.0), &self.legend, Font::new(16));
        self.canvas.encode_png()
    }
}

/// The box around all observed cells, a little larger, and the grid that it is cut from.
fn shown_part(file: &MapFile<2>) -> Option<(Grid<2>, Aabb<2>)> {
    let grid = match (&file.tsdf, &file.grid) {
        (Some(map), _) => *map.grid(),
        (_, Some(map)) => *map.store().grid(),
        _ => cells_for_map_server(file)?.0,
    };
    let observed = |i: usize| match (&file.tsdf, &file.grid) {
        (Some(map), _) => map.store().at(i).is_some(),
        (_, Some(map)) => map.store().at(i).is_some(),
        _ => true,
    };
    let mut seen = Aabb::EMPTY;
    for i in (0..grid.len()).filter(|&i| observed(i)) {
        seen.include(grid.lattice.center(grid.cell(i)));
    }
    if seen.is_empty() {
        seen = grid.aabb();
    }
    Some((grid, seen.grown(6.0 * grid.lattice.resolution)))
}

/// The color of every cell: occupancy in light tones, and with `distances` over it the signed distance near surfaces.
fn cell_colors(file: &MapFile<2>, grid: &Grid<2>, distances: bool, legend: &mut Vec<Entry>) -> Vec<Color> {
    // What is drawn over them without distances must show.
    let tone = |p: f64| match distances {
        true => occupancy_color(p),
        false => occupancy_color(p).mix(color::FREE, 0.8),
    };
    let mut colors = vec![color::UNKNOWN; grid.len()];
    if let Some(map) = &file.grid {
        let table: Vec<Color> = (i8::MIN..=i8::MAX)
            .map(|v| match LogOdds8(v) {
                v if v.is_unobserved() => color::UNKNOWN,
                v => tone(v.probability(map.rule())),
            })
            .collect();
        let cells = map.store().planes();
        colors.iter_mut().zip(cells).for_each(|(c, v)| *c = table[(i16::from(v.0) + 128) as usize]);
    } else if let Some((_, cells)) = cells_for_map_server(file) {
        colors.iter_mut().zip(&cells).for_each(|(c, cell)| {
            *c = match cell {
                MapCell::Free => tone(0.1),
                MapCell::Occupied => tone(0.9),
                MapCell::Unknown => color::UNKNOWN,
            }
        });
    }
    legend.push(Entry::new(Swatch::Area(tone(0.1)), "free"));
    legend.push(Entry::new(Swatch::Area(tone(0.9)), "occupied"));
    if let Some(map) = file.tsdf.as_ref().filter(|_| distances) {
        let (planes, truncation) = (map.store().planes(), map.config().truncation);
        let observed = planes.distances().iter().zip(planes.weights());
        for (c, (&d, _)) in colors.iter_mut().zip(observed).filter(|(_, (_, w))| **w >= 0.5) {
            *c = distance_color(f64::from(d), truncation).over(*c);
        }
        legend
            .push(Entry::new(Swatch::Area(distance_color(-0.7, 1.0).over(color::PAPER)), "behind a surface"));
        legend.push(Entry::new(Swatch::Area(distance_color(0.5, 1.0).over(color::PAPER)), "in front of it"));
    }
    colors
}

/// From the paper of surely free space over the tone of what is not known to a dark gray.
fn occupancy_color(p: f64) -> Color {
    if p < 0.5 {
        // The lower clamp is 0.12: one miss is a third of the way, three are nearly all of it.
        color::UNKNOWN.mix(color::FREE, (0.5 - p) / 0.33)
    } else {
        color::UNKNOWN.mix(color::OCCUPIED, (p - 0.5) / 0.47 * 0.65)
    }
}

/// The ramp of signed distances; in front of the surface it runs out again towards the truncation, so that the
/// occupancy shows there.
fn distance_color(d: f64, truncation: f64) -> Color {
    let tone = color::signed_distance(d, truncation);
    let rest = if d > 0.0 { (1.0 - d / truncation).clamp(0.0, 1.0) } else { 1.0 };
    tone.with_alpha(f64::from(tone.a) / 255.0 * rest)
}

fn draw_path(canvas: &mut Canvas, view: &View, file: &MapFile<2>, legend: &mut Vec<Entry>) {
    if file.poses.len() < 2 {
        return;
    }
    let at: Vec<_> = file.poses.iter().map(|p| p.translation).collect();
    let mut steps: Vec<f64> = at.windows(2).map(|w| distance(w[0], w[1])).collect();
    steps.sort_unstable_by(f64::total_cmp);
    // A jump is not a path: another log begins, or the poses were corrected.
    let jump = 10.0 * steps[steps.len() / 2] + 1.0;
    let mut line = Vec::with_capacity(at.len());
    for (i, &p) in at.iter().enumerate() {
        if i > 0 && distance(at[i - 1], p) > jump {
            line.push([f64::NAN; 2]);
        }
        line.push(p);
    }
    canvas.polyline(view, &line, Pen::new(color::MEASUREMENT.with_alpha(0.85), 1.5));
    legend.push(Entry::new(Swatch::Line(Pen::new(color::MEASUREMENT, 2.0)), "way of the sensor"));
}
