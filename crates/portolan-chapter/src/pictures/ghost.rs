//! How the error of a moved chair's cells decays.

use crate::ghost::GhostRun;
use portolan_draw::{Canvas, Chart, Series, color};

use crate::experiment::Forgetting;

/// Width and height of the sheet (pixels).
const SHEET: [u32; 2] = [1240, 600];

/// Two charts, where the prediction holds and where it does not, as PNG bytes.
pub fn ghost(forgetting: &Forgetting) -> Vec<u8> {
    let [width, height] = SHEET;
    let mut canvas = Canvas::new(width, height);
    let halves = canvas.bounds().inset(22.0, 18.0, 26.0, 16.0).split(2, 1, 36.0);
    if let [left, right] = halves[..] {
        measured(forgetting).draw(&mut canvas, left);
        deviating(forgetting).draw(&mut canvas, right);
    }
    canvas.encode_png()
}

fn runs(forgetting: &Forgetting) -> impl Iterator<Item = (&GhostRun, portolan_draw::Color)> {
    const TONES: [portolan_draw::Color; 3] = [color::NEGATIVE, color::MEASUREMENT, color::POSITIVE];
    forgetting.ghost.per_w_max.iter().zip(TONES.into_iter().cycle())
}

fn chart(forgetting: &Forgetting, title: &str, subtitle: &str) -> Chart {
    Chart::new(title)
        .subtitle(subtitle)
        .x("re-observations since the chair moved")
        .log_x()
        .x_range(1.0, longest(forgetting))
        .y("error left")
        .y_range(0.0, 1.0)
        .horizontal(0.5, "half", color::MUTED)
}

/// Error left after `n` observations, for as long as the measured curve is shown.
fn prediction(half_life: f64, longest: f64) -> Vec<[f64; 2]> {
    let steps = 160;
    let at = |i: i32| longest.max(1.0).powf(f64::from(i) / f64::from(steps));
    (0..=steps).map(at).map(|n| [n, 0.5f64.powf(n / half_life)]).collect()
}

fn longest(forgetting: &Forgetting) -> f64 {
    let ends = forgetting.ghost.per_w_max.iter().filter_map(|r| r.saturated.curve.last());
    ends.map(|p| p[0]).fold(2.0, f64::max)
}

fn measured(forgetting: &Forgetting) -> Chart {
    let mut chart = chart(
        forgetting,
        "Saturated cells seen as free: the filter's own rate",
        "Median error of the cells, as a part of the error when the chair moved. Dots: half-lives.",
    );
    for (run, tone) in runs(forgetting).filter(|(r, _)| r.saturated.cells > 0) {
        let m = &run.saturated;
        let name = format!("W_max {}: {:.1}", run.w_max, m.half_life_measured);
        chart = chart.series(Series::line(name, m.curve.iter().copied(), tone).width(4.5));
    }
    for (n, (run, _)) in runs(forgetting).filter(|(r, _)| r.saturated.cells > 0).enumerate() {
        let m = &run.saturated;
        let end = m.curve.last().map_or(1.0, |p| p[0]);
        let name = if n == 0 { "prediction" } else { "" };
        chart = chart.series(
            Series::line(name, prediction(m.half_life_predicted, end), color::INK).dashed().width(1.5),
        );
    }
    for (run, tone) in runs(forgetting) {
        if run.saturated.half_life_measured.is_finite() {
            chart =
                chart.series(Series::scatter("", [[run.saturated.half_life_measured, 0.5]], tone).width(7.0));
        }
    }
    chart
}

fn deviating(forgetting: &Forgetting) -> Chart {
    let mut chart = chart(
        forgetting,
        "Cells that do not obey: tapered weights, or not yet clamped",
        "Tapered: seen from behind a surface at least once. Not yet clamped: the gain is higher than the clamp's.",
    );
    for (run, tone) in runs(forgetting) {
        let groups = [
            (&run.unclamped, "not yet clamped", tone.with_alpha(0.55), 2.0),
            (&run.tapered, "tapered", tone, 4.5),
        ];
        for (group, what, tone, width) in groups.into_iter().filter(|(group, ..)| group.cells > 0) {
            let name = format!("W_max {}, {what}", run.w_max);
            chart = chart.series(Series::line(name, group.curve.iter().copied(), tone).width(width));
        }
    }
    for (n, (run, _)) in runs(forgetting).filter(|(r, _)| r.saturated.cells > 0).enumerate() {
        let name = if n == 0 { "prediction" } else { "" };
        let curve = prediction(run.saturated.half_life_predicted, longest(forgetting));
        chart = chart.series(Series::line(name, curve, color::INK).dashed().width(1.5));
    }
    chart
}
