//! One map, drawn.

use crate::MapRepr;
use portolan::cell::LogOddsValue;
use portolan::geom::{Aabb, Grid};
use portolan::store::Store;
use portolan::surface::{Ambiguity, level_set};
use portolan_draw::{Canvas, Color, Pen, PixelRect, View, color};
use portolan_sim::SolidKind;

use super::Scene;

/// What a panel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The way of the robot and one scan, over the true world where it is known.
    Log,
    /// The occupancy grid.
    Grid,
    /// The quadtree with its leaves.
    Tree,
    /// The truncated field with contour and truth.
    Tsdf,
    /// Its weights.
    Weight,
    /// The Euclidean field with level rings.
    Esdf,
    /// The Euclidean field less the true distance.
    EsdfError,
    /// The extracted contour.
    Contour,
    /// The share of beams through each cell that end in it, by hits per meter.
    Hits,
    /// The end points of all beams.
    Cloud,
    /// A few cells of the truncated field, with contour, truth and end points.
    CloseUp,
}

/// Distance at which the color of the Euclidean field saturates (meters).
const FAR: f64 = 1.5;
/// Spacing of its level rings (meters).
const RING: f64 = 0.25;
/// Error of the Euclidean field at which its color saturates (meters).
pub(super) const ERROR: f64 = 0.10;
/// Share of its full strength that the truncated field is drawn with, so that lines stay legible on it.
const TSDF_STRENGTH: f64 = 0.62;

impl Layer {
    /// Draws the layer into a view of the world.
    pub(super) fn draw(self, canvas: &mut Canvas, view: &View, scene: &Scene) {
        match self {
            Self::Log => log(canvas, view, scene),
            Self::Grid => grid(canvas, view, scene),
            Self::Tree => tree(canvas, view, scene),
            Self::Tsdf => tsdf(canvas, view, scene),
            Self::Weight => weight(canvas, view, scene),
            Self::Esdf => esdf(canvas, view, scene),
            Self::EsdfError => esdf_error(canvas, view, scene),
            Self::Contour => contour(canvas, view, scene),
            Self::Hits => hits(canvas, view, scene),
            Self::Cloud => cloud(canvas, view, scene),
            Self::CloseUp => close_up(canvas, view, scene),
        }
    }

    /// The box of the world that the layer is drawn over.
    pub(super) fn shown(self, scene: &Scene) -> Aabb<2> {
        if self == Self::CloseUp { scene.close_up() } else { scene.shown() }
    }
}

fn log(canvas: &mut Canvas, view: &View, scene: &Scene) {
    if let Some(world) = scene.world {
        for solid in world.solids() {
            let fill = match solid.kind {
                SolidKind::Wall => color::TRUTH.mix(color::PAPER, 0.45),
                SolidKind::Furniture => color::TRUTH.mix(color::PAPER, 0.75),
                SolidKind::Movable => color::NEGATIVE.mix(color::PAPER, 0.55),
            };
            let b = solid.aabb();
            canvas.rect(view, b.min, b.max, Some(fill), None);
        }
        truth(canvas, view, scene, 1.2);
    } else {
        canvas.dots(view, scene.gallery.cloud.points(), 0.6, color::TRUTH);
    }
    if let Some((pose, scan)) = scene.shown_scan() {
        let from = pose.translation;
        let ends: Vec<_> = scan.hits_world(pose).collect();
        let beams: Vec<_> = ends.iter().map(|&end| [from, end]).collect();
        canvas.segments(view, &beams, Pen::new(color::MEASUREMENT.with_alpha(0.32), 1.0));
        canvas.dots(view, &ends, 2.0, color::MEASUREMENT);
    }
    let path: Vec<_> = scene.log.iter().map(|(pose, _)| pose.translation).collect();
    canvas.polyline(view, &path, Pen::new(color::INK, 1.6));
    if let Some((pose, _)) = scene.shown_scan() {
        canvas.dots(view, &[pose.translation], 6.0, color::INK);
    }
}

fn grid(canvas: &mut Canvas, view: &View, scene: &Scene) {
    let map = &scene.gallery.occupancy;
    let cells = *map.store().grid();
    cell_raster(canvas, view, &cells, |i| Some(color::occupancy(map.store().at(i)?.probability(map.rule()))));
}

fn hits(canvas: &mut Canvas, view: &View, scene: &Scene) {
    let map = &scene.gallery.hits;
    let cells = *map.store().grid();
    cell_raster(canvas, view, &cells, |i| Some(color::occupancy(map.store().at(i)?.opacity::<2>())));
}

fn tree(canvas: &mut Canvas, view: &View, scene: &Scene) {
    let map = &scene.gallery.tree;
    let lattice = *map.store().lattice();
    let line = color::POSITIVE.mix(color::PAPER, 0.55);
    canvas.fill_rect(view.rect(), color::UNKNOWN);
    let frame = view.rect();
    map.store().for_each_leaf(|leaf| {
        let end = leaf.cell.map(|c| c + (1 << leaf.height));
        let low = view.pixel_from_world(lattice.corner(leaf.cell)).map(f64::round);
        let high = view.pixel_from_world(lattice.corner(end)).map(f64::round);
        let inside = |x: f64, y: f64| [x.clamp(frame.x, frame.right()), y.clamp(frame.y, frame.bottom())];
        let [x, y] = inside(low[0], high[1]);
        let [right, bottom] = inside(high[0], low[1]);
        let p = scene.gallery.tree.occupancy(lattice.center(leaf.cell)).unwrap_or(f64::NAN);
        canvas.fill_rect(PixelRect::new(x, y, right - x, bottom - y), color::occupancy(p));
        // Two sides of every leaf, one pixel wide: its neighbors bring the others.
        let side = if p > 0.5 { line.with_alpha(0.35) } else { line };
        canvas.fill_rect(PixelRect::new(x, y, 1.0, bottom - y), side);
        canvas.fill_rect(PixelRect::new(x, bottom - 1.0, right - x, 1.0), side);
    });
}

fn tsdf(canvas: &mut Canvas, view: &View, scene: &Scene) {
    tsdf_cells(canvas, view, scene);
    contour_lines(canvas, view, scene, 1.8);
    truth(canvas, view, scene, 1.2);
}

fn tsdf_cells(canvas: &mut Canvas, view: &View, scene: &Scene) {
    let map = &scene.gallery.tsdf;
    let truncation = map.config().truncation;
    cell_raster(canvas, view, map.grid(), |i| {
        let tone = color::signed_distance(f64::from(map.store().at(i)?.distance), truncation);
        Some(tone.with_alpha(TSDF_STRENGTH * f64::from(tone.a) / 255.0).over(color::PAPER))
    });
}

fn weight(canvas: &mut Canvas, view: &View, scene: &Scene) {
    let map = &scene.gallery.tsdf;
    let most = (0..map.grid().len()).filter_map(|i| map.store().at(i)).map(|c| c.weight).fold(1.0, f32::max);
    cell_raster(canvas, view, map.grid(), |i| {
        Some(color::sequential(f64::from(map.store().at(i)?.weight / most)))
    });
}

fn esdf(canvas: &mut Canvas, view: &View, scene: &Scene) {
    let field = scene.gallery.distance();
    pixel_raster(canvas, view, |p| {
        Some(color::signed_distance(field.distance(p).known()?, FAR).over(color::PAPER))
    });
    let grid = field.grid();
    let samples = field.samples();
    let most = samples.iter().filter(|d| !d.is_nan()).fold(0.0f32, |a, &d| a.max(d));
    for n in 1..=(f64::from(most) / RING) as usize {
        let level = (n as f64 * RING) as f32;
        let lifted: Vec<f32> = samples.iter().map(|d| d - level).collect();
        let rings = level_set(grid, &lifted, |i| !lifted[i].is_nan(), Ambiguity::Decide);
        for line in rings.polylines() {
            let mut points = line.vertices;
            if line.closed {
                points.extend(points.first().copied());
            }
            canvas.polyline(view, &points, Pen::new(color::INK.with_alpha(0.55), 1.1));
        }
    }
    contour_lines(canvas, view, scene, 1.8);
}

fn esdf_error(canvas: &mut Canvas, view: &View, scene: &Scene) {
    let field = scene.gallery.distance();
    cell_raster(canvas, view, field.grid(), |i| {
        let p = field.grid().lattice.center(field.grid().cell(i));
        let d = f64::from(field.samples()[i]);
        let truth = scene.world?.signed_distance(p);
        // Orange where the answer is too large, which a planner must fear; blue where it is too small.
        let error = color::signed_distance(truth - d, ERROR).over(color::PAPER);
        (d >= 0.0 && truth >= 0.0).then_some(error)
    });
    truth(canvas, view, scene, 1.0);
}

fn contour(canvas: &mut Canvas, view: &View, scene: &Scene) {
    truth(canvas, view, scene, 1.0);
    contour_lines(canvas, view, scene, 2.2);
}

fn cloud(canvas: &mut Canvas, view: &View, scene: &Scene) {
    canvas.dots(view, scene.gallery.cloud.points(), 0.7, color::MEASUREMENT.with_alpha(0.55));
}

fn close_up(canvas: &mut Canvas, view: &View, scene: &Scene) {
    tsdf_cells(canvas, view, scene);
    cell_lines(canvas, view, scene.gallery.tsdf.grid());
    canvas.dots(view, scene.gallery.cloud.points(), 1.8, color::MEASUREMENT.with_alpha(0.7));
    truth(canvas, view, scene, 2.0);
    contour_lines(canvas, view, scene, 3.0);
}

/// The true surfaces, dashed.
pub(super) fn truth(canvas: &mut Canvas, view: &View, scene: &Scene, width: f64) {
    let Some(world) = scene.world else { return };
    let segments: Vec<_> = world.boundary().iter().map(|s| [s.a, s.b]).collect();
    canvas.segments(view, &segments, Pen::new(color::TRUTH, width).dashed());
}

fn contour_lines(canvas: &mut Canvas, view: &View, scene: &Scene, width: f64) {
    let segments: Vec<_> = scene.gallery.contour.ends().collect();
    canvas.segments(view, &segments, Pen::new(color::SURFACE, width));
}

fn cell_lines(canvas: &mut Canvas, view: &View, grid: &Grid<2>) {
    let pen = Pen::new(color::PAPER.with_alpha(0.55), 1.0);
    let (low, high) = (grid.aabb().min, grid.aabb().max);
    let columns = (0..=grid.shape[0] as i32).map(|i| grid.lattice.corner([i, 0])[0]);
    let rows = (0..=grid.shape[1] as i32).map(|i| grid.lattice.corner([0, i])[1]);
    let lines: Vec<_> = columns
        .map(|x| [[x, low[1]], [x, high[1]]])
        .chain(rows.map(|y| [[low[0], y], [high[0], y]]))
        .collect();
    canvas.segments(view, &lines, pen);
}

/// One color per cell, by the cell's index; unknown where there is none, and around the cells.
fn cell_raster(canvas: &mut Canvas, view: &View, grid: &Grid<2>, tone: impl Fn(usize) -> Option<Color>) {
    let (origin, r) = (grid.lattice.origin, grid.lattice.resolution);
    canvas.fill_rect(view.rect(), color::UNKNOWN);
    let tone = |[x, y]: [usize; 2]| tone(y * grid.shape[0] + x).unwrap_or(color::UNKNOWN);
    canvas.raster(view, grid.shape, origin, r, tone);
}

/// One color per pixel, by its place in the world; unknown where there is none.
fn pixel_raster(canvas: &mut Canvas, view: &View, tone: impl Fn([f64; 2]) -> Option<Color>) {
    let (low, _) = view.world_box();
    let r = 1.0 / view.scale()[0];
    let shape = [view.rect().width, view.rect().height].map(|v| v.round() as usize);
    canvas.raster(view, shape, low, r, |c| {
        tone([0, 1].map(|k| low[k] + (c[k] as f64 + 0.5) * r)).unwrap_or(color::UNKNOWN)
    });
}
