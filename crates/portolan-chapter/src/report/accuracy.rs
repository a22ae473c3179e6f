//! How true the answers are.

use portolan_sim::ErrorSummary;

use super::page::{escaped, figure, table};
use super::{Facts, Section};
use crate::gallery::Gallery;
use crate::pictures::{self, Layer, Scene};

/// Median, p99, worst over, worst under in millimeters.
fn cells(error: Option<ErrorSummary>) -> Vec<String> {
    let mm = |v: f64| format!("{:.1}", 1e3 * v);
    match error {
        Some(e) => vec![mm(e.median), mm(e.p99), mm(e.worst_over), mm(e.worst_under)],
        None => vec!["–".into(); 4],
    }
}

pub(super) fn section(facts: &Facts) -> Option<Section> {
    facts.scene.world?;
    let gallery = facts.scene.gallery;
    let body = [distances(gallery), fields(gallery), surfaces(gallery), gradients(&facts.scene)].concat();
    Some(Section {
        title: "How true the answers are",
        body,
        command: "portolan demo --out out   (for machines: out/gallery.json)",
    })
}

fn distances(gallery: &Gallery) -> String {
    let header = ["answer", "median", "99 %", "worst, too large", "worst, too small"];
    let asked = gallery.rows.iter().filter(|r| r.distance_error.is_some());
    let rows: Vec<_> = asked.map(|r| [vec![escaped(&r.name)], cells(r.distance_error)].concat()).collect();
    format!(
        "<p>The text has no such column, and it matters more than speed. Distances are asked at observed free points and \
         compared with the true world (millimetres):</p>{}\
         <p>Too large is the direction that hurts a robot. Where a surface was never seen no map can know of it, and all of \
         them overestimate there; that is in the column too.</p>",
        table(&header, &rows, &[])
    )
}

fn fields(gallery: &Gallery) -> String {
    let header =
        ["distances", "contour: median", "99 %", "too large", "too small", "world: median", "99 %", "‖∇d‖"];
    let rows: Vec<Vec<String>> = gallery
        .fields
        .iter()
        .map(|field| {
            let mut row = vec![field.name().to_owned()];
            row.extend(cells(field.against_contour));
            row.extend(cells(field.against_truth).into_iter().take(2));
            row.push(format!("{:.3}", field.gradient));
            row
        })
        .collect();
    format!(
        "<p>Three ways to make distances of one map, against the exact distance to the extracted contour and against the world \
         (millimetres). The accurate one measures to the contour's segments; what is left is the interpolation between cells. The \
         text's seeds take a cell's offset to the surface to be at right angles to the way there. A mask knows whole cells.</p>{}",
        table(&header, &rows, &[])
    )
}

fn surfaces(gallery: &Gallery) -> String {
    let header = ["surface from", "median", "bias", "99 %", "occupancy wrong"];
    let rows: Vec<_> = gallery
        .rows
        .iter()
        .filter(|r| r.surface_error.is_some())
        .map(|r| {
            let mut row = vec![escaped(&r.name)];
            row.extend(match r.surface_error {
                Some(e) => [e.median, e.bias, e.p99].map(|v| format!("{:.1}", 1e3 * v)),
                None => Default::default(),
            });
            row.push(r.occupancy_wrong.map_or("–".into(), |w| format!("{:.2} %", 100.0 * w)));
            row
        })
        .collect();
    format!(
        "<p>Surfaces, and answers to \"is this point occupied?\" (millimetres; positive bias: in front of the true face; \
         wrong answers among points further than half a cell from any face):</p>{}\
         <p>Maps of bits stand a whole cell in front of the faces here: the faces of this apartment lie on the borders of \
         cells, the noise of the range puts half of all end points into the cell in front, and one end point in a scan is \
         enough to count the cell as hit. A signed distance averages the noise instead.</p>\
         <p>The text asks the contour by its crossing number, which counts on closed outlines. Seen from its rooms a building \
         is none: of the outer walls only the inner faces were observed, and every count is off by one. Here the first segment \
         that a ray meets decides, by the side that it shows; through a gap in the contour it still sees the wrong wall.</p>\
         <p>Thin walls come out too thick. Each side's claim reaches the truncation deep and meets the other side's there: at \
         τ = 15 cm a wall of 10 cm comes out 11.1 cm thick, at τ = 30 cm 16.4 cm. Walls between τ and 2 τ keep their faces. A \
         smaller truncation is the remedy, as far as the noise of the range allows.</p>",
        table(&header, &rows, &[])
    )
}

fn gradients(scene: &Scene) -> String {
    let picture = figure(
        &pictures::figure(Layer::EsdfError, scene),
        "wide",
        "Error of the ESDF over the apartment",
        "<b>Where the ESDF errs.</b> Blue: the answer is too small, which is safe. Orange: too large, which is not. Full \
         colour is 10 cm; gray was not observed or lies inside.",
    );
    format!(
        "<p>A gradient of length one says \"this way is away from the obstacle\". Median ‖∇‖ at observed free points: \
         <b>{:.3}</b> for the ESDF, <b>{:.3}</b> for the raw TSDF, which is constant beyond 15 cm: a planner on it stands \
         still.</p>{picture}",
        scene.gallery.fields[0].gradient, scene.gallery.tsdf_gradient,
    )
}
