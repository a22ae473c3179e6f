//! Our numbers beside the text's, and why they differ.

use crate::gallery::{Cost, MeasuredField, Row};
use crate::pictures::Scene;
use portolan_sim::ErrorSummary;

use super::page::table;
use super::{Facts, Section};
use portolan_draw::{shown_bytes, shown_seconds};

const LANGUAGE: &str =
    "The text's times are those of a TypeScript port in a browser; here compiled code on one core.";
const BLOCKS: &str =
    "Compiled; evidence is gathered by blocks of 8 × 8 cells and applied once a scan, not cell by cell.";

/// What a thing is, the text's number, ours, and why they differ.
type Line = (&'static str, &'static str, String, &'static str);

/// The numbers of this run.
struct Ours<'a>(&'a Scene<'a>);

impl Ours<'_> {
    fn bytes(&self, name: &str) -> String {
        self.0.row(name).map_or("–".into(), |r| shown_bytes(r.memory_bytes as f64))
    }

    fn time(&self, name: &str, cost: fn(&Row) -> Option<Cost>) -> String {
        self.0.row(name).and_then(cost).map_or("–".into(), |c| shown_seconds(c.seconds))
    }

    fn note(&self, name: &str) -> String {
        self.0.row(name).map_or(String::new(), |r| r.note.clone())
    }

    /// The field by the text's method: seeds near the surface.
    fn seeded(&self) -> &MeasuredField {
        &self.0.gallery.fields[1]
    }
}

pub(super) fn section(facts: &Facts) -> Section {
    let ours = Ours(&facts.scene);
    let rows: Vec<Vec<String>> = costs(&ours)
        .into_iter()
        .chain(accuracy(&ours))
        .map(|(what, text, ours, why)| vec![what.into(), text.into(), ours, why.into()])
        .collect();
    let body = format!(
        "<p>The text's apartment is not published; ours has its area, its length of wall and its thickness of wall, and \
         other rooms. What depends on the code alone should agree or be better, what depends on the rooms can only be \
         alike.</p>{}",
        table(&["what", "text", "here", "why it differs"], &rows, &[3])
    );
    Section { title: "Against the text's numbers", body, command: "portolan demo --out out" }
}

/// What maps weigh and what scans and questions cost.
fn costs(ours: &Ours) -> Vec<Line> {
    let banded = ours.note("TSDF").split(',').next().unwrap_or_default().to_owned();
    vec![
        (
            "grid, memory",
            "43.2 kB",
            ours.bytes("occupancy grid"),
            "The same array; ours counts its header too.",
        ),
        ("grid, update", "2.03 ms", ours.time("occupancy grid", |r| r.update), BLOCKS),
        (
            "quadtree, memory",
            "239 kB",
            ours.bytes("quadtree, 6.25"),
            "Inner nodes only, 9 bytes for four children with their one-byte values; leaves have no slot of their own.",
        ),
        (
            "quadtree, nodes",
            "11,957",
            ours.note("quadtree, 6.25"),
            "Another apartment with the same length of walls: other furniture, other frontier between free and unknown.",
        ),
        ("quadtree, update", "0.45 ms", ours.time("quadtree, 6.25", |r| r.update), BLOCKS),
        ("TSDF, memory", "346 kB", ours.bytes("TSDF, f32"), "Two planes of f32; the same."),
        (
            "TSDF, update",
            "0.52 ms<small>0.11 without carving</small>",
            format!("{}<small>{banded}</small>", ours.time("TSDF, f32", |r| r.update)),
            "Compiled, and evaluated at cell centres; the text's march along beams is the row below.",
        ),
        (
            "TSDF by the text's march",
            "0.52 ms",
            ours.time("TSDF, the chapter", |r| r.update),
            "The same algorithm, compiled: two samples a cell on every beam.",
        ),
        ("ESDF, memory", "+173 kB", format!("+{}", ours.bytes("ESDF")), "One plane of f32; the same."),
        ("ESDF, rebuild", "13.4 ms", shown_seconds(ours.seeded().seconds), LANGUAGE),
        (
            "contour, segments",
            "2,236",
            ours.0.gallery.contour.segments.len().to_string(),
            "Another apartment: one segment for each square of four cells that the seen faces run through.",
        ),
        (
            "contour, memory",
            "35.8 kB",
            format!("+{}", ours.bytes("extracted contour")),
            "Vertices in f64 and shared, with indices; the text keeps four f32 a segment. Allocated bytes are counted.",
        ),
        ("contour, extraction", "15.5 ms", ours.time("extracted contour", |r| r.update), LANGUAGE),
        ("occupancy probe, grid", "317 ns", ours.time("occupancy grid", |r| r.occupancy), LANGUAGE),
        ("occupancy probe, quadtree", "429 ns", ours.time("quadtree, 6.25", |r| r.occupancy), LANGUAGE),
        ("occupancy probe, TSDF", "422 ns", ours.time("TSDF, f32", |r| r.occupancy), LANGUAGE),
        ("distance probe, ESDF", "254 ns", ours.time("ESDF", |r| r.distance), LANGUAGE),
        (
            "distance probe, grid",
            "15.9 µs",
            ours.time("occupancy grid", |r| r.distance),
            "The same ring search, compiled. Probes are spread over the whole box here.",
        ),
        (
            "distance probe, contour",
            "45 µs",
            ours.time("extracted contour", |r| r.distance),
            "The same brute force over all segments, a few more of them, compiled.",
        ),
    ]
}

/// How true the answers are.
fn accuracy(ours: &Ours) -> Vec<Line> {
    let headline = ours.0.gallery.headline();
    let cm = |e: Option<ErrorSummary>, of: fn(&ErrorSummary) -> f64| {
        e.map_or("–".into(), |e| format!("{:.1} cm", 100.0 * of(&e)))
    };
    // The field by the text's method.
    let field = headline.fields[1];
    let both = |of: fn(&ErrorSummary) -> f64| {
        format!(
            "{}<small>{} against the world</small>",
            cm(field.against_contour, of),
            cm(field.against_truth, of)
        )
    };
    vec![
        (
            "‖∇d‖, ESDF",
            "0.93",
            format!("{:.3}", field.gradient),
            "The exact derivative of the interpolant; the text takes central differences over two cells, which blunt ridges.",
        ),
        (
            "‖∇d‖, TSDF",
            "0.01",
            format!("{:.3}", headline.tsdf_gradient),
            "Beyond the truncation every cell holds the same constant; the median probe lies there.",
        ),
        (
            "ESDF error, median",
            "3.0 cm",
            both(|e| e.median),
            "The text's method, measured like there against the extracted contour. The seeding treats a cell's offset \
             to the surface as orthogonal to the way there, which makes distances too small.",
        ),
        (
            "ESDF error, 99 %",
            "7.5 cm",
            both(|e| e.p99),
            "As above, and the field's values are measured along beams: too large where a face was seen at a grazing angle.",
        ),
        (
            "ESDF error, worst",
            "28 cm<small>too small</small>",
            both(|e| e.worst_under),
            "The text's worst is a doorway's lip seen from one side only; which lips were, depends on the rooms and the way.",
        ),
        (
            "ESDF, worst too large",
            "&lt; 5 cm",
            both(|e| e.worst_over),
            "The text's bound does not hold here. A face that was seen at grazing angles only makes the field jump from one side of \
             the seeding band to the other between two cells: there is contour there, and no seed. Against the world, surfaces \
             that were never observed count too.",
        ),
    ]
}
