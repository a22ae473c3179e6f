//! `map.png`: what was fused, on one picture.

use portolan::cell::{LogOdds8, LogOddsValue};
use portolan::geom::vector::distance;
use portolan::geom::{Aabb, Grid};
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

/// The picture of a map as PNG bytes; `None` where there is no map to show.
pub(crate) fn of_map(file: &MapFile<2>, derived: &Derived, title: &str) -> Option<Vec<u8>> {
    let (grid, shown) = shown_part(file)?;
    let [width, height] = shown.extent();
    let r = grid.lattice.resolution;
    // Whole pixels per cell where that is possible: cells stay squares.
    let fitting = LARGEST / (width.max(height) / r);
    let scale = if fitting >= 2.0 { fitting.floor().min(LARGEST_CELL) } else { fitting } / r;
    let (w, h) = ((width * scale).round(), (height * scale).round());
    let frame = PixelRect::new(MARGIN, MARGIN + TITLE, w.max(640.0), h);
    let mut canvas = Canvas::new((frame.right() + MARGIN) as u32, (frame.bottom() + LEGEND + MARGIN) as u32);
    let view = View::fit(shown.min, shown.max, frame);
    canvas.fill_rect(frame, color::UNKNOWN);
    let mut legend = vec![Entry::new(Swatch::Area(color::UNKNOWN), "not observed")];
    let colors = cell_colors(file, &grid, &mut legend);
    let [columns, _] = grid.shape;
    canvas.raster(&view, grid.shape, grid.lattice.origin, r, |[x, y]| colors[y * columns + x]);
    if let Some(contour) = &derived.contour {
        let segments: Vec<_> = contour.contour.ends().collect();
        let pen = Pen::new(color::SURFACE, (0.5 * scale * r).clamp(1.2, 2.5));
        canvas.segments(&view, &segments, pen);
        legend.push(Entry::new(Swatch::Line(Pen::new(color::SURFACE, 2.5)), "contour"));
    }
    if let Some(DistanceField::Two { points, .. }) = &derived.esdf
        && !points.is_empty()
    {
        for (center, _) in points {
            let corner = |sign: f64| center.map(|v| v + sign * 0.5 * r);
            canvas.rect(&view, corner(-1.0), corner(1.0), Some(color::SURFACE), None);
        }
        legend.push(Entry::new(Swatch::Area(color::SURFACE), "obstacle without a surface"));
    }
    draw_path(&mut canvas, &view, file, &mut legend);
    let heading = Font::new(24).bold();
    canvas.text([MARGIN, MARGIN - 4.0], &heading.fit(title, frame.width), heading, Anchor::Left);
    // The scale bar stands beside the legend, not on the map.
    let below = PixelRect::new(MARGIN, frame.bottom() + 10.0, frame.width, LEGEND);
    let [scale_x, scale_y] = view.scale();
    let meters = [below.width / scale_x, below.height / scale_y];
    canvas.scale_bar(&View::stretch([0.0; 2], meters, below.inset(0.0, 0.0, 0.0, 4.0)));
    canvas.legend(below.inset(0.0, 4.0, 0.3 * below.width, 0.0), &legend, Font::new(16));
    Some(canvas.encode_png())
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

/// The color of every cell: occupancy in light tones, and over it the signed distance near surfaces.
fn cell_colors(file: &MapFile<2>, grid: &Grid<2>, legend: &mut Vec<Entry>) -> Vec<Color> {
    let mut colors = vec![color::UNKNOWN; grid.len()];
    if let Some(map) = &file.grid {
        let table: Vec<Color> = (i8::MIN..=i8::MAX)
            .map(|v| match LogOdds8(v) {
                v if v.is_unobserved() => color::UNKNOWN,
                v => occupancy_color(v.probability(map.rule())),
            })
            .collect();
        let cells = map.store().planes();
        colors.iter_mut().zip(cells).for_each(|(c, v)| *c = table[(i16::from(v.0) + 128) as usize]);
    } else if let Some((_, cells)) = cells_for_map_server(file) {
        colors.iter_mut().zip(&cells).for_each(|(c, cell)| {
            *c = match cell {
                MapCell::Free => occupancy_color(0.1),
                MapCell::Occupied => occupancy_color(0.9),
                MapCell::Unknown => color::UNKNOWN,
            }
        });
    }
    legend.push(Entry::new(Swatch::Area(occupancy_color(0.1)), "free"));
    legend.push(Entry::new(Swatch::Area(occupancy_color(0.9)), "occupied"));
    if let Some(map) = &file.tsdf {
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
