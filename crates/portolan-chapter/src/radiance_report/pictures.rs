//! What a run looks like.

use crate::radiance::{Experiment, Far, LineRay, Passage, Sample, render, transmittance as along_ray};
use portolan_draw::{
    Anchor, Canvas, Chart, Color, Entry, Font, Panels, Pen, PixelRect, Series, Swatch, View, color,
};

use super::document::thinned;
use super::{Comparison, Run, Seed, title};

const WIDTH: f64 = 940.0;

/// Density per bin, one panel per fit.
pub(super) fn density(comparison: &Comparison) -> Vec<u8> {
    let experiment = &comparison.experiment;
    let legend = [
        Entry::new(Swatch::Line(Pen::new(color::MUTED, 1.5).dashed()), "start"),
        Entry::new(Swatch::Area(color::SURFACE.with_alpha(0.45)), "fit"),
        Entry::new(Swatch::Area(color::TRUTH.with_alpha(0.16)), "solid bodies, in truth"),
    ];
    let note = "Volume density per bin of 10 cm. At 50 1/m a bin lets 0.7 % pass; below 0.1 1/m, 99 %.";
    panels(comparison, "Density", note, legend, 230.0, |canvas, run, rect| {
        let fit = run.outcome.fit.line();
        let steps = |density: &[f64]| -> Vec<[f64; 2]> {
            let edge = |i: usize| fit.origin + i as f64 * fit.resolution;
            let last = density.last().map(|d| [edge(density.len()), *d]);
            // Less than any tick shows is drawn at the floor.
            density
                .iter()
                .enumerate()
                .map(|(i, d)| [edge(i), *d])
                .chain(last)
                .map(|[x, d]| [x, d.max(0.011)])
                .collect()
        };
        let chart = line_chart(experiment, "position (m)")
            .y("density (1/m)")
            .log_y()
            .y_range(0.01, 200.0)
            .series(Series::filled("", steps(&fit.density), color::SURFACE))
            .series(Series::step("", steps(&run.outcome.start.density), color::MUTED).width(1.5).dashed());
        chart.draw(canvas, inner(rect));
    })
}

/// Transmittance along every training ray, one panel per fit.
pub(super) fn transmittance(comparison: &Comparison) -> Vec<u8> {
    let experiment = &comparison.experiment;
    let legend = [
        Entry::new(Swatch::Line(Pen::new(color::POSITIVE, 2.0)), "rays to the right"),
        Entry::new(Swatch::Line(Pen::new(color::NEGATIVE, 2.0)), "rays to the left"),
        Entry::new(Swatch::Dot(color::INK), "where a ray starts"),
        Entry::new(Swatch::Area(color::TRUTH.with_alpha(0.16)), "solid bodies, in truth"),
    ];
    let note = "Share of a ray's light that is left at each place. What no light reaches gets no gradient.";
    panels(comparison, "Transmittance of the training rays", note, legend, 230.0, |canvas, run, rect| {
        let line = run.outcome.fit.line();
        let mut chart = line_chart(experiment, "position (m)").y("light that is left").y_range(0.0, 1.06);
        let mut starts = Vec::new();
        for m in &run.outcome.training {
            let crossing = line.crossing(&m.ray);
            let sign = if m.ray.ascending { 1.0 } else { -1.0 };
            let edge = |i: usize| {
                let bin = crossing.bin(i.min(crossing.count.saturating_sub(1)));
                let near = line.centre(bin) - sign * 0.5 * line.resolution;
                let past = if i >= crossing.count { sign * line.resolution } else { 0.0 };
                if i == 0 { m.ray.origin } else { near + past }
            };
            let points: Vec<_> =
                along_ray(line, &m.ray).into_iter().enumerate().map(|(i, t)| [edge(i), t]).collect();
            chart = chart.series(Series::line("", points, way(&m.ray)).width(1.8));
            starts.push([m.ray.origin, 1.0]);
        }
        chart.series(Series::scatter("", starts, color::INK).width(3.5)).draw(canvas, inner(rect));
    })
}

/// Every ray with what was measured and what is rendered along it, one panel per fit.
pub(super) fn rays(comparison: &Comparison) -> Vec<u8> {
    let experiment = &comparison.experiment;
    let legend = [
        Entry::new(Swatch::Line(Pen::new(color::MEASUREMENT, 2.5)), "measured depth"),
        Entry::new(Swatch::Dot(color::SURFACE), "rendered depth"),
        Entry::new(Swatch::Line(Pen::new(color::SURFACE, 1.5).dashed()), "rendered minus measured"),
        Entry::new(Swatch::Area(color::TRUTH.with_alpha(0.35)), "solid bodies, in truth"),
        Entry::new(Swatch::Area(color::OCCUPIED.with_alpha(0.6)), "opacity of the fit, per bin"),
    ];
    let note = "Squares on the right: reflectance, measured and rendered. The last three rays were held out.";
    let count = experiment.scene.training.len() + experiment.scene.held_out.len();
    let height = 24.0 * (count + 2) as f64 + 30.0;
    panels(comparison, "Rays", note, legend, height, |canvas, run, rect| {
        draw_rays(canvas, experiment, run, rect);
    })
}

fn draw_rays(canvas: &mut Canvas, experiment: &Experiment, run: &Run, rect: PixelRect) {
    let outcome = &run.outcome;
    let small = Font::new(16);
    let rows = outcome.rays().count() as f64 + 1.0;
    let plot = rect.inset(104.0, 8.0, 78.0, 30.0);
    let (low, high) = (-1.5, experiment.scene.length + 1.5);
    let view = View::stretch([low, 0.0], [high, rows], plot);
    for body in &experiment.scene.bodies {
        canvas.rect(&view, [body.low, 0.0], [body.high, rows], Some(color::TRUTH.with_alpha(0.22)), None);
    }
    let line = outcome.fit.line();
    for bin in 0..line.bins() {
        let (from, to) = (line.centre(bin) - 0.5 * line.resolution, line.centre(bin) + 0.5 * line.resolution);
        let opacity = 1.0 - (-line.density[bin] * line.resolution).exp();
        let tone = color::OCCUPIED.with_alpha(opacity);
        canvas.rect(&view, [from, rows - 0.78], [to, rows - 0.22], Some(tone), None);
    }
    canvas.text([rect.x + 10.0, plot.y + 2.0], "field", small.color(color::MUTED), Anchor::Left);
    for (i, (m, held_out)) in outcome.rays().enumerate() {
        let y = rows - 1.5 - i as f64;
        let sign = if m.ray.ascending { 1.0 } else { -1.0 };
        let at = |depth: f64| (m.ray.origin + sign * depth).clamp(low + 0.05, high - 0.05);
        let rendered = outcome.fit.render(&m.ray);
        let (measured_x, rendered_x) = (at(m.depth), at(rendered.depth));
        canvas.arrow(&view, [m.ray.origin, y], [measured_x, y], Pen::new(color::MEASUREMENT, 2.5));
        canvas.dots(&view, &[[m.ray.origin, y]], 3.0, color::INK);
        canvas.dashed(&view, &[[measured_x, y], [rendered_x, y]], color::SURFACE, 1.5);
        canvas.dots(&view, &[[rendered_x, y]], 4.5, color::SURFACE);
        let [_, pixel_y] = view.pixel_from_world([0.0, y]);
        let (label, tone) = if held_out { ("held out", color::NEGATIVE) } else { ("training", color::MUTED) };
        canvas.text([rect.x + 10.0, pixel_y - 8.0], label, small.color(tone), Anchor::Left);
        for (slot, value) in [(0.0, m.reflectance), (1.0, rendered.color[0])] {
            let left = (plot.right() + 16.0 + 24.0 * slot).round();
            let square = PixelRect::new(left, pixel_y.round() - 8.0, 20.0, 16.0);
            canvas.fill_rect(square, color::OCCUPIED.mix(color::PAPER, value));
            canvas.stroke_rect(square, Pen::new(color::MUTED, 1.0));
        }
    }
    for metre in 0..=experiment.scene.length as usize {
        let [x, y] = view.pixel_from_world([metre as f64, 0.0]);
        canvas.pixel_line([x, y], [x, y + 4.0], Pen::new(color::MUTED, 1.0));
        canvas.text([x, y + 6.0], &format!("{metre} m"), small.color(color::MUTED), Anchor::Centre);
    }
}

/// Depth residuals of training and held-out rays per step, all fits in one chart.
pub(super) fn residuals(comparison: &Comparison) -> Vec<u8> {
    let Comparison { experiment, seed, runs, .. } = comparison;
    let mut chart = Chart::new(format!("Depth residual per step, {}", seed_name(*seed)))
        .subtitle("Root mean square over the rays of each set.")
        .x("step")
        .y("residual (m)")
        .log_x()
        .log_y();
    for (run, tone) in runs.iter().zip(color::SERIES) {
        let curve = &run.outcome.curve;
        // Step 0 has no place on a logarithmic axis: the axis counts the states from 1.
        let points = |of: fn(&crate::radiance::Progress) -> f64| -> Vec<[f64; 2]> {
            thinned(curve.len()).into_iter().map(|i| [(i + 1) as f64, of(&curve[i])]).collect()
        };
        let label = title(run.channels);
        chart = chart
            .series(Series::line(format!("{label}: training"), points(|p| p.training.depth), tone).width(1.6))
            .series(
                Series::line(format!("{label}: held out"), points(|p| p.held_out.depth), tone)
                    .width(2.4)
                    .dashed(),
            );
    }
    let noise = experiment.settings.noise.depth;
    chart.horizontal(noise, "noise of the sensor", color::TRUTH).encode_png(988, 560)
}

/// How far behind a wall its rendered depth lies, against the wall's opacity.
pub(super) fn bias(experiment: &Experiment) -> Vec<u8> {
    let far = Far { depth: experiment.settings.far.depth, ..Far::default() };
    let bias_at = |optical_depth: f64| {
        let sample = Sample { density: optical_depth / 0.1, length: 0.1, depth: 3.0, color: [0.0, 0.0] };
        render(&[sample], &far.background(), &mut [Passage::default()]).depth - 3.0
    };
    let curve = (0..=240).map(|i| f64::from(i) / 20.0).map(|x| [x, bias_at(x)]);
    let bias = bias_at(5.0);
    Chart::new("Bias of rendered depth against opacity")
        .subtitle(format!(
            "One bin at 3 m, far plane at {} m. At an optical depth of 5 the wall stops 99.3 % of the light and is rendered \
             {:.1} cm too far.",
            far.depth,
            100.0 * bias
        ))
        .x("optical depth of the bin (density x length)")
        .y("rendered depth - 3 m (m)")
        .log_y()
        .series(Series::line("", curve, color::POSITIVE))
        .series(Series::scatter(format!("the chapter's example: {:.3} m", 3.0 + bias), [[5.0, bias]], color::SURFACE).width(5.0))
        .encode_png(820, 460)
}

/// A sheet of one column with a heading per fit, and what `draw` makes of each, as PNG bytes.
fn panels<const N: usize>(
    comparison: &Comparison,
    what: &str,
    note: &str,
    legend: [Entry; N],
    height: f64,
    draw: impl Fn(&mut Canvas, &Run, PixelRect),
) -> Vec<u8> {
    let Comparison { experiment, seed, runs, .. } = comparison;
    let mut sheet = Panels::new(format!("{what}, {}, {} steps", seed_name(*seed), experiment.steps))
        .subtitle(note)
        .columns(1)
        .legend(legend);
    for run in runs {
        let last = run.outcome.last();
        let line = format!(
            "depth residual: training {:.3} m, held out {:.3} m (noise {} m)",
            last.training.depth, last.held_out.depth, experiment.settings.noise.depth
        );
        sheet = sheet.panel(format!("Fit to {}", title(run.channels)), [line]);
    }
    let (mut canvas, rects) = sheet.layout_rects(WIDTH, height);
    runs.iter().zip(rects).for_each(|(run, rect)| draw(&mut canvas, run, rect));
    canvas.encode_png()
}

fn seed_name(seed: Seed) -> String {
    seed.named.map_or_else(|| format!("seed {}", seed.value), |n| format!("seed {} ({})", n.seed, n.name))
}

/// A chart over the whole line with its bodies shaded.
fn line_chart(experiment: &Experiment, label: &str) -> Chart {
    let scene = &experiment.scene;
    let chart = Chart::new("").x(label).x_range(0.0, scene.length);
    scene.bodies.iter().fold(chart, |chart, body| chart.span(body.low, body.high, "", color::TRUTH))
}

fn way(ray: &LineRay) -> Color {
    if ray.ascending { color::POSITIVE } else { color::NEGATIVE }
}

/// Room between the frame of a panel and its chart.
fn inner(rect: PixelRect) -> PixelRect {
    rect.inset(8.0, 2.0, 16.0, 6.0)
}
