//! Both fields at one point: of the Euclidean one exactly what `query` prints.

use portolan::Answer;
use portolan::field::{Esdf, UnknownSpace};
use portolan::map::Tsdf2;
use portolan_io::{AnswerRow, SigmaColumns, certified_reach, write_answer};
use serde_json::{Value, json};

use super::fields::{Fields, Sample, length};
use crate::engine::Refusal;
use crate::engine::fusion::Beside;

/// The answer for the page: numbers of both fields, and the row of `query`.
pub(super) fn answer(
    tsdf: &Tsdf2,
    beside: &Beside,
    fields: &Fields,
    p: [f64; 2],
    unknown: UnknownSpace,
) -> Result<Value, Refusal> {
    let row = row(tsdf, beside, &fields.euclidean, p, unknown);
    let mut line = Vec::new();
    write_answer(&mut line, &row, SigmaColumns::No).map_err(Refusal::new)?;
    let kept = fields.truncated(p);
    let sample = kept.value();
    Ok(json!({
        "at": p,
        "cell": tsdf.grid().lattice.cell_of(p),
        "row": String::from_utf8_lossy(&line).trim_end(),
        "euclidean": {
            "status": row.status.word(),
            "distance": row.distance,
            "gradient": row.gradient,
            "norm": length(row.gradient),
            "lower": row.lower,
            "upper": row.upper,
            "occupancy": row.occupancy,
        },
        // It certifies nothing: what it keeps is measured along beams, not to the nearest surface.
        "truncated": {
            "status": kept.status().word(),
            "distance": sample.map(|s| s.0),
            "gradient": sample.map(|s| s.1),
            "norm": length(sample.map(|s| s.1)),
        },
    }))
}

/// The row that `query` prints for a `map.portolan` of this map, with `--unknown` as given.
pub(super) fn row(
    tsdf: &Tsdf2,
    beside: &Beside,
    field: &Esdf<2>,
    p: [f64; 2],
    unknown: UnknownSpace,
) -> AnswerRow<2> {
    let mut row = AnswerRow::of(p, beside.occupancy(p), in_box(tsdf, field, p));
    row.certify(field, p, unknown, certified_reach(field));
    row
}

/// A 2-D map is a box: what lies outside does not depend on where something was seen.
fn in_box(tsdf: &Tsdf2, field: &Esdf<2>, p: [f64; 2]) -> Answer<Sample> {
    match field.distance_and_gradient(p) {
        _ if !tsdf.grid().aabb().contains(p) => Answer::Outside,
        Answer::Outside => Answer::Unknown,
        answer => answer,
    }
}
