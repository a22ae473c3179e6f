//! `map.png`: what was fused, on one picture.

use portolan::cell::{LogOdds8, LogOddsValue};
use portolan::geom::vector::distance;
use portolan::geom::{Aabb, Grid};
use portolan_draw::{Anchor, Canvas, Color, Entry, Font, Pen, PixelRect, Swatch, View, color};
use portolan_io::MapFile;

use crate::mapping::{Derived, cells_for_map_server};

/// The longer edge of the map on the picture is at most this long (pixels).
const LARGEST: f64 = 2400.0;
/// A cell is at most this large (pixels).
const LARGEST_CELL: f64 = 8.0;
const MARGIN: f64 = 28.0;
const TITLE: f64 = 40.0;
const LEGEND: f64 = 46.0;

/// The picture of a map as PNG bytes; `None` where there is no map to show.
pub(crate) fn of_map(file: &MapFile, derived: &Derived, title: &str) -> Option<Vec<u8>> {
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
    draw_occupancy(&mut canvas, &view, file, &mut legend);
    draw_distances(&mut canvas, &view, file, &mut legend);
    if let Some(contour) = &derived.contour {
        let segments: Vec<_> = contour.ends().collect();
        let pen = Pen::new(color::SURFACE, (0.5 * scale * r).clamp(1.2, 2.5));
        canvas.segments(&view, &segments, pen);
        legend.push(Entry::new(Swatch::Line(Pen::new(color::SURFACE, 2.5)), "contour"));
    }
    draw_path(&mut canvas, &view, file, &mut legend);
    canvas.scale_bar(&view);
    let heading = Font::new(24).bold();
    canvas.text([MARGIN, MARGIN - 4.0], &heading.fit(title, frame.width), heading, Anchor::Left);
    let below = PixelRect::new(MARGIN, frame.bottom() + 14.0, frame.width, LEGEND);
    canvas.legend(below, &legend, Font::new(16));
    Some(canvas.encode_png())
}

/// The box around all observed cells, a little larger, and the grid that it is cut from.
fn shown_part(file: &MapFile) -> Option<(Grid<2>, Aabb<2>)> {
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

/// Occupancy in light tones: what is drawn above stays legible.
fn draw_occupancy(canvas: &mut Canvas, view: &View, file: &MapFile, legend: &mut Vec<Entry>) {
    let lightly = |p: f64| color::UNKNOWN.mix(color::occupancy(p), if p < 0.5 { 1.0 } else { 0.45 });
    let mut entries = || {
        legend.push(Entry::new(Swatch::Area(lightly(0.12)), "free"));
        legend.push(Entry::new(Swatch::Area(lightly(0.97)), "occupied"));
    };
    if let Some(map) = &file.grid {
        let table: Vec<Color> = (i8::MIN..=i8::MAX)
            .map(|v| match LogOdds8(v) {
                v if v.is_unobserved() => color::UNKNOWN,
                v => lightly(v.probability(map.rule())),
            })
            .collect();
        let grid = *map.store().grid();
        let planes = map.store().planes();
        canvas.raster(view, grid.shape, grid.lattice.origin, grid.lattice.resolution, |[x, y]| {
            table[(i16::from(planes[y * grid.shape[0] + x].0) + 128) as usize]
        });
        entries();
    } else if let Some((grid, cells)) = cells_for_map_server(file) {
        use portolan_io::MapCell::{Free, Occupied, Unknown};
        canvas.raster(view, grid.shape, grid.lattice.origin, grid.lattice.resolution, |[x, y]| {
            match cells[y * grid.shape[0] + x] {
                Free => lightly(0.12),
                Occupied => lightly(0.97),
                Unknown => color::UNKNOWN,
            }
        });
        entries();
    }
}

/// The signed field near surfaces; where it is saturated the occupancy below shows.
fn draw_distances(canvas: &mut Canvas, view: &View, file: &MapFile, legend: &mut Vec<Entry>) {
    let Some(map) = &file.tsdf else { return };
    let (grid, planes) = (*map.grid(), map.store().planes());
    let truncation = map.config().truncation;
    canvas.raster(view, grid.shape, grid.lattice.origin, grid.lattice.resolution, |[x, y]| {
        let i = y * grid.shape[0] + x;
        let (d, w) = (f64::from(planes.distances()[i]), planes.weights()[i]);
        if w < 0.5 {
            return color::TRANSPARENT;
        }
        let tone = color::signed_distance(d, truncation);
        // In front of the surface the ramp runs out again towards the truncation.
        let rest = if d > 0.0 { (1.0 - d / truncation).clamp(0.0, 1.0) } else { 1.0 };
        tone.with_alpha(f64::from(tone.a) / 255.0 * rest)
    });
    legend.push(Entry::new(Swatch::Area(color::NEGATIVE.with_alpha(0.8)), "behind a surface"));
    legend.push(Entry::new(Swatch::Area(color::POSITIVE.with_alpha(0.3)), "in front of it"));
}

fn draw_path(canvas: &mut Canvas, view: &View, file: &MapFile, legend: &mut Vec<Entry>) {
    if file.poses.len() < 2 {
        return;
    }
    let at: Vec<_> = file.poses.iter().map(|p| p.translation).collect();
    let mut steps: Vec<f64> = at.windows(2).map(|w| distance(w[0], w[1])).collect();
    steps.sort_unstable_by(f64::total_cmp);
    // A jump is no way: another log begins, or the poses were corrected.
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
