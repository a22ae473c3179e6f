//! From odometry to the poses that the maps were made with.

use crate::poses::{CorrectionSettings, PoseErrors};
use portolan_sim::ErrorSummary;

use super::page::{figure, table};
use super::{Facts, Section};
use crate::experiment::{Drift, PoseSet};
use crate::pictures;

pub(super) fn section(facts: &Facts) -> Section {
    let drift = facts.drift;
    let noise = CorrectionSettings::default().odometry;
    let (candidates, refused) = drift.lap.rounds.last().map_or((0, 0), |r| (r.candidates, r.refused));
    let picture = figure(
        &pictures::drift(drift, &facts.scene),
        "full",
        "The lap by odometry and after the pose graph",
        "<b>Before and after.</b> The same scans and the same closures (purple), each panel at its own poses; the true way is \
         dashed. On the right both ways lie on each other.",
    );
    let body = format!(
        "<p>The text maps with the poses of its pose graph, and so does this page. The wheels measure each step with noise \
         (position {:.1} cm and heading {:.2}° after one metre, {:.2}° more after a turn of one radian) and with a bias that \
         no averaging removes: {:.0} % in length, {:.2}° in heading a metre. The errors add up along the lap, and the map \
         that is made with them has many a wall twice.</p>\
         <p>Every scan is then matched, point to line, to earlier ones near it, with the pose known so far as the first \
         guess. A match counts only where it is found from both sides and neither scan sees through the other's walls: of \
         {candidates} candidates in the last round {} were believed, {refused} refused. A pose graph of motions and closures \
         with a robust kernel gives the poses; then all of this is done once more, from the better poses. Closures that do not \
         agree with the final poses: {}.</p>{}{}\
         <p>Position and heading are compared with the simulator's without any alignment, since the lap starts at the true \
         pose. The contours of this table are made on a box with room around it, the same for all three sets; the set in bold \
         is the one that everything else on this page uses. The graph is out/pose_graph.g2o, with the optimised vertices.</p>{picture}",
        100.0 * noise.position_per_metre,
        noise.heading_per_metre.to_degrees(),
        noise.heading_per_radian.to_degrees(),
        100.0 * noise.scale_bias,
        noise.heading_bias_per_metre.to_degrees(),
        drift.lap.closures.len(),
        drift.disagreeing(),
        pose_sets(drift),
        lost(drift),
    );
    Section {
        title: "Where the poses come from, and what they cost the map",
        body,
        command: "portolan demo --out out   (other poses: --poses true, --poses odometry)",
    }
}

/// The table of the three sets of poses.
fn pose_sets(drift: &Drift) -> String {
    let errors = [None, Some(&drift.before), Some(&drift.after)];
    let contours = drift.contours.into_iter().zip(drift.contours_as_drawn);
    let sets = PoseSet::ALL.into_iter().zip(errors).zip(contours);
    let rows: Vec<_> =
        sets.map(|((set, errors), contour)| row(set, set == drift.chosen, errors, contour)).collect();
    let header = [
        "poses",
        "position, mean",
        "position, worst",
        "heading, rms",
        "contour off the walls, median",
        "95 %",
    ];
    table(&header, &rows, &[])
}

fn row(
    set: PoseSet,
    chosen: bool,
    errors: Option<&PoseErrors>,
    (contour, drawn): (Option<ErrorSummary>, Option<ErrorSummary>),
) -> Vec<String> {
    let name = match set {
        PoseSet::True => "the simulator's: true",
        PoseSet::Odometry => "odometry alone",
        PoseSet::Optimised => "odometry, closures, pose graph",
    };
    let name = if chosen { format!("<b>{name}</b>") } else { name.to_owned() };
    let mut cells = vec![name];
    cells.extend(match errors {
        Some(e) => [
            format!("{:.1} cm", 100.0 * e.translation.mean),
            format!("{:.1} cm", 100.0 * e.translation.max),
            format!("{:.2}°", e.rotation.rms.to_degrees()),
        ],
        None => ["0", "0", "0"].map(String::from),
    });
    let parts: [fn(&ErrorSummary) -> f64; 2] = [|e| e.median, |e| e.p95];
    cells.extend(parts.map(|part| match (contour, drawn) {
        (Some(e), Some(d)) => {
            format!("{:.1} mm<small>as drawn {:.1}</small>", 1e3 * part(&e), 1e3 * part(&d))
        }
        _ => "–".to_owned(),
    }));
    cells
}

/// What the corrected poses cost the map.
fn lost(drift: &Drift) -> String {
    match drift.contours {
        [Some(t), _, Some(o)] => format!(
            "<p>What the corrected poses cost the map: the contour lies {:.1} mm off the true walls in the median instead of \
             {:.1}, {:.1} mm instead of {:.1} for 95 of 100 of its vertices.</p>",
            1e3 * o.median,
            1e3 * t.median,
            1e3 * o.p95,
            1e3 * t.p95
        ),
        _ => String::new(),
    }
}
