//! How true the answers are.

use portolan_sim::ErrorSummary;

use super::page::{escaped, figure, table};
use super::{Facts, Section};
use crate::gallery::{Accuracy, Gallery};
use crate::pictures::{self, Layer, Scene};

/// A cell: the median over the turned worlds, with the world as it is drawn under it, where both were measured.
fn beside(gallery: &Gallery, tell: impl Fn(&Accuracy) -> Option<String>) -> String {
    let drawn = Accuracy::of(gallery);
    match (tell(&gallery.headline()), tell(&drawn)) {
        (Some(headline), Some(drawn)) if gallery.turned.is_some() => {
            format!("{headline}<small>as drawn {drawn}</small>")
        }
        (headline, _) => headline.unwrap_or_else(|| "–".into()),
    }
}

/// Median, p99, worst over, worst under in millimeters.
fn cells(gallery: &Gallery, of: impl Fn(&Accuracy) -> Option<ErrorSummary>) -> Vec<String> {
    let parts: [fn(&ErrorSummary) -> f64; 4] = [|e| e.median, |e| e.p99, |e| e.worst_over, |e| e.worst_under];
    let cell =
        |part: fn(&ErrorSummary) -> f64| beside(gallery, |a| of(a).map(|e| format!("{:.1}", 1e3 * part(&e))));
    parts.into_iter().map(cell).collect()
}

/// In which worlds the errors were measured.
fn worlds(gallery: &Gallery) -> String {
    let Some(turned) = &gallery.turned else { return String::new() };
    let angles: Vec<String> = turned.turns.iter().map(|t| format!("{}°", t.degrees)).collect();
    format!(
        "<p>The walls of this apartment lie on borders of cells, and that accident decides some errors. So each error here is \
         the median over {} worlds, turned by {} against the lattice and shifted by parts of a cell; under it stands the \
         world as it is drawn.</p>",
        angles.len(),
        angles.join(", ")
    )
}

pub(super) fn section(facts: &Facts) -> Option<Section> {
    facts.scene.world?;
    let gallery = facts.scene.gallery;
    let body = [
        worlds(gallery),
        distances(gallery),
        fields(gallery),
        surfaces(gallery),
        foretold(gallery),
        gradients(&facts.scene),
    ]
    .concat();
    Some(Section {
        title: "How true the answers are",
        body,
        command: "portolan demo --out out   (for machines: out/gallery.json)",
    })
}

fn distances(gallery: &Gallery) -> String {
    let header = ["answer", "median", "99 %", "worst, too large", "worst, too small"];
    let asked = gallery.rows.iter().enumerate().filter(|(_, r)| r.distance_error.is_some());
    let rows: Vec<_> = asked
        .map(|(i, r)| [vec![escaped(&r.name)], cells(gallery, |a| a.rows[i].distance_error)].concat())
        .collect();
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
        .enumerate()
        .map(|(k, field)| {
            let mut row = vec![field.name().to_owned()];
            row.extend(cells(gallery, |a| a.fields[k].against_contour));
            row.extend(cells(gallery, |a| a.fields[k].against_truth).into_iter().take(2));
            row.push(beside(gallery, |a| Some(format!("{:.3}", a.fields[k].gradient))));
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
        .enumerate()
        .filter(|(_, r)| r.surface_error.is_some())
        .map(|(i, r)| {
            let parts: [fn(&ErrorSummary) -> f64; 3] = [|e| e.median, |e| e.bias, |e| e.p99];
            let error = |part: fn(&ErrorSummary) -> f64| {
                beside(gallery, |a| a.rows[i].surface_error.map(|e| format!("{:.1}", 1e3 * part(&e))))
            };
            let mut row = vec![escaped(&r.name)];
            row.extend(parts.map(error));
            row.push(beside(gallery, |a| a.rows[i].occupancy_wrong.map(|w| format!("{:.2} %", 100.0 * w))));
            row
        })
        .collect();
    format!(
        "<p>Surfaces, and answers to \"is this point occupied?\" (millimetres; positive bias: in front of the true face; \
         wrong answers among points further than half a cell from any face):</p>{}\
         <p>As drawn, maps of bits stand a whole cell in front of the faces: the faces lie on the borders of cells, the noise of the range puts half of all end points into the cell in front, and one end point in a scan is \
         enough to count the cell as hit. A signed distance averages the noise instead.</p>\
         <p>The text asks the contour by its crossing number, which counts on closed outlines. Seen from its rooms a building \
         is none: of the outer walls only the inner faces were observed, and every count is off by one. Here the first segment \
         that a ray meets decides, by the side that it shows; through a gap in the contour it still sees the wrong wall.</p>\
         <p>Thin walls come out too thick. Each side's claim reaches the truncation deep and meets the other side's there, \
         where it is thinner than τ; walls between τ and 2 τ keep their faces. A smaller truncation is the remedy, as far as \
         the noise of the range allows.</p>",
        table(&header, &rows, &[])
    )
}

/// What maps say of ranges that they were not told; nothing where no scans were held out.
fn foretold(gallery: &Gallery) -> String {
    let header = ["representation", "within 10 cm", "median error, mm", "nats a beam"];
    let told: Vec<_> = gallery.rows.iter().filter_map(|row| Some((row, row.foretold?))).collect();
    let Some((_, first)) = told.first() else { return String::new() };
    let rows: Vec<_> = told
        .iter()
        .map(|(row, f)| {
            vec![
                escaped(&row.name),
                format!("{:.1} %", 100.0 * f.within_10_cm),
                format!("{:.1}", 1e3 * f.median_error),
                format!("{:.2}", f.log_density),
            ]
        })
        .collect();
    format!(
        "<p>A map is also a claim about what the sensor will read next. Every tenth scan, {} hits, was kept out of a second set \
         of maps, which foretell its ranges: hits per meter by their distribution along each beam, the others by the surface or \
         the first occupied cell that the beam meets, taken as the middle of a normal distribution of half a cell. All share \
         5 % of outliers.</p>{}",
        first.rays,
        table(&header, &rows, &[])
    )
}

fn gradients(scene: &Scene) -> String {
    let headline = scene.gallery.headline();
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
        headline.fields[0].gradient, headline.tsdf_gradient,
    )
}
