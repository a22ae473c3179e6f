//! The lap as the wheels have it, and as the pose graph has it.

use portolan_draw::{Entry, Panels, Pen, Swatch, color};

use super::Scene;
use super::layers::truth;
use crate::experiment::{Drift, PoseSet};

/// Width of a panel (pixels).
const PANEL: f64 = 720.0;

/// Two panels: the same scans and the same closures over the true world, before and after, as PNG bytes.
pub fn drift(drift: &Drift, scene: &Scene) -> Vec<u8> {
    let told = |mean: f64, max: f64| {
        format!("position off by {:.0} mm on average, {:.0} at most", 1e3 * mean, 1e3 * max)
    };
    let (before, after) = (&drift.before.translation, &drift.after.translation);
    let degrees = |e: &crate::poses::PoseErrors| {
        format!("heading off by {:.2} degrees rms", e.rotation.rms.to_degrees())
    };
    let shown = scene.shown().union(drift.extent().grown(0.4));
    let (mut canvas, views) = Panels::new("Odometry, loop closures, pose graph")
        .subtitle(format!(
            "{} scans, {} closures found by matching scans. Each panel draws the same scans and closures at its own poses.",
            drift.truth.len(),
            drift.lap.closures.len()
        ))
        .columns(2)
        .large()
        .panel("what the wheels say", [told(before.mean, before.max), degrees(&drift.before)])
        .panel("after the pose graph", [told(after.mean, after.max), degrees(&drift.after)])
        .legend([
            Entry::new(Swatch::Line(Pen::new(color::TRUTH, 1.5).dashed()), "true walls"),
            Entry::new(Swatch::Line(Pen::new(color::INK, 1.5).dashed()), "true way"),
            Entry::new(Swatch::Line(Pen::new(color::NEGATIVE, 2.5)), "way by odometry"),
            Entry::new(Swatch::Line(Pen::new(color::POSITIVE, 2.5)), "way after optimisation"),
            Entry::new(Swatch::Line(Pen::new(color::SURFACE, 1.0)), "loop closure"),
            Entry::new(Swatch::Dot(color::MEASUREMENT), "end point of a beam"),
        ])
        .layout(shown.min, shown.max, PANEL);
    let sets = [(PoseSet::Odometry, color::NEGATIVE), (PoseSet::Optimised, color::POSITIVE)];
    for (view, (set, tone)) in views.iter().zip(sets) {
        let poses = drift.poses(set);
        let ends = drift.end_points(set, scene.log.iter().map(|(_, scan)| scan));
        canvas.dots(view, &ends, 0.7, color::MEASUREMENT.with_alpha(0.35));
        truth(&mut canvas, view, scene, 1.3);
        let at = |k: usize| poses[k].translation;
        let closures: Vec<_> = drift.lap.closures.iter().map(|c| [at(c.earlier), at(c.later)]).collect();
        canvas.segments(view, &closures, Pen::new(color::SURFACE.with_alpha(0.45), 1.0));
        let way = |set| drift.poses(set).iter().map(|p| p.translation).collect::<Vec<_>>();
        canvas.polyline(view, &way(set), Pen::new(tone, 2.6));
        canvas.polyline(view, &way(PoseSet::True), Pen::new(color::INK, 1.2).dashed());
        let start: Vec<_> = poses.iter().take(1).map(|p| p.translation).collect();
        canvas.dots(view, &start, 5.0, color::INK);
    }
    if let Some(view) = views.first() {
        canvas.scale_bar(view);
    }
    canvas.encode_png()
}
