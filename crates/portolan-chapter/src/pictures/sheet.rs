//! All maps on one sheet, or one map on a picture of its own.

use crate::gallery::{Cost, Row};
use portolan_draw::{Canvas, Entry, Panels, Pen, PixelRect, Swatch, View, color, shown_bytes, shown_seconds};
use portolan_sim::ErrorSummary;

use super::{Layer, Scene};

/// Panels are about this wide (pixels); cells get whole pixels where that is possible.
const PANEL: f64 = 760.0;

/// Every representation of the log side by side, as PNG bytes.
pub fn sheet(scene: &Scene, title: &str, subtitle: &str) -> Vec<u8> {
    let layers = [
        Layer::Log,
        Layer::Grid,
        Layer::Tree,
        Layer::Tsdf,
        Layer::Weight,
        Layer::Esdf,
        Layer::Contour,
        Layer::Hits,
        Layer::Cloud,
        Layer::CloseUp,
    ];
    let mut panels = Panels::new(title).subtitle(subtitle).columns(5).large().legend(legend(scene));
    for layer in layers {
        panels = panels.panel(heading(layer, scene), lines(layer, scene));
    }
    let (width, height) = panel_size(scene);
    let (mut canvas, rects) = panels.layout_rects(width, height);
    for (layer, rect) in layers.into_iter().zip(rects) {
        draw(&mut canvas, layer, scene, rect);
    }
    canvas.encode_png()
}

/// One map alone, as PNG bytes.
pub fn figure(layer: Layer, scene: &Scene) -> Vec<u8> {
    let (width, height) = panel_size(scene);
    let mut canvas = Canvas::new(width as u32, height as u32);
    let all = canvas.bounds();
    draw(&mut canvas, layer, scene, all);
    canvas.encode_png()
}

fn draw(canvas: &mut Canvas, layer: Layer, scene: &Scene, rect: PixelRect) {
    let shown = layer.shown(scene);
    // Whole pixels: cells are squares of equal size.
    let rect = PixelRect::new(rect.x.round(), rect.y.round(), rect.width, rect.height);
    let view = View::fit(shown.min, shown.max, rect);
    layer.draw(canvas, &view, scene);
    // All others have the scale of the first.
    if matches!(layer, Layer::Log | Layer::CloseUp) {
        canvas.scale_bar(&view);
    }
}

fn panel_size(scene: &Scene) -> (f64, f64) {
    let r = scene.gallery.tsdf.config().resolution;
    let [width, height] = scene.shown().extent().map(|v| (v / r).round());
    let fitting = PANEL / width.max(1.0);
    let scale = if fitting >= 1.0 { fitting.floor() } else { fitting };
    ((width * scale).round(), (height * scale).round().clamp(0.2 * PANEL, 3.0 * PANEL))
}

fn heading(layer: Layer, scene: &Scene) -> &'static str {
    match layer {
        Layer::Log if scene.world.is_some() => "the world, the lap, one scan",
        Layer::Log => "the log: all end points, the way, one scan",
        Layer::Grid => "occupancy grid",
        Layer::Tree => "quadtree, every leaf",
        Layer::Tsdf if scene.world.is_some() => "TSDF, contour, truth",
        Layer::Tsdf => "TSDF, contour",
        Layer::Weight => "weight W of the TSDF",
        Layer::Esdf => "ESDF, a ring every 25 cm",
        Layer::EsdfError => "error of the ESDF",
        Layer::Contour => "extracted contour",
        Layer::Hits => "hits per meter: share of beams that end",
        Layer::Cloud => "point cloud",
        Layer::CloseUp if scene.world.is_some() => "the chair, enlarged: TSDF cells",
        Layer::CloseUp => "enlarged: TSDF cells",
    }
}

/// Memory and cost; the error where it is known.
fn lines(layer: Layer, scene: &Scene) -> [String; 2] {
    let of = |name: &str, more: fn(&Row) -> String| match scene.row(name) {
        Some(row) => [costs(row), more(row)],
        None => Default::default(),
    };
    match layer {
        Layer::Log => {
            let beams: usize = scene.log.iter().map(|(_, scan)| scan.len()).sum();
            let poses = scene.poses;
            [format!("{} scans, {beams} beams", scene.log.len()), format!("{poses}; beams of one scan")]
        }
        Layer::Grid => of("occupancy grid", |row| asked("occupancy probe", row.occupancy)),
        Layer::Tree => of("quadtree", |row| asked("occupancy probe", row.occupancy)),
        Layer::Tsdf => of("TSDF", |row| error("contour", row.surface_error)),
        Layer::Weight => {
            ["the filter's information per cell".into(), "dark: clamped at W_max; light: few scans".into()]
        }
        Layer::Esdf | Layer::EsdfError => of("ESDF", |row| {
            let error = error("distance", row.distance_error);
            format!("{}{}{error}", asked("probe", row.distance), if error.is_empty() { "" } else { ", " })
        }),
        Layer::Contour => of("extracted contour", |row| row.note.clone()),
        Layer::Hits => of("hits per meter", |row| {
            row.foretold.map_or(String::new(), |f| {
                format!(
                    "{:.1} % of ranges foretold within 10 cm, {:.2} nats",
                    100.0 * f.within_10_cm,
                    f.log_density
                )
            })
        }),
        Layer::Cloud => of("point cloud", |row| asked("distance probe", row.distance)),
        Layer::CloseUp => {
            let r = scene.gallery.tsdf.config().resolution;
            [format!("cells of {r} m hold the signed distance;"), "the wall is where its sign changes".into()]
        }
    }
}

fn costs(row: &Row) -> String {
    let plus = if row.derived { "+" } else { "" };
    let memory = format!("{plus}{}", shown_bytes(row.memory_bytes as f64));
    let Some(update) = row.update else { return memory };
    let per = if row.derived { "rebuild" } else { "scan" };
    format!("{memory}, {} / {per}", shown_seconds(update.seconds))
}

fn asked(what: &str, cost: Option<Cost>) -> String {
    match cost {
        Some(Cost { seconds, by: Some(by) }) => format!("{what} {} ({by})", shown_seconds(seconds)),
        Some(Cost { seconds, by: None }) => format!("{what} {}", shown_seconds(seconds)),
        None => String::new(),
    }
}

fn error(what: &str, error: Option<ErrorSummary>) -> String {
    error.map_or(String::new(), |e| format!("median {what} error {:.1} mm", 1e3 * e.median))
}

fn legend(scene: &Scene) -> Vec<Entry> {
    let mut entries = vec![
        Entry::new(Swatch::Area(color::occupancy(0.12)), "free"),
        Entry::new(Swatch::Area(color::OCCUPIED), "occupied"),
        Entry::new(Swatch::Area(color::UNKNOWN), "never observed"),
        Entry::new(Swatch::Area(color::POSITIVE.with_alpha(0.62).over(color::PAPER)), "distance above zero"),
        Entry::new(Swatch::Area(color::NEGATIVE.with_alpha(0.62).over(color::PAPER)), "below zero"),
        Entry::new(Swatch::Line(Pen::new(color::SURFACE, 3.0)), "extracted contour"),
        Entry::new(Swatch::Dot(color::MEASUREMENT), "measurement"),
        Entry::new(Swatch::Line(Pen::new(color::INK, 2.0)), "way of the robot"),
    ];
    if scene.world.is_some() {
        entries.push(Entry::new(Swatch::Line(Pen::new(color::TRUTH, 2.0).dashed()), "truth"));
    }
    entries
}
