//! Writes two sample pictures, a chart and a sheet of maps, into the folder named as the argument.

use std::path::Path;

use portolan_draw::{Chart, Entry, Panels, Pen, Series, Swatch, color};

fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".to_owned());
    std::fs::write(Path::new(&folder).join("chart.png"), chart())?;
    std::fs::write(Path::new(&folder).join("maps.png"), maps())
}

fn chart() -> Vec<u8> {
    let curve = |rate: f64, floor: f64| (0..400).map(move |i| [i as f64, (-rate * i as f64).exp() + floor]);
    Chart::new("Residual per step")
        .subtitle(
            "Root mean square over the rays of each set; the band is one standard deviation of the noise.",
        )
        .x("step of gradient descent")
        .y("residual (m)")
        .log_y()
        .series(Series::line("training rays", curve(0.03, 0.02), color::POSITIVE))
        .series(Series::line("held-out rays", curve(0.01, 0.3), color::NEGATIVE).dashed())
        .band((0..400).map(|i| [i as f64, 0.015, 0.025]), "noise ± 1 sigma", color::TRUTH)
        .vertical(120.0, "shown on the left", color::SURFACE)
        .encode_png(900, 520)
}

/// A disc seen by several maps.
fn maps() -> Vec<u8> {
    let distance = |x: f64, y: f64| (x - 3.0).hypot(y - 2.0) - 1.2;
    let cell = |r: f64, c: [usize; 2]| distance((c[0] as f64 + 0.5) * r, (c[1] as f64 + 0.5) * r);
    let (mut canvas, views) = Panels::new("One disc, three maps")
        .subtitle("All views show the same 6 m x 4 m; colours as in the legend.")
        .columns(3)
        .panel("occupancy grid", ["43.2 kB · 2.03 ms / scan", "probe 317 ns"])
        .panel("signed distance, truncated", ["346 kB · 0.52 ms / scan", "probe 422 ns"])
        .panel("distance field", ["173 kB", "probe 254 ns"])
        .legend([
            Entry::new(Swatch::Area(color::POSITIVE), "free, positive"),
            Entry::new(Swatch::Area(color::NEGATIVE), "behind, negative"),
            Entry::new(Swatch::Area(color::UNKNOWN), "unknown"),
            Entry::new(Swatch::Line(Pen::new(color::SURFACE, 2.0)), "extracted surface"),
            Entry::new(Swatch::Line(Pen::new(color::TRUTH, 2.0).dashed()), "truth"),
            Entry::new(Swatch::Dot(color::MEASUREMENT), "measurement"),
        ])
        .layout([0.0, 0.0], [6.0, 4.0], 420.0);
    let circle = |radius: f64| -> Vec<[f64; 2]> {
        (0..=90)
            .map(|i| f64::from(i) * 0.0698)
            .map(|a| [3.0 + radius * a.cos(), 2.0 + radius * a.sin()])
            .collect()
    };
    canvas.raster(&views[0], [60, 40], [0.0, 0.0], 0.1, |c| {
        let d = cell(0.1, c);
        if d < -0.4 { color::UNKNOWN } else { color::occupancy(if d < 0.0 { 0.95 } else { 0.1 }) }
    });
    canvas.raster(&views[1], [120, 80], [0.0, 0.0], 0.05, |c| {
        let d = cell(0.05, c);
        if d.abs() > 0.3 { color::UNKNOWN } else { color::signed_distance(d, 0.3) }
    });
    canvas.raster(&views[2], [600, 400], [0.0, 0.0], 0.01, |c| color::signed_distance(cell(0.01, c), 1.5));
    let hits: Vec<_> = circle(1.21).into_iter().step_by(4).collect();
    for view in &views {
        canvas.dashed(view, &circle(1.2), color::TRUTH, 1.5);
    }
    canvas.polyline(&views[1], &circle(1.19), Pen::new(color::SURFACE, 2.0));
    canvas.dots(&views[0], &hits, 3.0, color::MEASUREMENT);
    canvas.arrow(&views[2], [0.6, 3.2], [1.8, 2.6], Pen::new(color::INK, 2.0));
    canvas.scale_bar(&views[2]);
    canvas.encode_png()
}
