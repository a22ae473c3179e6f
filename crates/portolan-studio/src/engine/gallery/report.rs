//! The numbers: meters, seconds, bytes; `null` where a representation cannot answer.

use portolan_chapter::gallery::{MeasuredField, Row, Winner};
use serde_json::{Value, json};

use super::built::Built;

/// Names by which rows are known, as they begin, and the panels that show them: the first of a panel is the one drawn.
const PANELS: [(&str, &str); 6] = [
    ("occupancy grid", "grid"),
    ("quadtree", "tree"),
    ("TSDF", "tsdf"),
    ("ESDF", "esdf"),
    ("extracted contour", "contour"),
    ("point cloud", "cloud"),
];

/// What was timed, and who wins.
pub(super) fn costs(built: &Built) -> Value {
    let m = &built.measured;
    let cloud = &m.cloud_crossover;
    let esdf = m.rows.iter().find(|r| panel(r) == Some("esdf")).and_then(|r| r.distance);
    json!({
        "rows": m.rows.iter().map(row).collect::<Vec<_>>(),
        "winners": m.winners.iter().map(|w| winner(w, &m.rows)).collect::<Vec<_>>(),
        "never_win": m.never_win,
        "cloud": { "points": cloud.points, "measured": cloud.measured, "esdf_seconds": esdf.map(|c| c.seconds) },
    })
}

/// What is no matter of time.
pub(super) fn constants(built: &Built) -> Value {
    let m = &built.measured;
    let [w, h] = built.settings.grid.aabb().extent();
    json!({
        "area": w * h,
        "surface": surface_length(built),
        "surface_known": built.settings.surface_length.is_some(),
        "trees": m.trees,
        "fields": m.fields.iter().map(field).collect::<Vec<_>>(),
        "tsdf_gradient": m.tsdf_gradient,
    })
}

/// The length of surface that the crossover's formula takes (meters).
pub(super) fn surface_length(built: &Built) -> f64 {
    built.settings.surface_length.unwrap_or_else(|| built.measured.contour.length())
}

fn panel(row: &Row) -> Option<&'static str> {
    PANELS.iter().find(|(name, _)| row.name.starts_with(name)).map(|(_, panel)| *panel)
}

fn row(row: &Row) -> Value {
    let mut told = json!(row);
    told["panel"] = json!(panel(row));
    told
}

/// The winner, those level with it, and how many times dearer each row is: `null` where it cannot answer, or where the
/// winner's answer costs nothing.
fn winner(winner: &Winner, rows: &[Row]) -> Value {
    let seconds = |row: &Row| winner.workload.cost(row).map(|c| c.seconds);
    let best = rows.get(winner.row).and_then(seconds).filter(|&s| s > 0.0);
    let times: Vec<_> = rows.iter().map(|row| Some(seconds(row)? / best?)).collect();
    json!({
        "workload": winner.workload.name(), "row": winner.row, "level": winner.level, "ahead": winner.ahead,
        "times": times,
    })
}

fn field(f: &MeasuredField) -> Value {
    json!({
        "name": f.name(), "seconds": f.seconds, "gradient": f.gradient,
        "against_contour": f.against_contour, "against_truth": f.against_truth,
    })
}
