//! `report.html`: the text's argument with the numbers of this run, in one file that needs nothing else.
//!
//! A report is a list of sections, each made by one function from the same [`Facts`]; a section that has nothing to
//! show is left out.

mod accuracy;
mod against_text;
mod costs;
mod drift;
mod ghost;
mod memory;
mod page;
mod pictures;

use crate::experiment::{Drift, Forgetting, PoseSet};
use crate::gallery::Workload;
use crate::pictures::Scene;

/// What the sections are made of.
pub struct Facts<'a> {
    /// Log and maps.
    pub scene: Scene<'a>,
    /// Where the poses come from.
    pub drift: &'a Drift,
    /// The moved chair; `None`: left out.
    pub forgetting: Option<&'a Forgetting>,
    /// Seconds that the whole run took up to here.
    pub seconds: f64,
    /// What should be known before the maps are trusted.
    pub warnings: Vec<String>,
}

/// A heading, its text in HTML, and the command that gives its numbers (after three blanks what is to be said of it).
struct Section {
    title: &'static str,
    body: String,
    command: &'static str,
}

/// The whole file.
pub fn html(facts: &Facts) -> String {
    let sections = [
        Some(pictures::section(facts)),
        Some(drift::section(facts)),
        Some(costs::table(facts)),
        Some(costs::winners(facts)),
        Some(memory::section(facts)),
        accuracy::section(facts),
        ghost::section(facts),
        Some(against_text::section(facts)),
    ];
    let sections: Vec<Section> = sections.into_iter().flatten().collect();
    page::page(&format!("{}{}", summary(facts), introduction(facts)), &sections)
}

/// What one should know who reads no further: who is cheapest, what it weighs, how true it is.
fn summary(facts: &Facts) -> String {
    let gallery = facts.scene.gallery;
    let first = |w: &crate::gallery::Winner| {
        let asked = match w.workload {
            Workload::Occupancy => "occupancy",
            Workload::Distance => "distances",
            Workload::Surface => "the surface",
        };
        format!("{asked}: {}", page::escaped(&gallery.rows[w.row].name))
    };
    let cheapest: Vec<_> = gallery.winners.iter().map(first).collect();
    let sizes = gallery.rows.iter().filter(|row| !row.derived).map(|row| row.memory_bytes as f64);
    let (least, most) = sizes.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
    let headline = gallery.headline();
    let error = headline.fields.first().and_then(|field| field.against_truth);
    let truth = error.map_or(String::new(), |e| {
        format!(
            "<li>Distances of the accurate field are within {:.1} mm of the true world in the median, within {:.0} mm in 99 of \
             100 places.</li>",
            1e3 * e.median,
            1e3 * e.p99
        )
    });
    format!(
        "<ul class=lead><li>No map is cheapest at everything. For {}.</li><li>The same scans weigh from {} to {}.</li>{truth}</ul>",
        cheapest.join("; for "),
        portolan_draw::shown_bytes(least),
        portolan_draw::shown_bytes(most),
    )
}

fn introduction(facts: &Facts) -> String {
    let gallery = facts.scene.gallery;
    let beams: usize = facts.scene.log.iter().map(|(_, scan)| scan.len()).sum();
    let [width, height] = gallery.tsdf.grid().shape;
    let warnings: String = facts.warnings.iter().map(|w| format!("<li>{}</li>", page::escaped(w))).collect();
    let warnings = if warnings.is_empty() { warnings } else { format!("<ul class=warn>{warnings}</ul>") };
    format!(
        "<p class=lead>A map is a decision about which question gets to be cheap. Here {scans} scans ({beams} beams) \
         of one lap through a simulated apartment of 12 m × 9 m, at {poses}, go into every representation at \
         once: {width} × {height} cells of 5 cm, truncation 15 cm, weights clamped at {clamp}. Then all of them are asked the \
         same three questions: <em>is this point occupied? how far is the nearest surface? where is the boundary?</em> \
         The simulator knows the truth, so each answer has an error beside its cost.</p>\
         <p>“The text” on this page is chapter 19, <em>Modern Map Representations</em>, of the online textbook <em>Probabilistic \
         Robotics</em>, with which this program began; its numbers stand beside ours at the end.</p>\
         <p>Every number of ours on this page was computed in {seconds:.1} s, on the machine that wrote it, by the command under \
         each section. Times vary from run to run by some ten percent; memory and errors do not.</p>{warnings}",
        scans = facts.scene.log.len(),
        poses = match facts.drift.chosen {
            PoseSet::True => "their true poses",
            PoseSet::Odometry => "the poses that the wheels lead to",
            PoseSet::Optimised => "the poses that a pose graph made of drifting odometry",
        },
        clamp = gallery.tsdf.config().w_max,
        seconds = facts.seconds,
    )
}
