//! The maps side by side.

use super::page::figure;
use super::{Facts, Section};
use crate::pictures::{self, Layer};

const LEGEND: &str = "<p class=legend>\
    <span><i style=\"background:#6e9fcf\"></i>positive: free</span><span><i style=\"background:#eaa262\"></i>negative: behind a \
    surface</span><span><i style=\"background:#dcd9d3\"></i>never observed</span><span><i style=\"background:#7a3e9d\"></i>extracted \
    contour</span><span><i style=\"background:#159a6c\"></i>measured</span><span><i style=\"background:repeating-linear-gradient(90deg,\
    #7c858e 0 4px,#fff 4px 7px)\"></i>truth</span></p>";

pub(super) fn section(facts: &Facts) -> Section {
    const SHOWN: [(Layer, &str, &str); 10] = [
        (
            Layer::Log,
            "The world and the lap.",
            "Walls, furniture and the chair (orange); the way of the robot and the beams of one scan.",
        ),
        (
            Layer::Grid,
            "Occupancy grid.",
            "One byte a cell. Free is the color of the page, occupied that of ink, gray was never observed; nothing else is stored.",
        ),
        (
            Layer::Tree,
            "Quadtree.",
            "The same answers; equal neighbours are merged. It refines along walls, and along the edge of the unknown.",
        ),
        (
            Layer::Tsdf,
            "Truncated signed distance.",
            "Maintained within 15 cm of a surface. Further away it is a constant, and a constant has no gradient.",
        ),
        (
            Layer::Weight,
            "Its weight.",
            "The information each cell has accumulated; what makes this a filter and not a picture.",
        ),
        (
            Layer::Esdf,
            "Euclidean signed distance.",
            "A ring every 25 cm: distance and direction to the nearest obstacle everywhere that was observed.",
        ),
        (
            Layer::Contour,
            "Extracted contour.",
            "Where the sign changes. It ends where nothing was observed instead of inventing geometry.",
        ),
        (
            Layer::Hits,
            "Hits per meter.",
            "The share of beams through each cell that end in it: the color of the page lets all pass. Thin things stay as the part that they stop.",
        ),
        (Layer::Cloud, "Point cloud.", "The log itself: every end point, free space nowhere."),
        (
            Layer::CloseUp,
            "The chair, enlarged.",
            "Cells are 5 cm; the contour finds the face within millimetres. The far side was never seen.",
        ),
    ];
    let figures: String = SHOWN
        .iter()
        .map(|(layer, name, words)| {
            let caption = format!("<b>{name}</b> {words}");
            figure(&pictures::figure(*layer, &facts.scene), "", name, &caption)
        })
        .collect();
    Section {
        title: "One lap, every representation",
        body: format!("{LEGEND}<div class=grid>{figures}</div>"),
        command: "portolan demo --out out   (all of them on one sheet: out/gallery.png)",
    }
}
